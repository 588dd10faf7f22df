// `osteon-import report`: tables of known bones, its files, and its sentences.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/runtime/files.hpp"
#include "common/subvolumes/subvolume_file.hpp"
#include "server/import/subvolume_report.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/subvolume_checks.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::array<int, 3> kScanDims{40, 36, 24};

// A shaft on a foot, and a small ball beside them that is another island.
bool is_bone_of_scan(int x, int y, int z) {
  const int half = z < 8 ? 10 : 3;
  return z >= 2 && z < 22 && std::abs(x - 18) <= half && std::abs(y - 16) <= half;
}

CtScan shaft_scan() {
  CtScan scan;
  scan.volume.dims = kScanDims;
  scan.volume.spacing_mm = Vec3(0.5, 0.5, 1.0);
  scan.volume.values.assign(scan.volume.count(), -1000);
  for (int z = 0; z < kScanDims[2]; ++z)
    for (int y = 0; y < kScanDims[1]; ++y)
      for (int x = 0; x < kScanDims[0]; ++x) {
        const bool beside = x >= 35 && x < 38 && y >= 30 && y < 33 && z >= 12 && z < 15;
        if (is_bone_of_scan(x, y, z) || beside) scan.volume.values[scan.volume.index(x, y, z)] = 1200;
      }
  scan.source = "test, 40x36x24";
  return scan;
}

SubVolumeInput shaft_input() { return *input_of_scan(shaft_scan(), 226.0, keep_going); }

CarveStep through_the_foot() {
  return {*find_tool("burr-round-5"),
          {pose_along({2.0, 8.0, 4.0}, {0, 0, -1}), pose_along({16.0, 8.0, 4.0}, {0, 0, -1})},
          {}};
}

TEST(SubVolumeInput, IsTheLargestBone) {
  const SubVolumeInput input = shaft_input();
  std::size_t i = 0;
  for (int z = 0; z < kScanDims[2]; ++z)
    for (int y = 0; y < kScanDims[1]; ++y)
      for (int x = 0; x < kScanDims[0]; ++x, ++i)
        ASSERT_EQ(input.bone[i] != 0, is_bone_of_scan(x, y, z)) << x << " " << y << " " << z;
  const auto none = input_of_scan(shaft_scan(), 2000.0, keep_going);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::invalid_input);
}

TEST(SubVolumeMeasures, OfAShaftOnAFootAreKnown) {
  MeasureOptions options;
  options.steps = {through_the_foot()};
  const auto m = measure_sub_volumes(shaft_input(), options, keep_going);
  ASSERT_TRUE(m) << m.error().message;
  expect_consistent(*m);
  EXPECT_EQ(m->original.voxels, 40 * 36 * 24);
  EXPECT_EQ(m->object_box.voxels, 21 * 21 * 20);
  ASSERT_EQ(m->sections.size(), 2u);
  EXPECT_EQ(m->section_sum.voxels, 21 * 21 * 6 + 7 * 7 * 14);
  EXPECT_EQ(m->section_sum.voxels, m->bone);  // both sections are full
  for (const auto& row : m->subdivisions) EXPECT_EQ(row.all_full(), 2);
  // Both are one sub-volume each, until the tool divides the one that it meets.
  EXPECT_EQ(m->listed, 2);
  ASSERT_EQ(m->steps.size(), 1u);
  EXPECT_EQ(m->steps[0].poses, 15);  // a millimetre from each to the next
  EXPECT_GT(m->steps[0].made, 0);
  EXPECT_GT(m->steps[0].walk.removed, 0);
  EXPECT_GE(m->steps[0].walk.modified, m->steps[0].walk.removed);
}

