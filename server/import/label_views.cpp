#include "server/import/label_views.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "common/imaging/voxel_mask.hpp"
#include "common/imaging/window_level.hpp"

namespace osteon::import {
namespace {

constexpr int kBrick = 8;           // voxels along an edge of the bricks that a ray may pass over
constexpr double kStep = 0.5;       // of a ray, in voxels along the smallest spacing
constexpr double kAmbient = 0.25;   // light that falls on every surface
constexpr double kAside = 0.45;     // how far the lamp is to the left of the eye and above it, over its distance
constexpr double kReach = 1.5;      // voxels around a point that decide how its surface is turned
constexpr int kMaskBorder = 5;      // voxels of a mask around its labels: a ray's end, the reach, and one more
constexpr int kOutline = 2;         // pixels
constexpr double kThrough = 0.55;   // part of a structure's colour where bone hides it
constexpr double kFarther = 0.35;   // how much darker the farthest surface is
constexpr double kLeastSpan = 1.0;  // mm: a box of one point has a frame, too

// Right and down in a picture of each view, and the direction in which the eye looks; LPS.
struct Axes {
  Vec3 right, down, forward;
};
Axes axes_of(View view) {
  switch (view) {
    case View::axial:
      return {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
    case View::coronal:
      return {Vec3::UnitX(), -Vec3::UnitZ(), Vec3::UnitY()};
    case View::sagittal:
      break;
  }
  return {Vec3::UnitY(), -Vec3::UnitZ(), -Vec3::UnitX()};
}

// The voxels around a position, with the weights of linear interpolation.
class Voxels {
 public:
  explicit Voxels(const LabelledVoxels& of) : of_(of), to_voxel_(of.geometry.axes_mm.inverse()) {}

  [[nodiscard]] Vec3 voxel(const Vec3& position_mm) const { return to_voxel_ * (position_mm - of_.geometry.origin_mm); }
  [[nodiscard]] Vec3 step(const Vec3& direction_mm) const { return to_voxel_ * direction_mm; }
  [[nodiscard]] const Eigen::Matrix3d& to_voxel() const { return to_voxel_; }

  // Calls with the index and the weight of each of the eight voxels that exists.
  template <class Call>
  void around(const Vec3& voxel, Call call) const {
    const Vec3 low = voxel.array().floor();
    const Vec3 part = voxel - low;
    const std::array<int, 3> first{static_cast<int>(low.x()), static_cast<int>(low.y()), static_cast<int>(low.z())};
    const std::array<int, 3>& dims = of_.geometry.dims;
    for (int corner = 0; corner < 8; ++corner) {
      std::array<int, 3> at{};
      double weight = 1.0;
      bool there = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int next = (corner >> axis) & 1;
        at[axis] = first[axis] + next;
        there = there && at[axis] >= 0 && at[axis] < dims[axis];
        const double f = part[static_cast<int>(axis)];
        weight *= next == 1 ? f : 1.0 - f;
      }
      if (there && weight > 0.0) call(index(at), weight);
    }
  }
  [[nodiscard]] std::size_t index(const std::array<int, 3>& at) const {
    const std::array<int, 3>& dims = of_.geometry.dims;
    return (static_cast<std::size_t>(at[2]) * static_cast<std::size_t>(dims[1]) + static_cast<std::size_t>(at[1])) *
               static_cast<std::size_t>(dims[0]) +
           static_cast<std::size_t>(at[0]);
  }

 private:
  const LabelledVoxels& of_;
  Eigen::Matrix3d to_voxel_;
};

// The label with most weight, 0 included; of equal ones the first. Few of eight voxels differ.
class Vote {
 public:
  void add(std::uint8_t label, double weight) {
    for (std::size_t i = 0; i < count_; ++i)
      if (labels_[i] == label) {
        weights_[i] += weight;
        return;
      }
    labels_[count_] = label;
    weights_[count_++] = weight;
  }
  [[nodiscard]] std::uint8_t winner() const {
    const auto end = weights_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto best = std::max_element(weights_.begin(), end);
    return best == end ? 0 : labels_[static_cast<std::size_t>(best - weights_.begin())];
  }

