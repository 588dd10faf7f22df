// Runs every program on this machine in one room. A rig, an expert and a novice drill through the layered block of
// force-laws.md one after the other. Compares what the programs leave behind with closed forms.
#include <gtest/gtest.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fstream>
#include <numbers>
#include <thread>

#include "common/sound/levels.hpp"
#include "common/sound/tones.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/content.hpp"
#include "tests/support/wait.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr double kThickness_mm = 30.0;
constexpr double kCone_mm = 0.961;  // height of a 118° point of 3.2 mm
constexpr double kRigFeed_mm_per_s = 2.0;

class DrillingRoom : public testing::Test {
 protected:
  struct Hole {
    Table log, cuts;
    json summary;
  };
  struct Results {
    std::map<std::string, Hole> holes;  // by hand
    json server, viewer, audio;
    std::vector<float> sound;
    bool late_viewer_came = false, pictures_equal = false, pictures_differ_from_start = false;
    std::vector<std::pair<std::string, std::optional<int>>> exits;
    std::string late_mesh_hash, mesh_hash;
    bool killed_were_running = false;
    double killed_s = 0;   // steady clock
    double watched_s = 0;  // how long the viewer ran
  };

  static void SetUpTestSuite() {
    results_ = std::make_unique<Results>();
    Results& r = *results_;
    auto screen = Xvfb::start("640x480");
    ASSERT_TRUE(screen) << "Xvfb is needed; deploy/install installs it";
    Stage stage;
    const auto begun = std::chrono::steady_clock::now();
    ScriptedViewer viewer(stage.address(), *screen, {"--plain", "--summary", stage / "viewer.json"});
    Process audio = stage.start(
        "osteon-audio", {"--server", stage.address(), "--plain", "--output", "none", "--wav", stage / "sound.wav",
                         "--state-log", stage / "states.csv", "--summary", stage / "audio.json"});
    ASSERT_TRUE(viewer.tell("wait surface"));
    ASSERT_TRUE(viewer.tell("tool off"));
    const std::string look = "look at 0 0 -10 from 30 -40 60 up 0 0 1";
    ASSERT_TRUE(viewer.tell(look));
    ASSERT_TRUE(viewer.tell("screenshot " + (stage / "before.png").string()));

    // A viewer and an audio client that are killed during the work.
    ScriptedViewer doomed_viewer(stage.address(), *screen);
    Process doomed_audio = stage.start("osteon-audio", {"--server", stage.address(), "--plain", "--output", "none"});
    ASSERT_TRUE(doomed_viewer.tell("wait surface"));

    const std::map<std::string, double> places{{"rig", -12.0}, {"expert", 0.0}, {"novice", 12.0}};
    for (const std::string hand : {"rig", "expert", "novice"}) {
      json step = drill_at(places.at(hand), 0.0, hand);
      if (hand == "rig") step["feed_mm_per_s"] = kRigFeed_mm_per_s;
      Process haptic = stage.start_haptic(hand, {{"steps", json::array({step})}});
      if (hand == "rig") {
        std::this_thread::sleep_for(4s);
        r.killed_were_running = doomed_viewer.process().running() && doomed_audio.running();
        doomed_viewer.process().signal(SIGKILL);
        doomed_audio.signal(SIGKILL);
        r.killed_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
      }
      const auto code = haptic.wait(120s);
      ASSERT_EQ(code, 0) << hand << ": " << haptic.err();
      r.holes[hand] = {read_table(stage / (hand + ".csv")), read_table(stage / (hand + "-cuts.csv")),
                       read_json(stage / (hand + ".json"))};
    }

    const auto seq = std::to_string(r.holes["novice"].summary.at("room_seq").get<std::uint64_t>());
    ASSERT_TRUE(viewer.tell("wait seq " + seq));
    ASSERT_TRUE(viewer.tell("screenshot " + (stage / "after.png").string()));
    ScriptedViewer late(stage.address(), *screen, {"--plain", "--summary", stage / "late.json"});
    r.late_viewer_came = late.tell("wait surface") && late.tell("wait seq " + seq) && late.tell("tool off") &&
                         late.tell(look) && late.tell("screenshot " + (stage / "late.png").string());
    r.pictures_equal = content(stage / "after.png") == content(stage / "late.png");
    r.pictures_differ_from_start = content(stage / "after.png") != content(stage / "before.png");

    r.exits.emplace_back("late viewer", late.process().terminate());
    r.exits.emplace_back("viewer", viewer.process().terminate());
    r.watched_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    r.exits.emplace_back("audio", audio.terminate());
    r.exits.emplace_back("server", stage.server().terminate());
    r.server = read_json(stage / "server.json");
    r.viewer = read_json(stage / "viewer.json");
    r.audio = read_json(stage / "audio.json");
    r.mesh_hash = r.viewer.value("scene_mesh_hash", "none");
    r.late_mesh_hash = read_json(stage / "late.json").value("scene_mesh_hash", "missing");

    SF_INFO info{};
    SNDFILE* wav = sf_open((stage / "sound.wav").c_str(), SFM_READ, &info);
    ASSERT_NE(wav, nullptr);
    ASSERT_EQ(info.channels, 2);
    std::vector<float> both(static_cast<std::size_t>(2 * info.frames));
    sf_readf_float(wav, both.data(), info.frames);
    sf_close(wav);
    for (std::size_t i = 0; i + 1 < both.size(); i += 2) r.sound.push_back(0.5F * (both[i] + both[i + 1]));
  }
  static void TearDownTestSuite() { results_.reset(); }

