// The link between a window and its haptic client: what one end says arrives as it was, a wrong message is not used,
// and the socket is for programs of this user alone.
#include "common/input/pointer_link.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using nlohmann::json;

PointerInput an_input() {
  PointerInput input;
  input.target_mm = {1.25, -20.5, 300.0};
  input.rotation_bone_tool = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  input.on_bone = input.push = input.fine = true;
  input.irrigation = input.suction = input.empty_hand = true;
  input.push_n = 29.0;
  input.spindle = 0.75;
  input.spindle_rpm = 1200.0;
  input.tool = "drill-3.2";
  input.wear = 1.75;
  input.law = "allotta";
  input.source = PointerSource::game_pad;
  return input;
}

PointerOutput an_output() {
  PointerOutput output;
  output.pose_bone_tool = {{-1.5, 2.0, 0.125}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
  output.force_hand_n = {0.0, 1.0, -27.5};
  output.force_bone_n = {3.0, 0.0, -28.0};
  output.push_n = 29.0;
  output.depth_mm = 4.5;
  output.pushing = output.on_metal = output.saturated = true;
  output.device_holds_n = 0.88;
  output.tool = "burr-round-5";
  output.wear = 2.5;
  output.law = "milling";
  output.trouble = "the tool \"größer\" cannot be held";
  return output;
}

void expect_same(const PointerOutput& a, const PointerOutput& b) {
  EXPECT_EQ(a.pose_bone_tool.position_mm, b.pose_bone_tool.position_mm);
  EXPECT_EQ(a.pose_bone_tool.rotation, b.pose_bone_tool.rotation);
  EXPECT_EQ(a.force_hand_n, b.force_hand_n);
  EXPECT_EQ(a.force_bone_n, b.force_bone_n);
  EXPECT_EQ(a.push_n, b.push_n);
  EXPECT_EQ(a.depth_mm, b.depth_mm);
  EXPECT_EQ(a.pushing, b.pushing);
  EXPECT_EQ(a.on_metal, b.on_metal);
  EXPECT_EQ(a.saturated, b.saturated);
  EXPECT_EQ(a.device_holds_n, b.device_holds_n);
  EXPECT_EQ(a.tool, b.tool);
  EXPECT_EQ(a.wear, b.wear);
  EXPECT_EQ(a.law, b.law);
  EXPECT_EQ(a.trouble, b.trouble);
}

TEST(PointerMessage, ComesBackAsItWas) {
  const auto input = read_pointer_input(encode(an_input()));
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_EQ(*input, an_input());
  EXPECT_EQ(*read_pointer_input(encode(PointerInput{})), PointerInput{});
  const auto output = read_pointer_output(encode(an_output()));
  ASSERT_TRUE(output) << output.error().message;
  expect_same(*output, an_output());
  expect_same(*read_pointer_output(encode(PointerOutput{})), PointerOutput{});
}

using Refusal = Result<void> (*)(const std::string&);
Result<void> input_refusal(const std::string& text) {
  return read_pointer_input(text).map([](const auto&) {});
}
Result<void> output_refusal(const std::string& text) {
  return read_pointer_output(text).map([](const auto&) {});
}

// Values of a field that nothing may be done with.
using Wrong = std::vector<std::pair<const char*, std::vector<json>>>;

const std::vector<json> kNoBool{nullptr, 0, 1, "true", json::array({true}), json::object()};
const std::vector<json> kNoText{nullptr, 3, true, json::array({"drill-3.2"}), std::string(513, 'x')};
const std::vector<json> kNoUnitRotation{nullptr,
                                        "1,0,0,0",
                                        json::array(),
                                        json::array({1, 0, 0}),
                                        json::array({1, 0, 0, 0, 0}),
                                        json::array({0, 0, 0, 0}),
                                        json::array({0.99, 0, 0, 0}),
                                        json::array({1, 1, 0, 0}),
                                        json::array({2, 0, 0, 0}),
                                        json::array({1, 0, 0, nullptr}),
                                        json::array({"1", 0, 0, 0})};

std::vector<json> no_vector(double most) {
  return {nullptr,
          "1,2,3",
          5,
          json::object({{"x", 1}}),
          json::array(),
          json::array({1, 2}),
          json::array({1, 2, 3, 4}),
          json::array({1, 2, "3"}),
          json::array({1, nullptr, 3}),
          json::array({true, 2, 3}),
          json::array({1.001 * most, 0, 0}),
          json::array({0, 0, -1.001 * most}),
          json::array({0, 1e300, 0})};
}

std::vector<json> no_number(double least, double most) {
  return {nullptr, "10", true, json::array({10}), json::object(), least - 0.01, most + 0.01 * std::abs(most),
          -1e300,  1e300};
}

// Fields that an older program does not send.
const std::set<std::string> kOptional{"irrigation", "suction", "empty_hand", "wear", "law"};

// Each value alone, and the absence of a field that must be there, is refused with a sentence that names the field.
void expect_each_refused(const std::string& valid, const Wrong& wrong, Refusal refusal) {
  ASSERT_TRUE(refusal(valid));
  const json message = json::parse(valid);
  for (const auto& [field, values] : wrong) {
    ASSERT_TRUE(message.contains(field)) << field;
    std::vector<json> broken;
    for (const json& value : values) (broken.emplace_back(message))[field] = value;
    if (!kOptional.contains(field)) broken.emplace_back(message).erase(field);
    for (const json& one : broken) {
      const Result<void> refused = refusal(one.dump());
      ASSERT_FALSE(refused) << one.dump();
      EXPECT_EQ(refused.error().code, ErrorCode::invalid_input) << one.dump();
      EXPECT_NE(refused.error().message.find(field), std::string::npos) << refused.error().message;
    }
  }
  EXPECT_EQ(wrong.size(), message.size()) << "a field is not tested";
}

TEST(PointerMessage, EachFieldOfTheWindowIsChecked) {
  expect_each_refused(encode(an_input()),
                      {{"version", {nullptr, 0, 1, -1, 1.5, "2", true}},
                       {"target_mm", no_vector(1e5)},
                       {"rotation", kNoUnitRotation},
                       {"on_bone", kNoBool},
                       {"irrigation", kNoBool},
                       {"suction", kNoBool},
                       {"empty_hand", kNoBool},
                       {"push", kNoBool},
                       {"fine", kNoBool},
                       {"push_n", no_number(kLeastPush_n, kMostPush_n)},
                       {"spindle", no_number(0.0, 1.0)},
                       {"spindle_rpm", no_number(0.0, 2e5)},
                       {"tool", kNoText},
                       {"wear", no_number(kSharp, kBluntest)},
                       {"law", kNoText},
                       {"source", {nullptr, 2, true, "", "Mouse", "game pad ", std::string(513, 'x')}}},
                      input_refusal);
}

TEST(PointerMessage, AnOlderWindowHasNoOtherHandAndChangesNoWearOrLaw) {
  json message = json::parse(encode(an_input()));
  for (const std::string& field : kOptional) message.erase(field);
  const auto read = read_pointer_input(message.dump());
  ASSERT_TRUE(read) << read.error().message;
  PointerInput expected = an_input();
  expected.irrigation = expected.suction = expected.empty_hand = false;
  expected.wear.reset();
  expected.law.clear();
  EXPECT_EQ(*read, expected);
  // A window that has nothing to say of the wear sends no such field.
  EXPECT_FALSE(json::parse(encode(expected)).contains("wear"));
}

TEST(PointerMessage, AnOlderClientDoesNotSayHowItsToolCuts) {
  json message = json::parse(encode(an_output()));
  for (const std::string& field : kOptional) message.erase(field);
  const auto read = read_pointer_output(message.dump());
  ASSERT_TRUE(read) << read.error().message;
  PointerOutput expected = an_output();
  expected.wear.reset();
  expected.law.clear();
  expect_same(*read, expected);
}

TEST(PointerMessage, EachFieldOfTheHapticClientIsChecked) {
  expect_each_refused(encode(an_output()),
                      {{"version", {nullptr, 0, 1, -1, 1.5, "2", true}},
                       {"position_mm", no_vector(1e5)},
                       {"rotation", kNoUnitRotation},
                       {"force_hand_n", no_vector(1e6)},
                       {"force_bone_n", no_vector(1e6)},
                       {"push_n", no_number(0.0, 1e6)},
                       {"depth_mm", no_number(-1e5, 1e5)},
                       {"pushing", kNoBool},
                       {"on_metal", kNoBool},
                       {"saturated", kNoBool},
                       {"device_holds_n", no_number(0.0, 1e6)},
                       {"tool", kNoText},
                       {"wear", no_number(kSharp, kBluntest)},
                       {"law", kNoText},
                       {"trouble", kNoText}},
                      output_refusal);
}

TEST(PointerMessage, TheEndsOfARangeAreTaken) {
  for (const double push_n : {1.0, 40.0})
    for (const double spindle : {0.0, 1.0}) {
      PointerInput input = an_input();
      input.push_n = push_n;
      input.spindle = spindle;
      input.target_mm = {1e5, -1e5, 1e5};
      input.spindle_rpm = 2e5;
      input.wear = spindle > 0.0 ? kBluntest : kSharp;
      const auto read = read_pointer_input(encode(input));
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(*read, input);
    }
}

// A rotation of a peer that computes with less accuracy is made exact.
TEST(PointerMessage, ARotationIsMadeUnit) {
  json message = json::parse(encode(an_input()));
  message["rotation"] = {0.50004, 0.5, 0.5, 0.5};
  const auto read = read_pointer_input(message.dump());
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_NEAR(read->rotation_bone_tool.norm(), 1.0, 1e-15);
}

TEST(PointerMessage, WhatIsNoMessageIsRefused) {
  const std::string valid = encode(an_input());
  std::string not_a_number = valid, infinite = valid, huge = valid;
  for (auto& [text, value] : {std::pair(&not_a_number, "NaN"), {&infinite, "Infinity"}, {&huge, "1e999"}})
    text->replace(text->find("29.0"), 4, value);
  std::string no_utf8 = valid;
  no_utf8.replace(no_utf8.find("drill"), 2, "\xc3\x28");
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string("3"), std::string("null"), std::string("push"),
        std::string("{}"), valid.substr(1), valid.substr(0, valid.size() - 1), valid + valid, not_a_number, infinite,
        huge, no_utf8, std::string(8000, '['), std::string(100, '\0')})
    for (const Refusal refusal : {&input_refusal, &output_refusal}) {
      const Result<void> refused = refusal(text);
      ASSERT_FALSE(refused) << text;
      EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
      EXPECT_FALSE(refused.error().message.empty());
    }
  const Result<void> too_long = input_refusal(valid + std::string(11000, ' '));
  ASSERT_FALSE(too_long);
  EXPECT_NE(too_long.error().message.find("too long"), std::string::npos);
  // Neither end takes the other's messages.
  EXPECT_FALSE(output_refusal(valid));
  EXPECT_FALSE(input_refusal(encode(an_output())));
}

