// The sound of a recorded session: which records are read, that the live engine would give the same samples, and the
// program's command.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "audio_client/offline/offline_sound.hpp"
#include "audio_client/offline/state_record.hpp"
#include "audio_client/output/sound_engine.hpp"
#include "common/runtime/files.hpp"
#include "common/sound/tones.hpp"
#include "common/sound/wav_file.hpp"
#include "haptic_client/app/record_file.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/ideal_head.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::audio {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::int64_t kBegin_ns = 5'000'000'000;
constexpr std::size_t kBuffer = 256;

// States as a record has them: 120 in a second.
std::vector<CuttingState> timed_states() {
  std::vector<CuttingState> states = test::scripted_drilling().states;
  for (std::size_t i = 0; i < states.size(); ++i)
    states[i].time_ns = kBegin_ns + std::llround(1e9 * static_cast<double>(i) / 120.0);
  return states;
}

class ListedStates final : public StateRecord {
 public:
  explicit ListedStates(std::vector<CuttingState> states) : states_(std::move(states)) {}
  double done() const override { return static_cast<double>(next_) / static_cast<double>(states_.size()); }
  std::string name() const override { return "the list"; }

 protected:
  Result<std::optional<CuttingState>> read() override {
    if (next_ == states_.size()) return std::optional<CuttingState>();
    return std::optional(states_[next_++]);
  }
  std::string place(const char* field) const override { return std::string("the list: ") + field + " "; }

 private:
  std::vector<CuttingState> states_;
  std::size_t next_ = 0;
};

struct Sides {
  std::vector<float> left, right;
};

Sides rendered(StateRecord& record, const SynthParams& params = {}) {
  Sides sides;
  const auto sound = render_states(
      record, params,
      [&](std::span<const float> left, std::span<const float> right) {
        sides.left.insert(sides.left.end(), left.begin(), left.end());
        sides.right.insert(sides.right.end(), right.begin(), right.end());
        return Result<void>();
      },
      [](double) { return true; });
  EXPECT_TRUE(sound) << sound.error().message;
  return sides;
}

std::atomic<std::int64_t> clock_ns = 0;

// What the live program does, with buffers that begin at the first state, and a clock that goes from one to the next.
Sides live(const std::vector<CuttingState>& states, std::size_t frames, const SynthParams& params) {
  SoundEngine engine(params, []() noexcept -> std::int64_t { return clock_ns; });
  Sides sides{std::vector<float>(frames), std::vector<float>(frames)};
  std::size_t next = 0;
  for (std::size_t at = 0; at + kBuffer <= frames; at += kBuffer) {
    const std::int64_t now_ns = kBegin_ns + std::llround(1e9 * static_cast<double>(at) / test::kRate_hz);
    for (; next < states.size() && states[next].time_ns <= now_ns; ++next)
      engine.deliver(sound_scene(std::span(&states[next], 1), states[next].time_ns));
    clock_ns = now_ns;
    engine.render(std::span(sides.left).subspan(at, kBuffer), std::span(sides.right).subspan(at, kBuffer));
  }
  return sides;
}

// A listener beside a tool that moves to and fro in front of it.
SynthParams heard_over(Listening way) {
  SynthParams params;
  params.space.listening = way;
  params.space.pose_bone_head = looking(usual_listener_mm(way), Vec3::Zero(), -Vec3::UnitY());
  if (way == Listening::headphones)
    params.space.hrtf = std::make_shared<const Hrtf>(
        *Hrtf::make(test::sphere([](double along) { return 0.55 + 0.45 * along; }), test::kRate_hz));
  return params;
}

class OfflineSoundOver : public testing::TestWithParam<Listening> {};

