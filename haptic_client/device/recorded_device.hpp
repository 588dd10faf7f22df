// A device that does again what another did: plays the handle's poses and buttons of a recording, a row for each tick.
// Force goes nowhere. On the same bone with the same plan it makes the same cuts, bit for bit where time is virtual;
// what differs in either is refused by check_played(). A bone that stood on a mount moves again as it did, whatever the
// room's does.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "haptic_client/device/haptic_device.hpp"

namespace osteon::haptic {

// What a recording says of the session that it is of.
struct RecordedSession {
  std::string device, device_model;
  std::string case_hash, case_title;  // of the bone; the hash in hexadecimal digits
  std::string plan_digest;            // of what was done with which tools, likewise; empty: the recording does not say
  std::vector<std::string> tools;     // names, by their place in the session
  std::string start_hash;             // of the bone as it was found; empty: the recording does not say
  std::string field_hash;             // of the bone as it was left; empty: the recording has no end
  double force_scale = 0;             // s
  DeviceLimits limits;
  DeviceInfo info;
  std::vector<DeviceReading> readings;  // one for each tick from the first row on; a lost row shows the one before
  // Of each reading: where the bone stood, seen from where it rests. Empty: it never moved, or the recording does not
  // say.
  std::vector<Pose> pose_rest_bone;
};

// Whether a recording can be played in a session: only the same bone, tools and plan make sense of its handle. `name`:
// of the recording, for the sentence. Errors: invalid_input, which says what differs and what to give.
[[nodiscard]] Result<void> check_played(const RecordedSession& recorded, std::string_view name,
                                        std::string_view case_hash, const std::vector<std::string>& tools,
                                        std::string_view plan_digest);

// Reads a recording, also one that goes on or whose writer was killed: as far as it is complete. Errors: not_found (no
// such file), invalid_input (no HDF5 file, no recording, a dataset missing or of the wrong kind, no row, a number that
// is none), unsupported (another version of the format).
[[nodiscard]] Result<RecordedSession> read_recording(const std::filesystem::path& file);

class RecordedDevice final : public HapticDevice {
 public:
  RecordedDevice(std::string name, RecordedSession session);

  [[nodiscard]] std::string_view name() const override { return name_; }
  [[nodiscard]] DeviceLimits limits() const override { return session_.limits; }  // of the device that was recorded
  [[nodiscard]] DeviceInfo info() const override { return session_.info; }
  // After the last row the device is absent, as if it had been unplugged there.
  [[nodiscard]] DeviceReading read() noexcept override;
  [[nodiscard]] const Pose* pose_rest_bone() const noexcept override;
  void write(const DeviceOutput&) noexcept override {}

  [[nodiscard]] const RecordedSession& session() const { return session_; }
  [[nodiscard]] bool over() const noexcept override { return next_ >= session_.readings.size(); }

 private:
  std::string name_;
  RecordedSession session_;
  std::size_t next_ = 0;  // haptic thread
};

// Whether the room's bone is as it was when the recording began: a handle that cut bone goes through air where it was
// cut before, and is pushed out of bone that was not yet. `field_hash`: of the room as it was joined, in hexadecimal
// digits. Error invalid_input. A recording that does not say plays on any.
[[nodiscard]] Result<void> check_played_on(const RecordedDevice& recorded, std::string_view field_hash);

// `recorded:FILE` after its colon. Errors: those of read_recording().
[[nodiscard]] Result<std::unique_ptr<RecordedDevice>> make_recorded_device(const std::filesystem::path& file);

}  // namespace osteon::haptic
