#include "common/input/space_mouse_report.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {
namespace {

constexpr std::uint8_t kTranslation = 1, kRotation = 2, kButtons = 3, kBattery = 0x17;
constexpr std::size_t kThreeAxes = 1 + 6, kSixAxes = 1 + 12;

// Three int16, least significant byte first, in the cap's axes. Returned as fractions of full deflection in the device
// frame.
Vec3 axes(std::span<const std::uint8_t> bytes) {
  double raw[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const auto bits = static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8);
    raw[i] = std::clamp(static_cast<double>(static_cast<std::int16_t>(bits)) / kSpaceMouseRange, -1.0, 1.0);
  }
  return {raw[0], -raw[2], raw[1]};
}

}  // namespace

bool take_report(SpaceMouseState& state, std::span<const std::uint8_t> report) noexcept {
  if (report.empty()) return false;
  switch (report[0]) {
    case kTranslation:
      if (report.size() < kThreeAxes) return false;
      state.push = axes(report.subspan(1));
      if (report.size() >= kSixAxes) state.twist = axes(report.subspan(kThreeAxes));
      return true;
    case kRotation:
      if (report.size() < kThreeAxes) return false;
      state.twist = axes(report.subspan(1));
      return true;
    case kButtons: {
      if (report.size() < 2) return false;
      std::uint32_t bits = 0;
      for (std::size_t i = 1; i < std::min<std::size_t>(report.size(), 5); ++i)
        bits |= static_cast<std::uint32_t>(report[i]) << (8 * (i - 1));
      state.buttons = bits;
      return true;
    }
    case kBattery:
      if (report.size() < 2 || report[1] > 100) return false;
      state.battery_percent = report[1];
      return true;
    default:
      return false;
  }
}

Vec3 beyond_rest(const Vec3& deflection, double rest) noexcept {
  const double size = deflection.norm();
  return size <= rest ? Vec3(Vec3::Zero()) : Vec3(deflection * (std::min(1.0, (size - rest) / (1.0 - rest)) / size));
}

}  // namespace osteon
