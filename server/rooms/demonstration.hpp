// Repeats cuts of a journal in a live room. A simulated tool makes them; the room judges them like all other cuts.
// People see and hear it, and their tools can be guided along it.
#pragma once
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "server/room/log_entry.hpp"
#include "server/storage/journal_entries.hpp"

namespace osteon {

class Authorizer;
struct Caller;
class Demonstration;
class RoomRuntime;

struct WhatToShow {
  std::string room;    // room of the journal; empty: this room's own
  AuthorId of;         // author of the cuts; null: all authors
  RoomSeq from, to;    // both included; null: from the beginning, to the end
  double speed = 1.0;  // times the original speed
};

struct Shown {
  AuthorId demonstrator;
  std::size_t cuts = 0;
};

// Where demonstrations happen, and where their cuts come from.
struct DemonstrationPlace {
  // Reads the journal of a room from the beginning up to an event, or until `take` returns false. Errors: not_found (no
  // such room), unavailable (it has no journal, or the server is stopping), and those of reading.
  using ReadEntries = std::function<Result<RoomGenesis>(const std::string& room, RoomSeq to,
                                                        const std::function<bool(const LogEntry&)>& take)>;
  std::string room;
  RoomRuntime& runtime;
  ReadEntries read;
  Authorizer* authorizer = nullptr;  // null: everybody may do everything
};

// The demonstrations of one room. Any thread may call it but those of the room. Each demonstration has a thread.
class Demonstrations {
 public:
  static constexpr std::size_t kMost = 4, kMostCuts = 100'000;
  static constexpr double kLeastSpeed = 0.001, kMostSpeed = 100.0;

  Demonstrations();
  ~Demonstrations();
  Demonstrations(const Demonstrations&) = delete;
  Demonstrations& operator=(const Demonstrations&) = delete;

  // Reads the journal first, which takes a while; stops reading when all demonstrations are to end. Cuts that were
  // undone by `to` are not shown. While the demonstrator is stopped or its tool is not allowed, the tool is shown at
  // rest. A demonstration ends when the caller loses the right to start one, so nothing continues for a person whose
  // rights are revoked. Errors: invalid_input (the speed; another case; more than kMostCuts); not_found (no such room,
  // or no cut in that range); unavailable (that room has no journal, kMost demonstrations are running, the room is
  // closed, or the server is stopping); denied (`caller` no longer has the right); and those of reading.
  [[nodiscard]] Result<Shown> begin(const DemonstrationPlace& in, AuthorId by, const Caller& caller,
                                    const WhatToShow& what);
  // Error not_found: that author runs no demonstration. If a demonstration ended, the error says why.
  [[nodiscard]] Result<void> end(AuthorId demonstrator);
  // Ends all demonstrations for good, also those that are about to begin. Called when the room closes or the server
  // stops. All have ended when it returns.
  void end_all();

 private:
  Mutex mutex_{LockRank::demonstrations};
  // Shared with the cuts that they have queued.
  std::vector<std::shared_ptr<Demonstration>> going_on_ OSTEON_GUARDED_BY(mutex_);
  std::atomic<bool> over_{false};
};

}  // namespace osteon
