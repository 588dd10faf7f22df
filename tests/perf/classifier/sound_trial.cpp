#include "tests/perf/classifier/sound_trial.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "audio_client/offline/offline_sound.hpp"
#include "common/core/check.hpp"
#include "common/sound/random.hpp"
#include "common/tools/tool.hpp"
#include "tests/perf/classifier/gaussian_hmm.hpp"

namespace osteon::test {
namespace {

constexpr double kUsualRpm = 1000;
constexpr double kUsualDiameter_mm = 3.2;
constexpr int kNear = static_cast<int>(0.05 / kFrameStep_s + 0.5);  // frames
constexpr int kHearings = 5;
constexpr double kMostFaster = 0.15;
// Seeds of what is trained on and of what is tested never meet.
constexpr std::uint64_t kTestSeeds = 1000, kNoiseSeeds = 1'000'000;

class DrilledRecord final : public audio::StateRecord {
 public:
  explicit DrilledRecord(const std::vector<CuttingState>& states) : states_(states) {}
  double done() const override { return static_cast<double>(next_) / static_cast<double>(states_.size()); }
  std::string name() const override { return "the drilling"; }

 protected:
  Result<std::optional<CuttingState>> read() override {
    if (next_ == states_.size()) return std::optional<CuttingState>();
    return std::optional(states_[next_++]);
  }
  std::string place(const char* field) const override { return std::string("the drilling: ") + field + " "; }

