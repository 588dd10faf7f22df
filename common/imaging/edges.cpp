#include "common/imaging/edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "common/core/check.hpp"
#include "common/imaging/smoothing.hpp"

namespace osteon::imaging {
namespace {

constexpr double kSmoothEnd = 0.4, kGradientEnd = 0.6, kThinEnd = 0.9;  // fractions of the time
constexpr std::uint8_t kWeak = 2;               // on the way: an edge if a strong one reaches it
constexpr std::size_t kGrownAtOnce = 1U << 16;  // voxels between two questions whether to go on

// Axes along which a scan is smoothed and differentiated.
int axes_of(EdgeSpace space) { return space == EdgeSpace::slice ? 2 : 3; }

Result<void> smooth(HuVolume& volume, double sigma_mm, EdgeSpace space, const KeepGoing& keep_going) {
  if (sigma_mm == 0.0) return {};
  if (space == EdgeSpace::volume) return smooth_gaussian(volume, sigma_mm, keep_going);
  HuVolume one;  // slice, as a volume
  one.dims = {volume.dims[0], volume.dims[1], 1};
  one.spacing_mm = volume.spacing_mm;
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    const double begin = static_cast<double>(slice) / volume.dims[2], end = (slice + 1.0) / volume.dims[2];
    const auto first = volume.values.begin() + static_cast<std::ptrdiff_t>(volume.index(0, 0, slice));
    one.values.assign(first, first + static_cast<std::ptrdiff_t>(one.count()));
    if (auto done = smooth_gaussian(one, sigma_mm, part(keep_going, begin, end)); !done) return done;
    std::ranges::copy(one.values, first);
  }
  return {};
}

// HU/mm at a voxel.
Vec3 gradient(const HuVolume& volume, std::array<int, 3> at, int axes) {
  Vec3 g = Vec3::Zero();
  for (int axis = 0; axis < axes; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    std::array<int, 3> before = at, after = at;
    before[a] = std::max(at[a] - 1, 0);
    after[a] = std::min(at[a] + 1, volume.dims[a] - 1);
    if (before[a] == after[a]) continue;
    const int difference = volume.at(after[0], after[1], after[2]) - volume.at(before[0], before[1], before[2]);
    g[axis] = difference / ((after[a] - before[a]) * volume.spacing_mm[axis]);
  }
  return g;
}

Result<std::vector<float>> magnitudes(const HuVolume& volume, int axes, const KeepGoing& keep_going) {
  std::vector<float> out(volume.count());
  std::size_t i = 0;
  for (int z = 0; z < volume.dims[2]; ++z) {
    if (!keep_going(static_cast<double>(z) / volume.dims[2])) return stopped_while("measuring the gradient");
    for (int y = 0; y < volume.dims[1]; ++y)
      for (int x = 0; x < volume.dims[0]; ++x) out[i++] = static_cast<float>(gradient(volume, {x, y, z}, axes).norm());
  }
  return out;
}

// Trilinear, at voxel coordinates. Beyond the volume the nearest value.
float interpolated(const HuVolume& volume, const std::vector<float>& values, const Vec3& at) {
  std::array<int, 3> low{}, high{};
  Vec3 t;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const double clamped = std::clamp(at[axis], 0.0, volume.dims[a] - 1.0);
    low[a] = static_cast<int>(clamped);
    high[a] = std::min(low[a] + 1, volume.dims[a] - 1);
    t[axis] = clamped - low[a];
  }
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const bool x = (corner & 1) != 0, y = (corner & 2) != 0, z = (corner & 4) != 0;
    const double weight = (x ? t.x() : 1.0 - t.x()) * (y ? t.y() : 1.0 - t.y()) * (z ? t.z() : 1.0 - t.z());
    sum += weight *
           static_cast<double>(values[volume.index(x ? high[0] : low[0], y ? high[1] : low[1], z ? high[2] : low[2])]);
  }
  return static_cast<float>(sum);
}

