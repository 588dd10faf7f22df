// How matter weakens X-rays: I = I0 · exp(−∫ μ dl), the law of Beer and Lambert, for one energy.
//
// μ = (μ/ρ) · ρ, with the mass attenuation coefficients μ/ρ of Hubbell 1995 at 50 keV. [A] One energy stands
// for the spectrum of a C-arm's tube at some 80 kV. So there is no beam hardening, and scatter is left out.
#pragma once

namespace osteon::radiology {

// μ at 50 keV, 1/mm: water of 1 g/cm³ (0.2269 cm²/g), cortical bone of 1.92 g/cm³ (0.4242 cm²/g).
inline constexpr double kWater_per_mm = 0.02269, kCorticalBone_per_mm = 0.08145;
// Titanium of 4.54 g/cm³ (1.213 cm²/g). Iron of 7.87 g/cm³ (1.958 cm²/g) stands for steel.
inline constexpr double kTitanium_per_mm = 0.5507, kSteel_per_mm = 1.541;
// [A] Metal of a case: its importer finds that there is metal, and not which. Titanium would weaken a ray a third as
// much.
inline constexpr double kMetal_per_mm = kSteel_per_mm;
// HU of that bone in a CT scan. [A] The scanner's spectrum is like 70 keV: between the coefficients at 60 and 80 keV on
// logarithmic scales, bone has 0.2616 cm²/g and water 0.1937 cm²/g.
inline constexpr double kCorticalBone_hu = 1593.5;

// μ of a voxel of a scan, 1/mm. Below 0 HU it is a mixture of air, which does not count, and water. Above, it is one
// of water and cortical bone, because bone weakens the softer rays of a C-arm more than those of a CT scanner.
[[nodiscard]] constexpr double attenuation_per_mm(double hu) {
  const double water = kWater_per_mm * (1.0 + hu / 1000.0);
  const double bone = kWater_per_mm + (kCorticalBone_per_mm - kWater_per_mm) * hu / kCorticalBone_hu;
  return hu <= -1000.0 ? 0.0 : hu <= 0.0 ? water : bone;
}

// Attenuation is kept in steps of a part of water's, because it is in proportion to the matter in a voxel: half a voxel
// of bone weakens a ray half as much. HU above water are not: they rise less than attenuation does. 16 bits hold steel,
// and all HU that a scan of 16 bits can have.
inline constexpr float kAir_hu = -1000.0f;
inline constexpr float kStepsOfWater = 950.0f;
inline constexpr double kStep_per_mm = kWater_per_mm / static_cast<double>(kStepsOfWater);
inline constexpr float kHuPerStepBelowWater = -kAir_hu / kStepsOfWater;  // 1.05 HU
inline constexpr float kHuPerStepAboveWater =
    static_cast<float>(kStep_per_mm * kCorticalBone_hu / (kCorticalBone_per_mm - kWater_per_mm));  // 0.65 HU

inline constexpr double kMostSteps = 65535.0;
static_assert(kMostSteps * kStep_per_mm > kMetal_per_mm);
static_assert(kMostSteps * kStep_per_mm > attenuation_per_mm(32767.0));

// HU of some steps: the inverse of attenuation_per_mm().
[[nodiscard]] constexpr float hu_of_steps(float steps) {
  const float water = steps < kStepsOfWater ? steps : kStepsOfWater;
  const float bone = steps - kStepsOfWater > 0.0f ? steps - kStepsOfWater : 0.0f;
  return (water * kHuPerStepBelowWater + kAir_hu) + bone * kHuPerStepAboveWater;
}

}  // namespace osteon::radiology
