// Writes the rows of a session on a thread of its own, so that a slow disk holds up nobody: neither the haptic thread
// nor the one that reports.
#pragma once
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "haptic_client/app/record_file.hpp"

namespace osteon::haptic {

class Recorder {
 public:
  // Rows that may wait for a disk that does not answer: a minute. What comes then is dropped and counted.
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

  // Without a path nothing is recorded. Error internal: the file cannot be made.
  [[nodiscard]] Result<void> open(const std::filesystem::path& file, const RecordingInfo& info);
  [[nodiscard]] bool recording() const { return thread_.joinable(); }
  // Any thread but the haptic one: the field's hash of the room as it was joined, in hexadecimal digits.
  void begin_on(const std::string& field_hash);
  // Any thread but the haptic one, one at a time.
  void push(const TickRow& row);
  // Waits until what was pushed is written, and closes the file; again: does nothing. A disk that fails ends the
  // recording with one warning, and nothing else.
  Outcome finish(const RecordingEnd& end);

 private:
  void run();

  std::optional<RecordFile> file_;  // of the thread while it runs
  std::thread thread_;
  Outcome outcome_;

  std::mutex mutex_;  // guards the rest
  std::condition_variable wake_;
  std::string start_hash_;  // to be written
  std::vector<TickRow> waiting_;
  std::uint64_t dropped_ = 0;
  bool over_ = false;
};

}  // namespace osteon::haptic
