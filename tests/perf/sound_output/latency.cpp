#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <random>
#include <thread>
#include <tuple>

#include "audio_client/net/state_subscription.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "common/core/mutex.hpp"
#include "common/wire/room_client.hpp"
#include "server/rpc/room_server.hpp"
#include "tests/perf/percentiles.hpp"
#include "tests/perf/sound_output/machine_watch.hpp"
#include "tests/perf/sound_output/monitor.hpp"
#include "tests/perf/sound_output/output_trial.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kStatePeriod = 16667us;  // of a haptic client
constexpr int kCutting_states = 6;      // of each cut
constexpr std::size_t kQuiet_frames = 9600;
constexpr auto kPatience = 20s;
constexpr double kBin_ms = 2;

std::int64_t now_ns() { return Clock::now().time_since_epoch().count(); }
double ms_between(std::int64_t from_ns, std::int64_t to_ns) { return 1e-6 * static_cast<double>(to_ns - from_ns); }

// One cut: when it was accepted, and by which state.
struct Accepted {
  std::uint64_t state_seq = 0;
  std::int64_t at_ns = 0;
  std::size_t heard_frames = 0;  // had come from the monitor by then
};

// A hand in the server's own process, so that one clock sees the acceptance and the sound.
class CuttingHand {
 public:
  explicit CuttingHand(RoomRuntime& runtime, AuthorId author) : runtime_(runtime), author_(author) {}

  // One state, at its time: another one follows a period later.
  std::int64_t publish(CuttingState state) {
    std::this_thread::sleep_until(due_);
    due_ = std::max(due_ + kStatePeriod, Clock::now());
    state.author = author_;
    state.state_seq = ++state_seq_;
    state.time_ns = now_ns();
    const std::int64_t at_ns = now_ns();
    runtime_.publish_state(std::move(state));
    return at_ns;
  }
  void shift(std::chrono::microseconds by) { due_ += by; }
  [[nodiscard]] std::uint64_t state_seq() const { return state_seq_; }

 private:
  RoomRuntime& runtime_;
  AuthorId author_;
  std::uint64_t state_seq_ = 0;
  Clock::time_point due_ = Clock::now();
};

bool quiet(std::span<const Frame> frames) {
  return frames.size() >= kQuiet_frames && std::ranges::all_of(frames.last(kQuiet_frames), &Frame::silent);
}

Result<std::vector<Accepted>> cut_again_and_again(CuttingHand& hand, const Monitor& monitor, std::size_t cuts) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> shift_us(0, 50'000);  // over the periods of the states, the server and the sink
  std::vector<Accepted> accepted;
  while (accepted.size() < cuts) {
    const auto patience = Clock::now() + kPatience;
    hand.shift(std::chrono::microseconds(shift_us(random)));
    hand.publish(idle_drill());
    while (!quiet(monitor.frames())) {
      if (Clock::now() > patience) return failure(ErrorCode::unavailable, "the sink does not become silent");
      hand.publish(idle_drill());
    }
    // A drill that begins in bone: before it there is silence, so its first sample is the first one that is changed.
    const std::size_t heard_frames = monitor.frames().size();
    const std::int64_t at_ns = hand.publish(cortical_drill(1345));
    accepted.push_back({hand.state_seq(), at_ns, heard_frames});
    for (int i = 1; i < kCutting_states; ++i) hand.publish(cortical_drill(1345));
  }
  hand.publish(idle_drill());
  return accepted;
}

struct Latencies {
  std::vector<double> arrived_ms;  // at the monitor
  std::vector<double> played_ms;   // by the sink's clock
  std::vector<double> to_client_ms, to_render_ms, to_monitor_ms;
  std::size_t unheard = 0;
};

// From the states' sequence numbers: when each was received and rendered.
using SoundedStates = std::map<std::uint64_t, audio::Sounded>;

Latencies latencies(const std::vector<Accepted>& accepted, const Monitor& monitor, const SoundedStates& sounded) {
  Latencies found;
  const std::span<const Frame> frames = monitor.frames();
  for (const Accepted& cut : accepted) {
    const auto later = frames.subspan(cut.heard_frames);
    const auto first = std::ranges::find_if_not(later, &Frame::silent);
    const auto known = sounded.lower_bound(cut.state_seq);
    if (first == later.end() || known == sounded.end()) {
      ++found.unheard;
      continue;
    }
    const auto frame = cut.heard_frames + static_cast<std::size_t>(first - later.begin());
    const std::int64_t arrival_ns = monitor.arrival_ns(frame);
    // The sink's clock may move against ours, so it is that of a second before and after.
    const std::size_t second = 48000;
    const Monitor::Clock clock = monitor.clock(frame - std::min(frame, second), frame + second);
    found.arrived_ms.push_back(ms_between(cut.at_ns, arrival_ns));
    found.played_ms.push_back(ms_between(cut.at_ns, std::max(arrival_ns, clock.played_ns(frame))));
    found.to_client_ms.push_back(ms_between(cut.at_ns, known->second.received_ns));
    found.to_render_ms.push_back(ms_between(known->second.received_ns, known->second.rendered_ns));
    found.to_monitor_ms.push_back(ms_between(known->second.rendered_ns, arrival_ns));
  }
  return found;
}

