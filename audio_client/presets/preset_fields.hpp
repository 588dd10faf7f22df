// The fields of a preset, once for reading and writing: describe() names each one, with its limits.
#pragma once
#include <string>
#include <vector>

#include "audio_client/presets/tool_model.hpp"

namespace osteon::audio {

// Levels of a sound that is not there.
inline constexpr double kNoLevel_db = -200.0;

template <class Visitor>
void describe(Visitor& v, sound::PlanetarySet& set) {
  v.whole("ring", set.ring, 1, 1000);
  v.whole("sun", set.sun, 1, 1000);
  v.whole("planet", set.planet, 1, 1000);
}

template <class Visitor>
void describe(Visitor& v, sound::Gearbox& gears) {
  v.map("motor_end", gears.motor_end);
  v.map("output_end", gears.output_end);
}

template <class Visitor>
void describe(Visitor& v, Motor& motor) {
  v.number("reduction", motor.reduction, 0.01, 1000.0);
  v.number("efficiency", motor.efficiency, 0.1, 1.0);
  v.number("droop_rpm_per_Nmm", motor.droop_rpm_per_Nmm, 0.001, 1e5);
  v.number("most_Nmm", motor.most_Nmm, 0.01, 1e5);
  v.number("inertia_g_cm2", motor.inertia_g_cm2, 0.001, 1e5);
  v.number("run_up_s", motor.run_up_s, 0.02, 5.0);
  v.number("run_down_s", motor.run_down_s, 0.02, 1.5);
}

template <class Visitor>
void describe(Visitor& v, NoisePoint& point) {
  v.number("hz", point.hz, 20.0, 20000.0);
  v.number("db_per_hz", point.db_per_hz, kNoLevel_db, 0.0);
}

template <class Visitor>
void describe(Visitor& v, Chips& chips) {
  v.number("level_db", chips.level_db, kNoLevel_db, 0.0);
  v.number("soft_hz", chips.soft_hz, 20.0, 20000.0);
  v.number("hard_hz", chips.hard_hz, 20.0, 20000.0);
  v.number("quality", chips.quality, 0.3, 50.0);
  v.number("depth", chips.depth, 0.0, 1.0);
  v.number("lopsided", chips.lopsided, 0.0, 1.0);
}

template <class Visitor>
void describe(Visitor& v, SourceLevels_db& levels) {
  for (int s = 0; s < kLineSources; ++s)
    v.number(std::string(source_name(static_cast<LineSource>(s))).c_str(), levels[static_cast<std::size_t>(s)], -60.0,
             60.0);
}

template <class Visitor>
void describe(Visitor& v, Material& material) {
  v.number("density_g_cm3", material.density_g_cm3, 0.01, 4.0);
  v.number("load", material.load, 0.01, 1.5);
  v.map("change_db", material.change_db);
  v.number("noise_db", material.noise_db, -60.0, 60.0);
}

template <class Visitor>
void describe(Visitor& v, Mode& mode) {
  v.number("hz", mode.hz, 20.0, 20000.0);
  v.number("decay_s", mode.decay_s, 0.0005, 2.0);
  v.number("level_db", mode.level_db, kNoLevel_db, 0.0);
}

template <class Visitor>
void describe(Visitor& v, Perforation& perforation) {
  v.map("change_db", perforation.change_db);
  v.number("fade_s", perforation.fade_s, 0.001, 1.0);
  v.list("burst", perforation.burst, 0, kMostModes);
}

template <class Visitor>
void describe(Visitor& v, PlateParams& plate) {
  v.number("radius_mm", plate.radius_mm, 5.0, 500.0);
  v.number("quality", plate.quality, 0.5, 200.0);
  v.number("level_db", plate.level_db, kNoLevel_db, 0.0);
}

template <class Visitor>
void describe(Visitor& v, BladeParams& blade) {
  v.number("length_mm", blade.length_mm, 0.0, 1000.0);
  v.number("thickness_mm", blade.thickness_mm, 0.0, 20.0);
  v.number("quality", blade.quality, 0.5, 200.0);
  v.number("level_db", blade.level_db, kNoLevel_db, 0.0);
  v.number("slope_db", blade.slope_db, -30.0, 10.0);
}

template <class Visitor>
void describe(Visitor& v, BlowParams& blow) {
  v.number("impulse_N_s", blow.impulse_N_s, 0.001, 1000.0);
  v.number("contact_s", blow.contact_s, 0.00001, 0.01);
  v.number("rise", blow.rise, 0.0, 3.0);
  v.number("click_db", blow.click_db, kNoLevel_db, 0.0);
  v.number("click_s", blow.click_s, 0.0002, 0.02);
  v.list("modes", blow.modes, 0, kMostModes);
}

}  // namespace osteon::audio
