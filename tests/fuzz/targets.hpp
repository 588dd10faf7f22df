// What untrusted bytes can reach. Each target takes any bytes and must neither crash nor break a promise; sanitizers
// see the rest. Run by libFuzzer (osteon-fuzz, of the preset fuzz) and, in every test run, on seeded mutations.
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
  std::vector<Bytes> seeds;  // valid inputs, to mutate
  long mutations = 2000;     // of each seed in a test run
  // Changes an input as only who knows its form can; none: bytes are changed.
  std::function<void(Bytes&, std::mt19937&)> change = nullptr;
  // Waits for what run() has only begun; none: it has done all when it returns.
  std::function<void()> settle = nullptr;
  // Of how many rounds through the seeds one has this seed, where millions of inputs are asked for: more than 1 where
  // it costs as much as many others, or tells less. None: every round has all.
  std::function<long(const Bytes& seed)> rounds = nullptr;
  // What one allocation may take under libFuzzer: more of it throws std::bad_alloc.
  std::size_t most_bytes_at_once = std::size_t{256} << 20;
  // A line for whoever looks on: what was run how often.
  std::function<std::string()> figures = nullptr;
};

[[nodiscard]] std::vector<Target> targets();

}  // namespace osteon::fuzz
