// The engine that runs on the sound card's thread, the output without a card, the recorder, and a missing sound server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <thread>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/output/reconnecting_output.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "audio_client/output/volume_ramp.hpp"
#include "common/sound/levels.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/size_limit.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using namespace std::chrono_literals;

SoundScene scene_of(const CuttingState& state, std::int64_t received_ns) {
  return sound_scene(std::span(&state, 1), received_ns);
}

struct CountingSource final : SoundSource {
  std::atomic<std::uint64_t> frames{0};
  void render(std::span<float> left, std::span<float> right) noexcept override {
    std::fill(left.begin(), left.end(), 0.0F);
    std::fill(right.begin(), right.end(), 0.0F);
    frames += left.size();
  }
};

TEST(SoundEngine, NotesEachStateOnceWhenItIsFirstRendered) {
  SoundEngine engine(SynthParams{});
  std::vector<float> frames(256), right(256);
  CuttingState state = test::cortical_drill(1345);
  const std::int64_t before = std::chrono::steady_clock::now().time_since_epoch().count();
  for (const std::uint64_t seq : {1U, 2U, 2U, 5U}) {
    state.state_seq = seq;
    engine.deliver(scene_of(state, before));
    engine.render(frames, right);
    engine.render(frames, right);
  }
  std::vector<std::uint64_t> seen;
  Sounded sounded;
  while (engine.next_sounded(sounded)) {
    seen.push_back(sounded.state_seq);
    EXPECT_EQ(sounded.author, 1U);
    EXPECT_EQ(sounded.received_ns, before);
    EXPECT_GE(sounded.rendered_ns, before);
  }
  EXPECT_THAT(seen, testing::ElementsAre(1, 2, 5));
  EXPECT_EQ(engine.frames(), 8U * 256U);
  EXPECT_GT(engine.peak(), 0.0F);
  EXPECT_EQ(engine.work().count(), 8U);
}

// Two states of a third and two thirds of a load, which came in one buffer and are followed by none. A period later the
// load is whole, and stays so. Times are long past, so that the test needs none.
TEST(SoundEngine, ALoadThatRisesGoesOnForAPeriod) {
  constexpr std::int64_t kApart_ns = 16'000'000, kPast_ns = 200'000'000;
  const CuttingState whole = test::cortical_drill(1345);
  const auto state_of = [&](std::uint64_t third, bool timed) {
    CuttingState state = whole;
    state.state_seq = third;
    state.force_physical_N *= static_cast<double>(third) / 3.0;
    state.torque_Nmm *= static_cast<double>(third) / 3.0;
    state.time_ns = timed ? static_cast<std::int64_t>(third) * kApart_ns : 0;
    return state;
  };
  const auto level_db = [&](const std::vector<CuttingState>& states) {
    SoundEngine engine(SynthParams{});
    const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    for (const CuttingState& state : states) engine.deliver(scene_of(state, now_ns - kPast_ns + state.time_ns));
    std::vector<float> frames(48000), right(240);
    for (std::size_t at = 0; at < frames.size(); at += 240) engine.render(std::span(frames).subspan(at, 240), right);
    return sound::rms_db(std::span(frames).last(24000));
  };
  const double went_on = level_db({state_of(1, true), state_of(2, true)});
  EXPECT_NEAR(went_on, level_db({state_of(3, false)}), 0.1);
  EXPECT_GT(went_on, level_db({state_of(1, false), state_of(2, false)}) + 0.5);
}

TEST(SoundEngine, StatedLatencyIsWhereASceneIsFirstHeard) {
  SoundEngine engine(SynthParams{});
  std::vector<float> frames(1024), right(1024);
  engine.deliver(scene_of(test::free_drill(1400), 1));
  engine.render(frames, right);
  const auto first = std::find_if(frames.begin(), frames.end(), [](float x) { return x != 0; }) - frames.begin();
  const double stated = std::chrono::duration<double>(engine.latency()).count() * 48000;
  EXPECT_GE(first, stated - 0.01);
  EXPECT_LE(first, stated + 4) << "the ramp starts at zero";
}