// JSON has no such numbers, so a sender that computed one cannot make the receiver move there.
TEST(PointerMessage, NumbersThatAreNoneDoNotArrive) {
  for (const double none : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    PointerInput input = an_input();
    input.target_mm.y() = none;
    const Result<void> refused = input_refusal(encode(input));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("target_mm"), std::string::npos);
  }
}

// A sentence that is too long must not keep the state of the tool from the window.
TEST(PointerMessage, ALongTextArrivesShortened) {
  PointerOutput output = an_output();
  output.trouble = "x";
  for (int i = 0; i < 300; ++i) output.trouble += "é";
  const auto read = read_pointer_output(encode(output));
  ASSERT_TRUE(read) << read.error().message;
  // 512 bytes would end within a character of two.
  EXPECT_EQ(read->trouble, output.trouble.substr(0, 511));
  output.tool = output.law = output.trouble = std::string(512, '\x01');
  const auto escaped = read_pointer_output(encode(output));
  ASSERT_TRUE(escaped) << escaped.error().message;
  expect_same(*escaped, output);
}

// A program that uses the socket without Osteon's library.
class BareSocket {
 public:
  explicit BareSocket(const std::filesystem::path& path) : fd_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0)) {
    address_.sun_family = AF_UNIX;
    OSTEON_CHECK(fd_ >= 0 && path.native().size() < sizeof address_.sun_path);
    std::memcpy(address_.sun_path, path.c_str(), path.native().size());
  }
  ~BareSocket() {
    if (peer_ >= 0) ::close(peer_);
    ::close(fd_);
  }
  BareSocket(const BareSocket&) = delete;
  BareSocket& operator=(const BareSocket&) = delete;

  bool connect() { return ::connect(fd_, address(), sizeof address_) == 0; }
  bool listen() { return ::bind(fd_, address(), sizeof address_) == 0 && ::listen(fd_, 4) == 0; }
  void accept() { peer_ = ::accept(fd_, nullptr, nullptr); }
  [[nodiscard]] bool send(const std::string& text) const {
    return ::send(peer_ >= 0 ? peer_ : fd_, text.data(), text.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(text.size());
  }

 private:
  [[nodiscard]] const sockaddr* address() const { return reinterpret_cast<const sockaddr*>(&address_); }
  int fd_ = -1, peer_ = -1;
  sockaddr_un address_{};
};

