#include "viewer_client/pad/game_pad.hpp"

#include <SDL.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace osteon {

namespace {

double axis(SDL_GameController* pad, SDL_GameControllerAxis which) {
  return std::clamp(SDL_GameControllerGetAxis(pad, which) / 32767.0, -1.0, 1.0);
}

bool button(SDL_GameController* pad, SDL_GameControllerButton which) {
  return SDL_GameControllerGetButton(pad, which) != 0;
}

std::uint16_t motor(double share) {
  return static_cast<std::uint16_t>(std::lround(65535.0 * std::clamp(share, 0.0, 1.0)));
}

}  // namespace

struct GamePad::Impl {
  bool started = false;
  SDL_GameController* pad = nullptr;
  std::string name;
  GamePadState state;

  void close() {
    if (pad == nullptr) return;
    // Closing does not stop them while somebody else has the pad open.
    if (SDL_GameControllerGetAttached(pad)) SDL_GameControllerRumble(pad, 0, 0, 0);
    SDL_GameControllerClose(pad);
    pad = nullptr;
    state = {};
  }
  void read() {
    state.left = {axis(pad, SDL_CONTROLLER_AXIS_LEFTX), -axis(pad, SDL_CONTROLLER_AXIS_LEFTY)};
    state.right = {axis(pad, SDL_CONTROLLER_AXIS_RIGHTX), -axis(pad, SDL_CONTROLLER_AXIS_RIGHTY)};
    state.left_trigger = std::max(0.0, axis(pad, SDL_CONTROLLER_AXIS_TRIGGERLEFT));
    state.right_trigger = std::max(0.0, axis(pad, SDL_CONTROLLER_AXIS_TRIGGERRIGHT));
    state.a = button(pad, SDL_CONTROLLER_BUTTON_A);
    state.b = button(pad, SDL_CONTROLLER_BUTTON_B);
    state.shoulder =
        button(pad, SDL_CONTROLLER_BUTTON_LEFTSHOULDER) || button(pad, SDL_CONTROLLER_BUTTON_RIGHTSHOULDER);
  }
};

GamePad::GamePad() : impl_(std::make_unique<Impl>()) {
  SDL_SetMainReady();
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  // Without a window of SDL's own no pad would be in front. Who looks at which window is known to the caller.
  SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");
  // SDL's own drivers would open raw devices, which others may hold. The kernel's run the motors too.
  SDL_SetHint(SDL_HINT_JOYSTICK_HIDAPI, "0");
  SDL_SetHint(SDL_HINT_ACCELEROMETER_AS_JOYSTICK, "0");
  impl_->started = SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER) == 0;
}

GamePad::~GamePad() {
  impl_->close();
  if (impl_->started) SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
  SDL_TLSCleanup();  // what SDL keeps for a thread that it did not start
}

GamePad::Change GamePad::poll() {
  if (!impl_->started) return Change::none;
  SDL_GameControllerUpdate();
  SDL_FlushEvents(SDL_FIRSTEVENT, SDL_LASTEVENT);  // the state is read, so nobody takes them
  if (impl_->pad != nullptr) {
    if (SDL_GameControllerGetAttached(impl_->pad)) {
      impl_->read();
      return Change::none;
    }
    impl_->close();
    return Change::lost;
  }
  for (int i = 0; i < SDL_NumJoysticks(); ++i) {
    if (!SDL_IsGameController(i)) continue;
    impl_->pad = SDL_GameControllerOpen(i);
    if (impl_->pad == nullptr) continue;
    const char* name = SDL_GameControllerName(impl_->pad);
    impl_->name = name != nullptr ? name : "";
    impl_->read();
    return Change::opened;
  }
  return Change::none;
}

bool GamePad::is_open() const { return impl_->pad != nullptr; }

const std::string& GamePad::name() const { return impl_->name; }

const GamePadState& GamePad::state() const { return impl_->state; }

void GamePad::rumble(const GamePadRumble& strength) {
  if (impl_->pad != nullptr)
    SDL_GameControllerRumble(impl_->pad, motor(strength.low), motor(strength.high), kRumble_ms);
}

}  // namespace osteon