// Whether the magnitude falls on both sides along the gradient.
bool is_largest(const HuVolume& volume, const std::vector<float>& magnitude, std::array<int, 3> at, int axes) {
  // Towards brighter voxels. The longest component goes to the next voxel, so that no step stays within this one.
  Vec3 step = gradient(volume, at, axes).cwiseQuotient(volume.spacing_mm);
  step /= step.cwiseAbs().maxCoeff();
  const Vec3 here(at[0], at[1], at[2]);
  const float middle = magnitude[volume.index(at[0], at[1], at[2])];
  return middle > interpolated(volume, magnitude, here + step) &&
         middle >= interpolated(volume, magnitude, here - step);
}

// Adds the weak voxels that a strong one reaches, and removes the others. `strong`: where the search begins.
Result<void> connect(VoxelMask& edges, std::vector<std::array<int, 3>> strong, int axes, const KeepGoing& keep_going) {
  const int beside = axes == 3 ? 1 : 0;  // slices
  std::size_t grown = 0;
  while (!strong.empty()) {
    if (grown++ % kGrownAtOnce == 0 && !keep_going(0.0)) return stopped_while("connecting the edges");
    const auto [column, row, slice] = strong.back();
    strong.pop_back();
    for (int z = std::max(slice - beside, 0); z <= std::min(slice + beside, edges.dims[2] - 1); ++z)
      for (int y = std::max(row - 1, 0); y <= std::min(row + 1, edges.dims[1] - 1); ++y)
        for (int x = std::max(column - 1, 0); x <= std::min(column + 1, edges.dims[0] - 1); ++x) {
          if (edges.at(x, y, z) != kWeak) continue;
          edges.at(x, y, z) = 1;
          strong.push_back({x, y, z});
        }
  }
  for (std::uint8_t& value : edges.values) value = value == 1 ? 1 : 0;
  return {};
}

}  // namespace

Result<std::vector<float>> gradient_magnitude(HuVolume volume, const GradientParams& params,
                                              const KeepGoing& keep_going) {
  OSTEON_CHECK(params.sigma_mm >= 0.0);
  if (auto done = smooth(volume, params.sigma_mm, params.space, part(keep_going, 0.0, kGradientEnd)); !done)
    return tl::unexpected(done.error());
  return magnitudes(volume, axes_of(params.space), part(keep_going, kGradientEnd, 1.0));
}

Result<VoxelMask> canny_edges(HuVolume volume, const CannyParams& params, const KeepGoing& keep_going) {
  OSTEON_CHECK(params.sigma_mm >= 0.0 && params.low_hu_per_mm > 0.0 && params.low_hu_per_mm <= params.high_hu_per_mm);
  if (auto done = smooth(volume, params.sigma_mm, params.space, part(keep_going, 0.0, kSmoothEnd)); !done)
    return tl::unexpected(done.error());
  const int axes = axes_of(params.space);
  const auto magnitude = magnitudes(volume, axes, part(keep_going, kSmoothEnd, kGradientEnd));
  if (!magnitude) return tl::unexpected(magnitude.error());

  VoxelMask edges(volume.dims);
  std::vector<std::array<int, 3>> strong;
  const KeepGoing thinning = part(keep_going, kGradientEnd, kThinEnd);
  for (int z = 0; z < volume.dims[2]; ++z) {
    if (!thinning(static_cast<double>(z) / volume.dims[2])) return stopped_while("looking for edges");
    for (int y = 0; y < volume.dims[1]; ++y)
      for (int x = 0; x < volume.dims[0]; ++x) {
        const auto here = static_cast<double>((*magnitude)[volume.index(x, y, z)]);
        if (here < params.low_hu_per_mm || !is_largest(volume, *magnitude, {x, y, z}, axes)) continue;
        const bool is_strong = here >= params.high_hu_per_mm;
        edges.at(x, y, z) = is_strong ? 1 : kWeak;
        if (is_strong) strong.push_back({x, y, z});
      }
  }
  if (auto done = connect(edges, std::move(strong), axes, part(keep_going, kThinEnd, 1.0)); !done)
    return tl::unexpected(done.error());
  return edges;
}

}  // namespace osteon::imaging
