// Records who did what in a running server. The recording thread never waits for a disk: events go into a queue, and
// another thread writes them to the audit log and sends them to the system's log.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "common/core/mutex.hpp"
#include "server/audit/audit_log.hpp"
#include "server/audit/syslog.hpp"

namespace osteon {

struct AuditOptions {
  std::filesystem::path file{};               // "audit.log" in the folder of the journals
  std::shared_ptr<const SigningKeys> keys{};  // shared with the journals
  std::filesystem::path syslog{};             // Unix datagram socket of the system's log; empty: nothing is sent
  int retention_days = 0;                     // after which records are removed; 0: never
  std::size_t most_waiting = 4096;            // events; refusals take at most half of it
  std::chrono::milliseconds window = std::chrono::minutes(10);  // time in which equal refusals count as one
  std::chrono::milliseconds retry{1000};                        // after a disk error
};

struct AuditCounts {
  std::uint64_t written = 0;  // records
  std::uint64_t lost = 0;     // events for which the queue had no space
  bool failing = false;       // the disk did not accept the last records
};

// Any thread.
class AuditTrail {
 public:
  // Removes records that are too old, and records "start". Errors: those of AuditLog.
  [[nodiscard]] static Result<std::unique_ptr<AuditTrail>> open(AuditOptions options, Disk* disk = nullptr);
  // Records "stop", and writes what is waiting. If the disk fails then, the rest is lost, and the loss is logged.
  ~AuditTrail();
  AuditTrail(const AuditTrail&) = delete;
  AuditTrail& operator=(const AuditTrail&) = delete;

  // Equal refusals of one person make one record, and at the end of the window another one with their number. In a
  // window at most kMostOfOne different refusals of each person are recorded, and kMostOfUnauthenticated of all
  // unauthenticated callers together. A record gives the number of the others.
  void record(AuditEvent event);
  [[nodiscard]] AuditCounts counts() const;

  static constexpr std::size_t kMostOfOne = 32, kMostOfUnauthenticated = 256;

 private:
  AuditTrail(AuditOptions options, AuditLog log);
  using Clock = std::chrono::steady_clock;
  // A person's refusals since the window began: how often each was repeated, and how many were not recorded.
  struct Refusals {
    struct Repeated {
      AuditEvent event;
      std::uint64_t times = 0;
    };
    std::map<std::tuple<AuditIdentity, std::string, std::string, std::string>, Repeated> seen;
    std::uint64_t omitted = 0;
  };
  // True: it repeats an earlier refusal and is only counted.
  [[nodiscard]] bool is_counted(const AuditEvent& event) OSTEON_REQUIRES(mutex_);
  void put(AuditEvent event, std::size_t most) OSTEON_REQUIRES(mutex_);
  void end_window() OSTEON_REQUIRES(mutex_);
  void run();
  void write() OSTEON_REQUIRES(mutex_);  // writes what is waiting; releases mutex_ while it does so
  void send_to_syslog(const std::vector<AuditLog::Written>& written);  // [writer] the batch is on the disk
  void maintain();                                                     // [writer] retention

  const AuditOptions options_;
  AuditLog log_;  // used by the writer only, like the next three
  SyslogSocket syslog_;
  std::vector<AuditEvent> batch_;  // events that the disk has not accepted yet
  Clock::time_point maintained_at_;
  mutable Mutex mutex_{LockRank::leaf};
  CondVar wake_;
  std::deque<AuditEvent> waiting_ OSTEON_GUARDED_BY(mutex_);
  std::map<std::string, Refusals> refusals_ OSTEON_GUARDED_BY(mutex_);  // by person; "": unauthenticated
  Clock::time_point window_ends_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t lost_ OSTEON_GUARDED_BY(mutex_) = 0;  // not yet recorded
  AuditCounts counts_ OSTEON_GUARDED_BY(mutex_);
  bool end_ OSTEON_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace osteon
