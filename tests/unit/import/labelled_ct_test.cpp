// A CT with a label map: what becomes bone, what the case keeps as a structure at risk, and labels that come out again.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "server/import/ct_import.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/label_export.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/label_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// 32 x 28 x 24 mm, mirrored along x. Two bones that touch, a vein far from both, and a screw in the first.
TestGrid mirrored_grid() {
  TestGrid grid{.dims = {32, 28, 24}, .origin_mm = {16.0, -14.0, 100.0}};
  grid.axes_mm = Vec3(-1.0, 1.0, 1.0).asDiagonal();
  return grid;
}
constexpr int kFemur = 75, kTibia = 40, kVein = 52, kScrew = 200;
bool in_ball(const Vec3& p, const Vec3& centre, double radius_mm) { return (p - centre).norm() <= radius_mm; }
int label_at(const Vec3& p) {
  if (in_ball(p, {4.0, 0.0, 112.0}, 2.0)) return kScrew;
  if (in_ball(p, {4.0, 0.0, 112.0}, 6.0)) return p.x() > 0.0 ? kFemur : kTibia;
  return in_ball(p, {-12.0, 10.0, 104.0}, 2.0) ? kVein : 0;
}
// The scan is darker than the threshold of bone everywhere: only labels can find the bone.
int hu_at(const Vec3& p) { return label_at(p) == 0 ? -50 : label_at(p) == kVein ? 60 : 200; }

const std::vector<std::string> kKinds{"75=femur_left,40=tibia_left,52=vein,200=screw"};

CtOptions narrow() {
  CtOptions options;
  options.margin_mm = 2.0;
  return options;
}

Result<CtImport> labelled_case(const CtOptions& options = narrow(), const KeepGoing& going = keep_going) {
  const TestGrid grid = mirrored_grid();
  const test::TempDir folder;
  write_bytes(folder / "labels.nii", nifti_file(turned(grid, {1, 2, 0}, {true, false, false}), label_at));
  auto map = read_label_map(folder / "labels.nii", keep_going);
  EXPECT_TRUE(map) << map.error().message;
  CtScan scan = scan_of(grid, hu_at);
  auto placed = place_labels(std::move(*map), *parse_label_names(kKinds), scan.volume, "", keep_going);
  EXPECT_TRUE(placed) << placed.error().message;
  return import_ct(std::move(scan), std::move(*placed), options, going);
}

TEST(LabelledCt, BonesAreCarvedAndTheirVolumeIsThatOfTheLabels) {
  const auto made = labelled_case();
  ASSERT_TRUE(made) << made.error().message;
  double voxels = 0;
  for (const int label : labels_of(mirrored_grid(), label_at)) voxels += label != 0 && label != kVein ? 1.0 : 0.0;
  EXPECT_NEAR(made->bone->volume_mm3() / voxels, 1.0, 0.02);
  // A smooth surface lies within half a voxel of the ball that was drawn.
  for (const Vec3& way :
       {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, -1), Vec3(0.6, 0.0, 0.8), Vec3(0.5, 0.5, 0.70710678)})
    EXPECT_NEAR(made->bone->surface_mm(Vec3(4.0, 0.0, 112.0) + 6.0 * way), 0.0, 0.6) << way.transpose();
  EXPECT_GT(made->bone->surface_mm({-12.0, 10.0, 104.0}), 0.0) << "the vein is no bone";
}

TEST(LabelledCt, EachBoneHasTheNumberOfItsLabel) {
  const auto made = labelled_case();
  ASSERT_TRUE(made);
  const auto number_at = [&](const Vec3& p) {
    const Vec3 sample = (p / made->bone->pitch_mm()).array().round();
    return made->bone->bone_number(
        {static_cast<int>(sample.x()), static_cast<int>(sample.y()), static_cast<int>(sample.z())});
  };
  EXPECT_EQ(number_at({8.0, 0.0, 112.0}), kFemur);
  EXPECT_EQ(number_at({-1.0, 0.0, 112.0}), kTibia);
  EXPECT_EQ(number_at({4.0, 0.0, 112.0}), kScrew);
  // No sample of bone has a number that is no label, as just beyond the voxels.
  const CoordBox box = made->bone->bounds_samples();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const int number = made->bone->bone_number({x, y, z});
        ASSERT_TRUE(number == 0 || number == kFemur || number == kTibia || number == kScrew) << number;
      }
}

