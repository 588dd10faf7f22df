// Simulates rooms, one seed after the other. See osteon-simulate --help.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "common/runtime/log.hpp"
#include "common/runtime/progress.hpp"
#include "common/runtime/stop_signal.hpp"
#include "tests/simulation/simulate.hpp"

namespace {

using osteon::test::Breakage;
using osteon::test::SimulationOptions;
using osteon::test::SimulationReport;

constexpr const char* kUsage =
    "usage: osteon-simulate [--seeds FIRST..LAST] [--full] [--soak] [--verbose] [--break WHAT]\n"
    "Simulates a room for each seed: a server, its clients, their networks and its disk, on virtual time in this "
    "process.\n"
    "  --seeds FIRST..LAST  these; or a single one. 1..300 without it\n"
    "  --full               larger bones that fall apart, and the worst networks\n"
    "  --soak               1..100000 where no seeds are given\n"
    "  --verbose            a line for each seed, all that is wrong with it, and what the room logs\n"
    "  --break WHAT         with a rule broken, to see that seeds fail: dedup, ordering, skipping, replica, "
    "forgetful,\n"
    "                       pruning, unsaid, hasty\n"
    "The figures of all seeds go to standard output as JSON; all else to standard error, with the command that runs a "
    "seed\n"
    "that fails again. Status 0: no seed failed, 1: some did, 130: stopped with Ctrl-C, after the seed at hand.\n";

const std::map<std::string_view, Breakage> kBreakages{
    {"dedup", Breakage::dedup},     {"ordering", Breakage::ordering},   {"skipping", Breakage::skipping},
    {"replica", Breakage::replica}, {"forgetful", Breakage::forgetful}, {"pruning", Breakage::pruning},
    {"unsaid", Breakage::unsaid},   {"hasty", Breakage::hasty}};

struct Arguments {
  std::uint64_t first = 1, last = 300;
  SimulationOptions options;
  std::string_view broken;
  bool verbose = false;
};

bool parse_seeds(std::string_view text, Arguments& arguments) {
  const std::size_t dots = text.find("..");
  const std::string_view from = text.substr(0, dots),
                         to = dots == std::string_view::npos ? from : text.substr(dots + 2);
  const auto number = [](std::string_view digits, std::uint64_t& value) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return error == std::errc{} && end == digits.data() + digits.size();
  };
  return number(from, arguments.first) && number(to, arguments.last) && arguments.first <= arguments.last;
}

bool parse(int argc, char** argv, Arguments& arguments) {
  bool given = false, soak = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i], next = i + 1 < argc ? argv[i + 1] : "";
    if (word == "--full")
      arguments.options.full = true;
    else if (word == "--soak")
      soak = true;
    else if (word == "--verbose")
      arguments.verbose = true;
    else if (word == "--seeds" && parse_seeds(next, arguments))
      given = true, ++i;
    else if (word == "--break" && kBreakages.contains(next))
      arguments.broken = next, ++i;
    else
      return false;
  }
  if (!arguments.broken.empty()) arguments.options.breakage = kBreakages.at(arguments.broken);
  if (soak && !given) arguments.last = 100'000;
  return true;
}

// The command that runs only this seed.
std::string again(const Arguments& arguments, std::uint64_t seed) {
  std::string command = "osteon-simulate --verbose --seeds " + std::to_string(seed);
  if (arguments.options.full) command += " --full";
  if (!arguments.broken.empty()) command += " --break " + std::string(arguments.broken);
  return command;
}

// If a promise is broken during a seed, this line names the seed.
std::array<char, 256> abort_line{};
int real_stderr = STDERR_FILENO;
void say_which(int) { (void)!::write(real_stderr, abort_line.data(), std::strlen(abort_line.data())); }

// Suppresses the logs of rooms and journals: their faults are intended.
class Silence {
 public:
  explicit Silence(bool on) {
    static const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (on) ::dup2(nowhere, STDERR_FILENO);
  }
  ~Silence() { ::dup2(real_stderr, STDERR_FILENO); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
};

template <class Number>
nlohmann::ordered_json percentiles(std::vector<Number> values) {
  std::ranges::sort(values);
  const auto at = [&](double p) {
    if (values.empty()) return 0.0;
    return static_cast<double>(values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))]);
  };
  return {{"p50", at(0.5)}, {"p99", at(0.99)}, {"max", at(1)}};
}

