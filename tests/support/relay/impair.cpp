// osteon-impair: stands between programs on one machine and impairs their network. See relay.hpp.
#include <CLI/CLI.hpp>

#include <cstdio>

#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/number_option.hpp"
#include "tests/support/relay/relay.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Forwards UDP and TCP and does to them what a bad network does."};
  osteon::test::RelayOptions options;
  osteon::test::PathQuality& quality = options.quality;
  std::string addresses;
  double delay_ms = 0, jitter_ms = 0, kbit = 0;
  app.add_option("--addresses", addresses, "File to write the listening addresses to, one a line")->required();
  app.add_option("--udp", options.udp, "A server's UDP port, ADDRESS:PORT");
  app.add_option("--tcp", options.tcp, "A server's TCP port, ADDRESS:PORT");
  app.add_option("--seed", options.seed, "Of all that is left to chance");
  app.add_option("--loss", quality.loss, "Share of datagrams that are lost")->check(osteon::number_in(0.0, 1.0));
  app.add_option("--reorder", quality.reorder, "Share that later ones overtake")->check(osteon::number_in(0.0, 1.0));
  app.add_option("--duplicate", quality.duplicate, "Share that arrive twice")->check(osteon::number_in(0.0, 1.0));
  app.add_option("--corrupt", quality.corrupt, "Share of datagrams with bits flipped")
      ->check(osteon::number_in(0.0, 1.0));
  app.add_option("--delay-ms", delay_ms, "One way")->check(osteon::number_in(0.0, 1e5));
  app.add_option("--jitter-ms", jitter_ms, "More or less of it")->check(osteon::number_in(0.0, 1e5));
  app.add_option("--kbit", kbit, "Kilobits a second of each direction; 0: no limit")
      ->check(osteon::number_in(0.0, 1e7));
  if (const auto code = osteon::parse_arguments(app, argc, argv)) return *code;
  quality.delay = std::chrono::nanoseconds(static_cast<std::int64_t>(delay_ms * 1e6));
  quality.jitter = std::chrono::nanoseconds(static_cast<std::int64_t>(jitter_ms * 1e6));
  quality.bytes_per_s = kbit * 1000.0 / 8.0;

  const auto relay = osteon::test::Relay::open(options);
  if (!relay) {
    std::fprintf(stderr, "osteon-impair: %s\n", relay.error().message.c_str());
    return 1;
  }
  std::string text;
  for (const std::string& line : (*relay)->addresses()) text += line + "\n";
  if (const auto written = osteon::write_file(addresses, text); !written) {
    std::fprintf(stderr, "osteon-impair: %s\n", written.error().message.c_str());
    return 1;
  }
  (*relay)->run();
  return 0;
}