TEST(SoundEngine, RenderDoesNotAllocateEvenWhileRecording) {
  const test::TempDir temp;
  auto recorder = WavRecorder::open(temp / "a.wav", 48000, 2);
  ASSERT_TRUE(recorder);
  SoundEngine engine(SynthParams{});
  engine.record_to(*recorder);
  std::vector<float> frames(256), right(256);
  std::vector<SoundScene> scenes;
  const test::ScriptedDrilling script = test::scripted_drilling();
  for (const CuttingState& state : script.states) scenes.push_back(scene_of(state, 1));
  const test::AllocationCounter heap;
  double volume = 0.0;
  for (const SoundScene& scene : scenes) {
    engine.deliver(scene);
    engine.set_volume(volume = 1.0 - volume);
    engine.render(frames, right);
    static_cast<void>(engine.wave());
    static_cast<void>(engine.take_level());
    static_cast<void>(engine.take_longest_work());
  }
  EXPECT_EQ(heap.count(), 0);
}

// A factor moves by 1 / (rate * 30 ms) in a sample, so of a constant 1 the largest step between samples is that, and
// the way from factor a to b takes |a - b| * rate * 30 ms samples.
TEST(VolumeRamp, AConstantFollowsAStraightLineFromOneVolumeToTheNext) {
  for (const double rate_hz : {44100.0, 48000.0}) {
    VolumeRamp ramp(rate_hz);
    double factor = 1.0;
    for (const double wanted : {1.0, 0.0, 1.0, 0.25, 0.75, 0.75}) {
      std::vector<float> mono(4096, 1.0F), other(4096, -2.0F);
      // In two buffers: a ramp goes on where the one before ended.
      ramp.apply(std::span(mono).first(100), std::span(other).first(100), wanted);
      ramp.apply(std::span(mono).subspan(100), std::span(other).subspan(100), wanted);
      const double whole = 0.03 * rate_hz;
      for (std::size_t i = 0; i < mono.size(); ++i) {
        const double way = std::min(static_cast<double>(i + 1) / whole, std::abs(wanted - factor));
        ASSERT_NEAR(mono[i], factor + std::copysign(way, wanted - factor), 1e-6) << wanted << " " << i;
        ASSERT_EQ(other[i], -2.0F * mono[i]) << "both channels have one factor";
      }
      factor = wanted;
    }
  }
}

// y[n] - y[n-1] = g[n] (x[n] - x[n-1]) + (g[n] - g[n-1]) x[n-1], so a sine of amplitude A and frequency f has no larger
// step than A 2 sin(pi f / rate) + A / (rate * 30 ms), however the volume jumps.
TEST(VolumeRamp, ASineHasNoStepBeyondItsOwnAndTheRamps) {
  constexpr double kRate_hz = 48000.0, kSine_hz = 440.0, kAmplitude = 0.5, kPi = 3.14159265358979323846;
  VolumeRamp ramp(kRate_hz);
  std::vector<float> mono(48000);
  for (std::size_t i = 0; i < mono.size(); ++i)
    mono[i] = static_cast<float>(kAmplitude * std::sin(2.0 * kPi * kSine_hz * static_cast<double>(i) / kRate_hz));
  const double volumes[] = {0.0, 1.0, 0.3, 1.0, 0.0, 0.6};
  std::vector<float> other = mono;
  for (std::size_t at = 0, turn = 0; at < mono.size(); at += 256, ++turn) {
    const std::size_t count = std::min<std::size_t>(256, mono.size() - at);
    ramp.apply(std::span(mono).subspan(at, count), std::span(other).subspan(at, count), volumes[turn % 6]);
  }
  double largest = 0.0;
  for (std::size_t i = 1; i < mono.size(); ++i)
    largest = std::max(largest, static_cast<double>(std::abs(mono[i] - mono[i - 1])));
  EXPECT_LE(largest, kAmplitude * (2.0 * std::sin(kPi * kSine_hz / kRate_hz) + 1.0 / (0.03 * kRate_hz)) + 1e-6);
  EXPECT_GT(largest, 0.0);
}

// A device that appears while the sound is off.
TEST(VolumeRamp, AnythingThatBeginsWithTheSoundOffIsSilent) {
  VolumeRamp ramp(48000.0);
  std::vector<float> mono(256, 1.0F), other(256, 1.0F);
  ramp.apply(mono, other, 0.0);
  for (const float x : mono) ASSERT_EQ(x, 0.0F);
}

