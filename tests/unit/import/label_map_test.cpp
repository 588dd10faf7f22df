// Label maps of all kinds: read, named, and placed on the voxels of a CT.
#include "server/import/label_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/import/placed_labels.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/label_files.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// A CT that is oblique to the patient.
TestGrid ct_grid() {
  TestGrid grid{.dims = {11, 9, 7}, .origin_mm = {-20.0, 35.0, 110.0}};
  Eigen::Matrix3d turn;
  turn << 0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0;
  grid.axes_mm = turn * Vec3(1.0, 1.5, 2.0).asDiagonal();
  return grid;
}

// Labels 3 and 7 as two boxes that touch, and 9 in single voxels.
int label_of(const TestGrid& grid, const Vec3& position_mm) {
  const Vec3 at = (grid.axes_mm.inverse() * (position_mm - grid.origin_mm)).array().round();
  const auto within = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
    return at.x() >= x0 && at.x() <= x1 && at.y() >= y0 && at.y() <= y1 && at.z() >= z0 && at.z() <= z1;
  };
  if (within(1, 4, 2, 6, 1, 5)) return 3;
  if (within(5, 6, 2, 3, 0, 4)) return 7;
  return within(10, 10, 8, 8, 6, 6) || within(0, 0, 0, 0, 0, 0) ? 9 : 0;
}

const std::vector<std::string> kNames{"3=femur_left,7=vein,9=sciatic nerve"};

class LabelMaps : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    write_bytes(folder_ / name, bytes);
    return folder_ / name;
  }
  // The labels of a file on the voxels of ct_grid().
  Result<PlacedLabels> placed(const fs::path& file, const std::vector<std::string>& names = kNames) const {
    auto map = read_label_map(file, keep_going);
    if (!map) return tl::unexpected(map.error());
    const auto given = parse_label_names(names);
    EXPECT_TRUE(given);
    return place_labels(std::move(*map), *given, scan_of(ct_grid(), [](const Vec3&) { return 0; }).volume, "1.2.3.4",
                        keep_going);
  }
  void expect_refused(const fs::path& file, const std::string& what, const std::vector<std::string>& names = kNames,
                      ErrorCode code = ErrorCode::invalid_input) const {
    const auto result = placed(file, names);
    ASSERT_FALSE(result) << what;
    EXPECT_EQ(result.error().code, code) << result.error().message;
    expect_one_sentence(result.error(), file.string());
    EXPECT_NE(result.error().message.find(what), std::string::npos) << result.error().message;
  }
  test::TempDir folder_;
  TestGrid grid_ = ct_grid();
  LabelAt label_at_ = [this](const Vec3& p) { return label_of(grid_, p); };
};

std::vector<std::uint8_t> drawn() {
  const TestGrid grid = ct_grid();
  std::vector<std::uint8_t> out;
  for (const int label : labels_of(grid, [&](const Vec3& p) { return label_of(grid, p); }))
    out.push_back(static_cast<std::uint8_t>(label));
  return out;
}

// The file's first axis may be any axis of the CT, in either direction.
TEST_F(LabelMaps, NiftiOfAnyAxesIsPlacedVoxelForVoxel) {
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int flips = 0; flips < 8; flips += 3) {
      const TestGrid turn = turned(grid_, order, {(flips & 1) != 0, (flips & 2) != 0, (flips & 4) != 0});
      const auto found = placed(write("labels.nii", nifti_file(turn, label_at_)));
      ASSERT_TRUE(found) << found.error().message;
      EXPECT_TRUE(found->same_grid);
      EXPECT_EQ(found->values.values, drawn()) << order[0] << order[1] << order[2] << " " << flips;
    }
  } while (std::ranges::next_permutation(order).found);
}