 private:
  std::array<std::uint8_t, 8> labels_{};
  std::array<double, 8> weights_{};
  std::size_t count_ = 0;
};

// Calls with the column, row, slice and value of every voxel that has a colour.
template <class Call>
void for_coloured(const LabelledVoxels& voxels, const LabelColours& colours, Call call) {
  const std::uint8_t* label = voxels.labels.data();
  const std::array<int, 3>& dims = voxels.geometry.dims;
  for (int slice = 0; slice < dims[2]; ++slice)
    for (int row = 0; row < dims[1]; ++row)
      for (int column = 0; column < dims[0]; ++column, ++label)
        if (*label != 0 && colours[*label]) call(column, row, slice);
}

// The surface that the rays of a picture meet.
class Surface {
 public:
  Surface(const LabelledVoxels& voxels, const LabelColours& colours) : of_(voxels), colours_(colours), voxels_(voxels) {
    first_ = voxels.geometry.dims;
    last_ = {-1, -1, -1};
    for_coloured(voxels, colours, [&](int column, int row, int slice) {
      const std::array<int, 3> at{column, row, slice};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        first_[axis] = std::min(first_[axis], at[axis]);
        last_[axis] = std::max(last_[axis], at[axis]);
      }
    });
    if (empty()) return;
    std::array<int, 3> dims{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      dims[axis] = last_[axis] - first_[axis] + 1 + 2 * kMaskBorder;
      bricks_[axis] = dims[axis] / kBrick + 1;
    }
    solid_ = imaging::VoxelMask(dims);
    near_ = imaging::VoxelMask(bricks_);
    for_coloured(voxels, colours, [&](int column, int row, int slice) {
      take({column - first_[0] + kMaskBorder, row - first_[1] + kMaskBorder, slice - first_[2] + kMaskBorder});
    });
  }
  [[nodiscard]] bool empty() const { return last_[0] < 0; }

  struct Hit {
    double depth_mm = std::numeric_limits<double>::infinity();
    std::uint8_t label = 0;
    Colour colour;  // with its light
  };
  // Along a line from `from_mm`; nothing behind it. `lamp`: the direction of the light.
  [[nodiscard]] std::optional<Hit> meet(const Vec3& from_mm, const Vec3& direction, const Vec3& lamp) const {
    if (empty()) return {};
    const Vec3 first(first_[0], first_[1], first_[2]), last(last_[0], last_[1], last_[2]);
    const Vec3 from = voxels_.voxel(from_mm), along = voxels_.step(direction);
    // The part of the line within the box of the labels.
    double begin = 0.0, end = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double low = first[axis] - 1.0, high = last[axis] + 1.0;
      if (std::abs(along[axis]) < 1e-12) {
        if (from[axis] < low || from[axis] > high) return {};
        continue;
      }
      const double a = (low - from[axis]) / along[axis], b = (high - from[axis]) / along[axis];
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    if (begin > end) return {};
    const double step_mm = kStep / along.cwiseAbs().maxCoeff();
    // In voxels of the mask.
    const Vec3 start = from - first + Vec3::Constant(kMaskBorder);
    double before = begin;
    for (double depth = begin; depth <= end; before = depth, depth += step_mm) {
      const Vec3 at = start + depth * along;
      if (!is_near(at)) {
        // The steps that stay in this brick meet nothing either.
        const double out_mm = way_out_mm(start, along, at);
        for (double next = depth + step_mm; next < out_mm; next += step_mm) depth = next;
        continue;
      }
      if (filled(at) < 0.5) continue;
      const Vec3 surface = start + edge(start, along, before, depth) * along;
      const std::uint8_t label = label_at(surface - Vec3::Constant(kMaskBorder) + first);
      return Hit{depth, label, mixed(kBlackInk, *colours_[label], light(surface, lamp))};
    }
    return {};
  }

