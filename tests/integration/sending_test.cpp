// Sends a case from the window to a real server: the server gets the same case, and what goes wrong is one sentence.
#include <gtest/gtest.h>

#include <QDialog>
#include <QLabel>
#include <QPushButton>
#include <QSettings>
#include <QStatusBar>
#include <QTest>
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "common/volume/case.hpp"
#include "tests/integration/sending_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "viewer_client/desktop/language.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class SendingTest : public test::SendingBench<test::WindowBench> {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    speak("en");
    SendingBench::SetUp();
    if (!fs::exists(sent())) {
      const auto made = test::run(test::program("osteon-import"), {"phantom", "block", "--layers", "6:1.2", "--width",
                                                                   "10", "--pitch", "0.5", "--out", sent()});
      ASSERT_EQ(made.exit_code, 0) << made.err;
    }
  }
  // The case that is sent. The server has another one.
  [[nodiscard]] static fs::path sent() { return desk_->temp() / "sent"; }
  [[nodiscard]] bool half_sent() const { return words() == "The case is being sent" && !fs::is_empty(uploads_.path()); }
  // No case, but as much data as takes a while.
  [[nodiscard]] static fs::path large_file() {
    fs::path file = desk_->temp() / "large.osteon";
    std::ofstream{file};
    fs::resize_file(file, kLargeBytes);
    return file;
  }

  static constexpr std::uintmax_t kLargeBytes = std::uintmax_t{1} << 30;
};

TEST_F(SendingTest, TheServerGetsTheSameCaseAndOpensARoomWithIt) {
  const auto described = nlohmann::json::parse(test::content(sent() / "case.json"));
  const std::string hash = described["content_hash"].get<std::string>();
  EXPECT_EQ(listed("cases").find(hash), std::string::npos);
  window_->send_case(sent());
  send(address_, "ward");
  EXPECT_FALSE(at_rest()) << "at work at once";
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words(), address_ + " has the case, and the room ward is open with it.");
  EXPECT_NE(listed("cases").find(hash), std::string::npos);
  EXPECT_NE(listed("rooms").find("ward"), std::string::npos);
  // The server writes the files anew. Their hash is of the bone that is in them.
  const auto kept = Case::load(uploads_ / hash);
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(to_hex(kept->hash()), hash);
  EXPECT_EQ(part<QLineEdit>("new_room").text(), "") << "another case gets another room";
  EXPECT_EQ(QSettings().value("join/room").toString(), "ward") << "where one joins next";

  send(address_);
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words(), address_ + " had the case already.");
  send(address_, "ward");
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_NE(words().find("did not open the room"), std::string::npos) << words();
}

TEST_F(SendingTest, AServerThatIsKilledInTheMiddleIsOneSentenceAndTheCaseStays) {
  const fs::path large = large_file();
  window_->send_case(large);
  send(address_);
  ASSERT_TRUE(until([&] { return half_sent() || at_rest(); })) << words();
  ASSERT_FALSE(at_rest()) << words();
  server_->signal(SIGKILL);
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words().find("the connection to the server was lost"), 0u) << words();
  EXPECT_EQ(std::ranges::count(words(), '\n'), 0);
  EXPECT_EQ(fs::file_size(large), kLargeBytes);
  fs::remove(large);

  // Nobody is at the address any more, and then again somebody is.
  window_->send_case(sent());
  const std::string before = test::content(sent() / "bone.vdb");
  send(address_);
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_NE(words().find(address_), std::string::npos) << words();
  EXPECT_EQ(test::content(sent() / "bone.vdb"), before);
  start_server({"--uploads", uploads_.path(), "--rooms", rooms_.path()});
  send(address_);
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words(), address_ + " has the case now.");
}

TEST_F(SendingTest, ACancelledUploadLeavesNothingOnTheServer) {
  const fs::path large = large_file();
  window_->send_case(large);
  send(address_);
  ASSERT_TRUE(until([&] { return half_sent() || at_rest(); })) << words();
  server_->signal(SIGSTOP);  // on a fast machine it would have all of it soon
  ASSERT_FALSE(at_rest()) << words();
  // Escape closes no dialog that is at work.
  QTest::keyClick(&part<QDialog>("send_dialog"), Qt::Key_Escape);
  ASSERT_TRUE(until([&] { return at_rest(); })) << words();
  EXPECT_EQ(words(), "Cancelled. The server stored nothing, and the case here stays.");
  EXPECT_TRUE(part<QDialog>("send_dialog").isVisible());
  EXPECT_FALSE(fs::is_empty(uploads_.path())) << "the server stands still";
  server_->signal(SIGCONT);
  EXPECT_TRUE(until([&] { return fs::is_empty(uploads_.path()); }));
  EXPECT_TRUE(server_->running());
  QTest::keyClick(&part<QDialog>("send_dialog"), Qt::Key_Escape);
  EXPECT_FALSE(part<QDialog>("send_dialog").isVisible());
  fs::remove(large);
}

// The server stands still, so the packed case waits for the connection.
TEST_F(SendingTest, AClosedWindowWaitsForTheCaseAndThenGivesUp) {
  const fs::path scratch = cases_folder() / (".partial-send-" + std::to_string(QCoreApplication::applicationPid()));
  const auto close_while_it_connects = [&] {
    server_->signal(SIGSTOP);
    window_->send_case(sent());
    send(address_);
    ASSERT_TRUE(until([&] { return words().starts_with("Connecting"); })) << words();
    EXPECT_EQ(fs::status(scratch).permissions(), fs::perms::owner_all);
    EXPECT_FALSE(window_->close());
    EXPECT_TRUE(window_->isVisible());
    const std::string said = window_->statusBar()->toolTip().toStdString();
    EXPECT_NE(said.find("closes when the case is sent"), std::string::npos) << said;
  };
  close_while_it_connects();
  EXPECT_TRUE(window_->close());
  EXPECT_FALSE(fs::exists(scratch));
  server_->signal(SIGCONT);
  EXPECT_TRUE(fs::is_empty(uploads_.path()));

  begin();
  close_while_it_connects();
  server_->signal(SIGCONT);
  EXPECT_TRUE(until([&] { return !window_->isVisible(); })) << words();
  EXPECT_FALSE(fs::is_empty(uploads_.path()));
}

TEST_F(SendingTest, ARefusalSaysWhyAndSendingGoesOn) {
  const fs::path nothing = desk_->temp() / "text.osteon";
  std::ofstream(nothing) << "this is no archive";
  const auto refused = [&](const std::string& address, const char* why) {
    send(address);
    ASSERT_TRUE(until([&] { return at_rest(); })) << words();
    EXPECT_NE(words().find(why), std::string::npos) << words();
    EXPECT_EQ(std::ranges::count(words(), '\n'), 0);
  };
  window_->send_case(nothing);
  refused("nowhere", "is not HOST:PORT");
  EXPECT_EQ(words().find("--"), std::string::npos) << words();
  refused(address_, "zip archive");
  // A folder that is no case is refused before anything is sent.
  fs::create_directories(desk_->temp() / "empty");
  window_->send_case(desk_->temp() / "empty");
  refused(address_, "empty");
  ASSERT_EQ(server_->terminate(), 0);
  start_server({});
  window_->send_case(sent());
  refused(address_, "--uploads");
  EXPECT_TRUE(fs::is_empty(uploads_.path()));
}

}  // namespace
}  // namespace osteon