TEST_F(LabelMaps, EveryTypeOfNumbersWillDo) {
  const std::vector<int> values = labels_of(grid_, label_at_);
  const std::vector<NiftiVoxels> all{{2, 8, bytes_of<std::uint8_t>(values)},
                                     {4, 16, bytes_of<std::int16_t>(values)},
                                     {512, 16, bytes_of<std::uint16_t>(values)},
                                     {16, 32, bytes_of<float>(values)},
                                     {64, 64, bytes_of<double>(values)}};
  for (const NiftiVoxels& voxels : all) {
    const auto found = placed(write("labels.nii.gz", compressed(nifti_file(grid_, voxels))));
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->values.values, drawn()) << voxels.code;
  }
}

TEST_F(LabelMaps, LabelsKeepTheirNumbersAndSayWhereTheyComeFrom) {
  const auto found = placed(write("labels.nii", nifti_file(grid_, label_at_)));
  ASSERT_TRUE(found);
  ASSERT_EQ(found->labels.size(), 3u);
  EXPECT_EQ(found->labels[0].value, 3);
  EXPECT_EQ(found->labels[0].name, "femur_left");
  EXPECT_EQ(found->labels[0].kind, LabelKind::bone);
  EXPECT_EQ(found->labels[0].provenance.method, "label map, NIfTI");
  EXPECT_EQ(found->labels[0].provenance.parameters.at("number_in_file"), 3.0);
  EXPECT_EQ(found->labels[1].kind, LabelKind::vessel);
  EXPECT_EQ(found->labels[2].kind, LabelKind::nerve);
  EXPECT_NEAR(found->cm3[0], 4 * 5 * 5 * 3.0e-3, 1e-9) << "voxels of 1 x 1.5 x 2 mm";
}

TEST_F(LabelMaps, NumbersAbove255GetFreeOnes) {
  std::vector<int> values;
  for (const int label : labels_of(grid_, label_at_))
    values.push_back(label == 3 ? 1 : label == 7 ? 300 : label * 7000);
  const auto found = placed(write("labels.nii", nifti_file(grid_, {512, 16, bytes_of<std::uint16_t>(values)})),
                            {"1=femur,300=vein,63000=nerve"});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->labels.size(), 3u);
  EXPECT_EQ(found->labels[1].value, 2);
  EXPECT_EQ(found->labels[1].provenance.parameters.at("number_in_file"), 300.0);
  EXPECT_EQ(found->labels[2].value, 3);
  EXPECT_EQ(std::ranges::count(found->values.values, 2), std::ranges::count(drawn(), 7));
  EXPECT_EQ(std::ranges::count(found->values.values, 3), std::ranges::count(drawn(), 9));
}

TEST_F(LabelMaps, AFileThatDoesNotSayHowItLiesIsReported) {
  TestGrid near = grid_;
  near.axes_mm = Vec3(1.0, 1.5, 2.0).asDiagonal();
  std::string file = nifti_file(near, [](const Vec3&) { return 3; });
  const CtScan ct = scan_of({.dims = {30, 30, 30}, .origin_mm = {-15.0, -15.0, 0.0}}, [](const Vec3&) { return 0; });
  for (const bool oriented : {true, false}) {
    if (!oriented) file[254] = 0;  // no affine transform
    auto map = read_label_map(write("labels.nii", file), keep_going);
    ASSERT_TRUE(map) << map.error().message;
    EXPECT_EQ(map->oriented, oriented);
    map->grid.origin_mm = {-5.0, -5.0, 5.0};
    const auto found = place_labels(std::move(*map), *parse_label_names({"3=femur"}), ct.volume, "", keep_going);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(labels_text(*found, 1.0).find("left and right may be swapped") == std::string::npos, oriented);
  }
}