TEST(LabelledCt, TheScanKeepsAllLabelsAndTheTissueThatTheyName) {
  const auto made = labelled_case();
  ASSERT_TRUE(made);
  const ScanGeometry& geometry = made->scan.geometry;
  std::size_t n = 0;
  std::array<std::int64_t, 256> counts{};
  for (int k = 0; k < geometry.dims[2]; ++k)
    for (int j = 0; j < geometry.dims[1]; ++j)
      for (int i = 0; i < geometry.dims[0]; ++i, ++n) {
        const Vec3 at = geometry.position_mm({1.0 * i, 1.0 * j, 1.0 * k});
        const int label = label_at(at);
        ASSERT_EQ(made->scan.labels[n], label);
        ASSERT_EQ(made->scan.hu[n], hu_at(at));
        // Metal by its label, though its HU are those of cancellous bone (0.131 + 0.001067 · 200 g/cm³).
        ASSERT_EQ(made->scan.tissue[n], label == kScrew ? 3 : label == kFemur || label == kTibia ? 2 : 0);
        ++counts[static_cast<std::size_t>(label)];
      }
  for (const int label : {kFemur, kTibia, kVein, kScrew}) {
    const auto all = labels_of(mirrored_grid(), label_at);
    EXPECT_EQ(counts[static_cast<std::size_t>(label)], std::ranges::count(all, label)) << label;
  }
  const CaseInfo& info = made->bone->info();
  ASSERT_EQ(info.labels.size(), 4u);
  EXPECT_EQ(info.labels[1].name, "vein");
  EXPECT_EQ(info.labels[1].kind, LabelKind::vessel);
  EXPECT_EQ(info.labels[1].provenance.method, "label map, NIfTI");
  EXPECT_EQ(info.threshold_hu, 0.0) << "no threshold was used";
  const auto metal = std::ranges::find(info.tissues, LabelKind::metal, &CaseLabel::kind);
  ASSERT_NE(metal, info.tissues.end());
  EXPECT_EQ(metal->provenance.method, "HU, or as its label says");
}

// HU of 200 are 0.34 g/cm³, the density of cancellous bone.
TEST(LabelledCt, SamplesHaveTheTissueThatTheirLabelNames) {
  const TestGrid grid{.dims = {16, 12, 10}};
  const auto halves = [](const Vec3& p) { return p.x() < 3.0 || p.x() > 12.0 ? 0 : p.x() < 8.0 ? 1 : 2; };
  const test::TempDir folder;
  write_bytes(folder / "labels.nii", nifti_file(grid, halves));
  auto map = read_label_map(folder / "labels.nii", keep_going);
  ASSERT_TRUE(map) << map.error().message;
  CtScan scan = scan_of(grid, [](const Vec3&) { return 200; });
  auto placed =
      place_labels(std::move(*map), *parse_label_names({"1=shell:cortical,2=femur"}), scan.volume, "", keep_going);
  ASSERT_TRUE(placed) << placed.error().message;
  const auto made = import_ct(std::move(scan), std::move(*placed), {.pitch_mm = 1.0}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->bone->tissue({5, 6, 5}), Tissue::cortical);
  EXPECT_EQ(made->bone->tissue({10, 6, 5}), Tissue::trabecular);
}

