#include "common/tools/c_arm_shot.hpp"

#include <string>
#include <utility>

namespace osteon {
namespace {

// Not a number is in no range.
Result<void> within(const std::string& field, double value, double least, double most, const char* range) {
  if (value >= least && value <= most) return {};
  return bad_field(field, std::string("must be ") + range);
}

Result<void> placed(const std::string& field, const Vec3& at) {
  for (const double value : at)
    if (Result<void> sound = within(field, value, -kMostOfShot_mm, kMostOfShot_mm, "at most 1 km"); !sound)
      return sound;
  return {};
}

Result<void> numbered(const std::string& field, std::uint64_t number) {
  if (number >= 1 && number <= kMostShots) return {};
  return bad_field(field, "must be 1 to 2^53");
}

constexpr const char *kAngles = "-100 to 100", *kAmounts = "0 to 1e9";

}  // namespace

void ShotTotals::add(const CArmShot& shot) {
  ++shots;
  exposure_s += shot.exposure_s;
  dose_area_gy_cm2 += shot.dose_area_gy_cm2;
}

Result<void> check(const CArmShot& shot) {
  if (Result<void> sound = numbered("shot.number", shot.number); !sound) return sound;
  if (shot.time_unix_ms < 0 || shot.time_unix_ms > kLatestShot_unix_ms)
    return bad_field("shot.time_unix_ms", "must be 0 to 1e14");
  if (shot.mode > ShotMode::live) return bad_field("shot.mode", "must be single, pulse or live");
  const CArmPosition& at = shot.position;
  if (Result<void> sound = placed("shot.isocentre_mm", at.isocentre_mm); !sound) return sound;
  if (Result<void> sound = placed("shot.translation_mm", at.translation_mm); !sound) return sound;
  for (const auto& [field, angle] : {std::pair("shot.orbit_rad", at.orbit_rad), {"shot.tilt_rad", at.tilt_rad}})
    if (Result<void> sound = within(field, angle, -kMostOfShot_rad, kMostOfShot_rad, kAngles); !sound) return sound;
  for (const auto& [field, amount] : {std::pair("shot.exposure_s", shot.exposure_s),
                                      {"shot.air_kerma_at_metre_ugy", shot.air_kerma_at_metre_ugy},
                                      {"shot.dose_area_gy_cm2", shot.dose_area_gy_cm2}})
    if (Result<void> sound = within(field, amount, 0.0, kMostOfShot, kAmounts); !sound) return sound;
  if (shot.air_kerma_at_metre_ugy == 0.0) return bad_field("shot.air_kerma_at_metre_ugy", "must be above 0");
  return {};
}

Result<void> check(const ShotRun& run) {
  if (Result<void> sound = check(run.last); !sound) return sound;
  if (Result<void> sound = numbered("run.first_number", run.first_number); !sound) return sound;
  if (run.first_number > run.last.number) return bad_field("run.first_number", "is above that of its last shot");
  return within("run.exposure_s", run.exposure_s, 0.0, kMostOfShot, kAmounts);
}

Result<void> check(const ShotTotals& totals) {
  if (Result<void> sound = numbered("session.shots", totals.shots); !sound) return sound;
  if (Result<void> sound = within("session.exposure_s", totals.exposure_s, 0.0, kMostOfShot, kAmounts); !sound)
    return sound;
  return within("session.dose_area_gy_cm2", totals.dose_area_gy_cm2, 0.0, kMostOfShot, kAmounts);
}

}  // namespace osteon
