#include "viewer_client/inside/c_arm_shot.hpp"

#include <array>
#include <nlohmann/json.hpp>

namespace osteon {
namespace {

using nlohmann::json;

constexpr std::array kModeNames{"single", "pulse", "live"};

json numbers_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

// Reads fields of an object, and remembers whether one was missing or of another kind.
class ShotFields {
 public:
  explicit ShotFields(const json& object) : object_(object) {}
  [[nodiscard]] bool good() const { return good_; }

  double number(const char* name) { return number_in(at(name)); }
  Vec3 point(const char* name) {
    const json& list = at(name);
    good_ = good_ && list.is_array() && list.size() == 3;
    Vec3 point = Vec3::Zero();
    for (int axis = 0; good_ && axis < 3; ++axis) point[axis] = number_in(list[static_cast<std::size_t>(axis)]);
    return point;
  }
  std::uint64_t whole(const char* name) {
    const json& value = at(name);
    good_ = good_ && value.is_number_unsigned();
    return good_ ? value.get<std::uint64_t>() : 0;
  }
  // Within its limits, so that it is a whole number of that type.
  std::int64_t time(const char* name) {
    const double found = number(name);
    good_ = good_ && found >= 0.0 && found <= static_cast<double>(kLatestShot_unix_ms);
    return good_ ? static_cast<std::int64_t>(found) : 0;
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
  double number_in(const json& value) {
    good_ = good_ && value.is_number();
    return good_ ? value.get<double>() : 0.0;
  }

  const json& object_;
  bool good_ = true;
};

}  // namespace

radiology::CArm c_arm_at(const CArmPosition& position) {
  radiology::CArm arm;
  arm.isocentre_mm = position.isocentre_mm;
  arm.orbit_rad = position.orbit_rad;
  arm.tilt_rad = position.tilt_rad;
  arm.translation_mm = position.translation_mm;
  return arm;
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
  shot.time_unix_ms = fields.time("time_unix_ms");
  shot.mode = fields.mode();
  shot.position.isocentre_mm = fields.point("isocentre_mm");
  shot.position.orbit_rad = fields.number("orbit_rad");
  shot.position.tilt_rad = fields.number("tilt_rad");
  shot.position.translation_mm = fields.point("translation_mm");
  shot.exposure_s = fields.number("exposure_s");
  shot.air_kerma_at_metre_ugy = fields.number("air_kerma_at_metre_ugy");
  shot.dose_area_gy_cm2 = fields.number("dose_area_gy_cm2");
  shot.seed = fields.whole("seed");
  if (!fields.good() || !check(shot)) return {};
  return shot;
}

}  // namespace osteon