 private:
  // A voxel of the mask.
  void take(const std::array<int, 3>& at) {
    solid_.at(at[0], at[1], at[2]) = 1;
    // It is one of the eight around every position less than a voxel away.
    for (int z = (at[2] - 1) / kBrick; z <= at[2] / kBrick; ++z)
      for (int y = (at[1] - 1) / kBrick; y <= at[1] / kBrick; ++y)
        for (int x = (at[0] - 1) / kBrick; x <= at[0] / kBrick; ++x) near_.at(x, y, z) = 1;
  }
  [[nodiscard]] bool is_near(const Vec3& at) const {
    return near_.at(static_cast<int>(at.x()) / kBrick, static_cast<int>(at.y()) / kBrick,
                    static_cast<int>(at.z()) / kBrick) != 0;
  }
  // How far along a line, in mm, the brick of one of its points ends.
  [[nodiscard]] static double way_out_mm(const Vec3& start, const Vec3& along, const Vec3& at) {
    constexpr double kShort_mm = 1e-6;  // rounding must not lead beyond it
    double out = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(along[axis]) < 1e-12) continue;
      const int brick = static_cast<int>(at[axis]) / kBrick + (along[axis] > 0.0 ? 1 : 0);
      out = std::min(out, (brick * kBrick - start[axis]) / along[axis]);
    }
    return out - kShort_mm;
  }
  // How much of the interpolated voxel has a colour, 0 to 1. The border keeps all eight voxels within the mask.
  [[nodiscard]] double filled(const Vec3& at) const {
    const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y()), z = static_cast<int>(at.z());
    const std::uint8_t* corner = solid_.values.data() + solid_.index(x, y, z);
    const std::ptrdiff_t row = solid_.dims[0], slice = row * solid_.dims[1];
    const double u = at.x() - x, v = at.y() - y, w = at.z() - z;
    const auto along_x = [u](const std::uint8_t* from) { return from[0] + u * (from[1] - from[0]); };
    const auto in_slice = [&](const std::uint8_t* from) {
      const double low = along_x(from);
      return low + v * (along_x(from + row) - low);
    };
    const double low = in_slice(corner);
    return low + w * (in_slice(corner + slice) - low);
  }
  // Where it is half full, by bisection.
  [[nodiscard]] double edge(const Vec3& from, const Vec3& along, double outside, double inside) const {
    for (int i = 0; i < 5; ++i) {
      const double middle = 0.5 * (outside + inside);
      (filled(from + middle * along) < 0.5 ? outside : inside) = middle;
    }
    return inside;
  }
  // Of a point that is at least half full.
  [[nodiscard]] std::uint8_t label_at(const Vec3& at) const {
    Vote vote;
    voxels_.around(at, [&](std::size_t i, double weight) {
      if (of_.labels[i] != 0 && colours_[of_.labels[i]]) vote.add(of_.labels[i], weight);
    });
    return vote.winner();
  }
  // 0 to 1. The bone is fuller on one side of a point of its surface; the other side is where the surface looks.
  [[nodiscard]] double light(const Vec3& at, const Vec3& lamp) const {
    Vec3 change = Vec3::Zero();
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const Vec3 to(x, y, z);
          if (x != 0 || y != 0 || z != 0) change += filled(at + kReach * to) / to.norm() * to;
        }
    const Vec3 normal = -(voxels_.to_voxel().transpose() * change);
    const double facing = normal.norm() > 1e-9 ? std::max(0.0, -normal.normalized().dot(lamp)) : 0.0;
    return kAmbient + (1.0 - kAmbient) * facing;
  }

  const LabelledVoxels& of_;
  const LabelColours& colours_;
  Voxels voxels_;
  std::array<int, 3> first_{}, last_{};  // box of the voxels with a colour
  imaging::VoxelMask solid_;             // 1 for these; their box and a border
  std::array<int, 3> bricks_{};
  imaging::VoxelMask near_;  // 1 for bricks of the mask near one of them
};

// 1, 2 or 5 times a power of ten, at most `most`.
double round_length(double most) {
  const double ten = std::pow(10.0, std::floor(std::log10(most)));
  for (const double factor : {5.0, 2.0})
    if (factor * ten <= most) return factor * ten;
  return ten;
}

}  // namespace

Colour palette_colour(int index) {
  static constexpr Colour kColours[] = {{230, 159, 0}, {86, 180, 233},  {0, 158, 115},   {240, 228, 66},
                                        {213, 94, 0},  {204, 121, 167}, {120, 200, 120}, {150, 130, 230}};
  return kColours[static_cast<std::size_t>(index) % std::size(kColours)];
}

Vec3 direction_of(View view) { return axes_of(view).forward; }

