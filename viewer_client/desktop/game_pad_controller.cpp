#include "viewer_client/desktop/game_pad_controller.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "viewer_client/desktop/bone_view.hpp"

namespace osteon {

namespace {

constexpr double kLongestTick_s = 0.1;  // a window that was busy does not throw the tool far away
// SDL waits for the device, so nobody knows whether the user has let go. The usual age is 8 ms.
constexpr std::chrono::milliseconds kStalled{150};

}  // namespace

GamePadController::GamePadController(BoneView& view, Events events) : view_(view), events_(std::move(events)) {
  ticked_.start();
}

void GamePadController::tick(bool may_act, const RumbleInput& feel) {
  const double dt_s = std::min(kLongestTick_s, 1e-3 * static_cast<double>(ticked_.restart()));
  const GamePadReading read = pad_.take();
  const QString name = read.name.empty() ? tr("The game pad") : QString::fromStdString(read.name);
  if (read.lost) {
    release_all();
    events_.said(tr("%1 was unplugged. It no longer leads the tool.").arg(name));
  }
  if (read.opened) {
    mapping_ = GamePadMapping();
    events_.said(tr("%1: choose a tool. The left stick moves it, the right trigger pushes.").arg(name));
  }
  if (!read.is_open) return;
  if (!may_act || read.age > kStalled) return rest();
  const GamePadCommand command = mapping_.step(read.state);
  view_.follow_pad(command, dt_s);
  if (command.undoes) events_.undo();
  pad_.rumble(rumble_of(feel.force_n, feel.most_n, feel.cuts));
}

void GamePadController::rest() {
  release_all();
  pad_.rumble({});
}

void GamePadController::release_all() {
  view_.follow_pad(mapping_.release_all(), 0.0);
  view_.pad_gone();
}

}  // namespace osteon
