// The report of an import: what it says, what it never says, and that it is there as a whole or not at all.
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "server/import/dicom_writer.hpp"
#include "server/import/import_report.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/label_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// 40 x 36 x 32 mm: a large block and a small one of bone, far apart, in soft tissue of 40 HU, and a nerve.
const TestGrid kGrid{.dims = {40, 36, 32}, .origin_mm = {-20.0, -18.0, 100.0}, .axes_mm = Eigen::Matrix3d::Identity()};
bool in_block(const Vec3& p, const Vec3& centre, double half_mm) {
  return (p - centre).cwiseAbs().maxCoeff() < half_mm;
}
int block_at(const Vec3& p) {
  return in_block(p, {-8.0, 0.0, 116.0}, 6.3) ? 1 : in_block(p, {11.0, 0.0, 116.0}, 3.3) ? 2 : 0;
}
int structure_at(const Vec3& p) { return in_block(p, {11.0, 0.0, 116.0}, 3.3) ? 52 : block_at(p) == 1 ? 75 : 0; }

std::string ct_file() {
  std::vector<int> hu;
  for (const int block : labels_of(kGrid, block_at)) hu.push_back(block != 0 ? 1000 : 40);
  return nifti_file(kGrid, {.code = 4, .bits = 16, .bytes = bytes_of<std::int16_t>(hu)});
}

class Report : public ::testing::Test {
 protected:
  void SetUp() override { write_bytes(folder_ / "ct.nii", ct_file()); }
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] test::RunResult import(std::vector<std::string> options) const {
    options.insert(options.begin(), {"ct", path("ct.nii")});
    return test::run(OSTEON_IMPORT_PROGRAM, options);
  }
  [[nodiscard]] nlohmann::json facts() const {
    return nlohmann::json::parse(test::content(folder_ / "report" / "report.json"));
  }
  test::TempDir folder_;
};

// Every element that is opened is closed, in order, but for those of HTML that never are.
void expect_well_formed(const std::string& html) {
  const std::set<std::string> open_ended{"meta", "img", "!DOCTYPE"};
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    const std::size_t end = html.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const bool closing = html[at + 1] == '/';
    const std::size_t begin = at + (closing ? 2 : 1);
    const std::string name = html.substr(begin, html.find_first_of(" >", begin) - begin);
    if (open_ended.contains(name)) continue;
    if (!closing) {
      open.push_back(name);
      continue;
    }
    ASSERT_FALSE(open.empty()) << name;
    ASSERT_EQ(open.back(), name);
    open.pop_back();
  }
  EXPECT_TRUE(open.empty());
}

