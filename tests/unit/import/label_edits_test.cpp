// Manual corrections: each kind against a volume in closed form, and the file in which a person writes them.
#include "server/import/label_edits.hpp"

#include <cmath>
#include <fstream>
#include <numbers>

#include "server/import/edit_file.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

// Voxels of 0.5 x 0.5 x 0.8 mm whose axes are turned and whose first lies somewhere.
imaging::HuVolume turned_grid() {
  imaging::HuVolume grid;
  grid.dims = {64, 60, 40};
  grid.spacing_mm = {0.5, 0.5, 0.8};
  grid.origin_mm = {-20.0, 31.0, 7.0};
  grid.directions = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  return grid;
}

Vec3 middle_of(const imaging::HuVolume& grid) {
  return grid.position_mm(Vec3(grid.dims[0] - 1, grid.dims[1] - 1, grid.dims[2] - 1) / 2.0);
}

double mm3_of(const imaging::HuVolume& grid, const imaging::VoxelMask& labels, int bone) {
  return static_cast<double>(std::ranges::count(labels.values, static_cast<std::uint8_t>(bone))) *
         grid.spacing_mm.prod();
}

imaging::VoxelMask all_of(const imaging::HuVolume& grid, std::uint8_t bone) {
  imaging::VoxelMask labels(grid.dims);
  std::ranges::fill(labels.values, bone);
  return labels;
}

std::vector<LabelEdit> edits_of(const std::string& list) {
  const auto edits = parse_edits("edits:\n" + list, "my-edits.yaml");
  EXPECT_TRUE(edits) << edits.error().message;
  return edits.value_or(std::vector<LabelEdit>{});
}

std::string xyz(const Vec3& at) {
  return "[" + std::to_string(at.x()) + ", " + std::to_string(at.y()) + ", " + std::to_string(at.z()) + "]";
}

std::vector<EditEffect> apply(const imaging::HuVolume& grid, const std::vector<LabelEdit>& edits,
                              imaging::VoxelMask& labels) {
  const auto effects = apply_edits(grid, edits, labels, keep_going);
  EXPECT_TRUE(effects) << effects.error().message;
  return effects.value_or(std::vector<EditEffect>{});
}

TEST(LabelEdits, BallsHaveTheirVolume) {
  const imaging::HuVolume grid = turned_grid();
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * std::pow(7.0, 3);
  const std::string ball = ", centre_mm: " + xyz(middle_of(grid)) + ", radius_mm: 7}\n";
  imaging::VoxelMask labels(grid.dims);
  const auto painted = apply(grid, edits_of("  - {kind: paint, bone: 3" + ball), labels);
  EXPECT_NEAR(mm3_of(grid, labels, 3), ball_mm3, 0.01 * ball_mm3);
  EXPECT_EQ(static_cast<double>(painted[0].gained[3]) * grid.spacing_mm.prod(), mm3_of(grid, labels, 3));

  labels = all_of(grid, 2);
  const double whole_mm3 = mm3_of(grid, labels, 2);
  apply(grid, edits_of("  - {kind: erase" + ball), labels);
  EXPECT_NEAR(whole_mm3 - mm3_of(grid, labels, 2), ball_mm3, 0.01 * ball_mm3);
  EXPECT_EQ(mm3_of(grid, labels, 0), whole_mm3 - mm3_of(grid, labels, 2));
}

TEST(LabelEdits, AnEraserLeavesOtherBones) {
  const imaging::HuVolume grid = turned_grid();
  imaging::VoxelMask labels = all_of(grid, 2);
  for (std::size_t i = 0; i < labels.values.size() / 2; ++i) labels.values[i] = 1;
  const double other_mm3 = mm3_of(grid, labels, 1);
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * 343.0;
  apply(grid, edits_of("  - {kind: erase, bone: 2, centre_mm: " + xyz(middle_of(grid)) + ", radius_mm: 7}\n"), labels);
  EXPECT_EQ(mm3_of(grid, labels, 1), other_mm3);
  EXPECT_NEAR(mm3_of(grid, labels, 0), ball_mm3 / 2, 0.02 * ball_mm3) << "the half in bone 2";
}

