// The edit list that the window writes, against the reader of osteon-import.
#include "viewer_client/imaging/imaging_edits.hpp"

#include <gtest/gtest.h>

#include "server/import/edit_file.hpp"

namespace osteon {
namespace {

using import::EditKind;
using import::LabelEdit;

SharedCorrection shared(Correction correction) { return std::make_shared<const Correction>(std::move(correction)); }

std::vector<LabelEdit> read_again(const ImagingEdits& edits) {
  const auto read = import::parse_edits(edit_list_text(edits), "edits.yaml");
  EXPECT_TRUE(read) << read.error().message << edit_list_text(edits);
  return read.value_or(std::vector<LabelEdit>{});
}

// The same positions, bit for bit, in the same order.
TEST(ImagingEdits, SeedsAreThoseOfTheImporter) {
  ImagingEdits edits;
  edits.seeds = {{{1.0 / 3.0, -20.1, 1e-3}, 1}, {{-0.1, 1e4 / 7.0, 5.0}, 7}, {{1, 2, 3}, 0}};
  const auto read = read_again(edits);
  ASSERT_EQ(read.size(), 3u);
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].kind, i == 2 ? EditKind::outside : EditKind::seed);
    EXPECT_EQ(read[i].bone, edits.seeds[i].bone);
    EXPECT_EQ(read[i].points_mm, std::vector<Vec3>{edits.seeds[i].at_mm});
  }
}

TEST(ImagingEdits, EachKindIsThatOfTheImporter) {
  ImagingEdits edits;
  edits.box = MarkedBox{{1.0 / 3.0, 2, 3}, {4, 5, -6.7}};
  edits.corrections = {
      shared({CorrectionKind::paint, 3, {{1, 2, 3}}, 2.5, Vec3::Zero()}),
      shared({CorrectionKind::paint, 4, {{1, 2, 3}, {4, 5, 6}}, 0.5, Vec3::UnitY()}),
      shared({CorrectionKind::erase, 0, {{7, 8, 9}}, 1.5, Vec3::Zero()}),
      shared({CorrectionKind::erase, 0, {{7, 8, 9}, {1, 1, 1}, {2, 2, 2}}, 1.5, Vec3::Zero()}),
      shared({CorrectionKind::cut, 3, {{0, 0, 1}}, 0.0, Vec3(0, 0.6, 0.8)}),
  };
  edits.labels = {{3, "femur \"left\" \\ 1", 40, 12.3456}};
  const auto read = read_again(edits);
  ASSERT_EQ(read.size(), 7u);
  EXPECT_EQ(read[0].kind, EditKind::box);
  EXPECT_EQ(read[0].points_mm, (std::vector<Vec3>{edits.box->corner_mm, edits.box->opposite_mm}));
  constexpr std::array kKinds{EditKind::paint, EditKind::scribble, EditKind::erase, EditKind::erase, EditKind::cut};
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    const LabelEdit& edit = read[i + 1];
    EXPECT_EQ(edit.kind, kKinds[i]);
    EXPECT_EQ(edit.bone, edits.corrections[i]->bone);
    EXPECT_EQ(edit.points_mm, edits.corrections[i]->points_mm);
    EXPECT_EQ(edit.radius_mm, edits.corrections[i]->radius_mm);
    EXPECT_NEAR((edit.normal - edits.corrections[i]->normal).norm(), 0.0, 1e-15);
  }
  EXPECT_EQ(read[6].kind, EditKind::label);
  EXPECT_EQ(read[6].name, "femur \"left\" \\ 1");
  EXPECT_EQ(read[6].opacity, 0.4);
  EXPECT_EQ(read[6].minutes, 12.35) << "hundredths";
}

TEST(ImagingEdits, LandmarksAreThoseOfTheImporter) {
  ImagingEdits edits;
  EXPECT_EQ(next_landmark(edits), "landmark 1");
  put_landmark(edits, "landmark 1", {1, 2, 3});
  put_landmark(edits, "tip \"of\" \\ nail: 1", {1.0 / 3.0, -20.1, 1e-3});
  EXPECT_EQ(next_landmark(edits), "landmark 2");
  put_landmark(edits, "landmark 1", {7, 8, 9});  // moves
  const auto read = read_again(edits);
  ASSERT_EQ(read.size(), 2u);
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].kind, EditKind::landmark);
    EXPECT_EQ(read[i].name, edits.landmarks[i].name);
    EXPECT_EQ(read[i].points_mm, std::vector<Vec3>{edits.landmarks[i].at_mm});
  }
  EXPECT_EQ(read[0].points_mm.front(), Vec3(7, 8, 9));
}

