#include "tests/support/pad/virtual_pad.hpp"

#include <SDL.h>

#include <cmath>

namespace osteon::test {

namespace {

constexpr std::uint16_t kVendor = 0x1209, kProduct = 0x0001;  // given to tests by pid.codes

Sint16 raw(double share) { return static_cast<Sint16>(std::lround(32767.0 * share)); }

}  // namespace

VirtualPad::VirtualPad() {
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
  SDL_SetHint(SDL_HINT_JOYSTICK_HIDAPI, "0");
  SDL_SetHint(SDL_HINT_GAMECONTROLLER_IGNORE_DEVICES_EXCEPT, "0x1209/0x0001");
  SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER);
}

VirtualPad::~VirtualPad() {
  unplug();
  SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
}

bool VirtualPad::plug_in() {
  SDL_VirtualJoystickDesc pad{};
  pad.version = SDL_VIRTUAL_JOYSTICK_DESC_VERSION;
  pad.type = SDL_JOYSTICK_TYPE_GAMECONTROLLER;
  pad.naxes = SDL_CONTROLLER_AXIS_MAX;
  pad.nbuttons = SDL_CONTROLLER_BUTTON_MAX;
  pad.vendor_id = kVendor;
  pad.product_id = kProduct;
  pad.name = "Virtual Pad";
  pad.userdata = this;
  pad.Rumble = [](void* self, Uint16 low, Uint16 high) {
    auto& me = *static_cast<VirtualPad*>(self);
    const std::lock_guard lock(me.mutex_);
    me.heard_.push_back({low, high});
    return 0;
  };
  const int index = SDL_JoystickAttachVirtualEx(&pad);
  if (index < 0) return false;
  SDL_Joystick* joystick = SDL_JoystickOpen(index);
  joystick_ = joystick;
  instance_ = SDL_JoystickGetDeviceInstanceID(index);
  if (joystick == nullptr) return false;
  hold({});
  return true;
}

std::vector<VirtualPad::Motors> VirtualPad::heard() const {
  const std::lock_guard lock(mutex_);
  return heard_;
}

bool VirtualPad::quiet() const {
  const std::lock_guard lock(mutex_);
  return heard_.empty() || (heard_.back().low == 0 && heard_.back().high == 0);
}

void VirtualPad::lock_sdl() { SDL_LockJoysticks(); }
void VirtualPad::unlock_sdl() { SDL_UnlockJoysticks(); }

void VirtualPad::unplug() {
  if (joystick_ == nullptr) return;
  SDL_JoystickClose(static_cast<SDL_Joystick*>(joystick_));
  joystick_ = nullptr;
  for (int i = 0; i < SDL_NumJoysticks(); ++i)
    if (SDL_JoystickGetDeviceInstanceID(i) == instance_) return (void)SDL_JoystickDetachVirtual(i);
}

void VirtualPad::hold(const GamePadState& state) {
  auto* joystick = static_cast<SDL_Joystick*>(joystick_);
  const auto axis = [&](int which, double share) { SDL_JoystickSetVirtualAxis(joystick, which, raw(share)); };
  axis(SDL_CONTROLLER_AXIS_LEFTX, state.left.x());
  axis(SDL_CONTROLLER_AXIS_LEFTY, -state.left.y());  // a pad's own y is down
  axis(SDL_CONTROLLER_AXIS_RIGHTX, state.right.x());
  axis(SDL_CONTROLLER_AXIS_RIGHTY, -state.right.y());
  // A trigger at rest is at the axis' lower end.
  axis(SDL_CONTROLLER_AXIS_TRIGGERLEFT, 2.0 * state.left_trigger - 1.0);
  axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 2.0 * state.right_trigger - 1.0);
  SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_A, state.a);
  SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_B, state.b);
  SDL_JoystickSetVirtualButton(joystick, SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, state.shoulder);
}

}  // namespace osteon::test