// A voxel of the CT takes the label whose voxel's centre is nearest, by comparison with all of them.
TEST_F(LabelMaps, AnotherGridGivesTheNearestLabel) {
  TestGrid coarse{.dims = {9, 9, 6}, .origin_mm = grid_.origin_mm + Vec3(-7.3, -1.1, -0.7)};
  coarse.axes_mm = Vec3(2.3, 2.1, 2.9).asDiagonal();
  const auto found = placed(write("labels.nii", nifti_file(coarse, label_at_)));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->same_grid);
  EXPECT_EQ(found->labels.at(0).provenance.method, "label map, NIfTI, nearest voxel");
  const Vec3 half = 0.5 * coarse.axes_mm.diagonal();
  std::size_t n = 0, different = 0;
  for (int k = 0; k < grid_.dims[2]; ++k)
    for (int j = 0; j < grid_.dims[1]; ++j)
      for (int i = 0; i < grid_.dims[0]; ++i, ++n) {
        double least = std::numeric_limits<double>::infinity();
        Vec3 nearest = Vec3::Zero();
        for (int z = 0; z < coarse.dims[2]; ++z)
          for (int y = 0; y < coarse.dims[1]; ++y)
            for (int x = 0; x < coarse.dims[0]; ++x)
              if (const double d = (coarse.position_mm(x, y, z) - grid_.position_mm(i, j, k)).norm(); d < least) {
                least = d;
                nearest = coarse.position_mm(x, y, z);
              }
        const Vec3 offset = (nearest - grid_.position_mm(i, j, k)).cwiseAbs();
        const int expected = (offset.array() > half.array()).any() ? 0 : label_at_(nearest);
        ASSERT_EQ(found->values.values[n], expected) << i << " " << j << " " << k;
        different += expected != label_at_(grid_.position_mm(i, j, k)) ? 1 : 0;
      }
  EXPECT_GT(different, 0u) << "the grids differ";
}

TEST_F(LabelMaps, AScanThatIsLargerThanItsLabelsHasNoneBeyondThem) {
  const TestGrid part{.dims = {6, 4, 3}, .origin_mm = grid_.position_mm(1, 2, 1), .axes_mm = grid_.axes_mm};
  const auto found = placed(write("labels.nii", nifti_file(part, label_at_)), {"3=femur,7=vein,9=nerve"});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(found->same_grid);
  EXPECT_EQ(std::ranges::count(found->values.values, 3), 4 * 4 * 3);
  EXPECT_EQ(std::ranges::count(found->values.values, 9), 0) << "they lie beyond the labels' voxels";
  EXPECT_EQ(found->labels.size(), 2u);
}

TEST_F(LabelMaps, LabelsBeyondTheCtAreReported) {
  TestGrid larger = grid_;
  larger.dims[0] += 6;
  const Vec3 end = grid_.position_mm(12, 4, 4);
  const auto found = placed(write(
      "labels.nii", nifti_file(larger, [&](const Vec3& p) { return (p - end).norm() < 4.0 ? 3 : label_at_(p); })));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(found->beyond_cm3, 0.0);
  EXPECT_NE(labels_text(*found, 1.0).find("\nbeyond "), std::string::npos);
}

TEST_F(LabelMaps, SlicerSegmentationsBringTheirNames) {
  const std::string fields =
      slicer_segment(0, "Femur left", 3, 0) + slicer_segment(1, "Vein", 7, 0) +
      slicer_segment(2, "Segment_3", 9, 0, "TerminologyEntry:List~SCT^1^Anatomical Structure~SCT^2^Nerve~^^~|");
  for (const auto& [order, flipped] : std::vector<std::pair<std::array<int, 3>, std::array<bool, 3>>>{
           {{0, 1, 2}, {false, false, false}}, {{2, 0, 1}, {true, false, true}}}) {
    const TestGrid turn = turned(grid_, order, flipped);
    const auto found = placed(write("a.seg.nrrd", nrrd_file(turn, labels_of(turn, label_at_), 1, fields)), {});
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->values.values, drawn());
    ASSERT_EQ(found->labels.size(), 3u);
    EXPECT_EQ(found->labels[0].name, "Femur left");
    EXPECT_EQ(found->labels[0].provenance.method, "label map, 3D Slicer segmentation");
    EXPECT_EQ(found->labels[2].name, "Nerve") << "its type, because its name says nothing";
  }
}

