// Writes the rows of a session on a thread of its own. So a slow disk delays neither the haptic thread nor the
// telemetry thread.
#pragma once
#include <optional>
#include <thread>
#include <vector>

#include "common/core/mutex.hpp"
#include "haptic_client/app/record_file.hpp"

namespace osteon::haptic {

class Recorder {
 public:
  // Number of rows that may wait for a disk that does not respond: a minute. Later rows are dropped and counted.
  static constexpr std::size_t kMostWaiting = 60'000;

  struct Outcome {
    std::uint64_t rows = 0, dropped = 0;
    std::string trouble;  // a sentence; empty: none
  };

  Recorder() = default;
  ~Recorder() {
    RecordingEnd end;
    end.lost = true;
    (void)finish(end);
  }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  // Without a path nothing is recorded. Error internal: the file cannot be created.
  [[nodiscard]] Result<void> open(const std::filesystem::path& file, const RecordingInfo& info);
  [[nodiscard]] bool recording() const { return thread_.joinable(); }
  // `field_hash`: of the room's field as it was joined, hexadecimal. Any thread except the haptic one.
  void begin_on(const std::string& field_hash);
  // Any thread except the haptic one, one at a time.
  void push(const TickRow& row);
  // Waits until all pushed rows are written, and closes the file. A second call does nothing. A disk that fails ends
  // only the recording, with one warning.
  Outcome finish(const RecordingEnd& end);

 private:
  void run();

  std::optional<RecordFile> file_;  // used by the thread only, while it runs
  std::thread thread_;
  Outcome outcome_;

  Mutex mutex_{LockRank::leaf};
  CondVar wake_;
  std::string start_hash_ OSTEON_GUARDED_BY(mutex_);  // to be written
  std::vector<TickRow> waiting_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t dropped_ OSTEON_GUARDED_BY(mutex_) = 0;
  bool over_ OSTEON_GUARDED_BY(mutex_) = false;
};

}  // namespace osteon::haptic