class PointerLink : public ::testing::Test {
 protected:
  void listen() {
    auto made = PointerServer::listen(path_);
    ASSERT_TRUE(made) << made.error().message;
    window_ = std::move(*made);
  }
  std::unique_ptr<PointerClient> connect() {
    auto made = PointerClient::connect(path_);
    EXPECT_TRUE(made) << made.error().message;
    return made ? std::move(*made) : nullptr;
  }
  void expect_works(PointerClient& client) {
    window_->send(an_input());
    const auto input = client.wait(0);
    ASSERT_TRUE(input);
    EXPECT_EQ(*input, an_input());
    client.send(an_output());
    ASSERT_TRUE(window_->newest());
    expect_same(*window_->newest(), an_output());
  }

  test::TempDir folder_;
  std::filesystem::path path_ = folder_ / "pointer";
  std::unique_ptr<PointerServer> window_;
};

TEST_F(PointerLink, TheNewestMessageCounts) {
  listen();
  EXPECT_FALSE(window_->connected());
  EXPECT_FALSE(window_->newest());
  window_->send(an_input());  // to nobody
  const auto client = connect();
  ASSERT_TRUE(client);
  EXPECT_TRUE(window_->connected());
  EXPECT_FALSE(client->wait(0)) << "what was said before a client came";
  for (const double push_n : {5.0, 6.0, 7.0}) {
    PointerInput input = an_input();
    input.push_n = push_n;
    window_->send(input);
    PointerOutput output = an_output();
    output.depth_mm = push_n;
    client->send(output);
  }
  const auto newest = client->wait(0);
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->push_n, 7.0);
  EXPECT_FALSE(client->wait(0));
  EXPECT_EQ(window_->newest()->depth_mm, 7.0);
  EXPECT_EQ(window_->newest()->depth_mm, 7.0) << "it stays until a newer one comes";
  EXPECT_EQ(client->refused() + window_->refused(), 0u);
}

