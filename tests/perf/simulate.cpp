// Simulates rooms, one seed after the other: osteon-simulate --seeds 1..1000 [--full] [--soak] [--verbose] [--break WHAT]
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/runtime/log.hpp"
#include "tests/simulation/simulate.hpp"

namespace {

using osteon::test::Breakage;

constexpr const char* kUsage =
    "usage: osteon-simulate [--seeds FIRST..LAST] [--full] [--soak] [--verbose]\n"
    "                       [--break dedup|ordering|skipping|replica|forgetful]\n";

bool parse(std::string_view text, std::uint64_t& first, std::uint64_t& last) {
  const std::size_t dots = text.find("..");
  const std::string_view from = text.substr(0, dots), to = dots == std::string_view::npos ? from : text.substr(dots + 2);
  const auto number = [](std::string_view digits, std::uint64_t& value) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc{} && end == digits.data() + digits.size();
  };
  return number(from, first) && number(to, last) && first <= last;
}

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(p * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string_view, Breakage> breakages{{"dedup", Breakage::dedup},
                                                       {"ordering", Breakage::ordering},
                                                       {"skipping", Breakage::skipping},
                                                       {"replica", Breakage::replica},
                                                       {"forgetful", Breakage::forgetful}};
  std::uint64_t first = 1, last = 300;
  osteon::test::SimulationOptions options;
  bool verbose = false, given = false, soak = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--full") options.full = true;
    else if (word == "--soak") soak = true;
    else if (word == "--verbose") verbose = true;
    else if (word == "--seeds" && i + 1 < argc && parse(argv[i + 1], first, last)) given = true, ++i;
    else if (word == "--break" && i + 1 < argc && breakages.contains(argv[i + 1])) options.breakage = breakages.at(argv[++i]);
    else return std::fputs(kUsage, stderr), 2;
  }
  if (soak && !given) last = options.full ? 300 : 100'000;

  osteon::log::open("osteon-simulate");
  // What rooms and journals log of the trouble that they are given is no news.
  std::FILE* out = verbose ? stderr : ::fdopen(::dup(STDERR_FILENO), "w");
  if (!verbose) ::dup2(::open("/dev/null", O_WRONLY), STDERR_FILENO);
  std::setvbuf(out, nullptr, _IOLBF, 0);
  std::uint64_t failed = 0;
  osteon::test::SimulationReport sum;
  std::vector<double> cpu_ms, settled_s;
  std::map<std::string, std::uint64_t> invariants;  // seeds in which they were broken first
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const osteon::test::SimulationReport one = osteon::test::simulate(seed, options);
    sum.cuts += one.cuts, sum.rows += one.rows, sum.committed += one.committed, sum.rejected += one.rejected;
    sum.undone += one.undone, sum.splits += one.splits, sum.acknowledged += one.acknowledged, sum.crashes += one.crashes;
    sum.disk_failures += one.disk_failures, sum.breaks += one.breaks, sum.resumed += one.resumed, sum.programs += one.programs;
    sum.virtual_s += one.virtual_s;
    cpu_ms.push_back(one.cpu_ms);
    settled_s.push_back(one.settled_s);
    if (verbose)
      std::fprintf(out, "seed %llu: %llu cuts, %llu rows, %llu crashes, %llu breaks, settled in %.2f s, %.1f ms\n",
                   static_cast<unsigned long long>(seed), static_cast<unsigned long long>(one.cuts),
                   static_cast<unsigned long long>(one.rows), static_cast<unsigned long long>(one.crashes),
                   static_cast<unsigned long long>(one.breaks), one.settled_s, one.cpu_ms);
    if (one.faults.empty()) continue;
    ++failed;
    ++invariants[std::string(name(one.faults.front().invariant))];
    std::fprintf(out, "seed %llu: %s: %s\n  again: osteon-simulate --seeds %llu..%llu%s\n", static_cast<unsigned long long>(seed),
                 std::string(name(one.faults.front().invariant)).c_str(), one.faults.front().sentence.c_str(),
                 static_cast<unsigned long long>(seed), static_cast<unsigned long long>(seed), options.full ? " --full" : "");
    if (verbose)
      for (const osteon::test::Fault& fault : one.faults)
        std::fprintf(out, "  %s: %s\n", std::string(name(fault.invariant)).c_str(), fault.sentence.c_str());
  }
  const nlohmann::ordered_json summary{
      {"seeds", last - first + 1}, {"failures", failed}, {"broken_invariants", invariants}, {"cuts", sum.cuts},
      {"rows", sum.rows},
      {"commits", sum.committed}, {"rejections", sum.rejected}, {"undos", sum.undone}, {"splits", sum.splits},
      {"acknowledged", sum.acknowledged}, {"crashes", sum.crashes}, {"disk_failures", sum.disk_failures}, {"breaks", sum.breaks},
      {"resumed", sum.resumed}, {"programs", sum.programs}, {"virtual_s", sum.virtual_s},
      {"settled_s", {{"p50", percentile(settled_s, 0.5)}, {"p99", percentile(settled_s, 0.99)},
                     {"max", percentile(settled_s, 1)}}},
      {"cpu_ms", {{"p50", percentile(cpu_ms, 0.5)}, {"p99", percentile(cpu_ms, 0.99)}, {"max", percentile(cpu_ms, 1)}}}};
  std::printf("%s\n", summary.dump(2).c_str());
  return failed == 0 ? 0 : 1;
}
