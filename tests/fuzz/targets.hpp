// What untrusted bytes can reach. Each target takes any bytes and must neither crash nor break a promise; sanitizers see
// the rest. A target is linked to libFuzzer by naming it in LLVMFuzzerTestOneInput, and run here on seeded mutations.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace osteon::fuzz {

using Bytes = std::vector<std::uint8_t>;

struct Target {
  std::string name;
  std::function<void(std::span<const std::uint8_t>)> run;
  std::vector<Bytes> seeds;  // valid inputs, to mutate
};

[[nodiscard]] std::vector<Target> targets();

}  // namespace osteon::fuzz
