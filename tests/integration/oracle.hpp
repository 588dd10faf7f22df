// Records outside of the server what it has acknowledged, from what its clients received.
#pragma once
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "common/wire/room_client.hpp"

namespace osteon::test {

// Any thread.
class Oracle {
 public:
  Oracle() = default;
  Oracle(const Oracle& other);
  Oracle& operator=(const Oracle&) = delete;

  void asked();                                      // a request that becomes at most one log entry
  void heard(RoomSeq place);                         // of any event
  void heard_cut(RoomSeq place, std::string bytes);  // of a v1::Cut
  void heard_mark(RoomSeq place, std::string label);
  void heard_join(AuthorId author);  // its sequence number is not sent
  void heard_kept(const wire::DurableSeq& kept);

  [[nodiscard]] std::uint64_t acknowledged() const;            // the largest sequence number that any client received
  [[nodiscard]] std::uint64_t most() const;                    // largest possible number of log entries
  [[nodiscard]] std::optional<wire::DurableSeq> kept() const;  // the newest witness
  // What the lines of an export lack or have changed, up to a sequence number. Empty: nothing.
  [[nodiscard]] std::string lacks(std::string_view lines, std::uint64_t up_to) const;

 private:
  mutable std::mutex mutex_;
  std::uint64_t asked_ = 0, furthest_ = 0;
  std::map<std::uint64_t, std::string> cuts_, marks_;  // by sequence number
  std::set<std::uint64_t> joins_;                      // authors
  std::optional<wire::DurableSeq> kept_;
};

// A haptic client without a bone. It cuts without end, as fast as its room takes the cuts. It reports to the oracle
// what it receives.
class LightHand {
 public:
  // Errors: those of wire::join_room.
  [[nodiscard]] static Result<std::unique_ptr<LightHand>> come(const std::string& address, const std::string& name,
                                                               Oracle& oracle, std::uint64_t seed);
  // The same author again, at the server that is now at `address`. It brings what the oracle knows to be durable.
  [[nodiscard]] static Result<std::unique_ptr<LightHand>> come_again(const std::string& address,
                                                                     const wire::JoinedRoom& before, Oracle& oracle,
                                                                     std::uint64_t seed);
  ~LightHand();
  LightHand(const LightHand&) = delete;
  LightHand& operator=(const LightHand&) = delete;

  [[nodiscard]] const wire::JoinedRoom& room() const { return room_; }
  [[nodiscard]] std::uint64_t decided() const { return decided_; }  // own cuts
  // Why its stream ended. Empty: it has not ended.
  [[nodiscard]] std::optional<std::string> ended() const;
  [[nodiscard]] std::string rejected() const;  // reason of its newest rejected cut
  // Marks the moment. False: there was no answer.
  [[nodiscard]] bool mark(const std::string& label);

 private:
  struct Stream;
  LightHand(wire::JoinedRoom room, Oracle& oracle, std::uint64_t seed);
  void read();
  void cut();

  wire::JoinedRoom room_;
  Oracle* oracle_;
  const std::uint64_t seed_;
  std::unique_ptr<Stream> stream_;
  std::atomic<bool> over_{false}, complete_{false};
  std::atomic<std::uint64_t> decided_{0}, lease_{0};
  mutable std::mutex mutex_;
  std::optional<std::string> ended_;
  std::string rejected_;
  std::thread cutter_, reader_;  // the second joins the first
};

}  // namespace osteon::test
