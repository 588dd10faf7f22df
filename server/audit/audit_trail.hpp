// Takes down who did what in a running server. Whoever records never waits for a disk: a queue, and a thread that
// writes to the audit log and sends the same to the system's log.
#pragma once
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "server/audit/audit_log.hpp"
#include "server/audit/syslog.hpp"

namespace osteon {

struct AuditOptions {
  std::filesystem::path file{};               // "audit.log" in the folder of the journals
  std::shared_ptr<const SigningKeys> keys{};  // shared with the journals
  std::filesystem::path syslog{};             // Unix datagram socket of the system's log; empty: nothing is sent
  int retention_days = 0;                     // after which records are removed; 0: never
  std::size_t most_waiting = 4096;            // events; refusals take at most half of it
  std::chrono::milliseconds window = std::chrono::minutes(10);  // in which equal refusals count as one
  std::chrono::milliseconds retry{1000};                        // after an error of the disk
};

struct AuditCounts {
  std::uint64_t written = 0;  // records
  std::uint64_t lost = 0;     // events for which there was no place in the queue
  bool failing = false;       // the disk did not take the last records
};

// Any thread.
class AuditTrail {
 public:
  // Removes what is older than it may be, and records "start". Errors: those of AuditLog.
  [[nodiscard]] static Result<std::unique_ptr<AuditTrail>> open(AuditOptions options, Disk* disk = nullptr);
  // Records "stop", and writes what waits. What a failing disk does not take then is lost, and logged.
  ~AuditTrail();
  AuditTrail(const AuditTrail&) = delete;
  AuditTrail& operator=(const AuditTrail&) = delete;

  // Equal refusals of one person are one record, and at the end of the window another with their number. Of each
  // person kMostOfOne different ones are recorded in a window, of all strangers together kMostOfUnauthenticated; a record
  // counts the others.
  void record(AuditEvent event);
  [[nodiscard]] AuditCounts counts() const;

  static constexpr std::size_t kMostOfOne = 32, kMostOfUnauthenticated = 256;

 private:
  AuditTrail(AuditOptions options, AuditLog log);
  using Clock = std::chrono::steady_clock;
  // A person's refusals since the window began: how often each came again, and how many found no place.
  struct Refusals {
    struct Repeated {
      AuditEvent event;
      std::uint64_t times = 0;
    };
    std::map<std::tuple<AuditIdentity, std::string, std::string, std::string>, Repeated> seen;
    std::uint64_t omitted = 0;
  };
  // Under mutex_. True: it is another of the same, and only counted.
  [[nodiscard]] bool is_counted(const AuditEvent& event);
  void put(AuditEvent event, std::size_t most);
  void end_window();
  void run();
  void write(std::unique_lock<std::mutex>& lock);            // what waits; lets go of the lock meanwhile
  void tell(const std::vector<AuditLog::Written>& written);  // [writer] the batch is on the disk
  void maintain();                                           // [writer] retention

  const AuditOptions options_;
  AuditLog log_;  // of the writer, as the next three
  SyslogSocket syslog_;
  std::vector<AuditEvent> batch_;  // that the disk has not taken yet
  Clock::time_point kept_up_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<AuditEvent> waiting_;
  std::map<std::string, Refusals> refusals_;  // by person; "": strangers
  Clock::time_point window_ends_;
  std::uint64_t lost_ = 0;  // not yet recorded
  AuditCounts counts_;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace osteon
