#include "viewer_client/inside/hu_window.hpp"

#include "common/core/check.hpp"

namespace osteon {

void grey_of(std::span<const float> hu, const HuWindow& window, std::span<std::uint8_t> grey) {
  OSTEON_CHECK(hu.size() == grey.size() && window.width_hu > 0.0);
  for (std::size_t i = 0; i < hu.size(); ++i) grey[i] = window.grey(static_cast<double>(hu[i]));
}

}  // namespace osteon