TEST_P(OfflineSoundOver, IsThatOfTheLiveEngineBitForBit) {
  std::vector<CuttingState> states = timed_states();
  for (std::size_t i = 0; i < states.size(); ++i)
    states[i].pose_bone_tool.position_mm = {0, 0, 100 * std::sin(0.01 * static_cast<double>(i))};
  ListedStates record(states);
  const Sides offline = rendered(record, heard_over(GetParam()));
  const std::size_t common = 48000 * states.size() / 120 / kBuffer * kBuffer;
  ASSERT_GT(offline.left.size(), common);
  const Sides engine = live(states, common, heard_over(GetParam()));
  EXPECT_GT(*std::ranges::max_element(engine.left), 0.1F);
  EXPECT_TRUE(std::equal(engine.left.begin(), engine.left.end(), offline.left.begin()));
  EXPECT_TRUE(std::equal(engine.right.begin(), engine.right.end(), offline.right.begin()));
  EXPECT_EQ(offline.left == offline.right, GetParam() == Listening::mono);
}

INSTANTIATE_TEST_SUITE_P(EachWay, OfflineSoundOver,
                         testing::Values(Listening::mono, Listening::loudspeakers, Listening::headphones));

TEST(OfflineSound, LooksAtTheMiddleOfTheWorkInBone) {
  const auto middle_of = [](const std::vector<std::pair<CuttingPhase, Vec3>>& places) {
    std::vector<CuttingState> states;
    for (const auto& [phase, tip_mm] : places) {
      states.push_back(test::free_drill(1400));
      states.back().phase = phase;
      states.back().pose_bone_tool.position_mm = tip_mm;
    }
    ListedStates record(states);
    const auto work = survey(record, [](double) { return true; });
    EXPECT_TRUE(work);
    return work->middle_mm;
  };
  using enum CuttingPhase;
  EXPECT_EQ(middle_of({{free, {500, 0, 0}}, {cutting, {1, 2, 3}}, {rubbing, {3, 6, 9}}, {idle, {0, 900, 0}}}),
            Vec3(2, 4, 6));
  EXPECT_EQ(middle_of({{free, {4, 0, 0}}, {idle, {0, 2, 0}}}), Vec3(2, 1, 0)) << "nothing touched bone";
}