 private:
  const std::vector<CuttingState>& states_;
  std::size_t next_ = 0;
};

LabelledFrames heard(const Sounding& s, Hearing hearing, double snr_db, std::uint64_t seed, double faster = 1.0) {
  LabelledFrames frames;
  frames.rows = features(with_noise(s.samples, s.from_s, s.to_s, snr_db, seed), hearing, faster);
  frames.classes = s.classes;
  return frames;
}

TrialResult compared(const std::vector<int>& truth, const std::vector<int>& named) {
  TrialResult result;
  for (std::size_t i = 0; i < truth.size(); ++i)
    ++result.confusion[static_cast<std::size_t>(truth[i])][static_cast<std::size_t>(named[i])];
  const auto size = static_cast<int>(truth.size());
  for (int i = 1; i < size; ++i) {
    const int now = truth[static_cast<std::size_t>(i)];
    if (now == truth[static_cast<std::size_t>(i) - 1]) continue;
    ++result.changes;
    bool found = false;
    for (int k = std::max(1, i - kNear); k <= std::min(size - 1, i + kNear); ++k)
      found = found || (named[static_cast<std::size_t>(k)] == now && named[static_cast<std::size_t>(k) - 1] != now);
    result.found += found;
  }
  return result;
}

std::vector<Drilling> drillings(const Drilling& usual, int count, std::uint64_t first_seed) {
  std::vector<Drilling> all;
  for (int i = 0; i < count; ++i) all.push_back(varied(usual, first_seed + static_cast<std::uint64_t>(i)));
  return all;
}

}  // namespace

double accuracy(const Confusion& confusion) {
  double right = 0, all = 0;
  for (std::size_t i = 0; i < kSoundClasses; ++i)
    for (std::size_t k = 0; k < kSoundClasses; ++k) {
      all += confusion[i][k];
      right += i == k ? confusion[i][k] : 0;
    }
  return all > 0 ? right / all : 0;
}

double mean_recall(const Confusion& confusion) {
  double sum = 0;
  for (std::size_t i = 0; i < kSoundClasses; ++i) {
    double all = 0;
    for (const int count : confusion[i]) all += count;
    sum += all > 0 ? confusion[i][i] / all : 0;
  }
  return sum / kSoundClasses;
}

void add(Confusion& to, const Confusion& more) {
  for (std::size_t i = 0; i < kSoundClasses; ++i)
    for (std::size_t k = 0; k < kSoundClasses; ++k) to[i][k] += more[i][k];
}

TrialSet training_set(int count) {
  Drilling usual;
  usual.rpm = kUsualRpm;
  return {"training", drillings(usual, count, 1)};
}

std::vector<TrialSet> test_sets(int count) {
  Drilling usual;
  usual.rpm = kUsualRpm;
  std::vector<TrialSet> sets = {{"other drillings", drillings(usual, count, kTestSeeds)}};
  std::uint64_t seed = kTestSeeds + 100;
  TrialSet speeds{"speed +- 10 %", {}};
  for (const double factor : {0.9, 0.95, 1.05, 1.1}) {
    Drilling other = usual;
    other.rpm = kUsualRpm * factor;
    const auto some = drillings(other, std::max(1, count / 2), seed += 100);
    speeds.drillings.insert(speeds.drillings.end(), some.begin(), some.end());
  }
  sets.push_back(std::move(speeds));
  for (const Tool& tool : builtin_tools()) {
    if (tool.kind != ToolKind::drill || tool.name == usual.tool) continue;
    Drilling other = usual;
    other.tool = tool.name;
    other.push_n *= tool.diameter_mm / kUsualDiameter_mm;  // a hand leans harder on a thicker drill
    sets.push_back({tool.name, drillings(other, std::max(1, count / 2), seed += 100)});
  }
  return sets;
}

Sounding sounding(const Drilling& drilling, std::uint64_t seed) {
  const DrilledLayers layers = drill(drilling);
  Sounding s;
  DrilledRecord record(layers.states);
  audio::SynthParams params;
  params.seed = seed;
  const auto made = audio::render_states(
      record, params,
      [&](std::span<const float> frames, std::span<const float>) {
        s.samples.insert(s.samples.end(), frames.begin(), frames.end());
        return Result<void>();
      },
      [](double) { return true; });
  OSTEON_CHECK(made.has_value());
  s.samples.resize(layers.truth.size() * static_cast<std::size_t>(params.rate_hz / 1000), 0.0F);
  const Eigen::Index frames = features(s.samples, Hearing::level_only).rows();
  const auto step = static_cast<std::size_t>(std::lround(1000 * kFrameStep_s));
  for (Eigen::Index m = 0; m < frames; ++m) {
    const std::size_t at = std::min(layers.truth.size() - 1, static_cast<std::size_t>(m) * step);
    s.classes.push_back(static_cast<int>(layers.truth[at]));
  }
  const int silent = static_cast<int>(SoundClass::silent);
  const auto turns = [&](int one) { return one != silent; };
  const auto first = std::ranges::find_if(s.classes, turns);
  s.from_s = kFrameStep_s * static_cast<double>(first - s.classes.begin());
  s.to_s =
      kFrameStep_s * static_cast<double>(s.classes.rend() - std::find_if(s.classes.rbegin(), s.classes.rend(), turns));
  return s;
}

std::vector<TrialResult> trial(const std::vector<Sounding>& training, const std::vector<std::vector<Sounding>>& tests,
                               Hearing hearing, double snr_db) {
  std::vector<LabelledFrames> lessons;
  std::uint64_t seed = kNoiseSeeds;
  // The speed of training is one. So that its lines are not taken for the only possible ones, each sound is also heard
  // as if it were slower and faster.
  sound::Random random(seed);
  for (const Sounding& s : training)
    for (int i = 0; i < kHearings; ++i)
      lessons.push_back(heard(s, hearing, snr_db, ++seed, 1.0 + kMostFaster * (2.0 * random.unit() - 1.0)));
  const GaussianHmm model = GaussianHmm::learned(lessons, static_cast<int>(kSoundClasses), {});
  std::vector<TrialResult> results;
  for (const std::vector<Sounding>& set : tests) {
    TrialResult all;
    for (const Sounding& s : set) {
      const LabelledFrames frames = heard(s, hearing, snr_db, ++seed);
      const TrialResult one = compared(frames.classes, model.named(frames.rows));
      add(all.confusion, one.confusion);
      all.changes += one.changes;
      all.found += one.found;
    }
    results.push_back(all);
  }
  return results;
}

}  // namespace osteon::test
