// Runs every target on seeded mutations of its valid inputs. Environment variables change this:
// OSTEON_FUZZ_RUNS asks for more inputs, in all seeds of a target together. OSTEON_FUZZ_TARGET selects one target.
// OSTEON_FUZZ_SEED selects other mutations (1 if it is not set). OSTEON_FUZZ_INPUT, in hexadecimal digits, runs only
// that input.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <string_view>

#include "tests/fuzz/targets.hpp"
#include "tests/support/trials.hpp"

namespace osteon::fuzz {
namespace {

Bytes mutated(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  for (std::size_t i = 0, count = 1 + below(4); i < count; ++i) {
    if (bytes.empty()) bytes.push_back(0);
    switch (below(5)) {
      case 0:
        bytes[below(bytes.size())] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 1:
        bytes[below(bytes.size())] = static_cast<std::uint8_t>(below(256));
        break;
      case 2:
        bytes.resize(below(bytes.size() + 1));
        break;
      case 3:
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size() + 1)),
                     static_cast<std::uint8_t>(below(256)));
        break;
      default:
        bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size())));
        break;
    }
  }
  return bytes;
}

Bytes of_hex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(std::string(text.substr(i, 2)), nullptr, 16)));
  return bytes;
}

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

Bytes changed(const Target& target, const Bytes& seed, std::mt19937& random) {
  // Applies a few changes of format on top of each other, or changes bytes.
  if (!target.change || random() % 4 == 0) return mutated(seed, random);
  Bytes input = seed;
  for (std::size_t changes = 1 + random() % 6; changes > 0; --changes) target.change(input, random);
  return input;
}

// Uses the seeds in turn, so that their effects combine. Runs at least `count` inputs and returns how many there were.
long run_asked(const Target& target, long count, std::mt19937& random) {
  const auto has = [&](const Bytes& seed, long round) { return !target.rounds || round % target.rounds(seed) == 0; };
  long done = 0;
  for (long round = 0; done < count; ++round)
    for (const Bytes& seed : target.seeds)
      if (has(seed, round)) {
        target.run(changed(target, seed, random));
        ++done;
      }
  return done;
}

TEST(Fuzz, TargetsStandMutatedInputs) {
  const char *asked = std::getenv("OSTEON_FUZZ_RUNS"), *only = std::getenv("OSTEON_FUZZ_TARGET");
  const char* number = std::getenv("OSTEON_FUZZ_SEED");
  bool any = false;
  for (const Target& target : targets()) {
    if (only && target.name != only) continue;
    any = true;
    SCOPED_TRACE(target.name);
    std::mt19937 random(number ? static_cast<std::uint32_t>(std::atol(number)) : 1u);
    const auto settle = [&] {
      if (target.settle) target.settle();
    };
    if (const char* input = std::getenv("OSTEON_FUZZ_INPUT")) {
      target.run(of_hex(input));
      settle();
      continue;
    }
    for (const Bytes& seed : target.seeds) target.run(seed);
    settle();
    if (!asked) {
      for (long i = 0; i < test::trials(static_cast<unsigned>(target.mutations)); ++i)
        for (const Bytes& seed : target.seeds) target.run(changed(target, seed, random));
      settle();
      continue;
    }
    const long count = std::atol(asked);
    long done = run_asked(target, count / 10, random);
    const double memory_mb = resident_mb();  // by now the memory of the start is allocated
    done += run_asked(target, count - done, random);
    settle();
    std::printf("fuzzed: %s %ld inputs; memory after a tenth of them %.1f MB, at the end %.1f MB\n",
                target.name.c_str(), done, memory_mb, resident_mb());
    if (target.figures) std::printf("fuzzed: %s\n", target.figures().c_str());
  }
  EXPECT_TRUE(any) << "there is no such target";
}

TEST(Fuzz, TargetsStandNoiseAndNothing) {
  std::mt19937 random(2);
  for (const Target& target : targets()) {
    target.run({});
    for (int i = 0; i < static_cast<int>(test::trials(500)); ++i) {
      Bytes noise(random() % 2000);
      for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
      target.run(noise);
    }
    if (target.settle) target.settle();
  }
}

}  // namespace
}  // namespace osteon::fuzz