TEST(ImagingEdits, LandmarksAreRenamedAndRemoved) {
  ImagingEdits edits;
  put_landmark(edits, "a", {1, 2, 3});
  put_landmark(edits, "b", {4, 5, 6});
  EXPECT_FALSE(rename_landmark(edits, "a", "b"));
  EXPECT_FALSE(rename_landmark(edits, "c", "d"));
  EXPECT_FALSE(rename_landmark(edits, "a", ""));
  EXPECT_FALSE(rename_landmark(edits, "a", std::string(61, 'x')));
  EXPECT_TRUE(rename_landmark(edits, "a", "a")) << "its own name";
  EXPECT_TRUE(rename_landmark(edits, "a", "c"));
  ASSERT_EQ(edits.landmarks.size(), 2u);
  EXPECT_EQ(edits.landmarks[0], (MarkedLandmark{"c", {1, 2, 3}}));
  remove_landmark(edits, "c");
  ASSERT_EQ(edits.landmarks.size(), 1u);
  EXPECT_EQ(edits.landmarks[0].name, "b");
}

TEST(ImagingEdits, TheFirstLineIsTheCommand) {
  ImagingEdits edits;
  edits.threshold_hu = 300.0;
  edits.filter = {MedianFilter::slice, 0.75};
  EXPECT_TRUE(edit_list_text(edits).starts_with(
      "# osteon-import ct --threshold 300 --median slice --gaussian 0.75 --edits THIS_FILE\n"));
}

// No edit of the importer has more than 1000 points. The parts of a stroke meet, so that it has no gap.
TEST(ImagingEdits, ALongStrokeIsSeveralEdits) {
  Correction stroke{CorrectionKind::erase, 0, {}, 1.0, Vec3::Zero()};
  for (int i = 0; i < 2500; ++i) stroke.points_mm.emplace_back(i, i % 2, 0);
  ImagingEdits edits;
  edits.corrections = {shared(stroke)};
  const auto read = read_again(edits);
  ASSERT_EQ(read.size(), 3u);
  std::vector<Vec3> points = read[0].points_mm;
  for (std::size_t i = 1; i < read.size(); ++i) {
    EXPECT_EQ(read[i].points_mm.front(), points.back());
    points.insert(points.end(), read[i].points_mm.begin() + 1, read[i].points_mm.end());
  }
  EXPECT_EQ(points, stroke.points_mm);
  EXPECT_TRUE(is_listable(edits));
}

TEST(ImagingEdits, AListThatTheImporterRefusesIsFull) {
  ImagingEdits edits;
  for (int i = 0; i < 1000; ++i) edits.seeds.push_back({Vec3(i, 0, 0), 1});
  EXPECT_TRUE(is_listable(edits));
  EXPECT_EQ(read_again(edits).size(), 1000u);
  edits.seeds.push_back({Vec3(0, 1, 0), 1});
  EXPECT_FALSE(is_listable(edits));
  EXPECT_FALSE(import::parse_edits(edit_list_text(edits), "edits.yaml"));
  // 990 points of 20 bytes at least, in 100 strokes: more than 1 MiB.
  edits.seeds.clear();
  const SharedCorrection stroke =
      shared({CorrectionKind::erase, 0, std::vector<Vec3>(990, {10.25, 10.25, 10.25}), 1.0});
  edits.corrections.assign(100, stroke);
  EXPECT_FALSE(is_listable(edits));
}