TEST_F(PointerLink, EitherEndNoticesThatTheOtherHasGone) {
  listen();
  auto client = connect();
  ASSERT_TRUE(client);
  expect_works(*client);
  client.reset();
  EXPECT_FALSE(window_->connected());
  EXPECT_FALSE(window_->newest()) << "of a tool that nobody holds any more";
  client = connect();
  ASSERT_TRUE(client);
  expect_works(*client);
  EXPECT_FALSE(client->closed());
  window_.reset();
  EXPECT_FALSE(client->wait(0));
  EXPECT_TRUE(client->closed());
  listen();
  EXPECT_TRUE(client->closed()) << "a new window needs a new connection";
  client = connect();
  ASSERT_TRUE(client);
  expect_works(*client);
}

// A client that does not read must not stop the window. What it gets later is old, and then new again.
TEST_F(PointerLink, AFullSocketStopsNobody) {
  listen();
  const auto client = connect();
  ASSERT_TRUE(client);
  for (int i = 0; i < 20'000; ++i) window_->send(an_input());
  for (int i = 0; i < 20'000; ++i) client->send(an_output());
  EXPECT_TRUE(window_->connected());
  EXPECT_FALSE(client->closed());
  EXPECT_TRUE(client->wait(0));
  expect_works(*client);
}

TEST_F(PointerLink, OneWindowListens) {
  listen();
  const auto client = connect();
  ASSERT_TRUE(client);
  for (int i = 0; i < 3; ++i) {
    const auto second = PointerServer::listen(path_);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::exists);
    EXPECT_NE(second.error().message.find(path_.string()), std::string::npos);
  }
  expect_works(*client);
}

// Clients wait for a window that has one already. When the kernel's queue is full, the window still lives.
TEST_F(PointerLink, ABusyWindowIsNotReplaced) {
  listen();
  auto client = connect();
  ASSERT_TRUE(client);
  expect_works(*client);
  std::vector<std::unique_ptr<PointerClient>> waiting;
  ErrorCode code = ErrorCode::internal;
  for (int i = 0; i < 10; ++i) {
    auto one = PointerClient::connect(path_);
    if (!one) {
      code = one.error().code;
      break;
    }
    waiting.push_back(std::move(*one));
  }
  EXPECT_EQ(code, ErrorCode::unavailable);
  EXPECT_EQ(PointerServer::listen(path_).error().code, ErrorCode::exists);
  ASSERT_FALSE(waiting.empty());
  client.reset();
  EXPECT_FALSE(window_->connected());
  EXPECT_TRUE(window_->connected()) << "the first that waited comes in";
  expect_works(*waiting.front());
}

TEST_F(PointerLink, ASocketThatADeadProgramLeftIsReplaced) {
  { ASSERT_TRUE(BareSocket(path_).listen()); }
  ASSERT_TRUE(std::filesystem::is_socket(path_));
  const auto nobody = PointerClient::connect(path_);
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().code, ErrorCode::not_found);
  listen();
  const auto client = connect();
  ASSERT_TRUE(client);
  expect_works(*client);
}

