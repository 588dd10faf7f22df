#include "viewer_client/imaging/hu_window.hpp"

#include "common/core/check.hpp"

namespace osteon {

GreyTable::GreyTable(const HuWindow& window) : greys_(std::size_t{1} << 16) {
  OSTEON_CHECK(window.width_hu > 0.0);
  for (std::size_t i = 0; i < greys_.size(); ++i) greys_[i] = window.grey(static_cast<double>(i) - 32768.0);
}

void grey_of(std::span<const float> hu, const HuWindow& window, std::span<std::uint8_t> grey) {
  OSTEON_CHECK(hu.size() == grey.size() && window.width_hu > 0.0);
  for (std::size_t i = 0; i < hu.size(); ++i) grey[i] = window.grey(static_cast<double>(hu[i]));
}

}  // namespace osteon