Box coloured_box(const LabelledVoxels& voxels, const LabelColours& colours) {
  Box box;
  const ScanGeometry& g = voxels.geometry;
  const Vec3 half = 0.5 * g.axes_mm.cwiseAbs().rowwise().sum();
  // The box of the voxels' coordinates is enough: its corners reach at least as far as the voxels.
  std::array<int, 3> first = g.dims, last{-1, -1, -1};
  for_coloured(voxels, colours, [&](int column, int row, int slice) {
    const std::array<int, 3> at{column, row, slice};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = std::min(first[axis], at[axis]);
      last[axis] = std::max(last[axis], at[axis]);
    }
  });
  if (last[0] < 0) return box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 voxel;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      voxel[axis] = ((corner >> axis) & 1) == 0 ? first[a] : last[a];
    }
    box.include(g.position_mm(voxel) - half);
    box.include(g.position_mm(voxel) + half);
  }
  return box;
}

Vec3 Frame::position_mm(double x, double y) const {
  const Axes axes = axes_of(view);
  const double middle = 0.5 * (pixels - 1);
  return centre_mm + pixel_mm * ((x - middle) * axes.right + (y - middle) * axes.down);
}

std::array<double, 2> Frame::pixel_of(const Vec3& position_mm) const {
  const Axes axes = axes_of(view);
  const Vec3 from = (position_mm - centre_mm) / pixel_mm;
  const double middle = 0.5 * (pixels - 1);
  return {middle + from.dot(axes.right), middle + from.dot(axes.down)};
}

Frame frame_around(const Box& box, View view, int pixels, int border) {
  const Axes axes = axes_of(view);
  const Vec3 size = box.size_mm();
  const double span = std::max({kLeastSpan, std::abs(size.dot(axes.right)), std::abs(size.dot(axes.down))});
  return {view, box.centre_mm(), span / (pixels - 2 * border), pixels};
}

void write_sides(Picture& picture, const Frame& frame) {
  const bool sagittal = frame.view == View::sagittal, axial = frame.view == View::axial;
  const int middle = frame.pixels / 2, last = frame.pixels - 18;
  picture.text(6, middle, sagittal ? "A" : "R", kWhiteInk, 2);
  picture.text(last, middle, sagittal ? "P" : "L", kWhiteInk, 2);
  picture.text(middle, 6, axial ? "A" : "H", kWhiteInk, 2);
  picture.text(middle, last - 2, axial ? "P" : "F", kWhiteInk, 2);
  const double length_mm = round_length(0.3 * frame.pixels * frame.pixel_mm);
  const int length = static_cast<int>(std::lround(length_mm / frame.pixel_mm));
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g mm", length_mm);
  picture.fill(8, frame.pixels - 8, length, 3, kWhiteInk);
  picture.text(8, frame.pixels - 26, text.data(), kWhiteInk, 2);
}

double fullest_plane_mm(const LabelledVoxels& voxels, const LabelColours& colours, View view) {
  const Vec3 direction = axes_of(view).forward.cwiseAbs();
  const ScanGeometry& g = voxels.geometry;
  const Box box = coloured_box(voxels, colours);
  if (box.empty()) return g.position_mm(0.5 * Vec3(g.dims[0] - 1, g.dims[1] - 1, g.dims[2] - 1)).dot(direction);
  // Bins as wide as the voxels that lie most across the plane, so that a plane of voxels falls into one bin.
  const Vec3 steps = g.axes_mm.transpose() * direction;
  const double bin_mm = steps.cwiseAbs().maxCoeff(), low = box.min_mm.dot(direction);
  std::vector<std::int64_t> counts(static_cast<std::size_t>(box.size_mm().dot(direction) / bin_mm) + 2, 0);
  const double start = g.origin_mm.dot(direction) - low;
  for_coloured(voxels, colours, [&](int column, int row, int slice) {
    ++counts[static_cast<std::size_t>((start + steps.dot(Vec3(column, row, slice))) / bin_mm)];
  });
  std::int64_t all = 0, before = 0, most = -1;
  for (const std::int64_t count : counts) all += count;
  std::size_t fullest = 0;
  for (std::size_t bin = 0; bin < counts.size(); ++bin) {
    const std::int64_t behind = all - before - counts[bin];
    if (counts[bin] > most && 4 * before <= 3 * all && 4 * behind <= 3 * all) most = counts[bin], fullest = bin;
    before += counts[bin];
  }
  return low + (static_cast<double>(fullest) + 0.5) * bin_mm;
}

