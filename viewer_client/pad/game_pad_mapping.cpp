#include "viewer_client/pad/game_pad_mapping.hpp"

#include <algorithm>
#include <cmath>

#include "common/input/pointer_link.hpp"

namespace osteon {

Eigen::Vector2d shaped_stick(const Eigen::Vector2d& stick, double rest) noexcept {
  const double out = stick.norm();
  if (!(out > rest)) return Eigen::Vector2d::Zero();
  const double way = (std::min(out, 1.0) - rest) / (1.0 - rest);
  return way * way / out * stick;
}

void GamePadMapping::Held::take(bool down, bool up) noexcept {
  if (up) held = false, may = true;
  if (down && may) held = true;
}

GamePadCommand GamePadMapping::step(const GamePadState& state) noexcept {
  const bool pushed = push_.held, ran = spindle_.held, a = a_.held, b = b_.held;
  push_.take(state.right_trigger > kTriggerPulled, state.right_trigger < kTriggerRest);
  spindle_.take(state.left_trigger > kTriggerPulled, state.left_trigger < kTriggerRest);
  a_.take(state.a, !state.a);
  b_.take(state.b, !state.b);
  GamePadCommand command;
  command.slide = shaped_stick(state.left, kStickRest);
  command.turn = shaped_stick(state.right, kStickRest);
  command.push = push_.held;
  command.push_begins = push_.held && !pushed;
  if (command.push) {
    const double pulled = std::clamp((state.right_trigger - kTriggerPulled) / (1.0 - kTriggerPulled), 0.0, 1.0);
    command.push_n = kLeastPush_n + pulled * (kMostPush_n - kLeastPush_n);
  }
  command.fine = state.shoulder;
  if (spindle_.held != ran) command.spindle = spindle_.held;
  command.toggles_spindle = a_.held && !a;
  command.undoes = b_.held && !b;
  const bool used =
      !command.slide.isZero() || !command.turn.isZero() || command.push || spindle_.held || a_.held || b_.held;
  command.used = used || used_;
  used_ = used;
  return command;
}

GamePadCommand GamePadMapping::release_all() noexcept {
  GamePadCommand command;
  if (spindle_.held) command.spindle = false;
  command.used = used_;
  *this = GamePadMapping();
  return command;
}

GamePadRumble rumble_of(double force_n, double most_n, bool cuts) noexcept {
  if (!(force_n >= kFelt_n) || !(most_n > 0.0)) return {};
  const double low = std::sqrt(std::min(1.0, force_n / most_n));
  return {low, cuts ? 0.5 * low : 0.0};
}

}  // namespace osteon
