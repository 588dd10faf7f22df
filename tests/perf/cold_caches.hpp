// Cold caches for benchmarks.
#pragma once
#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

namespace osteon::test {

// Simulates other work of the process. Reads and writes every line of 96 MiB, three times the largest cache, so that
// code, tools, bone and cut field all come from memory again.
inline void flush_caches() {
  static std::vector<std::uint64_t> memory(std::size_t{12} << 20);
  for (std::size_t i = 0; i < memory.size(); i += 8) memory[i] += i;
  benchmark::ClobberMemory();
}

}  // namespace osteon::test