TEST(SoundEngine, TheListenerHearsTheVolumeAndSeesWhatWasPlayed) {
  SoundEngine loud(SynthParams{}), half(SynthParams{});
  half.set_volume(0.5);
  std::vector<float> a(300), b(300), right(300), heard;
  CuttingState state = test::cortical_drill(1345);
  float level = 0.0F;
  for (int turn = 0; turn < 40; ++turn) {
    for (SoundEngine* engine : {&loud, &half}) engine->deliver(scene_of(state, 1));
    loud.render(a, right);
    half.render(b, right);
    ++state.state_seq;
    heard.insert(heard.end(), b.begin(), b.end());
    for (const float x : b) level = std::max(level, std::abs(x));
    if (turn < 10) continue;
    // Beyond the ramp, of 1440 samples.
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(b[i], 0.5F * a[i], 1e-6F);
  }
  EXPECT_GT(level, 0.01F);
  const SoundEngine::Wave& wave = half.wave();
  EXPECT_TRUE(std::equal(wave.begin(), wave.end(), heard.end() - static_cast<std::ptrdiff_t>(wave.size())));
  EXPECT_EQ(half.take_level(), level);
  EXPECT_EQ(half.take_level(), 0.0F) << "since the last call";
  EXPECT_EQ(half.buffer_frames(), 300U);
  EXPECT_EQ(half.take_longest_work().count() / 1000, static_cast<std::int64_t>(half.work().max_us()));
  EXPECT_EQ(half.take_longest_work().count(), 0);
  EXPECT_EQ(half.peak(), loud.peak()) << "what is recorded has the full volume";
}

// A device that a test takes away.
struct StandInOutput final : AudioOutput {
  explicit StandInOutput(std::string& why) : why_(why) {}
  Result<void> start() override { return {}; }
  void stop() noexcept override {}
  std::chrono::nanoseconds latency() const noexcept override { return 7ms; }
  std::uint64_t gaps() const noexcept override { return 2; }
  std::uint64_t late_callbacks() const noexcept override { return 5; }
  std::string failure_reason() const override { return why_; }

 private:
  std::string& why_;
};

TEST(ReconnectingOutput, IsOpenedAgainAfterItsDeviceCameBack) {
  std::string why;
  bool there = false;
  int attempts = 0;
  ReconnectingOutput output([&]() -> Result<std::unique_ptr<AudioOutput>> {
    ++attempts;
    if (!there) return failure(ErrorCode::unavailable, "no device");
    return std::make_unique<StandInOutput>(why);
  });
  EXPECT_FALSE(output.open());
  EXPECT_EQ(output.trouble(), "no device");
  const auto start = ReconnectingOutput::Clock::now();
  output.maintain(start, false);
  EXPECT_EQ(attempts, 1) << "not wanted";
  output.maintain(start, true);
  output.maintain(start + 1s, true);
  EXPECT_EQ(attempts, 2) << "not at each call";
  there = true;
  output.maintain(start + 3s, true);
  EXPECT_EQ(output.trouble(), "");
  EXPECT_EQ(output.latency(), 7ms);
  output.maintain(start + 9s, true);
  EXPECT_EQ(attempts, 3) << "it plays";
  why = "the sound server went away";
  output.maintain(start + 10s, true);
  EXPECT_EQ(output.trouble(), why);
  EXPECT_EQ(output.latency(), 0ms);
  why.clear();
  output.maintain(start + 13s, true);
  EXPECT_EQ(output.trouble(), "");
  EXPECT_EQ(output.gaps(), 4U) << "of both";
  EXPECT_EQ(output.late_callbacks(), 10U) << "of both";
}

TEST(PacedOutput, AsksForFramesAtTheSoundCardsPace) {
  CountingSource source;
  auto output = open_output({.kind = OutputKind::none}, source);
  ASSERT_TRUE(output) << output.error().message;
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE((*output)->start());
  ASSERT_TRUE(test::wait_until([&] { return source.frames >= 24000; }, 30s));
  const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  (*output)->stop();
  const std::uint64_t frames = source.frames;
  // Never ahead of the clock by more than the buffer that it has just begun.
  EXPECT_GE(took_s, (24000.0 - 2 * 256) / 48000.0);
  EXPECT_EQ((*output)->failure_reason(), "");
  std::this_thread::sleep_for(30ms);
  EXPECT_EQ(source.frames, frames) << "no frames after the stop";
}