TEST(OfflineSound, RunsDownAfterTheLastStateAndInAGap) {
  std::vector<CuttingState> states;
  for (int i = 0; i < 240; ++i) {
    states.push_back(test::free_drill(1400));
    states.back().state_seq = static_cast<std::uint64_t>(i + 1);
    // Between the first second and the second one nothing comes for 5 s.
    states.back().time_ns = kBegin_ns + i * 8'333'333LL + (i < 120 ? 0 : 5'000'000'000LL);
  }
  ListedStates record(states);
  const std::vector<float> samples = rendered(record).left;
  const auto loudest = [&](double from_s, double to_s) {
    const auto part = std::span(samples).subspan(static_cast<std::size_t>(from_s * 48000),
                                                 static_cast<std::size_t>((to_s - from_s) * 48000));
    float most = 0;
    for (const float x : part) most = std::max(most, std::abs(x));
    return most;
  };
  EXPECT_GT(loudest(2.0, 2.9), 0.01F);     // 2 s long the last state counts
  EXPECT_EQ(loudest(4.2, 5.9), 0.0F);      // then the drill has run down
  EXPECT_GT(loudest(6.5, 7.0), 0.01F);     // it runs again
  EXPECT_LT(samples.size(), 48000 * 8.0);  // and ends without waiting
  EXPECT_EQ(samples.back(), 0.0F);
}

TEST(OfflineSound, StopsWhenItIsAsked) {
  ListedStates record(timed_states());
  const auto sound = render_states(
      record, {}, [](std::span<const float>, std::span<const float>) { return Result<void>(); },
      [](double done) { return done < 0.5; });
  ASSERT_FALSE(sound);
  EXPECT_EQ(sound.error().code, ErrorCode::cancelled);
}

// Two states with 20 s between them: after the first, half of the record is read, and nearly all after the second.
TEST(OfflineSound, ProgressIsThatOfTheSound) {
  const std::vector<CuttingState> timed = timed_states();
  std::vector<CuttingState> states{timed.front(), timed.front()};
  states.back().time_ns += 20'000'000'000;
  ListedStates record(states);
  std::uint64_t frames = 0;
  std::vector<double> seconds, done;
  const auto sound = render_states(
      record, {},
      [&](std::span<const float> left, std::span<const float>) {
        frames += left.size();
        return Result<void>();
      },
      [&](double fraction) {
        seconds.push_back(static_cast<double>(frames) / test::kRate_hz);
        done.push_back(fraction);
        return true;
      },
      20.0);
  ASSERT_TRUE(sound) << sound.error().message;
  ASSERT_GT(done.size(), 20U);
  for (std::size_t i = 0; i < done.size(); ++i)
    EXPECT_NEAR(done[i], std::min(1.0, seconds[i] / (20.0 + kLongestTail_s)), 0.01) << seconds[i];
}

// Both files of osteon-haptic, from the same ticks.
TEST(StateRecord, ReadsWhatTheHapticClientWrites) {
  const test::TempDir temp;
  haptic::RecordingInfo info;
  info.author = 7;
  info.tools = {{"drill-3.2", "chi", 3.2}, {"burr-round-5", "milling", 5.0}};
  auto file = haptic::RecordFile::create(temp / "a.h5", info);
  ASSERT_TRUE(file) << file.error().message;
  haptic::SessionLog log;
  haptic::DeviceInfo device;
  ASSERT_TRUE(log.open(temp / "a.csv", device, AuthorId{7}));
  constexpr int kRows = 9000;  // more than are read at once
  const auto row_of = [](int i) {
    haptic::TickRow row;
    row.mono_ns = kBegin_ns + 1'000'000LL * i;
    row.report.state_seq = static_cast<std::uint64_t>(i + 1);
    row.report.tool = i >= 500;
    row.report.spindle_rpm = 1000 - i % 100;
    row.report.cutting.phase = i % 2 ? CuttingPhase::cutting : CuttingPhase::rubbing;
    row.report.cutting.feed_mm_per_s = 0.25 * (i % 8);
    row.report.cutting.density_g_cm3 = 1.5;
    row.report.cutting.engaged = 0.75;
    row.report.cutting.torque_nmm = 16 + i % 4;
    row.report.coupling.force_n = {3.0, 4.0, 0.0};
    row.report.pose_bone_proxy = pose_along({1, 2, 3}, {0.6, 0, -0.8});
    if (i >= 100) row.reading.buttons = haptic::kSuction;
    return row;
  };
  for (int i = 0; i < kRows; ++i) {
    const haptic::TickRow one = row_of(i);
    ASSERT_TRUE(file->append({&one, 1}));
    log.write(one, info.tools[static_cast<std::size_t>(one.report.tool)].name);
  }
  ASSERT_TRUE(file->finish({}));
  ASSERT_TRUE(log.finish());

  for (const char* name : {"a.h5", "a.csv"}) {
    SCOPED_TRACE(name);
    const auto record = open_states(temp / name);
    ASSERT_TRUE(record) << record.error().message;
    for (int i = 0; i < kRows; ++i) {
      const auto state = (*record)->next();
      ASSERT_TRUE(state) << state.error().message;
      ASSERT_TRUE(*state) << i;
      const haptic::TickRow expected = row_of(i);
      ASSERT_EQ((*state)->time_ns, expected.mono_ns);
      ASSERT_EQ((*state)->author, AuthorId{7});
      ASSERT_EQ((*state)->state_seq, expected.report.state_seq);
      ASSERT_EQ((*state)->tool_name, i >= 500 ? "burr-round-5" : "drill-3.2");
      ASSERT_EQ((*state)->phase, expected.report.cutting.phase);
      ASSERT_EQ((*state)->spindle_rpm, expected.report.spindle_rpm);
      ASSERT_EQ((*state)->feed_mm_per_s, expected.report.cutting.feed_mm_per_s);
      ASSERT_EQ((*state)->density_g_cm3, 1.5);
      ASSERT_EQ((*state)->engaged_fraction, 0.75);
      ASSERT_EQ((*state)->torque_Nmm, expected.report.cutting.torque_nmm);
      ASSERT_EQ((*state)->force_physical_N.norm(), 5.0);
      ASSERT_EQ((*state)->pose_bone_tool.position_mm, Vec3(1, 2, 3));
      // Along it a drill breaks through. A burr may do so in any direction.
      const Vec3 axis = i >= 500 ? Vec3(0, 0, 0) : Vec3(0.6, 0, -0.8);
      ASSERT_LT((tool_sound(**state).feed_axis - axis).norm(), 1e-5) << i;
      ASSERT_EQ((*state)->suction, i >= 100);
    }
    const auto end = (*record)->next();
    ASSERT_TRUE(end);
    EXPECT_FALSE(*end);
    EXPECT_EQ((*record)->done(), 1.0);
  }
}

constexpr const char* kHeader =
    "mono_ns,phase,tool,rpm,feed_mm_per_s,density_g_cm3,force_physical_n,torque_nmm,author\n";

TEST(StateRecord, KnowsNoAxisInATableWithoutIt) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", kHeader + std::string("1000,free,drill-3.2,900,0,0,0,0,3\n")));
  const auto record = open_states(temp / "log.csv");
  ASSERT_TRUE(record) << record.error().message;
  const auto state = (*record)->next();
  ASSERT_TRUE(state && *state);
  EXPECT_EQ(tool_sound(**state).feed_axis, Vec3(0, 0, 0));
}

