// Tests what a listener hears of: a simulated hand broaches and drills beside a real server, and a subscriber gets the
// states that an audio client gets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "audio_client/net/state_subscription.hpp"
#include "common/core/mutex.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

// Keeps every state once.
class Listener {
 public:
  explicit Listener(const std::string& address) {
    auto room = wire::join_room(address, wire::ClientKind::audio, "listener", 20s, {});
    if (room)
      subscription_ = StateSubscription::start(std::move(*room), [this](const auto& states, auto) { take(states); });
  }
  [[nodiscard]] bool joined() const { return subscription_ != nullptr; }
  [[nodiscard]] std::vector<CuttingState> heard() const {
    const MutexLock lock(mutex_);
    return heard_;
  }

 private:
  void take(const std::vector<CuttingState>& states) {
    const MutexLock lock(mutex_);
    for (const CuttingState& state : states)
      if (heard_.empty() || heard_.back().state_seq < state.state_seq) heard_.push_back(state);
  }
  mutable Mutex mutex_{LockRank::leaf};
  std::vector<CuttingState> heard_ OSTEON_GUARDED_BY(mutex_);
  std::unique_ptr<StateSubscription> subscription_;  // last: its thread uses the other members
};

// Row of the haptic client's log in which the state was computed.
std::size_t row_of(const Table& log, const CuttingState& state) {
  const auto& seqs = log["state_seq"];
  const auto at = std::ranges::lower_bound(seqs, static_cast<double>(state.state_seq));
  return static_cast<std::size_t>(at - seqs.begin());
}

// Runs one step, and returns what was heard while the tool was in somebody's hand.
std::vector<CuttingState> heard_during(Stage& stage, const json& step) {
  Listener listener(stage.address());
  EXPECT_TRUE(listener.joined());
  Process haptic = stage.start_haptic("hand", {{"steps", json::array({step})}});
  EXPECT_EQ(haptic.wait(180s), 0) << haptic.err();
  std::vector<CuttingState> heard = listener.heard();
  // The last one may be the server's own, of a tool that nobody holds any more: of the same time as the one before.
  if (heard.size() > 1 && heard.back().time_ns == heard[heard.size() - 2].time_ns) heard.pop_back();
  return heard;
}

// Section of the keel broach `deep_mm` in a face, by the numbers of its definition.
double section_mm2(double deep_mm) {
  const double less = 2.0 * (40.0 - deep_mm) * std::tan(5.0 * std::numbers::pi / 180.0);
  return (40.0 - less) * (12.0 - less) - 2.0 * 1.5 * 1.5;
}