  // The entries of the log while the tip is between two depths on its way in.
  static std::vector<std::size_t> on_the_way_in(const Hole& hole, double from_mm, double to_mm) {
    std::vector<std::size_t> found;
    double deepest = -1e9;
    for (std::size_t i = 0; i < hole.log.entries(); ++i) {
      const double depth = hole.log["depth_mm"][i];
      const bool advancing = depth >= deepest;
      deepest = std::max(deepest, depth);
      if (advancing && depth >= from_mm && depth <= to_mm) found.push_back(i);
    }
    EXPECT_FALSE(found.empty()) << "between " << from_mm << " and " << to_mm;
    return found;
  }
  // Median of a column over the ticks in which the tool moves. At most a tenth of them may stand still.
  static double typical(const Hole& hole, const std::string& column, double from_mm, double to_mm) {
    std::vector<double> values;
    std::size_t standing = 0;
    for (const std::size_t i : on_the_way_in(hole, from_mm, to_mm)) {
      if (hole.log["feed_mm_per_s"][i] < 1e-3)
        ++standing;
      else
        values.push_back(hole.log[column][i]);
    }
    EXPECT_LT(10 * standing, standing + values.size()) << column << " between " << from_mm << " and " << to_mm;
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
  }
  // The whole cone is in the near cortex, in the medulla, or in the far cortex.
  static double near_cortex(const Hole& hole, const std::string& column) { return typical(hole, column, 1.5, 4.8); }
  static double medulla(const Hole& hole, const std::string& column) { return typical(hole, column, 6.5, 24.5); }
  static double far_cortex(const Hole& hole, const std::string& column) { return typical(hole, column, 26.5, 29.5); }

  // How far the tip goes beyond the far face.
  static double plunge_mm(const Hole& hole) {
    double deepest = 0.0;
    for (const double depth : hole.log["depth_mm"]) deepest = std::max(deepest, depth);
    return deepest - kThickness_mm;
  }

  static std::unique_ptr<Results> results_;
};
std::unique_ptr<DrillingRoom::Results> DrillingRoom::results_;

