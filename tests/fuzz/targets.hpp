// Fuzz targets for everything that untrusted bytes can reach. A target takes any bytes. It must not crash or break a
// promise.
// Sanitizers find other errors. libFuzzer runs the targets (osteon-fuzz, preset `fuzz`). Every test run gives them
// seeded mutations.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace osteon::fuzz {

using Bytes = std::vector<std::uint8_t>;

struct Target {
  std::string name;
  std::function<void(std::span<const std::uint8_t>)> run;
  std::vector<Bytes> seeds;  // valid inputs to mutate
  long mutations = 2000;     // number for each seed in a test run
  // Changes an input with knowledge of its format. If empty, bytes are changed.
  std::function<void(Bytes&, std::mt19937&)> change = nullptr;
  // Waits for work that run() has only started. If empty, run() has done all its work when it returns.
  std::function<void()> settle = nullptr;
  // For runs of millions of inputs: this seed is used in one of so many rounds through the seeds.
  // More than 1 for a seed that is as expensive as many others, or that finds less. If empty, every round uses all
  // seeds.
  std::function<long(const Bytes& seed)> rounds = nullptr;
  // Largest single allocation under libFuzzer, bytes. A larger one throws std::bad_alloc.
  std::size_t most_bytes_at_once = std::size_t{256} << 20;
  // A line for the reader of the test's output: what was run, and how often.
  std::function<std::string()> figures = nullptr;
};

[[nodiscard]] std::vector<Target> targets();

}  // namespace osteon::fuzz
