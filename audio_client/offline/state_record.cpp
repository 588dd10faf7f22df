#include "audio_client/offline/state_record.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string_view>

#include "audio_client/offline/state_sources.hpp"
#include "common/core/bounded_text.hpp"
#include "common/tools/tool.hpp"

namespace osteon::audio {
namespace {

namespace fs = std::filesystem;

constexpr double kMostRecordedRpm = 1e6;
constexpr double kMostNumber = 1e9;  // of every other quantity: more is damage

struct NamedNumber {
  const char* field;
  double value, least, most;
};

// The first number that no session has, or nothing.
std::optional<NamedNumber> impossible(const CuttingState& state) {
  const std::array<NamedNumber, 10> numbers = {
      {{"rpm", state.spindle_rpm, 0.0, kMostRecordedRpm},
       {"force", state.force_physical_N.norm(), 0.0, kMostNumber},
       {"torque", state.torque_Nmm, -kMostNumber, kMostNumber},
       {"feed", state.feed_mm_per_s, -kMostNumber, kMostNumber},
       {"density", state.density_g_cm3, 0.0, 100.0},
       {"engaged share", state.engaged_fraction, 0.0, 1.0},
       {"position of the tip", state.pose_bone_tool.position_mm.norm(), 0.0, kMostNumber},
       {"cortex", state.cortex_mm, 0.0, kMostNumber},
       {"seated", state.seated, 0.0, 1.0},
       {"blow impulse", state.blow_impulse_N_s, 0.0, kMostNumber}}};
  for (const NamedNumber& number : numbers)
    if (!(number.value >= number.least && number.value <= number.most)) return number;  // also nan
  return std::nullopt;
}

// A wild number has up to 300 digits before its point.
std::string shown(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

}  // namespace

void StateRecord::note_tool(const std::string& name) {
  if (name == last_tool_ || !unknown_tool_.empty()) return;
  last_tool_ = name;
  if (name.empty() || find_tool(name)) return;
  std::string known;
  for (const Tool& tool : builtin_tools()) known += (known.empty() ? "" : ", ") + tool.name;
  unknown_tool_ = place("tool") + "is \"" + bounded_text(name, 60) +
                  "\", which this program does not know, so it sounds like a drill; known are " + known;
}

Result<std::optional<CuttingState>> StateRecord::next() {
  auto state = read();
  if (!state || !*state) return state;
  if (const auto number = impossible(**state))
    return bad_input(place(number->field) + "is " + shown(number->value) +
                     ", which no tool has; the record is damaged, so record the session again");
  const std::int64_t time_ns = (*state)->time_ns;
  if (time_ns < 0 || time_ns > kLatestState_ns)
    return bad_input(place("mono_ns") + "is not of a clock; the record is damaged, so record the session again");
  if (!first_ns_) first_ns_ = time_ns;
  if (last_ns_ && time_ns < *last_ns_)
    return bad_input(place("mono_ns") + "is before that of the row before; sort the rows by time");
  // As doubles: the difference of two wild numbers may overflow.
  if (static_cast<double>(time_ns) - static_cast<double>(*first_ns_) > 1e9 * kLongestSession_s)
    return bad_input(place("mono_ns") + "is more than 4 hours after the first; give a record of one session");
  last_ns_ = time_ns;
  note_tool((*state)->tool_name);
  return state;
}

Result<std::unique_ptr<StateRecord>> open_states(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error))
    return bad_input(file.string() + " is a folder; give the recording (session.h5) or the session log (CSV) in it");
  if (!fs::exists(file, error))
    return failure(ErrorCode::not_found,
                   "there is no file " + file.string() + "; give what osteon-haptic --record or --session-log wrote");
  if (!fs::is_regular_file(file, error))
    return bad_input(file.string() + " is a device or a pipe; give a recording or a session log on a disk");
  std::array<char, 16> begin{};
  std::ifstream in(file, std::ios::binary);
  in.read(begin.data(), begin.size());
  if (in.gcount() == 0)
    return bad_input(file.string() + " cannot be read, or has no byte in it; give a recording or a session log");
  const std::string_view letters(begin.data(), static_cast<std::size_t>(in.gcount()));
  if (letters.starts_with("\x89HDF\r\n\x1a\n")) return open_recording(file);
  if (letters.starts_with("SQLite format 3"))
    return bad_input(file.string() +
                     " is the journal of a room, which keeps cuts but neither forces nor densities; give what "
                     "osteon-haptic --record or --session-log wrote");
  if (letters.starts_with("RIFF") || letters.starts_with("PK"))
    return bad_input(file.string() + " is no record of a session; give what osteon-haptic --record or --session-log " +
                     "wrote");
  return open_session_log(file);
}

}  // namespace osteon::audio
