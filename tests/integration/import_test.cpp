// Tests osteon-import alone, as real processes: a phantom, five kinds of tools, a closed surface, and the same hash
// every time.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/geometry/mesh_file.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class Import : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto made = start(
        {"phantom", "block", "--layers", "5:1.9,15:0.4", "--width", "40", "--pitch", "0.5", "--out", path("case")});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    std::ofstream(folder_ / "five.yaml")
        << "steps:\n"
           "  - {tool: drill-3.2, axis: [0, 0, -1], from: [-14, -14, 2], to: [-14, -14, -12]}\n"
           "  - {tool: burr-round-5, axis: [0, 0, -1], path: [{at: [-8, 10, 2]}, {at: [-8, 10, -2]}, {at: [6, 12, "
           "-2]}]}\n"
           "  - {tool: saw-oscillating-3, axis: [0, 0, -1], across: [1, 0, 0], from: [0, -14, 2], to: [0, -14, -6]}\n"
           "  - {tool: reamer-cylinder, axis: [0, 0, -1], from: [12, -8, 2], to: [12, -8, -9]}\n"
           "  - {tool: broach-2, axis: [0, 0, -1], across: [1, 0, 0], from: [-2, 0, 2], to: [-2, 0, -6]}\n";
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  static RunResult start(const std::vector<std::string>& arguments) {
    return run(program("osteon-import"), arguments, 120s);
  }

  // Expects exit code 1, one sentence that names the fault, and nothing new in the folder.
  void refused(const std::vector<std::string>& arguments, const std::string& named) {
    const auto before = names();
    const auto result = start(arguments);
    EXPECT_EQ(result.exit_code, 1) << named;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
    EXPECT_EQ(names(), before);
  }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) out.push_back(entry.path().string());
    std::ranges::sort(out);
    return out;
  }
  TempDir folder_;
};

TEST_F(Import, FiveToolsLeaveOneClosedSurfaceAndOneHash) {
  std::string hashes[2];
  for (int turn = 0; turn < 2; ++turn) {
    const std::string fields = path(turn == 0 ? "a.vdb" : "b.vdb"), surface = path(turn == 0 ? "a.stl" : "b.stl");
    const auto carved = start({"carve", path("case"), path("five.yaml"), "--out", fields, "--surface", surface});
    ASSERT_EQ(carved.exit_code, 0) << carved.err;
    EXPECT_NE(carved.out.find(" 0 open edges"), std::string::npos) << carved.out;
    const auto hash = start({"hash", fields});
    ASSERT_EQ(hash.exit_code, 0) << hash.err;
    hashes[turn] = hash.out;
    EXPECT_NE(carved.out.find("hash       " + hash.out), std::string::npos) << carved.out;
    const auto mesh = read_stl(surface);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(open_edges(*mesh), 0u);
    EXPECT_GT(enclosed_mm3(*mesh), 0.9 * 40 * 40 * 20);
    EXPECT_LT(enclosed_mm3(*mesh), 40 * 40 * 20 - 1000.0);  // the reamer alone removes more than that
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0].size(), 65u);
}

TEST_F(Import, ItsSurfaceIsACaseAgain) {
  ASSERT_EQ(start({"surface", path("case"), "--out", path("block.stl")}).exit_code, 0);
  const auto again = start({"stl", path("block.stl"), "--pitch", "0.5", "--out", path("again")});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const auto bone = again.out.find("bone       ");
  ASSERT_NE(bone, std::string::npos) << again.out;
  EXPECT_NEAR(std::stod(again.out.substr(bone + 11)), 32.0, 0.2) << again.out;  // cm3: edges are rounded over one cell
}

TEST_F(Import, WrongFilesAreRefused) {
  ASSERT_EQ(start({"carve", path("case"), path("five.yaml"), "--out", path("a.vdb")}).exit_code, 0);
  ASSERT_EQ(start({"phantom", "block", "--layers", "6:1", "--width", "10", "--pitch", "0.5", "--out", path("other")})
                .exit_code,
            0);
  std::ofstream(folder_ / "letter.vdb") << "Dear reader\n";
  fs::copy_file(folder_ / "a.vdb", folder_ / "half.vdb");
  fs::resize_file(folder_ / "half.vdb", fs::file_size(folder_ / "a.vdb") / 2);
  for (const char* wrong : {"letter.vdb", "half.vdb", "five.yaml"}) {
    refused({"hash", path(wrong)}, path(wrong));
    refused({"surface", path("case"), "--fields", path(wrong), "--out", path("n.stl")}, path(wrong));
  }
  refused({"surface", path("other"), "--fields", path("a.vdb"), "--out", path("n.stl")}, "a.vdb");
  refused({"carve", path("case"), path("letter.vdb"), "--out", path("n.vdb")}, "letter.vdb");
  refused({"carve", path("a.vdb"), path("five.yaml"), "--out", path("n.vdb")}, "a.vdb");
  refused({"stl", path("a.vdb"), "--out", path("n")}, "a.vdb");
}

TEST_F(Import, CtrlCLeavesNothingBehind) {
  // A path of many thousand cuts.
  std::ofstream script(folder_ / "long.yaml");
  script << "steps:\n  - tool: reamer-sphere\n    axis: [0, 0, -1]\n    path:\n";
  for (int i = 0; i < 2000; ++i)
    script << "      - {at: [" << (i % 2 == 0 ? -15 : 15) << ", " << i % 30 - 15 << ", -4]}\n";
  script.close();
  const auto before = names();
  Process process(program("osteon-import"), {"carve", path("case"), path("long.yaml"), "--out", path("l.vdb"),
                                             "--surface", path("l.stl"), "--cut", "0.2"});
  const auto end = std::chrono::steady_clock::now() + 60s;
  while (process.err().find("carving") == std::string::npos && process.running() &&
         std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(2ms);
  ASSERT_TRUE(process.running()) << process.err();
  process.signal(SIGINT);
  EXPECT_EQ(process.wait(60s), 130);
  EXPECT_EQ(process.out(), "");
  EXPECT_EQ(names(), before);
}

}  // namespace
}  // namespace osteon::test
