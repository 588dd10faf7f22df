// osteon-fuzz --target=NAME [--seeds=FOLDER] [OPTIONS OF LIBFUZZER] [FOLDER...]
// Runs one target under libFuzzer, which searches for inputs that reach new code. --seeds first writes the target's own
// seeds into that folder.
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <random>
#include <string>
#include <string_view>

#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {
namespace {

const Target* chosen = nullptr;
constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();
std::atomic<std::size_t> most_bytes_at_once = kNoLimit;  // between two inputs libFuzzer itself allocates more

[[noreturn]] void usage(const std::vector<Target>& all) {
  std::fprintf(stderr, "osteon-fuzz --target=NAME [--seeds=FOLDER] [OPTIONS OF LIBFUZZER] [FOLDER...]; targets:");
  for (const Target& target : all) std::fprintf(stderr, " %s", target.name.c_str());
  std::fprintf(stderr, "\n");
  std::exit(2);
}

void write_seeds(const Target& target, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < target.seeds.size(); ++i) {
    std::ofstream file(folder / ("seed-" + target.name + "-" + std::to_string(i)), std::ios::binary);
    for (const std::uint8_t byte : target.seeds[i]) file.put(static_cast<char>(byte));
  }
}

// libFuzzer ignores options that begin with two dashes.
void choose(std::span<char*> arguments) {
  static const std::vector<Target> all = targets();
  constexpr std::string_view kTarget = "--target=", kSeeds = "--seeds=";
  std::filesystem::path folder;
  for (const std::string_view argument : arguments) {
    if (argument.starts_with(kTarget)) {
      const auto found = std::ranges::find(all, argument.substr(kTarget.size()), &Target::name);
      chosen = found == all.end() ? nullptr : &*found;
    }
    if (argument.starts_with(kSeeds)) folder = argument.substr(kSeeds.size());
  }
  if (chosen == nullptr) usage(all);
  if (!folder.empty()) write_seeds(*chosen, folder);
}

}  // namespace
}  // namespace osteon::fuzz

// GDCM and OpenVDB allocate what a damaged file claims. The import reads files in a child process with a memory limit,
// where std::bad_alloc is handled as a damaged file.
// The address sanitizer allows no such limit, so the limit is here.
void* operator new(std::size_t bytes) {
  const bool too_many = bytes > osteon::fuzz::most_bytes_at_once;
  void* memory = too_many ? nullptr : std::malloc(std::max<std::size_t>(bytes, 1));
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void* operator new[](std::size_t bytes) { return operator new(bytes); }
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(std::max<std::size_t>(bytes, 1));
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(std::max<std::size_t>(bytes, 1));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

extern "C" {
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

int LLVMFuzzerInitialize(int* argc, char*** argv) {
  osteon::fuzz::choose({*argv, static_cast<std::size_t>(*argc)});
  return 0;
}
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const osteon::fuzz::Target& target = *osteon::fuzz::chosen;
  osteon::fuzz::most_bytes_at_once = target.most_bytes_at_once;
  target.run({data, size});
  // Calls overlap with those of the next inputs: some are answered after seconds.
  static int begun = 0;
  constexpr int kSettleEvery = 4096;
  if (target.settle && ++begun % kSettleEvery == 0) target.settle();
  osteon::fuzz::most_bytes_at_once = osteon::fuzz::kNoLimit;
  return 0;
}
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  const osteon::fuzz::Target& target = *osteon::fuzz::chosen;
  if (!target.change) return LLVMFuzzerMutate(data, size, most);
  static std::mt19937 random(seed);  // seeding takes longer than some targets
  if (random() % 2 == 0) return LLVMFuzzerMutate(data, size, most);
  osteon::fuzz::Bytes input(data, data + size);
  target.change(input, random);
  if (input.size() > most) return LLVMFuzzerMutate(data, size, most);
  std::ranges::copy(input, data);
  return input.size();
}
}
