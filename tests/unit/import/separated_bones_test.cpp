// Bones that touch, from the scan to the case: separated by seeds or cores, and corrected by hand.
#include "server/import/separated_bones.hpp"

#include <cmath>
#include <numbers>

#include "server/import/edit_file.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

// Voxels of 1 mm, the first at the origin: muscle, and balls of bone.
struct Ball {
  Vec3 centre_mm;
  double radius_mm = 0.0;
};
CtScan balls(const std::array<int, 3>& dims, const std::vector<Ball>& list) {
  CtScan scan;
  scan.volume.dims = dims;
  scan.source = "drawn";
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x) {
        bool bone = false;
        for (const Ball& ball : list) bone = bone || (Vec3(x, y, z) - ball.centre_mm).norm() <= ball.radius_mm;
        scan.volume.values.push_back(bone ? 900 : 50);
      }
  return scan;
}

// Two balls that share a circle at x = 17.5, and a third one apart.
CtScan three_balls() {
  return balls({56, 22, 22}, {{{9.5, 10.5, 10.5}, 8.5}, {{25.5, 10.5, 10.5}, 8.5}, {{46.5, 10.5, 10.5}, 6.0}});
}

Result<CtImport> made(const CtOptions& options, const KeepGoing& going = keep_going) {
  return import_ct(three_balls(), options, going);
}

CtOptions with_edits(const std::string& list) {
  CtOptions options;
  const auto edits = parse_edits("edits:\n" + list, "my-edits.yaml");
  EXPECT_TRUE(edits) << edits.error().message;
  options.edits = edits.value_or(std::vector<LabelEdit>{});
  options.edits_file = "my-edits.yaml";
  return options;
}

const CaseLabel* label_of(const CtImport& import, int value) {
  for (const CaseLabel& label : import.bone->info().labels)
    if (label.value == value) return &label;
  return nullptr;
}

TEST(SeparatedBones, EachSeedIsABoneOfItsOwn) {
  CtOptions options;
  options.surface = SurfaceAt::threshold;
  options.grow.seeds_mm = {{24, 10, 10}, {12, 10, 10}, {46, 10, 10}};
  const auto joined = made(options);
  options.separate = true;
  const auto apart = made(options);
  ASSERT_TRUE(joined && apart) << apart.error().message;
  EXPECT_EQ(joined->bone->info().labels.size(), 2u);
  ASSERT_EQ(apart->bone->info().labels.size(), 3u);
  EXPECT_EQ(apart->bone->bone_number({25, 10, 10}), 1);
  EXPECT_EQ(apart->bone->bone_number({9, 10, 10}), 2);
  EXPECT_EQ(apart->bone->bone_number({46, 10, 10}), 3);
  EXPECT_NEAR(apart->found.bones[0].volume_cm3, apart->found.bones[1].volume_cm3, 1e-9) << "mirrored balls";
  EXPECT_NEAR(apart->bone->volume_mm3(), joined->bone->volume_mm3(), 1e-6) << "the outer surface is the same";
  const CaseLabel* label = label_of(*apart, 2);
  ASSERT_NE(label, nullptr);
  EXPECT_NE(label->provenance.method.find("watershed from seeds"), std::string::npos);
  EXPECT_EQ(label->provenance.parameters.at("own_seed_1"), 2.0);
  EXPECT_EQ(label->provenance.parameters.at("seed_2_x_mm"), 12.0);
}

TEST(SeparatedBones, SeedsOfOneNumberAreOneBone) {
  CtOptions options;
  options.separate = true;
  options.grow.seeds_mm = {{9, 10, 10}, {25, 10, 10}, {46, 10, 10}};
  options.grow.bones = {4, 9, 4};
  const auto import = made(options);
  ASSERT_TRUE(import) << import.error().message;
  ASSERT_EQ(import->bone->info().labels.size(), 2u);
  EXPECT_EQ(import->bone->bone_number({9, 10, 10}), 4);
  EXPECT_EQ(import->bone->bone_number({46, 10, 10}), 4);
  EXPECT_EQ(import->bone->bone_number({25, 10, 10}), 9);
  EXPECT_EQ(label_of(*import, 4)->provenance.parameters.at("own_seed_2"), 3.0);
}

