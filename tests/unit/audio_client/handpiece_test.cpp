// What a preset becomes for a tool: its partials, its motor at the spindle, its noise, and how its body radiates.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "audio_client/presets/preset_file.hpp"
#include "audio_client/synth/handpiece.hpp"
#include "audio_client/synth/noise_bank.hpp"
#include "common/sound/spectrum.hpp"
#include "common/tools/tool.hpp"

namespace osteon::audio {
namespace {

TEST(Handpiece, PartialsAreFewEnoughAndPositive) {
  for (const ToolModel& model : builtin_presets()) {
    const Handpiece piece = make_handpiece(model, nullptr, 48000);
    EXPECT_LE(piece.partials.size(), static_cast<std::size_t>(kMaxPartials));
    for (const Partial& partial : piece.partials) {
      EXPECT_GT(partial.ratio, 0) << model.name;
      EXPECT_GT(partial.level, 0) << model.name;
    }
  }
}

TEST(Handpiece, ItsTeethAreThoseOfTheTool) {
  const auto reamer = find_tool("reamer-sphere");
  ASSERT_TRUE(reamer);
  const ToolModel* model = preset_for(builtin_presets(), "reamer-sphere", "sphere-reamer");
  ASSERT_NE(model, nullptr);
  const Handpiece piece = make_handpiece(*model, &*reamer, 48000);
  EXPECT_EQ(piece.teeth, 40);
  std::vector<double> teeth;
  for (const Partial& partial : piece.partials)
    if (partial.source == LineSource::teeth) teeth.push_back(partial.ratio);
  EXPECT_EQ(teeth, (std::vector<double>{40, 80, 120, 160, 200, 240, 39, 41}));
}

// The power of motor and spindle is the same but for the gear's loss, and so is the time constant.
TEST(Handpiece, TheMotorIsSeenThroughItsGear) {
  const Motor motor{.reduction = 16, .efficiency = 0.8, .droop_rpm_per_Nmm = 100, .most_Nmm = 30, .inertia_g_cm2 = 10};
  const SpindleParams spindle = at_spindle(motor, 1000);
  EXPECT_NEAR(spindle.most_nmm, 30 * 16 * 0.8, 1e-9);
  EXPECT_NEAR(spindle.droop_rpm_per_nmm, 100 / (16.0 * 16.0 * 0.8), 1e-12);
  // J d: 1e-6 kg m^2 times 100 rpm / (N mm) = 10472 rad/s / (N m).
  EXPECT_NEAR(spindle.response_s, 1e-6 * 10471.98, 1e-6);
}

TEST(Handpiece, RadiatesBestInTheMiddleBand) {
  EXPECT_LT(radiation(20), 0.02);
  for (const double hz : {600.0, 1000.0, 3000.0, 5500.0}) EXPECT_GT(radiation(hz), 0.6) << hz;
  EXPECT_LT(radiation(15000), 0.25);
}

TEST(NoiseBank, HasTheDensityOfItsPoints) {
  const std::vector<NoisePoint> points = {{250, -70}, {500, -64}, {1000, -66}, {2000, -62}, {4000, -66}, {8000, -70}};
  NoiseBank bank;
  bank.prepare(points, 48000);
  WhiteNoise white(3);
  std::vector<float> samples;
  for (int i = 0; i < 8000; ++i) {
    Block block{};
    bank.add_to(block, white, 1.0F, 1.0F);
    samples.insert(samples.end(), block.begin(), block.end());
  }
  const sound::Spectrum spectrum = sound::power_spectrum(samples, 48000);
  for (const NoisePoint& point : points) {
    const double width = 0.06 * point.hz;
    const double db_per_hz =
        sound::band_db(spectrum, point.hz - width, point.hz + width) - 10.0 * std::log10(2.0 * width);
    EXPECT_NEAR(db_per_hz, point.db_per_hz, 1.0) << point.hz;
  }
}

}  // namespace
}  // namespace osteon::audio
