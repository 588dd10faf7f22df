#include "common/imaging/window_level.hpp"

#include <cmath>

#include "common/core/check.hpp"

namespace osteon::imaging {

std::uint8_t grey_of(double hu, const Window& window) {
  OSTEON_CHECK(window.width_hu >= 1.0);
  const double from_centre = hu - (window.centre_hu - 0.5), width = window.width_hu - 1.0;
  if (from_centre <= -0.5 * width) return 0;
  if (from_centre > 0.5 * width) return 255;
  return static_cast<std::uint8_t>(std::lround((from_centre / width + 0.5) * 255.0));
}

}  // namespace osteon::imaging
