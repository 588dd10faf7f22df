// What a session leaves behind: a row for each tick, a row for each cut, a summary.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "haptic_client/control/session.hpp"

namespace osteon::haptic {

// One tick, as it crosses from the haptic thread.
struct TickRow {
  std::int64_t mono_ns = 0;
  SurgeonPhase phase = SurgeonPhase::done;
  std::uint32_t step = 0;
  double depth_mm = 0, device_depth_mm = 0;  // along the axis of the step's site
  double force_rendered_n = 0;
  bool idle = false;  // no step was under way: waiting
  LoopReport report;
  DeviceReading reading;
  double commanded_rpm = 0;
  DeviceOutput rendered;  // device frame
  // In this tick the tool was taken up: where, and how the device lies in the bone's frame from then on.
  bool take_up = false;
  Pose taken_up_at;  // bone frame
  WorkspaceMapping mapping;
};

struct RecordedCut {
  std::uint64_t author_seq = 0, room_seq = 0;              // room_seq 0: rejected, or not confirmed
  std::int64_t closed_mono_ns = 0, confirmed_mono_ns = 0;  // confirmed_mono_ns 0: the room never said what became of it
};

[[nodiscard]] const char* name(CuttingPhase phase);
// Of the law by which a tool cuts.
[[nodiscard]] std::string law_name(const ToolModel& model);
// Of the bits of LoopReport::events, the lowest first.
[[nodiscard]] std::vector<std::string> event_names();
// Of the bits of LoopReport::out_of_range, the lowest first.
[[nodiscard]] std::vector<std::string> range_names();

// Contacts with metal, each to be told once. One thread.
class MetalWatch {
 public:
  // So long without metal a contact is over: a hand trembles, and a point that is drawn back a little comes again.
  static constexpr std::uint64_t kApart_ticks = 500;
  // To be asked of every tick in order. A sentence as a contact begins, else nothing.
  [[nodiscard]] std::string note(const ToolModel& model, const LoopReport& report);

 private:
  std::uint64_t last_seq_ = 0;  // of the last tick on metal; 0: none yet
};

// Where a session used force laws outside the range that they were made for. One thread.
class RangeWatch {
 public:
  // So many ticks more outside than not are worth a word: as a drill's cone enters, its feed is so for a moment.
  static constexpr std::int64_t kLasting_ticks = 200;
  struct Use {
    const ForceLaw* law = nullptr;
    unsigned bits = 0;        // of OutOfRange, all that were ever seen
    std::uint64_t ticks = 0;  // spent outside
  };
  // To be asked of every tick that was outside, in order; it may be asked of others. A sentence when a law stays
  // outside for the first time in the session, else nothing.
  [[nodiscard]] std::string note(const ToolModel& model, const LoopReport& report);
  [[nodiscard]] const std::vector<Use>& uses() const { return uses_; }  // each law once

 private:
  struct Stay {
    std::uint64_t last_seq = 0;  // of the last tick outside
    std::int64_t ticks = 0;      // more outside than not up to then
    bool told = false;
  };
  std::vector<Use> uses_;
  std::vector<Stay> stays_;  // of each use
};

// Rows are written as they come; a disk that is full shows at finish().
class SessionLog {
 public:
  // Without a path everything is dropped. `device`: in the hand; one without motors shows no force. Error internal: the
  // file cannot be made.
  [[nodiscard]] Result<void> open(const std::filesystem::path& file, const DeviceInfo& device);
  void write(const TickRow& row, const std::string& tool);
  [[nodiscard]] Result<void> finish();

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  bool shows_force_ = true;
  std::int64_t first_mono_ns_ = 0;  // of the first row; 0: none yet
};

[[nodiscard]] Result<void> write_cut_log(const std::filesystem::path& file, const std::vector<RecordedCut>& rows);

}  // namespace osteon::haptic
