// What a hand at a game pad wants, and what it feels. Pure numbers: no device, no I/O and no clock.
#pragma once
#include <optional>

#include <Eigen/Core>

namespace osteon {

// A game pad's controls.
struct PadState {
  Eigen::Vector2d left = Eigen::Vector2d::Zero(), right = Eigen::Vector2d::Zero();  // sticks, −1 … 1: x right, y up
  double left_trigger = 0, right_trigger = 0;                                       // 0 … 1
  bool a = false, b = false, shoulder = false;                                      // shoulder: any of the two
};

// What the pad asks for in one tick.
struct PadOrder {
  // Motion of the tool across the picture, and its turn: fractions −1 … 1 of the fastest, x right, y up.
  Eigen::Vector2d slide = Eigen::Vector2d::Zero(), turn = Eigen::Vector2d::Zero();
  bool push = false, push_begins = false;  // the right trigger is pulled; since this tick
  double push_n = 0;                       // kLeastPush_n to kMostPush_n while `push`, else 0
  bool fine = false;                       // motions at a tenth; slide and turn are not scaled by it
  std::optional<bool> spindle;             // the left trigger was pulled or let go in this tick
  bool toggles_spindle = false;            // A went down in this tick
  bool undoes = false;                     // B went down in this tick
  bool used = false;                       // a control is not at rest, or came to rest in this tick
};

// A stick without its dead zone: zero up to `rest`, 1 at the rim, u² of the way u between. So it begins without a step
// and without a corner, and small motions are fine ones. The direction stays. Corners of a square stick count as the
// rim.
[[nodiscard]] Eigen::Vector2d shaped_stick(const Eigen::Vector2d& stick, double rest) noexcept;

// [one thread]
class PadControl {
 public:
  static constexpr double kStickRest = 0.15;
  // A trigger is pulled from the second on, until it is below the first again. The push is linear from the first on.
  static constexpr double kTriggerRest = 0.08, kTriggerPulled = 0.12;

  [[nodiscard]] PadOrder step(const PadState& state) noexcept;
  // The pad is away, or somebody looks at another window: nothing is held. Triggers and buttons count again only after
  // they have been at rest, so that what was held all the time does not push.
  [[nodiscard]] PadOrder let_go() noexcept;

 private:
  // Whether a button or trigger is held. One that was held when the pad came counts from its next press on.
  struct Held {
    bool held = false, may = false;
    void take(bool down, bool up) noexcept;
  };
  Held push_, spindle_, a_, b_;
  bool used_ = false;
};

// Shares of the two motors' full strength, 0 … 1: the heavy slow one, and the light fast one.
struct PadRumble {
  double low = 0, high = 0;
  friend bool operator==(const PadRumble&, const PadRumble&) = default;
};

// The heavy motor follows the force that the hand gets, as √(F / F_most): motors hardly turn at a tenth of their
// strength, so a straight line would hide a light touch. The light one runs at half of that while material goes. At
// rest below kFelt_n, where only a hand's tremble is left, and where the most is not known (0).
inline constexpr double kFelt_n = 0.3;
[[nodiscard]] PadRumble rumble_of(double force_n, double most_n, bool cuts) noexcept;

}  // namespace osteon