TEST(LabelEdits, APolylineIsARodWithRoundEnds) {
  const imaging::HuVolume grid = turned_grid();
  const Vec3 middle = middle_of(grid);
  // At an angle to the axes of the grid, so that its steps even out.
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY();
  imaging::VoxelMask labels(grid.dims);
  apply(grid,
        edits_of("  - {kind: scribble, bone: 9, radius_mm: 3, points_mm: [" + xyz(middle - 8.0 * x) + ", " +
                 xyz(middle + 8.0 * x) + "]}\n"),
        labels);
  const double rod_mm3 = std::numbers::pi * 9.0 * 16.0 + 4.0 / 3.0 * std::numbers::pi * 27.0;
  EXPECT_NEAR(mm3_of(grid, labels, 9), rod_mm3, 0.02 * rod_mm3);

  // A right angle of two such legs. Of the four quarters around its corner, they share a quarter of the ball in three,
  // and inside the angle a quarter of what two crossing cylinders share, 16/3 r³.
  labels = imaging::VoxelMask(grid.dims);
  apply(grid,
        edits_of("  - {kind: scribble, bone: 9, radius_mm: 3, points_mm: [" + xyz(middle + 8.0 * x) + ", " +
                 xyz(middle) + ", " + xyz(middle + 8.0 * y) + "]}\n"),
        labels);
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * 27.0, leg_mm3 = std::numbers::pi * 9.0 * 8.0;
  const double shared_mm3 = 16.0 / 3.0 * 27.0 / 4.0 + 3.0 * ball_mm3 / 4.0;
  const double angle_mm3 = 2.0 * leg_mm3 + 2.0 * ball_mm3 - shared_mm3;
  EXPECT_NEAR(mm3_of(grid, labels, 9), angle_mm3, 0.02 * angle_mm3);
}

// The same rod, taken out of solid bone.
TEST(LabelEdits, AnEraserGoesAlongAPolyline) {
  const imaging::HuVolume grid = turned_grid();
  const Vec3 middle = middle_of(grid), x = Vec3::UnitX();
  imaging::VoxelMask labels = all_of(grid, 2);
  apply(grid,
        edits_of("  - {kind: erase, radius_mm: 3, points_mm: [" + xyz(middle - 8.0 * x) + ", " + xyz(middle + 8.0 * x) +
                 "]}\n"),
        labels);
  const double rod_mm3 = std::numbers::pi * 9.0 * 16.0 + 4.0 / 3.0 * std::numbers::pi * 27.0;
  EXPECT_NEAR(mm3_of(grid, labels, 0), rod_mm3, 0.02 * rod_mm3);
}

// A disc: the area of its circle, one slice thick. Each axis of the grid has slices of another thickness.
TEST(LabelEdits, WithANormalABallIsADiscInOneSlice) {
  const imaging::HuVolume grid = turned_grid();
  const Vec3 centre = grid.position_mm(Vec3(31, 29, 20));
  for (int axis = 0; axis < 3; ++axis) {
    imaging::VoxelMask labels(grid.dims);
    LabelEdit disc{.kind = EditKind::paint, .bone = 4, .points_mm = {centre}, .radius_mm = 7.0};
    disc.normal = grid.directions.col(axis);
    apply(grid, {disc}, labels);
    const double disc_mm3 = std::numbers::pi * 49.0 * grid.spacing_mm[axis];
    EXPECT_NEAR(mm3_of(grid, labels, 4), disc_mm3, 0.03 * disc_mm3) << axis;
    for (int k = 0; k < grid.dims[2]; ++k)
      for (int j = 0; j < grid.dims[1]; ++j)
        for (int i = 0; i < grid.dims[0]; ++i)
          if (labels.at(i, j, k) != 0) {
            EXPECT_EQ(Eigen::Vector3i(i, j, k)[axis], Eigen::Vector3i(31, 29, 20)[axis]);
          }
  }
}

