// Turns the controls of a game pad into commands for the tool, and a force into the strength of the pad's motors. Pure
// numbers: no device, no I/O and no clock.
#pragma once
#include <optional>

#include <Eigen/Core>

namespace osteon {

// A game pad's controls.
struct GamePadState {
  Eigen::Vector2d left = Eigen::Vector2d::Zero(), right = Eigen::Vector2d::Zero();  // sticks, −1 … 1: x right, y up
  double left_trigger = 0, right_trigger = 0;                                       // 0 … 1
  bool a = false, b = false, shoulder = false;                                      // shoulder: any of the two
};

// What the pad asks for in one tick.
struct GamePadCommand {
  // Motion of the tool across the picture, and its turn: fractions −1 … 1 of the fastest, x right, y up.
  Eigen::Vector2d slide = Eigen::Vector2d::Zero(), turn = Eigen::Vector2d::Zero();
  bool push = false, push_begins = false;  // the right trigger is pulled; since this tick
  double push_n = 0;                       // kLeastPush_n to kMostPush_n while `push`, else 0
  bool fine = false;                       // motion ten times smaller; slide and turn are not scaled by it
  std::optional<bool> spindle;             // the left trigger was pulled or let go in this tick
  bool toggles_spindle = false;            // A went down in this tick
  bool undoes = false;                     // B went down in this tick
  bool used = false;                       // a control is not at rest, or came to rest in this tick
};

// A stick's response: zero up to a deflection of `rest` (the dead zone), 1 at the rim, and u² between, where u is the
// share of the way from `rest` to the rim. So it begins without a step and without a corner, and small deflections make
// fine motions. The direction stays. Corners of a square stick count as the rim.
[[nodiscard]] Eigen::Vector2d shaped_stick(const Eigen::Vector2d& stick, double rest) noexcept;

// [one thread]
class GamePadMapping {
 public:
  static constexpr double kStickRest = 0.15;
  // Hysteresis: a trigger counts as pulled above kTriggerPulled, until it is below kTriggerRest. The push grows
  // linearly from kTriggerPulled on, so that it begins with the least push.
  static constexpr double kTriggerRest = 0.08, kTriggerPulled = 0.12;

  [[nodiscard]] GamePadCommand step(const GamePadState& state) noexcept;
  // Releases all controls: the pad is unplugged, or another window is in front. A trigger or button counts again only
  // after it has been at rest, so that one that was held all the time does not push.
  [[nodiscard]] GamePadCommand release_all() noexcept;

 private:
  // Whether a button or trigger is held. One that was held when the pad was plugged in counts from its next press on.
  struct Held {
    bool held = false, may = false;
    void take(bool down, bool up) noexcept;
  };
  Held push_, spindle_, a_, b_;
  bool used_ = false;
};

// Shares of the two motors' full strength, 0 … 1: the heavy slow one, and the light fast one.
struct GamePadRumble {
  double low = 0, high = 0;
  friend bool operator==(const GamePadRumble&, const GamePadRumble&) = default;
};

// The heavy motor follows the force on the hand as sqrt(F / F_most): motors hardly turn at a tenth of their strength,
// so a proportional law would hide a light touch. The light motor runs at half of that strength while the tool cuts.
// Both rest below kFelt_n, where only the hand's tremor is left, and while F_most is not known (0).
inline constexpr double kFelt_n = 0.3;
[[nodiscard]] GamePadRumble rumble_of(double force_n, double most_n, bool cuts) noexcept;

}  // namespace osteon
