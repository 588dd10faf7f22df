// How forces of bone become forces of a device that can hold less. Proportional: every force s times as large, so all
// ratios stay. Compressed: a logarithm, after the mu-law of ITU-T G.711. Feed cue: the same within a small budget, and
// a vibration that grows with the feed.
//
//   c(F) = s · F0 · ln(1 + F / F0),   0 <= F <= Ff,   c(Ff) = the budget
//
// F0 is the knee. Far below it c is s · F, and the ratio of two forces is kept. The ratio of two forces F and r · F
// is shown as ln(1 + r · F / F0) / ln(1 + F / F0), which lies between 1 and r. Far above the knee equal ratios become
// equal differences: c(r · F) - c(F) approaches s · F0 · ln r. Between zero and Ff the map is strictly monotone, so
// a harder bone is never shown as the softer one.
//
// A spring F = k · e is shown as c(k · e). That is again a spring without hysteresis: its energy is the integral of c
// over e. It is nowhere stiffer than s · k.
#pragma once
#include <cmath>
#include <cstdint>
#include <string_view>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon::haptic {

enum class ForceChoice : std::uint8_t { proportional, compressed, feed_cue };
[[nodiscard]] std::string_view name(ForceChoice choice);
// Error invalid_input: lists the names.
[[nodiscard]] Result<ForceChoice> find_force_choice(std::string_view name);

// What a user chooses.
struct ForceScaling {
  double scale = 0.0;  // s of the proportional choice; 0: the device's continuous force / 30 N
  ForceChoice choice = ForceChoice::proportional;
  ForceScaling(double s = 0.0, ForceChoice c = ForceChoice::proportional) : scale(s), choice(c) {}
};

inline constexpr double kFullForce_n = 60.0;  // Ff: with more a tool's force is cut off [A]
inline constexpr double kLeastKnee_n = 3.0;   // F0 on a weak device: about the force of a drill in marrow [A]
inline constexpr double kCueShare = 0.3;      // share of the continuous force for the steady part of the feed cue [A]

// c over s, and what follows from it. Physical forces, N.
struct Compression {
  double knee_n = 0.0;  // F0; 0: none, c(F) = s · F

  [[nodiscard]] bool on() const noexcept { return knee_n > 0.0; }
  [[nodiscard]] double of(double force_n) const noexcept {
    return on() ? knee_n * std::log1p(force_n / knee_n) : force_n;
  }
  [[nodiscard]] double inverse(double compressed_n) const noexcept {
    return on() ? knee_n * std::expm1(compressed_n / knee_n) : compressed_n;
  }
  // Compressed over physical: 1 at zero.
  [[nodiscard]] double share(double force_n) const noexcept {
    return on() && force_n > 0.0 ? of(force_n) / force_n : 1.0;
  }
  [[nodiscard]] Vec3 of(const Vec3& force_n) const noexcept {
    return on() ? Vec3(share(force_n.norm()) * force_n) : force_n;
  }
  [[nodiscard]] Vec3 inverse(const Vec3& compressed_n) const noexcept {
    const double size = compressed_n.norm();
    return on() && size > 0.0 ? Vec3(compressed_n * (inverse(size) / size)) : compressed_n;
  }
  // Energy of a spring of this stiffness (N/mm) and extension (mm), as compressed: mJ.
  [[nodiscard]] double stored_mj(double n_per_mm, double extension_mm) const noexcept;
  // Stiffness, at most this one, of a spring of this extension that holds this energy.
  [[nodiscard]] double paid_n_per_mm(double n_per_mm, double extension_mm, double paid_mj) const noexcept;
  // Extension, at most this one, of a spring of this stiffness that holds this energy.
  [[nodiscard]] double paid_mm(double n_per_mm, double extension_mm, double paid_mj) const noexcept;
  // The knee with which a budget is reached at Ff, with a slope of at most 1 and a knee of at least kLeastKnee_n. 0:
  // the budget holds Ff.
  [[nodiscard]] static Compression within(double budget_n) noexcept;
};

}  // namespace osteon::haptic
