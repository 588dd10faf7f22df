#include "common/radiology/bone_hu.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/check.hpp"
#include "common/core/large_pages.hpp"

namespace osteon::radiology {
namespace {

constexpr std::int32_t kBrick = 8;

std::size_t samples_in(const CoordBox& box) {
  const Coord d = box.dims();
  return to_index(d.x) * to_index(d.y) * to_index(d.z);
}

std::uint16_t rounded_steps(double per_mm) {
  return static_cast<std::uint16_t>(std::min(per_mm / kStep_per_mm, kMostSteps - 0.5) + 0.5);
}

// The part of a sample's voxel that is solid, from the distance to the surface.
float solid_part(float distance_mm, float pitch_mm) { return std::clamp(0.5f - distance_mm / pitch_mm, 0.0f, 1.0f); }

CoordBox intersection(const CoordBox& a, const CoordBox& b) {
  return {{std::max(a.min.x, b.min.x), std::max(a.min.y, b.min.y), std::max(a.min.z, b.min.z)},
          {std::min(a.max.x, b.max.x), std::min(a.max.y, b.max.y), std::min(a.max.z, b.max.z)}};
}

CoordBox enclosing(const CoordBox& a, const CoordBox& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {{std::min(a.min.x, b.min.x), std::min(a.min.y, b.min.y), std::min(a.min.z, b.min.z)},
          {std::max(a.max.x, b.max.x), std::max(a.max.y, b.max.y), std::max(a.max.z, b.max.z)}};
}

// Calls with parts of the box, each within a cube of `side` samples that is aligned to it.
template <class Call>
void each_part(const CoordBox& box, std::int32_t side, Call call) {
  if (box.empty()) return;
  const Coord first = floor_to(box.min, side);
  for (std::int32_t x = first.x; x <= box.max.x; x += side)
    for (std::int32_t y = first.y; y <= box.max.y; y += side)
      for (std::int32_t z = first.z; z <= box.max.z; z += side)
        call(intersection(box, {{x, y, z}, {x + side - 1, y + side - 1, z + side - 1}}));
}

std::size_t parts_in(const CoordBox& box, std::int32_t side) {
  std::size_t parts = 0;
  each_part(box, side, [&](const CoordBox&) { ++parts; });
  return parts;
}

// Asks after each of some equal parts of long work whether to go on.
class Parts {
 public:
  Parts(const KeepGoing& keep_going, std::size_t count) : keep_going_(keep_going), count_(static_cast<double>(count)) {}
  void next() {
    done_ += 1.0;
    if (!stopped_ && keep_going_) stopped_ = !keep_going_(done_ / count_);
  }
  [[nodiscard]] bool stopped() const { return stopped_; }