TEST(SubVolumeMeasures, StopAtEachQuestion) {
  MeasureOptions options;
  options.steps = {through_the_foot()};
  const SubVolumeInput input = shaft_input();
  int questions = 0;
  double last = 0.0;
  ASSERT_TRUE(measure_sub_volumes(input, options, [&](double fraction) {
    EXPECT_GE(fraction, last - 1e-9) << "progress never goes back";
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    return ++questions > 0;
  }));
  for (int stop = 1; stop <= questions; stop += 1 + questions / 12) {
    int asked = 0;
    const auto stopped = measure_sub_volumes(input, options, [&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped) << stop;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

TEST(SubVolumeReport, ShowsTheBoxesOnTheBone) {
  const SubVolumeInput input = shaft_input();
  const auto m = measure_sub_volumes(input, {}, keep_going);
  ASSERT_TRUE(m);
  const auto picture = boxes_picture(input, *m, keep_going);
  ASSERT_TRUE(picture);
  // The object box is white, and each section has its colour. Bone has neither.
  const auto pixels = [&](Colour colour) {
    int count = 0;
    for (int y = 22; y < picture->height(); ++y)
      for (int x = 0; x < 460; ++x) count += picture->at(x, y) == colour;
    return count;
  };
  EXPECT_GT(pixels(kWhiteInk), 400);
  EXPECT_GT(pixels(palette_colour(0)), 100);
  EXPECT_GT(pixels(palette_colour(1)), 100);
  const auto bone = *bone_colours()[1];
  int of_bone = 0;
  for (int y = 22; y < picture->height(); ++y)
    for (int x = 0; x < 460; ++x) {
      const Colour c = picture->at(x, y);
      of_bone += c.red > 40 && c.red <= bone.red && c.red > c.green && c.green > c.blue;
    }
  EXPECT_GT(of_bone, 5000);
}

TEST(SubVolumeReport, IsThereAsAWholeOrNotAtAll) {
  const test::TempDir folder;
  const SubVolumeInput input = shaft_input();
  const auto m = measure_sub_volumes(input, {}, keep_going);
  ASSERT_TRUE(m);
  const auto stopped = write_sub_volumes(input, *m, folder / "out", [](double done) { return done < 0.5; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  ASSERT_TRUE(write_sub_volumes(input, *m, folder / "out", keep_going));
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder / "out")) names.push_back(entry.path().filename().string());
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("Meta.dat", "SBB1.dat", "SBB2.dat", "boxes.png", "report.txt",
                                                     "report.json"));
  const auto all = subvolumes::read_sub_volumes(folder / "out" / "Meta.dat", keep_going);
  ASSERT_TRUE(all) << all.error().message;
  for (std::size_t i = 0; i < all->size(); ++i)
    EXPECT_EQ((*all)[i], subvolumes::data_of(input.voxels(), m->sections[i]));
  const auto text = read_file(folder / "out" / "report.json");
  ASSERT_TRUE(text);
  const nlohmann::json report = nlohmann::json::parse(*text);
  EXPECT_EQ(report["table_5_1"]["section_sum"]["voxels"], m->section_sum.voxels);
  EXPECT_EQ(report["table_5_3"].size(), 4u);
  EXPECT_EQ(report["sections"].size(), 2u);
  // The files' sizes are those of the table.
  std::int64_t bytes = 0;
  for (const char* name : {"SBB1.dat", "SBB2.dat"})
    bytes += static_cast<std::int64_t>(fs::file_size(folder / "out" / name));
  EXPECT_EQ(bytes, m->section_sum.file_bytes);
}

// The files of a section lie where the section was, so the box around them is the object box.
TEST(SubVolumeInput, OfItsOwnFilesIsTheObjectBox) {
  const test::TempDir folder;
  const SubVolumeInput input = shaft_input();
  const auto m = measure_sub_volumes(input, {}, keep_going);
  ASSERT_TRUE(m);
  ASSERT_TRUE(write_sub_volumes(input, *m, folder / "out", keep_going));
  const fs::path meta = folder / "out" / "Meta.dat";
  ASSERT_TRUE(is_meta_file(meta));
  const auto again = input_of_files(meta, 226.0, keep_going);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->hu, voxels_of_box(input.voxels(), m->object).hu);
  const auto measured = measure_sub_volumes(*again, {}, keep_going);
  ASSERT_TRUE(measured);
  EXPECT_EQ(measured->bone, m->bone);
  EXPECT_EQ(measured->section_sum.voxels, m->section_sum.voxels);
  EXPECT_EQ(measured->original.voxels, m->object_box.voxels);
  EXPECT_FALSE(input_of_files(meta, 2000.0, keep_going));
  // Half a voxel aside, and a kilometre away.
  const auto text = read_file(folder / "out" / "SBB2.dat");
  ASSERT_TRUE(text);
  const std::size_t at = text->find("ORIGIN "), end = text->find('\n', at);
  for (const char* origin : {"ORIGIN 7.75 6.5 8", "ORIGIN 1e+06 6.5 8", "ORIGIN 7.5 6.5 1e+300"}) {
    ASSERT_TRUE(write_file(folder / "out" / "SBB2.dat", text->substr(0, at) + origin + text->substr(end)));
    const auto refused = input_of_files(meta, 226.0, keep_going);
    ASSERT_FALSE(refused) << origin;
    EXPECT_EQ(refused.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(refused.error().message, HasSubstr("ORIGIN"));
  }
}

class SubVolumeProgram : public ::testing::Test {
 protected:
  SubVolumeProgram() {
    const CtScan scan = shaft_scan();
    std::ofstream(folder_ / "scan.raw", std::ios::binary)
        .write(reinterpret_cast<const char*>(scan.volume.values.data()),
               static_cast<std::streamsize>(2 * scan.volume.count()));
    std::ofstream(folder_ / "script.yaml")
        << "steps: [{tool: burr-round-5, from: [2, 8, 4], to: [16, 8, 4], axis: [0, 0, -1]}]\n";
  }
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  // With the options of the raw scan.
  [[nodiscard]] test::RunResult run(std::vector<std::string> more, const char* command = "report") const {
    std::vector<std::string> arguments{command, path("scan.raw"), "--size", "40,36,24", "--spacing", "0.5,0.5,1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run(OSTEON_IMPORT_PROGRAM, arguments);
  }
  void expect_sentence(const test::RunResult& result, const std::string& named) const {
    EXPECT_NE(result.exit_code, 0) << result.out;
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr(named));
  }
  test::TempDir folder_;
};

TEST_F(SubVolumeProgram, PrintsTheTablesOfAScanAndOfItsCase) {
  const auto scan = run({"--out", path("out"), "--carve", path("script.yaml"), "--subdivisions", "4"});
  ASSERT_EQ(scan.exit_code, 0) << scan.err;
  for (const char* part : {"Table 5.1", "Table 5.2", "Table 5.3", "original data", "OpenVDB tree", "burr-round-5",
                           "2 sections of 6 14 slices", "read again to the same bytes"})
    EXPECT_THAT(scan.out, HasSubstr(part));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "boxes.png"));
  const auto files = test::run(OSTEON_IMPORT_PROGRAM, {"report", path("out/Meta.dat")});
  ASSERT_EQ(files.exit_code, 0) << files.err;
  EXPECT_THAT(files.out, HasSubstr("2 sections of 6 14 slices"));
  ASSERT_EQ(run({"--out", path("case")}, "ct").exit_code, 0);
  const auto of_case = test::run(OSTEON_IMPORT_PROGRAM, {"report", path("case"), "--carve", path("script.yaml")});
  ASSERT_EQ(of_case.exit_code, 0) << of_case.err;
  EXPECT_THAT(of_case.out, HasSubstr("2 sections of 6 14 slices"));
  const auto of_source = test::run(OSTEON_IMPORT_PROGRAM, {"report", path("case"), "--source", path("scan.raw"),
                                                           "--size", "40,36,24", "--spacing", "0.5,0.5,1"});
  ASSERT_EQ(of_source.exit_code, 0) << of_source.err;
  EXPECT_THAT(of_source.out, HasSubstr("2 sections of 6 14 slices"));
  EXPECT_THAT(of_source.out, HasSubstr("40"));
}

