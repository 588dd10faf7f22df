// The fields of a configuration file, and the messages about a wrong one.
#include "server/cli/server_config.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <string>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

class ServerConfigTest : public ::testing::Test {
 protected:
  ConfigRead read(const std::string& text) {
    std::ofstream(dir_ / "server.yaml") << text;
    const Result<ConfigRead> got = read_server_config(dir_ / "server.yaml");
    EXPECT_TRUE(got.has_value()) << got.error().message;
    return got.value_or(ConfigRead{});
  }
  // A case as osteon-import could have written it, as far as the folder shows.
  void make_case(const std::string& name) {
    fs::create_directories(dir_ / name);
    std::ofstream(dir_ / name / "case.json") << "{}";
  }
  test::TempDir dir_;
};

TEST_F(ServerConfigTest, EveryFieldIsRead) {
  const ConfigRead got = read(R"(
cases: [skull, /bones/ear]
listen: "[::1]:50000"
address_file: address
summary: /tmp/summary.json
tools: tools
save: save.vdb
resume: resume.vdb
journal: room.journal
rooms: rooms
uploads: uploads
udp_listen: 0.0.0.0:50001
retention_days: 365
detail: near
certificates: certs
plain: true
proxy_socket: proxy.sock
most_connections: 40
most_rooms: 12
most_ticket_hours: 168
most_rooms_per_person: 3
most_backups_per_person: 4
case_memory_mib: 2000
compliant_mount: true
metrics: 9464
drain_seconds: 7
limits:
  path_knots: 32
  beyond_bone_mm: 50
  swept_mm: 20
  spindle_rpm: 90000
  time_slack_ms: 500
  swept_voxels_per_s: 2e8
  power_w: 300.5
  blow_j: 15
)");
  EXPECT_TRUE(got.faults.empty()) << got.faults.front();
  const ServerConfig& c = got.config;
  EXPECT_EQ(c.case_folders, (std::vector<fs::path>{dir_ / "skull", "/bones/ear"}));
  EXPECT_EQ(c.listen, "[::1]:50000");
  EXPECT_EQ(c.address_file, dir_ / "address");
  EXPECT_EQ(c.summary_file, "/tmp/summary.json");
  EXPECT_EQ(c.tools_folder, dir_ / "tools");
  EXPECT_EQ(c.save_file, dir_ / "save.vdb");
  EXPECT_EQ(c.resume_file, dir_ / "resume.vdb");
  EXPECT_EQ(c.journal_file, dir_ / "room.journal");
  EXPECT_EQ(c.rooms_folder, dir_ / "rooms");
  EXPECT_EQ(c.uploads_folder, dir_ / "uploads");
  EXPECT_EQ(c.udp_listen, "0.0.0.0:50001");
  EXPECT_EQ(c.retention_days, 365);
  EXPECT_EQ(c.detail, Detail::near);
  EXPECT_EQ(c.certificates, dir_ / "certs");
  EXPECT_TRUE(c.plain);
  EXPECT_EQ(c.proxy_socket, dir_ / "proxy.sock");
  EXPECT_EQ(c.most_connections, 40);
  EXPECT_EQ(c.most_rooms, 12);
  EXPECT_EQ(c.most_ticket_hours, 168);
  EXPECT_EQ(c.most_rooms_per_person, 3);
  EXPECT_EQ(c.most_backups_per_person, 4);
  EXPECT_EQ(c.case_memory_mib, 2000);
  EXPECT_TRUE(c.mount);
  EXPECT_EQ(c.metrics, "9464");
  EXPECT_EQ(c.drain_seconds, 7);
  EXPECT_EQ(c.limits.path_knots, 32);
  EXPECT_EQ(c.limits.beyond_bone_mm, 50);
  EXPECT_EQ(c.limits.swept_mm, 20);
  EXPECT_EQ(c.limits.spindle_rpm, 90000u);
  EXPECT_EQ(c.limits.time_slack, std::chrono::milliseconds(500));
  EXPECT_EQ(c.limits.swept_voxels_per_s, 2e8);
  EXPECT_EQ(c.limits.power_w, 300.5);
  EXPECT_EQ(c.limits.blow_j, 15);
}

