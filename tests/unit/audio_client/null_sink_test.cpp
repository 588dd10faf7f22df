// RtAudio's real PulseAudio backend, run by deploy/with-null-sink. The rendered sound must arrive at the sink's
// monitor.
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/output/reconnecting_output.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/tones.hpp"
#include "tests/support/process.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kTone = 20000;  // frames in which a tone is measured
constexpr const char* kAlwaysGaps = "the machine's sound has gaps all the time";

struct Channels {
  std::vector<float> left, right;
};

// Records both channels of the sink's monitor, and when each block arrived.
class Monitor {
 public:
  Monitor() {
    pipe_ =
        ::popen("parec --device=virt.monitor --rate=48000 --channels=2 --format=float32le --latency-msec=1 --raw", "r");
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~Monitor() {
    thread_.request_stop();
    thread_.join();
    ::pclose(pipe_);
  }
  [[nodiscard]] std::size_t size() {
    const std::lock_guard lock(mutex_);
    return left_.size();
  }
  [[nodiscard]] std::vector<float> left() {
    const std::lock_guard lock(mutex_);
    return left_;
  }
  // The newest `count` samples of both channels.
  [[nodiscard]] Channels last(std::size_t count) {
    const std::lock_guard lock(mutex_);
    const auto back = static_cast<std::ptrdiff_t>(std::min(count, left_.size()));
    return {{left_.end() - back, left_.end()}, {right_.end() - back, right_.end()}};
  }
  [[nodiscard]] Clock::time_point arrival(std::size_t sample) {
    const std::lock_guard lock(mutex_);
    for (const auto& [end, when] : pieces_) {
      if (sample < end) return when;
    }
    return {};
  }

 private:
  void run(const std::stop_token& stop) {
    std::vector<char> bytes;
    char buffer[4096];
    const int fd = ::fileno(pipe_);
    while (!stop.stop_requested()) {
      pollfd ready{fd, POLLIN, 0};
      if (::poll(&ready, 1, 20) <= 0) continue;
      const ssize_t count = ::read(fd, buffer, sizeof buffer);
      if (count <= 0) return;
      const auto now = Clock::now();
      bytes.insert(bytes.end(), buffer, buffer + count);
      const std::lock_guard lock(mutex_);
      std::size_t at = 0;
      for (; at + 8 <= bytes.size(); at += 8) {
        float samples[2];
        std::copy_n(bytes.data() + at, sizeof samples, reinterpret_cast<char*>(samples));
        left_.push_back(samples[0]);
        right_.push_back(samples[1]);
      }
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
      pieces_.emplace_back(left_.size(), now);
    }
  }

  FILE* pipe_;
  std::mutex mutex_;
  std::vector<float> left_, right_;
  std::vector<std::pair<std::size_t, Clock::time_point>> pieces_;
  std::jthread thread_;
};

// A busy machine causes gaps, which are silence in the monitor. No sound of ours is ever 0 for so long. The sound after
// a gap is shifted, so a tone across the gap has another frequency.
bool has_gap(std::span<const float> sound) {
  constexpr int kGap = 32;
  int zeros = 0;
  for (const float sample : sound) {
    zeros = sample == 0 ? zeros + 1 : 0;
    if (zeros >= kGap) return true;
  }
  return false;
}

// Waits until the monitor has `count` new samples without a gap.
std::optional<Channels> gapless(Monitor& monitor, std::size_t count) {
  constexpr int kTries = 60;
  for (int tries = 0; tries < kTries; ++tries) {
    const std::size_t until = monitor.size() + count;
    if (!test::wait_until([&] { return monitor.size() > until; }, 30s)) return std::nullopt;
    Channels heard = monitor.last(count);
    if (!has_gap(heard.left) && !has_gap(heard.right)) return heard;
  }
  return std::nullopt;
}

// Silence until the test starts it, then a sine whose first sample is already loud, so that its arrival is sharp.
struct ToneSource final : SoundSource {
  std::atomic<bool> on{false};
  std::atomic<std::int64_t> started_ns{0};
  std::atomic<std::uint64_t> frames{0};
  std::uint64_t at = 0;
  void render(std::span<float> left, std::span<float> right) noexcept override {
    const bool sounds = on.load();
    if (sounds && at == 0) started_ns = Clock::now().time_since_epoch().count();
    for (std::size_t i = 0; i < left.size(); ++i, ++at) {
      const double turn = 2 * std::numbers::pi * static_cast<double>(at) / 48000;
      left[i] = sounds ? static_cast<float>(0.5 * std::cos(1000 * turn)) : 0.0F;
      right[i] = sounds ? static_cast<float>(0.25 * std::cos(1500 * turn)) : 0.0F;
    }
    if (!sounds) at = 0;
    frames += left.size();
  }
};

TEST(PulseOutput, RenderedToneArrivesAtTheSink) {
  ToneSource source;
  auto output = open_output({.kind = OutputKind::pulse}, source);
  ASSERT_TRUE(output) << output.error().message;
  Monitor monitor;
  ASSERT_TRUE((*output)->start());
  // The null sink may stall for 1.5 s at its start.
  ASSERT_TRUE(test::wait_until([&] { return source.frames > 96000 && monitor.size() > 48000; }, 30s));
  source.on = true;
  const std::size_t before = monitor.size();
  std::size_t first = before;
  ASSERT_TRUE(test::wait_until(
      [&] {
        const std::vector<float> left = monitor.left();
        while (first < left.size() && left[first] == 0) ++first;
        return first < left.size();
      },
      30s))
      << "nothing arrived";
  const std::optional<Channels> heard = gapless(monitor, kTone);
  (*output)->stop();
  EXPECT_EQ((*output)->failure_reason(), "");

  ASSERT_TRUE(heard) << kAlwaysGaps;
  const sound::Tone left = sound::find_tone(heard->left, 48000, 900, 1100);
  EXPECT_NEAR(left.hz, 1000, 1);
  EXPECT_NEAR(left.level_db, 20 * std::log10(0.5), 1.0);
  EXPECT_NEAR(sound::find_tone(heard->right, 48000, 1400, 1600).level_db, 20 * std::log10(0.25), 1.0);
  EXPECT_LT(sound::tone_db(heard->right, 48000, 1000), -60) << "the channels are apart";

  const double took_ms = std::chrono::duration<double, std::milli>(monitor.arrival(first).time_since_epoch()).count() -
                         static_cast<double>(source.started_ns) / 1e6;
  const double stated_ms = std::chrono::duration<double, std::milli>((*output)->latency()).count();
  std::printf("render to monitor %.1f ms, stated bound %.1f ms, %llu gaps\n", took_ms, stated_ms,
              static_cast<unsigned long long>((*output)->gaps()));
  EXPECT_GT(took_ms, 0);
}

TEST(PulseOutput, TheSinkIsListedAndChosenByItsName) {
  const auto devices = output_devices();
  ASSERT_TRUE(devices) << devices.error().message;
  ASSERT_EQ(devices->size(), 1U) << "the monitor is a source";
  EXPECT_TRUE(devices->front().is_default);
  EXPECT_EQ(devices->front().channels, 2U);
  EXPECT_EQ(devices->front().rate_hz, 48000U);
  EXPECT_FALSE(devices->front().name.empty());
  ToneSource source;
  const auto output = open_output({.kind = OutputKind::pulse, .device = devices->front().name}, source);
  ASSERT_TRUE(output) << output.error().message;
  ASSERT_TRUE((*output)->start());
  EXPECT_TRUE(test::wait_until([&] { return source.frames > 4800; }, 30s));
  (*output)->stop();
  EXPECT_TRUE(open_output({.kind = OutputKind::pulse, .device = "Null"}, source)) << "a part of the name";
  const auto none = open_output({.kind = OutputKind::pulse, .device = "Concert hall"}, source);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::invalid_input);
}