// The voxels of the case at their place in the scan.
TEST(SubVolumeInput, OfACaseInItsSourceIsThatOfTheSource) {
  const SubVolumeInput whole = shaft_input();
  const std::array<int, 3> first{5, 3, 1}, dims{30, 26, 22};
  SubVolumeInput of_case{.geometry = {dims, whole.geometry.position_mm(Vec3(5, 3, 1)), whole.geometry.axes_mm},
                         .hu = {},
                         .bone = {},
                         .threshold_hu = whole.threshold_hu,
                         .what = "a case"};
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x)
        of_case.bone.push_back(is_bone_of_scan(x + first[0], y + first[1], z + first[2]) ? 1 : 0);
  const auto placed = input_in_source(of_case, shaft_scan(), "scan");
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_EQ(placed->bone, whole.bone);
  EXPECT_EQ(placed->hu, whole.hu);
  EXPECT_EQ(placed->geometry, whole.geometry);
  SubVolumeInput half_a_voxel = of_case, beyond = of_case, before = of_case, coarser = of_case;
  half_a_voxel.geometry.origin_mm.x() += 0.25;
  beyond.geometry.origin_mm.z() += 2.0;
  before.geometry.origin_mm.z() -= 2.0;
  coarser.geometry.axes_mm *= 1.01;
  for (const SubVolumeInput& wrong : {half_a_voxel, beyond, before, coarser}) {
    const auto refused = input_in_source(wrong, shaft_scan(), "scan");
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("--source"));
  }
}