 private:
  const KeepGoing& keep_going_;
  double count_, done_ = 0.0;
  bool stopped_ = false;
};

// Up to the faces of the outer voxels, half a voxel beyond their centres.
Box box_of_scan(const ScanGeometry& geometry) {
  Box box;
  for (int corner = 0; corner < 8; ++corner)
    box.include(geometry.position_mm(Vec3((corner & 1) != 0 ? geometry.dims[0] - 0.5 : -0.5,
                                          (corner & 2) != 0 ? geometry.dims[1] - 0.5 : -0.5,
                                          (corner & 4) != 0 ? geometry.dims[2] - 0.5 : -0.5)));
  return box;
}

// HU of a scan at a position in voxels. Air beyond half a voxel from the outer centres.
float scan_hu(const CaseScan& scan, const Vec3& voxel) {
  std::array<std::size_t, 3> cell{}, next{};
  std::array<float, 3> weight{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double at = voxel[static_cast<Eigen::Index>(axis)], last = scan.geometry.dims[axis] - 1;
    if (!(at >= -0.5 && at <= last + 0.5)) return kAir_hu;
    const double within = std::clamp(at, 0.0, last), low = std::min(std::floor(within), std::max(0.0, last - 1.0));
    cell[axis] = static_cast<std::size_t>(low);
    next[axis] = std::min(cell[axis] + 1, static_cast<std::size_t>(last));
    weight[axis] = static_cast<float>(within - low);
  }
  const auto columns = static_cast<std::size_t>(scan.geometry.dims[0]);
  const auto rows = static_cast<std::size_t>(scan.geometry.dims[1]);
  const auto along_row = [&](std::size_t row, std::size_t slice) {
    const std::int16_t* p = scan.hu.data() + (slice * rows + row) * columns;
    const float a = p[cell[0]], b = p[next[0]];
    return a + weight[0] * (b - a);
  };
  const auto in_slice = [&](std::size_t slice) {
    const float a = along_row(cell[1], slice), b = along_row(next[1], slice);
    return a + weight[1] * (b - a);
  };
  const float a = in_slice(cell[2]), b = in_slice(next[2]);
  return a + weight[2] * (b - a);
}

// Replaces the samples of a finer level along one axis by their means over voxels of level 0. A voxel reaches from half
// a pitch before its sample to half a pitch behind, so the first and the last of its 2^level + 1 samples count half.
void average_along(std::vector<float>& values, std::size_t outer, std::size_t fine, std::size_t inner, int level) {
  const std::size_t step = std::size_t{1} << level, coarse = (fine - 1) / step;
  const float share = 1.0f / static_cast<float>(step);
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t c = 0; c < coarse; ++c) {
      const float* from = values.data() + (o * fine + c * step) * inner;
      float* to = values.data() + (o * coarse + c) * inner;
      for (std::size_t i = 0; i < inner; ++i) {
        float sum = 0.5f * (from[i] + from[step * inner + i]);
        for (std::size_t k = 1; k < step; ++k) sum += from[k * inner + i];
        to[i] = sum * share;
      }
    }
}

void average(std::vector<float>& values, const CoordBox& box, const CoordBox& fine, int level) {
  if (level == 0) return;
  const Coord d = box.dims(), fd = fine.dims();
  average_along(values, 1, to_index(fd.x), to_index(fd.y) * to_index(fd.z), level);
  average_along(values, to_index(d.x), to_index(fd.y), to_index(fd.z), level);
  average_along(values, to_index(d.x) * to_index(d.y), to_index(fd.z), 1, level);
}

// Samples of `level` in the voxels of a box of samples of level 0.
CoordBox fine_box(const CoordBox& box, int level) {
  const std::int32_t fine = 1 << level, half = fine / 2;
  return CoordBox{fine * box.min, fine * box.max}.grown(half);
}

// Samples of level 0 whose voxels meet what a leaf determines. A coarser level is interpolated between its samples.
CoordBox voxels_of(Coord leaf, int leaf_level, int level) {
  const std::int32_t last = kLeafSize - 1;
  CoordBox fine{leaf, leaf + Coord{last, last, last}};
  if (leaf_level <= level) {
    const std::int32_t scale = 1 << (level - leaf_level);
    fine = CoordBox{scale * fine.min, scale * fine.max}.grown(scale - 1);
  } else {
    fine = {shift_down(fine.min, leaf_level - level), shift_down(fine.max, leaf_level - level) + Coord{1, 1, 1}};
  }
  const CoordBox reached = fine.grown((1 << level) / 2);
  const std::int32_t up = (1 << level) - 1;
  return {shift_down(reached.min + Coord{up, up, up}, level), shift_down(reached.max, level)};
}

// From this part of a box on, the whole box is renewed at once: each sample is then gathered once.
constexpr double kDense = 0.2;
constexpr std::int32_t kPartSide = 16;

}  // namespace

BoneHu::BoneHu(Case bone, const CoordBox& box)
    : bone_(std::move(bone)), box_(box), dims_(box.grown(1).dims()), level_(finest_level(bone_.pitch_mm())) {
  const auto bricks = [](std::int32_t samples) { return (samples - 2) / kBrick + 1; };
  bricks_ = {bricks(dims_.x), bricks(dims_.y), bricks(dims_.z)};
  const std::size_t count = to_index(dims_.x) * to_index(dims_.y) * to_index(dims_.z) + 1;
  uncut_ = zeros<std::uint16_t>(count);
  occupied_.assign(to_index(bricks_.x) * to_index(bricks_.y) * to_index(bricks_.z), 0);
}

