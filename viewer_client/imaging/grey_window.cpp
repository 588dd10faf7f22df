#include "viewer_client/imaging/grey_window.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

namespace {

constexpr double kWhite = 255.0;
constexpr double kPart = 1.0 / 400.0;  // of its width that a window changes for each pixel [A]
constexpr double kMostCentre_hu = 4000.0;

}  // namespace

GreyTable::GreyTable(const GreyWindow& window) : greys_(std::size_t{1} << 16) {
  const double width = std::max(kLeastWidth_hu, window.width_hu);
  const double low = window.centre_hu - 0.5 - 0.5 * (width - 1.0);
  for (std::size_t i = 0; i < greys_.size(); ++i) {
    const double hu = static_cast<double>(i) - 32768.0;
    // A window of 1 HU has no slope: what is above its limit is white.
    const double part = width > kLeastWidth_hu ? (hu - low) / (width - 1.0) : (hu > low ? 1.0 : 0.0);
    greys_[i] = static_cast<std::uint8_t>(std::lround(kWhite * std::clamp(part, 0.0, 1.0)));
  }
}

GreyWindow dragged(const GreyWindow& window, double right_px, double down_px) {
  const double step_hu = std::max(1.0, kPart * window.width_hu);
  return {std::clamp(window.centre_hu + step_hu * down_px, -kMostCentre_hu, kMostCentre_hu),
          std::clamp(window.width_hu + step_hu * right_px, kLeastWidth_hu, kMostWidth_hu)};
}

}  // namespace osteon
