// A server on virtual time: a room that is driven, its journal on a disk in memory, and sessions as the server's
// streams keep them. It pauses, crashes in the midst of writes, loses its power and its disk, and comes back.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/net/room_runtime.hpp"
#include "server/net/room_store.hpp"
#include "tests/simulation/ledger.hpp"
#include "tests/simulation/sim_link.hpp"
#include "tests/simulation/sim_stream.hpp"
#include "tests/support/disk/memory_disk.hpp"

namespace osteon::test {

// What is broken on purpose, to see that the invariants find it.
enum class Breakage {
  none,
  dedup,      // a cut that was sent again is taken again
  ordering,   // now and then two neighbouring entries change places
  skipping,   // now and then an entry is left out
  replica,    // on coming back a client takes leaves over what it holds, instead of taking on what is held there
  forgetful,  // the journal waits for no disk
  unsaid,     // now and then a hand is not told what was decided about it
  pruning,    // what goes in datagrams is not said over the stream, before the client says that it has come
  hasty,      // a session is told what it begins with, but for the leaves, before that is kept
};

// Those that a simulated room begins with: few, because everyone who opens or joins it makes them anew.
[[nodiscard]] std::shared_ptr<ToolBox> few_tools();

struct ServerCondition {
  CutLimits limits;
  std::size_t sector_bytes = 4096;
  std::chrono::nanoseconds late_most = std::chrono::milliseconds(1);  // of a tick
  double slow_writes = 0.03;  // share of ticks whose entries take up to 0.4 s to be kept
  double pauses = 0.0005;     // share of ticks that come 0.1 to 3 s late
  bool fast_path = false;     // it offers one
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

  // What happens to it. It comes back by itself, after 0.05 to 2 s.
  void boot();
  void crash(bool power);
  void restart();  // as its operator does: everyone is told, the journal is closed
  void lose_power_at(std::uint64_t nth_write_or_sync);
  // The room then closes, and the operator comes after a while; what a failed disk left is recovered.
  void fail_disk_at(std::uint64_t nth_write_or_sync, int error, MemoryDisk::Lasting lasting);
  void jump_clock(Time by) { jumped_ += by; }
  void checkpoint();
  void rest();  // from now on nothing of that happens
  [[nodiscard]] bool up() const { return runtime_ != nullptr; }

  // Requests as they arrive. Nobody answers while it is down; what is not answered before a crash never is.
  struct JoinRequest {
    std::string name;
    AuthorId resume;  // null: somebody new
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
  [[nodiscard]] Digest replayed();            // room_hash of a new room with these
  [[nodiscard]] Digest live();                // room_hash; runs a tick
  // Closed, and opened again: with a checkpoint of its end or without.
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
  void note_kept();  // before anyone is told of it
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
  bool made_ = false;  // a journal was, once
  std::unique_ptr<RoomStore> store_;
  std::unique_ptr<RoomRuntime> runtime_;
  std::unique_ptr<SimLinks> links_;                 // none: no fast path
  std::vector<std::shared_ptr<Session>> sessions_;  // with streams and queued cuts
  std::uint64_t life_ = 0;                          // rises with every boot and crash
  std::uint64_t planned_tick_ = 0;                  // the newest that was planned counts
  Time began_{}, booted_{}, jumped_{};              // the room's time at its boot
  Time writes_until_{};                             // the disk is busy
  bool power_fails_ = false, disk_fails_ = false, operator_comes_ = false, disk_has_failed_ = false, resting_ = false;
  std::uint64_t crashes_ = 0, disk_failures_ = 0;
  std::size_t most_behind_ = 0;
};

}  // namespace osteon::test