// The sentence with which a table is refused.
std::string refusal(const std::string& text) {
  const test::TempDir temp;
  std::ofstream(temp / "log.csv") << text;
  const auto record = open_states(temp / "log.csv");
  if (!record) return record.error().message;
  for (;;) {
    const auto state = (*record)->next();
    if (!state) return state.error().message;
    if (!*state) return {};
  }
}

TEST(StateRecord, RefusesABadTableByOneSentence) {
  const std::string header = kHeader;
  const std::string good = "1000,free,drill-3.2,900,0,0,0,0,3\n";
  EXPECT_EQ(refusal(header + good), "");
  EXPECT_EQ(refusal("\xEF\xBB\xBF" + header + "1000,free,drill-3.2,900,0,0,0,0,3\r\n\n"), "");
  EXPECT_EQ(refusal(header + good + "2000,free,drill"), "");  // its program was killed
  EXPECT_THAT(refusal("time_s,rpm\n1,2\n"), AllOf(HasSubstr("line 1"), HasSubstr("mono_ns"), HasSubstr("give")));
  EXPECT_THAT(refusal(header), HasSubstr("no whole row"));
  EXPECT_THAT(refusal(header + "1000,free,drill-3.2,fast,0,0,0,0,3\n"),
              AllOf(HasSubstr("log.csv: line 2: rpm is no number (fast)"), HasSubstr("give")));
  EXPECT_THAT(refusal(header + "1000,free,drill-3.2,nan,0,0,0,0,3\n"), HasSubstr("line 2: rpm is no number"));
  EXPECT_THAT(refusal(header + good + "1001,boring,drill-3.2,900,0,0,0,0,3\n"),
              HasSubstr("line 3: phase is none of idle, free, cutting and rubbing (boring)"));
  EXPECT_THAT(refusal(header + good + "1001,free,drill-3.2,-5,0,0,0,0,3\n"), HasSubstr("line 3: rpm is -5"));
  EXPECT_THAT(refusal(header + good + "1001,free,drill-3.2,1e300,0,0,0,0,3\n"),
              HasSubstr("rpm is 1e+300, which no tool"));
  EXPECT_THAT(refusal("rpm," + header + "0," + good), HasSubstr("log.csv: line 1 has the column rpm more than once"));
  EXPECT_THAT(refusal(header + good + "999,free,drill-3.2,900,0,0,0,0,3\n"),
              AllOf(HasSubstr("line 3: mono_ns is before"), HasSubstr("sort")));
  EXPECT_THAT(refusal(header + good + "1001,free,drill-3.2,900\n"), HasSubstr("line 3 has 4 fields"));
  EXPECT_THAT(refusal(header + good + "4000000000000000000,free,d,900,0,0,0,0,3\n"), HasSubstr("4 hours"));
  for (const char* wild : {"9223372036854775000", "-1000"})
    EXPECT_THAT(refusal(header + wild + ",free,d,900,0,0,0,0,3\n"), HasSubstr("line 2: mono_ns is not of a clock"));
  EXPECT_THAT(refusal(header + std::string(20000, 'x') + "\n"), HasSubstr("line 2 has more than"));
}