Result<BoneHu> BoneHu::make(const Case& bone, const CaseScan* scan, const KeepGoing& keep_going) {
  CoordBox box = bone.bounds_samples();
  if (scan) {
    const ScanGeometry& geometry = scan->geometry;
    if (scan->hu.empty() || scan->hu.size() != geometry.count())
      return bad_input("the scan of the case has no HU; import the case again from its CT");
    box = enclosing(box, covering_samples(box_of_scan(geometry), bone.pitch_mm()));
  }
  const Coord dims = box.grown(1).dims();
  if (static_cast<double>(dims.x) * dims.y * dims.z > static_cast<double>(kMostHuSamples))
    return failure(ErrorCode::exhausted,
                   "the bone has too many samples for slices and radiographs; import it with a "
                   "coarser --pitch");
  BoneHu made(bone, box);
  const bool whole = scan ? made.fill_from_scan(*scan, keep_going) : made.fill_from_density(keep_going);
  if (!whole) return stopped_while("preparing slices and radiographs");
  made.fill_metal();
  made.steps_ = made.uncut_;
  made.note_occupied(box);
  return made;
}

bool BoneHu::fill_from_density(const KeepGoing& keep_going) {
  const DensityCalibration given = bone_.info().calibration;
  const DensityCalibration line = given.slope_g_cm3_per_hu > 0.0 ? given : kDefaultLine;
  const auto slope = static_cast<float>(line.slope_g_cm3_per_hu);
  const auto intercept = static_cast<float>(line.intercept_g_cm3), pitch = static_cast<float>(pitch_mm());
  std::vector<float> surface, density;
  Parts parts(keep_going, parts_in(box_, 4 * kPartSide));
  each_part(box_, 4 * kPartSide, [&](const CoordBox& part) {
    if (parts.stopped()) return;
    surface.resize(samples_in(part));
    density.resize(samples_in(part));
    bone_.gather_surface(part, surface);
    bone_.gather_density(part, density);
    std::size_t i = 0;
    for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
      for (std::int32_t y = part.min.y; y <= part.max.y; ++y) {
        std::uint16_t* to = uncut_.data() + index({x, y, part.min.z});
        for (std::int32_t z = part.min.z; z <= part.max.z; ++z, ++i, ++to)
          *to = rounded_steps(static_cast<double>(solid_part(surface[i], pitch)) *
                              radiology::attenuation_per_mm(static_cast<double>((density[i] - intercept) / slope)));
      }
    parts.next();
  });
  return !parts.stopped();
}

bool BoneHu::fill_from_scan(const CaseScan& scan, const KeepGoing& keep_going) {
  from_scan_ = true;
  const Eigen::Matrix3d to_voxels = scan.geometry.axes_mm.inverse();
  Parts planes(keep_going, to_index(box_.dims().x));
  for (std::int32_t x = box_.min.x; x <= box_.max.x && !planes.stopped(); ++x) {
    for (std::int32_t y = box_.min.y; y <= box_.max.y; ++y) {
      std::uint16_t* to = uncut_.data() + index({x, y, box_.min.z});
      for (std::int32_t z = box_.min.z; z <= box_.max.z; ++z, ++to) {
        const Vec3 voxel = to_voxels * (position_mm({x, y, z}, pitch_mm()) - scan.geometry.origin_mm);
        *to = rounded_steps(radiology::attenuation_per_mm(static_cast<double>(scan_hu(scan, voxel))));
      }
    }
    planes.next();
  }
  return !planes.stopped();
}

// Neither density, which ends at compact bone, nor the HU of most scanners tell how dense metal is. Only samples within
// the surface are labelled. So a sample of the skin is metal if one beside it is.
void BoneHu::fill_metal() {
  std::vector<float> surface;
  const auto is_metal = [&](Coord sample, float distance_mm) {
    if (distance_mm < 0.0f) return bone_.tissue(sample) == Tissue::metal;
    bool any = false;
    for (std::int32_t n = 0; n < 27; ++n)
      any |= bone_.tissue(sample + Coord{n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1}) == Tissue::metal;
    return any;
  };
  for (const Coord leaf : bone_.metal_leaves()) {
    const std::int32_t last = kLeafSize - 1;
    // The skin may be in the next leaf. A sample that two leaves reach is filled twice, with the same value.
    const CoordBox part = intersection(CoordBox{leaf, leaf + Coord{last, last, last}}.grown(1), box_);
    if (part.empty()) continue;
    surface.resize(samples_in(part));
    bone_.gather_surface(part, surface);
    std::size_t i = 0;
    for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
      for (std::int32_t y = part.min.y; y <= part.max.y; ++y) {
        std::uint16_t* to = uncut_.data() + index({x, y, part.min.z});
        for (std::int32_t z = part.min.z; z <= part.max.z; ++z, ++i, ++to) {
          const double solid = static_cast<double>(solid_part(surface[i], static_cast<float>(pitch_mm())));
          if (solid > 0.0 && is_metal({x, y, z}, surface[i])) *to = std::max(*to, rounded_steps(solid * kMetal_per_mm));
        }
      }
  }
}

