// The engine that runs on the sound card's thread, the output without a card, the recorder, and a missing sound server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sndfile.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <thread>
#include <vector>

#include "audio_client/output/audio_output.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "common/sound/levels.hpp"
#include "tests/support/allocation_counter.hpp"
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
  void render(std::span<float> mono) noexcept override {
    std::fill(mono.begin(), mono.end(), 0.0F);
    frames += mono.size();
  }
};

TEST(SoundEngine, NotesEachStateOnceWhenItIsFirstRendered) {
  SoundEngine engine(SynthParams{});
  std::vector<float> frames(256);
  CuttingState state = test::cortical_drill(1345);
  const std::int64_t before = std::chrono::steady_clock::now().time_since_epoch().count();
  for (const std::uint64_t seq : {1U, 2U, 2U, 5U}) {
    state.state_seq = seq;
    engine.deliver(scene_of(state, before));
    engine.render(frames);
    engine.render(frames);
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

TEST(SoundEngine, StatedLatencyIsWhereASceneIsFirstHeard) {
  SoundEngine engine(SynthParams{});
  std::vector<float> frames(1024);
  engine.deliver(scene_of(test::free_drill(1400), 1));
  engine.render(frames);
  const auto first = std::find_if(frames.begin(), frames.end(), [](float x) { return x != 0; }) - frames.begin();
  const double stated = std::chrono::duration<double>(engine.latency()).count() * 48000;
  EXPECT_GE(first, stated - 0.01);
  EXPECT_LE(first, stated + 4) << "the ramp starts at zero";
}

TEST(SoundEngine, RenderDoesNotAllocateEvenWhileRecording) {
  const test::TempDir temp;
  auto recorder = WavRecorder::open(temp / "a.wav", 48000);
  ASSERT_TRUE(recorder);
  SoundEngine engine(SynthParams{});
  engine.record_to(*recorder);
  std::vector<float> frames(256);
  std::vector<SoundScene> scenes;
  const test::ScriptedDrilling script = test::scripted_drilling();
  for (const CuttingState& state : script.states) scenes.push_back(scene_of(state, 1));
  const test::AllocationCounter heap;
  for (const SoundScene& scene : scenes) {
    engine.deliver(scene);
    engine.render(frames);
  }
  EXPECT_EQ(heap.count(), 0);
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
}

TEST(OutputKind, UnknownNamesAreRefusedWithTheChoice) {
  EXPECT_EQ(*output_kind("pulse"), OutputKind::pulse);
  EXPECT_EQ(*output_kind("none"), OutputKind::none);
  const auto unknown = output_kind("tape");
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, testing::AllOf(testing::HasSubstr("tape"), testing::HasSubstr("none")));
}

TEST(WavRecorder, PathThatCannotBeWrittenIsNamed) {
  const auto recorder = WavRecorder::open("/nowhere/at/all.wav", 48000);
  ASSERT_FALSE(recorder);
  EXPECT_THAT(recorder.error().message, testing::HasSubstr("/nowhere/at/all.wav"));
}

TEST(WavRecorder, FullQueueIsCountedAndNeverWaits) {
  const test::TempDir temp;
  auto recorder = WavRecorder::open(temp / "a.wav", 48000);
  ASSERT_TRUE(recorder);
  std::vector<float> second(48000, 0.25F);
  for (int i = 0; i < 60; ++i) recorder->push(second);
  ASSERT_TRUE(recorder->close());
  EXPECT_EQ(recorder->frames_written() + recorder->frames_lost(), 60U * 48000U);
  SF_INFO info{};
  SNDFILE* file = sf_open((temp / "a.wav").c_str(), SFM_READ, &info);
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(static_cast<std::uint64_t>(info.frames), recorder->frames_written());
  EXPECT_EQ(info.samplerate, 48000);
  EXPECT_EQ(info.channels, 1);
  sf_close(file);
}

}  // namespace
}  // namespace osteon::audio