TEST_F(PointerLink, AFileIsNotReplaced) {
  std::ofstream(path_) << "mine";
  const auto made = PointerServer::listen(path_);
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().message.find(path_.string()), std::string::npos);
  std::ifstream file(path_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "mine");
}

TEST_F(PointerLink, NobodyElseMayOpenTheSocket) {
  const mode_t before = ::umask(0);
  listen();
  EXPECT_EQ(::umask(before), 0u) << "the program's own mask stays";
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  window_.reset();
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(PointerLink, AMissingSocketAndALongPathAreNamed) {
  const auto missing = PointerClient::connect(path_);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_NE(missing.error().message.find(path_.string()), std::string::npos);
  // A path in sockaddr_un has 108 bytes, and the last one is zero.
  const std::string folder = folder_.path().string() + "/";
  for (const std::string& path :
       {std::string(), folder + std::string(108 - folder.size(), 'x'), std::string(500, 'x')}) {
    const auto window = PointerServer::listen(path);
    const auto client = PointerClient::connect(path);
    ASSERT_FALSE(window) << path;
    ASSERT_FALSE(client) << path;
    for (const Error& error : {window.error(), client.error()}) {
      EXPECT_EQ(error.code, ErrorCode::invalid_input) << path;
      EXPECT_NE(error.message.find("107"), std::string::npos) << error.message;
    }
  }
  path_ = folder + std::string(107 - folder.size(), 'x');
  listen();
  EXPECT_TRUE(connect());
}

TEST_F(PointerLink, GarbageIsCountedAndNeverUsed) {
  listen();
  BareSocket stranger(path_);
  ASSERT_TRUE(stranger.connect());
  for (const std::string& text : {std::string("garbage"), std::string("{}"), encode(an_input()),
                                  std::string(20'000, 'x'), encode(an_output()) + std::string(20'000, ' ')})
    ASSERT_TRUE(stranger.send(text));
  EXPECT_TRUE(window_->connected());
  EXPECT_FALSE(window_->newest());
  EXPECT_EQ(window_->refused(), 5u);
  ASSERT_TRUE(stranger.send(encode(an_output())));
  EXPECT_TRUE(window_->newest());
  ASSERT_TRUE(stranger.send("garbage"));
  ASSERT_TRUE(window_->newest()) << "the last good one stays";
  expect_same(*window_->newest(), an_output());
  EXPECT_EQ(window_->refused(), 6u);
}

TEST_F(PointerLink, GarbageOfAWindowMovesNoTool) {
  BareSocket stranger(path_);
  ASSERT_TRUE(stranger.listen());
  const auto client = connect();
  ASSERT_TRUE(client);
  stranger.accept();
  for (const std::string& text : {std::string("garbage"), std::string("{}"), encode(an_output())})
    ASSERT_TRUE(stranger.send(text));
  EXPECT_FALSE(client->wait(0));
  EXPECT_EQ(client->refused(), 3u);
  EXPECT_FALSE(client->closed());
  ASSERT_TRUE(stranger.send(encode(an_input())));
  ASSERT_TRUE(stranger.send("garbage"));
  const auto input = client->wait(0);
  ASSERT_TRUE(input);
  EXPECT_EQ(*input, an_input());
  EXPECT_EQ(client->refused(), 4u);
}

// Even where the file lets others in, neither end talks to another user.
TEST_F(PointerLink, AnotherUserIsRefused) {
  if (::geteuid() != 0) return;  // only root can become another user
  listen();
  ASSERT_EQ(::chmod(path_.c_str(), 0777), 0);
  ASSERT_EQ(::chmod(folder_.path().c_str(), 0755), 0);
  std::array<int, 2> says{}, hears{};
  ASSERT_TRUE(::pipe(says.data()) == 0 && ::pipe(hears.data()) == 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(hears[1]);
    // From within the folder, because another user may not go through those above it.
    if (::chdir(folder_.path().c_str()) != 0 || ::setuid(65534) != 0) ::_exit(2);
    const auto client = PointerClient::connect("pointer");
    if (client || client.error().code != ErrorCode::denied) ::_exit(3);
    BareSocket stranger("pointer");
    if (!stranger.connect() || !stranger.send(encode(an_output()))) ::_exit(4);
    char any = 0;
    if (::write(says[1], &any, 1) != 1) ::_exit(5);
    while (::read(hears[0], &any, 1) > 0) continue;  // until the test has looked
    ::_exit(0);
  }
  ::close(says[1]);
  ::close(hears[0]);
  char any = 0;
  const ssize_t said = ::read(says[0], &any, 1);
  // The client that went away, the stranger, and nobody.
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(window_->connected());
    EXPECT_FALSE(window_->newest());
  }
  ::close(hears[1]);
  ::close(says[0]);
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(said, 1);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const auto client = connect();
  ASSERT_TRUE(client);
  expect_works(*client);
}

}  // namespace
}  // namespace osteon
