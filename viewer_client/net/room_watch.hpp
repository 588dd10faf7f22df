// A viewer's connection to the server: joins the room and fills an Inbox from its two streams.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "viewer_client/scene/inbox.hpp"

namespace osteon {

struct RoomWatchOptions {
  std::string address;          // host:port
  std::string name = "viewer";  // shown to others
  std::chrono::milliseconds patience{5000};
  bool keep_trying = false;  // after the connection was lost: until it is back, not just for `patience`
};

struct WatchedRoom {
  std::string case_title;
  double pitch_mm = 0;
  Box bounds;
};

// Two reader threads, one for each stream, from start() to the destructor.
class RoomWatch {
 public:
  // Joins first. Errors: unavailable, unsupported, cancelled; one sentence each. `inbox` must outlive the watch;
  // `stop` is asked from several threads.
  [[nodiscard]] static Result<std::unique_ptr<RoomWatch>> start(const RoomWatchOptions& options, Inbox& inbox,
                                                                std::function<bool()> stop);
  ~RoomWatch();

  [[nodiscard]] const WatchedRoom& room() const;
  // What went wrong for good since the start; none while the room is watched.
  [[nodiscard]] std::optional<Error> failure_seen() const;
  // The connection is lost and being made anew.
  [[nodiscard]] bool interrupted() const;

 private:
  struct Impl;
  explicit RoomWatch(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