Picture draw_plane(const LabelledVoxels& voxels, const LabelColours& colours, const Frame& frame) {
  const Voxels around(voxels);
  const int pixels = frame.pixels;
  Picture picture(pixels, pixels, kBlackInk);
  std::vector<std::uint8_t> labels(static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels));
  const auto label_at = [&](int x, int y) -> std::uint8_t& {
    return labels[static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels) + static_cast<std::size_t>(x)];
  };
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) {
      double hu = 0.0, there = 0.0;
      Vote vote;
      around.around(around.voxel(frame.position_mm(x, y)), [&](std::size_t i, double weight) {
        there += weight;
        if (!voxels.hu.empty()) hu += weight * voxels.hu[i];
        vote.add(voxels.labels[i], weight);
      });
      if (there < 0.5) continue;
      label_at(x, y) = vote.winner();
      const std::uint8_t grey = voxels.hu.empty() ? 0 : imaging::grey_of(hu / there, {});
      picture.set(x, y, {grey, grey, grey});
    }
  for (int y = 0; y < pixels; ++y)
    for (int x = 0; x < pixels; ++x) {
      const std::uint8_t label = label_at(x, y);
      if (label == 0 || !colours[label]) continue;
      const auto differs = [&](int to_x, int to_y) {
        return to_x < 0 || to_y < 0 || to_x >= pixels || to_y >= pixels || label_at(to_x, to_y) != label;
      };
      bool edge = false;
      for (int d = 1; d <= kOutline; ++d)
        edge = edge || differs(x - d, y) || differs(x + d, y) || differs(x, y - d) || differs(x, y + d);
      if (edge)
        picture.set(x, y, *colours[label]);
      else if (voxels.hu.empty())
        picture.set(x, y, mixed(kBlackInk, *colours[label], 0.4));
    }
  return picture;
}

Result<SurfacePicture> draw_surface(const LabelledVoxels& voxels, const LabelColours& colours,
                                    const LabelColours& within, const Frame& frame, const KeepGoing& keep_going) {
  const Surface bones(voxels, colours), structures(voxels, within);
  const ScanGeometry& g = voxels.geometry;
  const Axes axes = axes_of(frame.view);
  const Vec3 direction = axes.forward, lamp = (direction + kAside * (axes.right + axes.down)).normalized();
  // The eye is outside the scan, as far as its diagonal.
  const Vec3 diagonal = g.axes_mm * Vec3(g.dims[0], g.dims[1], g.dims[2]);
  const Vec3 middle = g.origin_mm + 0.5 * diagonal;
  const double reach_mm = diagonal.norm() + g.axes_mm.cwiseAbs().sum();
  const double back_mm = (frame.centre_mm - middle).dot(direction) + reach_mm;
  SurfacePicture drawn{Picture(frame.pixels, frame.pixels, kBlackInk), {}};
  std::vector<std::optional<Surface::Hit>> hits;
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0.0;
  for (int y = 0; y < frame.pixels; ++y) {
    if (!keep_going(static_cast<double>(y) / frame.pixels)) return stopped_while("drawing the bone");
    for (int x = 0; x < frame.pixels; ++x) {
      const Vec3 from = frame.position_mm(x, y) - back_mm * direction;
      std::optional<Surface::Hit> hit = bones.meet(from, direction, lamp);
      if (const auto structure = structures.meet(from, direction, lamp)) {
        if (!hit || structure->depth_mm <= hit->depth_mm)
          hit = structure;
        else
          hit->colour = mixed(hit->colour, structure->colour, kThrough);
      }
      if (hit) nearest = std::min(nearest, hit->depth_mm), farthest = std::max(farthest, hit->depth_mm);
      hits.push_back(hit);
      drawn.labels.push_back(hit ? hit->label : 0);
    }
  }
  // What is far is darker, so that the eye sees what lies before what.
  const double range = std::max(1e-9, farthest - nearest);
  for (int y = 0, i = 0; y < frame.pixels; ++y)
    for (int x = 0; x < frame.pixels; ++x, ++i)
      if (const auto& hit = hits[static_cast<std::size_t>(i)])
        drawn.picture.set(x, y, mixed(hit->colour, kBlackInk, kFarther * (hit->depth_mm - nearest) / range));
  return drawn;
}

}  // namespace osteon::import
