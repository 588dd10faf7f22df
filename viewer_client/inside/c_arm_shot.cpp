#include "viewer_client/inside/c_arm_shot.hpp"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace osteon {
namespace {

using nlohmann::json;

constexpr std::array kModeNames{"single", "pulse", "live"};

json numbers_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// Reads fields of an object, and remembers whether one was missing or impossible.
class ShotFields {
 public:
  explicit ShotFields(const json& object) : object_(object) {}
  [[nodiscard]] bool good() const { return good_; }

  double number(const char* name, double least, double most) { return within(at(name), least, most); }
  Vec3 point(const char* name) {
    const json& list = at(name);
    good_ = good_ && list.is_array() && list.size() == 3;
    Vec3 point = Vec3::Zero();
    for (int axis = 0; good_ && axis < 3; ++axis)
      point[axis] = within(list[static_cast<std::size_t>(axis)], -radiology::kMostOfCArm_mm, radiology::kMostOfCArm_mm);
    return point;
  }
  std::uint64_t whole(const char* name) {
    const json& value = at(name);
    good_ = good_ && value.is_number_unsigned();
    return good_ ? value.get<std::uint64_t>() : 0;
  }
  ShotMode mode() {
    const json& value = at("mode");
    for (std::size_t i = 0; value.is_string() && i < kModeNames.size(); ++i)
      if (value == kModeNames[i]) return static_cast<ShotMode>(i);
    good_ = false;
    return ShotMode::single;
  }

 private:
  const json& at(const char* name) {
    static const json kNone;
    const auto found = object_.find(name);
    return found != object_.end() ? *found : kNone;
  }
  double within(const json& value, double least, double most) {
    const double found = value.is_number() ? value.get<double>() : NAN;
    good_ = good_ && found >= least && found <= most;
    return good_ ? found : 0.0;
  }

  const json& object_;
  bool good_ = true;
};

constexpr double kMostTurn_rad = 100.0, kMostOfShot = 1e9;
constexpr double kLatest_unix_ms = 1e14;                        // in three thousand years
constexpr std::uint64_t kMostNumber = std::uint64_t{1} << 53U;  // the next one is a number too, in any language

}  // namespace

radiology::CArm c_arm_at(const CArmPosition& position) {
  radiology::CArm arm;
  arm.isocentre_mm = position.isocentre_mm;
  arm.orbit_rad = position.orbit_rad;
  arm.tilt_rad = position.tilt_rad;
  arm.translation_mm = position.translation_mm;
  return arm;
}

void ShotTotals::add(const CArmShot& shot) {
  ++shots;
  exposure_s += shot.exposure_s;
  dose_area_gy_cm2 += shot.dose_area_gy_cm2;
}

std::string line_of(const CArmShot& shot) {
  return json{{"number", shot.number},
              {"time_unix_ms", shot.time_unix_ms},
              {"mode", kModeNames[static_cast<std::size_t>(shot.mode)]},
              {"isocentre_mm", numbers_of(shot.position.isocentre_mm)},
              {"orbit_rad", shot.position.orbit_rad},
              {"tilt_rad", shot.position.tilt_rad},
              {"translation_mm", numbers_of(shot.position.translation_mm)},
              {"exposure_s", shot.exposure_s},
              {"air_kerma_at_metre_ugy", shot.air_kerma_at_metre_ugy},
              {"dose_area_gy_cm2", shot.dose_area_gy_cm2},
              {"seed", shot.seed}}
      .dump();
}

std::optional<CArmShot> shot_of(std::string_view line) {
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object()) return {};
  ShotFields fields(object);
  CArmShot shot;
  shot.number = fields.whole("number");
  shot.time_unix_ms = static_cast<std::int64_t>(fields.number("time_unix_ms", 0.0, kLatest_unix_ms));
  shot.mode = fields.mode();
  shot.position.isocentre_mm = fields.point("isocentre_mm");
  shot.position.orbit_rad = fields.number("orbit_rad", -kMostTurn_rad, kMostTurn_rad);
  shot.position.tilt_rad = fields.number("tilt_rad", -kMostTurn_rad, kMostTurn_rad);
  shot.position.translation_mm = fields.point("translation_mm");
  shot.exposure_s = fields.number("exposure_s", 0.0, kMostOfShot);
  shot.air_kerma_at_metre_ugy = fields.number("air_kerma_at_metre_ugy", 0.0, kMostOfShot);
  shot.dose_area_gy_cm2 = fields.number("dose_area_gy_cm2", 0.0, kMostOfShot);
  shot.seed = fields.whole("seed");
  if (!fields.good() || shot.number < 1 || shot.number > kMostNumber) return {};
  return shot;
}

}  // namespace osteon
