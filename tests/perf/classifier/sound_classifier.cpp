// osteon-sound-classifier [--json] [--drillings N]: whether a listener can tell by the rendered sound alone what a
// drill does. Trains on drillings of one tool at one speed, and names the frames of others. Prints the shares that are
// right, and what was taken for what. Beside it, a listener who hears only the level.
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tests/perf/classifier/sound_trial.hpp"

namespace {

using namespace osteon;
using namespace osteon::test;

constexpr double kSnrs_db[] = {20, 6};
struct Listener {
  const char* name;
  Hearing hearing;
};
constexpr Listener kListeners[] = {
    {"spectrum", Hearing::spectrum}, {"equal_rms", Hearing::equal_rms}, {"level_only", Hearing::level_only}};

nlohmann::json result_of(const std::vector<TrialSet>& sets, const std::vector<TrialResult>& results) {
  TrialResult all;
  nlohmann::json by_set;
  for (std::size_t i = 0; i < results.size(); ++i) {
    add(all.confusion, results[i].confusion);
    all.changes += results[i].changes;
    all.found += results[i].found;
    by_set[sets[i].name] = {{"accuracy", accuracy(results[i].confusion)},
                            {"mean_recall", mean_recall(results[i].confusion)},
                            {"transitions", static_cast<double>(results[i].found) / results[i].changes}};
  }
  return {{"accuracy", accuracy(all.confusion)},
          {"mean_recall", mean_recall(all.confusion)},
          {"transitions", static_cast<double>(all.found) / all.changes},
          {"confusion", all.confusion},
          {"sets", by_set}};
}

void print(const std::string& title, const nlohmann::json& result) {
  std::printf("%s: %.1f %% of frames, mean of classes %.1f %%, transitions within 50 ms %.1f %%\n", title.c_str(),
              100 * result["accuracy"].get<double>(), 100 * result["mean_recall"].get<double>(),
              100 * result["transitions"].get<double>());
  std::printf("  %-12s", "is \\ named");
  for (std::size_t k = 0; k < kSoundClasses; ++k) std::printf("%13s", name(static_cast<SoundClass>(k)).data());
  std::printf("\n");
  for (std::size_t i = 0; i < kSoundClasses; ++i) {
    std::printf("  %-12s", name(static_cast<SoundClass>(i)).data());
    for (std::size_t k = 0; k < kSoundClasses; ++k) std::printf("%13d", result["confusion"][i][k].get<int>());
    std::printf("\n");
  }
  for (const auto& [set, numbers] : result["sets"].items())
    std::printf("  %-20s %.1f %% of frames, mean of classes %.1f %%, transitions %.1f %%\n", set.c_str(),
                100 * numbers["accuracy"].get<double>(), 100 * numbers["mean_recall"].get<double>(),
                100 * numbers["transitions"].get<double>());
}

}  // namespace

int main(int argc, char** argv) {
  bool json = false;
  int count = 16;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--json") json = true;
    if (argument == "--drillings" && i + 1 < argc) count = std::atoi(argv[i + 1]);
  }
  if (count < 2 || count > 90) {
    std::fprintf(stderr, "osteon-sound-classifier: --drillings must be from 2 to 90\n");
    return 1;
  }
  std::uint64_t seed = 0;
  const auto soundings = [&](const TrialSet& set) {
    std::vector<Sounding> all;
    for (const Drilling& drilling : set.drillings) all.push_back(sounding(drilling, ++seed));
    return all;
  };
  const std::vector<Sounding> training = soundings(training_set(count));
  const std::vector<TrialSet> sets = test_sets(count / 2);
  std::vector<std::vector<Sounding>> tests;
  for (const TrialSet& set : sets) tests.push_back(soundings(set));
  nlohmann::json all;
  for (const Listener& listener : kListeners)
    for (const double snr_db : kSnrs_db) {
      const std::string title = std::string(listener.name) + "_" + std::to_string(static_cast<int>(snr_db)) + "db";
      all[title] = result_of(sets, trial(training, tests, listener.hearing, snr_db));
      if (!json) print(title, all[title]);
    }
  for (std::size_t i = 0; i < kSoundClasses; ++i) all["classes"].push_back(name(static_cast<SoundClass>(i)));
  if (json) std::printf("%s\n", all.dump().c_str());
  return 0;
}