nlohmann::json distribution(std::vector<double> values) {
  std::ranges::sort(values);
  nlohmann::json found = spread(values);
  found["p95"] = rounded(percentile(values, 95));
  return found;
}

// Number of values in steps of kBin_ms, from 0.
nlohmann::json histogram(const std::vector<double>& values) {
  std::vector<std::size_t> bins;
  for (const double value : values) {
    const auto bin = static_cast<std::size_t>(std::max(0.0, value) / kBin_ms);
    bins.resize(std::max(bins.size(), bin + 1));
    ++bins[bin];
  }
  return bins;
}

// The client of osteon-audio: its subscription, its engine and its output.
class Listener {
 public:
  static Result<std::unique_ptr<Listener>> start(const OutputTrial& trial, const std::string& address) {
    Result<audio::SynthParams> params = synth_of(trial);
    if (!params) return tl::unexpected(params.error());
    auto room = wire::join_room(address, wire::ClientKind::audio, "listener", kPatience, {});
    if (!room) return tl::unexpected(room.error());
    audio::SynthParams& synth = *params;
    synth.space.pose_bone_head.position_mm += room->bounds.centre_mm();
    std::unique_ptr<Listener> listener(new Listener(synth));
    auto output = audio::open_output(trial.output, listener->engine_);
    if (!output) return tl::unexpected(output.error());
    listener->output_ = std::move(*output);
    if (Result<void> started = listener->output_->start(); !started) return tl::unexpected(started.error());
    listener->watch_ = StateSubscription::start(
        std::move(*room), [raw = listener.get()](const std::vector<CuttingState>& tools, Clock::time_point received) {
          raw->engine_.deliver(audio::sound_scene(tools, received.time_since_epoch().count()));
        });
    return listener;
  }
  ~Listener() { stop(); }
  void stop() {
    watch_.reset();
    if (output_) output_->stop();
  }
  [[nodiscard]] audio::SoundEngine& engine() { return engine_; }
  [[nodiscard]] const audio::AudioOutput& output() const { return *output_; }
  // Keeps the notes of what was rendered; they do not wait for long.
  void note() {
    for (audio::Sounded one; engine_.next_sounded(one);) sounded_[one.state_seq] = one;
  }
  [[nodiscard]] const SoundedStates& sounded() const { return sounded_; }

 private:
  explicit Listener(const audio::SynthParams& params) : engine_(params) {}

  audio::SoundEngine engine_;
  std::unique_ptr<audio::AudioOutput> output_;
  std::unique_ptr<StateSubscription> watch_;
  SoundedStates sounded_;
};

}  // namespace

Result<nlohmann::json> time_cuts(const OutputTrial& trial) {
  const TempDir folder;
  const Case bone = plain_block(20, 10, 1);
  if (Result<void> saved = bone.save(folder / "case"); !saved) return tl::unexpected(saved.error());
  auto server = RoomServer::start(Room(bone), {.case_folder = folder / "case"}, [](double) {});
  if (!server) return tl::unexpected(server.error());
  RoomRuntime& runtime = (*(*server)->rooms().find(""))->runtime();
  const Result<AuthorId> author = runtime.join(MemberKind::surgeon, "hand");
  if (!author) return tl::unexpected(author.error());
  // A trial lasts about half a second of drill that runs down, and the silence after it.
  const auto most_frames = static_cast<std::size_t>((3.0 * static_cast<double>(trial.cuts) + 60) * kOutputRate_hz);
  const auto monitor = Monitor::open(kSink, most_frames);
  if (!monitor) return tl::unexpected(monitor.error());
  auto listener = Listener::start(trial, (*server)->address());
  if (!listener) return tl::unexpected(listener.error());
  std::optional<AwakeMachine> awake;
  if (trial.awake) awake.emplace();
  CuttingHand hand(runtime, *author);
  std::jthread notes([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      (*listener)->note();
      std::this_thread::sleep_for(100ms);
    }
  });
  const auto accepted = cut_again_and_again(hand, **monitor, trial.cuts);
  if (!accepted) return tl::unexpected(accepted.error());
  std::this_thread::sleep_for(1s);
  notes.request_stop();
  notes.join();
  (*listener)->stop();
  (*listener)->note();

  const Latencies found = latencies(*accepted, **monitor, (*listener)->sounded());
  const std::size_t end = (*monitor)->frames().size();
  nlohmann::json out = described(trial);
  out.update(
      {{"unheard", found.unheard},
       {"gaps_by_clock", (*listener)->output().gaps()},
       {"arrived_ms", distribution(found.arrived_ms)},
       {"histogram", {{"bin_ms", kBin_ms}, {"counts", histogram(found.arrived_ms)}}},
       {"played_ms", distribution(found.played_ms)},
       {"server_and_network_ms", distribution(found.to_client_ms)},
       {"wait_for_render_ms", distribution(found.to_render_ms)},
       {"render_to_monitor_ms", distribution(found.to_monitor_ms)},
       {"monitor_late_ms", distribution((*monitor)->clock(end - std::min<std::size_t>(end, 480'000), end).late_ms)}});
  return out;
}

}  // namespace osteon::test