// Two pieces of a row, with a number each.
TEST(SubVolumeInput, OfMarksIsWhatHasANumber) {
  LabelMap marks;
  marks.file = "marks.nrrd";
  marks.grid = shaft_scan().volume;
  marks.segments = {{.number = 1, .name = {}, .type = {}, .runs = {{3, 6, 5, 2}}},
                    {.number = 9, .name = {}, .type = {}, .runs = {{30, 39, 35, 23}}}};
  const auto input = input_of_marked(shaft_scan(), marks, 226.0, keep_going);
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_EQ(std::ranges::count(input->bone, 1), 14);
  EXPECT_EQ(input->bone[input->voxels().index({3, 5, 2})], 1);
  EXPECT_EQ(input->bone[input->voxels().index({39, 35, 23})], 1);
  EXPECT_EQ(input->hu, shaft_scan().volume.values);
  LabelMap half_a_voxel = marks, coarser = marks, fewer = marks;
  half_a_voxel.grid.origin_mm.x() += 0.25;
  coarser.grid.spacing_mm *= 1.01;
  fewer.grid.dims[2] -= 1;
  for (const LabelMap& wrong : {half_a_voxel, coarser, fewer}) {
    const auto refused = input_of_marked(shaft_scan(), wrong, 226.0, keep_going);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("marks.nrrd"));
    EXPECT_THAT(refused.error().message, HasSubstr("--bone"));
  }
  EXPECT_FALSE(input_of_marked(shaft_scan(), marks, 226.0, [](double) { return false; }));
}

TEST_F(SubVolumeProgram, TakesBoneFromALabelMap) {
  ASSERT_EQ(run({path("islands.nrrd")}, "islands").exit_code, 0);
  const auto all = run({"--bone", path("islands.nrrd")});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  // The shaft on its foot, and the ball beside them.
  EXPECT_THAT(all.out, HasSubstr("bone       " + std::to_string(21 * 21 * 6 + 7 * 7 * 14 + 27) + " voxels"));
  EXPECT_THAT(all.out, HasSubstr("4 sections of 6 4 3 7 slices"));
}

TEST_F(SubVolumeProgram, SaysInOneSentenceWhatIsWrong) {
  fs::create_directories(folder_ / "out");
  expect_sentence(run({"--out", path("out")}), "already there");
  expect_sentence(run({"--carve", path("none.yaml")}), "; check its name");
  expect_sentence(test::run(OSTEON_IMPORT_PROGRAM, {"report", path("none")}), "there is no file or folder");
  expect_sentence(run({"--subdivisions", "9"}), "--subdivisions");
  ASSERT_EQ(run({"--out", path("case")}, "ct").exit_code, 0);
  expect_sentence(test::run(OSTEON_IMPORT_PROGRAM, {"report", path("case"), "--threshold", "300"}), "--threshold");
  expect_sentence(test::run(OSTEON_IMPORT_PROGRAM, {"report", path("case"), "--series", "1"}), "leave out");
  expect_sentence(run({"--source", path("case")}), "--source is for a case");
  expect_sentence(test::run(OSTEON_IMPORT_PROGRAM, {"report", path("case"), "--bone", path("none.nrrd")}),
                  "--bone is for a scan");
  expect_sentence(run({"--bone", path("none.nrrd")}), "none.nrrd");
  ASSERT_EQ(test::run(OSTEON_IMPORT_PROGRAM,
                      {"phantom", "block", "--layers", "4:1.5", "--width", "6", "--out", path("block")})
                .exit_code,
            0);
  expect_sentence(test::run(OSTEON_IMPORT_PROGRAM, {"report", path("block")}), path("block"));
}

}  // namespace
}  // namespace osteon::import
