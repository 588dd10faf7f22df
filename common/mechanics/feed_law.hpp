// Cutting resistance as a function of feed, and its solution against a stiff coupling: feed follows force.
#pragma once

namespace osteon {

// resistance(v) = offset + scale · v^exponent for v > 0 in mm/s, N. A force law gives this for the speed, density and
// engagement of a moment.
struct FeedLaw {
  double offset_n = 0;           // N at the slowest feed: ploughing edges, a spring; below it nothing advances
  double scale_n = 0;            // N at 1 mm/s, beyond the offset
  double exponent = 1;           // > 0
  double max_feed_mm_per_s = 0;  // heel contact: the tool's flank touches the bone and allows no faster feed
  double threshold_n = 0;        // below this force the tool rubs and does not advance
};

[[nodiscard]] double resistance_n(const FeedLaw& law, double feed_mm_per_s) noexcept;

// The feed at which the law resists with that force, not limited: the inverse of the law. Zero up to its offset.
[[nodiscard]] double feed_at_mm_per_s(const FeedLaw& law, double force_n) noexcept;

// A law `factor` times as strong at every feed, with the same limit.
[[nodiscard]] FeedLaw scaled(const FeedLaw& law, double factor) noexcept;

struct FeedSolution {
  double feed_mm_per_s = 0;
  double cutting_n = 0;  // the law's share of the force; the heel or rubbing bears the rest
  bool heel_contact = false;
  bool rubbing = false;
};

// Solves stiffness · (extension − v·dt) = resistance(v) for v in [0, min(cap, extension/dt)]. Both sides are monotone,
// so the root is bracketed and unique. Below threshold or offset the tool rubs. Without extension or law the feed is
// zero.
[[nodiscard]] FeedSolution solve_feed(const FeedLaw& law, double stiffness_n_per_mm, double extension_mm,
                                      double dt_s) noexcept;

}  // namespace osteon