// One wrong value for every field, and a word of the remedy in the message.
const std::multimap<std::string, std::pair<std::string, std::string>> kWrong{
    {"address_file", {"[a, b]", "write a path"}},
    {"audit", {"[x]", "write a path"}},
    {"audit_retention_days", {"-1", "from 0 to 36500"}},
    {"audit_syslog", {"[x]", "write a path"}},
    {"case_memory_mib", {"0", "from 1 to 1048576"}},
    {"cases", {"{}", "list of paths"}},
    {"cases", {"[]", "list of paths"}},
    {"certificates", {"[x]", "write a path"}},
    {"compliant_mount", {"soft", "true or false"}},
    {"detail", {"fine", "auto, full or near"}},
    {"drain_seconds", {"-1", "from 0 to 600"}},
    {"drain_seconds", {"1.5", "whole number"}},
    {"journal", {"{}", "write a path"}},
    {"limits.beyond_bone_mm", {"0", "from 1 to 1000"}},
    {"limits.blow_j", {"-3", "from 0 to 1000"}},
    {"limits.path_knots", {"65", "from 2 to 64"}},
    {"limits.power_w", {"much", "from 1 to"}},
    {"limits.power_w", {"nan", "from 1 to"}},
    {"limits.spindle_rpm", {"0", "from 1 to"}},
    {"limits.swept_mm", {"1e9", "from 1 to 1000"}},
    {"limits.swept_voxels_per_s", {"12", "from"}},
    {"limits.time_slack_ms", {"0", "from 1 to 60000"}},
    {"listen", {"50000", "HOST:PORT"}},
    {"listen", {"127.0.0.1:70000", "HOST:PORT"}},
    {"metrics", {"0.0.0.0:9464", "this machine alone"}},
    {"metrics", {"port", "write a port"}},
    {"most_backups_per_person", {"none", "from 1 to 65536"}},
    {"most_connections", {"0", "from 1 to 65535"}},
    {"most_rooms", {"0", "from 1 to 65536"}},
    {"most_rooms_per_person", {"0", "from 1 to 65536"}},
    {"most_ticket_hours", {"0", "from 1 to 87600"}},
    {"plain", {"yes please", "true or false"}},
    {"proxy_socket", {"[x]", "write a path"}},
    {"resume", {"''", "write a path"}},
    {"retention_days", {"0", "from 1 to 36500"}},
    {"rooms", {"[x]", "write a path"}},
    {"save", {"{}", "write a path"}},
    {"signing_key", {"[x]", "write a path"}},
    {"summary", {"{}", "write a path"}},
    {"tools", {"{}", "write a path"}},
    {"udp_listen", {"50001", "HOST:PORT"}},
    {"uploads", {"[x]", "write a path"}},
};

