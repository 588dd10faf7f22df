// osteon-audio as a process beside a real server. It plays, logs and records what a haptic client would send.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sndfile.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/files.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/tones.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/room_client.hpp"
#include "osteon/v1/cutting.grpc.pb.h"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

struct Row {
  std::uint64_t state_seq = 0;
  std::int64_t received_ns = 0, sounded_ns = 0;
};

std::vector<Row> read_log(const std::filesystem::path& file, std::string& header) {
  std::ifstream in(file);
  std::getline(in, header);
  std::vector<Row> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    Row row;
    char comma;
    fields >> row.state_seq >> comma >> row.received_ns >> comma >> row.sounded_ns;
    rows.push_back(row);
  }
  return rows;
}

// The mean of both channels; nothing if the file has not two.
std::vector<float> read_wav(const std::filesystem::path& file) {
  SF_INFO info{};
  SNDFILE* in = sf_open(file.c_str(), SFM_READ, &info);
  if (!in) return {};
  std::vector<float> samples(static_cast<std::size_t>(info.frames * info.channels));
  sf_readf_float(in, samples.data(), info.frames);
  sf_close(in);
  if (info.channels != 2) return {};
  std::vector<float> mean(static_cast<std::size_t>(info.frames));
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5F * (samples[2 * i] + samples[2 * i + 1]);
  return mean;
}

constexpr std::size_t kSilent_frames = 2000;

// Whether the last samples of a recording that still grows are 0. Its header has no length yet.
bool ends_silently(const std::filesystem::path& file) {
  constexpr std::size_t kHeader_bytes = 44, kTail_bytes = kSilent_frames * sizeof(std::int16_t);
  const auto bytes = read_file(file);
  return bytes && bytes->size() > kHeader_bytes + 10 * kTail_bytes &&
         std::all_of(bytes->end() - kTail_bytes, bytes->end(), [](char byte) { return byte == 0; });
}

// A server with a small phantom, ready for clients.
class AudioProcess : public testing::Test {
 protected:
  void SetUp() override {
    const test::RunResult made =
        test::run(test::program("osteon-import"), {"phantom", "block", "--layers", "4:1.9", "--width", "8", "--pitch",
                                                   "0.5", "--out", (temp_ / "case").string()});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    server_.emplace(test::program("osteon-server"),
                    std::vector<std::string>{"--case", (temp_ / "case").string(), "--plain", "--address-file",
                                             (temp_ / "address").string()});
    const auto address = test::wait_for_address(temp_ / "address", 30s);
    ASSERT_TRUE(address) << server_->err();
    address_ = *address;
  }

  std::vector<std::string> arguments() const {
    // If deploy/with-null-sink runs the test with this variable, the sound goes through RtAudio and PulseAudio.
    const char* output = std::getenv("OSTEON_TEST_OUTPUT");
    return {"--server",
            address_,
            "--plain",
            "--output",
            output ? output : "none",
            "--wav",
            (temp_ / "a.wav").string(),
            "--state-log",
            (temp_ / "a.csv").string(),
            "--summary",
            (temp_ / "a.json").string()};
  }

  // Sends the states at 120 Hz as a haptic client does.
  void send(const std::vector<CuttingState>& states) {
    auto room = wire::join_room(address_, wire::ClientKind::haptic, "hand", 5s, {});
    ASSERT_TRUE(room) << room.error().message;
    grpc::ClientContext context;
    const auto stub = v1::CuttingService::NewStub(room->channel);
    const auto stream = stub->Session(&context);
    std::thread reader([&] {
      v1::SessionResponse ignored;
      while (stream->Read(&ignored)) {
      }
    });
    v1::SessionRequest open;
    open.mutable_open()->set_author(room->author.value);
    open.mutable_open()->set_server_epoch(room->server_epoch);
    bool sent = stream->Write(open);
    auto due = std::chrono::steady_clock::now();
    for (CuttingState state : states) {
      std::this_thread::sleep_until(due += 8333us);
      state.author = room->author;
      v1::SessionRequest request;
      *request.mutable_state() = wire::to_wire(state);
      sent = sent && stream->Write(request);
    }
    EXPECT_TRUE(sent) << "the server closed the session";
    stream->WritesDone();
    context.TryCancel();
    reader.join();
    static_cast<void>(stream->Finish());
  }

