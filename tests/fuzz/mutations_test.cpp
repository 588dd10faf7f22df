// Every target on seeded mutations of its valid inputs; OSTEON_FUZZ_RUNS in the environment asks for more of them, in all of a
// target's seeds together, and OSTEON_FUZZ_TARGET for one target alone.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {
namespace {

Bytes mutated(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  for (std::size_t i = 0, count = 1 + below(4); i < count; ++i) {
    if (bytes.empty()) bytes.push_back(0);
    switch (below(5)) {
      case 0: bytes[below(bytes.size())] ^= static_cast<std::uint8_t>(1u << below(8)); break;
      case 1: bytes[below(bytes.size())] = static_cast<std::uint8_t>(below(256)); break;
      case 2: bytes.resize(below(bytes.size() + 1)); break;
      case 3: bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() + 1)), static_cast<std::uint8_t>(below(256))); break;
      default: bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size()))); break;
    }
  }
  return bytes;
}

TEST(Fuzz, TargetsStandMutatedInputs) {
  const char *asked = std::getenv("OSTEON_FUZZ_RUNS"), *only = std::getenv("OSTEON_FUZZ_TARGET");
  bool any = false;
  for (const Target& target : targets()) {
    if (only && target.name != only) continue;
    any = true;
    SCOPED_TRACE(target.name);
    std::mt19937 random(1);
    const auto seeds = static_cast<long>(target.seeds.size());
    const long runs = asked ? (std::atol(asked) + seeds - 1) / seeds : target.mutations;
    for (const Bytes& seed : target.seeds) {
      target.run(seed);
      for (long i = 0; i < runs; ++i) {
        Bytes input = seed;
        // A few changes of form on top of each other, or changes of bytes.
        if (target.change && random() % 4) {
          for (std::size_t changes = 1 + random() % 6; changes > 0; --changes) target.change(input, random);
        } else {
          input = mutated(std::move(input), random);
        }
        target.run(input);
      }
    }
  }
  EXPECT_TRUE(any) << "there is no such target";
}

TEST(Fuzz, TargetsStandNoiseAndNothing) {
  std::mt19937 random(2);
  for (const Target& target : targets()) {
    target.run({});
    for (int i = 0; i < 500; ++i) {
      Bytes noise(random() % 2000);
      for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
      target.run(noise);
    }
  }
}

}  // namespace
}  // namespace osteon::fuzz