TEST(StateRecord, TellsOtherFilesApart) {
  const test::TempDir temp;
  const auto message = [&](const char* name) {
    const auto record = open_states(temp / name);
    return record ? std::string() : record.error().message;
  };
  EXPECT_THAT(message("none.h5"), HasSubstr("there is no file"));
  std::filesystem::create_directory(temp / "folder");
  EXPECT_THAT(message("folder"), HasSubstr("is a folder"));
  std::ofstream empty(temp / "empty.csv");
  EXPECT_THAT(message("empty.csv"), HasSubstr("has no byte"));
  std::ofstream(temp / "room.journal") << "SQLite format 3" << '\0';
  EXPECT_THAT(message("room.journal"), HasSubstr("keeps cuts but neither forces nor densities"));
  std::ofstream(temp / "a.h5") << "\x89HDF\r\n\x1a\n and nothing that follows";
  EXPECT_THAT(message("a.h5"), AllOf(HasSubstr("a.h5"), HasSubstr("or give another recording")));
}

std::string long_log(int rows) {
  std::string text = kHeader;
  for (int i = 0; i < rows; ++i)
    text += std::to_string(kBegin_ns + 8'333'333LL * i) + ",cutting,drill-3.2,1345,0.89,1.9,27,25,1\n";
  return text;
}

TEST(RenderCommand, WritesTheSoundOfALog) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(240)));
  const auto ran = test::run(test::program("osteon-audio"), {"render", (temp / "log.csv").string(), "--out",
                                                             (temp / "x.wav").string(), "--listen", "mono"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("states     240"), HasSubstr("listener   mono"),
                             HasSubstr("times as fast as it sounds")));
  const auto sound = sound::read_wav(temp / "x.wav");
  ASSERT_TRUE(sound) << sound.error().message;
  // The last state is 239 / 120 s after the first; then the drill runs down within half a second.
  EXPECT_GT(sound->seconds(), 2.0);
  EXPECT_LT(sound->seconds(), 3.0);
  const auto record = open_states(temp / "log.csv");
  ASSERT_TRUE(record);
  const std::vector<float> expected = rendered(**record).left;
  ASSERT_EQ(sound->samples.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); i += 7) ASSERT_NEAR(sound->samples[i], expected[i], 1.1 / 32768) << i;
}

// A second of cutting at the patient's head, and one at the feet. The usual listener looks between them, from the
// patient's right side.
std::string log_of_both_ends() {
  std::string text = "mono_ns,phase,tool,rpm,feed_mm_per_s,density_g_cm3,force_physical_n,torque_nmm,tip_z_mm\n";
  for (int i = 0; i < 240; ++i)
    text += std::to_string(kBegin_ns + 8'333'333LL * i) + ",cutting,drill-3.2,1345,0.89,1.9,27,25," +
            (i < 120 ? "1100" : "900") + "\n";
  return text;
}

double rms(std::span<const float> samples) {
  double sum = 0;
  for (const float x : samples) sum += static_cast<double>(x) * static_cast<double>(x);
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

TEST(RenderCommand, PutsTheWorkBetweenBothChannels) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", log_of_both_ends()));
  for (const std::string way : {"", "loudspeakers", "headphones"}) {
    SCOPED_TRACE(way);
    std::vector<std::string> arguments = {"render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string()};
    if (!way.empty()) arguments.insert(arguments.end(), {"--listen", way});
    const auto ran = test::run(test::program("osteon-audio"), arguments);
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("listener   " + (way.empty() ? "loudspeakers" : way)));
    std::array<double, 2> left{}, right{};
    for (const auto channel : {sound::Channel::left, sound::Channel::right}) {
      const auto sound = sound::read_wav(temp / "x.wav", {.channel = channel, .from_s = 0, .to_s = {}});
      ASSERT_TRUE(sound) << sound.error().message;
      for (std::size_t end : {0U, 1U})
        (channel == sound::Channel::left ? left : right)[end] =
            rms(std::span(sound->samples).subspan(24000 + 48000 * end, 19200));
    }
    // The other end is the mirror image; the flutter of the lines is not.
    EXPECT_GT(left[0], 1.15 * right[0]);
    EXPECT_GT(right[1], 1.15 * left[1]);
    EXPECT_NEAR(left[0] / right[1], 1.0, 0.2);
  }
}