std::size_t BoneHu::index(Coord sample) const {
  const Coord at = sample - box_.min + Coord{1, 1, 1};
  return (to_index(at.x) * to_index(dims_.y) + to_index(at.y)) * to_index(dims_.z) + to_index(at.z);
}

float BoneHu::hu(Coord sample) const {
  return box_.contains(sample) ? hu_of_steps(static_cast<float>(steps_[index(sample)])) : kAir_hu;
}

double BoneHu::attenuation_per_mm(Coord sample) const {
  return box_.contains(sample) ? kStep_per_mm * steps_[index(sample)] : 0.0;
}

HuLattice BoneHu::lattice() const { return {steps_.data(), dims_, occupied_.data(), bricks_}; }

Vec3 BoneHu::in_lattice(const Vec3& point_mm) const {
  return point_mm / pitch_mm() - Vec3(box_.min.x - 1, box_.min.y - 1, box_.min.z - 1);
}

std::size_t BoneHu::memory_bytes() const {
  return (uncut_.size() + steps_.size()) * sizeof(std::uint16_t) + occupied_.size();
}

bool BoneHu::any_cut(std::span<const CutField* const> bodies, const CoordBox& box) const {
  for (const CutField* body : bodies)
    for (int level = 0; level < kLevels; ++level) {
      // One sample more on each side, because coarser levels are interpolated between their samples.
      const std::int32_t fine = 1 << level;
      if (body->has_cuts(level, CoordBox{fine * box.min, fine * box.max}.grown(fine))) return true;
    }
  return false;
}

void BoneHu::restore(const CoordBox& box) {
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y) {
      const auto first = static_cast<std::ptrdiff_t>(index({x, y, box.min.z}));
      std::copy_n(uncut_.begin() + first, box.dims().z, steps_.begin() + first);
    }
}

// Bone and what is left of it are the solid fractions of S and of f, as in removed_mm3(). Both come from the same
// samples, so they are equal to the last bit where nothing was cut.
void BoneHu::cut(std::span<const CutField* const> bodies, const CoordBox& box) {
  static thread_local GatherScratch scratch;
  static thread_local std::vector<float> bone, left, other;
  const CoordBox fine = fine_box(box, level_);
  for (std::vector<float>* values : {&bone, &left, &other}) values->resize(samples_in(fine));
  bodies.front()->gather_surface(level_, fine, bone, scratch);
  bodies.front()->gather_solid(level_, fine, left, scratch);
  for (const CutField* body : bodies.subspan(1)) {
    body->gather_solid(level_, fine, other, scratch);
    std::ranges::transform(left, other, left.begin(), [](float a, float b) { return std::min(a, b); });
  }
  const auto pitch = static_cast<float>(level_pitch_mm(pitch_mm(), level_));
  for (std::vector<float>* values : {&bone, &left}) {
    for (float& value : *values) value = solid_part(value, pitch);
    average(*values, box, fine, level_);
  }
  std::size_t i = 0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y) {
      std::size_t at = index({x, y, box.min.z});
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z, ++i, ++at) {
        // Beside the bone of a voxel, a scan shows soft tissue, which stays. Density has only air there.
        const float kept = from_scan_ ? 1.0f - (bone[i] - left[i]) : bone[i] > 0.0f ? left[i] / bone[i] : 1.0f;
        steps_[at] = static_cast<std::uint16_t>(static_cast<float>(uncut_[at]) * kept + 0.5f);
      }
    }
}

