#include "common/imaging/surface_level.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/imaging/neighbours.hpp"

namespace osteon::imaging {
namespace {

// [A] The farthest that a profile goes each way: so many mm for the blur of the scanner, and so many voxels.
constexpr double kProfile_mm = 1.5, kProfile_voxels = 2.0;
constexpr double kStep_voxels = 0.5;
constexpr double kTurn = 0.25;  // [A] A profile ends where HU go back by this part of their change. Noise is less.
// [A] HU of the most compact bone. Metal and enamel behind bone do not raise its level beyond what such bone gives.
constexpr double kCompact_hu = 1850.0;
constexpr std::size_t kVoxelsAtOnce = 1 << 14;  // between two questions whether to go on

class Profiles {
 public:
  Profiles(const HuVolume& volume, const VoxelMask& bones) : volume_(volume), bones_(bones) {}

  // HU half way between the two sides of the edge at a voxel of a bone. Nothing if it is at no edge towards outside.
  [[nodiscard]] std::optional<double> half_maximum_hu(const std::array<int, 3>& at) const {
    const Vec3 gradient = gradient_hu_mm(at);
    if (!(gradient.norm() > 0.0)) return std::nullopt;
    const Vec3 direction = gradient.normalized();
    // Steps in voxels, so that no slice is passed over.
    const Vec3 step = direction.cwiseQuotient(volume_.spacing_mm);
    const double step_mm = kStep_voxels / step.cwiseAbs().maxCoeff();
    const double reach_mm = kProfile_mm + kProfile_voxels * direction.cwiseAbs().dot(volume_.spacing_mm);
    const int steps = static_cast<int>(std::ceil(reach_mm / step_mm));
    const std::uint8_t bone = bones_.at(at[0], at[1], at[2]);
    const Vec3 from(at[0], at[1], at[2]);
    const double start_hu = std::min<double>(volume_.at(at[0], at[1], at[2]), kCompact_hu);
    bool leaves = false;
    double lowest = start_hu, highest = start_hu;
    for (int i = 1; i <= steps; ++i) {
      const Vec3 to = from - i * step_mm * step;
      const auto hu = sample(to);
      if (!hu || *hu > lowest + kTurn * (start_hu - lowest)) break;
      lowest = std::min(lowest, *hu);
      leaves = leaves || bones_.values[nearest(to)] != bone;
    }
    if (!leaves) return std::nullopt;
    for (int i = 1; i <= steps; ++i) {
      const auto hu = sample(from + i * step_mm * step);
      if (!hu || *hu < highest - kTurn * (highest - start_hu)) break;
      highest = std::max(highest, *hu);
    }
    return 0.5 * (lowest + highest);
  }

 private:
  [[nodiscard]] Vec3 gradient_hu_mm(const std::array<int, 3>& at) const {
    Vec3 gradient = Vec3::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<int, 3> before = at, after = at;
      before[axis] = std::max(0, at[axis] - 1);
      after[axis] = std::min(volume_.dims[axis] - 1, at[axis] + 1);
      if (before == after) continue;
      const auto i = static_cast<int>(axis);
      gradient[i] = (volume_.at(after[0], after[1], after[2]) - volume_.at(before[0], before[1], before[2])) /
                    ((after[axis] - before[axis]) * volume_.spacing_mm[i]);
    }
    return gradient;
  }
  // Of a place in the scan, so without negative numbers.
  [[nodiscard]] std::size_t nearest(const Vec3& voxel) const {
    return volume_.index(static_cast<int>(voxel.x() + 0.5), static_cast<int>(voxel.y() + 0.5),
                         static_cast<int>(voxel.z() + 0.5));
  }
  // Trilinear HU, at most those of compact bone; nothing outside the scan.
  [[nodiscard]] std::optional<double> sample(const Vec3& voxel) const {
    std::array<std::size_t, 3> low{}, next{};
    std::array<double, 3> part{};
    const std::array<std::size_t, 3> stride{
        1, static_cast<std::size_t>(volume_.dims[0]),
        static_cast<std::size_t>(volume_.dims[0]) * static_cast<std::size_t>(volume_.dims[1])};
    std::size_t first = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double v = voxel[static_cast<int>(axis)];
      if (v < 0.0 || v > volume_.dims[axis] - 1) return std::nullopt;
      low[axis] = static_cast<std::size_t>(v);
      part[axis] = v - static_cast<double>(low[axis]);
      next[axis] = part[axis] > 0.0 ? stride[axis] : 0;
      first += low[axis] * stride[axis];
    }
    const std::int16_t* hu = volume_.values.data() + first;
    const auto mix = [](double a, double b, double t) { return a + (b - a) * t; };
    const auto row = [&](std::size_t i) { return mix(hu[i], hu[i + next[0]], part[0]); };
    const auto slice = [&](std::size_t i) { return mix(row(i), row(i + next[1]), part[1]); };
    return std::min(mix(slice(0), slice(next[2]), part[2]), kCompact_hu);
  }

  const HuVolume& volume_;
  const VoxelMask& bones_;
};

constexpr std::uint8_t kNotSeen = 0, kStays = 1, kGoes = 2, kBeside = 3;

// Goes from the surface into the bones, through the voxels below their level.
class Front {
 public:
  Front(const HuVolume& volume, double threshold_hu, const VoxelMask& bones)
      : volume_(volume),
        threshold_hu_(threshold_hu),
        bones_(bones),
        profiles_(volume, bones),
        above_(bones.dims),
        state_(bones.dims) {}