TEST(LabelEdits, ABoxHasTheVoxelsBetweenItsCorners) {
  const imaging::HuVolume grid = turned_grid();
  const auto box = [&](const Vec3& a, const Vec3& b) {
    return boxed_voxels(
        grid, std::vector{LabelEdit{.kind = EditKind::box, .points_mm = {grid.position_mm(a), grid.position_mm(b)}}});
  };
  const auto boxed = box({30, 5, 39}, {10, 20.4, 12.6});
  ASSERT_TRUE(boxed && *boxed);
  EXPECT_EQ((*boxed)->first, (std::array{10, 5, 13}));
  EXPECT_EQ((*boxed)->last, (std::array{30, 20, 39}));
  const auto beyond = box({-99, -99, -99}, {99, 99, 99});
  ASSERT_TRUE(beyond && *beyond);
  EXPECT_EQ((*beyond)->count(), grid.count());
  EXPECT_FALSE(*boxed_voxels(grid, {}));
  const auto none = box({70, 5, 5}, {80, 9, 9});
  ASSERT_FALSE(none);
  expect_one_sentence(none.error(), "edit 1 (box): it holds no voxel of the scan");
}

TEST(LabelEdits, APlaneCutsOffOneSideOfOneBone) {
  const imaging::HuVolume grid = turned_grid();
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * 343.0;
  const Vec3 middle = middle_of(grid), normal = Vec3(1, -2, 0.5).normalized();
  const std::string ball = "  - {kind: paint, bone: 1, centre_mm: " + xyz(middle) + ", radius_mm: 7}\n";
  // 3 mm beyond the centre: a cap of height 4.
  const double cap_mm3 = std::numbers::pi * 16.0 * (7.0 - 4.0 / 3.0);
  const std::string cut = "  - {kind: cut, bone: 1, point_mm: " + xyz(middle + 3.0 * normal) + ", normal: [10, -20, 5]";
  imaging::VoxelMask labels = all_of(grid, 8);
  apply(grid, edits_of(ball + cut + "}\n"), labels);
  EXPECT_NEAR(mm3_of(grid, labels, 0), cap_mm3, 0.03 * cap_mm3);
  EXPECT_NEAR(mm3_of(grid, labels, 1), ball_mm3 - cap_mm3, 0.01 * ball_mm3);

  labels = all_of(grid, 8);
  apply(grid, edits_of(ball + cut + ", to_bone: 254}\n"), labels);
  EXPECT_NEAR(mm3_of(grid, labels, 254), cap_mm3, 0.03 * cap_mm3);
  EXPECT_EQ(mm3_of(grid, labels, 0), 0.0);
}

TEST(LabelEdits, TheOrderMattersAndAReplayIsEqual) {
  const imaging::HuVolume grid = turned_grid();
  const std::string paint = "  - {kind: paint, bone: 1, centre_mm: " + xyz(middle_of(grid)) + ", radius_mm: 6}\n";
  const std::string erase = "  - {kind: erase, centre_mm: " + xyz(middle_of(grid)) + ", radius_mm: 4}\n";
  imaging::VoxelMask hollow = all_of(grid, 5), again = all_of(grid, 5), full = all_of(grid, 5);
  apply(grid, edits_of(paint + erase), hollow);
  apply(grid, edits_of(paint + erase), again);
  apply(grid, edits_of(erase + paint), full);
  EXPECT_EQ(hollow.values, again.values);
  const double inner_mm3 = 4.0 / 3.0 * std::numbers::pi * 64.0;
  EXPECT_NEAR(mm3_of(grid, full, 1) - mm3_of(grid, hollow, 1), inner_mm3, 0.02 * inner_mm3);
  EXPECT_EQ(mm3_of(grid, full, 0), 0.0);
}