TEST(SeparatedBones, WithoutSeedsCoresAreBones) {
  CtOptions options;
  options.separate = true;
  const auto largest = made(options);
  options.keep_all = true;
  const auto all = made(options);
  ASSERT_TRUE(largest && all);
  EXPECT_EQ(largest->bone->info().labels.size(), 2u) << "only the largest island is kept";
  ASSERT_EQ(all->bone->info().labels.size(), 3u);
  EXPECT_EQ(all->bone->bone_number({46, 10, 10}), 3) << "the smallest comes last";
  EXPECT_NE(all->bone->bone_number({9, 10, 10}), all->bone->bone_number({25, 10, 10}));
  EXPECT_NE(segmentation_text(all->found).find("3 in the case, separated"), std::string::npos);
}

TEST(SeparatedBones, StopsAtEveryQuestion) {
  CtOptions options = with_edits("  - {kind: erase, centre_mm: [9, 10, 10], radius_mm: 3}\n");
  options.separate = true;
  imaging::VoxelMask bones;
  const CtScan scan = three_balls();
  const auto run = [&](const KeepGoing& going) {
    bones = imaging::VoxelMask(scan.volume.dims);
    for (std::size_t i = 0; i < bones.values.size(); ++i) bones.values[i] = scan.volume.values[i] > 500 ? 1 : 0;
    CtSegmentation found;
    const std::vector<imaging::BoneSeed> seeds{{{9, 10, 10}, 1}, {{25, 10, 10}, 2}, {{46, 10, 10}, 3}};
    return finish_bones(scan.volume, options, seeds, bones, found, going);
  };
  int questions = 0;
  ASSERT_TRUE(run([&](double) { return ++questions > 0; }));
  for (int stop = 1; stop <= questions; stop += 3) {
    int asked = 0;
    const auto stopped = run([&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped) << stop << " of " << questions;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

TEST(EditedBones, AnErasedBallIsAHoleWithItsVolume) {
  // Voxels of 1 mm: the surface of the hole lies half way between their centres.
  const auto whole = made({});
  const auto edited = made(with_edits("  - {kind: erase, centre_mm: [25.5, 10.5, 10.5], radius_mm: 6}\n"));
  ASSERT_TRUE(whole && edited) << edited.error().message;
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * 216.0;
  EXPECT_NEAR(whole->bone->volume_mm3() - edited->bone->volume_mm3(), ball_mm3, 0.03 * ball_mm3);
  EXPECT_GT(edited->bone->surface_mm({25.5, 10.5, 10.5}), 1.0);
  EXPECT_EQ(label_of(*edited, 1)->provenance.edits,
            (std::vector<std::string>{"erase, at 25.5,10.5,10.5 mm, radius 6 mm"}));
}

TEST(EditedBones, ANewBoneMayLieBeyondAllOthers) {
  const auto edited =
      made(with_edits("  - {kind: paint, bone: 7, centre_mm: [9, 10, 10], radius_mm: 2}\n"
                      "  - {kind: scribble, bone: 8, points_mm: [[46, 10, 8], [46, 10, 13]], radius_mm: 2}\n"));
  ASSERT_TRUE(edited) << edited.error().message;
  ASSERT_EQ(edited->bone->info().labels.size(), 3u);
  EXPECT_EQ(edited->bone->bone_number({9, 10, 10}), 7);
  EXPECT_EQ(edited->bone->bone_number({46, 10, 10}), 8);
  EXPECT_EQ(edited->bone->bone_number({25, 10, 10}), 1);
  EXPECT_EQ(label_of(*edited, 7)->provenance.method, "edits");
  EXPECT_EQ(label_of(*edited, 1)->provenance.edits.size(), 1u) << "the second edit did not change bone 1";
}

TEST(EditedBones, ACutAfterASeparationTouchesOneBone) {
  CtOptions options = with_edits(
      "  - {kind: cut, bone: 2, point_mm: [0, 10.5, 0], normal: [0, 1, 0], to_bone: 5}\n"
      "  - {kind: cut, bone: 5, point_mm: [25, 10, 18], normal: [0, 0, 1]}\n");
  options.separate = true;
  options.grow.seeds_mm = {{9, 10, 10}, {25, 10, 10}};
  const auto cut = made(options);
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_EQ(cut->bone->bone_number({9, 14, 10}), 1);
  EXPECT_EQ(cut->bone->bone_number({25, 7, 10}), 2);
  EXPECT_EQ(cut->bone->bone_number({25, 14, 10}), 5);
  EXPECT_EQ(label_of(*cut, 2)->provenance.edits.size(), 1u);
  EXPECT_EQ(label_of(*cut, 5)->provenance.edits.size(), 2u);
  EXPECT_TRUE(label_of(*cut, 1)->provenance.edits.empty());
}

TEST(EditedBones, TheSameFileGivesTheSameHash) {
  const std::string paint = "  - {kind: paint, bone: 2, centre_mm: [9, 10, 10], radius_mm: 4}\n";
  const std::string erase = "  - {kind: erase, centre_mm: [12, 10, 10], radius_mm: 4}\n";
  const auto first = made(with_edits(paint + erase)), again = made(with_edits(paint + erase)),
             other = made(with_edits(erase + paint));
  ASSERT_TRUE(first && again && other);
  EXPECT_EQ(first->bone->hash(), again->bone->hash());
  EXPECT_NE(first->bone->hash(), other->bone->hash());
}

TEST(EditedBones, EditsChangeTheLabelsOfALabelMap) {
  CtScan scan = three_balls();
  PlacedLabels placed;
  placed.values = imaging::VoxelMask(scan.volume.dims);
  for (std::size_t i = 0; i < placed.values.values.size(); ++i)
    placed.values.values[i] = scan.volume.values[i] > 500 ? 5 : 0;
  placed.labels = {{5, "femur", LabelKind::bone, {"label map, test", {}, {}}}};
  placed.cm3 = {1.0};
  const CtOptions options = with_edits(
      "  - {kind: cut, bone: 5, point_mm: [17.5, 0, 0], normal: [1, 0, 0], to_bone: 6}\n"
      "  - {kind: erase, centre_mm: [46.5, 10.5, 10.5], radius_mm: 9}\n");
  const auto import = import_ct(std::move(scan), std::move(placed), options, keep_going);
  ASSERT_TRUE(import) << import.error().message;
  ASSERT_EQ(import->bone->info().labels.size(), 2u);
  EXPECT_EQ(label_of(*import, 5)->name, "femur");
  EXPECT_EQ(label_of(*import, 5)->provenance.edits.size(), 1u);
  EXPECT_EQ(label_of(*import, 6)->provenance.edits.size(), 2u);
  EXPECT_EQ(import->bone->bone_number({9, 10, 10}), 5);
  EXPECT_EQ(import->bone->bone_number({25, 10, 10}), 6);
  EXPECT_GT(import->bone->surface_mm({46, 10, 10}), 0.0);
  EXPECT_NEAR(import->labels.cm3[0], import->labels.cm3[1], 1e-9) << "mirrored balls";
}

// Two balls that touch are one island. A seed outside takes the other ball away.
TEST(SeparatedBones, WhatGrowsFromASeedOutsideIsNoBone) {
  CtOptions options;
  options.separate = true;
  options.surface = SurfaceAt::threshold;
  options.grow.seeds_mm = {{9, 10, 10}, {25, 10, 10}};
  options.grow.bones = {1, 254};
  const auto both = made(options);
  options.grow.outside = 254;
  const auto one = made(options);
  ASSERT_TRUE(both && one) << one.error().message;
  EXPECT_NEAR(one->bone->volume_mm3(), 0.5 * both->bone->volume_mm3(), 0.02 * both->bone->volume_mm3());
  ASSERT_EQ(one->bone->info().labels.size(), 1u);
  EXPECT_EQ(one->bone->bone_number({9, 10, 10}), 1);
  options.grow.bones = {254, 254};
  const auto none = made(options);
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().message.find("leaves no bone"), std::string::npos) << none.error().message;
}

TEST(EditedBones, ALabelHasTheNameAndTheMinutesThatAPersonGives) {
  CtOptions options = with_edits(
      "  - {kind: label, bone: 2, name: humerus, opacity: 0.5, minutes: 3.5}\n"
      "  - {kind: erase, bone: 1, centre_mm: [9, 10, 10], radius_mm: 2}\n");
  options.separate = true;
  options.grow.seeds_mm = {{9, 10, 10}, {25, 10, 10}};
  const auto import = made(options);
  ASSERT_TRUE(import) << import.error().message;
  EXPECT_EQ(label_of(*import, 1)->name, "bone 1");
  EXPECT_EQ(label_of(*import, 2)->name, "humerus");
  EXPECT_EQ(label_of(*import, 2)->provenance.parameters.at("minutes"), 3.5);
  EXPECT_EQ(label_of(*import, 2)->provenance.edits,
            std::vector<std::string>{"label bone 2 humerus, opacity 0.5, 3.5 min"});
}

// An eraser beside the bone is no mistake, wherever in the scan it is.
TEST(EditedBones, AnEraserFarFromTheBoneChangesNothing) {
  const auto plain = made(with_edits("  - {kind: erase, centre_mm: [9, 10, 10], radius_mm: 0.5}\n"));
  const auto also =
      made(with_edits("  - {kind: erase, centre_mm: [9, 10, 10], radius_mm: 0.5}\n"
                      "  - {kind: erase, centre_mm: [1, 1, 1], radius_mm: 1}\n"));
  ASSERT_TRUE(plain && also) << also.error().message;
  EXPECT_EQ(plain->bone->volume_mm3(), also->bone->volume_mm3());
}

// A box around the third ball. Without it, the two others would be kept. Another box divides that ball.
TEST(EditedBones, OnlyTheBoxCounts) {
  CtOptions options = with_edits("  - {kind: box, corner_mm: [55, 21, 21], opposite_mm: [36, 0, 0]}\n");
  const auto ball = made(options);
  ASSERT_TRUE(ball) << ball.error().message;
  const double ball_mm3 = 4.0 / 3.0 * std::numbers::pi * 216.0;
  EXPECT_NEAR(ball->bone->volume_mm3(), ball_mm3, 0.03 * ball_mm3);
  EXPECT_EQ(ball->found.islands.size(), 1u);
  options.edits[0].points_mm[1].x() = 46.0;
  const auto half = made(options);
  ASSERT_TRUE(half) << half.error().message;
  // The first whole voxel of the box begins at x = 45.5, 1 mm beyond the middle of the ball.
  const double cap_mm = 6.0 + 1.0;
  const double part_mm3 = std::numbers::pi * cap_mm * cap_mm * (6.0 - cap_mm / 3.0);
  EXPECT_NEAR(half->bone->volume_mm3(), part_mm3, 0.04 * part_mm3);
  EXPECT_NE(half->bone->info().source.find("a box of it"), std::string::npos) << half->bone->info().source;
  EXPECT_EQ(label_of(*half, 1)->provenance.parameters.at("box_2_x_mm"), 46.0);
}

TEST(EditedBones, EditsThatCannotBeNameTheirFile) {
  const auto away = made(with_edits("  - {kind: erase, centre_mm: [900, 0, 0], radius_mm: 3}\n"));
  ASSERT_FALSE(away);
  expect_one_sentence(away.error(), "my-edits.yaml, edit 1 (erase): it covers no voxel");
  const auto nothing = made(with_edits("  - {kind: cut, bone: 1, point_mm: [0, 0, -5], normal: [0, 0, 1]}\n"));
  ASSERT_FALSE(nothing);
  expect_one_sentence(nothing.error(), "my-edits.yaml leaves no bone; ");
}

}  // namespace
}  // namespace osteon::import
