// Table 8.1 of the dissertation: a hand-held drill at 1400 rpm.
#include <gtest/gtest.h>

#include "audio_client/synth/gearbox.hpp"
#include "audio_client/synth/handpiece.hpp"

namespace osteon::audio {
namespace {

constexpr double kOutput_hz = 1400.0 / 60.0;

TEST(Gearbox, ShaftsAndMeshesAreThoseOfTheTable) {
  constexpr Gearbox gears;
  // The table rounds its ratios to four digits.
  constexpr double kRounding = 3e-4;
  EXPECT_NEAR(gears.transfer() * kOutput_hz, 89.23, 89.23 * kRounding);
  EXPECT_NEAR(gears.motor() * kOutput_hz, 356.91, 356.91 * kRounding);
  EXPECT_NEAR(gears.output_mesh() * kOutput_hz, 1119.84, 1119.84 * kRounding);
  EXPECT_NEAR(gears.output_spin() * kOutput_hz, 74.66, 74.66 * kRounding);
  EXPECT_NEAR(gears.motor_mesh() * kOutput_hz, 4014.63, 4014.63 * kRounding);
  EXPECT_NEAR(gears.motor_spin() * kOutput_hz, 267.64, 267.64 * kRounding);
}

TEST(Gearbox, MotorsThirdHarmonicLiesWhereItWasHeard) {
  // 8.5.4: about 5500 Hz when running free, 5400 Hz when loaded, and a line near 1800 Hz, at a nominal 1400 rpm.
  constexpr Gearbox gears;
  EXPECT_NEAR(3 * kCommutatorSegments * gears.motor() * kOutput_hz, 5450, 100);
  EXPECT_NEAR(kCommutatorSegments * gears.motor() * kOutput_hz, 1800, 30);
}

TEST(Handpiece, PartialsAreFewEnoughAndPositive) {
  for (const HandpieceKind kind : {HandpieceKind::geared_drill, HandpieceKind::direct_burr}) {
    const Handpiece piece = make_handpiece(kind);
    EXPECT_LE(piece.partials.size(), static_cast<std::size_t>(kMaxPartials));
    for (const Partial& partial : piece.partials) {
      EXPECT_GT(partial.ratio, 0);
      EXPECT_GT(partial.level, 0);
    }
  }
}

TEST(Handpiece, RadiatesBestInTheMiddleBand) {
  EXPECT_LT(radiation(20), 0.02);
  for (const double hz : {600.0, 1000.0, 3000.0, 5500.0}) EXPECT_GT(radiation(hz), 0.6) << hz;
  EXPECT_LT(radiation(15000), 0.25);
}

}  // namespace
}  // namespace osteon::audio
