// A server on virtual time: a room, its journal on a disk in memory, and sessions like the server's streams. It pauses,
// crashes during writes, loses its power and its disk, and comes back.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/rooms/room_runtime.hpp"
#include "server/storage/room_store.hpp"
#include "tests/simulation/ledger.hpp"
#include "tests/simulation/sim_link.hpp"
#include "tests/simulation/sim_stream.hpp"
#include "tests/support/disk/memory_disk.hpp"

namespace osteon::test {

// Deliberate defects, to test that the invariants find them.
enum class Breakage {
  none,
  dedup,      // a cut that was sent again is accepted again
  ordering,   // sometimes two neighbouring entries change places
  skipping,   // sometimes an entry is left out
  replica,    // a returning client puts leaves over its present content, instead of replacing that content
  forgetful,  // the journal does not wait for the disk
  unsaid,     // sometimes a hand does not receive a decision about it
  pruning,    // what goes in datagrams is not sent over the stream, before the client has acknowledged it
  hasty,      // a session receives its first messages, except the leaves, before they are durable
};

// The tools of a new simulated room. They are few, because every program that opens or joins it makes them anew.
[[nodiscard]] std::shared_ptr<ToolBox> few_tools();

struct ServerCondition {
  CutLimits limits;
  std::size_t sector_bytes = 4096;
  std::chrono::nanoseconds late_most = std::chrono::milliseconds(1);  // of a tick
  double slow_writes = 0.03;  // share of ticks whose entries take up to 0.4 s to become durable
  double pauses = 0.0005;     // share of ticks that come 0.1 to 3 s late
  bool fast_path = false;     // the fast path is offered
  wire::LinkOptions link = wire::server_link_options();
  Breakage breakage = Breakage::none;
};

class SimServer {
 public:
  using Time = VirtualTime::Time;

  SimServer(VirtualTime& time, Ledger& ledger, Datagrams& datagrams, std::uint64_t seed, const Case& bone,
            const ServerCondition& condition);
  ~SimServer();
  SimServer(const SimServer&) = delete;
  SimServer& operator=(const SimServer&) = delete;

  // Events of the server. It comes back by itself, after 0.05 to 2 s.
  void boot();
  void crash(bool power);
  void restart();  // as by its operator: clients receive the reason, the journal is closed
  void lose_power_at(std::uint64_t nth_write_or_sync);
  // The room then closes, and the operator comes after a while. The journal on the failed disk is salvaged.
  void fail_disk_at(std::uint64_t nth_write_or_sync, int error, MemoryDisk::Lasting lasting);
  void jump_clock(Time by) { jumped_ += by; }
  void checkpoint();
  void rest();  // from now on none of these events happens
  [[nodiscard]] bool up() const { return runtime_ != nullptr; }

  // Requests as they arrive. While the server is down, no request is answered. A request that was not answered before a
  // crash is never answered.
  struct JoinRequest {
    std::string name;
    AuthorId resume;  // null: a new author
    std::string secret;
    std::optional<Witness> kept;
  };
  struct Joined {
    AuthorId author;
    std::uint64_t server_epoch = 0, lease_epoch = 0;
    std::string secret;
  };
  void join(const JoinRequest& request, std::function<void(const Result<Joined>&)> answer);
  void change(std::function<Result<RoomEvent>(Room&)> change, std::function<void(const Result<RoomEvent>&)> answer);
  void accept(const std::shared_ptr<SimStream>& stream);

  // For checks.
  [[nodiscard]] RoomRuntime& runtime() { return *runtime_; }
  [[nodiscard]] std::vector<LogEntry> entries();  // as they are on the disk
  [[nodiscard]] Digest replayed();                // room_hash of a new room with these entries
  [[nodiscard]] Digest live();                    // room_hash; runs a tick
  // Closes the room and opens it again: with a checkpoint of its end or without.
  [[nodiscard]] Digest reopened(bool with_checkpoint);
  [[nodiscard]] std::uint64_t crashes() const { return crashes_; }
  [[nodiscard]] std::uint64_t disk_failures() const { return disk_failures_; }
  [[nodiscard]] std::size_t most_behind() const { return most_behind_; }  // entries that waited for a session

 private:
  class Session;
  struct Wish;
  [[nodiscard]] bool power_is_out() const { return power_fails_ && disk_.has_failed(); }
  [[nodiscard]] RoomStore::Options options();
  void tick();
  void after_tick();
  void note_kept();  // before any client receives them
  void plan_tick();
  void boot_later();
  void down();  // the process is gone
  void recover();
  [[nodiscard]] Time now() const { return began_ + (time_.now() - booted_) + jumped_; }

  VirtualTime& time_;
  Ledger& ledger_;
  Datagrams& datagrams_;
  Random random_;
  const Case& bone_;
  const ServerCondition condition_;
  MemoryDisk disk_;
  std::filesystem::path file_ = "/room/journal";
  int recoveries_ = 0;
  bool made_ = false;  // a journal was made
  std::unique_ptr<RoomStore> store_;
  std::unique_ptr<RoomRuntime> runtime_;
  std::unique_ptr<SimLinks> links_;                 // null: no fast path
  std::vector<std::shared_ptr<Session>> sessions_;  // with streams and queued cuts
  std::uint64_t life_ = 0;                          // rises with every boot and crash
  std::uint64_t planned_tick_ = 0;                  // only the newest planned tick counts
  Time began_{}, booted_{}, jumped_{};              // the room's time at its boot
  Time writes_until_{};                             // the disk is busy until then
  bool power_fails_ = false, disk_fails_ = false, operator_comes_ = false, disk_has_failed_ = false, resting_ = false;
  std::uint64_t crashes_ = 0, disk_failures_ = 0;
  std::size_t most_behind_ = 0;
};

}  // namespace osteon::test