TEST(ImagingEdits, NamesThatTheImporterRefusesAreNoNames) {
  ImagingEdits edits;
  edits.labels = {{1, "femur", 100, 0.0}, {2, "bone 2", 100, 0.0}};
  for (const char* name :
       {"", "tibia\n", "bone 2", "femur", "a name that is as long as a sentence and is no name of a bone"})
    EXPECT_FALSE(may_be_called(edits, 3, name)) << name;
  for (const char* name : {"tibia", "bone 3", "Schädel", "true", "12", "a: b, {c}", "# no"}) {
    ASSERT_TRUE(may_be_called(edits, 3, name)) << name;
    ImagingEdits named = edits;
    own_label(named, 3).name = name;
    EXPECT_EQ(read_again(named).back().name, name);
  }
  EXPECT_TRUE(may_be_called(edits, 1, "femur")) << "its own";
}

TEST(ImagingEdits, ANewBoneHasANumberThatIsFree) {
  ImagingEdits edits;
  EXPECT_EQ(next_bone(edits), 1);
  edits.seeds = {{{0, 0, 0}, 1}, {{0, 0, 0}, 3}, {{0, 0, 0}, 0}};
  EXPECT_EQ(next_bone(edits), 2);
  edits.corrections = {shared({CorrectionKind::paint, 2, {{0, 0, 0}}, 1.0})};
  EXPECT_EQ(next_bone(edits), 4);
  own_label(edits, 4).minutes = 1.0;
  EXPECT_EQ(next_bone(edits), 4) << "nobody has named it";
  own_label(edits, 4).name = "rib";
  EXPECT_EQ(next_bone(edits), 5);
}

// The importer refuses a stroke beside the scan or its box, and a cut of a bone that is not there.
TEST(ImagingEdits, WhatComesToNothingIsLeftOutWhenTheBoneIsMade) {
  ScanGeometry scan;
  scan.dims = {20, 20, 20};
  ImagingEdits edits;
  edits.box = MarkedBox{{5, 5, 5}, {10, 10, 10}};
  edits.corrections = {
      shared({CorrectionKind::cut, 2, {{7, 7, 7}}, 0.0, Vec3::UnitX()}),
      shared({CorrectionKind::paint, 2, {{12, 7, 7}}, 1.9}),            // 2 mm beside the box
      shared({CorrectionKind::erase, 0, {{12, 7, 7}}, 2.0}),            // on its edge
      shared({CorrectionKind::erase, 0, {{1, 1, 1}, {7, 7, 7}}, 0.1}),  // into it
      shared({CorrectionKind::cut, 2, {{7, 7, 7}}, 0.0, Vec3::UnitX()}),
      shared({CorrectionKind::cut, 1, {{7, 7, 7}}, 0.0, Vec3::UnitX()}),
      shared({CorrectionKind::paint, 2, {{7, 7, 7}}, 1.0}),
      shared({CorrectionKind::cut, 2, {{7, 7, 7}}, 0.0, Vec3::UnitX()}),
  };
  const std::vector<KeptSeed> seeds{{{6, 6, 6}, 1}};
  const ImagingEdits made = made_edits(edits, seeds, scan);
  EXPECT_EQ(made.seeds, seeds);
  EXPECT_EQ(made.corrections, (std::vector{edits.corrections[2], edits.corrections[3], edits.corrections[5],
                                           edits.corrections[6], edits.corrections[7]}));
}

// The importer sees the parts of a long stroke one by one.
TEST(ImagingEdits, APartOfALongStrokeBesideTheBoxIsLeftOut) {
  ScanGeometry scan;
  scan.dims = {20, 20, 20};
  ImagingEdits edits;
  edits.box = MarkedBox{{5, 5, 5}, {10, 10, 10}};
  Correction stroke{CorrectionKind::erase, 0, {}, 0.1};
  for (int i = 0; i < 1000; ++i) stroke.points_mm.emplace_back(1, 1 + i % 2, 1);
  for (int i = 0; i < 500; ++i) stroke.points_mm.emplace_back(7, 7 + i % 2, 7);
  edits.corrections = {shared(stroke)};
  const ImagingEdits made = made_edits(edits, {}, scan);
  ASSERT_EQ(made.corrections.size(), 1u);
  EXPECT_EQ(made.corrections[0]->points_mm, std::vector<Vec3>(stroke.points_mm.begin() + 999, stroke.points_mm.end()));
  EXPECT_EQ(made.corrections[0]->radius_mm, 0.1);
}

}  // namespace
}  // namespace osteon
