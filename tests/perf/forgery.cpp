// Sends forged, flipped, cut, extended and replayed datagrams to the class with which a server opens them
// (wire::ServerLink). Counts how many it accepts, and how many bytes it answers. Takes their number (10 million if none
// is given) and prints JSON.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <numeric>

#include "tests/unit/wire/forgery.hpp"

int main(int argc, char** argv) {
  const long long asked = argc > 1 ? std::atoll(argv[1]) : 10'000'000;
  if (asked < 1) {
    std::fprintf(stderr, "osteon-forgery: needs the number of datagrams, at least 1\n");
    return 1;
  }
  using Clock = std::chrono::steady_clock;
  const auto begun = Clock::now();
  const osteon::test::ForgeryReport report = osteon::test::forge(static_cast<std::uint64_t>(asked), 1);
  const double seconds = std::chrono::duration<double>(Clock::now() - begun).count();
  const auto number = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };

  const std::uint64_t forged = std::accumulate(report.sent.begin(), report.sent.end(), std::uint64_t{0});
  std::printf("{\"forged\": %llu, \"accepted\": %llu, \"answered_bytes\": %llu, ", number(forged),
              number(report.accepted), number(report.answered_bytes));
  for (std::size_t i = 0; i < osteon::test::kForgeries; ++i)
    std::printf("\"%s\": %llu, ", osteon::test::kForgeryNames[i], number(report.sent[i]));
  std::printf(
      "\"refused_as\": {\"unknown_session\": %llu, \"malformed\": %llu, \"replayed\": %llu, \"forged\": %llu}, ",
      number(report.unknown_session), number(report.malformed), number(report.replayed), number(report.forged));
  std::printf("\"genuine\": %llu, \"genuine_accepted\": %llu, \"genuine_answered\": %llu, ", number(report.genuine),
              number(report.genuine_accepted), number(report.genuine_answered));
  std::printf("\"cuts\": %llu, \"cuts_returned\": %llu, ", number(report.cuts), number(report.cuts_returned));
  std::printf("\"moves\": %llu, \"moves_noticed\": %llu, ", number(report.moves), number(report.moves_noticed));
  std::printf("\"generations\": %llu, \"seconds\": %.3f, \"packets_per_s\": %.0f}\n", number(report.generations),
              seconds, static_cast<double>(forged) / seconds);
}
