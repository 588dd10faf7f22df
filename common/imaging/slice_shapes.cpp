#include "common/imaging/slice_shapes.hpp"

#include <algorithm>
#include <cmath>

#include "common/imaging/resample.hpp"

namespace osteon::imaging {
namespace {

constexpr double kThick = 2.0;             // steps between slices, in pixels
constexpr double kFarthest_slices = 20.0;  // distances end there
constexpr double kUnits = 30000.0;         // of that distance
// So many steps between slices may the larger of two distances exceed the smaller one, if they lie on different sides.
constexpr double kBeyond_slices = 2.0;
constexpr double kBeyond = kBeyond_slices / kFarthest_slices * kUnits;
constexpr double kFar_mm = 1e9;
constexpr int kSweeps = 8;  // each of the four directions twice

// One slice of a field, and the distance of its pixels to the contour between inside and outside.
class SliceDistance {
 public:
  SliceDistance(int columns, int rows, double width_mm, double height_mm)
      : columns_(columns),
        rows_(rows),
        width_mm_(width_mm),
        height_mm_(height_mm),
        distance_mm_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
        fixed_(distance_mm_.size()) {}

  // Without a sign. `field` is inside at 0 and above.
  const std::vector<double>& measure(std::span<const double> field) {
    std::ranges::fill(distance_mm_, kFar_mm);
    fixed_.assign(fixed_.size(), false);
    bool any = false;
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) any = start(field, x, y) || any;
    for (int sweep = 0; any && sweep < kSweeps; ++sweep)
      for (int j = 0; j < rows_; ++j)
        for (int i = 0; i < columns_; ++i)
          spread((sweep & 1) == 0 ? i : columns_ - 1 - i, (sweep & 2) == 0 ? j : rows_ - 1 - j);
    return distance_mm_;
  }

 private:
  [[nodiscard]] std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] bool has(int x, int y) const { return x >= 0 && y >= 0 && x < columns_ && y < rows_; }

  // Pixels beside the contour: the distance to the straight line through the crossings along both axes.
  bool start(std::span<const double> field, int x, int y) {
    const double here = field[at(x, y)];
    const auto crossing = [&](int dx, int dy, double step_mm) {
      double nearest = kFar_mm;
      for (const int side : {-1, 1}) {
        if (!has(x + side * dx, y + side * dy)) continue;
        const double beside = field[at(x + side * dx, y + side * dy)];
        if ((here >= 0.0) != (beside >= 0.0)) nearest = std::min(nearest, step_mm * here / (here - beside));
      }
      return nearest;
    };
    const double along_x = crossing(1, 0, width_mm_), along_y = crossing(0, 1, height_mm_);
    if (along_x == kFar_mm && along_y == kFar_mm) return false;
    const double product = along_x * along_y;
    distance_mm_[at(x, y)] = product > 0.0 ? product / std::hypot(along_x, along_y) : 0.0;
    fixed_[at(x, y)] = true;
    return true;
  }

  // The upwind solution of |grad d| = 1 from the neighbours with the smaller distances (fast sweeping, Zhao 2005).
  void spread(int x, int y) {
    if (fixed_[at(x, y)]) return;
    const auto least = [&](int dx, int dy) {
      return std::min(has(x - dx, y - dy) ? distance_mm_[at(x - dx, y - dy)] : kFar_mm,
                      has(x + dx, y + dy) ? distance_mm_[at(x + dx, y + dy)] : kFar_mm);
    };
    const double a = least(1, 0), b = least(0, 1);
    double found = std::min(a + width_mm_, b + height_mm_);
    const double square = width_mm_ * width_mm_ + height_mm_ * height_mm_, apart = a - b;
    if (apart * apart < square && std::max(a, b) < found)
      found = (a * height_mm_ * height_mm_ + b * width_mm_ * width_mm_ +
               width_mm_ * height_mm_ * std::sqrt(square - apart * apart)) /
              square;
    distance_mm_[at(x, y)] = std::min(distance_mm_[at(x, y)], found);
  }

  int columns_, rows_;
  double width_mm_, height_mm_;
  std::vector<double> distance_mm_;
  std::vector<bool> fixed_;
};

// The slope of a cubic at a value, from the differences before and after it: their harmonic mean, or level at an
// extreme.
double limited_slope(double before, double after) {
  return before * after > 0.0 ? 2.0 * before * after / (before + after) : 0.0;
}

