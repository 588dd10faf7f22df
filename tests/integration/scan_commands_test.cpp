// What osteon-import shows of a scan before a case is made of it, as the window asks it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "server/import/dicom_writer.hpp"
#include "tests/integration/two_balls.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "viewer_client/imaging/island_map.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;

class ScanCommands : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(import::write_dicom_series(balls_, folder_ / "ct", [](double) { return true; }));
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  static RunResult start(const std::vector<std::string>& arguments) { return run(program("osteon-import"), arguments); }
  // Exit code 1, one sentence with `named`, and no new file.
  void refused(const std::vector<std::string>& arguments, const std::string& named) const {
    const auto before = names_in(folder_.path());
    const auto result = start(arguments);
    EXPECT_EQ(result.exit_code, 1) << named;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
    EXPECT_EQ(names_in(folder_.path()), before);
  }
  TempDir folder_;
  imaging::HuVolume balls_ = two_balls();
};

TEST_F(ScanCommands, AScanIsWrittenVoxelForVoxel) {
  const auto written = start({"export-scan", path("ct"), path("scan.nrrd"), "--series", "1"});
  ASSERT_EQ(written.exit_code, 0) << written.err;
  const auto scan = read_scan_file(folder_ / "scan.nrrd");
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->geometry.dims, balls_.dims);
  EXPECT_EQ(scan->values, balls_.values);
  EXPECT_LT((scan->geometry.origin_mm - balls_.origin_mm).norm(), 1e-6);
  refused({"export-scan", path("ct"), path("scan.nrrd")}, "scan.nrrd");
  refused({"export-scan", path("ct"), path("other.nii")}, ".nrrd");
  refused({"export-scan", path("ct"), path("other.nrrd"), "--series", "2"}, "series");
}

// Every edge is on the surface of a ball, and goes all around it.
TEST_F(ScanCommands, EdgesLieOnTheSurfacesOfTheBalls) {
  const auto written = start({"edges", path("ct"), path("edges.nrrd")});
  ASSERT_EQ(written.exit_code, 0) << written.err;
  const auto edges = read_number_file(folder_ / "edges.nrrd");
  ASSERT_TRUE(edges) << edges.error().message;
  EXPECT_EQ(edges->geometry.dims, balls_.dims);
  std::array<int, 8> octants{};  // around the middle of the ball on the left
  for (int k = 0; k < balls_.dims[2]; ++k)
    for (int j = 0; j < balls_.dims[1]; ++j)
      for (int i = 0; i < balls_.dims[0]; ++i) {
        const int edge = edges->at({i, j, k});
        ASSERT_LE(edge, 1);
        if (edge == 0) continue;
        const Vec3 at = balls_.position_mm(Vec3(i, j, k));
        const Vec3 off = Vec3(std::abs(at.x()), at.y(), at.z()) - Vec3(kApart_mm, 0, 0);
        EXPECT_NEAR(off.norm(), kBall_mm, balls_.spacing_mm.maxCoeff()) << at.transpose();
        if (at.x() > 0.0) ++octants[(off.x() > 0) + 2 * (off.y() > 0) + 4 * (off.z() > 0)];
      }
  for (const int count : octants) EXPECT_GT(count, 10);
  refused({"edges", path("ct"), path("other.nrrd"), "--limits", "300,100"}, "--limits");
  refused({"edges", path("ct"), path("edges.nrrd")}, "edges.nrrd");
}

// Islands are the voxels of the balls, largest first; both have as many. What is listed is what is written.
TEST_F(ScanCommands, IslandsAreListedAndNumbered) {
  const auto listed = start({"islands", path("ct"), path("islands.nrrd")});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  const auto json = nlohmann::json::parse(listed.out);
  ASSERT_EQ(json["islands"].size(), 2u) << listed.out;
  EXPECT_EQ(json["count"], 2);
  EXPECT_EQ(json["threshold_hu"], 226.0);
  auto numbers = read_number_file(folder_ / "islands.nrrd");
  ASSERT_TRUE(numbers) << numbers.error().message;
  ASSERT_EQ(start({"export-scan", path("ct"), path("scan.nrrd")}).exit_code, 0);
  const auto scan = read_scan_file(folder_ / "scan.nrrd");
  ASSERT_TRUE(scan);
  const auto map = IslandMap::make(scan->geometry, std::move(*numbers));
  ASSERT_TRUE(map) << map.error().message;
  std::array<int, 3> counts{};
  for (int k = 0; k < balls_.dims[2]; ++k)
    for (int j = 0; j < balls_.dims[1]; ++j)
      for (int i = 0; i < balls_.dims[0]; ++i) {
        const auto number = map->number({i, j, k});
        ASSERT_LE(number, 2);
        ++counts[number];
        EXPECT_EQ(number != 0, balls_.at(i, j, k) == kBall_hu);
      }
  EXPECT_EQ(counts[1], counts[2]);
  for (const auto& island : json["islands"]) {
    EXPECT_EQ(island["kind"], "bone");
    EXPECT_NEAR(island["volume_cm3"].get<double>(), counts[1] * balls_.spacing_mm.prod() * 1e-3, 1e-9);
    const auto at = island["centre_mm"].get<std::vector<double>>();
    EXPECT_NEAR(std::abs(at[0]), kApart_mm, 0.5 * balls_.spacing_mm.x());
    const auto voxel = voxel_of(scan->geometry, Vec3(at[0], at[1], at[2]));
    ASSERT_TRUE(voxel);
    EXPECT_EQ(map->number(*voxel), island["number"].get<int>());
  }
  // This comes to light after the progress of the reading.
  const auto none = start({"islands", path("ct"), path("none.nrrd"), "--threshold", "1001"});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_NE(none.err.find("no voxel reaches the bone threshold of 1001 HU"), std::string::npos) << none.err;
  EXPECT_FALSE(fs::exists(folder_ / "none.nrrd"));
}