// Layers hold segments that may overlap, each with values of its own.
TEST_F(LabelMaps, LayersOfASlicerSegmentationAreReadOneByOne) {
  std::vector<int> values;
  for (const int label : labels_of(grid_, label_at_))
    for (const int other : {label == 3 ? 1 : 0, label == 7 ? 1 : label == 9 ? 2 : 0}) values.push_back(other);
  const std::string named =
      slicer_segment(0, "femur", 1, 0) + slicer_segment(1, "vein", 1, 1) + slicer_segment(2, "nerve", 2, 1);
  const auto found = placed(write("a.seg.nrrd", nrrd_file(grid_, values, 2, named)), {});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->labels.size(), 3u);
  EXPECT_EQ(found->labels[0].name, "femur");
  EXPECT_EQ(found->labels[2].name, "vein") << "1 was taken, so it got the next number";
  EXPECT_EQ(found->labels[2].value, 3);
  EXPECT_EQ(found->labels[2].provenance.parameters.at("number_in_file"), 1.0);
  for (const auto& [name, label] : {std::pair("femur", 3), std::pair("vein", 7), std::pair("nerve", 9)}) {
    const auto entry = std::ranges::find(found->labels, name, &CaseLabel::name);
    ASSERT_NE(entry, found->labels.end());
    EXPECT_EQ(std::ranges::count(found->values.values, entry->value), std::ranges::count(drawn(), label)) << name;
  }
}

// As Slicer wrote them until 2020.
TEST_F(LabelMaps, BinaryLayersWithoutValuesAreOneSegmentEach) {
  std::vector<int> values;
  for (const int label : labels_of(grid_, label_at_))
    for (const int own : {3, 7, 9}) values.push_back(label == own ? 1 : 0);
  const std::string fields = "Segment0_Name:=femur\nSegment1_Name:=vein\nSegment2_Name:=nerve\n";
  const auto found = placed(write("old.seg.nrrd", nrrd_file(grid_, values, 3, fields)), {});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->labels.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(std::ranges::count(found->values.values, found->labels[i].value),
              std::ranges::count(drawn(), std::array<int, 3>{3, 7, 9}[i == 0                            ? 0
                                                                      : found->labels[i].name == "vein" ? 1
                                                                                                        : 2]));
}

TEST_F(LabelMaps, AFolderHasOneFileForEachStructure) {
  fs::create_directory(folder_ / "structures");
  for (const auto& [name, label] : {std::pair("femur_left", 3), std::pair("iliac_artery_left", 7),
                                    std::pair("spinal_cord", 9), std::pair("liver", 77), std::pair("spleen", 78)})
    write_bytes(folder_ / "structures" / (std::string(name) + ".nii.gz"),
                compressed(nifti_file(grid_, [&, own = label](const Vec3& p) {
                  return label_at_(p) == own || (own == 77 && label_at_(p) == 9) ? 1 : 0;
                })));
  const auto found = placed(folder_ / "structures", {});
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->labels.size(), 3u);
  EXPECT_EQ(found->labels[0].name, "femur_left");
  EXPECT_EQ(found->labels[0].provenance.method, "label map, folder of label files");
  EXPECT_TRUE(found->labels[0].provenance.parameters.empty()) << "the order of the files says nothing";
  EXPECT_EQ(std::ranges::count(found->values.values, found->labels[0].value), std::ranges::count(drawn(), 3));
  ASSERT_EQ(found->left_out.size(), 1u) << "the spleen has no voxels";
  EXPECT_EQ(found->left_out[0].name, "liver");
  EXPECT_NE(labels_text(*found, 1.0).find("left out   liver, 0.01 cm3\n"), std::string::npos)
      << labels_text(*found, 1.0);
}

