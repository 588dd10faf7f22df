// States of a drilling: synthetic recordings whose states are known, and partitions in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "common/sound/drilling_states.hpp"
#include "common/sound/gearbox.hpp"
#include "common/sound/levels.hpp"
#include "tests/unit/sound/signals.hpp"

namespace osteon::sound {
namespace {

constexpr double kTolerance_s = 0.05;

struct Scene {
  DrillingState state;
  double seconds;
  double noise_db;           // RMS of white noise
  double motor_db, mesh_db;  // amplitude of the motor's third harmonic, and of the motor's mesh
  double rumble_db = -200;   // amplitude at 200 Hz
};

double amplitude(double db) { return std::pow(10.0, db / 20.0); }

std::vector<float> played(const std::vector<Scene>& scenes, unsigned seed) {
  const std::vector<GearLine> lines = gear_table(Gearbox{}, 1400);
  const auto hz = [&](std::string_view line) { return std::ranges::find(lines, line, &GearLine::name)->hz; };
  std::vector<float> all;
  for (const Scene& scene : scenes) {
    const auto count = static_cast<std::size_t>(scene.seconds * kAnalysed_hz);
    std::vector<float> part = white_noise(amplitude(scene.noise_db), count, seed++);
    part = added(part, tone(hz("commutation x3"), amplitude(scene.motor_db), count, kAnalysed_hz));
    part = added(part, tone(hz("motor mesh"), amplitude(scene.mesh_db), count, kAnalysed_hz));
    part = added(part, tone(200, amplitude(scene.rumble_db), count, kAnalysed_hz));
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

void expect_states(const std::vector<StateSpan>& found, const std::vector<Scene>& scenes,
                   double tolerance_s = kTolerance_s) {
  ASSERT_EQ(found.size(), scenes.size());
  double at_s = 0;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    EXPECT_EQ(name(found[i].state), name(scenes[i].state)) << "part " << i;
    EXPECT_NEAR(found[i].from_s, at_s, i == 0 ? 0.0 : tolerance_s) << name(scenes[i].state);
    at_s += scenes[i].seconds;
    EXPECT_NEAR(found[i].to_s, at_s, tolerance_s) << name(scenes[i].state);
  }
}

std::string words(const std::vector<StateSpan>& spans) {
  std::string text;
  for (const StateSpan& span : spans)
    text +=
        std::string(name(span.state)) + " " + std::to_string(span.from_s) + " (" + std::to_string(span.level_db) + ") ";
  return text;
}

// The order of Figure 8.13, on a bone with two cortices.
std::vector<Scene> drilling() {
  return {{DrillingState::before, 0.8, -66, -200, -200},      {DrillingState::free, 1.3, -38, -32, -35},
          {DrillingState::cortical, 2.1, -29, -21, -24, -32}, {DrillingState::cancellous, 1.7, -33, -31, -27, -40},
          {DrillingState::cortical, 1.1, -29, -21, -24, -32}, {DrillingState::perforation, 0.12, -24, -21, -22, -10},
          {DrillingState::free, 0.9, -38, -32, -35},          {DrillingState::after, 0.7, -66, -200, -200}};
}

TEST(DrillingStates, KnownStatesAreFoundWithinFiftyMilliseconds) {
  for (const unsigned seed : {1U, 100U, 200U}) {
    const auto found = drilling_states(played(drilling(), seed), kAnalysed_hz);
    SCOPED_TRACE(words(found));
    expect_states(found, drilling());
  }
}

// The modes of a hand piece ring off exponentially, and so pass the level of cancellous bone on their way to the free
// drill's. At 145 dB in a second that takes 0.05 to 0.1 s.
TEST(DrillingStates, ABurstThatRingsOffIsNoBone) {
  constexpr double kDecay_s = 0.06, kLoudest_db = -6;
  for (const bool through_soft : {false, true}) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
      std::vector<Scene> scenes = drilling();
      if (!through_soft) scenes.erase(scenes.begin() + 3, scenes.begin() + 5);
      const std::size_t burst = scenes.size() - 3;
      scenes[burst] = {DrillingState::free, 0.2, -38, -32, -35};  // below the burst the drill already runs free
      std::vector<float> samples = played(scenes, 100 * seed);
      double at_s = 0;
      for (std::size_t i = 0; i < burst; ++i) at_s += scenes[i].seconds;
      for (auto n = static_cast<std::size_t>(at_s * kAnalysed_hz); n < samples.size(); ++n) {
        const double t_s = static_cast<double>(n) / kAnalysed_hz - at_s;
        samples[n] += static_cast<float>(amplitude(kLoudest_db) * std::exp(-t_s / kDecay_s) *
                                         std::sin(2 * std::numbers::pi * 200 * t_s));
      }
      const auto found = drilling_states(samples, kAnalysed_hz);
      SCOPED_TRACE(words(found));
      ASSERT_EQ(found.size(), scenes.size());
      EXPECT_EQ(found[burst].state, DrillingState::perforation);
      EXPECT_NEAR(found[burst].from_s, at_s, kTolerance_s);
      EXPECT_EQ(found[burst + 1].state, DrillingState::free);
      EXPECT_LT(found[burst].to_s, at_s + 0.3) << "by then it is below the free drill";
    }
  }
}

// A drill that goes on in soft bone after a loud moment has not broken through.
TEST(DrillingStates, SoftBoneAfterABurstIsBone) {
  std::vector<Scene> scenes = drilling();
  scenes[6] = {DrillingState::cancellous, 0.9, -33, -31, -27, -40};
  const auto found = drilling_states(played(scenes, 4), kAnalysed_hz);
  SCOPED_TRACE(words(found));
  for (const StateSpan& span : found) EXPECT_NE(span.state, DrillingState::perforation);
}

TEST(DrillingStates, LoudnessOfTheRecordingDoesNotMatter) {
  for (const double gain : {0.3, 2.0}) {
    std::vector<float> samples = played(drilling(), 5);
    for (float& x : samples) x *= static_cast<float>(gain);
    const auto found = drilling_states(samples, kAnalysed_hz);
    SCOPED_TRACE(words(found));
    expect_states(found, drilling());
  }
}

TEST(DrillingStates, OneKindOfBoneIsKnownByItsLines) {
  // The motor's line leads in cortical bone, and the mesh in cancellous bone.
  for (const auto state : {DrillingState::cortical, DrillingState::cancellous}) {
    const bool hard = state == DrillingState::cortical;
    const std::vector<Scene> scenes = {{DrillingState::before, 0.6, -66, -200, -200},
                                       {DrillingState::free, 1.0, -38, -32, -35},
                                       {state, 1.5, -30, hard ? -21.0 : -27.0, hard ? -27.0 : -21.0},
                                       {DrillingState::after, 0.6, -66, -200, -200}};
    const auto found = drilling_states(played(scenes, 9), kAnalysed_hz);
    SCOPED_TRACE(words(found));
    expect_states(found, scenes);
  }
}

std::vector<Scene> one_bone(DrillingState state, double seconds, double noise_db, double motor_db, double mesh_db) {
  return {{DrillingState::before, 0.6, -66, -200, -200},
          {DrillingState::free, 1.0, -42, -200, -200},
          {state, seconds, noise_db, motor_db, mesh_db},
          {DrillingState::after, 0.6, -66, -200, -200}};
}

TEST(DrillingStates, BeyondTheRateOfTheRecordingNoLineDecides) {
  // At 3500 rpm the motor's third harmonic is at 13382 Hz, and its mesh at 10037 Hz. The mesh alone proves nothing.
  const std::vector<Scene> scenes = one_bone(DrillingState::cortical, 1.5, -30, -200, -200);
  const auto found = drilling_states(played(scenes, 9), kAnalysed_hz, {.spindle_rpm = 3500, .free = {}});
  SCOPED_TRACE(words(found));
  expect_states(found, scenes);
}

TEST(DrillingStates, NoiseFavoursNoLine) {
  // In bands of 535 Hz the noise has -43.1 dB, and a mesh 8.3 dB below it adds 0.6 dB. Noise alone varies by
  // 1 / sqrt(535 * 4), or 0.1 dB.
  const std::vector<Scene> scenes = one_bone(DrillingState::cancellous, 4.0, -30, -200, -48.4);
  const auto found = drilling_states(played(scenes, 9), kAnalysed_hz);
  SCOPED_TRACE(words(found));
  expect_states(found, scenes);
}

TEST(DrillingStates, LongRecordingsHaveLongerFrames) {
  // 200 s at 6000 frames: one each 33 ms, and parts of at least three. So the burst is not found.
  std::vector<Scene> scenes = drilling();
  scenes.erase(scenes.begin() + 5);
  for (Scene& scene : scenes) scene.seconds *= 200 / 8.6;
  const auto found = drilling_states(played(scenes, 3), kAnalysed_hz);
  SCOPED_TRACE(words(found));
  expect_states(found, scenes, 3 * 200.0 / kMostFrames);
}

TEST(DrillingStates, ASteadyDrillIsFree) {
  const std::vector<Scene> scenes = {{DrillingState::free, 3.0, -38, -32, -35}};
  expect_states(drilling_states(played(scenes, 3), kAnalysed_hz), scenes);
}

TEST(DrillingStates, SilenceIsBeforeAnyDrill) {
  const auto digital = drilling_states(std::vector<float>(22050, 0.0F), kAnalysed_hz);
  ASSERT_EQ(digital.size(), 1U);
  EXPECT_EQ(digital.front().state, DrillingState::before);
  EXPECT_NEAR(digital.front().to_s, 1.0, 1e-9);
  EXPECT_TRUE(drilling_states(std::vector<float>(100, 0.1F), kAnalysed_hz).empty());
}

TEST(DrillingStates, TheUserMaySayWhereTheDrillRunsFree) {
  // Begins in bone: the quietest part would count as free. The user knows better.
  const std::vector<Scene> scenes = {{DrillingState::cortical, 1.5, -29, -21, -24},
                                     {DrillingState::cancellous, 1.5, -33, -31, -27},
                                     {DrillingState::free, 0.15, -38, -32, -35}};
  const auto samples = played(scenes, 21);
  const auto guessed = drilling_states(samples, kAnalysed_hz);
  ASSERT_GE(guessed.size(), 2U);
  EXPECT_EQ(guessed[1].state, DrillingState::free) << words(guessed);
  const auto told = drilling_states(samples, kAnalysed_hz, {.free = TimeSpan{3.02, 3.13}});
  SCOPED_TRACE(words(told));
  expect_states(told, scenes);
}

TEST(OptimalPartition, FindsExactEdges) {
  std::vector<double> rows;
  const std::vector<std::size_t> edges = {0, 17, 20, 60};
  for (std::size_t i = 0; i < 100; ++i)
    for (const double height : {1.0, -2.0})
      rows.push_back(height * (i < edges[1] ? 0.0 : i < edges[2] ? 10.0 : i < edges[3] ? -3.0 : 4.0));
  EXPECT_EQ(optimal_partition(rows, 2, 5.0, 3), edges);
  // A step of h between two equal halves of n rows costs n h^2 / 4 without an edge, here 100.
  const auto step = [](std::size_t i) { return i < 50 ? 0.0 : 2.0; };
  rows.clear();
  for (std::size_t i = 0; i < 100; ++i) rows.push_back(step(i));
  EXPECT_EQ(optimal_partition(rows, 1, 99.0, 3), (std::vector<std::size_t>{0, 50}));
  EXPECT_EQ(optimal_partition(rows, 1, 101.0, 3), (std::vector<std::size_t>{0}));
}

TEST(OptimalPartition, PartsAreNotShorterThanAsked) {
  std::vector<double> rows(40, 0.0);
  rows[20] = 100.0;
  for (const std::size_t shortest : {std::size_t{1}, std::size_t{4}, std::size_t{7}}) {
    auto edges = optimal_partition(rows, 1, 1.0, shortest);
    edges.push_back(rows.size());
    for (std::size_t i = 1; i < edges.size(); ++i) EXPECT_GE(edges[i] - edges[i - 1], shortest);
    EXPECT_GT(edges.size(), 2U);
  }
  EXPECT_TRUE(optimal_partition({}, 1, 1.0, 3).empty());
  EXPECT_EQ(optimal_partition(std::vector<double>(2, 1.0), 1, 1.0, 3), (std::vector<std::size_t>{0}));
}

}  // namespace
}  // namespace osteon::sound
