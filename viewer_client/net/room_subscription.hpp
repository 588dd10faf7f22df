// A viewer's connection to the server: joins the room and fills an RenderQueue from its two streams.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/wire/credentials.hpp"
#include "common/wire/room_client.hpp"
#include "viewer_client/scene/item_place.hpp"
#include "viewer_client/scene/render_queue.hpp"
#include "viewer_client/scene/room_answer.hpp"

namespace osteon {

struct RoomSubscriptionOptions {
  std::string address;  // host:port
  std::string room{};   // which of the server's; empty: the only one that is open
  wire::ClientCredentials credentials{};
  std::string name = "viewer";  // shown to others
  std::chrono::milliseconds patience{5000};
  // From where the window looks at a bone with these bounds at first; none: it wants all of the bone in full.
  std::function<ViewFrustum(const Box&)> first_look;
  bool keep_trying = false;  // after the connection was lost: until it is back, not just for `patience`
};

struct WatchedRoom {
  std::string case_title;
  double pitch_mm = 0;
  Box bounds;
};

// From start() to the destructor two reader threads, one for each stream, and one that says where the window looks.
class RoomSubscription {
 public:
  // Joins first. Errors: unavailable, unsupported, cancelled; one sentence each. `render_queue` must outlive the watch;
  // `stop` is asked from several threads.
  [[nodiscard]] static Result<std::unique_ptr<RoomSubscription>> start(const RoomSubscriptionOptions& options,
                                                                       RenderQueue& render_queue,
                                                                       std::function<bool()> stop);
  ~RoomSubscription();

  [[nodiscard]] const WatchedRoom& room() const;
  // The newest one: another after the connection was lost.
  [[nodiscard]] wire::JoinedRoom joined() const;
  // What went wrong for good since the start; none while the room is watched.
  [[nodiscard]] std::optional<Error> failure_seen() const;
  // The connection is lost and being made anew.
  [[nodiscard]] bool interrupted() const;

  // Where the window looks now; returns at once. The server is told of a real change, at most 4 times a second.
  void look(const ViewFrustum& from);

  // What a viewer may ask of the room. They wait for the answer. Errors:
  // invalid_input, not_found (no such tool or item), unavailable (nothing to undo, no answer).
  [[nodiscard]] Result<RoomAnswer> undo(std::uint32_t count);
  [[nodiscard]] Result<RoomAnswer> undo_to(RoomSeq mark);
  [[nodiscard]] Result<RoomAnswer> mark(const std::string& label);
  [[nodiscard]] Result<RoomAnswer> redo(std::uint32_t count);
  [[nodiscard]] Result<RoomAnswer> remove_body(BodyId body);
  [[nodiscard]] Result<RoomAnswer> place(const std::string& tool, const ItemPlace& where, BodyId body);
  // Of an item that stands. By the rules of common/tools/scene.hpp, which the server applies to its bone.
  [[nodiscard]] Result<RoomAnswer> move_item(std::uint32_t item, const ItemPlace& where);
  [[nodiscard]] Result<RoomAnswer> turn_item(std::uint32_t item, double turns);
  [[nodiscard]] Result<RoomAnswer> seat_item(std::uint32_t item, double most_mm);
  [[nodiscard]] Result<RoomAnswer> remove_item(std::uint32_t item);
  [[nodiscard]] Result<RoomAnswer> save(const std::string& file_name);  // of the server

 private:
  struct Impl;
  explicit RoomSubscription(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