TEST(PulseOutput, DrillIsHeardThroughTheServer) {
  SoundEngine engine(SynthParams{});
  auto output = open_output({.kind = OutputKind::pulse}, engine);
  ASSERT_TRUE(output) << output.error().message;
  Monitor monitor;
  ASSERT_TRUE((*output)->start());
  ASSERT_TRUE(test::wait_until([&] { return engine.frames() > 96000 && monitor.size() > 48000; }, 30s));
  CuttingState state = test::cortical_drill(1200);
  state.state_seq = 9;
  engine.deliver(sound_scene(std::span(&state, 1), Clock::now().time_since_epoch().count()));
  // One second of running is far past the run-up. The sink's own clock is the machine's.
  constexpr std::size_t kRunUp = 56000, kMeasured = 40000;
  const std::size_t running = monitor.size() + kRunUp;
  ASSERT_TRUE(test::wait_until([&] { return monitor.size() > running; }, 30s));
  const std::optional<Channels> heard = gapless(monitor, kMeasured);
  (*output)->stop();

  Sounded sounded;
  ASSERT_TRUE(engine.next_sounded(sounded));
  EXPECT_EQ(sounded.state_seq, 9U);
  EXPECT_GE(sounded.rendered_ns, sounded.received_ns);
  ASSERT_TRUE(heard) << kAlwaysGaps;
  const double mesh_hz = 48 * 1200 / 60.0;
  const sound::Tone mesh = sound::find_tone(heard->left, 48000, mesh_hz - 20, mesh_hz + 20);
  EXPECT_NEAR(mesh.hz, mesh_hz, 1);
  EXPECT_GT(mesh.level_db, -45);
}

