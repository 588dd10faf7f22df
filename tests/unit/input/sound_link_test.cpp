// The link between a window and its audio client: what one end says arrives as it was, and a wrong message is not used.
// The socket itself is that of the pointer, whose tests are in pointer_link_test.cpp.
#include "common/input/sound_link.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using nlohmann::json;

SoundReport a_report() {
  SoundReport report;
  report.wave = {0, 1, -1, 12345, -kFullScale, kFullScale};
  report.rate_hz = 44100.0;
  report.level = 0.625;
  report.work_ms = 0.125;
  report.buffer_ms = 5.25;
  report.latency_ms = 22.75;
  report.gaps = 3;
  report.late_callbacks = 17;
  report.device = "PulseAudio";
  report.trouble = "the sound server \"größer\" went away";
  return report;
}

TEST(SoundMessage, ComesBackAsItWas) {
  for (const SoundSettings& settings : {SoundSettings{}, SoundSettings{0.0, false}, SoundSettings{0.375, true}}) {
    const auto read = read_sound_settings(encode(settings));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, settings);
  }
  for (const SoundReport& report : {SoundReport{}, a_report()}) {
    const auto read = read_sound_report(encode(report));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(*read, report);
  }
}

TEST(SoundMessage, TheLargestReportFits) {
  SoundReport report = a_report();
  report.wave.assign(kMostWaveSamples, -kFullScale);
  report.device = report.trouble = std::string(512, '\x01');
  report.level = report.work_ms = report.buffer_ms = report.latency_ms = 1.0 / 3.0;
  const auto read = read_sound_report(encode(report));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, report);
}

TEST(SoundMessage, OfALongerWaveTheNewestSamplesStay) {
  SoundReport report;
  report.wave.resize(kMostWaveSamples + 100);
  std::iota(report.wave.begin(), report.wave.end(), 0);
  const auto read = read_sound_report(encode(report));
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->wave.size(), kMostWaveSamples);
  EXPECT_EQ(read->wave.front(), 100);
  EXPECT_EQ(read->wave.back(), report.wave.back());
}

// Each value alone, and the field's absence, is refused with a sentence that names the field.
template <class Read>
void expect_each_refused(const std::string& valid, const std::vector<std::pair<const char*, std::vector<json>>>& wrong,
                         Read read) {
  ASSERT_TRUE(read(valid));
  const json message = json::parse(valid);
  for (const auto& [field, values] : wrong) {
    std::vector<json> broken;
    for (const json& value : values) (broken.emplace_back(message))[field] = value;
    broken.emplace_back(message).erase(field);
    for (const json& one : broken) {
      const auto refused = read(one.dump());
      ASSERT_FALSE(refused) << one.dump();
      EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
      EXPECT_NE(refused.error().message.find(field), std::string::npos) << refused.error().message;
    }
  }
  EXPECT_EQ(wrong.size(), message.size()) << "a field is not tested";
}

const std::vector<json> kNoVersion{nullptr, 0, 1, 1.5, "2", true};

TEST(SoundMessage, EachFieldIsChecked) {
  const auto no_number = [](double least, double most) {
    return std::vector<json>{nullptr, "1", true, json::array({1}), least - 0.01, 1.001 * most, 1e300};
  };
  const std::vector<json> no_text{nullptr, 3, json::array(), std::string(513, 'x')};
  expect_each_refused(encode(SoundSettings{}),
                      {{"version", kNoVersion}, {"volume", no_number(0, 1)}, {"on", {nullptr, 0, "true"}}},
                      [](const std::string& text) { return read_sound_settings(text); });
  expect_each_refused(
      encode(a_report()),
      {{"version", kNoVersion},
       {"wave",
        {nullptr, "1,2", 5, json::object({{"x", 1}}), json::array({1.5}), json::array({"1"}), json::array({true}),
         json::array({kFullScale + 1}), json::array({0, -kFullScale - 1}), json::array({std::int64_t{1} << 40}),
         json::array({std::numeric_limits<std::uint64_t>::max()}), std::vector<int>(kMostWaveSamples + 1, 0)}},
       {"rate_hz", no_number(1, 1e6)},
       {"level", no_number(0, 1)},
       {"work_ms", no_number(0, 1e6)},
       {"buffer_ms", no_number(0, 1e6)},
       {"latency_ms", no_number(0, 1e6)},
       {"gaps", no_number(0, 1e15)},
       {"late_callbacks", no_number(0, 1e15)},
       {"device", no_text},
       {"trouble", no_text}},
      [](const std::string& text) { return read_sound_report(text); });
  EXPECT_FALSE(read_sound_settings(encode(a_report()))) << "neither end takes the other's messages";
  EXPECT_FALSE(read_sound_report(encode(SoundSettings{})));
}

TEST(SoundLink, SettingsAndReportsArrive) {
  const test::TempDir folder;
  const auto window = SoundServer::listen(folder / "sound");
  ASSERT_TRUE(window) << window.error().message;
  EXPECT_FALSE((*window)->connected());
  auto client = SoundClient::connect(folder / "sound");
  ASSERT_TRUE(client) << client.error().message;
  (*window)->send({0.25, true});
  (*window)->send({0.5, true});
  const auto settings = (*client)->wait(0);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->volume, 0.5) << "the newest counts";
  (*client)->send(a_report());
  ASSERT_TRUE((*window)->newest());
  EXPECT_EQ(*(*window)->newest(), a_report());
  client->reset();
  EXPECT_FALSE((*window)->newest()) << "of a client that has gone";
}

TEST(SoundLink, ErrorsNameTheSoundAndTheRemedy) {
  const test::TempDir folder;
  const auto nobody = SoundClient::connect(folder / "sound");
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().message, "no window listens at the sound's socket " + (folder / "sound").string() +
                                        "; start osteon, which starts this program by itself");
}

}  // namespace
}  // namespace osteon