  test::TempDir temp_;
  std::optional<test::Process> server_;
  std::string address_;
};

std::vector<CuttingState> numbered(const std::vector<std::pair<CuttingState, double>>& parts) {
  std::vector<CuttingState> states;
  for (const auto& [state, seconds] : parts) {
    for (int i = 0; i < static_cast<int>(seconds * 120); ++i) {
      states.push_back(state);
      states.back().state_seq = states.size();
    }
  }
  return states;
}

TEST_F(AudioProcess, StatesAreHeardLoggedAndRecorded) {
  test::Process audio(test::program("osteon-audio"), arguments());
  ASSERT_TRUE(test::wait_until([&] { return audio.err().find("joined") != std::string::npos; }, 20s)) << audio.err();
  send(numbered({{test::free_drill(1200), 1.2}, {test::cortical_drill(1200), 1.2}, {test::idle_drill(), 0.8}}));
  // A sink that stalls takes the states later.
  EXPECT_TRUE(test::wait_until([&] { return ends_silently(temp_ / "a.wav"); }, 20s)) << "the tool does not run down";
  EXPECT_EQ(audio.terminate(), 0) << audio.err();

  std::string header;
  const std::vector<Row> rows = read_log(temp_ / "a.csv", header);
  EXPECT_THAT(header, testing::StartsWith("state_seq,received_mono_ns,sounded_mono_ns"));
  // If two states come within one buffer, only the newest counts, so not all 384 are played. After a stall there are
  // fewer.
  ASSERT_GT(rows.size(), 60U);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_GT(rows[i].sounded_ns, rows[i].received_ns);
    if (i > 0) {
      EXPECT_GT(rows[i].state_seq, rows[i - 1].state_seq);
    }
  }

  const std::vector<float> heard = read_wav(temp_ / "a.wav");
  const nlohmann::json summary = nlohmann::json::parse(*read_file(temp_ / "a.json"));
  EXPECT_EQ(summary["wav_frames"], heard.size());
  EXPECT_EQ(summary["wav_frames_lost"], 0);
  EXPECT_EQ(summary["frames"], heard.size());
  EXPECT_EQ(summary["states_sounded"], rows.size());
  EXPECT_GT(summary["peak"], 0.02);
  EXPECT_LT(summary["peak"], 1.0);
  EXPECT_GT(summary["received_to_sounded"]["p50_ms"], 0);

  std::printf("%s\n", summary.dump().c_str());

  // The loudest half second is cortical drilling. It contains the output mesh at 48 x 20 Hz, but for the moment after
  // the load came, in which the motor lost up to 19 rpm.
  std::size_t loudest = 0;
  double loudest_db = sound::kSilence_db;
  for (std::size_t at = 0; at + 24000 <= heard.size(); at += 2400) {
    const double db = sound::rms_db(std::span(heard).subspan(at, 24000));
    if (db > loudest_db) loudest_db = db, loudest = at;
  }
  EXPECT_NEAR(sound::find_tone(std::span(heard).subspan(loudest, 24000), 48000, 940, 980).hz, 960, 1.0);
  EXPECT_EQ(sound::peak(std::span(heard).last(kSilent_frames)), 0) << "the recording ends in silence";
}