TEST(PulseOutput, MissingSoundServerIsOneSentenceWithTheRemedy) {
  const test::TempDir temp;
  // No server can listen in an empty folder, and none is started.
  ::setenv("PULSE_SERVER", ("unix:" + (temp / "nobody").string()).c_str(), 1);
  ::setenv("XDG_RUNTIME_DIR", temp.path().c_str(), 1);
  ::setenv("HOME", temp.path().c_str(), 1);
  CountingSource source;
  const auto output = open_output({.kind = OutputKind::pulse}, source);
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::unavailable);
  EXPECT_THAT(output.error().message, testing::HasSubstr("--output none"));
  EXPECT_THAT(output.error().message, testing::Not(testing::HasSubstr("\n")));
  const auto devices = output_devices();
  ASSERT_FALSE(devices);
  EXPECT_EQ(devices.error().code, ErrorCode::unavailable);
}

TEST(SoundDevice, IsChosenByNameByNumberByAPartOrByTheServer) {
  const std::vector<SoundDevice> sinks{{"Screen", 2, 48000, false},
                                       {"Desk", 2, 44100, true},
                                       {"1", 2, 48000, false},
                                       {"Twin", 2, 48000, false},
                                       {"Twin", 6, 48000, false},
                                       {"USB Audio 7 Analog", 2, 48000, false},
                                       {"USB Audio 8 Digital", 2, 48000, false}};
  const auto chosen = [&](const char* wanted) {
    const auto found = chosen_device(sinks, wanted, "sink");
    EXPECT_TRUE(found) << wanted << ": " << (found ? "" : found.error().message);
    return found.value_or(99);
  };
  EXPECT_EQ(chosen(""), 1U);
  EXPECT_EQ(chosen("Screen"), 0U);
  EXPECT_EQ(chosen("4"), 4U);
  EXPECT_EQ(chosen("1"), 2U) << "a name counts before a number";
  EXPECT_EQ(chosen("USB Audio 8"), 6U) << "a part that no other has";
  EXPECT_EQ(chosen("Analog"), 5U);
  EXPECT_EQ(chosen("7"), 5U) << "no number of a sink, but a part";
  EXPECT_EQ(*chosen_device({sinks.front()}, "", "sink"), 0U) << "no default";
  for (const char* wrong : {"Twin", "Twi", "USB Audio", "77", "-1", "0x", "desk", "Analog 7"}) {
    const auto refused = chosen_device(sinks, wrong, "sink");
    ASSERT_FALSE(refused) << wrong;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(refused.error().message,
                testing::AllOf(testing::HasSubstr(wrong), testing::HasSubstr("osteon-audio devices")));
  }
  const auto none = chosen_device({}, "", "source");
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, testing::HasSubstr("has no source"));
}

TEST(OutputKind, UnknownNamesAreRefusedWithTheChoice) {
  EXPECT_EQ(*output_kind("pulse"), OutputKind::pulse);
  EXPECT_EQ(*output_kind("none"), OutputKind::none);
  const auto unknown = output_kind("tape");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, testing::AllOf(testing::HasSubstr("tape"), testing::HasSubstr("none")));
}

TEST(WavRecorder, PathThatCannotBeWrittenIsNamed) {
  const auto recorder = WavRecorder::open("/nowhere/at/all.wav", 48000, 2);
  ASSERT_FALSE(recorder);
  EXPECT_THAT(recorder.error().message, testing::HasSubstr("/nowhere/at/all.wav"));
}

