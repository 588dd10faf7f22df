// Exponentially weighted moving average, equation (7.15): F_i = E_i (1 - alpha) + F_(i-1) alpha. Only for the cutting
// force. In the coupling that holds the user's hand, a filter creates energy (5 ms of it creates some joules in 10 s of
// stroking).
#pragma once
#include <cmath>

namespace osteon {

inline constexpr double kCuttingFilter_s = 2e-3;  // tau

// `T`: double, or a vector with + and *. The factor follows from the tick, alpha = exp(-dt/tau), so that the felt force
// does not depend on the loop's rate.
template <class T>
class ForceFilter {
 public:
  explicit ForceFilter(const T& start) noexcept : value_(start) {}

  // [haptic] One tick; a tau of zero passes everything.
  const T& step(const T& sample, double dt_s, double tau_s = kCuttingFilter_s) noexcept {
    const double alpha = tau_s > 0.0 ? std::exp(-dt_s / tau_s) : 0.0;
    value_ = sample * (1.0 - alpha) + value_ * alpha;
    return value_;
  }
  // [haptic] For a safety zero, or when a tool is picked up.
  void reset(const T& value) noexcept { value_ = value; }
  [[nodiscard]] const T& value() const noexcept { return value_; }

 private:
  T value_;
};

}  // namespace osteon