TEST(RenderCommand, RefusesAListenerThatCannotBe) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(10)));
  const auto refused = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string()});
    const auto ran = test::run(test::program("osteon-audio"), more);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_FALSE(std::filesystem::exists(temp / "x.wav"));
    return ran.err;
  };
  EXPECT_THAT(refused({"--listen", "tin"}), HasSubstr("headphones"));
  EXPECT_THAT(refused({"--listener", "0", "0", "0"}), HasSubstr("--listener 0 0 0"));
  EXPECT_THAT(refused({"--listen", "mono", "--listener", "0", "0", "100"}), HasSubstr("another --listen than mono"));
  EXPECT_THAT(refused({"--listen", "mono", "--listener-up", "0", "0", "1"}), HasSubstr("another --listen than mono"));
  EXPECT_THAT(refused({"--listener", "0", "0", "200", "--listener-up", "0", "0", "1"}),
              AllOf(HasSubstr("no side is left"), HasSubstr("--listener-up"), HasSubstr("such as 0 -1 0")));
  EXPECT_THAT(refused({"--listener", "0", "300", "0"}), HasSubstr("such as 0 0 1"));  // up is 0 -1 0
  EXPECT_THAT(refused({"--hrtf", "a.sofa"}), HasSubstr("--listen headphones"));
  EXPECT_THAT(refused({"--listen", "headphones", "--rate", "96000"}), HasSubstr("--rate of headphones is at most"));
}

// A drill of one's own, which has nothing but one line: that of its spindle's tenth order.
TEST(RenderCommand, PlaysAToolByItsPreset) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(240)));
  ASSERT_TRUE(write_file(temp / "own.yaml",
                         "name: own\ntools: [drill]\ndrive: rotation\nrated_rpm: 1345\n"
                         "lines:\n  - {order: 10, level_db: -20, source: shaft}\n"));
  const std::string own = (temp / "own.yaml").string();
  const auto ran = test::run(
      test::program("osteon-audio"),
      {"render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string(), "--preset", own, "--listen", "mono"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const auto sound = sound::read_wav(temp / "x.wav");
  ASSERT_TRUE(sound) << sound.error().message;
  const std::span<const float> steady = std::span(sound->samples).subspan(48000, 48000);
  EXPECT_NEAR(sound::find_tone(steady, 48000, 100, 8000).hz, 10 * 1345 / 60.0, 1.0);
  const auto lost =
      test::run(test::program("osteon-audio"), {"render", (temp / "log.csv").string(), "--out", own, "--preset", own});
  EXPECT_EQ(lost.exit_code, 1);
  EXPECT_THAT(lost.err, HasSubstr("would lose what is read"));
}

TEST(RenderCommand, TakesNoEmptyName) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(10)));
  const auto ran = test::run(test::program("osteon-audio"), {"render", (temp / "log.csv").string(), "--out", ""});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_EQ(ran.err, "osteon-audio: --out: the name is empty; give a file; see osteon-audio render --help\n");
}

TEST(RenderCommand, RefusesToLoseTheRecord) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(10)));
  const std::string file = (temp / "log.csv").string();
  const auto ran = test::run(test::program("osteon-audio"), {"render", file, "--out", file});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, HasSubstr("would lose what is read"));
  EXPECT_EQ(*read_file(temp / "log.csv"), long_log(10));
}

class RenderStopped : public testing::TestWithParam<int> {};