TEST_F(AudioProcess, HeadphonesHearBothEars) {
  std::vector<std::string> with_headphones = arguments();
  with_headphones.insert(with_headphones.end(), {"--listen", "headphones", "--listener", "0", "-400", "-300"});
  test::Process audio(test::program("osteon-audio"), with_headphones);
  ASSERT_TRUE(test::wait_until([&] { return audio.err().find("joined") != std::string::npos; }, 20s)) << audio.err();
  send(numbered({{test::cortical_drill(1200), 1.0}}));
  EXPECT_EQ(audio.terminate(), 0) << audio.err();
  const nlohmann::json summary = nlohmann::json::parse(*read_file(temp_ / "a.json"));
  EXPECT_EQ(summary["listen"], "headphones");
  EXPECT_GT(summary["peak_left"], 0.01);
  EXPECT_GT(summary["peak_right"], 0.01);
  EXPECT_EQ(summary["wav_frames"], read_wav(temp_ / "a.wav").size());
}

TEST_F(AudioProcess, ServerThatGoesAwayIsOneSentenceAndAFinishedRecording) {
  test::Process audio(test::program("osteon-audio"), arguments());
  ASSERT_TRUE(test::wait_until([&] { return audio.err().find("joined") != std::string::npos; }, 20s)) << audio.err();
  server_->signal(SIGKILL);
  EXPECT_EQ(audio.wait(20s), 1);
  EXPECT_THAT(audio.err(), testing::HasSubstr("osteon-audio: the server went away"));
  EXPECT_FALSE(read_wav(temp_ / "a.wav").empty());
  EXPECT_TRUE(std::filesystem::exists(temp_ / "a.json"));
}

// The size of a file ends where the disk would be full.
TEST_F(AudioProcess, AFullDiskIsSaidWhileTheSoundGoesOn) {
  constexpr std::uint64_t kRoom = 256 * 1024;
  std::vector<std::string> limited{"-c", "ulimit -f 256 && exec \"$@\"", "osteon-audio",
                                   test::program("osteon-audio").string()};
  std::vector<std::string> own = arguments();
  *std::next(std::ranges::find(own, "--output")) = "none";  // PulseAudio's shared memory needs larger files
  limited.insert(limited.end(), own.begin(), own.end());
  test::Process audio("bash", limited);
  EXPECT_TRUE(test::wait_until([&] { return audio.err().find("the recording has ended") != std::string::npos; }, 60s))
      << audio.err();
  EXPECT_TRUE(audio.running());
  EXPECT_EQ(audio.terminate(), 1);
  EXPECT_THAT(audio.err(), testing::HasSubstr("osteon-audio: the recording " + (temp_ / "a.wav").string() +
                                              " could not be written whole (File too large)"));
  const nlohmann::json summary = nlohmann::json::parse(*read_file(temp_ / "a.json"));
  EXPECT_EQ(std::filesystem::file_size(temp_ / "a.wav"), kRoom);
  EXPECT_EQ(summary["wav_frames"], (kRoom - 44) / 4);
  EXPECT_EQ(summary["wav_frames"].get<std::uint64_t>() + summary["wav_frames_lost"].get<std::uint64_t>(),
            summary["frames"].get<std::uint64_t>());
}

TEST_F(AudioProcess, KilledListenerDisturbsNobody) {
  test::Process audio(test::program("osteon-audio"), arguments());
  ASSERT_TRUE(test::wait_until([&] { return audio.err().find("joined") != std::string::npos; }, 20s)) << audio.err();
  audio.signal(SIGKILL);
  send(numbered({{test::free_drill(1200), 0.5}}));
  EXPECT_TRUE(server_->running());
  EXPECT_EQ(server_->terminate(), 0) << server_->err();
}

