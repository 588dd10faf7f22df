// A session log: a CSV table with a row for each millisecond.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <span>
#include <string_view>
#include <vector>

#include "audio_client/offline/state_sources.hpp"
#include "common/core/bounded_text.hpp"
#include "common/core/read_number.hpp"

namespace osteon::audio {
namespace {

constexpr std::size_t kLongestLine = 16384;
constexpr std::size_t kNoColumn = SIZE_MAX;
constexpr double kAxisError = 1e-3;  // of the length of a unit vector that was rounded

void split(std::string_view line, std::vector<std::string_view>& fields) {
  fields.clear();
  if (line.ends_with('\r')) line.remove_suffix(1);
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    fields.push_back(line.substr(at, end - at));
    at = end + 1;
  }
}

std::optional<CuttingPhase> phase_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, CuttingPhase>, 4> kNames = {{{"idle", CuttingPhase::idle},
                                                                                {"free", CuttingPhase::free},
                                                                                {"cutting", CuttingPhase::cutting},
                                                                                {"rubbing", CuttingPhase::rubbing}}};
  const auto* const found = std::ranges::find(kNames, name, &std::pair<std::string_view, CuttingPhase>::first);
  return found == kNames.end() ? std::nullopt : std::optional(found->second);
}

class LogStates final : public StateRecord {
 public:
  explicit LogStates(const std::filesystem::path& file) : file_(file.string()), in_(file, std::ios::binary) {
    std::error_code ignored;
    bytes_ = static_cast<double>(std::filesystem::file_size(file, ignored));
  }

  Result<void> open() {
    const auto header = take_line();
    if (!header) return tl::unexpected(header.error());
    std::string_view names = line_;
    if (names.starts_with("\xEF\xBB\xBF")) names.remove_prefix(3);  // the byte order mark of a spreadsheet
    header_ = names;
    split(header_, columns_);
    for (Column& column : needed_) {
      column.at = find(column.name);
      if (column.at == kNoColumn)
        return bad_input(file_ + ": line 1 has no column " + column.name +
                         "; give a log that osteon-haptic --session-log wrote");
    }
    for (const std::span<Column> columns :
         {std::span<Column>(optional_), std::span<Column>(tip_), std::span<Column>(axis_)})
      for (Column& column : columns) column.at = find(column.name);
    for (const std::span<const Column> columns : {std::span<const Column>(needed_), std::span<const Column>(optional_),
                                                  std::span<const Column>(tip_), std::span<const Column>(axis_)})
      for (const Column& column : columns)
        if (std::ranges::count(columns_, std::string_view(column.name)) > 1)
          return bad_input(file_ + ": line 1 has the column " + column.name +
                           " more than once; keep the one that the sound shall follow");
    return {};
  }

  double done() const override { return bytes_ > 0 ? std::min(1.0, static_cast<double>(read_) / bytes_) : 1.0; }
  std::string name() const override { return file_; }

 protected:
  Result<std::optional<CuttingState>> read() override {
    for (;;) {
      const auto more = take_line();
      if (!more) return tl::unexpected(more.error());
      if (!*more) return end();
      if (!line_.empty() && line_ != "\r") break;
    }
    split(line_, fields_);
    if (fields_.size() != columns_.size())
      return bad_input(file_ + ": line " + std::to_string(number_) + " has " + std::to_string(fields_.size()) +
                       " fields, and line 1 has " + std::to_string(columns_.size()) +
                       "; write each row with the columns of line 1");
    ++rows_;
    return parsed();
  }

  std::string place(const char* field) const override {
    return file_ + ": line " + std::to_string(number_) + ": " + field + " ";
  }

 private:
  struct Column {
    const char* name;
    std::size_t at = kNoColumn;
  };
  enum Needed { kMonoNs, kPhase, kTool, kRpm, kFeed, kDensity, kForce, kTorque };
  enum Optional { kSeq, kAuthor, kSuction, kCortex, kSeated, kBlows, kImpulse, kEngaged };

  [[nodiscard]] std::size_t find(std::string_view name) const {
    const auto found = std::ranges::find(columns_, name);
    return found == columns_.end() ? kNoColumn : static_cast<std::size_t>(found - columns_.begin());
  }

  // False at the end. A last line without its end was cut off when its program was killed, and does not count.
  Result<bool> take_line() {
    in_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    const auto got = static_cast<std::size_t>(in_.gcount());
    read_ += got;
    if (in_.eof()) return false;
    if (!in_)
      return bad_input(file_ + ": line " + std::to_string(number_ + 1) + " has more than " +
                       std::to_string(kLongestLine) + " bytes; give a log that osteon-haptic --session-log wrote");
    line_ = std::string_view(buffer_.data(), got - 1);
    ++number_;
    return true;
  }

