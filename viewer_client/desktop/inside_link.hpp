// The inside of the room's bone for the window. It is fetched and followed while a picture of it is visible, and by
// nothing else.
#pragma once
#include <QObject>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "viewer_client/inside/inside_bone.hpp"

namespace osteon {

class RoomLink;

// [GUI thread] It never waits for the bone. When a painter's picture is hidden, it waits until that painter rests.
class InsideLink : public QObject {
 public:
  ~InsideLink() override;

  // A room was joined. It must outlive the next call. `case_folder`: of the case, if it is on this computer; else
  // empty. Null: there is no room.
  void set_room(RoomLink* room, const std::filesystem::path& case_folder = {});
  // What this painter draws can be seen, or cannot any more. It may be told again.
  void set_visible(const std::shared_ptr<InsidePainter>& painter, bool visible);
  // A painter has a new request.
  void wake();
  // None: no room, or no picture is visible.
  [[nodiscard]] std::optional<InsideStatus> status() const;

 private:
  void hold(bool wanted);

  RoomLink* room_ = nullptr;
  std::filesystem::path case_folder_;
  std::vector<std::shared_ptr<InsidePainter>> painters_;  // those that are visible; shared with their owners
  // Where a job of the room's own thread puts it, and another one ends it. Shared with both.
  std::shared_ptr<std::shared_ptr<InsideBone>> slot_;
  std::shared_ptr<InsideBone> inside_;  // the same, once it is there
  bool holds_ = false;                  // the room was asked to hold the bone
};

}  // namespace osteon
