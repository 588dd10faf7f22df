// RtAudio's real PulseAudio backend, run by deploy/with-null-sink. The rendered sound must arrive at the sink's
// monitor.
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <numbers>
#include <span>
#include <thread>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/tones.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// Records the left channel of the sink's monitor, and when each block arrived.
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
        float sample;
        std::copy_n(bytes.data() + at, sizeof sample, reinterpret_cast<char*>(&sample));
        left_.push_back(sample);
      }
      bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
      pieces_.emplace_back(left_.size(), now);
    }
  }

  FILE* pipe_;
  std::mutex mutex_;
  std::vector<float> left_;
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

// Silence until the test starts it, then a sine whose first sample is already loud, so that its arrival is sharp.
struct ToneSource final : SoundSource {
  std::atomic<bool> on{false};
  std::atomic<std::int64_t> started_ns{0};
  std::atomic<std::uint64_t> frames{0};
  std::uint64_t at = 0;
  void render(std::span<float> mono) noexcept override {
    const bool sounds = on.load();
    if (sounds && at == 0) started_ns = Clock::now().time_since_epoch().count();
    for (float& x : mono) {
      x = sounds ? static_cast<float>(0.5 * std::cos(2 * std::numbers::pi * 1000 * static_cast<double>(at++) / 48000))
                 : 0.0F;
    }
    frames += mono.size();
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
  ASSERT_TRUE(test::wait_until([&] { return monitor.size() > before + 96000; }, 30s));
  (*output)->stop();
  EXPECT_EQ((*output)->failure_reason(), "");

  const std::vector<float> left = monitor.left();
  std::size_t first = before;
  while (first < left.size() && left[first] == 0) ++first;
  ASSERT_LT(first + 24000, left.size()) << "nothing arrived";
  const std::span<const float> tone = std::span(left).subspan(first + 1000, 20000);
  const sound::Tone heard = sound::find_tone(tone, 48000, 900, 1100);
  EXPECT_NEAR(heard.hz, 1000, 1);
  EXPECT_NEAR(heard.level_db, 20 * std::log10(0.5), 1.0);

  const double took_ms = std::chrono::duration<double, std::milli>(monitor.arrival(first).time_since_epoch()).count() -
                         static_cast<double>(source.started_ns) / 1e6;
  const double stated_ms = std::chrono::duration<double, std::milli>((*output)->latency()).count();
  std::printf("render to monitor %.1f ms, stated bound %.1f ms, %llu gaps\n", took_ms, stated_ms,
              static_cast<unsigned long long>((*output)->gaps()));
  EXPECT_GT(took_ms, 0);
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
  constexpr std::size_t kRunUp = 56000, kAcknowledged = 40000;
  constexpr int kTries = 40;
  std::vector<float> left;
  std::size_t until = monitor.size() + kRunUp;
  for (int tries = 0; left.empty() || has_gap(std::span(left).last(kAcknowledged)); ++tries) {
    ASSERT_LT(tries, kTries) << "the machine's sound has gaps all the time";
    const std::uint64_t gaps = (*output)->gaps();
    until += kAcknowledged;
    ASSERT_TRUE(test::wait_until([&] { return monitor.size() > until; }, 30s));
    if ((*output)->gaps() == gaps) left = monitor.left();
  }
  (*output)->stop();

  Sounded sounded;
  ASSERT_TRUE(engine.next_sounded(sounded));
  EXPECT_EQ(sounded.state_seq, 9U);
  EXPECT_GE(sounded.rendered_ns, sounded.received_ns);
  const double mesh_hz = 48 * 1200 / 60.0;
  const sound::Tone mesh = sound::find_tone(std::span(left).last(kAcknowledged), 48000, mesh_hz - 20, mesh_hz + 20);
  EXPECT_NEAR(mesh.hz, mesh_hz, 1);
  EXPECT_GT(mesh.level_db, -45);
}

}  // namespace
}  // namespace osteon::audio
