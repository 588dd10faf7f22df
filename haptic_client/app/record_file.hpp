// A session as an HDF5 file, in the layout of recording_layout.hpp: one row for each millisecond, in chunks. The file
// is readable while it grows and after the writer was killed (HDF5's single writer, many readers).
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "haptic_client/app/record.hpp"

namespace osteon::haptic {

// What is constant for a whole session.
struct RecordingInfo {
  std::string device;  // as --device named it
  DeviceInfo device_info;
  DeviceLimits limits;
  LoopParams loop;
  std::string case_hash, case_title;
  std::string plan_digest;  // of plan_digest(), in hexadecimal digits
  double pitch_mm = 0;      // h of the case
  std::uint64_t author = 0;
  struct Item {
    std::string name;
    std::string law;  // by which it cuts
    double diameter_mm = 0;
  };
  std::vector<Item> tools;  // by their index in the session
};

// Known when the session ends.
struct RecordingEnd {
  std::string field_hash;  // of the whole bone
  std::uint64_t room_seq = 0;
  std::uint64_t rows_dropped = 0;
  bool lost = false;  // the session ended early: its room was lost
};

class RecordFile {
 public:
  // Rows are written in chunks of this size; a killed writer loses fewer rows.
  static constexpr std::size_t kChunkRows = 500;
  // Free space left on the disk; a recording ends before it uses it.
  static constexpr std::uint64_t kKeepFree_bytes = 16u << 20;

  // Begins a recording; overwrites the file. Error internal: it cannot be created; gives the reason.
  [[nodiscard]] static Result<RecordFile> create(const std::filesystem::path& file, const RecordingInfo& info,
                                                 std::uint64_t keep_free_bytes = kKeepFree_bytes);
  ~RecordFile();  // without finish(): written rows stay, and whole chunks of them can be read
  RecordFile(RecordFile&&) noexcept;
  RecordFile& operator=(RecordFile&&) noexcept;

  // The hash of the room's field as it was joined, in hexadecimal digits. Call once, as soon as it is known. Error
  // internal.
  [[nodiscard]] Result<void> begin_on(const std::string& field_hash);
  // Rows in order. After an error, stop: the file stays readable up to its last whole chunk. Error internal: the disk
  // is full or fails, with the system's reason.
  [[nodiscard]] Result<void> append(std::span<const TickRow> rows);
  [[nodiscard]] Result<void> finish(const RecordingEnd& end);
  [[nodiscard]] std::uint64_t rows_written() const;

 private:
  struct Impl;
  explicit RecordFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::haptic
