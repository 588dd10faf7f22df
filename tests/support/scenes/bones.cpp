#include "tests/support/scenes/bones.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/field/kernel.hpp"

namespace osteon::test {

Case make_bone(const Box& extent, double pitch_mm, const std::function<double(const Vec3&)>& distance_mm,
               const std::function<double(const Vec3&)>& density_g_cm3,
               const std::function<Tissue(const Vec3&)>& tissue) {
  const CoordBox box = covering_samples(extent.grown((kBandVoxels + 1) * pitch_mm), pitch_mm);
  DenseVolume<float> surface(box, 0.0f), density(box, 0.0f);
  SampleLabels labels;
  if (tissue) labels.tissue = DenseVolume<Tissue>(box, Tissue::none);
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 p = position_mm({x, y, z}, pitch_mm);
        surface.at({x, y, z}) = static_cast<float>(distance_mm(p));
        density.at({x, y, z}) = static_cast<float>(density_g_cm3(p));
        if (tissue) labels.tissue.at({x, y, z}) = tissue(p);
      }
  CaseInfo info{
      .title = "Test bone", .source = "closed form", .pitch_mm = pitch_mm, .calibration = {}, .threshold_hu = 0.0};
  auto built = Case::build(info, surface, density, labels);
  OSTEON_CHECK(built.has_value());
  return *built;
}

Case layered_block(const std::vector<Layer>& layers, double width_mm, double pitch_mm) {
  double thickness = 0.0;
  for (const Layer& layer : layers) thickness += layer.thickness_mm;
  const Vec3 half{0.5 * width_mm, 0.5 * width_mm, 0.5 * thickness};
  const Vec3 centre{0.0, 0.0, -0.5 * thickness};
  const auto distance = [=](const Vec3& p) {
    const Vec3 q = (p - centre).cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  };
  const auto density = [=](const Vec3& p) {
    double depth = -p.z();
    for (const Layer& layer : layers) {
      depth -= layer.thickness_mm;
      if (depth < 0.0) return layer.density_g_cm3;
    }
    return layers.back().density_g_cm3;
  };
  return make_bone({centre - half, centre + half}, pitch_mm, distance, density);
}

Case plain_block(double width_mm, double thickness_mm, double pitch_mm, double density_g_cm3) {
  return layered_block({{thickness_mm, density_g_cm3}}, width_mm, pitch_mm);
}

Case marked_block(double width_mm, double thickness_mm, double pitch_mm,
                  const std::function<Tissue(const Vec3&)>& tissue) {
  const Vec3 half{0.5 * width_mm, 0.5 * width_mm, 0.5 * thickness_mm};
  const auto distance = [=](const Vec3& p) {
    const Vec3 q = (p + Vec3(0, 0, half.z())).cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
  };
  const auto density = [&](const Vec3& p) { return tissue(p) == Tissue::none ? 1.9 : 2.1; };
  return make_bone({{-half.x(), -half.y(), -thickness_mm}, {half.x(), half.y(), 0.0}}, pitch_mm, distance, density,
                   tissue);
}

Case large_ball(double radius_mm, double pitch_mm, double density_g_cm3) {
  const auto fill = [&](const CoordBox& part, PartSamples& samples) {
    const Vec3 low = position_mm(part.min, pitch_mm), high = position_mm(part.max, pitch_mm);
    const double middle = (0.5 * (low + high)).norm() - radius_mm,
                 reach = 0.5 * (high - low).norm() + (kBandVoxels + 1) * pitch_mm;
    if (middle > reach) return PartKind::outside;
    std::ranges::fill(samples.density_g_cm3, static_cast<float>(density_g_cm3));
    if (middle < -reach) return PartKind::inside;
    std::size_t i = 0;
    for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
      for (std::int32_t y = part.min.y; y <= part.max.y; ++y)
        for (std::int32_t z = part.min.z; z <= part.max.z; ++z, ++i)
          samples.surface_mm[i] = static_cast<float>(position_mm({x, y, z}, pitch_mm).norm() - radius_mm);
    return PartKind::samples;
  };
  const Vec3 half = Vec3::Constant(radius_mm + (kBandVoxels + 1) * pitch_mm);
  const CaseInfo info{
      .title = "Ball", .source = "closed form", .pitch_mm = pitch_mm, .calibration = {}, .threshold_hu = 0.0};
  auto built = Case::build(info, covering_samples({-half, half}, pitch_mm), fill);
  OSTEON_CHECK(built.has_value());
  return *built;
}

Cut straight_cut(const Tool& tool, const Vec3& from_tip_mm, const Vec3& to_tip_mm, const Vec3& axis,
                 std::uint64_t author_seq) {
  return {.author = {1},
          .author_seq = author_seq,
          .lease_epoch = 1,
          .body = {},
          .tool = tool.hash(),
          .level = tool.cut_level,
          .path = {quantise(pose_along(from_tip_mm, axis)), quantise(pose_along(to_tip_mm, axis))},
          .spindle_rpm = static_cast<std::uint32_t>(tool.spindle_rpm)};
}

}  // namespace osteon::test
