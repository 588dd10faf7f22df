// The logs of a session: a row for each tick, a row for each cut, and a summary.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "haptic_client/simulation/session.hpp"

namespace osteon::haptic {

// One tick, as passed on by the haptic thread.
struct TickRow {
  std::int64_t mono_ns = 0;
  SurgeonPhase phase = SurgeonPhase::done;
  std::uint32_t step = 0;
  double depth_mm = 0, device_depth_mm = 0;  // along the axis of the step's site
  double force_rendered_n = 0;
  double cortex_mm = 0;  // as in CuttingState
  bool idle = false;     // no step was under way: waiting
  LoopReport report;
  DeviceReading reading;
  double commanded_rpm = 0;
  bool empty_hand = false;
  std::uint8_t pointer_source = 0;  // as SessionTick has it
  DeviceOutput rendered;            // device frame
  // The tool was taken up in this tick: where, and the mapping of the device to the bone's frame from then on.
  bool take_up = false;
  Pose taken_up_at;  // bone frame
  WorkspaceMapping mapping;
};

struct RecordedCut {
  std::uint64_t author_seq = 0, room_seq = 0;  // room_seq 0: rejected, or not confirmed
  // confirmed_mono_ns 0: the room never sent a decision.
  std::int64_t closed_mono_ns = 0, confirmed_mono_ns = 0;
};

[[nodiscard]] const char* name(CuttingPhase phase);
// Name of the law with which a tool began.
[[nodiscard]] std::string law_name(const ToolModel& model);
// Names of the bits of LoopReport::events, the lowest first.
[[nodiscard]] std::vector<std::string> event_names();
// Names of the bits of LoopReport::Cutting::out_of_range, the lowest first.
[[nodiscard]] std::vector<std::string> range_names();

// Reports each contact with metal once. One thread.
class MetalWatch {
 public:
  // A contact ends after so long without metal: a hand trembles, and a point that is drawn back a little returns.
  static constexpr std::uint64_t kApart_ticks = 500;
  // Call for every tick in order. Returns a sentence when a contact begins, else nothing.
  [[nodiscard]] std::string note(const ToolModel& model, const LoopReport& report);

 private:
  std::uint64_t last_seq_ = 0;  // of the last tick on metal; 0: none yet
};

// Where a session used force laws outside their range. One thread.
class RangeWatch {
 public:
  // This many more ticks outside than inside are reported: as a drill's cone enters, its feed is outside for a moment.
  static constexpr std::int64_t kLasting_ticks = 200;
  struct Use {
    const ForceLaw* law = nullptr;
    unsigned bits = 0;        // of OutOfRange, all that occurred
    std::uint64_t ticks = 0;  // number of ticks outside
  };
  // Call for every tick that was outside, in order; other ticks are permitted. The law is the report's, or the model's
  // if it names none. Returns a sentence when a law stays outside for the first time in the session, else nothing.
  [[nodiscard]] std::string note(const ToolModel& model, const LoopReport& report);
  [[nodiscard]] const std::vector<Use>& uses() const { return uses_; }  // each law once

 private:
  struct Stay {
    std::uint64_t last_seq = 0;  // of the last tick outside
    std::int64_t ticks = 0;      // number of ticks outside minus inside up to then
    bool reported = false;
  };
  std::vector<Use> uses_;
  std::vector<Stay> stays_;  // of each use
};

// Rows are written at once; finish() reports a full disk.
class SessionLog {
 public:
  // Without a path everything is dropped. `device`: the one in the hand; one without motors shows no force. `author`:
  // of the states, by which the sound is made again. Error internal: the file cannot be created.
  [[nodiscard]] Result<void> open(const std::filesystem::path& file, const DeviceInfo& device, AuthorId author);
  void write(const TickRow& row, const std::string& tool);
  [[nodiscard]] Result<void> finish();

 private:
  std::filesystem::path path_;
  std::ofstream file_;
  bool shows_force_ = true;
  AuthorId author_;
  std::int64_t first_mono_ns_ = 0;  // of the first row; 0: none yet
};

[[nodiscard]] Result<void> write_cut_log(const std::filesystem::path& file, const std::vector<RecordedCut>& rows);

}  // namespace osteon::haptic