// A single wrong voxel is gone, and the others of its neighbourhood stay.
TEST_F(ScanCommands, AScanIsWrittenAsItIsAfterAFilter) {
  imaging::HuVolume wrong = balls_;
  const std::size_t at = wrong.index(30, 4, 12);  // in muscle
  wrong.values[at] = 2000;
  ASSERT_TRUE(import::write_dicom_series(wrong, folder_ / "wrong", [](double) { return true; }));
  ASSERT_EQ(start({"export-scan", path("wrong"), path("as-is.nrrd")}).exit_code, 0);
  ASSERT_EQ(start({"export-scan", path("wrong"), path("median.nrrd"), "--median", "volume"}).exit_code, 0);
  const auto as_is = read_scan_file(folder_ / "as-is.nrrd"), median = read_scan_file(folder_ / "median.nrrd");
  ASSERT_TRUE(as_is && median);
  EXPECT_EQ(as_is->values[at], 2000);
  for (const std::size_t near : {at - 1, at, at + 1}) EXPECT_EQ(median->values[near], kMuscle_hu);
}

TEST_F(ScanCommands, ABoxLimitsTheIslands) {
  std::ofstream(folder_ / "box.yaml") << "edits: [{kind: box, corner_mm: [2, -99, -99], opposite_mm: [99, 99, 99]}]";
  const auto listed = start({"islands", path("ct"), path("islands.nrrd"), "--edits", path("box.yaml")});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  const auto islands = nlohmann::json::parse(listed.out)["islands"];
  ASSERT_EQ(islands.size(), 1u) << listed.out;
  EXPECT_NEAR(islands[0]["centre_mm"][0].get<double>(), kApart_mm, 0.5 * balls_.spacing_mm.x());
  std::ofstream(folder_ / "box.yaml") << "edits:\n  - {kind: box, corner_mm: [2, 0, 0]}";
  refused({"islands", path("ct"), path("none.nrrd"), "--edits", path("box.yaml")}, "line 2, edit 1: opposite_mm");
}

TEST_F(ScanCommands, EachSeriesHasAPicture) {
  const auto listed = start({"series", path("ct"), "--json", "--pictures", path("pictures")});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_EQ(nlohmann::json::parse(listed.out)["series"].size(), 1u);
  EXPECT_EQ(names_in(folder_ / "pictures"), std::set<std::string>{"series-1.png"});
  EXPECT_EQ(content(folder_ / "pictures" / "series-1.png").substr(1, 3), "PNG");
  refused({"series", path("ct"), "--pictures", path("pictures")}, "pictures");
  EXPECT_NE(start({"series", path("ct"), "--with-hu"}).exit_code, 0) << "there is no folder for them";
  ASSERT_EQ(start({"series", path("ct"), "--with-hu", "--pictures", path("both")}).exit_code, 0);
  EXPECT_EQ(names_in(folder_ / "both"), (std::set<std::string>{"series-1.nrrd", "series-1.png"}));
  const auto slice = read_scan_file(folder_ / "both" / "series-1.nrrd");
  ASSERT_TRUE(slice) << slice.error().message;
  EXPECT_EQ(slice->geometry.dims, (std::array<int, 3>{balls_.dims[0], balls_.dims[1], 1}));
  EXPECT_LT((slice->geometry.origin_mm - balls_.position_mm(Vec3(0, 0, 12))).norm(), 1e-6);
  EXPECT_TRUE(std::ranges::equal(slice->values,
                                 std::span(balls_.values).subspan(12 * slice->values.size(), slice->values.size())));
  fs::create_directory(folder_ / "empty");
  refused({"series", path("empty"), "--pictures", path("none")}, "empty");
}

}  // namespace
}  // namespace osteon::test