TEST_F(LabelMaps, NamesOfTotalSegmentatorComeByNumberOrFromTheHeader) {
  const std::vector<int> labels = labels_of(grid_, label_at_);
  std::vector<int> values;
  for (const int label : labels) values.push_back(label == 3 ? 75 : label == 7 ? 52 : label == 9 ? 5 : 0);
  const NiftiVoxels voxels{.bytes = bytes_of<std::uint8_t>(values)};
  const auto by_number = placed(write("total.nii", nifti_file(grid_, voxels)), {"totalsegmentator"});
  const auto by_header =
      placed(write("named.nii.gz",
                   compressed(nifti_file(grid_, voxels,
                                         {{5, "liver"}, {52, "aorta"}, {75, "femur_left"}, {76, "femur_right"}}))),
             {});
  for (const auto* found : {&by_number, &by_header}) {
    ASSERT_TRUE(*found) << found->error().message;
    ASSERT_EQ((*found)->labels.size(), 2u);
    EXPECT_EQ((*found)->labels[0].name, "aorta");
    EXPECT_EQ((*found)->labels[1].name, "femur_left");
    EXPECT_EQ((*found)->labels[1].value, 75);
    ASSERT_EQ((*found)->left_out.size(), 1u);
    EXPECT_EQ((*found)->left_out[0].name, "liver");
  }
}

std::vector<int> mask_of(const std::vector<int>& labels, int own) {
  std::vector<int> mask;
  for (const int label : labels) mask.push_back(label == own ? 1 : 0);
  return mask;
}

class DicomSegments : public LabelMaps {
 protected:
  [[nodiscard]] std::vector<SegSegment> segments(const TestGrid& grid) const {
    const std::vector<int> labels = labels_of(grid, label_at_);
    return {{1, "Femur", "", mask_of(labels, 3)},
            {2, "Segment 2", "Vein", mask_of(labels, 7)},
            {5, "Nerve", "", mask_of(labels, 9)}};
  }
  [[nodiscard]] fs::path write_seg(const SegOptions& options) const {
    return write("labels.dcm", seg_file(grid_, segments(grid_), options));
  }
};

// 11 x 9 pixels of a frame are no whole number of bytes.
TEST_F(DicomSegments, FramesLieByTheirPositions) {
  SegOptions all;
  all.with_empty_frames = true;
  SegOptions with_gap;
  with_gap.slice_gap_mm = 2.0;
  for (const SegOptions& options : {SegOptions{}, all, with_gap}) {
    const auto found = placed(write_seg(options), {});
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_TRUE(found->same_grid);
    ASSERT_EQ(found->labels.size(), 3u);
    EXPECT_EQ(found->labels[1].name, "Vein") << "its coded type";
    EXPECT_EQ(found->labels[2].value, 5);
    EXPECT_EQ(found->labels[0].provenance.method, "label map, DICOM SEG");
    std::vector<std::uint8_t> expected = drawn();
    for (std::uint8_t& value : expected) value = value == 3 ? 1 : value == 7 ? 2 : value == 9 ? 5 : 0;
    EXPECT_EQ(found->values.values, expected);
  }
}

