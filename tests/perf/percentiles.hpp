// Percentiles of measured values, for the programs that print figures.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <vector>

namespace osteon::test {

// 0 if there are no values.
[[nodiscard]] inline double percentile(const std::vector<double>& sorted, double percent) {
  return sorted.empty()
             ? 0.0
             : sorted[static_cast<std::size_t>(0.01 * percent * static_cast<double>(sorted.size() - 1) + 0.5)];
}

[[nodiscard]] inline double rounded(double value) { return std::round(1000.0 * value) / 1000.0; }

[[nodiscard]] inline nlohmann::json spread(std::vector<double> values) {
  std::ranges::sort(values);
  double sum = 0.0;
  for (const double value : values) sum += value;
  return {{"count", values.size()},
          {"mean", rounded(values.empty() ? 0.0 : sum / static_cast<double>(values.size()))},
          {"p50", rounded(percentile(values, 50))},
          {"p99", rounded(percentile(values, 99))},
          {"max", rounded(values.empty() ? 0.0 : values.back())}};
}

}  // namespace osteon::test