TEST_P(RenderStopped, LeavesNoPartOfASound) {
  std::signal(SIGHUP, SIG_DFL);  // perhaps the tests were started by nohup
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(120 * 1800)));
  test::Process audio(test::program("osteon-audio"),
                      {"render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string()});
  ASSERT_TRUE(audio.wait_for_percent(1, 60s)) << audio.err();
  audio.signal(GetParam());
  EXPECT_EQ(audio.wait(30s), 130);
  EXPECT_THAT(audio.err(), HasSubstr("stopped"));
  for (const auto& entry : std::filesystem::directory_iterator(temp.path()))
    EXPECT_EQ(entry.path().filename(), "log.csv");
}

INSTANTIATE_TEST_SUITE_P(EachSignal, RenderStopped, testing::Values(SIGINT, SIGTERM, SIGHUP));

// The shell's limit on the size of files, 64 blocks of 1024 bytes.
TEST(RenderCommand, SaysThatTheFileBecomesTooLarge) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(1200)));
  ASSERT_TRUE(write_file(temp / "x.wav", "an older sound"));
  const auto ran =
      test::run("bash", {"-c", "ulimit -f 64 && exec \"$@\"", "render", test::program("osteon-audio").string(),
                         "render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string()});
  EXPECT_EQ(ran.exit_code, 1);
  EXPECT_THAT(ran.err, AllOf(HasSubstr("x.wav could not be written whole (File too large)"),
                             HasSubstr("an older file of that name is as it was")));
  EXPECT_EQ(*read_file(temp / "x.wav"), "an older sound");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), {}), 2);
}

// Two states that are nearly 4 hours apart: 48 000 frames of 6 bytes a second are 4.15 GB. A limit of the shell stops
// what begins to write.
TEST(RenderCommand, RefusesASoundAboveFourGigabytesBeforeItIsMade) {
  const test::TempDir temp;
  const std::string state = ",free,drill-3.2,900,0,0,0,0,1\n";
  ASSERT_TRUE(write_file(temp / "long.csv", kHeader + ("1" + state) + "14390000000001" + state));
  ASSERT_TRUE(write_file(temp / "x.wav", "an older sound"));
  const auto error = [&](std::vector<std::string> options) {
    std::vector<std::string> arguments = {
        "-c",     "ulimit -f 64 && exec \"$@\"", "render", test::program("osteon-audio").string(),
        "render", (temp / "long.csv").string(),  "--out",  (temp / "x.wav").string()};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto ran = test::run("bash", arguments);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_EQ(*read_file(temp / "x.wav"), "an older sound");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), {}), 2);
    return ran.err;
  };
  // 4 000 000 000 / 288 000 = 13 889 s, and the drill runs down for 2 s of them.
  EXPECT_THAT(error({"--bits", "24"}),
              AllOf(HasSubstr("long.csv lasts 240 minutes"), HasSubstr("4.1 GB"),
                    HasSubstr("--bits 16, --listen mono, a lower"), HasSubstr("at most 231 minutes")));
  EXPECT_THAT(error({"--listen", "mono", "--rate", "192000"}), HasSubstr("5.5 GB"));
  for (const auto& fits : {std::vector<std::string>{"--bits", "16"}, {"--bits", "24", "--listen", "mono"}})
    EXPECT_THAT(error(fits), HasSubstr("could not be written whole (File too large)"));
}

TEST(RenderCommand, TakesNoSeedThatItWouldChange) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "log.csv", long_log(10)));
  const auto render = [&](const char* seed) {
    return test::run(test::program("osteon-audio"),
                     {"render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string(), "--seed", seed});
  };
  for (const char* seed : {"-1", "18446744073709551616", "1.5"}) {
    const auto ran = render(seed);
    EXPECT_EQ(ran.exit_code, 1);
    EXPECT_THAT(ran.err, HasSubstr(std::string("--seed: ") + seed + " is no whole number"));
  }
  EXPECT_EQ(render("18446744073709551615").exit_code, 0);
}

TEST(RenderCommand, NamesAToolThatItDoesNotKnow) {
  const test::TempDir temp;
  std::string log = long_log(10);
  const auto render = [&] {
    EXPECT_TRUE(write_file(temp / "log.csv", log));
    const auto ran = test::run(test::program("osteon-audio"),
                               {"render", (temp / "log.csv").string(), "--out", (temp / "x.wav").string()});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.out;
  };
  EXPECT_THAT(render(), testing::Not(HasSubstr("note")));
  const std::size_t row = log.find("drill-3.2", log.find("drill-3.2") + 1);
  log.replace(row, 9, "drill3.2");
  EXPECT_THAT(render(), AllOf(HasSubstr("log.csv: line 3: tool is \"drill3.2\""), HasSubstr("sounds like a drill"),
                              HasSubstr("known are"), HasSubstr("drill-3.2"), HasSubstr("burr-round-5")));
}

}  // namespace
}  // namespace osteon::audio