// Returns the box of samples that have another value now.
CoordBox BoneHu::renew_box(std::span<const CutField* const> bodies, const CoordBox& box) {
  static thread_local std::vector<std::uint16_t> before;
  const auto row = to_index(box.dims().z);
  before.clear();
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y) {
      const std::uint16_t* first = steps_.data() + index({x, y, box.min.z});
      before.insert(before.end(), first, first + row);
    }
  if (any_cut(bodies, box))
    cut(bodies, box);
  else
    restore(box);
  CoordBox changed;
  std::size_t i = 0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y) {
      const std::uint16_t* now = steps_.data() + index({x, y, box.min.z});
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z, ++i, ++now)
        if (*now != before[i]) changed = enclosing(changed, {{x, y, z}, {x, y, z}});
    }
  return changed;
}

// Returns whether a body that was there the last time is not any more.
bool BoneHu::note_bodies(std::span<const CutField* const> bodies) {
  const bool gone = std::ranges::any_of(seen_, [&](BodyId id) {
    return std::ranges::none_of(bodies, [&](const CutField* body) { return body->body() == id; });
  });
  seen_.clear();
  for (const CutField* body : bodies) seen_.push_back(body->body());
  return gone;
}

Result<void> BoneHu::renew(std::span<const CutField* const> bodies, const KeepGoing& keep_going) {
  OSTEON_CHECK(!bodies.empty());
  note_bodies(bodies);
  Parts parts(keep_going, parts_in(box_, kPartSide));
  each_part(box_, kPartSide, [&](const CoordBox& part) {
    if (parts.stopped()) return;
    renew_box(bodies, part);
    parts.next();
  });
  note_occupied(box_);
  if (parts.stopped()) return stopped_while("renewing slices and radiographs");
  return {};
}

std::vector<CoordBox> BoneHu::update(std::span<const CutField* const> bodies, std::span<const ChangedLeaves> changes) {
  OSTEON_CHECK(!bodies.empty());
  std::vector<CoordBox> changed;
  const auto renew_part = [&](const CoordBox& part) {
    const CoordBox found = renew_box(bodies, part);
    if (found.empty()) return;
    note_occupied(found);
    changed.push_back(found);
  };
  // A body that is gone was whole where it has no leaf, so its leaves do not tell what changed.
  if (note_bodies(bodies)) {
    each_part(box_, kPartSide, renew_part);
    return changed;
  }
  for (const ChangedLeaves& change : changes) {
    CoordBox all;
    double samples = 0.0;
    for (const Coord origin : change.origins) {
      const CoordBox box = intersection(voxels_of(origin, change.level, level_), box_);
      if (box.empty()) continue;
      all = enclosing(all, box);
      samples += static_cast<double>(samples_in(box));
    }
    if (all.empty()) continue;
    if (samples >= kDense * static_cast<double>(samples_in(all))) {
      each_part(all, kPartSide, renew_part);
      continue;
    }
    for (const Coord origin : change.origins)
      each_part(intersection(voxels_of(origin, change.level, level_), box_), kPartSide, renew_part);
  }
  return changed;
}

// The bricks that have a sample of the box.
void BoneHu::note_occupied(const CoordBox& box) {
  const Coord first = box.min - box_.min, last = box.max - box_.min + Coord{1, 1, 1};
  const auto brick = [](std::int32_t sample, std::int32_t count) { return std::clamp(sample / kBrick, 0, count - 1); };
  for (std::int32_t x = brick(first.x, bricks_.x); x <= brick(last.x, bricks_.x); ++x)
    for (std::int32_t y = brick(first.y, bricks_.y); y <= brick(last.y, bricks_.y); ++y)
      for (std::int32_t z = brick(first.z, bricks_.z); z <= brick(last.z, bricks_.z); ++z) {
        bool any = false;
        const auto end = [](std::int32_t b, std::int32_t samples) {
          return std::min(b * kBrick + kBrick, samples - 1);
        };
        for (std::int32_t i = x * kBrick; i <= end(x, dims_.x) && !any; ++i)
          for (std::int32_t j = y * kBrick; j <= end(y, dims_.y) && !any; ++j) {
            const std::uint16_t* row =
                steps_.data() + (to_index(i) * to_index(dims_.y) + to_index(j)) * to_index(dims_.z);
            any = std::any_of(row + z * kBrick, row + end(z, dims_.z) + 1, [](std::uint16_t s) { return s != 0; });
          }
        occupied_[(to_index(x) * to_index(bricks_.y) + to_index(y)) * to_index(bricks_.z) + to_index(z)] = any ? 1 : 0;
      }
}

}  // namespace osteon::radiology
