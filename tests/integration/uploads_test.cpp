// Tests uploads of cases to a running server. A valid case can be opened in rooms. An invalid one causes one sentence.
#include <gtest/gtest.h>

#include <fstream>

#include "server/upload_validation/case_archive.hpp"
#include "tests/integration/stage.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class Uploads : public ::testing::Test {
 protected:
  Uploads() : stage_(16.0, {"--plain", "--rooms", rooms_.path(), "--uploads", uploads_.path()}) {
    const RunResult imported = run(program("osteon-import"),
                                   {"phantom", "block", "--layers", "6:1.2", "--width", "10", "--pitch", "0.5",
                                    "--title", "A block from elsewhere", "--out", stage_ / "other"},
                                   120s);
    EXPECT_EQ(imported.exit_code, 0) << imported.err;
  }
  RunResult ask(const std::string& what, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), what);
    arguments.insert(arguments.end(), {"--plain", "--server", stage_.address()});
    return run(program("osteon-server"), arguments, 120s);
  }
  [[nodiscard]] std::size_t kept() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(uploads_.path()), fs::directory_iterator{}));
  }

  TempDir rooms_, uploads_;
  Stage stage_;
};

TEST_F(Uploads, ACaseIsSentAndGetsARoomAndIsThereAfterARestart) {
  const RunResult sent = ask("cases", {"upload", stage_ / "other"});
  ASSERT_EQ(sent.exit_code, 0) << sent.err;
  const std::string hash = sent.out.substr(0, 64);
  EXPECT_EQ(hash, read_json(stage_ / "other" / "case.json")["content_hash"].get<std::string>());
  EXPECT_NE(ask("cases", {"list"}).out.find("A block from elsewhere"), std::string::npos);
  const RunResult made = ask("rooms", {"create", "elsewhere", "--case-hash", hash});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(ask("rooms", {"list"}).out.find("elsewhere"), std::string::npos);

  EXPECT_EQ(stage_.server().terminate(), 0) << stage_.server().err();
  stage_.start_server({"--plain", "--rooms", rooms_.path(), "--uploads", uploads_.path()});
  const RunResult again = ask("rooms", {"list"});
  EXPECT_NE(again.out.find("elsewhere"), std::string::npos) << again.out << stage_.server().err();
}

TEST_F(Uploads, WhatIsNoSoundCaseIsOneSentenceAndNothingIsKept) {
  std::ofstream(stage_ / "text.zip") << "this is no archive";
  const auto expect_refused = [&](const fs::path& what, const std::string& why) {
    const RunResult refused = ask("cases", {"upload", what});
    EXPECT_NE(refused.exit_code, 0);
    EXPECT_NE(refused.err.find(why), std::string::npos) << refused.err;
    EXPECT_EQ(kept(), 0U);
  };
  expect_refused(stage_ / "text.zip", "zip archive");
  expect_refused(stage_ / "no-such-file", "no-such-file");
  expect_refused(rooms_.path(), "is not a case");

  fs::create_directory(stage_ / "broken");
  fs::copy_file(stage_ / "other" / "case.json", stage_ / "broken" / "case.json");
  std::ofstream(stage_ / "broken" / "bone.vdb") << std::string(5000, 'x');
  expect_refused(stage_ / "broken", "not sound");

  // A decompression bomb: a thousand times its size.
  fs::create_directory(stage_ / "bomb");
  fs::copy_file(stage_ / "other" / "case.json", stage_ / "bomb" / "case.json");
  std::ofstream(stage_ / "bomb" / "bone.vdb");
  fs::resize_file(stage_ / "bomb" / "bone.vdb", 300 << 20);
  expect_refused(stage_ / "bomb", "times its size");

  // The server still works.
  EXPECT_TRUE(stage_.server().running());
  EXPECT_EQ(ask("cases", {"upload", stage_ / "other"}).exit_code, 0);
  EXPECT_EQ(kept(), 1U);
}

// Paths and processes of the server must not appear at clients. Only the log has them.
TEST_F(Uploads, ErrorsNameNoPathsAndNoProcesses) {
  const std::string pid = std::to_string(stage_.server().pid());
  std::vector<std::string> told;
  const auto expect_told = [&](const RunResult& refused, const std::string& what) {
    EXPECT_NE(refused.exit_code, 0) << what;
    // The client may name its own files.
    for (const fs::path& folder : {rooms_.path(), uploads_.path()})
      EXPECT_EQ(refused.err.find(folder.string()), std::string::npos) << what << ": " << refused.err;
    EXPECT_EQ(refused.err.find(pid), std::string::npos) << what << ": " << refused.err;
    EXPECT_EQ(refused.err.find('/'), std::string::npos) << what << ": " << refused.err;
    EXPECT_NE(refused.err.find(what), std::string::npos) << refused.err;
  };
  const RunResult sent = ask("cases", {"upload", stage_ / "other"});
  ASSERT_EQ(sent.exit_code, 0) << sent.err;
  const std::string hash = sent.out.substr(0, 64);
  for (const std::string room : {"damaged", "gone"})
    ASSERT_EQ(ask("rooms", {"create", room, "--case-hash", hash}).exit_code, 0);
  ASSERT_EQ(ask("rooms", {"backup", "damaged", "once.backup"}).exit_code, 0);
  expect_told(ask("rooms", {"backup", "damaged", "once.backup"}), "once.backup");
  for (const std::string room : {"damaged", "gone"}) ASSERT_EQ(ask("rooms", {"close", room}).exit_code, 0);

  std::vector<fs::path> journals;
  for (const auto& entry : fs::directory_iterator(rooms_.path()))
    if (entry.path().filename().string().starts_with("damaged") && entry.path().extension() != ".backup")
      journals.push_back(entry.path());
  ASSERT_FALSE(journals.empty());
  for (const fs::path& journal : journals) std::ofstream(journal, std::ios::trunc) << "no journal";
  expect_told(ask("rooms", {"resume", "damaged"}), "no journal");

  fs::remove(uploads_ / hash / "bone.vdb");
  expect_told(ask("rooms", {"resume", "gone"}), "bone.vdb");
  fs::create_directory(stage_ / "bad");
  fs::copy_file(stage_ / "other" / "case.json", stage_ / "bad" / "case.json");
  std::ofstream(stage_ / "bad" / "bone.vdb") << std::string(5000, 'x');
  expect_told(ask("cases", {"upload", stage_ / "bad"}), "not sound");

  EXPECT_NE(stage_.server().err().find(rooms_.path().string()), std::string::npos) << "the log keeps the paths";
}

TEST(UploadsNotTaken, AServerWithoutAFolderForThemSaysSo) {
  const Stage stage(16.0);
  const RunResult refused =
      run(program("osteon-server"), {"cases", "upload", stage / "case", "--plain", "--server", stage.address()}, 60s);
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.err.find("--uploads"), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace osteon::test
