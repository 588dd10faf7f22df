// Cuts of a journal that happen again in a live room: made by a tool of its own, judged like anybody's, seen and heard,
// so that hands can be guided along it.
#pragma once
#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/result.hpp"

namespace osteon {

struct Caller;
class Demonstration;
class OpenRoom;
class Rooms;

struct WhatToShow {
  std::string room;    // whose journal; empty: the room's own
  AuthorId of;         // whose cuts; null: everyone's
  RoomSeq from, to;    // both included; null: from its beginning, to its end
  double speed = 1.0;  // times as fast as it happened
};

struct Shown {
  AuthorId demonstrator;
  std::size_t cuts = 0;
};

// Those of one room. Any thread but the room's own. Each has a thread.
class Demonstrations {
 public:
  static constexpr std::size_t kMost = 4, kMostCuts = 100'000;
  static constexpr double kLeastSpeed = 0.001, kMostSpeed = 100.0;

  Demonstrations();
  ~Demonstrations();
  Demonstrations(const Demonstrations&) = delete;
  Demonstrations& operator=(const Demonstrations&) = delete;

  // Reads the journal first, which takes a while; given up where all are to end. Cuts that were taken back by `to` are
  // not shown. While the demonstrator is stopped or without its tool, the tool is seen at rest. Errors: invalid_input
  // (the speed; another case; more than kMostCuts), not_found (no such room, no cut there), unavailable (that room is
  // not kept, kMost go on, the room is closed, the server is to stop), denied (`caller` may not any more), and those of
  // reading. It ends once the caller may not start one any more: who is revoked leaves nothing going on.
  [[nodiscard]] Result<Shown> begin(Rooms& rooms, OpenRoom& in, AuthorId by, const Caller& caller,
                                    const WhatToShow& what);
  // Error not_found: no demonstration of that author goes on; of one that was ended, why.
  [[nodiscard]] Result<void> end(AuthorId demonstrator);
  // For good, also of those that are about to begin: the room is closed, or the server is to stop. They are over when
  // it returns.
  void end_all();

 private:
  std::mutex mutex_;  // taken before those of the room, the authorizer and a demonstration, within none
  std::vector<std::shared_ptr<Demonstration>> going_on_;  // shared with the cuts that they have queued
  std::atomic<bool> over_{false};
};

}  // namespace osteon