TEST_F(Report, SaysWhatWasKeptAndWhatWasLeftOut) {
  const auto made = import({"--out", path("case"), "--report", path("report")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::set<std::string> names;
  for (const fs::path& file : files_of(folder_ / "report")) names.insert(file.filename());
  EXPECT_EQ(names,
            (std::set<std::string>{"report.html", "report.json", "montage.png", "islands.png", "histogram.png"}));
  const nlohmann::json report = facts();
  // The blocks have 13 and 7 voxels of 1 mm along an edge; the grid's voxels are at whole millimetres.
  const auto& parts = report.at("parts");
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_TRUE(parts[0].at("kept"));
  EXPECT_NEAR(parts[0].at("volume_cm3"), 13 * 13 * 13 * 1e-3, 1e-9);
  EXPECT_NEAR(parts[0].at("density_g_cm3"), 0.131 + 0.001067 * 1000.0, 1e-6);
  EXPECT_NEAR(parts[0].at("centre_mm")[0], -8.0, 1e-9);
  EXPECT_NE(parts[0].at("place").get<std::string>().find("right"), std::string::npos);
  EXPECT_FALSE(parts[1].at("kept"));
  EXPECT_NEAR(parts[1].at("volume_cm3"), 7 * 7 * 7 * 1e-3, 1e-9);
  EXPECT_EQ(report.at("threshold_hu"), 226.0);
  ASSERT_EQ(report.at("left_out").size(), 1u);
  EXPECT_NE(report.at("left_out")[0].get<std::string>().find("1 of 2 islands, 0.34 of 2.54"), std::string::npos);

  const std::string html = test::content(folder_ / "report" / "report.html");
  expect_well_formed(html);
  for (const char* text : {"bone 1", "left out", "226 HU", "2.20", "data:image/png;base64,iVBORw0KGgo"})
    EXPECT_NE(html.find(text), std::string::npos) << text;
  EXPECT_EQ(html.find("src=\"http"), std::string::npos) << "it needs no other file";
}

// The blocks in soft tissue, with air and a sheet of a table behind them.
TEST_F(Report, NamesTheTableAndSaysWhy) {
  const auto hu_at = [](const Vec3& p) {
    return block_at(p) != 0 ? 1000 : p.y() > 13.0 && p.y() < 15.0 ? 600 : p.y() < 9.0 ? 40 : -1000;
  };
  write_bytes(folder_ / "ct.nii",
              nifti_file(kGrid, {.code = 4, .bits = 16, .bytes = bytes_of<std::int16_t>(labels_of(kGrid, hu_at))}));
  const auto made = import({"--out", path("case"), "--report", path("report")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json report = facts();
  const auto& parts = report.at("parts");
  ASSERT_EQ(parts.size(), 3u);
  int tables = 0;
  for (const auto& part : parts) {
    const auto& island = part.at("island");
    if (island.at("kind") == "bone") {
      EXPECT_LT(island.at("exposed_share"), 0.05);
      continue;
    }
    ++tables;
    EXPECT_EQ(island.at("kind"), "table");
    EXPECT_FALSE(part.at("kept"));
    // Both faces of the sheet see air, and the one to the back sees outside.
    EXPECT_GT(island.at("at_air_share"), 0.9);
    EXPECT_GT(island.at("exposed_share"), 0.45);
  }
  EXPECT_EQ(tables, 1);
  ASSERT_EQ(report.at("left_out").size(), 2u);
  EXPECT_NE(report.at("left_out")[0].get<std::string>().find("Not bone: table or headrest, island "),
            std::string::npos);
  EXPECT_NE(report.at("left_out")[1].get<std::string>().find("1 of 3 islands, 0.34 of "), std::string::npos);
  const std::string html = test::content(folder_ / "report" / "report.html");
  expect_well_formed(html);
  EXPECT_NE(html.find("left out: table or headrest"), std::string::npos);
}

// A block of bone beside a vessel of 11 mm radius in which nothing is seen but contrast medium.
TEST_F(Report, NamesContrastMediumAndTheEvidence) {
  const TestGrid grid{.dims = {60, 30, 30}};
  const auto hu_at = [](const Vec3& p) {
    return std::hypot(p.x() - 16.0, p.y() - 15.0) < 11.0 ? 350 : in_block(p, {38.0, 15.0, 15.0}, 9.3) ? 1000 : 40;
  };
  write_bytes(folder_ / "ct.nii",
              nifti_file(grid, {.code = 4, .bits = 16, .bytes = bytes_of<std::int16_t>(labels_of(grid, hu_at))}));
  const auto made = import({"--out", path("case"), "--report", path("report")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json report = facts();
  ASSERT_EQ(report.at("parts").size(), 2u);
  int contrast = 0;
  for (const auto& part : report.at("parts")) contrast += part.at("island").at("kind") == "contrast" ? 1 : 0;
  EXPECT_EQ(contrast, 1);
  ASSERT_EQ(report.at("left_out").size(), 1u);
  EXPECT_EQ(report.at("left_out")[0].get<std::string>().find("Not bone: contrast medium, island "), 0u);
  const auto& steps = report.at("steps");
  const auto step = std::ranges::find(steps, "contrast medium", [](const auto& of) { return of.at("step"); });
  ASSERT_NE(step, steps.end());
  EXPECT_EQ(step->at("parameters").at("level_hu"), 350.0);
  EXPECT_EQ(step->at("parameters").at("noise_hu"), 0.0);
  const double vessel_cm3 = std::numbers::pi * 121.0 * 30.0 * 1e-3;
  EXPECT_NEAR(step->at("parameters").at("contrast_cm3"), vessel_cm3, 0.03 * vessel_cm3);
}

TEST_F(Report, TheHistogramCountsEveryVoxel) {
  ASSERT_EQ(import({"--out", path("case"), "--report", path("report")}).exit_code, 0);
  const nlohmann::json histogram = facts().at("histogram");
  const auto count = [](const nlohmann::json& of) {
    std::int64_t sum = of.at("below").get<std::int64_t>() + of.at("above").get<std::int64_t>();
    for (const std::int64_t voxels : of.at("voxels")) sum += voxels;
    return sum;
  };
  EXPECT_EQ(count(histogram.at("scan")), 40 * 36 * 32);
  EXPECT_EQ(count(histogram.at("bone")), 13 * 13 * 13);
  const int first = histogram.at("scan").at("first_hu"), bin = histogram.at("scan").at("bin_hu");
  EXPECT_EQ(histogram.at("scan").at("voxels")[static_cast<std::size_t>((1000 - first) / bin)],
            13 * 13 * 13 + 7 * 7 * 7);
}

TEST_F(Report, ShowsTheIslandsBeforeOneChooses) {
  const auto made = import({"--list", "--report", path("report"), "--title", "A <title> & more"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_FALSE(fs::exists(folder_ / "report" / "montage.png"));
  EXPECT_TRUE(fs::exists(folder_ / "report" / "islands.png"));
  EXPECT_EQ(facts().at("parts").size(), 2u);
  EXPECT_TRUE(facts().at("hash").get<std::string>().empty());
  const std::string html = test::content(folder_ / "report" / "report.html");
  expect_well_formed(html);
  EXPECT_NE(html.find("A &lt;title&gt; &amp; more"), std::string::npos);
}

TEST_F(Report, NamesStructuresAtRisk) {
  write_bytes(folder_ / "labels.nii", nifti_file(kGrid, structure_at));
  const auto made = import({"--labels", path("labels.nii"), "--label-names", "75=femur_left,52=sciatic_nerve",
                            "--truth", path("labels.nii"), "--out", path("case"), "--report", path("report")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const nlohmann::json report = facts();
  ASSERT_EQ(report.at("parts").size(), 2u);
  for (const auto& part : report.at("parts")) {
    const bool nerve = part.at("number") == 52;
    EXPECT_EQ(part.at("at_risk"), nerve);
    EXPECT_EQ(part.at("density_g_cm3").is_null(), nerve);
    EXPECT_EQ(part.at("name"), nerve ? "sciatic_nerve" : "femur_left");
    EXPECT_NEAR(part.at("centre_mm")[0], nerve ? 11.0 : -8.0, 1e-9);
  }
  EXPECT_TRUE(report.at("threshold_hu").is_null());
  // The labels are the truth itself.
  for (const auto& row : report.at("comparison").at("labels")) {
    EXPECT_EQ(row.at("dice"), 1.0) << row;
    EXPECT_EQ(row.at("mean_surface_distance_mm"), 0.0) << row;
    if (row.at("label") == "all bone") {
      EXPECT_FALSE(row.contains("matched_by"));
    } else {
      EXPECT_EQ(row.at("matched_by"), "name") << row;
    }
  }
  EXPECT_EQ(report.at("comparison").at("labels").size(), 3u) << "both, and all bone";
  const std::string html = test::content(folder_ / "report" / "report.html");
  expect_well_formed(html);
  EXPECT_NE(html.find("structure at risk"), std::string::npos);
}

TEST_F(Report, IntoAFolderThatExistsIsRefusedAndNothingIsLost) {
  fs::create_directory(folder_ / "report");
  write_bytes(folder_ / "report" / "mine.txt", "mine");
  const auto made = import({"--out", path("case"), "--report", path("report")});
  EXPECT_NE(made.exit_code, 0);
  EXPECT_NE(made.err.find("report is already there"), std::string::npos) << made.err;
  EXPECT_EQ(std::ranges::count(made.err, '\n'), 1) << made.err;
  EXPECT_EQ(test::content(folder_ / "report" / "mine.txt"), "mine");
  EXPECT_FALSE(fs::exists(folder_ / "case"));
  for (const char* inside : {"case/report", "case"}) {
    const auto nested = import({"--out", path("case"), "--report", path(inside)});
    EXPECT_NE(nested.exit_code, 0);
    EXPECT_NE(nested.err.find("are in one another"), std::string::npos) << nested.err;
    EXPECT_FALSE(fs::exists(folder_ / "case"));
  }
}

// Stopped at any time: neither the folder nor a part of it is there.
TEST_F(Report, StoppedIsNotThereAtAll) {
  CtScan scan{.volume = {}, .source = "test"};
  scan.volume.dims = kGrid.dims;
  scan.volume.origin_mm = kGrid.origin_mm;
  for (const int block : labels_of(kGrid, block_at)) scan.volume.values.push_back(block != 0 ? 1000 : 40);
  const ScanGeometry read{scan.volume.dims, scan.volume.origin_mm, Eigen::Matrix3d::Identity()};
  CtOptions options;
  options.draw_islands = true;
  const auto made = import_ct(std::move(scan), options, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  const ImportReport report{.bone = &*made->bone, .scan = &made->scan, .islands = &made->found, .read = read};
  const fs::path target = folder_ / "stopped";
  int calls = 0;
  ASSERT_TRUE(write_report(report, folder_ / "whole", [&](double) { return ++calls > 0; }));
  ASSERT_GT(calls, 100);
  for (int last = 0; last < calls; last += std::max(1, calls / 5)) {
    int left = last;
    const auto stopped = write_report(report, target, [&](double) { return left-- > 0; });
    ASSERT_FALSE(stopped) << last;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      EXPECT_FALSE(entry.path().filename().string().starts_with("stopped")) << entry.path();
  }
}

struct Secret {
  std::uint16_t group, element;
  std::string value;
};

TEST_F(Report, NothingInItNamesThePatientTheDateOrThePath) {
  const fs::path series = folder_ / "DOEQUIST_JANELLE" / "series";
  fs::create_directory(folder_ / "DOEQUIST_JANELLE");
  ASSERT_NO_FATAL_FAILURE(write_small_series(series));
  const std::vector<Secret> attributes{{0x0008, 0x0020, "20200229"},          {0x0008, 0x0050, "ACC0815"},
                                       {0x0008, 0x0080, "StElsewhere"},       {0x0008, 0x103e, "SeriesOfDoequist"},
                                       {0x0010, 0x0010, "DOEQUIST^JANELLE"},  {0x0010, 0x0020, "PID-123456"},
                                       {0x0010, 0x0030, "19570314"},          {0x0018, 0x1210, "KernelOfJanelle"},
                                       {0x0020, 0x000e, "1.2.826.0.1.4711.3"}};
  for (const fs::path& file : files_of(series))
    for (const Secret& a : attributes) set_tag(file, a.group, a.element, a.value);
  // A file beside the slices is named after the patient, too. Secrets are long, so that no picture has one by chance.
  write_bytes(series / "Janelle_notes.txt", "nothing");
  const auto made =
      test::run(OSTEON_IMPORT_PROGRAM, {"ct", series.string(), "--out", path("case"), "--report", path("report")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::string all;
  for (const fs::path& file : files_of(folder_ / "report")) all += test::content(file);
  ASSERT_NE(all.find("DICOM CT"), std::string::npos) << "what is there is found";
  std::vector<std::string> secrets{"DOEQUIST", "JANELLE", "Doequist", "Janelle", folder_.path().string()};
  for (const Secret& a : attributes) secrets.push_back(a.value);
  for (const std::string& secret : secrets) EXPECT_EQ(all.find(secret), std::string::npos) << secret;
}

// A segment that a person named after a patient becomes "label N" in a comparison.
TEST_F(Report, TheTruthsOwnNamesAreNotTaken) {
  const std::vector<int> voxels = labels_of(kGrid, block_at);
  NiftiVoxels labels{.code = 2, .bits = 8, .bytes = bytes_of<std::uint8_t>(voxels)};
  write_bytes(folder_ / "truth.nii", nifti_file(kGrid, labels, {{1, "Jane Doe left"}, {2, "nerve"}}));
  const auto made = import({"--truth", path("truth.nii"), "--out", path("case"), "--report", path("report")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_EQ(made.out.find("Doe"), std::string::npos) << made.out;
  EXPECT_EQ(test::content(folder_ / "report" / "report.json").find("Doe"), std::string::npos);
  const nlohmann::json row = facts().at("comparison").at("labels")[0];
  EXPECT_EQ(row.at("truth"), "label 1");
  EXPECT_EQ(row.at("matched_by"), "number");
  EXPECT_NE(test::content(folder_ / "report" / "report.html").find("<td>label 1</td><td>number</td>"),
            std::string::npos);
  EXPECT_EQ(row.at("dice"), 1.0);
}

// The scan ends within the large block at the head end, and nowhere else.
TEST_F(Report, WarnsOfBoneThatTheScanCutsOff) {
  ASSERT_EQ(import({"--out", path("whole"), "--report", path("report")}).exit_code, 0);
  const auto ends = [&] {
    std::vector<std::string> told;
    const std::vector<std::string> warnings = facts().at("warnings");
    for (const std::string& warning : warnings)
      if (warning.find("scan ends") != std::string::npos) told.push_back(warning);
    return told;
  };
  EXPECT_TRUE(ends().empty());
  TestGrid lower = kGrid;
  lower.dims[2] = 18;
  std::vector<int> hu;
  for (const int block : labels_of(lower, block_at)) hu.push_back(block != 0 ? 1000 : 40);
  write_bytes(folder_ / "ct.nii", nifti_file(lower, {.code = 4, .bits = 16, .bytes = bytes_of<std::int16_t>(hu)}));
  fs::remove_all(folder_ / "report");
  ASSERT_EQ(import({"--out", path("cut"), "--report", path("report")}).exit_code, 0);
  ASSERT_EQ(ends().size(), 1u);
  EXPECT_NE(ends().front().find("(head end)"), std::string::npos) << ends().front();
}

}  // namespace
}  // namespace osteon::import