// A broach goes by blows of 3920 N mm against 130 MPa (1.2 / 1.9)^2 times its section. It is seated where a blow drives
// it 0.1 mm, so its seating is that advance over the present one. What moves it in the log are the blows.
TEST(SoundState, TheBlowsOnABroachAreCountedAndItsSeatingRises) {
  constexpr double kDensity = 1.2, kTo_mm = 6.0;
  Stage stage([](const std::filesystem::path& folder) {
    const Result<void> saved = layered_block({{20.0, kDensity}}, 60.0, 0.5).save(folder);
    ASSERT_TRUE(saved) << saved.error().message;
  });
  json step = drill_at(0.0, 0.0, "expert");
  step.update({{"tool", "broach-2"}, {"spindle_rpm", 240}, {"to_mm", kTo_mm}, {"push_n", 40}});
  step.erase("beyond_mm");
  step.erase("feed_mm_per_s");
  const std::vector<CuttingState> heard = heard_during(stage, step);
  const Table log = read_table(stage / "hand.csv");
  ASSERT_GT(heard.size(), 50u);

  std::size_t bursts = 0;
  double last_burst_s = -1.0;
  for (std::size_t i = 1; i < log.entries(); ++i)
    if (log.texts.at("phase")[i] == "cutting" && log["depth_mm"][i] > log["depth_mm"][i - 1] + 1e-3) {
      if (log["time_s"][i] > last_burst_s + 0.05) ++bursts;
      last_burst_s = log["time_s"][i];
    }
  std::printf("%zu states, %u blows, %zu bursts\n", heard.size(), heard.back().blows, bursts);
  EXPECT_GT(bursts, 8u);
  // The point of a blow may be missed on both sides: the first only brings the faces to rest, the last ends the step.
  EXPECT_NEAR(heard.back().blows, static_cast<double>(bursts), 1.0);
  EXPECT_EQ(heard.back().blows, log["blows"].back());
  EXPECT_NEAR(heard.back().blow_impulse_N_s, 2.8, 0.001);

  const double per_mm2 = 0.1 * 130.0 * (kDensity / 1.9) * (kDensity / 1.9) / 3920.0;
  double most_seated = 0.0;
  std::size_t compared = 0;
  for (std::size_t k = 1; k < heard.size(); ++k) {
    const CuttingState& state = heard[k];
    const std::size_t row = row_of(log, state);
    if (row >= log.entries() || log["state_seq"][row] != static_cast<double>(state.state_seq)) continue;
    EXPECT_GE(state.blows, heard[k - 1].blows);
    EXPECT_EQ(state.blows, log["blows"][row]) << "as the tick counted";
    EXPECT_EQ(state.time_ns / 1000, std::llround(log["mono_ns"][row]) / 1000) << "when the tick was";
    if (state.phase != CuttingPhase::rubbing || state.depth_mm < 1.0 || state.seated == 0.0) continue;
    const double seated = per_mm2 * section_mm2(state.depth_mm);
    // The points on the broach's faces stand for its area within a twelfth (tool_effects_test.cpp).
    EXPECT_NEAR(state.seated, seated, 0.1 * seated) << state.depth_mm;
    EXPECT_GE(state.seated, most_seated - 0.02 * seated);
    most_seated = std::max(most_seated, state.seated);
    ++compared;
  }
  EXPECT_GT(compared, 20u);
  EXPECT_GT(most_seated, 1.1 * per_mm2 * section_mm2(1.0));
}

// The block of force-laws.md: cortices of 5 mm around 20 mm of medulla. From 1.5 mm on, the whole layer is seen.
TEST(SoundState, ADrillKnowsTheLayerThatItCuts) {
  Stage stage;
  const std::vector<CuttingState> heard = heard_during(stage, drill_at(0.0, 0.0, "expert"));
  const Table log = read_table(stage / "hand.csv");
  std::size_t near = 0, medulla = 0, far = 0;
  double deepest = -1e9;
  for (const CuttingState& state : heard) {
    const bool on_the_way = state.depth_mm >= deepest;
    deepest = std::max(deepest, state.depth_mm);
    EXPECT_EQ(state.blows, 0u);
    if (!on_the_way || state.phase != CuttingPhase::cutting) continue;
    if (state.depth_mm > 1.5 && state.depth_mm < 4.5) {
      EXPECT_NEAR(state.cortex_mm, 5.0, 0.5) << state.depth_mm;
      ++near;
    } else if (state.depth_mm > 9.0 && state.depth_mm < 23.0) {
      EXPECT_EQ(state.cortex_mm, 0.0) << state.depth_mm;
      ++medulla;
    } else if (state.depth_mm > 26.5 && state.depth_mm < 29.5) {
      EXPECT_NEAR(state.cortex_mm, 5.0, 0.5) << state.depth_mm;
      ++far;
    }
  }
  std::printf("%zu, %zu and %zu states in near cortex, medulla and far cortex\n", near, medulla, far);
  EXPECT_GT(near, 50u);
  EXPECT_GT(medulla, 10u);
  EXPECT_GT(far, 20u);
  EXPECT_NEAR(std::ranges::max(log["cortex_mm"]), 5.0, 0.5);
}

}  // namespace
}  // namespace osteon::test