TEST(LabelEdits, WhatCannotBeReplayedIsOneSentence) {
  const imaging::HuVolume grid = turned_grid();
  imaging::VoxelMask labels = all_of(grid, 2);
  const auto refused = [&](const std::string& list) {
    const auto effects = apply_edits(grid, edits_of(list), labels, keep_going);
    EXPECT_FALSE(effects) << list;
    return effects ? Error{} : effects.error();
  };
  const std::string fine = "  - {kind: erase, centre_mm: " + xyz(middle_of(grid)) + ", radius_mm: 1}\n";
  expect_one_sentence(refused(fine + "  - {kind: erase, centre_mm: [500, 0, 0], radius_mm: 3}\n"),
                      "edit 2 (erase): it covers no voxel of the scan");
  expect_one_sentence(refused(fine + fine + "  - {kind: cut, bone: 7, point_mm: [0, 0, 0], normal: [0, 0, 1]}\n"),
                      "edit 3 (cut): bone: there is no bone 7");
  labels = imaging::VoxelMask(grid.dims);
  expect_one_sentence(refused("  - {kind: cut, bone: 7, point_mm: [0, 0, 0], normal: [0, 0, 1]}\n"), "only none");
}

TEST(LabelEdits, StopAtEveryQuestion) {
  const imaging::HuVolume grid = turned_grid();
  const auto edits = edits_of("  - {kind: paint, bone: 1, centre_mm: " + xyz(middle_of(grid)) +
                              ", radius_mm: 2}\n  - {kind: cut, bone: 1, point_mm: [0, 0, 0], normal: [0, 0, 1]}\n");
  int questions = 0;
  imaging::VoxelMask labels(grid.dims);
  ASSERT_TRUE(apply_edits(grid, edits, labels, [&](double) { return ++questions > 0; }));
  EXPECT_GT(questions, grid.dims[2]);
  for (int stop = 1; stop <= questions; ++stop) {
    int asked = 0;
    labels = imaging::VoxelMask(grid.dims);
    const auto stopped = apply_edits(grid, edits, labels, [&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

TEST(EditFile, ReadsAllKinds) {
  const auto edits = edits_of(
      "  - kind: paint\n    bone: 2\n    centre_mm: [1, -2.5, +3e1]\n    radius_mm: 4\n"
      "  - {kind: scribble, bone: 254, points_mm: [[0, 0, 0], [1, 0, 0], [1, 1, 0]], radius_mm: 0.05}\n"
      "  - {kind: erase, centre_mm: [0, 0, 0], radius_mm: 200}\n"
      "  - {kind: cut, bone: 1, point_mm: [1, 2, 3], normal: [0, 3, 4], to_bone: 2}\n"
      "  - {kind: seed, point_mm: [4, 5, 6]}\n"
      "  - {kind: seed, point_mm: [4, 5, 6], bone: 7}\n");
  ASSERT_EQ(edits.size(), 6u);
  EXPECT_EQ(edits[0].bone, 2);
  EXPECT_EQ(edits[0].points_mm[0], Vec3(1.0, -2.5, 30.0));
  EXPECT_EQ(edits[1].points_mm.size(), 3u);
  EXPECT_EQ(edits[2].bone, 0);
  EXPECT_LT((edits[3].normal - Vec3(0.0, 0.6, 0.8)).norm(), 1e-12);
  EXPECT_EQ(edits[3].to_bone, 2);
  EXPECT_EQ(edits[4].kind, EditKind::seed);
  EXPECT_EQ(edits[5].bone, 7);
}

TEST(EditFile, FaultsAreOneSentenceWithFileEditFieldAndRemedy) {
  const std::string fine = "  - {kind: erase, centre_mm: [0, 0, 0], radius_mm: 1}\n";
  for (const auto& [list, what] : {
           std::pair<std::string, std::string>{"{kind: paint, bone: 1, centre_mm: [0, 0, 0]}",
                                               "radius_mm is missing; "},
           {"{kind: paint, bone: 1, centre_mm: [0, 0, 0], radius_mm: 1, radius_mm: 2}", "radius_mm is there twice; "},
           {"{kind: paint, bone: 1, centre_mm: [0, 0, 0], radius: 1}", "\"radius\" is no field of paint; "},
           {"{kind: erase, centre_mm: [0, 0, 0], radius_mm: nan}", "radius_mm is \"nan\"; "},
           {"{kind: erase, centre_mm: [0, 0, 0], radius_mm: .nan}", "radius_mm is \".nan\"; "},
           {"{kind: erase, centre_mm: [0, 0, 0], radius_mm: 0}", "radius_mm is \"0\"; "},
           {"{kind: erase, centre_mm: [0, 0, 0], radius_mm: 201}", "radius_mm is \"201\"; "},
           {"{kind: erase, centre_mm: [0, 0, 0], radius_mm: 1 mm}", "radius_mm is \"1 mm\"; "},
           {"{kind: erase, centre_mm: [0, 0], radius_mm: 1}", "centre_mm does not have three numbers; "},
           {"{kind: erase, centre_mm: [0, inf, 0], radius_mm: 1}", "centre_mm is \"inf\"; "},
           {"{kind: erase, centre_mm: [0, 1e6, 0], radius_mm: 1}", "centre_mm is \"1e6\"; "},
           {"{kind: erase, centre_mm: here, radius_mm: 1}", "centre_mm does not have three numbers; "},
           {"{kind: paint, bone: 0, centre_mm: [0, 0, 0], radius_mm: 1}", "bone is \"0\"; "},
           {"{kind: paint, bone: 255, centre_mm: [0, 0, 0], radius_mm: 1}", "bone is \"255\"; "},
           {"{kind: paint, bone: 1.5, centre_mm: [0, 0, 0], radius_mm: 1}", "bone is \"1.5\"; "},
           {"{kind: cut, bone: 1, point_mm: [0, 0, 0], normal: [0, 0, 0]}", "normal has no length; "},
           {"{kind: cut, bone: 1, point_mm: [0, 0, 0], normal: [0, 0, 1], to_bone: 1}", "to_bone is 1, as bone is; "},
           {"{kind: scribble, bone: 1, points_mm: [[0, 0, 0]], radius_mm: 1}", "points_mm is not a list of 2 to 1000"},
           {"{kind: smear, bone: 1}", "kind is \"smear\"; "},
           {"{kind: erase, radius_mm: 1}", "erase needs centre_mm or points_mm"},
           {"{kind: erase, radius_mm: 1, centre_mm: [0, 0, 0], points_mm: [[0, 0, 0], [1, 0, 0]]}",
            "erase needs centre_mm or points_mm"},
           {"{kind: paint, bone: 1, centre_mm: [0, 0, 0], radius_mm: 1, normal: [0, 0, 0]}", "normal has no length; "},
           {"{kind: outside}", "point_mm is missing; "},
           {"{kind: outside, point_mm: [0, 0, 0], bone: 1}", "\"bone\" is no field of outside; "},
           {"{kind: box, corner_mm: [0, 0, 0]}", "opposite_mm is missing; "},
           {"{kind: label, bone: 1}", "name is missing; "},
           {"{kind: label, bone: 1, name: ''}", "name is not one to 60 bytes"},
           {"{kind: label, bone: 1, name: \"a\\tb\"}", "name is not one to 60 bytes"},
           {"{kind: label, bone: 1, name: bone 2}", "name is \"bone 2\", which only a bone of that number may have; "},
           {"{kind: label, bone: 1, name: femur, opacity: 1.5}", "opacity is \"1.5\"; "},
           {"{kind: label, bone: 1, name: femur, minutes: -1}", "minutes is \"-1\"; "},
           {"{bone: 1}", "kind is missing; "},
           {"paint", "kind is missing; "},
       }) {
    const auto refused = parse_edits("edits:\n" + fine + "  - " + list + "\n", "my-edits.yaml");
    ASSERT_FALSE(refused) << list;
    expect_one_sentence(refused.error(), "my-edits.yaml, line 3, edit 2: " + what);
  }
  for (const char* text : {"", "edits:", "edits: 3", "edits: []", "[1, 2]", "edit: [{kind: seed, point_mm: [0, 0, 0]}]",
                           "edits: [{kind: seed, point_mm: [0, 0, 0]}]\nmore: 1", "edits: [", "a: &a [*a]"}) {
    const auto refused = parse_edits(text, "my-edits.yaml");
    ASSERT_FALSE(refused) << text;
    expect_one_sentence(refused.error(), "my-edits.yaml");
  }
}

TEST(EditFile, WhatMayBeThereOnceIsRefusedTheSecondTime) {
  const std::string box = "  - {kind: box, corner_mm: [0, 0, 0], opposite_mm: [1, 1, 1]}\n";
  const std::string femur = "  - {kind: label, bone: 1, name: femur}\n";
  const std::string landmark = "  - {kind: landmark, name: femur, point_mm: [1, 2, 3]}\n";
  EXPECT_EQ(edits_of(femur + landmark).size(), 2u) << "a bone and a point may have one name";
  for (const auto& [list, what] :
       {std::pair<std::string, std::string>{box + box, "there is a box before it; "},
        {femur + "  - {kind: label, bone: 1, name: tibia}\n", "bone 1 has a label before it; "},
        {femur + "  - {kind: label, bone: 2, name: femur}\n", "name is \"femur\", as that of another label; "},
        {landmark + landmark, "name is \"femur\", as that of another landmark; "}}) {
    const auto refused = parse_edits("edits:\n" + list, "my-edits.yaml");
    ASSERT_FALSE(refused) << list;
    expect_one_sentence(refused.error(), "my-edits.yaml, line 3, edit 2: " + what);
  }
}

TEST(EditFile, ListsOfAnyLengthAreBounded) {
  std::string list = "edits:\n";
  for (int i = 0; i < 1001; ++i) list += "- {kind: seed, point_mm: [0, 0, 0]}\n";
  const auto many = parse_edits(list, "my-edits.yaml");
  ASSERT_FALSE(many);
  expect_one_sentence(many.error(), "more than 1000 entries");
  const test::TempDir dir;
  const auto file = dir.path() / "long.yaml";
  std::ofstream(file) << "edits: [] # " << std::string(1 << 20, 'x');
  const auto refused = read_edits(file);
  ASSERT_FALSE(refused);
  expect_one_sentence(refused.error(), "longer than 1 MiB");
  const auto missing = read_edits(dir.path() / "none.yaml");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_FALSE(read_edits(dir.path()));
}

TEST(EditFile, ReadsWhatIsNoCorrection) {
  const auto edits = edits_of(
      "  - {kind: outside, point_mm: [1, 2, 3]}\n"
      "  - {kind: box, corner_mm: [1, 2, 3], opposite_mm: [4, 5, 6]}\n"
      "  - {kind: label, bone: 3, name: left femur, opacity: 0.25, minutes: 7.5}\n"
      "  - {kind: label, bone: 4, name: bone 4}\n"
      "  - {kind: erase, bone: 2, points_mm: [[0, 0, 0], [1, 0, 0]], radius_mm: 2, normal: [0, 0, 2]}\n");
  ASSERT_EQ(edits.size(), 5u);
  EXPECT_EQ(edits[0].points_mm, (std::vector<Vec3>{{1, 2, 3}}));
  EXPECT_EQ(edits[1].points_mm.size(), 2u);
  EXPECT_EQ(edits[2].name, "left femur");
  EXPECT_EQ(edits[2].opacity, 0.25);
  EXPECT_EQ(edits[2].minutes, 7.5);
  EXPECT_EQ(edits[3].opacity, 1.0);
  EXPECT_EQ(edits[4].normal, Vec3::UnitZ());
  EXPECT_EQ(edit_text(edits[2]), "label bone 3 left femur, opacity 0.25, 7.5 min");
  EXPECT_EQ(edit_text(edits[1]), "box from 1,2,3 to 4,5,6 mm");
  const LabelEdit longest{
      .kind = EditKind::label, .bone = 254, .name = std::string(60, 'x'), .opacity = 1.0 / 3.0, .minutes = 1e5 / 3.0};
  EXPECT_LT(edit_text(longest).size(), 200u);
}

TEST(LabelEdits, ALandmarkLiesInAVoxelOfTheScan) {
  const imaging::HuVolume grid = turned_grid();
  const auto check = [&](const Vec3& voxel) {
    const std::vector<LabelEdit> edits{
        {.kind = EditKind::seed, .points_mm = {Vec3::Constant(1e4)}},
        {.kind = EditKind::landmark, .points_mm = {grid.position_mm(voxel)}, .name = "apex"}};
    return check_landmarks(grid, edits);
  };
  for (const Vec3& inside : {Vec3(0, 0, 0), Vec3(-0.49, 59.49, 20), Vec3(63.49, 30, -0.49), Vec3(63, 59, 39.49)})
    EXPECT_TRUE(check(inside)) << inside.transpose();
  for (const Vec3& beside : {Vec3(-0.51, 0, 0), Vec3(0, 59.51, 0), Vec3(0, 0, 39.51), Vec3(1e3, 1e3, 1e3)}) {
    const auto refused = check(beside);
    ASSERT_FALSE(refused) << beside.transpose();
    expect_one_sentence(refused.error(), "edit 2 (landmark): apex lies beside the scan; ");
  }
}

TEST(EditFile, ReadsLandmarks) {
  const auto edits = edits_of(
      "  - {kind: landmark, name: \"Épine \\\"1\\\"\", point_mm: [1.25, -2, 3e1]}\n"
      "  - {kind: landmark, name: apex, point_mm: [4, 5, 6]}\n");
  ASSERT_EQ(edits.size(), 2u);
  EXPECT_EQ(edits[0].kind, EditKind::landmark);
  EXPECT_EQ(edits[0].name, "Épine \"1\"");
  EXPECT_EQ(edits[0].points_mm, (std::vector<Vec3>{{1.25, -2.0, 30.0}}));
  EXPECT_EQ(edits[0].bone, 0);
  EXPECT_EQ(edit_text(edits[1]), "landmark apex at 4,5,6 mm");
}

TEST(EditFile, EachEditIsALineForTheProvenance) {
  const auto edits = edits_of(
      "  - {kind: cut, bone: 1, point_mm: [1, 2, 3], normal: [0, 0, 2]}\n"
      "  - {kind: scribble, bone: 2, points_mm: [[0, 0, 0], [1, 0, 0], [1, 1, 0.5]], radius_mm: 2}\n"
      "  - {kind: scribble, bone: 2, points_mm: [[0, 0, 0], [1, 0.5, 0], [1, 1, 0.5]], radius_mm: 2}\n");
  EXPECT_EQ(edit_text(edits[0]), "cut bone 1, removed, at 1,2,3 mm, normal 0,0,1");
  EXPECT_NE(edit_text(edits[1]), edit_text(edits[2])) << "points between the ends count";
  for (LabelEdit edit : edits) {
    edit.to_bone = 254;
    edit.bone = 253;
    edit.radius_mm = 1.0 / 3.0;
    edit.normal = Vec3(-1.0 / 3.0, -2.0 / 3.0, -2.0 / 3.0);
    for (Vec3& point : edit.points_mm) point = Vec3::Constant(-1e5 / 3.0);
    EXPECT_LE(edit_text(edit).size(), 200u);
  }
  for (const double tiny : {-0.0001234567, -1.234567e-300}) {
    const LabelEdit small{.kind = EditKind::scribble,
                          .bone = 254,
                          .points_mm = std::vector<Vec3>(1000, {tiny, -12345.67, -123.456789}),
                          .radius_mm = 0.05678912,
                          .normal = {tiny, -0.00123456, -0.9999992}};
    EXPECT_LE(edit_text(small).size(), 200u) << edit_text(small);
  }
}

}  // namespace
}  // namespace osteon::import
