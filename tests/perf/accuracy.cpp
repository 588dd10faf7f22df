// Measures the accuracy of cuts: volume and surface of a sphere, a drilled hole and a saw's kerf against their closed
// forms, at falling pitches and many random positions on the lattice. Takes the number of trials and prints JSON.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include "tests/support/scenes/known_cuts.hpp"

namespace osteon::test {
namespace {

constexpr double kPitches_mm[] = {0.5, 0.25, 0.125, 0.0625};

double quantile(std::vector<double> values, double part) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

using Make = std::function<KnownCut(double pitch_mm, Random& random)>;

void measure(const char* name, const std::string& tool, int trials, const Make& make, bool last) {
  std::printf("\"%s\": {\"tool\": \"%s\", \"pitches\": [", name, tool.c_str());
  for (const double pitch : kPitches_mm) {
    // Every pitch has its own positions: equal positions would not be equal on another lattice.
    Random random(static_cast<std::uint64_t>(1e4 * pitch));
    std::vector<double> errors, deviations;
    double sum = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      const CutAccuracy accuracy = accuracy_of(make(pitch, random));
      errors.push_back(100.0 * std::abs(accuracy.volume_error));
      sum += 100.0 * accuracy.volume_error;
      deviations.insert(deviations.end(), accuracy.deviation_pitches.begin(), accuracy.deviation_pitches.end());
    }
    std::printf(
        "%s{\"pitch_mm\": %g, \"error_percent_mean\": %.6f, \"error_percent_p50\": %.6f, \"error_percent_min\": %.6f, "
        "\"error_percent_max\": %.6f, \"vertices\": %zu, \"deviation_pitches_p50\": %.6f, "
        "\"deviation_pitches_p99\": %.6f, \"deviation_pitches_max\": %.6f}",
        pitch == kPitches_mm[0] ? "" : ", ", pitch, sum / trials, quantile(errors, 0.5), quantile(errors, 0.0),
        quantile(errors, 1.0), deviations.size(), quantile(deviations, 0.5), quantile(deviations, 0.99),
        quantile(deviations, 1.0));
    std::fprintf(stderr, "%s at %g mm\n", name, pitch);
  }
  std::printf("]}%s\n", last ? "" : ",");
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  using namespace osteon;
  using namespace osteon::test;
  const int trials = argc > 1 ? std::atoi(argv[1]) : 0;
  if (trials < 1 || trials > 10000) {
    std::fprintf(stderr, "osteon-accuracy: needs the number of trials, 1 to 10000\n");
    return 1;
  }
  std::printf("{\"trials\": %d,\n", trials);
  const auto burr = nearest_tool(ToolKind::round_burr, 3.2), drill = nearest_tool(ToolKind::drill, 3.2),
             saw = widest_saw();
  if (burr)
    measure(
        "sphere", burr->name, trials, [&](double p, Random& r) { return sphere_in_bone(*burr, p, r); }, false);
  if (drill)
    measure(
        "hole", drill->name, trials, [&](double p, Random& r) { return hole_through_slab(*drill, p, r); }, !saw);
  if (saw)
    measure(
        "kerf", saw->name, trials, [&](double p, Random& r) { return kerf_through_shaft(*saw, p, r); }, true);
  std::printf("}\n");
}
