#include "tests/support/scenes/described_case.hpp"

#include <cstdint>
#include <utility>

#include "common/core/check.hpp"

namespace osteon::test {

Result<Case> described_ball(CaseInfo info) {
  const CoordBox box{{-8, -8, -8}, {8, 8, 8}};
  DenseVolume<float> surface(box, 0.0f);
  const DenseVolume<float> density(box, 1.5f);
  for (std::int32_t x = -8; x <= 8; ++x)
    for (std::int32_t y = -8; y <= 8; ++y)
      for (std::int32_t z = -8; z <= 8; ++z)
        surface.at({x, y, z}) = static_cast<float>(position_mm({x, y, z}, info.pitch_mm).norm() - 3.0 * info.pitch_mm);
  return Case::build(std::move(info), surface, density);
}

CaseScan turned_scan() {
  CaseScan scan;
  scan.geometry.dims = {19, 11, 7};
  scan.geometry.origin_mm = {-10.25, 20.5, 7.125};
  const Eigen::Matrix3d turned =
      (Eigen::AngleAxisd(0.3, Vec3::UnitX()) * Eigen::AngleAxisd(-0.7, Vec3::UnitZ())).matrix();
  scan.geometry.axes_mm = turned * Vec3(0.5, 0.75, -2.0).asDiagonal();
  for (int k = 0; k < 7; ++k)
    for (int j = 0; j < 11; ++j)
      for (int i = 0; i < 19; ++i) {
        scan.hu.push_back(static_cast<std::int16_t>(i + 100 * j + 1000 * k - 3000));
        scan.labels.push_back(j > 5 ? 0 : i < 9 ? 1 : 7);
        scan.tissue.push_back(j > 5 ? 0 : k < 3 ? 1 : 2);
      }
  scan.hu[5] = -32768;
  scan.hu[6] = 32767;
  return scan;
}

CaseInfo full_description(const CaseScan& scan) {
  const auto described = describe_scan(scan);
  OSTEON_CHECK(described.has_value());
  return {.title = "A femur",
          .source = "closed form",
          .pitch_mm = 0.5,
          .calibration = {.slope_g_cm3_per_hu = 0.001, .intercept_g_cm3 = 0.1},
          .density_from = {{"rods", {{"cortical_error_g_cm3", 0.1}}, {"by hand"}}},
          .threshold_hu = 226.0,
          .scan = *described,
          .labels = {{1, "bone 1", LabelKind::bone, {"threshold", {{"threshold_hu", 226.0}, {"island", 1.0}}, {}}},
                     {7, "Nervus ischiadicus", LabelKind::nerve, {"painted", {}, {"paint 1 2 3", "erase 4 5 6"}}}},
          .tissues = {{1, "cortical", LabelKind::cortical, {"density", {{"from_g_cm3", 1.0}}, {}}},
                      {2, "cancellous", LabelKind::cancellous, {"density", {{"below_g_cm3", 1.0}}, {}}}},
          .landmarks = {{"head centre", {1.0, 2.0, 3.0}}, {"lesser trochanter", {4.0, 5.0, 6.0}}},
          .axes = {{"neck", {1.0, 2.0, 3.0}, {0.0, 0.6, 0.8}}},
          .planes = {{"osteotomy", {4.0, 5.0, 6.0}, {0.0, 0.0, -1.0}}},
          .regions = {{"near the nerve", 7, {}, {}}, {"window", 0, {-1.0, -2.0, -3.0}, {1.0, 2.0, 3.0}}}};
}

}  // namespace osteon::test
