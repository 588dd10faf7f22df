#include "common/imaging/hard_tissue.hpp"

#include "common/imaging/calibration.hpp"

namespace osteon::imaging {
namespace {

constexpr double kBlur_voxels = 2.0;
constexpr std::size_t kOften = 1 << 20;  // voxels between two calls of keep_going
constexpr auto kMetal = static_cast<std::uint8_t>(Tissue::metal);
constexpr auto kEnamel = static_cast<std::uint8_t>(Tissue::enamel);

}  // namespace

Result<HardTissue> find_hard_tissue(const HuVolume& volume, const SparseMask& bones,
                                    const DensityCalibration& calibration, double metal_hu,
                                    const KeepGoing& keep_going) {
  const double compact_hu = hounsfield(calibration, kCompactBone_g_cm3);
  const auto is_hard = [&](std::int16_t hu) { return hu > compact_hu || hu >= metal_hu; };
  HardTissue found;
  bool any = false, any_metal = false;
  const auto stopped = [&](double done) { return !keep_going(done); };
  const Error cancelled{ErrorCode::cancelled, "stopped while looking for metal"};
  for (std::size_t i = 0; i < volume.values.size(); ++i) {
    if (i % kOften == 0 && stopped(0.3 * static_cast<double>(i) / static_cast<double>(volume.values.size())))
      return tl::unexpected(cancelled);
    any = any || is_hard(volume.values[i]);
    any_metal = any_metal || volume.values[i] >= metal_hu;
  }
  if (!any) return found;
  VoxelMask metal;
  if (any_metal) {
    metal = VoxelMask(volume.dims);
    for (std::size_t i = 0; i < volume.values.size(); ++i) metal.values[i] = volume.values[i] >= metal_hu ? 1 : 0;
    auto near = within_mm(metal, Vec3::Ones(), kBlur_voxels, [&](double done) { return keep_going(0.3 + 0.6 * done); });
    if (!near) return tl::unexpected(near.error());
    metal = std::move(*near);
  }
  found.tissue = VoxelMask(volume.dims);
  std::int64_t metal_voxels = 0, enamel_voxels = 0;
  for (std::size_t i = 0; i < volume.values.size(); ++i) {
    if (i % kOften == 0 && stopped(0.9)) return tl::unexpected(cancelled);
    if (!is_hard(volume.values[i]) || bones.values[i] == 0) continue;
    const bool is_metal = any_metal && metal.values[i] != 0;
    found.tissue.values[i] = is_metal ? kMetal : kEnamel;
    ++(is_metal ? metal_voxels : enamel_voxels);
  }
  const double voxel_cm3 = volume.spacing_mm.prod() * 1e-3;
  found.metal_cm3 = static_cast<double>(metal_voxels) * voxel_cm3;
  found.enamel_cm3 = static_cast<double>(enamel_voxels) * voxel_cm3;
  return found;
}

}  // namespace osteon::imaging