TEST_F(DicomSegments, FramesInAnotherPlaneThanTheCtAreTurned) {
  const TestGrid turn = turned(grid_, {2, 1, 0}, {true, false, false});
  ASSERT_GT(turn.axes_mm.determinant(), 0.0) << "slices go along the normal of the frames";
  const auto found = placed(write("labels.dcm", seg_file(turn, segments(turn))), {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(found->same_grid);
  EXPECT_EQ(std::ranges::count(found->values.values, 1), std::ranges::count(drawn(), 3));
  for (std::size_t i = 0; i < drawn().size(); ++i) ASSERT_EQ(found->values.values[i] == 1, drawn()[i] == 3) << i;
}

TEST_F(DicomSegments, AFolderWithTheFileWillDo) {
  fs::create_directory(folder_ / "seg");
  write_bytes(folder_ / "seg" / "1.dcm", seg_file(grid_, segments(grid_)));
  EXPECT_TRUE(placed(folder_ / "seg", {}));
}

TEST_F(DicomSegments, WrongFilesAreRefusedInASentence) {
  const auto refused = [&](const SegOptions& options, const std::string& what,
                           ErrorCode code = ErrorCode::invalid_input) {
    SCOPED_TRACE(what);
    expect_refused(write_seg(options), what, {}, code);
  };
  refused({.type = "FRACTIONAL"}, "fractional", ErrorCode::unsupported);
  refused({.sop_class = "1.2.840.10008.5.1.4.1.1.66.7"}, "label map of DICOM", ErrorCode::unsupported);
  refused({.sop_class = "1.2.840.10008.5.1.4.1.1.2"}, "is no DICOM SEG");
  refused({.syntax = "1.2.840.10008.1.2.5"}, "compressed", ErrorCode::unsupported);
  refused({.frame_of_reference = "1.2.3.5"}, "another frame of reference");
  refused({.without_positions = true}, "without its position");
  refused({.shift_mm = 0.3}, "above each other");
  refused({.missing_bytes = 4}, "cut off");
  refused({.listed_number = 77}, "segment 77");
  const std::string whole = seg_file(grid_, segments(grid_));
  for (const double part : {0.2, 0.5, 0.9}) {
    const auto file =
        write("cut.dcm", whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))));
    expect_refused(file, ";", {});
  }
}

TEST_F(LabelMaps, UnknownLabelsAreNamedWithWhatToWrite) {
  const fs::path file = write("labels.nii", nifti_file(grid_, label_at_));
  expect_refused(file, "label 3, label 7, label 9 are; write --label-names 3=NAME", {});
  expect_refused(file, "label 9 is; write --label-names 9=NAME or 9=NAME:KIND, with the kind bone, ",
                 {"3=femur,7=vein"});
  expect_refused(write("a.seg.nrrd", nrrd_file(grid_, labels_of(grid_, label_at_), 1,
                                               slicer_segment(0, "Doe Jane", 3, 0) + slicer_segment(1, "vein", 7, 0))),
                 "\"Doe Jane\", label 9 are; write --label-names Doe Jane=NAME", {});
  expect_refused(write("other.nii", nifti_file(grid_, [&](const Vec3& p) { return label_at_(p) == 0 ? 0 : 200; })),
                 "label 200 is", {"totalsegmentator"});
}

TEST_F(LabelMaps, WrongValuesAreRefused) {
  std::vector<int> values = labels_of(grid_, label_at_);
  const auto with = [&](NiftiVoxels voxels) { return write("labels.nii", nifti_file(grid_, voxels)); };
  values[5] = -2;
  expect_refused(with({4, 16, bytes_of<std::int16_t>(values)}), "a voxel of -2");
  values[5] = 0;
  std::string floats = bytes_of<float>(values);
  const float half = 2.5f;
  floats.replace(40, sizeof half, reinterpret_cast<const char*>(&half), sizeof half);
  expect_refused(with({16, 32, floats}), "a voxel of 2.5");
  expect_refused(with({8, 32, bytes_of<std::int32_t>(std::vector<int>(values.size(), 70000))}), "a voxel of 70000");
  expect_refused(with({2, 8, std::string(values.size(), '\0')}), "no labelled voxel");
}

TEST_F(LabelMaps, LabelsOfAnotherPlaceAreRefused) {
  TestGrid far = grid_;
  far.origin_mm.x() += 500.0;
  const auto shifted = [&](const Vec3& p) { return label_at_(p - Vec3(500.0, 0.0, 0.0)); };
  expect_refused(write("labels.nii", nifti_file(far, shifted)), "no label within the CT");
}

