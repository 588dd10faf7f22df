// Both ends of the fast path, joined without a network. A test reads, changes or loses what each sends.
#pragma once
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "common/wire/client_link.hpp"
#include "common/wire/server_link.hpp"
#include "tests/support/network/sim_network.hpp"
#include "tests/unit/wire/link_trial.hpp"

namespace osteon::test {

struct LinkPair {
  explicit LinkPair(const wire::LinkOptions& up = {}, const wire::LinkOptions& down = wire::server_link_options())
      : client(keys, 1, 1, up),
        server(keys, {7}, seeded(2), 1, 1, down),
        reads_up(3, keys.up),
        reads_down(3, keys.down) {}

  // Runs both ends for this time. What they send arrives at once, unless `lost` drops it.
  void run(Time span) {
    DatagramBuffer buffer, plain;
    for (const Time until = now + span; now < until; now += 1ms) {
      for (auto bytes = client.send(now, buffer); !bytes.empty(); bytes = client.send(now, buffer)) {
        const auto opened = reads_up.open(bytes, now, plain);
        ASSERT_TRUE(opened);
        v1::UpPacket packet;
        ASSERT_TRUE(packet.ParseFromArray(opened->plain.data(), static_cast<int>(opened->plain.size())));
        ups.push_back(packet);
        if (!lost || !lost(packet)) server.receive(node(2), bytes, now);
      }
      while (const auto out = server.send(now, buffer)) {
        const auto opened = reads_down.open(out->bytes, now, plain);
        ASSERT_TRUE(opened);
        v1::DownPacket packet;
        ASSERT_TRUE(packet.ParseFromArray(opened->plain.data(), static_cast<int>(opened->plain.size())));
        downs.push_back(packet);
        if (!lost_down || !lost_down(packet)) client.receive(out->bytes, now);
      }
    }
  }
  Cut cut(std::uint64_t number, std::size_t knots = 1) const {
    Cut cut;
    cut.author = {7};
    cut.author_seq = number;
    cut.path.resize(1 + knots);
    for (std::size_t k = 0; k < cut.path.size(); ++k)
      cut.path[k].position[0] = static_cast<std::int32_t>(10 * (number + k));
    return cut;
  }
  // Sends a packet that no correct client makes.
  void forge(const v1::UpPacket& packet) {
    DatagramBuffer buffer;
    const std::string plain = packet.SerializeAsString();
    server.receive(
        node(2), forger_up.seal({reinterpret_cast<const std::uint8_t*>(plain.data()), plain.size()}, now, buffer), now);
  }
  void forge(const v1::DownPacket& packet) {
    DatagramBuffer buffer;
    const std::string plain = packet.SerializeAsString();
    client.receive(forger_down.seal({reinterpret_cast<const std::uint8_t*>(plain.data()), plain.size()}, now, buffer),
                   now);
  }

  SessionKeys keys = make_session_keys(3, seeded(1));
  wire::ClientLink client;
  wire::ServerLink server;
  Opener reads_up, reads_down;
  Sealer forger_up{3, keys.up, {.first_counter = 100'000}}, forger_down{3, keys.down, {.first_counter = 100'000}};
  Time now = 1s;
  std::vector<v1::UpPacket> ups;
  std::vector<v1::DownPacket> downs;
  std::function<bool(const v1::UpPacket&)> lost;
  std::function<bool(const v1::DownPacket&)> lost_down;
};

}  // namespace osteon::test
