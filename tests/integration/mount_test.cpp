// Tests a bone on its compliant mount between real programs. Two simulated hands press it, one of them over a
// connection with 150 ms each way.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>

#include "tests/integration/bad_network.hpp"
#include "tests/integration/stage.hpp"
#include "tests/support/relay/impair_process.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

Process start_hand(const Stage& stage, const std::string& name, const json& step, const std::string& address,
                   std::vector<std::string> more) {
  std::ofstream(stage / (name + "-plan.json")) << json{{"steps", json::array({step})}};
  std::vector<std::string> arguments{"--server",
                                     address,
                                     "--plain",
                                     "--plan",
                                     stage / (name + "-plan.json"),
                                     "--summary",
                                     stage / (name + ".json"),
                                     "--cache",
                                     stage / (name + "-cache")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return stage.start("osteon-haptic", arguments);
}

TEST(Mount, TwoHandsPressOneBone) {
  Stage stage(40.0, {"--plain", "--compliant-mount"});
  ImpairProcess line({"--tcp", stage.address(), "--udp", "127.0.0.1:" + udp_port_of(stage.server())});
  ASSERT_FALSE(line.tcp().empty()) << line.process().err();
  ASSERT_EQ(line.command("delay 150 10"), "ok");
  // Through the bone takes so long that a hand on a busy machine gives up.
  const auto drill_in = [](double x_mm) {
    json step = drill_at(x_mm, 0, "expert");
    step["to_mm"] = 8.0;
    return step;
  };
  Process far = start_hand(stage, "far", drill_in(-8), line.tcp(), {"--udp", line.udp(), "--timeout", "30"});
  Process near = start_hand(stage, "near", drill_in(8), stage.address(), {});
  // A person who touches nothing, and whose datagrams do not get through.
  Process idle = start_hand(stage, "idle", {{"action", "wait"}, {"seconds", 9.0}}, stage.address(), {"--udp", "off"});
  ASSERT_EQ(near.wait(120s), 0) << near.err();
  ASSERT_EQ(far.wait(120s), 0) << far.err();
  ASSERT_EQ(idle.wait(120s), 0) << idle.err();
  ASSERT_EQ(stage.server().terminate(), 0);

  const json server = read_json(stage / "server.json");
  EXPECT_EQ(server.at("rejected"), 0);
  double put_in_mj = 0, released_mj = 0;
  for (const char* name : {"near", "far"}) {
    const json hand = read_json(stage / (std::string(name) + ".json")), mount = hand.at("mount");
    std::printf("%s: %s\n", name, mount.dump().c_str());
    EXPECT_TRUE(mount.at("there"));
    // A drill is pushed with about 29 N, and the mount yields by 1 mm per 5 N.
    EXPECT_GT(mount.at("most_mm").get<double>(), 1.0) << name;
    EXPECT_LT(mount.at("most_mm").get<double>(), 20.0) << name;
    EXPECT_GT(mount.at("granted_mj").get<double>(), 0.0) << name << " is granted what the other puts in";
    EXPECT_GT(mount.at("low_pass_s").get<double>(), 0.5) << name << " waits for the slowest connection";
    EXPECT_EQ(hand.at("rejected"), 0) << name;
    EXPECT_TRUE(hand.at("steps").at(0).at("completed")) << name;
    put_in_mj += mount.at("put_in_mj").get<double>();
    released_mj += mount.at("released_mj").get<double>();
  }
  EXPECT_GT(put_in_mj, 10.0);
  const json idle_mount = read_json(stage / "idle.json").at("mount");
  std::printf("idle: %s\n", idle_mount.dump().c_str());
  EXPECT_GT(idle_mount.at("most_mm").get<double>(), 1.0) << "the bone moves for everybody in the room";
  EXPECT_EQ(idle_mount.at("put_in_mj"), 0.0);
  EXPECT_LE(released_mj, put_in_mj + 2.0 * 2.0) << "no more than what was put in, plus the allowances";
}

// Without a compliant mount, nobody receives messages about one.
TEST(Mount, ABoneWithoutOneStands) {
  Stage stage(40.0);
  json step = drill_at(0, 0, "expert");
  step["to_mm"] = 3.0;
  Process hand = start_hand(stage, "hand", step, stage.address(), {});
  ASSERT_EQ(hand.wait(120s), 0) << hand.err();
  const json mount = read_json(stage / "hand.json").at("mount");
  EXPECT_FALSE(mount.at("there"));
  EXPECT_EQ(mount.at("most_mm"), 0.0);
  EXPECT_EQ(mount.at("put_in_mj"), 0.0);
}

}  // namespace
}  // namespace osteon::test
