#include "haptic_client/app/recorder.hpp"

#include <utility>

#include "common/runtime/log.hpp"

namespace osteon::haptic {

Result<void> Recorder::open(const std::filesystem::path& file, const RecordingInfo& info) {
  if (file.empty()) return {};
  Result<RecordFile> made = RecordFile::create(file, info);
  if (!made) return tl::unexpected(made.error());
  file_ = std::move(*made);
  thread_ = std::thread([this] { run(); });
  return {};
}

void Recorder::begin_on(const std::string& field_hash) {
  if (!recording()) return;
  const MutexLock lock(mutex_);
  start_hash_ = field_hash;
  wake_.notify_one();
}

void Recorder::push(const TickRow& row) {
  if (!recording()) return;
  const MutexLock lock(mutex_);
  if (waiting_.size() >= kMostWaiting) {
    ++dropped_;
    return;
  }
  waiting_.push_back(row);
  if (waiting_.size() == RecordFile::kChunkRows / 2) wake_.notify_one();
}

void Recorder::run() {
  std::vector<TickRow> rows;
  std::string start_hash;
  bool over = false;
  while (!over) {
    {
      MutexLock lock(mutex_);
      while (!over_ && start_hash_.empty() && waiting_.size() < RecordFile::kChunkRows / 2) wake_.wait(lock);
      over = over_;
      start_hash = std::exchange(start_hash_, {});
      rows.swap(waiting_);
    }
    if (outcome_.trouble.empty()) {
      Result<void> written = start_hash.empty() ? Result<void>() : file_->begin_on(start_hash);
      if (written) written = file_->append(rows);
      if (!written) {
        outcome_.trouble = written.error().message;
        outcome_.rows = file_->rows_written();
        file_.reset();
        log::warn("the recording has ended; the session continues", {{"because", outcome_.trouble}});
      }
    }
    rows.clear();
  }
}

Recorder::Outcome Recorder::finish(const RecordingEnd& end) {
  if (!recording()) return outcome_;
  {
    const MutexLock lock(mutex_);
    over_ = true;
    wake_.notify_one();
  }
  thread_.join();
  {
    const MutexLock lock(mutex_);
    outcome_.dropped = dropped_;
  }
  if (!file_) return outcome_;
  RecordingEnd all = end;
  all.rows_dropped += outcome_.dropped;
  if (Result<void> written = file_->finish(all); !written) {
    outcome_.trouble = written.error().message;
    log::warn("the recording is incomplete", {{"because", outcome_.trouble}});
  }
  outcome_.rows = file_->rows_written();
  file_.reset();
  return outcome_;
}

}  // namespace osteon::haptic