TEST_F(DrillingRoom, ServerAndHapticClientHoldTheSameField) {
  EXPECT_EQ(results_->holes["novice"].summary["field_hash"], results_->server["field_hash"]);
  // Observers who joined later may have raised the server's number.
  EXPECT_LE(results_->holes["novice"].summary["room_seq"], results_->server["room_seq"]);
  EXPECT_EQ(results_->server["rejected"], 0);
  EXPECT_GT(results_->server["committed"], 100);
}

TEST_F(DrillingRoom, ThreeHolesAreGoneFromTheBone) {
  // Each tool has gone beyond the far side, so each hole is a cylinder. The bone is 30 mm thick.
  const double exact = 3.0 * std::numbers::pi * 1.6 * 1.6 * kThickness_mm;
  EXPECT_NEAR(results_->server["removed_mm3"].get<double>(), exact, 0.02 * exact);
}

TEST_F(DrillingRoom, TheRigFeelsChisForcesAndNothingAfterTheExit) {
  const Hole& rig = results_->holes["rig"];
  // Chi (7.3) at 1000 rpm, from its values at 1 mm/s.
  const double faster = std::pow(kRigFeed_mm_per_s, 0.5189), cortex_n = 28.9 * faster, medulla_n = 3.25 * faster;
  EXPECT_NEAR(near_cortex(rig, "force_physical_n"), cortex_n, 0.05 * cortex_n)
      << "at " << near_cortex(rig, "feed_mm_per_s") << " mm/s";
  EXPECT_NEAR(medulla(rig, "force_physical_n"), medulla_n, 0.05 * medulla_n);
  EXPECT_NEAR(far_cortex(rig, "force_physical_n"), cortex_n, 0.05 * cortex_n);
  for (const std::size_t i : on_the_way_in(rig, kThickness_mm + kCone_mm + 0.5, kThickness_mm + 2.9))
    EXPECT_LT(rig.log["force_physical_n"][i], 0.05);
  // The drill follows the rig's hand.
  const std::vector<std::size_t> in_cortex = on_the_way_in(rig, 1.5, 4.8);
  ASSERT_GT(in_cortex.size(), 1000u);
  const auto change = [&](const std::string& column) {
    return rig.log[column][in_cortex.back()] - rig.log[column][in_cortex.front()];
  };
  EXPECT_NEAR(change("device_depth_mm") / (1e-3 * change("state_seq")), kRigFeed_mm_per_s, 0.02 * kRigFeed_mm_per_s)
      << "mm/s; a tick is 1 ms";
  EXPECT_LE(near_cortex(rig, "feed_mm_per_s"), 1.02 * kRigFeed_mm_per_s);
}

TEST_F(DrillingRoom, HandsAreHeldBackByTheCortexAndPlungeWhenItGivesWay) {
  const Hole& expert = results_->holes["expert"];
  const Hole& novice = results_->holes["novice"];
  EXPECT_GE(medulla(expert, "feed_mm_per_s"), 10.0 * near_cortex(expert, "feed_mm_per_s"));
  EXPECT_GT(plunge_mm(expert), 1.0);
  EXPECT_LT(plunge_mm(expert), plunge_mm(novice));
  // force-laws.md: 6.0 mm and 14.4 mm.
  EXPECT_NEAR(plunge_mm(expert), 6.0, 0.15 * 6.0);
  EXPECT_NEAR(plunge_mm(novice), 14.4, 0.15 * 14.4);
}