// Where bone ends between two slices, the next contour is far away or none. Its distance then is limited, so that the
// bone is closed by a dome.
void limit_beyond(double& b, double& c) {
  if ((b >= 0.0) == (c >= 0.0)) return;
  double &near = std::abs(b) < std::abs(c) ? b : c, &far = std::abs(b) < std::abs(c) ? c : b;
  far = std::copysign(std::min(std::abs(far), std::abs(near) + kBeyond), far);
}

// Between b and c, at a fraction of the way.
double cubic(double a, double b, double c, double d, double part) {
  limit_beyond(b, c);
  const double first = limited_slope(b - a, c - b), last = limited_slope(c - b, d - c);
  const double rest = 1.0 - part;
  return rest * rest * ((1.0 + 2.0 * part) * b + part * first) + part * part * ((3.0 - 2.0 * part) * c - rest * last);
}

}  // namespace

bool has_thick_slices(const HuVolume& volume) {
  return volume.spacing_mm.z() > kThick * std::max(volume.spacing_mm.x(), volume.spacing_mm.y());
}

SliceShapes::SliceShapes(const HuVolume& volume, BoneField field)
    : volume_(volume),
      field_(std::move(field)),
      unit_mm_(kFarthest_slices * volume.spacing_mm.z() / kUnits),
      distances_(volume.count()) {}

Result<SliceShapes> SliceShapes::make(const HuVolume& volume, const SparseMask& bones, const SurfaceLevel& level,
                                      const KeepGoing& keep_going) {
  auto field = BoneField::make(volume, bones, level, part(keep_going, 0.0, 0.1));
  if (!field) return tl::unexpected(field.error());
  SliceShapes shapes(volume, std::move(*field));
  const auto [columns, rows, slices] = volume.dims;
  const std::size_t area = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  SliceDistance distance(columns, rows, volume.spacing_mm.x(), volume.spacing_mm.y());
  std::vector<std::int16_t> hu(area);
  std::vector<double> above(area);
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(0.1 + 0.9 * slice / slices)) return stopped_while("measuring the shapes of the slices");
    shapes.field_.read({{0, 0, slice}, {columns - 1, rows - 1, slice}}, hu);
    for (std::size_t i = 0; i < area; ++i) above[i] = hu[i] - level.threshold_hu;
    const std::vector<double>& distance_mm = distance.measure(above);
    std::int16_t* to = shapes.distances_.data() + volume.index(0, 0, slice);
    // No voxel lies on the contour, so each has a side.
    for (std::size_t i = 0; i < area; ++i) {
      const double units = std::clamp(distance_mm[i] / shapes.unit_mm_, 1.0, kUnits);
      to[i] = static_cast<std::int16_t>(above[i] >= 0.0 ? std::lround(units) : -std::lround(units));
    }
  }
  return shapes;
}

Inside SliceShapes::inside(const CoordBox& box, double pitch_mm) const {
  return field_.inside(voxels_for(volume_, box, pitch_mm));
}

void SliceShapes::read(const CoordBox& box, double pitch_mm, std::span<float> out) const {
  const auto [columns, rows, slices] = volume_.dims;
  struct Between {
    int low, high;
    double part;
  };
  const auto between = [](double voxel, int count) {
    const double inside = std::clamp(voxel, 0.0, static_cast<double>(count - 1));
    const int low = std::min(static_cast<int>(inside), std::max(0, count - 2));
    return Between{low, std::min(low + 1, count - 1), inside - low};
  };
  std::size_t n = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = volume_.voxel(position_mm({x, y, z}, pitch_mm));
        const Between i = between(at.x(), columns), j = between(at.y(), rows), k = between(at.z(), slices);
        const auto in_slice = [&](int slice) {
          const std::int16_t* d = distances_.data();
          const auto row = [&](int r) {
            const double low = d[volume_.index(i.low, r, slice)], high = d[volume_.index(i.high, r, slice)];
            return low + (high - low) * i.part;
          };
          const double low = row(j.low), high = row(j.high);
          return low + (high - low) * j.part;
        };
        const double before = in_slice(std::max(k.low - 1, 0)), after = in_slice(std::min(k.high + 1, slices - 1));
        out[n++] = static_cast<float>(cubic(before, in_slice(k.low), in_slice(k.high), after, k.part));
      }
}

}  // namespace osteon::imaging
