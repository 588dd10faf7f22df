#include "tests/fuzz/pointer_target.hpp"

#include <string_view>

#include "common/core/check.hpp"
#include "common/input/pointer_link.hpp"
#include "common/input/sound_link.hpp"
#include "tests/fuzz/import_files.hpp"

namespace osteon::fuzz {
namespace {

bool within(double value, double least, double most) { return value >= least && value <= most; }

bool is_near(const Vec3& v, double most) { return v.cwiseAbs().maxCoeff() <= most; }

bool is_unit(const Eigen::Quaterniond& q) { return within(q.norm(), 1.0 - 1e-12, 1.0 + 1e-12); }

// What a tool is moved by lies within its ranges, and comes back the same when it is sent on.
void check_input(const PointerInput& input) {
  OSTEON_CHECK(is_near(input.target_mm, 1e5) && is_unit(input.rotation_bone_tool));
  OSTEON_CHECK(within(input.push_n, kLeastPush_n, kMostPush_n) && within(input.spindle, 0.0, 1.0));
  OSTEON_CHECK(within(input.spindle_rpm, 0.0, 2e5) && input.tool.size() <= 512 && input.law.size() <= 512);
  OSTEON_CHECK(!input.wear || within(*input.wear, kSharp, kBluntest));
  Result<PointerInput> again = read_pointer_input(encode(input));
  OSTEON_CHECK(again && again->rotation_bone_tool.isApprox(input.rotation_bone_tool, 1e-12));
  again->rotation_bone_tool = input.rotation_bone_tool;
  OSTEON_CHECK(*again == input);
}

void check_output(const PointerOutput& output) {
  OSTEON_CHECK(is_near(output.pose_bone_tool.position_mm, 1e5) && is_unit(output.pose_bone_tool.rotation));
  OSTEON_CHECK(is_near(output.force_hand_n, 1e6) && is_near(output.force_bone_n, 1e6));
  OSTEON_CHECK(output.tool.size() <= 512 && output.law.size() <= 512 && output.trouble.size() <= 512);
  OSTEON_CHECK(!output.wear || within(*output.wear, kSharp, kBluntest));
  const Result<PointerOutput> again = read_pointer_output(encode(output));
  OSTEON_CHECK(again && again->trouble == output.trouble && again->tool == output.tool);
  OSTEON_CHECK(again->wear == output.wear && again->law == output.law);
  OSTEON_CHECK(again->pose_bone_tool.position_mm == output.pose_bone_tool.position_mm);
  OSTEON_CHECK(again->depth_mm == output.depth_mm && again->push_n == output.push_n);
  OSTEON_CHECK(again->pushing == output.pushing && again->on_metal == output.on_metal);
  OSTEON_CHECK(again->device_holds_n == output.device_holds_n && again->saturated == output.saturated);
}

void check_report(const SoundReport& report) {
  OSTEON_CHECK(report.wave.size() <= kMostWaveSamples && report.rate_hz >= 1.0 && within(report.level, 0.0, 1.0));
  for (const int sample : report.wave) OSTEON_CHECK(within(sample, -kFullScale, kFullScale));
  for (const double ms : {report.work_ms, report.buffer_ms, report.latency_ms}) OSTEON_CHECK(within(ms, 0.0, 1e6));
  OSTEON_CHECK(report.device.size() <= 512 && report.trouble.size() <= 512);
  const Result<SoundReport> again = read_sound_report(encode(report));
  OSTEON_CHECK(again && *again == report);
}

void read_sound_message(std::span<const std::uint8_t> data) {
  const std::string_view text(reinterpret_cast<const char*>(data.data()), data.size());
  if (const Result<SoundSettings> settings = read_sound_settings(text)) {
    OSTEON_CHECK(within(settings->volume, 0.0, 1.0));
    const Result<SoundSettings> again = read_sound_settings(encode(*settings));
    OSTEON_CHECK(again && *again == *settings);
  } else {
    expect_bounded(settings.error());
  }
  if (const Result<SoundReport> report = read_sound_report(text))
    check_report(*report);
  else
    expect_bounded(report.error());
}

void read_message(std::span<const std::uint8_t> data) {
  const std::string_view text(reinterpret_cast<const char*>(data.data()), data.size());
  if (const Result<PointerInput> input = read_pointer_input(text))
    check_input(*input);
  else
    expect_bounded(input.error());
  if (const Result<PointerOutput> output = read_pointer_output(text))
    check_output(*output);
  else
    expect_bounded(output.error());
}

}  // namespace

Target pointer_message_target() {
  PointerInput input;
  input.target_mm = {1.25, -20.5, 300.0};
  input.on_bone = input.push = true;
  input.tool = "drill-3.2";
  input.wear = 1.5;
  input.law = "allotta";
  PointerOutput output;
  output.force_bone_n = {0.0, 1.5, -27.25};
  output.pushing = true;
  output.tool = "burr-round-5";
  output.wear = 2.25;
  output.law = "milling";
  output.trouble = "the tool \"gr\u00f6\u00dfer\" cannot be held";
  Target target{"pointer_message",
                read_message,
                {bytes_of_text(encode(PointerInput{})), bytes_of_text(encode(input)),
                 bytes_of_text(encode(PointerOutput{})), bytes_of_text(encode(output))}};
  // Half of the changed inputs keep the form of JSON, so that fields are reached.
  target.change = change_number;
  return target;
}

Target sound_message_target() {
  SoundReport report;
  for (int i = 0; i < 64; ++i) report.wave.push_back((i % 2 == 0 ? 1 : -1) * i * kFullScale / 63);
  report.level = 0.5;
  report.work_ms = 0.125;
  report.buffer_ms = 5.333;
  report.late_callbacks = 7;
  report.device = "PulseAudio";
  report.trouble = "no sound server answers (\u00fc)";
  Target target{
      "sound_message",
      read_sound_message,
      {bytes_of_text(encode(SoundSettings{})), bytes_of_text(encode(SoundReport{})), bytes_of_text(encode(report))}};
  target.change = change_number;
  return target;
}

}  // namespace osteon::fuzz
