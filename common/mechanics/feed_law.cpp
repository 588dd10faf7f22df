#include "common/mechanics/feed_law.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

double resistance_n(const FeedLaw& law, double feed_mm_per_s) noexcept {
  if (feed_mm_per_s <= 0.0) return 0.0;
  return law.offset_n + law.scale_n * (law.exponent == 1.0 ? feed_mm_per_s : std::pow(feed_mm_per_s, law.exponent));
}

double feed_at_mm_per_s(const FeedLaw& law, double force_n) noexcept {
  if (!(force_n > law.offset_n) || !(law.scale_n > 0.0)) return 0.0;
  return std::pow((force_n - law.offset_n) / law.scale_n, 1.0 / law.exponent);
}

FeedLaw scaled(const FeedLaw& law, double factor) noexcept {
  FeedLaw out = law;
  out.offset_n *= factor;
  out.scale_n *= factor;
  out.threshold_n *= factor;
  return out;
}

FeedSolution solve_feed(const FeedLaw& law, double stiffness_n_per_mm, double extension_mm, double dt_s) noexcept {
  const double available_n = stiffness_n_per_mm * extension_mm;
  if (!(available_n > 0.0) || !(law.max_feed_mm_per_s > 0.0) || available_n < law.threshold_n ||
      available_n <= law.offset_n)
    return {.rubbing = available_n > 0.0};

  const auto surplus_n = [&](double feed) {
    return stiffness_n_per_mm * (extension_mm - feed * dt_s) - resistance_n(law, feed);
  };
  double low = 0.0, high = std::min(law.max_feed_mm_per_s, extension_mm / dt_s);
  if (surplus_n(high) >= 0.0) return {high, resistance_n(law, high), high == law.max_feed_mm_per_s, false};

  // Bisection. The error after 48 halvings is far below any force that a person feels, and the time is the same in
  // every tick.
  for (int i = 0; i < 48; ++i) {
    const double middle = 0.5 * (low + high);
    (surplus_n(middle) >= 0.0 ? low : high) = middle;
  }
  return {low, resistance_n(law, low), false, false};
}

}  // namespace osteon