  Result<std::optional<CuttingState>> end() const {
    if (rows_ == 0) return bad_input(file_ + " has no whole row below its header; record a session");
    return std::optional<CuttingState>();
  }

  [[nodiscard]] tl::unexpected<Error> no_value(const Column& column, const char* what) const {
    return bad_input(place(column.name) + "is " + what + " (" + bounded_text(fields_[column.at], 40) +
                     "); give a log that osteon-haptic --session-log wrote");
  }

  // Reads a column into `value`; one that is not there leaves it. Returns the column if it is no number.
  template <class T>
  const Column* number(const Column& column, T& value) const {
    if (column.at == kNoColumn) return nullptr;
    const auto read = read_number<T>(fields_[column.at]);
    if (!read) return &column;
    value = *read;
    return nullptr;
  }

  // As number(), of tip and axis. Where the axis is not known, the rotation is zero.
  const Column* read_pose(Pose& pose) const {
    Vec3 tip_mm = Vec3::Zero(), axis = Vec3::Zero();
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto at = static_cast<std::size_t>(i);
      for (const Column* wrong : {number(tip_[at], tip_mm[i]), number(axis_[at], axis[i])})
        if (wrong) return wrong;
    }
    const bool known = std::abs(axis.norm() - 1.0) < kAxisError;
    pose = known ? pose_along(tip_mm, axis) : Pose{tip_mm, Eigen::Quaterniond(0, 0, 0, 0)};
    return nullptr;
  }

  Result<std::optional<CuttingState>> parsed() const {
    CuttingState state;
    const auto phase = phase_of(fields_[needed_[kPhase].at]);
    if (!phase) return no_value(needed_[kPhase], "none of idle, free, cutting and rubbing");
    state.phase = *phase;
    state.tool_name = bounded_text(fields_[needed_[kTool].at], 200);
    state.state_seq = rows_;
    state.author.value = 1;
    state.engaged_fraction = 1;
    double force_n = 0;
    int suction = 0;
    for (const Column* wrong :
         {number(needed_[kMonoNs], state.time_ns), number(needed_[kRpm], state.spindle_rpm),
          number(needed_[kFeed], state.feed_mm_per_s), number(needed_[kDensity], state.density_g_cm3),
          number(needed_[kForce], force_n), number(needed_[kTorque], state.torque_Nmm),
          number(optional_[kSeq], state.state_seq), number(optional_[kAuthor], state.author.value),
          number(optional_[kSuction], suction), read_pose(state.pose_bone_tool),
          number(optional_[kCortex], state.cortex_mm), number(optional_[kSeated], state.seated),
          number(optional_[kBlows], state.blows), number(optional_[kImpulse], state.blow_impulse_N_s),
          number(optional_[kEngaged], state.engaged_fraction)})
      if (wrong) return no_value(*wrong, "no number");
    // The log has the size of the force and not its direction, and the sound needs no more.
    state.force_physical_N = {0, 0, force_n};
    state.suction = suction != 0;
    return std::optional(std::move(state));
  }

  std::string file_;
  std::ifstream in_;
  double bytes_ = 0;
  std::uint64_t read_ = 0, number_ = 0, rows_ = 0;
  std::vector<char> buffer_ = std::vector<char>(kLongestLine);
  std::string header_;
  std::string_view line_;  // in the buffer
  std::vector<std::string_view> columns_, fields_;
  std::array<Column, 8> needed_ = {{{"mono_ns"},
                                    {"phase"},
                                    {"tool"},
                                    {"rpm"},
                                    {"feed_mm_per_s"},
                                    {"density_g_cm3"},
                                    {"force_physical_n"},
                                    {"torque_nmm"}}};
  // Logs of other versions may lack these.
  std::array<Column, 8> optional_ = {{{"state_seq"},
                                      {"author"},
                                      {"suction"},
                                      {"cortex_mm"},
                                      {"seated"},
                                      {"blows"},
                                      {"blow_impulse_n_s"},
                                      {"engaged"}}};
  std::array<Column, 3> tip_ = {{{"tip_x_mm"}, {"tip_y_mm"}, {"tip_z_mm"}}},
                        axis_ = {{{"axis_x"}, {"axis_y"}, {"axis_z"}}};
};

}  // namespace

Result<std::unique_ptr<StateRecord>> open_session_log(const std::filesystem::path& file) {
  auto log = std::make_unique<LogStates>(file);
  if (auto opened = log->open(); !opened) return tl::unexpected(opened.error());
  return log;
}

}  // namespace osteon::audio
