// What is kept of each shot of a C-arm. A record says all that the picture depends on but the bone and the tools, so
// whoever has those can make the picture again.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/pose.hpp"
#include "common/radiology/c_arm.hpp"

namespace osteon {

// How the tube is switched on.
enum class ShotMode : std::uint8_t {
  single,  // one picture for each press
  pulse,   // short pulses while the pedal is held
  live,    // all the time while the pedal is held
};

// Where the C-arm stands; the rest of radiology::CArm is the machine's.
struct CArmPosition {
  Vec3 isocentre_mm = Vec3::Zero();
  double orbit_rad = 0.0, tilt_rad = 0.0;
  Vec3 translation_mm = Vec3::Zero();
  friend bool operator==(const CArmPosition& a, const CArmPosition& b) {
    return a.isocentre_mm == b.isocentre_mm && a.orbit_rad == b.orbit_rad && a.tilt_rad == b.tilt_rad &&
           a.translation_mm == b.translation_mm;
  }
};
[[nodiscard]] radiology::CArm c_arm_at(const CArmPosition& position);

struct CArmShot {
  std::uint64_t number = 0;       // in its session, from 1
  std::int64_t time_unix_ms = 0;  // when it was asked for
  ShotMode mode = ShotMode::single;
  CArmPosition position;
  double exposure_s = 0.0;              // for how long the tube was on
  double air_kerma_at_metre_ugy = 0.0;  // of this shot
  double dose_area_gy_cm2 = 0.0;        // nominal
  std::uint64_t seed = 0;               // of its noise
  friend bool operator==(const CArmShot&, const CArmShot&) = default;
};

struct ShotTotals {
  std::uint64_t shots = 0;
  double exposure_s = 0.0, dose_area_gy_cm2 = 0.0;
  void add(const CArmShot& shot);
};

// One line of JSON, without its end.
[[nodiscard]] std::string line_of(const CArmShot& shot);
// None: the line is no shot, or one of its numbers is not possible.
[[nodiscard]] std::optional<CArmShot> shot_of(std::string_view line);

}  // namespace osteon