TEST(AudioProgram, WrongInputsAreOneSentenceEach) {
  const test::TempDir temp;
  struct Case {
    std::vector<std::string> arguments;
    std::string says;
  };
  const std::vector<Case> cases = {
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--timeout", "0.2"}, "127.0.0.1:1"},
      {{"--server", "nowhere", "--plain", "--output", "none"}, "nowhere"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "tape"}, "--output none"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--wav", "/nowhere/a.wav"}, "/nowhere/a.wav"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--state-log", "/nowhere/a.csv"}, "/nowhere/a.csv"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--summary", "/nowhere/a.json"}, "/nowhere/a.json"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "pulse"}, "--output none"},
      {{"--output", "none"}, "--server"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--listen", "quadraphony"}, "--listen loudspeakers"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--hrtf", "a.sofa"}, "--listen headphones"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--listen", "headphones", "--hrtf", "/nowhere.sofa"},
       "/nowhere.sofa"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--listen", "headphones", "--hrtf", "/etc/passwd"},
       "--hrtf another file"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--listener", "0", "0", "0"}, "--listener"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--device", "0"}, "--output pulse"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--timeout", "nan"}, "nan is not a number from 0"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--wav", ""}, "--wav: the name is empty"},
      {{"--server", "127.0.0.1:1", "--plain", "--output", "none", "--summary", ""}, "--summary: the name is empty"},
      {{"devices"}, "no sound server answers"},
  };
  for (const Case& wrong : cases) {
    test::ProcessOptions options;
    options.environment = {{"PULSE_SERVER", "unix:" + (temp / "nobody").string()},
                           {"XDG_RUNTIME_DIR", temp.path().string()}};
    const test::RunResult result = test::run(test::program("osteon-audio"), wrong.arguments, 30s, options);
    EXPECT_EQ(result.exit_code, 1) << wrong.says;
    EXPECT_THAT(result.err, testing::StartsWith("osteon-audio: ")) << wrong.says;
    EXPECT_THAT(result.err, testing::HasSubstr(wrong.says));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
}

TEST(AudioProgram, WritesNoFileOverAnotherOne) {
  const test::TempDir temp;
  const std::string file = (temp / "a.yaml").string();
  ASSERT_TRUE(write_file(file, "a preset of hours of work"));
  const std::vector<std::vector<std::string>> wrong = {
      {"--preset", file, "--wav", file}, {"--wav", file, "--summary", file}, {"--state-log", file, "--summary", file}};
  for (const std::vector<std::string>& options : wrong) {
    std::vector<std::string> arguments{"--server", "127.0.0.1:1", "--plain", "--output", "none"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const test::RunResult result = test::run(test::program("osteon-audio"), arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, testing::AllOf(testing::HasSubstr(file + " would lose "),
                                           testing::HasSubstr("give " + options[2] + " another file")));
    EXPECT_EQ(*read_file(file), "a preset of hours of work");
  }
}

TEST(AudioProgram, RefusesAnEarlierRecordingAtOnce) {
  const test::TempDir temp;
  const std::string file = (temp / "a.wav").string();
  ASSERT_TRUE(write_file(file, "earlier sound"));
  const test::RunResult result = test::run(test::program("osteon-audio"),
                                           {"--server", "127.0.0.1:1", "--plain", "--output", "none", "--wav", file});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, testing::HasSubstr(file + " is already there; give --wav another name, or add --overwrite"));
  EXPECT_EQ(*read_file(file), "earlier sound");
}

TEST(AudioProgram, WithoutAServerAnEarlierRecordingStays) {
  const test::TempDir temp;
  ASSERT_TRUE(write_file(temp / "a.wav", "earlier sound"));
  ASSERT_TRUE(write_file(temp / "a.csv", "earlier rows"));
  const test::RunResult result =
      test::run(test::program("osteon-audio"),
                {"--server", "127.0.0.1:1", "--plain", "--output", "none", "--timeout", "0.2", "--wav",
                 (temp / "a.wav").string(), "--state-log", (temp / "a.csv").string(), "--overwrite"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, testing::HasSubstr("127.0.0.1:1"));
  EXPECT_EQ(*read_file(temp / "a.wav"), "earlier sound");
  EXPECT_EQ(*read_file(temp / "a.csv"), "earlier rows");
}

}  // namespace
}  // namespace osteon
