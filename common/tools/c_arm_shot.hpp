// What is kept of each shot of a C-arm, and what a room is told of it. A record says all that the picture depends on
// but the bone and the tools, so whoever has those can make the picture again.
#pragma once
#include <algorithm>
#include <cstdint>
#include <functional>

#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

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
  friend bool operator==(const ShotTotals&, const ShotTotals&) = default;
};

// The shots of one press of a pedal, as the others in a room are told of them.
struct ShotRun {
  AuthorId author;                 // who shot; null: the room does not know yet
  std::uint64_t first_number = 0;  // of its first shot
  double exposure_s = 0.0;         // of all its shots so far
  CArmShot last;                   // its newest shot
  [[nodiscard]] std::uint64_t shots() const { return last.number - first_number + 1; }
  friend bool operator==(const ShotRun&, const ShotRun&) = default;
};

[[nodiscard]] inline bool same_press(const ShotRun& a, const ShotRun& b) {
  return a.author == b.author && a.first_number == b.first_number;
}

// Where too many are kept: an iterator to the one that goes, the first one of whoever has most. So nobody's shots push
// out those of the others. `run_of`: the ShotRun of an entry. `runs` is not empty.
template <class Runs, class RunOf = std::identity>
[[nodiscard]] auto surplus_run(const Runs& runs, RunOf run_of = {}) {
  const auto author_of = [&](const auto& entry) { return std::invoke(run_of, entry).author; };
  return std::ranges::max_element(
      runs, {}, [&](const auto& entry) { return std::ranges::count(runs, author_of(entry), author_of); });
}

// Limits of a record, from files and from the network.
inline constexpr double kMostOfShot_mm = 1e6, kMostOfShot_rad = 100.0;
inline constexpr double kMostOfShot = 1e9;                           // s, µGy, Gy cm²
inline constexpr std::int64_t kLatestShot_unix_ms = 1e14;            // in three thousand years
inline constexpr std::uint64_t kMostShots = std::uint64_t{1} << 53;  // the next number is one too, in any language

// Error invalid_input, naming the field: a number that is not finite or beyond the limits above, a kerma that is not
// above zero, or a run whose last shot is not one of it.
[[nodiscard]] Result<void> check(const CArmShot& shot);
[[nodiscard]] Result<void> check(const ShotRun& run);
[[nodiscard]] Result<void> check(const ShotTotals& totals);

}  // namespace osteon