// The last one: it ends the server of deploy/with-null-sink, and starts another one in the same place.
TEST(RestartedServer, IsPlayedToAgain) {
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  ASSERT_NE(folder, nullptr);
  ToneSource source;
  ReconnectingOutput output([&] { return open_output({.kind = OutputKind::pulse}, source); });
  ASSERT_TRUE(output.open()) << output.trouble();
  const auto begin = Clock::now();
  ASSERT_TRUE(output.start());
  ASSERT_TRUE(test::wait_until([&] { return source.frames > 4800; }, 30s));

  EXPECT_EQ(test::run("pactl", {"exit"}).exit_code, 0);
  ASSERT_TRUE(test::wait_until(
      [&] {
        output.maintain(Clock::now(), false);
        return !output.trouble().empty();
      },
      30s));
  EXPECT_EQ(output.trouble(), "the sound server went away; start it again, or use --output none with --wav FILE");
  // No more is rendered than time has passed, and fits into the buffers.
  const std::chrono::duration<double> took = Clock::now() - begin;
  EXPECT_LT(static_cast<double>(source.frames), 48000 * took.count() + 4 * 256 + 4800);

  test::ProcessOptions home;
  home.environment = {{"HOME", folder}};
  const test::Process server(
      "pulseaudio",
      {"-n", "-F", std::string(folder) + "/null.pa", "--daemonize=no", "--exit-idle-time=-1", "--use-pid-file=no"},
      home);
  ASSERT_TRUE(test::wait_until(
      [&] {
        output.maintain(Clock::now(), true);
        return output.trouble().empty();
      },
      60s))
      << output.trouble();
  const std::uint64_t before = source.frames;
  source.on = true;
  Monitor monitor;
  ASSERT_TRUE(test::wait_until([&] { return source.frames > before + 96000 && monitor.size() > 48000; }, 60s));
  const std::optional<Channels> heard = gapless(monitor, kTone);
  output.stop();
  ASSERT_TRUE(heard) << kAlwaysGaps;
  EXPECT_NEAR(sound::find_tone(heard->left, 48000, 900, 1100).level_db, 20 * std::log10(0.5), 1.0);
}

}  // namespace
}  // namespace osteon::audio