TEST(LabelledCt, BoneEndsWhereTheScanEnds) {
  const TestGrid grid{.dims = {12, 12, 10}};
  const auto all = [](const Vec3& p) { return p.x() >= 4.0 ? 1 : 0; };
  const test::TempDir folder;
  write_bytes(folder / "labels.nii", nifti_file(grid, all));
  auto map = read_label_map(folder / "labels.nii", keep_going);
  ASSERT_TRUE(map) << map.error().message;
  CtScan scan = scan_of(grid, [](const Vec3&) { return 500; });
  auto placed = place_labels(std::move(*map), *parse_label_names({"1=femur"}), scan.volume, "", keep_going);
  ASSERT_TRUE(placed) << placed.error().message;
  const auto made = import_ct(std::move(scan), std::move(*placed), {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NEAR(made->bone->volume_mm3(), 8.0 * 12.0 * 10.0, 0.02 * 8.0 * 12.0 * 10.0);
  EXPECT_NEAR(made->bone->surface_mm({8.0, 5.0, -0.5}), 0.0, 0.01);
  EXPECT_NEAR(made->bone->surface_mm({11.5, 5.0, 5.0}), 0.0, 0.01);
}

TEST(LabelledCt, TheImportStopsWhereverItIsAsked) {
  for (const double last : {0.0, 0.02, 0.08, 0.2, 0.3, 0.5, 0.7, 0.86, 0.95}) {
    const auto made = labelled_case(narrow(), [&](double done) { return done < last; });
    ASSERT_FALSE(made) << last;
    EXPECT_EQ(made.error().code, ErrorCode::cancelled) << made.error().message;
  }
}

// The voxels of a NIfTI-1 file by their positions, as its header describes them.
void expect_nifti_has_labels(const std::string& bytes) {
  const auto number = [&]<class T>(std::size_t at, T value) {
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  ASSERT_EQ(number(70, std::int16_t{}), 2) << "bytes";
  ASSERT_GT(number(254, std::int16_t{}), 0) << "it has an affine transform";
  std::array<int, 3> dims{};
  for (std::size_t d = 0; d < 3; ++d) dims[d] = number(42 + 2 * d, std::int16_t{});
  std::size_t at = static_cast<std::size_t>(number(108, 0.0f)), found = 0;
  for (int k = 0; k < dims[2]; ++k)
    for (int j = 0; j < dims[1]; ++j)
      for (int i = 0; i < dims[0]; ++i, ++at) {
        Vec3 p;
        for (std::size_t row = 0; row < 3; ++row) {
          const auto part = [&](std::size_t c) { return static_cast<double>(number(280 + 16 * row + 4 * c, 0.0f)); };
          const double ras = part(0) * i + part(1) * j + part(2) * k + part(3);
          p[static_cast<Eigen::Index>(row)] = row < 2 ? -ras : ras;
        }
        ASSERT_EQ(static_cast<unsigned char>(bytes[at]), label_at(p.array().round())) << p.transpose();
        found += bytes[at] != 0 ? 1 : 0;
      }
  const auto all = labels_of(mirrored_grid(), label_at);
  EXPECT_EQ(found, static_cast<std::size_t>(std::ranges::count_if(all, [](int label) { return label != 0; })));
}

class LabelProgram : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write_inputs() const {
    const TestGrid grid = mirrored_grid();
    write_bytes(folder_ / "ct.nii", nifti_file(grid, {4, 16, bytes_of<std::int16_t>(labels_of(grid, hu_at))}));
    const TestGrid turn = turned(grid, {2, 0, 1}, {false, true, false});
    const std::string fields = slicer_segment(0, "femur left", kFemur, 0) + slicer_segment(1, "tibia", kTibia, 0) +
                               slicer_segment(2, "vein", kVein, 0) + slicer_segment(3, "screw", kScrew, 0);
    fs::create_directory(folder_ / "DOE_JANE");
    write_bytes(folder_ / "DOE_JANE" / "doe.seg.nrrd", nrrd_file(turn, labels_of(turn, label_at), 1, fields));
  }
  [[nodiscard]] test::RunResult run(const std::vector<std::string>& arguments) const {
    return test::run(OSTEON_IMPORT_PROGRAM, arguments);
  }
  test::TempDir folder_;
};

TEST_F(LabelProgram, LabelsComeOutAsTheyWentIn) {
  write_inputs();
  const auto made =
      run({"ct", path("ct.nii"), "--labels", path("DOE_JANE/doe.seg.nrrd"), "--out", path("case"), "--margin", "1"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const char* line :
       {"threshold  none; bones come from a label map\n", "labels     number     cm3  structure\n", "    75    ",
        "femur left (bone), in the bone\n", "vein (vessel), at risk\n", "grid       that of the CT, voxel for voxel\n"})
    EXPECT_NE(made.out.find(line), std::string::npos) << line << "is not in\n" << made.out;
  const std::string json = test::content(folder_ / "case" / "case.json");
  EXPECT_NE(json.find("label map, 3D Slicer segmentation"), std::string::npos) << json;
  for (const char* secret : {"DOE", "doe", "seg.nrrd", "JANE"}) EXPECT_EQ(json.find(secret), std::string::npos);

  const auto nifti = run({"export-labels", path("case"), path("out.nii.gz")});
  ASSERT_EQ(nifti.exit_code, 0) << nifti.err;
  EXPECT_NE(nifti.out.find("52=vein:vessel\n"), std::string::npos) << nifti.out;
  expect_nifti_has_labels(uncompressed(test::content(folder_ / "out.nii.gz")));
  ASSERT_EQ(run({"export-labels", path("case"), path("out.nii")}).exit_code, 0);
  expect_nifti_has_labels(test::content(folder_ / "out.nii"));

  // What was exported for 3D Slicer makes the same case, with its names.
  ASSERT_EQ(run({"export-labels", path("case"), path("out.seg.nrrd")}).exit_code, 0);
  const auto again =
      run({"ct", path("ct.nii"), "--labels", path("out.seg.nrrd"), "--out", path("again"), "--margin", "1"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(test::content(folder_ / "again" / "case.json"), json);
}

// A series and its segmentation name one frame of reference.
TEST_F(LabelProgram, DicomSegmentsBelongToTheirSeries) {
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder_ / "series"));
  for (const fs::path& file : files_of(folder_ / "series")) set_tag(file, 0x0020, 0x0052, "1.2.826.0.1.4711.4");
  const auto scan = read_dicom_series(folder_ / "series", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  const imaging::HuVolume& volume = scan->volume;
  const TestGrid grid{.dims = volume.dims,
                      .origin_mm = volume.origin_mm,
                      .axes_mm = volume.directions * volume.spacing_mm.asDiagonal()};
  std::vector<int> mask;
  for (const std::int16_t hu : volume.values) mask.push_back(hu > 500 ? 1 : 0);
  SegOptions options;
  options.frame_of_reference = "1.2.826.0.1.4711.4";
  write_bytes(folder_ / "seg.dcm", seg_file(grid, {{1, "Tibia", "", mask}}, options));
  const auto made = run({"ct", path("series"), "--labels", path("seg.dcm"), "--out", path("case")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string json = test::content(folder_ / "case" / "case.json");
  EXPECT_NE(json.find("label map, DICOM SEG"), std::string::npos) << json;
  for (const char* secret : {"4711", "DOE", "JANE", "1.2.3"}) EXPECT_EQ(json.find(secret), std::string::npos) << secret;
  options.frame_of_reference = "1.2.826.0.1.4711.5";
  write_bytes(folder_ / "other.dcm", seg_file(grid, {{1, "Tibia", "", mask}}, options));
  const auto other = run({"ct", path("series"), "--labels", path("other.dcm"), "--out", path("other")});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.err.find("another frame of reference"), std::string::npos) << other.err;
}

TEST_F(LabelProgram, ASlicerFileSaysWhereEachSegmentIs) {
  write_inputs();
  ASSERT_EQ(run({"ct", path("ct.nii"), "--labels", path("DOE_JANE"), "--out", path("case"), "--margin", "0"}).exit_code,
            0);
  ASSERT_EQ(run({"export-labels", path("case"), path("out.seg.nrrd")}).exit_code, 0);
  const std::string file = test::content(folder_ / "out.seg.nrrd");
  const std::string header = file.substr(0, file.find("\n\n"));
  for (const char* line : {"Segment0_Name:=tibia\n", "Segment0_LabelValue:=40\n", "Segment1_Name:=vein\n",
                           "Segment1_Layer:=0\n", "Segmentation_ReferenceImageExtentOffset:=0 0 0\n"})
    EXPECT_NE((header + "\n").find(line), std::string::npos) << line << "is not in\n" << header;
  // The vein: a ball of 2 mm around (-12, 10, 104), in the box of all labels, from x = 10 down, y = -6 and z = 102 up.
  EXPECT_NE(header.find("Segment1_Extent:=20 24 14 18 0 4\n"), std::string::npos) << header;
}

TEST_F(LabelProgram, WrongArgumentsAreRefused) {
  write_inputs();
  const auto refused = [&](std::vector<std::string> arguments, const std::string& what) {
    const auto result = run(arguments);
    EXPECT_NE(result.exit_code, 0) << what;
    EXPECT_EQ(result.out, "");
    // One sentence, after the progress if there was some.
    const std::size_t at = result.err.find("osteon-import: ");
    ASSERT_NE(at, std::string::npos) << result.err;
    const std::string sentence = result.err.substr(at);
    EXPECT_NE(sentence.find(what), std::string::npos) << sentence;
    EXPECT_EQ(std::ranges::count(sentence, '\n'), 1) << sentence;
    EXPECT_EQ(result.err.find("**"), std::string::npos) << "a library spoke: " << result.err;
  };
  const std::string labels = path("DOE_JANE/doe.seg.nrrd");
  refused({"ct", path("ct.nii"), "--labels", labels, "--threshold", "200", "--out", path("case")}, "--labels");
  refused({"ct", path("ct.nii"), "--labels", labels, "--keep", "1", "--out", path("case")}, "--labels");
  refused({"ct", path("ct.nii"), "--label-names", "1=femur", "--out", path("case")}, "--labels");
  refused({"ct", path("ct.nii"), "--labels", path("ct.nii"), "--out", path("case")}, "a voxel of -50");
  EXPECT_FALSE(fs::exists(folder_ / "case"));
  ASSERT_EQ(run({"ct", path("ct.nii"), "--labels", labels, "--out", path("case")}).exit_code, 0);
  refused({"export-labels", path("case"), path("out.dcm")}, "does not end in .nii.gz, .nii, .seg.nrrd or .nrrd");
  refused({"export-labels", path("case"), path("ct.nii")}, "already there");
  refused({"export-labels", path("case"), path("no/folder/out.nii")}, "cannot write");
  refused({"export-labels", path("absent"), path("out.nii")}, "absent");
  ASSERT_EQ(
      run({"phantom", "block", "--layers", "4:1.9", "--width", "4", "--pitch", "1", "--out", path("block")}).exit_code,
      0);
  refused({"export-labels", path("block"), path("out.nii")}, "has no scan");
  EXPECT_FALSE(fs::exists(folder_ / "out.nii"));
}

}  // namespace
}  // namespace osteon::import