// Whole frames, in their order, on both sides of the 256 frames that the queue takes at once.
TEST(WavRecorder, ChannelsAreKeptApartOrAveraged) {
  const test::TempDir temp;
  std::vector<float> left(700), right(700);
  for (std::size_t i = 0; i < left.size(); ++i) {
    left[i] = static_cast<float>(i) / 1024.0F;
    right[i] = -0.5F * left[i];
  }
  for (const int channels : {1, 2}) {
    auto recorder = WavRecorder::open(temp / "a.wav", 48000, channels, Existing::replaced);
    ASSERT_TRUE(recorder);
    recorder->push(left, right);
    ASSERT_TRUE(recorder->close());
    EXPECT_EQ(recorder->frames_written(), left.size());
    SF_INFO info{};
    SNDFILE* file = sf_open((temp / "a.wav").c_str(), SFM_READ, &info);
    ASSERT_NE(file, nullptr);
    ASSERT_EQ(info.channels, channels);
    ASSERT_EQ(static_cast<std::size_t>(info.frames), left.size());
    std::vector<float> read(left.size() * static_cast<std::size_t>(channels));
    sf_readf_float(file, read.data(), info.frames);
    sf_close(file);
    constexpr float kStep = 1.0F / 32768.0F;  // of 16 bits
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (channels == 1) {
        ASSERT_NEAR(read[i], 0.25F * left[i], kStep);
      } else {
        ASSERT_NEAR(read[2 * i], left[i], kStep);
        ASSERT_NEAR(read[2 * i + 1], right[i], kStep);
      }
    }
  }
}

TEST(WavRecorder, TakesNoFileThatIsThereOrInUse) {
  const test::TempDir temp;
  const std::filesystem::path file = temp / "a.wav";
  {
    auto first = WavRecorder::open(file, 48000, 1);
    ASSERT_TRUE(first) << first.error().message;
    first->push(std::vector<float>(256, 0.5F), std::vector<float>(256, 0.5F));
    for (const Existing existing : {Existing::refused, Existing::replaced}) {
      const auto second = WavRecorder::open(file, 48000, 1, existing);
      ASSERT_FALSE(second);
      EXPECT_EQ(second.error().code, ErrorCode::exists);
      EXPECT_THAT(second.error().message,
                  testing::AllOf(testing::HasSubstr(file.string()), testing::HasSubstr("--wav")));
    }
    ASSERT_TRUE(first->close());
  }
  EXPECT_EQ(std::filesystem::file_size(file), 44U + 2 * 256) << "the sound of the first is whole";
  const auto again = WavRecorder::open(file, 48000, 1);
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().message, testing::HasSubstr("add --overwrite"));
  EXPECT_TRUE(WavRecorder::open(file, 48000, 1, Existing::replaced));
}

TEST(WavRecorder, AFullDiskIsSaidAtOnceAndCounted) {
  constexpr std::uint64_t kRoom = 44 + 4 * 10'000;  // a header and 10 000 frames
  const test::TempDir temp;
  auto recorder = WavRecorder::open(temp / "a.wav", 48000, 2);
  ASSERT_TRUE(recorder) << recorder.error().message;
  EXPECT_EQ(recorder->trouble(), "");
  const std::vector<float> second(48000, 0.25F);
  Result<void> closed;
  {
    const test::SizeLimit full(kRoom);
    recorder->push(second, second);
    EXPECT_TRUE(test::wait_until([&] { return !recorder->trouble().empty(); }, std::chrono::seconds{30}));
    recorder->push(second, second);
    closed = recorder->close();
  }
  ASSERT_FALSE(closed);
  EXPECT_THAT(closed.error().message,
              testing::AllOf(testing::HasSubstr((temp / "a.wav").string()), testing::HasSubstr("File too large"),
                             testing::HasSubstr("make room on the disk")));
  EXPECT_EQ(std::filesystem::file_size(temp / "a.wav"), kRoom);
  EXPECT_EQ(recorder->frames_written(), 10'000U);
  EXPECT_EQ(recorder->frames_lost(), 2 * 48'000U - 10'000U);
}

TEST(WavRecorder, FullQueueIsCountedAndNeverWaits) {
  const test::TempDir temp;
  auto recorder = WavRecorder::open(temp / "a.wav", 48000, 2);
  ASSERT_TRUE(recorder);
  std::vector<float> second(48000, 0.25F);
  for (int i = 0; i < 60; ++i) recorder->push(second, second);
  ASSERT_TRUE(recorder->close());
  EXPECT_EQ(recorder->frames_written() + recorder->frames_lost(), 60U * 48000U);
  SF_INFO info{};
  SNDFILE* file = sf_open((temp / "a.wav").c_str(), SFM_READ, &info);
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(static_cast<std::uint64_t>(info.frames), recorder->frames_written());
  EXPECT_EQ(info.samplerate, 48000);
  EXPECT_EQ(info.channels, 2);
  sf_close(file);
}

}  // namespace
}  // namespace osteon::audio
