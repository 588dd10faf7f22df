// A recording: HDF5 with a row for each millisecond.
#include <algorithm>
#include <vector>

#include "audio_client/offline/state_sources.hpp"
#include "common/recording/recording_reader.hpp"

namespace osteon::audio {
namespace {

constexpr std::size_t kRowsAtOnce = 8192;

// Columns that sound needs, of some rows.
struct Rows {
  std::vector<std::int64_t> mono_ns;
  std::vector<std::uint64_t> state_seq;
  std::vector<float> rpm, feed, density, engaged, torque, wrench;
  std::vector<std::uint8_t> phase, tool;
  std::vector<std::uint32_t> buttons;
  std::vector<double> pose, cortex, seated, impulse;
  std::vector<std::uint32_t> blows;
};

class RecordingStates final : public StateRecord {
 public:
  explicit RecordingStates(const std::filesystem::path& file) : reader_(file) {}

  Result<void> open() {
    if (!reader_.open()) return tl::unexpected(reader_.error());
    count_ = reader_.rows();
    tools_ = reader_.texts(recording::kTools);
    author_ = reader_.number(recording::kMetadata, recording::kAuthor);
    if (reader_.ok() && !(author_ >= 0 && author_ < 9e15)) reader_.damaged(recording::kAuthor);
    if (reader_.ok() && count_ == 0)
      reader_.wrong(ErrorCode::invalid_input, reader_.name() + " holds no complete row; its session ended too soon");
    if (!reader_.ok()) return tl::unexpected(reader_.error());
    return {};
  }

  double done() const override { return static_cast<double>(next_) / static_cast<double>(count_); }
  std::string name() const override { return reader_.name(); }

 protected:
  Result<std::optional<CuttingState>> read() override {
    if (next_ == count_) return std::optional<CuttingState>();
    if (next_ == first_ + rows_.mono_ns.size()) {
      if (!fetch()) return tl::unexpected(reader_.error());
    }
    const std::size_t i = next_ - first_;
    ++next_;
    if (rows_.phase[i] < 1 || rows_.phase[i] > 4) return bad_input(place(recording::kState) + kDamage);
    if (rows_.tool[i] >= std::max<std::size_t>(1, tools_.size()))
      return bad_input(place(recording::kTool) + "is " + std::to_string(rows_.tool[i]) + ", and metadata/tools names " +
                       std::to_string(tools_.size()) + kAgain);
    return std::optional(state_of(i));
  }

  std::string place(const char* field) const override {
    return reader_.name() + ": row " + std::to_string(next_ - 1) + ": " + field + " ";
  }

 private:
  static constexpr const char* kAgain = "; the file is damaged, so record the session again";
  static constexpr const char* kDamage =
      "is none of idle, free, cutting and rubbing; the file is damaged, so record the session again";
  static constexpr std::uint32_t kSuctionBit = 8;  // of kButtons, as its meaning in the file says

  bool fetch() {
    first_ = next_;
    const std::size_t n = std::min(kRowsAtOnce, count_ - first_);
    const auto get = [&]<class T>(std::vector<T>& into, const char* path, std::size_t width = 1) {
      into = reader_.values<T>(path, n, width, first_);
    };
    // Recordings of older programs lack these.
    const auto get_if_there = [&]<class T>(std::vector<T>& into, const char* path) {
      if (reader_.has_dataset(path))
        get(into, path);
      else
        into.assign(n, T{});
    };
    get(rows_.mono_ns, recording::kMonoNs);
    get(rows_.state_seq, recording::kTick);
    get(rows_.rpm, recording::kSpindleRpm);
    get(rows_.feed, recording::kFeed);
    get(rows_.density, recording::kDensity);
    get(rows_.engaged, recording::kEngaged);
    get(rows_.torque, recording::kTorque);
    get(rows_.wrench, recording::kWrench, 6);
    get(rows_.phase, recording::kState);
    get(rows_.tool, recording::kTool);
    get(rows_.buttons, recording::kButtons);
    get(rows_.pose, recording::kToolPose, 7);
    get_if_there(rows_.cortex, recording::kCortex);
    get_if_there(rows_.seated, recording::kSeated);
    get_if_there(rows_.blows, recording::kBlows);
    get_if_there(rows_.impulse, recording::kBlowImpulse);
    return reader_.ok();
  }

  [[nodiscard]] CuttingState state_of(std::size_t i) const {
    CuttingState state;
    state.author.value = static_cast<std::uint64_t>(author_);
    state.state_seq = rows_.state_seq[i];
    state.time_ns = rows_.mono_ns[i];
    if (!tools_.empty()) state.tool_name = tools_[rows_.tool[i]];
    const double* p = &rows_.pose[7 * i];
    state.pose_bone_tool = {{p[0], p[1], p[2]}, {p[6], p[3], p[4], p[5]}};
    state.spindle_rpm = rows_.rpm[i];
    state.feed_mm_per_s = rows_.feed[i];
    state.density_g_cm3 = rows_.density[i];
    state.engaged_fraction = rows_.engaged[i];
    state.force_physical_N = {rows_.wrench[6 * i], rows_.wrench[6 * i + 1], rows_.wrench[6 * i + 2]};
    state.torque_Nmm = rows_.torque[i];
    state.phase = static_cast<CuttingPhase>(rows_.phase[i]);
    state.suction = (rows_.buttons[i] & kSuctionBit) != 0;
    state.cortex_mm = rows_.cortex[i];
    state.seated = rows_.seated[i];
    state.blows = rows_.blows[i];
    state.blow_impulse_N_s = rows_.impulse[i];
    return state;
  }

  RecordingReader reader_;
  std::vector<std::string> tools_;
  double author_ = 0;
  std::size_t count_ = 0, first_ = 0, next_ = 0;
  Rows rows_;
};

}  // namespace

Result<std::unique_ptr<StateRecord>> open_recording(const std::filesystem::path& file) {
  auto states = std::make_unique<RecordingStates>(file);
  if (auto opened = states->open(); !opened) return tl::unexpected(opened.error());
  return states;
}

}  // namespace osteon::audio