TEST_F(ServerConfigTest, EveryFieldIsWrongOnce) {
  std::set<std::string> tried;
  for (const auto& [field, wrong] : kWrong) {
    tried.insert(field);
    const bool limit = field.starts_with("limits.");
    const std::string line = limit ? "limits:\n  " + field.substr(7) + ": " + wrong.first : field + ": " + wrong.first;
    const ConfigRead got = read("# a comment\n" + line + "\n");
    ASSERT_EQ(got.faults.size(), 1u) << line;
    const std::string& said = got.faults.front();
    EXPECT_EQ(said.find((dir_ / "server.yaml").string() + ":" + (limit ? "3" : "2") + ": \"" + field + "\" is "), 0u)
        << said;
    EXPECT_NE(said.find(wrong.second), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
  const std::vector<std::string> known = server_config_fields();
  EXPECT_EQ(tried, (std::set<std::string>{known.begin(), known.end()})) << "a field has no wrong value in this test";
}

TEST_F(ServerConfigTest, AnUnknownFieldIsReportedWithTheNearestKnownOne) {
  const std::map<std::string, std::string> nearest{{"lisen: x:1", "\"listen\""},
                                                   {"case: skull", "\"cases\""},
                                                   {"Metrics: 1", "\"metrics\""},
                                                   {"retention: 3", "\"retention_days\""},
                                                   {"limit: {}", "\"limits\""},
                                                   {"limits:\n  power: 3", "\"limits.power_w\""},
                                                   {"drain-seconds: 3", "\"drain_seconds\""}};
  for (const auto& [line, meant] : nearest) {
    const ConfigRead got = read(line + "\n");
    ASSERT_EQ(got.faults.size(), 1u) << line;
    EXPECT_NE(got.faults[0].find("is not a field; did you mean " + meant), std::string::npos) << got.faults[0];
  }
}

TEST_F(ServerConfigTest, AllFaultsAreReported) {
  const ConfigRead got = read("listen: here\nlisten: 127.0.0.1:1\nfoo: 1\nlimits: 3\nmetrics: 9464\n");
  ASSERT_EQ(got.faults.size(), 4u);
  EXPECT_NE(got.faults[1].find("twice"), std::string::npos);
  EXPECT_NE(got.faults[3].find("\"limits\" is not a map"), std::string::npos);
  EXPECT_EQ(got.config.metrics, "9464") << "the correct fields are read";
}

TEST_F(ServerConfigTest, WhatIsNotYamlIsSaidWithItsLine) {
  for (const char* text : {"cases: [\n", "- a\n- b\n", "listen: \"x\n", "just words\n", "{[]: 3}\n"}) {
    const ConfigRead got = read(text);
    ASSERT_GE(got.faults.size(), 1u) << text;
    EXPECT_EQ(got.faults[0].find((dir_ / "server.yaml").string() + ":"), 0u) << got.faults[0];
  }
  EXPECT_TRUE(read_server_config(dir_ / "nowhere.yaml").error().message.find("nowhere.yaml") != std::string::npos);
}

TEST_F(ServerConfigTest, WhatDoesNotFitTogetherIsSaid) {
  ServerConfig config;
  EXPECT_NE(check_server_config(config).error().message.find("--case"), std::string::npos);
  config.case_folders = {"a"};
  EXPECT_NE(check_server_config(config).error().message.find("--certificates"), std::string::npos)
      << "no option says how clients authenticate";
  config.certificates = "c";
  EXPECT_TRUE(check_server_config(config).has_value());
  config.plain = true;
  EXPECT_NE(check_server_config(config).error().message.find("--plain excludes"), std::string::npos);
  config.certificates.clear();
  EXPECT_TRUE(check_server_config(config).has_value());
  ServerConfig tickets = config;
  tickets.most_ticket_hours = 24;
  EXPECT_NE(check_server_config(tickets).error().message.find("--certificates"), std::string::npos);
  ServerConfig two = config;
  two.case_folders = {"a", "b"};
  EXPECT_NE(check_server_config(two).error().message.find("--rooms"), std::string::npos);
  two.rooms_folder = "r";
  EXPECT_TRUE(check_server_config(two).has_value());
  ServerConfig uploads = config;
  uploads.uploads_folder = "u";
  EXPECT_NE(check_server_config(uploads).error().message.find("--rooms"), std::string::npos);
  uploads.rooms_folder = "r";
  EXPECT_TRUE(check_server_config(uploads).has_value());
  using Change = void (*)(ServerConfig&);
  const std::vector<std::pair<Change, Change>> pairs{
      {[](ServerConfig& c) { c.journal_file = "j"; }, [](ServerConfig& c) { c.rooms_folder = "r"; }},
      {[](ServerConfig& c) { c.journal_file = "j"; }, [](ServerConfig& c) { c.resume_file = "r"; }},
      {[](ServerConfig& c) { c.rooms_folder = "r"; }, [](ServerConfig& c) { c.resume_file = "r"; }},
      {[](ServerConfig& c) { c.rooms_folder = "r"; }, [](ServerConfig& c) { c.save_file = "s"; }}};
  for (const auto& [one, other] : pairs) {
    ServerConfig both = config;
    one(both);
    EXPECT_TRUE(check_server_config(both).has_value());
    other(both);
    const Result<void> checked = check_server_config(both);
    ASSERT_FALSE(checked.has_value());
    EXPECT_NE(checked.error().message.find(" excludes "), std::string::npos) << checked.error().message;
  }
}

TEST_F(ServerConfigTest, WhatIsNotThereIsSaid) {
  make_case("skull");
  ServerConfig sound;
  sound.case_folders = {dir_ / "skull"};
  ASSERT_TRUE(check_server_places(sound).has_value());
  const std::map<std::string, std::function<void(ServerConfig&)>> missing{
      {"--case", [&](ServerConfig& c) { c.case_folders = {dir_ / "nowhere"}; }},
      {"--tools", [&](ServerConfig& c) { c.tools_folder = dir_ / "nowhere"; }},
      {"--resume", [&](ServerConfig& c) { c.resume_file = dir_ / "nowhere"; }},
      {"--journal", [&](ServerConfig& c) { c.journal_file = dir_ / "nowhere" / "j"; }},
      {"--save", [&](ServerConfig& c) { c.save_file = dir_ / "nowhere" / "s"; }},
      {"--summary", [&](ServerConfig& c) { c.summary_file = dir_ / "nowhere" / "s"; }},
      {"--address-file", [&](ServerConfig& c) { c.address_file = dir_ / "nowhere" / "a"; }},
      {"--certificates", [&](ServerConfig& c) { c.certificates = dir_ / "nowhere"; }},
      {"--rooms", [&](ServerConfig& c) { c.rooms_folder = dir_ / "nowhere" / "r"; }}};
  for (const auto& [option, change] : missing) {
    ServerConfig config = sound;
    change(config);
    const Result<void> checked = check_server_places(config);
    ASSERT_FALSE(checked.has_value()) << option;
    EXPECT_NE(checked.error().message.find(option), std::string::npos) << checked.error().message;
    EXPECT_NE(checked.error().message.find("nowhere"), std::string::npos) << checked.error().message;
  }
}

TEST(ServerConfigExample, IsSoundAndNamesEveryField) {
  const fs::path file = fs::path(OSTEON_DEPLOY) / "osteon-server.yaml";
  const Result<ConfigRead> got = read_server_config(file);
  ASSERT_TRUE(got.has_value()) << got.error().message;
  for (const std::string& fault : got->faults) ADD_FAILURE() << fault;
  EXPECT_TRUE(check_server_config(got->config).has_value());
  // The fields that it leaves out as comments must be in it too.
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const std::string& field : server_config_fields()) {
    const std::string name = field.substr(field.find('.') == std::string::npos ? 0 : field.find('.') + 1);
    EXPECT_NE(text.find(name + ":"), std::string::npos) << field;
  }
  // The limits in the example are the defaults.
  EXPECT_EQ(got->config.limits.power_w, kServedLimits.power_w);
  EXPECT_EQ(got->config.limits.swept_voxels_per_s, kServedLimits.swept_voxels_per_s);
  EXPECT_EQ(got->config.limits.time_slack, kServedLimits.time_slack);
  EXPECT_EQ(got->config.limits.path_knots, kServedLimits.path_knots);
}

}  // namespace
}  // namespace osteon
