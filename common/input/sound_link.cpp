#include "common/input/sound_link.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/input/link_message.hpp"

namespace osteon {

namespace {

using nlohmann::json;

constexpr double kMostRate_hz = 1e6, kMost_ms = 1e6, kMostGaps = 1e15;
constexpr LinkMessageNames kSoundMessage{"a sound's", "the sound", "osteon and osteon-audio"};

}  // namespace

LocalLinkNames sound_link_names() { return {"the sound's socket", "an audio client"}; }

std::string encode(const SoundSettings& settings) {
  return json{{"version", kLinkVersion}, {"volume", settings.volume}, {"on", settings.on}}.dump();
}

std::string encode(const SoundReport& report) {
  const std::size_t older = report.wave.size() - std::min(report.wave.size(), kMostWaveSamples);
  const std::vector<int> wave(report.wave.begin() + static_cast<std::ptrdiff_t>(older), report.wave.end());
  return json{{"version", kLinkVersion},
              {"wave", wave},
              {"rate_hz", report.rate_hz},
              {"level", report.level},
              {"work_ms", report.work_ms},
              {"buffer_ms", report.buffer_ms},
              {"latency_ms", report.latency_ms},
              {"gaps", report.gaps},
              {"late_callbacks", report.late_callbacks},
              {"device", shortened(report.device)},
              {"trouble", shortened(report.trouble)}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<SoundSettings> read_sound_settings(std::string_view text) {
  Result<LinkMessage> fields = LinkMessage::read(text, kSoundMessage);
  if (!fields) return tl::unexpected(fields.error());
  SoundSettings settings;
  settings.volume = fields->number("volume", 0.0, 1.0);
  settings.on = fields->boolean("on");
  if (const Result<void> read = fields->outcome(); !read) return tl::unexpected(read.error());
  return settings;
}

Result<SoundReport> read_sound_report(std::string_view text) {
  Result<LinkMessage> fields = LinkMessage::read(text, kSoundMessage);
  if (!fields) return tl::unexpected(fields.error());
  SoundReport report;
  report.wave = fields->integers("wave", kMostWaveSamples, kFullScale);
  report.rate_hz = fields->number("rate_hz", 1.0, kMostRate_hz);
  report.level = fields->number("level", 0.0, 1.0);
  report.work_ms = fields->number("work_ms", 0.0, kMost_ms);
  report.buffer_ms = fields->number("buffer_ms", 0.0, kMost_ms);
  report.latency_ms = fields->number("latency_ms", 0.0, kMost_ms);
  report.gaps = fields->number("gaps", 0.0, kMostGaps);
  report.late_callbacks = fields->number("late_callbacks", 0.0, kMostGaps);
  report.device = fields->text("device");
  report.trouble = fields->text("trouble");
  if (const Result<void> read = fields->outcome(); !read) return tl::unexpected(read.error());
  return report;
}

}  // namespace osteon
