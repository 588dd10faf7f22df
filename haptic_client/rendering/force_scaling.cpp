#include "haptic_client/rendering/force_scaling.hpp"

#include <array>
#include <string>

namespace osteon::haptic {
namespace {

constexpr std::array<std::string_view, 3> kForceChoices = {"proportional", "compressed", "feed-cue"};
constexpr int kHalvings = 40;  // a double of mm or N/mm is then known to a millionth of what anybody feels

// The largest argument in [0, most] whose value is at most `wanted`, for a growing function.
template <class Growing>
double largest(double most, double wanted, Growing&& of) noexcept {
  if (of(most) <= wanted) return most;
  double low = 0.0, high = most;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (of(middle) <= wanted ? low : high) = middle;
  }
  return low;
}

}  // namespace

std::string_view name(ForceChoice choice) { return kForceChoices[static_cast<std::size_t>(choice)]; }

Result<ForceChoice> find_force_choice(std::string_view name) {
  for (std::size_t i = 0; i < kForceChoices.size(); ++i)
    if (kForceChoices[i] == name) return static_cast<ForceChoice>(i);
  return failure(ErrorCode::invalid_input,
                 "there is no force choice \"" + std::string(name) + "\"; choose proportional, compressed or feed-cue");
}

double Compression::stored_mj(double n_per_mm, double extension_mm) const noexcept {
  const double force_n = n_per_mm * extension_mm;
  if (!on()) return 0.5 * force_n * extension_mm;
  const double x = force_n / knee_n;
  // (1 + x) ln(1 + x) - x loses its digits where x is small: x² / 2 - x³ / 6.
  const double energy = x < 1e-4 ? x * x * (0.5 - x / 6.0) : (1.0 + x) * std::log1p(x) - x;
  return n_per_mm > 0.0 ? knee_n * knee_n * energy / n_per_mm : 0.0;
}

double Compression::paid_n_per_mm(double n_per_mm, double extension_mm, double paid_mj) const noexcept {
  return largest(n_per_mm, paid_mj, [&](double k) { return stored_mj(k, extension_mm); });
}

double Compression::paid_mm(double n_per_mm, double extension_mm, double paid_mj) const noexcept {
  return largest(extension_mm, paid_mj, [&](double mm) { return stored_mj(n_per_mm, mm); });
}

Compression Compression::within(double budget_n) noexcept {
  if (budget_n >= kFullForce_n) return {};
  const auto at_full_n = [](double knee_n) { return Compression{knee_n}.of(kFullForce_n); };
  if (at_full_n(kLeastKnee_n) >= budget_n) return {kLeastKnee_n};
  double low_n = kLeastKnee_n, high_n = 1e6;
  for (int i = 0; i < 2 * kHalvings; ++i) {
    const double middle_n = 0.5 * (low_n + high_n);
    (at_full_n(middle_n) < budget_n ? low_n : high_n) = middle_n;
  }
  return {high_n};
}

}  // namespace osteon::haptic
