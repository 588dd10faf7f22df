// A viewer's connection to the server. It joins the room and fills a RenderQueue from the room's two streams and its
// plan.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/c_arm_shot.hpp"
#include "common/volume/case_cache.hpp"
#include "common/wire/credentials.hpp"
#include "common/wire/room_client.hpp"
#include "viewer_client/net/held_bone.hpp"
#include "viewer_client/scene/item_place.hpp"
#include "viewer_client/scene/render_queue.hpp"
#include "viewer_client/scene/room_answer.hpp"

namespace osteon {

struct RoomSubscriptionOptions {
  std::string address;  // host:port
  std::string room{};   // name of the room; empty: the only open room
  wire::ClientCredentials credentials{};
  std::string name = "viewer";  // shown to others
  std::chrono::milliseconds patience{5000};
  // For the first connection, where nothing listens. Where something does, `patience` counts.
  std::chrono::milliseconds refused_patience = patience;
  // The window's first view of a bone with these bounds. None: the whole bone in full detail.
  std::function<ViewFrustum(const Box&)> first_look{};
  bool keep_trying = false;  // after a lost connection: retry without end, not only for `patience`
  std::filesystem::path cache = default_case_cache();  // of the cases of hold_bone()
};

struct WatchedRoom {
  std::string case_title;
  double pitch_mm = 0;
  Box bounds;
};

// From start() to the destructor it has four threads: one reader for each stream, one that sends the view, and one that
// reads the plan and ends.
class RoomSubscription {
 public:
  // Joins first. Errors: unavailable, unsupported, cancelled; each with one sentence. `render_queue` must outlive the
  // subscription. `stop` is called from several threads.
  [[nodiscard]] static Result<std::unique_ptr<RoomSubscription>> start(const RoomSubscriptionOptions& options,
                                                                       RenderQueue& render_queue,
                                                                       std::function<bool()> stop);
  ~RoomSubscription();
  // Ends the streams, and each request that waits for an answer, with an error. Returns at once. Any thread.
  void end();

  [[nodiscard]] const WatchedRoom& room() const;
  // The newest join. It changes after a lost connection.
  [[nodiscard]] wire::JoinedRoom joined() const;
  // The error that ended the subscription for good. None while it is running.
  [[nodiscard]] std::optional<Error> failure_seen() const;
  // The connection is lost and the client is reconnecting.
  [[nodiscard]] bool interrupted() const;

  // Sets the window's view; returns at once. The server receives real changes only, at most 4 times a second.
  void look(const ViewFrustum& from);

  // Whether a picture of the bone's inside is shown: then its case is fetched, and a fifth thread follows each cut. Off
  // at first; nothing of it is sent or kept then. Waits for the end of that thread when it is switched off, also if
  // somebody still shares held_bone(): that bone stays as it is.
  void hold_bone(bool wanted);
  // Null while it is off. Shared with whoever looks at the bone at the moment.
  [[nodiscard]] std::shared_ptr<HeldBone> held_bone() const;

  // Requests to the room. Each waits for the answer. Errors: invalid_input, not_found (no such tool or item),
  // unavailable (nothing to undo, no answer).
  [[nodiscard]] Result<RoomAnswer> ping();  // a question without an effect, to see how long the answer takes
  // The newest press of the own C-arm so far, for the others in the room. Also: denied (an observer's shots are not for
  // others), unsupported (the server is too old).
  [[nodiscard]] Result<RoomAnswer> share_shots(const ShotRun& run, const ShotTotals& session);
  // Draws for all; with a number it changes an own drawing. The answer is its number. Also: denied (the role may not).
  [[nodiscard]] Result<std::uint32_t> draw(const Annotation& drawn);
  [[nodiscard]] Result<void> wipe_off(std::uint32_t annotation);
  [[nodiscard]] Result<RoomAnswer> undo(std::uint32_t count);
  [[nodiscard]] Result<RoomAnswer> undo_to(RoomSeq mark);
  [[nodiscard]] Result<RoomAnswer> mark(const std::string& label);
  [[nodiscard]] Result<RoomAnswer> redo(std::uint32_t count);
  [[nodiscard]] Result<RoomAnswer> remove_body(BodyId body);
  [[nodiscard]] Result<RoomAnswer> place(const std::string& tool, const ItemPlace& where, BodyId body);
  // For a placed item. The server applies the rules of common/tools/scene.hpp to its bone.
  [[nodiscard]] Result<RoomAnswer> move_item(std::uint32_t item, const ItemPlace& where);
  [[nodiscard]] Result<RoomAnswer> turn_item(std::uint32_t item, double turns);
  [[nodiscard]] Result<RoomAnswer> seat_item(std::uint32_t item, double most_mm);
  [[nodiscard]] Result<RoomAnswer> remove_item(std::uint32_t item);
  [[nodiscard]] Result<RoomAnswer> save(const std::string& file_name);  // on the server

 private:
  struct Impl;
  explicit RoomSubscription(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
