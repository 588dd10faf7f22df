#include "server/import/grown_bones.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace osteon::import {
namespace {

// Limits of a threshold, as on the command line.
constexpr double kLeastThreshold_hu = -1000.0, kMostThreshold_hu = 4000.0;

std::string describe(const GrowOptions& options, double threshold_hu) {
  std::array<char, 96> similar{};
  if (options.similar_hu)
    std::snprintf(similar.data(), similar.size(), "within %g HU of %s", *options.similar_hu,
                  options.adaptive ? "the region's mean" : "the seed");
  else
    std::snprintf(similar.data(), similar.size(), "of %g HU and more", threshold_hu);
  std::string text = std::string(", voxels ") + similar.data() + " grown " +
                     (options.by == imaging::GrowBy::slice ? "slice by slice" : "in the volume") + " from";
  for (const Vec3& seed : options.seeds_mm) {
    std::array<char, 96> at{};
    std::snprintf(at.data(), at.size(), " %.6g,%.6g,%.6g", seed.x(), seed.y(), seed.z());
    text += at.data();
  }
  return text + " mm";
}

}  // namespace

Result<GrownBones> grow_bones(const imaging::HuVolume& scan, const GrowOptions& options, double threshold_hu,
                              const KeepGoing& keep_going) {
  imaging::GrowingParams params{.low_hu = threshold_hu, .by = options.by};
  if (options.similar_hu) {
    if (!(*options.similar_hu > 0.0) || !std::isfinite(*options.similar_hu))
      return failure(ErrorCode::invalid_input,
                     "similar voxels must be within a number of HU above 0; give another "
                     "--similar");
    params.similarity = options.adaptive ? imaging::Similarity::mean : imaging::Similarity::seed;
    params.tolerance_hu = *options.similar_hu;
  } else if (options.adaptive) {
    return failure(ErrorCode::invalid_input, "--adaptive needs --similar with a number of HU");
  }
  std::vector<std::array<int, 3>> seeds;
  for (const Vec3& position_mm : options.seeds_mm) {
    const auto voxel = imaging::seed_voxel(scan, position_mm);
    if (!voxel) return tl::unexpected(voxel.error());
    seeds.push_back(*voxel);
  }
  auto grown = imaging::grow_from_seeds(scan, seeds, params, keep_going);
  if (!grown) return tl::unexpected(grown.error());
  GrownBones bones{.labels = std::move(grown->labels),
                   .seeds = {},
                   .regions = std::move(grown->list),
                   .threshold_hu = threshold_hu,
                   .description = describe(options, threshold_hu)};
  for (std::size_t i = 0; i < seeds.size(); ++i)
    bones.seeds.push_back({seeds[i], options.bones.empty() ? static_cast<int>(i) + 1 : options.bones[i]});
  const auto lowest = std::ranges::min_element(bones.regions, {}, &imaging::Region::low_hu);
  bones.threshold_hu = std::clamp(std::ceil(lowest->low_hu), kLeastThreshold_hu, kMostThreshold_hu);
  return bones;
}

Result<Vec3> parse_seed(const std::string& text) {
  Vec3 position_mm;
  const char *at = text.data(), *end = text.data() + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const auto [stop, error] = std::from_chars(at, end, position_mm[axis]);
    const bool last = axis == 2;
    if (error != std::errc{} || !std::isfinite(position_mm[axis]) || (last ? stop != end : stop == end || *stop != ','))
      return failure(ErrorCode::invalid_input, "--seed " + text + " is not a position; write X,Y,Z in mm (LPS)");
    at = last ? stop : stop + 1;
  }
  return position_mm;
}

}  // namespace osteon::import
