// Trains the classifier on the sound of one tool at one speed, and tests it on other drillings, speeds and tools.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "tests/perf/classifier/drilled_layers.hpp"
#include "tests/perf/classifier/sound_features.hpp"

namespace osteon::test {

// Counts of frames: what was true (row), and what the classifier said (column).
using Confusion = std::array<std::array<int, kSoundClasses>, kSoundClasses>;
[[nodiscard]] double accuracy(const Confusion& confusion);     // share of frames
[[nodiscard]] double mean_recall(const Confusion& confusion);  // mean of the classes' shares
void add(Confusion& to, const Confusion& more);

struct TrialResult {
  Confusion confusion{};
  int changes = 0, found = 0;  // from one class to another, and those that were named within 50 ms
};

struct TrialSet {
  std::string name;
  std::vector<Drilling> drillings;
};

// Drillings of `drill-3.2` at 1000 rpm to train on; others of it, other speeds, and tools that no training heard.
[[nodiscard]] TrialSet training_set(int drillings);
[[nodiscard]] std::vector<TrialSet> test_sets(int drillings);

// A drilling, its rendered sound, and what is true of each frame.
struct Sounding {
  std::vector<float> samples;
  std::vector<int> classes;     // of each frame of features()
  double from_s = 0, to_s = 0;  // in which the spindle turns
};
[[nodiscard]] Sounding sounding(const Drilling& drilling, std::uint64_t seed);

// One result for each set. Each sound has white noise `snr_db` below it.
[[nodiscard]] std::vector<TrialResult> trial(const std::vector<Sounding>& training,
                                             const std::vector<std::vector<Sounding>>& tests, Hearing hearing,
                                             double snr_db);

}  // namespace osteon::test
