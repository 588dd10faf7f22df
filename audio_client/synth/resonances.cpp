#include "audio_client/synth/resonances.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace osteon::audio {
namespace {

constexpr double kBone_Pa = 17e9, kBone_kg_m3 = 1900.0, kBonePoisson = 0.3;
constexpr double kSteel_Pa = 200e9, kSteel_kg_m3 = 7850.0;
constexpr double kClampedPlate = 10.2158;
// Roots of cos k cosh k = -1.
constexpr std::array<double, 5> kCantilever = {1.875104, 4.694091, 7.854757, 10.995541, 14.137168};

}  // namespace

double plate_mode_hz(double thickness_mm, double radius_mm) noexcept {
  const double wave_m_s = std::sqrt(kBone_Pa / (12.0 * kBone_kg_m3 * (1.0 - kBonePoisson * kBonePoisson)));
  return kClampedPlate * wave_m_s * (1e-3 * thickness_mm) / (2.0 * std::numbers::pi * 1e-6 * radius_mm * radius_mm);
}

double beam_mode_hz(int index, double length_mm, double thickness_mm) noexcept {
  const double k = kCantilever[static_cast<std::size_t>(index)];
  const double wave_m_s = std::sqrt(kSteel_Pa / (12.0 * kSteel_kg_m3));
  return k * k * wave_m_s * (1e-3 * thickness_mm) / (2.0 * std::numbers::pi * 1e-6 * length_mm * length_mm);
}

}  // namespace osteon::audio
