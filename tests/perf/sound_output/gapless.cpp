#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>
#include <vector>

#include "audio_client/output/sound_engine.hpp"
#include "tests/perf/percentiles.hpp"
#include "tests/perf/sound_output/machine_watch.hpp"
#include "tests/perf/sound_output/measured_source.hpp"
#include "tests/perf/sound_output/monitor.hpp"
#include "tests/perf/sound_output/output_trial.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr double kHalf = 0.5;        // of a period, the most that the thread may work
constexpr double kLongStall_ms = 5;  // shorter ones are no reason for a gap: the buffers hold more

// A drilling that never rests, again and again. It moves round the listener, at 60 states a second as a haptic client
// sends them.
class DrillingHand {
 public:
  explicit DrillingHand(audio::SoundEngine& engine) : engine_(engine) {
    for (const CuttingState& state : scripted_drilling().states)
      if (state.spindle_rpm > 1000) states_.push_back(state);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }

 private:
  void run(const std::stop_token& stop) {
    auto due = Clock::now();
    for (std::uint64_t i = 0; !stop.stop_requested(); ++i) {
      CuttingState state = states_[2 * i % states_.size()];
      state.state_seq = i + 1;
      state.time_ns = Clock::now().time_since_epoch().count();
      const double turn = 0.02 * static_cast<double>(i);
      state.pose_bone_tool.position_mm = Vec3(60 * std::cos(turn), 0, 60 * std::sin(turn));
      engine_.deliver(audio::sound_scene({&state, 1}, state.time_ns));
      std::this_thread::sleep_until(due += 16667us);
    }
  }

  audio::SoundEngine& engine_;
  std::vector<CuttingState> states_;
  std::jthread thread_;
};

// Gaps for which no processor's stall is to blame. A gap is heard soon after the stall that made it.
std::size_t unexplained(const FrameComparison& heard, const Monitor& monitor, const std::vector<Stall>& stalls) {
  constexpr std::int64_t kSoon_ns = 60'000'000;
  return static_cast<std::size_t>(std::ranges::count_if(heard.gaps, [&](std::size_t frame) {
    const std::int64_t at_ns = monitor.arrival_ns(frame);
    return std::ranges::none_of(stalls, [&](const Stall& stall) {
      return stall.ms() >= kLongStall_ms && stall.from_ns <= at_ns && at_ns < stall.to_ns + kSoon_ns;
    });
  }));
}

using ThreadUse = MeasuredSource::ThreadUse;

std::vector<double> sorted_shares(const std::vector<ThreadUse>& uses) {
  std::vector<double> shares;
  for (const ThreadUse& use : uses) shares.push_back(use.share);
  std::ranges::sort(shares);
  return shares;
}

// Without those uses during which a processor stood still, if only for a short time.
std::vector<ThreadUse> undisturbed(std::vector<ThreadUse> uses, const std::vector<Stall>& stalls) {
  std::erase_if(uses, [&](const ThreadUse& use) {
    return std::ranges::any_of(stalls, [&](const Stall& stall) {
      return stall.from_ns - MachineWatch::kLook_ns <= use.to_ns && use.from_ns <= stall.to_ns;
    });
  });
  return uses;
}

double longest_ms(const std::vector<Stall>& stalls) {
  double longest = 0;
  for (const Stall& stall : stalls) longest = std::max(longest, stall.ms());
  return longest;
}

}  // namespace

Result<nlohmann::json> play_without_gaps(const OutputTrial& trial) {
  Result<audio::SynthParams> params = synth_of(trial);
  if (!params) return tl::unexpected(params.error());
  const auto most_frames = static_cast<std::size_t>((60 * trial.minutes + 60) * kOutputRate_hz);
  audio::SoundEngine engine(*params);
  MeasuredSource source(engine, most_frames);
  const Result<std::unique_ptr<Monitor>> monitor = Monitor::open(kSink, most_frames);
  if (!monitor) return tl::unexpected(monitor.error());
  Result<std::unique_ptr<audio::AudioOutput>> output = audio::open_output(trial.output, source);
  if (!output) return tl::unexpected(output.error());
  std::optional<AwakeMachine> awake;
  if (trial.awake) awake.emplace();
  MachineWatch machine;
  if (Result<void> started = (*output)->start(); !started) return tl::unexpected(started.error());
  {
    const DrillingHand hand(engine);
    std::this_thread::sleep_for(std::chrono::duration<double>(60 * trial.minutes));
  }
  (*output)->stop();
  std::this_thread::sleep_for(500ms);
  const std::vector<Stall> stalls = machine.stop();
  const double stolen_s = machine.stolen_s();

  const FrameComparison heard = compare(source.frames(), (*monitor)->frames());
  const std::vector<ThreadUse> uses = source.thread_uses();
  const std::vector<double> shares = sorted_shares(uses), own_shares = sorted_shares(undisturbed(uses, stalls));
  const SinkFacts sink = (*monitor)->sink();
  nlohmann::json found = described(trial);
  found.update({{"sink_keeps_samples", sink.float_48k_stereo && sink.full_volume},
                {"trouble", (*output)->failure_reason()},
                {"seconds_equal", static_cast<double>(heard.equal) / kOutputRate_hz},
                {"gaps", heard.gaps.size()},
                {"gaps_without_stall", unexplained(heard, **monitor, stalls)},
                {"stalls", std::ranges::count_if(stalls, [](const Stall& one) { return one.ms() >= kLongStall_ms; })},
                {"longest_stall_ms", longest_ms(stalls)},
                {"stolen_s", stolen_s},
                {"silent_frames", heard.silent},
                {"jumps", heard.jumps},
                {"missing_frames", heard.missing},
                {"differing_frames", heard.differing},
                {"monitor_holes", (*monitor)->holes()},
                {"gaps_by_clock", (*output)->gaps()},
                {"late_callbacks", (*output)->late_callbacks()},
                {"realtime", source.is_realtime()},
                {"callbacks", shares.size()},
                {"share_p50", percentile(shares, 50)},
                {"share_p99", percentile(shares, 99)},
                {"share_max", percentile(shares, 100)},
                {"share_max_without_stall", percentile(own_shares, 100)},
                {"disturbed", 1 - static_cast<double>(own_shares.size()) / static_cast<double>(shares.size())},
                {"above_half", std::ranges::count_if(shares, [](double share) { return share > kHalf; })},
                {"allocations", source.allocations()},
                {"allocations_of_thread", source.allocations_of_thread()}});
  return found;
}

}  // namespace osteon::test
