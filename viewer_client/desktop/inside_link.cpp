#include "viewer_client/desktop/inside_link.hpp"

#include <algorithm>
#include <utility>

#include "viewer_client/desktop/room_link.hpp"

namespace osteon {

InsideLink::~InsideLink() { set_room(nullptr); }

void InsideLink::set_room(RoomLink* room, const std::filesystem::path& case_folder) {
  if (holds_) hold(false);
  room_ = room;
  case_folder_ = case_folder;
  if (room_ != nullptr && !painters_.empty()) hold(true);
}

void InsideLink::set_visible(const std::shared_ptr<InsidePainter>& painter, bool visible) {
  const auto known = std::ranges::find(painters_, painter);
  if (visible == (known != painters_.end())) return;
  if (visible) {
    painters_.push_back(painter);
    if (inside_) inside_->add(painter);
  } else {
    painters_.erase(known);
    if (inside_) inside_->remove(*painter);
  }
  if (room_ != nullptr && holds_ == painters_.empty()) hold(!painters_.empty());
}

// The room's own thread makes and ends what it shows, because the end waits. It does one job after the other, so each
// finds what the one before it has left.
void InsideLink::hold(bool wanted) {
  holds_ = wanted;
  if (!wanted) {
    if (inside_) inside_->end();
    inside_.reset();
    // The job has the last share. Without a job, the end waits here, as that of the room does.
    room_->ask(
        [ended = std::exchange(slot_, nullptr)](RoomSubscription& room) {
          ended->reset();
          room.hold_bone(false);
          return Result<RoomAnswer>(RoomAnswer{});
        },
        [](const Result<RoomAnswer>&) {});
    return;
  }
  slot_ = std::make_shared<std::shared_ptr<InsideBone>>();
  room_->ask(
      [made = slot_, options = InsideOptions{.case_folder = case_folder_}](RoomSubscription& room) {
        room.hold_bone(true);
        if (std::shared_ptr<HeldBone> held = room.held_bone()) *made = InsideBone::start(std::move(held), options);
        return Result<RoomAnswer>(RoomAnswer{});
      },
      [this, made = slot_](const Result<RoomAnswer>&) {
        if (made != slot_) return;  // it was switched off meanwhile
        inside_ = *made;
        if (!inside_) return;
        for (const std::shared_ptr<InsidePainter>& painter : painters_) inside_->add(painter);
      });
}

void InsideLink::wake() {
  if (inside_) inside_->wake();
}

std::optional<InsideStatus> InsideLink::status() const {
  if (inside_) return inside_->status();
  return holds_ ? std::optional(InsideStatus{}) : std::nullopt;
}

}  // namespace osteon