class Sum {
 public:
  void add(const SimulationReport& one) {
    ++seeds_;
    fast_path_ += one.fast_path ? 1 : 0;
    cuts_ += one.cuts, entries_ += one.entries, committed_ += one.committed, rejected_ += one.rejected;
    decisions_ += one.decisions, forbidden_ += one.forbidden;
    undone_ += one.undone, splits_ += one.splits, acknowledged_ += one.acknowledged, crashes_ += one.crashes;
    disk_failures_ += one.disk_failures, breaks_ += one.breaks, resumed_ += one.resumed, programs_ += one.programs;
    datagrams_.sent += one.datagrams.sent, datagrams_.opened += one.datagrams.opened,
        datagrams_.forged += one.datagrams.forged;
    datagrams_.entries += one.datagrams.entries, datagrams_.cuts += one.datagrams.cuts,
        datagrams_.moves += one.datagrams.moves;
    virtual_s_ += one.virtual_s;
    cpu_ms_.push_back(one.cpu_ms);
    settled_s_.push_back(one.settled_s);
    back_s_.push_back(one.back_s);
    std::ranges::copy(one.felt_by_datagram_ms, std::back_inserter(felt_by_datagram_ms_));
    std::ranges::copy(one.felt_by_stream_ms, std::back_inserter(felt_by_stream_ms_));
    if (one.faults.empty()) return;
    ++failures_;
    ++broken_[std::string(name(one.faults.front().invariant))];
  }
  [[nodiscard]] std::uint64_t seeds() const { return seeds_; }
  [[nodiscard]] std::uint64_t failures() const { return failures_; }
  [[nodiscard]] nlohmann::ordered_json json() const {
    return {{"seeds", seeds_},
            {"failures", failures_},
            {"broken_invariants", broken_},
            {"fast_path_seeds", fast_path_},
            {"cuts", cuts_},
            {"entries", entries_},
            {"commits", committed_},
            {"rejections", rejected_},
            {"undos", undone_},
            {"decisions", decisions_},
            {"forbidden", forbidden_},
            {"splits", splits_},
            {"acknowledged", acknowledged_},
            {"crashes", crashes_},
            {"disk_failures", disk_failures_},
            {"breaks", breaks_},
            {"resumed", resumed_},
            {"programs", programs_},
            {"datagrams",
             {{"sent", datagrams_.sent},
              {"opened", datagrams_.opened},
              {"forged", datagrams_.forged},
              {"cuts", datagrams_.cuts},
              {"entries", datagrams_.entries},
              {"moves", datagrams_.moves}}},
            {"virtual_s", virtual_s_},
            {"back_s", percentiles(back_s_)},
            {"settled_s", percentiles(settled_s_)},
            // During all faults: partitions, crashes and a slow disk too.
            {"felt_ms",
             {{"by_datagram", percentiles(felt_by_datagram_ms_)}, {"by_stream", percentiles(felt_by_stream_ms_)}}},
            {"cpu_ms", percentiles(cpu_ms_)}};
  }

 private:
  std::uint64_t seeds_ = 0, failures_ = 0, fast_path_ = 0, cuts_ = 0, entries_ = 0, committed_ = 0, rejected_ = 0,
                undone_ = 0, decisions_ = 0, forbidden_ = 0, splits_ = 0, acknowledged_ = 0, crashes_ = 0,
                disk_failures_ = 0, breaks_ = 0, resumed_ = 0, programs_ = 0;
  osteon::test::DatagramCounts datagrams_;
  double virtual_s_ = 0;
  std::vector<double> cpu_ms_, settled_s_, back_s_;
  std::vector<float> felt_by_datagram_ms_, felt_by_stream_ms_;
  std::map<std::string, std::uint64_t> broken_;  // seeds in which this was broken first
};

void say(const SimulationReport& one, const Arguments& arguments) {
  if (arguments.verbose)
    std::fprintf(
        stderr,
        "seed %llu: %s, %llu cuts, %llu entries, %llu crashes, %llu breaks; back after %.2f s, settled in %.2f s; "
        "%.1f ms\n",
        static_cast<unsigned long long>(one.seed), one.fast_path ? "datagrams" : "streams",
        static_cast<unsigned long long>(one.cuts), static_cast<unsigned long long>(one.entries),
        static_cast<unsigned long long>(one.crashes), static_cast<unsigned long long>(one.breaks), one.back_s,
        one.settled_s, one.cpu_ms);
  const std::size_t count = std::min<std::size_t>(one.faults.size(), arguments.verbose ? 20 : 1);
  for (std::size_t i = 0; i < count; ++i)
    std::fprintf(stderr, "seed %llu: %s: %s\n", static_cast<unsigned long long>(one.seed),
                 std::string(name(one.faults[i].invariant)).c_str(), one.faults[i].sentence.c_str());
  if (!one.faults.empty()) std::fprintf(stderr, "  again: %s\n", again(arguments, one.seed).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == "--help") return std::fputs(kUsage, stdout), 0;
  Arguments arguments;
  if (!parse(argc, argv, arguments)) return std::fputs(kUsage, stderr), 2;

  const osteon::StopSignal stop;
  osteon::log::open("osteon-simulate");
  real_stderr = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  std::signal(SIGABRT, say_which);
  Sum sum;
  const std::uint64_t seeds = arguments.last - arguments.first + 1;
  {
    osteon::Progress progress("rooms simulated");
    for (std::uint64_t seed = arguments.first; seed <= arguments.last && !stop.requested(); ++seed) {
      std::snprintf(abort_line.data(), abort_line.size(), "seed %llu: a promise is broken\n  again: %s\n",
                    static_cast<unsigned long long>(seed), again(arguments, seed).c_str());
      const SimulationReport one = [&] {
        const Silence silence(!arguments.verbose);
        return osteon::test::simulate(seed, arguments.options);
      }();
      say(one, arguments);
      sum.add(one);
      progress.update(static_cast<double>(sum.seeds()) / static_cast<double>(seeds));
    }
  }
  if (sum.seeds() < seeds)
    std::fprintf(stderr, "stopped; go on with --seeds %llu..%llu\n",
                 static_cast<unsigned long long>(arguments.first + sum.seeds()),
                 static_cast<unsigned long long>(arguments.last));
  std::printf("%s\n", sum.json().dump(2).c_str());
  return sum.seeds() < seeds ? 130 : sum.failures() == 0 ? 0 : 1;
}
