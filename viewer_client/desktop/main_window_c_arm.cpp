// What the C-arm gets of the room: the tools and items in its beam, and the shots of the others.
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/c_arm_panel.hpp"
#include "viewer_client/desktop/main_window.hpp"
#include "viewer_client/scene/held_tools.hpp"

namespace osteon {

CArmPanel* MainWindow::make_c_arm() {
  CArmPanel::Events events;
  events.in_beam = [this] {
    CArmPanel::InBeam seen;
    const SceneUpdater* updater = view_->updater();
    if (updater == nullptr || !room_) return seen;
    seen.states = updater->states();
    seen.items = updater->items();
    seen.tools = updater->tools();
    const CuttingState* own = own_state(seen.states, room_->people(), own_name_.toStdString());
    if (own != nullptr && !own->tool_name.empty()) seen.tip_mm = own->pose_bone_tool.position_mm;
    return seen;
  };
  events.say = [this](const QString& sentence) { say(sentence); };
  events.shots = [this] { return room_ ? ShotsOfAll{room_->self(), room_->people(), room_->shots()} : ShotsOfAll{}; };
  events.share = [this](const SharedShots::Message& message, RoomLink::Answered answered) {
    if (!room_) return;
    room_->ask([message](RoomSubscription& room) { return room.share_shots(message.run, message.session); },
               std::move(answered));
  };
  return new CArmPanel(inside_, std::move(events));
}

}  // namespace osteon