TEST_F(LabelMaps, TwoLabelsInOneVoxelAreRefused) {
  std::vector<int> values;
  for (const int label : labels_of(grid_, label_at_))
    values.push_back(label == 3 ? 1 : 0), values.push_back(label == 7 ? 1 : 0);
  for (std::size_t i = 0; i < values.size(); i += 2)
    if (values[i] == 1) {
      values[i + 1] = 1;
      break;
    }
  const std::string fields = slicer_segment(0, "femur", 1, 0) + slicer_segment(1, "vein", 1, 1);
  const auto file = write("a.seg.nrrd", nrrd_file(grid_, values, 2, fields));
  expect_refused(file,
                 "a.seg.nrrd: \"femur\" and \"vein\" are both in 1 voxel; let each voxel have one label, or leave one "
                 "out by --label-names vein=NAME:none",
                 {});
  const auto without = placed(file, {"vein=NAME:none"});
  ASSERT_TRUE(without) << without.error().message << " - what is left out shares no voxel";
  EXPECT_EQ(std::ranges::count(without->values.values, 1), std::ranges::count(drawn(), 3));
}

TEST_F(LabelMaps, AMapWithoutBoneIsRefused) {
  expect_refused(write("labels.nii", nifti_file(grid_, label_at_)), "has no bone", {"3=vein,7=nerve,9=dura"});
}

TEST_F(LabelMaps, BrokenFilesAreRefused) {
  const std::string nifti = nifti_file(grid_, label_at_);
  expect_refused(write("cut.nii", nifti.substr(0, nifti.size() - 100)), "ends before its last voxel");
  expect_refused(write("cut.nii", nifti.substr(0, 200)), "has no labels; give");
  expect_refused(write("text.nii", "nothing"), "has no labels; give");
  const std::string nrrd = nrrd_file(grid_, labels_of(grid_, label_at_), 1, slicer_segment(0, "femur", 3, 0));
  expect_refused(write("cut.seg.nrrd", nrrd.substr(0, nrrd.size() - 30)), ";");
  expect_refused(
      write("bad.seg.nrrd", nrrd_file(grid_, labels_of(grid_, label_at_), 1, slicer_segment(0, "femur", -3, 0))),
      "Segment0_LabelValue");
  expect_refused(write("colours.nrrd", nrrd_file(grid_, std::vector<int>(3 * grid_.count(), 1), 3, "")),
                 "several numbers", {}, ErrorCode::unsupported);
  expect_refused(folder_ / "absent.nii", "there is no file", {}, ErrorCode::not_found);
  fs::create_directory(folder_ / "empty");
  expect_refused(folder_ / "empty", "has no file of labels");
}

TEST_F(LabelMaps, FilesOfAFolderMustHaveTheSameVoxels) {
  fs::create_directory(folder_ / "s");
  write_bytes(folder_ / "s" / "femur.nii", nifti_file(grid_, label_at_));
  EXPECT_TRUE(read_label_map(folder_ / "s", keep_going)) << "alone, a file may have several labels";
  write_bytes(folder_ / "s" / "tibia.nii", nifti_file(grid_, label_at_));
  const auto several = read_label_map(folder_ / "s", keep_going);
  ASSERT_FALSE(several);
  expect_one_sentence(several.error(), "several labels");
  const auto one = [](const Vec3&) { return 1; };
  write_bytes(folder_ / "s" / "femur.nii", nifti_file(grid_, one));
  TestGrid other = grid_;
  other.origin_mm.z() += 0.5;
  write_bytes(folder_ / "s" / "tibia.nii", nifti_file(other, one));
  const auto shifted = read_label_map(folder_ / "s", keep_going);
  ASSERT_FALSE(shifted);
  expect_one_sentence(shifted.error(), "other voxels than femur.nii");
}

TEST_F(LabelMaps, ReadingStopsWhenAsked) {
  const auto never = [](double) { return false; };
  for (const fs::path& file : {write("labels.nii", nifti_file(grid_, label_at_)),
                               write("a.seg.nrrd", nrrd_file(grid_, labels_of(grid_, label_at_), 1, ""))}) {
    const auto map = read_label_map(file, never);
    ASSERT_FALSE(map);
    EXPECT_EQ(map.error().code, ErrorCode::cancelled) << map.error().message;
  }
}

}  // namespace
}  // namespace osteon::import