TEST_F(DrillingRoom, TheDrillSoundsDifferentInAirCortexAndMedulla) {
  const Hole& rig = results_->holes["rig"];
  const std::vector<float>& sound = results_->sound;
  const double start_s = 1e-9 * results_->audio.at("first_frame_mono_ns").get<double>();
  // The middle half second of the sound for a range of depths in the rig's log.
  const auto heard = [&](double from_mm, double to_mm) {
    std::vector<double> times;
    for (std::size_t i = 0; i < rig.log.entries(); ++i) {
      const double depth = rig.log["depth_mm"][i];
      if (depth >= from_mm && depth <= to_mm && rig.log["rpm"][i] > 500.0 && times.size() < 100'000)
        times.push_back(1e-9 * rig.log["mono_ns"][i]);
      if (depth > to_mm) break;
    }
    EXPECT_FALSE(times.empty()) << "between " << from_mm << " and " << to_mm << " mm";
    const double middle = times.empty() ? start_s : 0.5 * (times.front() + times.back());
    const auto first = static_cast<std::size_t>(std::max(0.0, (middle - 0.25 - start_s) * 48000.0));
    EXPECT_LT(first + 24000, sound.size());
    return std::span(sound).subspan(std::min(first, sound.size() - 24000), 24000);
  };
  const auto cortical = heard(1.5, 4.8), cancellous = heard(6.5, 24.5), free = heard(-1e3, -0.3);
  EXPECT_GT(sound::rms_db(cancellous), sound::rms_db(free) + 1.0);
  EXPECT_GT(sound::rms_db(cortical), sound::rms_db(cancellous) + 3.0);

  // The output set's gear mesh has 48 periods for each turn of the spindle: 800 Hz at 1000 rpm. Load slows the spindle.
  const auto mesh_hz = [](std::span<const float> s) { return sound::find_tone(s, 48000.0, 700.0, 830.0).hz; };
  EXPECT_NEAR(mesh_hz(free), 800.0, 4.0);
  EXPECT_LT(mesh_hz(cancellous), mesh_hz(free) - 0.3);
  EXPECT_LT(mesh_hz(cortical), mesh_hz(cancellous) - 2.0);
}

TEST_F(DrillingRoom, AViewerThatComesLateShowsTheSameSurface) {
  EXPECT_TRUE(results_->late_viewer_came);
  EXPECT_TRUE(results_->pictures_equal);
  EXPECT_TRUE(results_->pictures_differ_from_start);
  EXPECT_EQ(results_->mesh_hash, results_->late_mesh_hash);
  EXPECT_EQ(results_->mesh_hash, results_->server["mesh_hash"]);
}

// The bone and the tool change all the time, so a viewer without this limit draws 30 pictures a second.
TEST_F(DrillingRoom, AViewerDrawsAtMostAsManyPicturesAsItMay) {
  constexpr int kScreenshots = 2;
  const int frames = results_->viewer.at("frames").get<int>();
  EXPECT_LE(frames, kViewerFrames_hz * results_->watched_s + 1 + kScreenshots);
  EXPECT_GT(frames, 10) << "or the limit would prove nothing";
}

TEST_F(DrillingRoom, EveryProgramEndsCleanlyOnSigterm) {
  for (const auto& [name, code] : results_->exits) EXPECT_EQ(code, 0) << name;
}

TEST_F(DrillingRoom, AKilledViewerAndAKilledAudioClientDisturbNobody) {
  EXPECT_TRUE(results_->killed_were_running);
  // Every cut made after the kill was acknowledged, and its log entry reached the others in order.
  const Hole& rig = results_->holes["rig"];
  EXPECT_EQ(rig.summary["rejected"], 0);
  ASSERT_EQ(rig.cuts.entries(), rig.summary["cuts"].get<std::size_t>());
  int after_the_kill = 0;
  for (std::size_t i = 0; i < rig.cuts.entries(); ++i) {
    EXPECT_GE(rig.cuts["confirmed_mono_ns"][i], rig.cuts["closed_mono_ns"][i]);
    if (i > 0) {
      EXPECT_EQ(rig.cuts["room_seq"][i], rig.cuts["room_seq"][i - 1] + 1.0);
    }
    after_the_kill += 1e-9 * rig.cuts["closed_mono_ns"][i] > results_->killed_s;
  }
  EXPECT_GT(after_the_kill, 500);  // 12 s of drilling, a cut every 8 ms
  // The remaining viewer and audio client ran to the end. Their own tests check what they show and play.
  EXPECT_GT(results_->sound.size(), 48000u * 40u);
}

}  // namespace
}  // namespace osteon::test