  // Voxels beside another bone or beside none. Error: cancelled.
  Result<void> start(const KeepGoing& keep_going) {
    const auto [columns, rows, slices] = bones_.dims;
    for (int slice = 0; slice < slices; ++slice) {
      if (!keep_going(static_cast<double>(slice) / slices)) return stopped();
      for (int row = 0; row < rows; ++row)
        for (int column = 0; column < columns; ++column)
          if (bones_.at(column, row, slice) != 0 && at_surface({column, row, slice})) look({column, row, slice});
    }
    return {};
  }
  // Error: cancelled.
  Result<void> advance(const KeepGoing& keep_going) {
    for (std::size_t next = 0; next < gone_.size(); ++next) {
      if (next % kVoxelsAtOnce == 0 && !keep_going(static_cast<double>(next) / static_cast<double>(gone_.size())))
        return stopped();
      const std::array<int, 3> at = gone_[next];  // a copy, because look() adds to the list
      each_beside(at, [&](const std::array<int, 3>& beside) {
        if (bones_.at(beside[0], beside[1], beside[2]) != 0) look(beside);
      });
    }
    return {};
  }
  // Voxels beside those that were seen get the mean of their levels, so that the field between both is smooth.
  Result<void> widen(const KeepGoing& keep_going) {
    const Neighbours neighbours(bones_.dims);
    std::vector<std::pair<std::uint32_t, std::uint8_t>> wider;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      if (i % kVoxelsAtOnce == 0 && !keep_going(static_cast<double>(i) / static_cast<double>(seen_.size())))
        return stopped();
      neighbours.each(seen_[i], [&](std::uint32_t beside, int) {
        if (state_.values[beside] != kNotSeen) return;
        state_.values[beside] = kBeside;
        int sum = 0, count = 0;
        neighbours.each(beside, [&](std::uint32_t known, int) {
          if (state_.values[known] == kNotSeen || state_.values[known] == kBeside) return;
          sum += above_.values[known];
          ++count;
        });
        wider.emplace_back(beside, static_cast<std::uint8_t>(sum / count));
      });
    }
    for (const auto& [voxel, steps] : wider) above_.values[voxel] = steps;
    return {};
  }
  [[nodiscard]] const std::vector<std::array<int, 3>>& gone() const { return gone_; }
  // As in SurfaceLevel.
  [[nodiscard]] const VoxelMask& above() const { return above_; }

 private:
  static tl::unexpected<Error> stopped() { return stopped_while("looking for the level of the bone's surface"); }

  template <class Visit>
  void each_beside(const std::array<int, 3>& at, Visit visit) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        std::array<int, 3> beside = at;
        beside[axis] += side;
        if (beside[axis] >= 0 && beside[axis] < bones_.dims[axis]) visit(beside);
      }
  }
  [[nodiscard]] bool at_surface(const std::array<int, 3>& at) const {
    const std::uint8_t bone = bones_.at(at[0], at[1], at[2]);
    bool found = false;
    each_beside(at, [&](const std::array<int, 3>& beside) {
      found = found || bones_.at(beside[0], beside[1], beside[2]) != bone;
    });
    return found;
  }
  void look(const std::array<int, 3>& at) {
    const std::size_t i = bones_.index(at[0], at[1], at[2]);
    if (state_.values[i] != kNotSeen || volume_.values[i] < threshold_hu_) return;
    const auto level_hu = profiles_.half_maximum_hu(at);
    const auto steps = static_cast<std::uint8_t>(
        level_hu ? std::clamp((*level_hu - threshold_hu_) / SurfaceLevel::kStep_hu, 0.0, 255.0) : 0.0);
    above_.values[i] = steps;
    state_.values[i] = SurfaceLevel::lowered(volume_.values[i], steps) < threshold_hu_ ? kGoes : kStays;
    seen_.push_back(static_cast<std::uint32_t>(i));
    if (state_.values[i] == kGoes) gone_.push_back(at);
  }

  const HuVolume& volume_;
  double threshold_hu_;
  const VoxelMask& bones_;
  Profiles profiles_;
  VoxelMask above_, state_;
  std::vector<std::uint32_t> seen_;
  std::vector<std::array<int, 3>> gone_;
};

}  // namespace

Result<SurfaceLevel> move_to_half_maximum(const HuVolume& volume, double threshold_hu, VoxelMask& bones,
                                          const KeepGoing& keep_going) {
  if (volume.count() > std::numeric_limits<std::uint32_t>::max())
    return bad_input("a scan of " + describe(volume) +
                     " has too many voxels to find the level of its surface; export a smaller region");
  Front front(volume, threshold_hu, bones);
  if (auto done = front.start(part(keep_going, 0.0, 0.6)); !done) return tl::unexpected(done.error());
  if (auto done = front.advance(part(keep_going, 0.6, 0.8)); !done) return tl::unexpected(done.error());
  if (auto done = front.widen(part(keep_going, 0.8, 1.0)); !done) return tl::unexpected(done.error());
  for (const std::array<int, 3>& at : front.gone()) bones.at(at[0], at[1], at[2]) = 0;
  return SurfaceLevel{threshold_hu, SparseBytes(front.above().values)};
}

}  // namespace osteon::imaging
