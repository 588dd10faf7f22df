// A device that plays a recording: the handle's poses and buttons, one row for each tick. It ignores force. On the same
// bone with the same plan it makes the same cuts, bit for bit where time is virtual. check_played() rejects another
// bone or plan. A bone that stood on a mount moves again as it did, whatever the room's bone does.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

// What the recording of a pointer's hand says of a tick, beside the reading.
struct PointerTick {
  double commanded_rpm = 0;
  bool in_hand = false;  // a tool was taken up
  int take_up = -1;      // index in RecordedSession::take_ups; -1: none in this tick
  std::uint8_t source = 0;
  std::uint8_t law = 0;  // of the tool in hand: index in RecordedSession::laws
  double wear = 1.0;     // of that tool
};

// A tool was taken up: which one, where, and the parameters of the mapping from the device to the bone from then on.
struct RecordedTakeUp {
  int tool = 0;
  Pose pose_bone_tool;
  Eigen::Quaterniond view = Eigen::Quaterniond::Identity();
  double scale = 1;
  Vec3 device_mm = Vec3::Zero(), bone_mm = Vec3::Zero();
};

// What a recording says about its session.
struct RecordedSession {
  std::string device, device_model;
  std::string case_hash, case_title;  // of the bone; the hash in hexadecimal digits
  std::string plan_digest;            // of the plan and its tools, likewise; empty: the recording does not say
  std::vector<std::string> tools;     // names, by their index in the session
  std::vector<std::string> laws;      // names; of a pointer's recording only
  std::string start_hash;             // of the bone at the beginning; empty: the recording does not say
  std::string field_hash;             // of the bone at the end; empty: the recording has no end
  double force_scale = 0;             // s
  std::string force_choice;           // as --force-choice names it; empty: proportional
  DeviceLimits limits;
  DeviceInfo info;
  std::vector<DeviceReading> readings;  // one for each tick from the first row on; a lost row repeats the one before
  // For each reading: the bone's pose relative to its rest pose. Empty: it never moved, or the recording does not say.
  std::vector<Pose> pose_rest_bone;
  // For each reading of a pointer's recording. Empty: of another device.
  std::vector<PointerTick> pointer;
  std::vector<RecordedTakeUp> take_ups;
  [[nodiscard]] bool of_pointer() const noexcept { return !pointer.empty(); }
};

// Whether a recording can be played in a session. Its handle makes sense only with the same bone, tools and plan.
// `name`: of the recording, for the message. Error invalid_input: says what differs and which options to give.
[[nodiscard]] Result<void> check_played(const RecordedSession& recorded, std::string_view name,
                                        std::string_view case_hash, const std::vector<std::string>& tools,
                                        std::string_view plan_digest);

// Reads a recording, as far as it is complete. It may still be growing, or its writer may have been killed. Errors:
// not_found (no such file), invalid_input (no HDF5 file, no recording, a dataset missing or of the wrong kind, no row,
// a value that is not a number), unsupported (another version of the format; a pointer's recording that lacks ticks, or
// that is older than recording::kPointerSource).
[[nodiscard]] Result<RecordedSession> read_recording(const std::filesystem::path& file);

class RecordedDevice final : public HapticDevice {
 public:
  RecordedDevice(std::string name, RecordedSession session);

  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] DeviceLimits limits() const override { return session_.limits; }  // of the device that was recorded
  [[nodiscard]] DeviceInfo info() const override { return session_.info; }
  // After the last row the device is absent, as if it had been unplugged.
  [[nodiscard]] DeviceReading read() noexcept override;
  [[nodiscard]] const Pose* pose_rest_bone() const noexcept override;
  void write(const DeviceOutput&) noexcept override {}
  // [haptic] Of the reading that read() gave last. Null: it is not the recording of a pointer, or it is over.
  [[nodiscard]] const PointerTick* pointer_tick() const noexcept;

  [[nodiscard]] const RecordedSession& session() const { return session_; }
  [[nodiscard]] bool over() const noexcept override { return next_ >= session_.readings.size(); }

 private:
  std::string name_;
  RecordedSession session_;
  std::size_t next_ = 0;  // haptic thread
  bool ended_ = false;    // haptic thread; read() was called after the last reading
};

// Whether the room's bone is as it was when the recording began. On other bone, the recorded handle moves through air
// where bone was cut before, and is pushed out of bone that was not yet cut. `field_hash`: of the room as it was
// joined, in hexadecimal digits. Error invalid_input. A recording without this hash plays on any bone.
[[nodiscard]] Result<void> check_played_on(const RecordedDevice& recorded, std::string_view field_hash);

// The text of `recorded:FILE` after its colon. Errors: those of read_recording().
[[nodiscard]] Result<std::unique_ptr<RecordedDevice>> make_recorded_device(const std::filesystem::path& file);

}  // namespace osteon::haptic
