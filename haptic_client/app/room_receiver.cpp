#include "haptic_client/app/room_receiver.hpp"

#include <functional>
#include <utility>
#include <variant>

namespace osteon::haptic {

RoomCallbacks RoomReceiver::callbacks() {
  return {
      .message = [this](RoomMessage&& message) { receive(std::move(message)); },
      .partner = [this](const CuttingState& state) { receive_partner(state); },
      .stop_flag =
          [this](std::uint64_t lease_epoch, bool frozen) {
            exchange_.stop_flag = packed(StopFlag{lease_epoch, frozen});
          },
      .bone =
          [this](const MountPose& seen) {
            exchange_.mount_updates.store(MountUpdate{line_, seen});
          },
      .lost = [this](const Error& why) { end_.give_up(why); },
  };
}

void RoomReceiver::receive(RoomMessage&& message) {
  // Passed to the loop at once: it must not wait for earlier work of the replica.
  if (const auto* decided = std::get_if<HandSupervised>(&message))
    exchange_.restrictions.store(haptic_restrictions(decided->supervision, decided->seq, decided->lease_epoch, tools_));
  if (std::holds_alternative<Interrupted>(message)) ++line_;
  if (queue_.push(std::move(message))) last_received_ = std::chrono::steady_clock::now();
}

void RoomReceiver::receive_partner(const CuttingState& state) {
  // The replica's thread makes the solid of a tool that is new here.
  if (!state.tool_name.empty() && named_tools_.size() < PartnerSolids::kMost &&
      named_tools_.insert(state.tool_name).second)
    queue_.push_tool(state.tool_name);
  // The entry with the oldest state is replaced.
  Partners::Partner* place = &partners_.of[0];
  for (Partners::Partner& partner : partners_.of) {
    if (partner.author == state.author) {
      place = &partner;
      break;
    }
    if (partner.received_ns < place->received_ns) place = &partner;
  }
  *place = {state.author,           state.state_seq, state.pose_bone_tool,
            state.pose_bone_device, mono_ns(),       std::hash<std::string>{}(state.tool_name)};
  exchange_.partners.store(partners_);
}

}  // namespace osteon::haptic
