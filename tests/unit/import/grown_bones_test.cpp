// Bones that grow from seeds, and suggested thresholds, from the scan to the case.
#include "server/import/grown_bones.hpp"

#include <cmath>
#include <random>

#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

constexpr std::int16_t kMuscle_hu = 50;

// Voxels of 1 mm, the first at the origin.
CtScan muscle(const std::array<int, 3>& dims) {
  CtScan scan;
  scan.volume.dims = dims;
  scan.volume.values.assign(scan.volume.count(), kMuscle_hu);
  scan.source = "drawn";
  return scan;
}

// Fills voxels from `first` to `last`, both included.
void draw_box(CtScan& scan, const std::array<int, 3>& first, const std::array<int, 3>& last, std::int16_t hu) {
  for (int z = first[2]; z <= last[2]; ++z)
    for (int y = first[1]; y <= last[1]; ++y)
      for (int x = first[0]; x <= last[0]; ++x) scan.volume.values[scan.volume.index(x, y, z)] = hu;
}

CtOptions grown_from(std::vector<Vec3> seeds_mm) {
  CtOptions options;
  options.grow.seeds_mm = std::move(seeds_mm);
  return options;
}

TEST(GrownBones, BonesThatTouchAtAnEdgeGrowApart) {
  CtScan scan = muscle({32, 32, 16});
  draw_box(scan, {4, 4, 4}, {11, 11, 11}, 800);
  draw_box(scan, {12, 12, 4}, {25, 25, 11}, 800);  // shares edges of voxels with the first
  const auto island = import_ct(scan, {}, keep_going);
  const auto grown = import_ct(scan, grown_from({{8, 8, 8}}), keep_going);
  ASSERT_TRUE(island && grown) << grown.error().message;
  EXPECT_EQ(island->found.islands[0].voxels, 8 * 8 * 8 + 14 * 14 * 8);
  EXPECT_EQ(grown->found.islands[0].voxels, 8 * 8 * 8);
  EXPECT_EQ(grown->found.kept, std::vector{1});
  EXPECT_LT(grown->bone->surface_mm({8, 8, 8}), 0.0);
  EXPECT_GT(grown->bone->surface_mm({18, 18, 8}), 0.0);
}

TEST(GrownBones, SimilarVoxelsLeaveADenserBoneOut) {
  CtScan scan = muscle({40, 20, 20});
  draw_box(scan, {4, 4, 4}, {15, 15, 15}, 700);
  draw_box(scan, {16, 4, 4}, {35, 15, 15}, 1500);  // shares a face
  for (const imaging::GrowBy by : {imaging::GrowBy::slice, imaging::GrowBy::volume})
    for (const bool adaptive : {false, true}) {
      CtOptions options = grown_from({{10, 10, 10}});
      options.grow.similar_hu = 300.0;
      options.grow.adaptive = adaptive;
      options.grow.by = by;
      const auto grown = import_ct(scan, options, keep_going);
      ASSERT_TRUE(grown) << grown.error().message;
      EXPECT_EQ(grown->found.islands[0].voxels, 12 * 12 * 12);
      EXPECT_EQ(grown->bone->info().threshold_hu, 400.0) << "what the region takes at least";
      // Half way between 700 and 50 HU is 375. The surface lies 0.46 mm beyond the outer voxels' centres.
      EXPECT_NEAR(grown->bone->surface_mm({3.54, 10, 10}), 0.0, 0.05);
      EXPECT_GT(grown->bone->surface_mm({20, 10, 10}), 0.0);
    }
}

TEST(GrownBones, MarrowComesWithTheBoneThatEnclosesIt) {
  CtScan scan = muscle({30, 30, 30});
  draw_box(scan, {5, 5, 5}, {24, 24, 24}, 1200);
  draw_box(scan, {9, 9, 9}, {20, 20, 20}, -80);
  CtOptions options = grown_from({{6, 6, 6}});
  options.grow.similar_hu = 100.0;
  const auto whole = import_ct(scan, options, keep_going);
  options.hollow = true;
  const auto hollow = import_ct(scan, options, keep_going);
  ASSERT_TRUE(whole && hollow);
  EXPECT_EQ(whole->found.islands[0].voxels, 20 * 20 * 20);
  EXPECT_EQ(hollow->found.islands[0].voxels, 20 * 20 * 20 - 12 * 12 * 12);
}

TEST(GrownBones, EachSeedsBoneHasItsNumber) {
  CtScan scan = muscle({60, 20, 16});
  draw_box(scan, {4, 4, 4}, {20, 15, 11}, 800);
  draw_box(scan, {24, 4, 4}, {33, 15, 11}, 800);
  draw_box(scan, {40, 4, 4}, {53, 15, 11}, 800);
  const auto grown = import_ct(scan, grown_from({{30, 8, 8}, {45, 8, 8}, {50, 10, 9}}), keep_going);
  ASSERT_TRUE(grown);
  EXPECT_EQ(grown->found.regions.size(), 2u) << "the third seed lies in the second one's region";
  EXPECT_EQ(grown->bone->bone_number({30, 8, 8}), 1);
  EXPECT_EQ(grown->bone->bone_number({45, 8, 8}), 2);
  EXPECT_GT(grown->bone->surface_mm({10, 8, 8}), 0.0);
  CtOptions merged = grown_from({{30, 8, 8}, {45, 8, 8}});
  merged.merge = true;
  const auto one = import_ct(scan, merged, keep_going);
  ASSERT_TRUE(one);
  EXPECT_EQ(one->bone->bone_number({45, 8, 8}), 1);
}

TEST(GrownBones, StopAtEveryQuestion) {
  CtScan scan = muscle({24, 24, 20});
  draw_box(scan, {5, 5, 5}, {18, 18, 14}, 800);
  CtOptions options = grown_from({{8, 8, 8}});
  options.grow.similar_hu = 200.0;
  options.grow.adaptive = true;
  options.grow.by = imaging::GrowBy::slice;
  options.list_only = true;  // what follows asks as often as time passes
  int questions = 0;
  ASSERT_TRUE(import_ct(scan, options, [&](double) { return ++questions > 0; }));
  for (int stop = 1; stop <= questions; ++stop) {
    int asked = 0;
    const auto stopped = import_ct(scan, options, [&](double) { return ++asked < stop; });
    ASSERT_FALSE(stopped) << stop << " of " << questions << ", asked " << asked;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

TEST(GrownBones, ASeedIsThreeNumbers) {
  EXPECT_EQ(*parse_seed("-12.5,3,0.25"), Vec3(-12.5, 3.0, 0.25));
  EXPECT_EQ(*parse_seed("1e2,-0,7"), Vec3(100.0, 0.0, 7.0));
  for (const char* wrong :
       {"", "1,2", "1,2,3,4", "1,2,x", "1;2;3", "nan,2,3", "1,inf,3", "1,2,3 ", " 1,2,3", ",,", "1,,3"}) {
    const auto refused = parse_seed(wrong);
    ASSERT_FALSE(refused) << wrong;
    EXPECT_NE(refused.error().message.find("--seed"), std::string::npos);
  }
}

TEST(GrownBones, ASeedThatWillNotDoIsOneSentence) {
  const CtScan scan = muscle({8, 8, 8});
  for (const auto& [seed_mm, why] : {std::pair{Vec3(-300, 3, 3), "lies outside the scan; give a --seed between"},
                                     std::pair{Vec3(4, 3, 3), "has 50 HU, and its region takes 226 to"}}) {
    const auto refused = import_ct(scan, grown_from({seed_mm}), keep_going);
    ASSERT_FALSE(refused);
    expect_one_sentence(refused.error(), why);
  }
}

TEST(GrownBones, LimitsThatAreNoNumbersAreRefused) {
  const CtScan scan = muscle({8, 8, 8});
  for (const double similar_hu : {std::nan(""), 0.0, -1.0, HUGE_VAL}) {
    CtOptions options = grown_from({{4, 4, 4}});
    options.grow.similar_hu = similar_hu;
    const auto refused = import_ct(scan, options, keep_going);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("--similar"), std::string::npos) << refused.error().message;
  }
}

TEST(SuggestedThreshold, FindsTheBoneInNoise) {
  CtScan scan = muscle({40, 40, 40});
  draw_box(scan, {10, 10, 10}, {29, 29, 29}, 700);
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 60.0);
  for (std::int16_t& hu : scan.volume.values) hu = static_cast<std::int16_t>(hu + std::lround(noise(random)));
  CtOptions options;
  options.suggest_threshold = true;
  const auto made = import_ct(scan, options, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  // The widths are equal: half way between the means, and a little more because there is more muscle: + 5 HU.
  EXPECT_NEAR(made->bone->info().threshold_hu, 380.0, 15.0);
  EXPECT_EQ(made->bone->info().source, "drawn, threshold suggested");
  EXPECT_NE(segmentation_text(made->found).find("suggested  "), std::string::npos);
  // Both means are more than 5 deviations away from the threshold: none of 64000 voxels is on the wrong side.
  EXPECT_EQ(made->found.islands.size(), 1u);
  EXPECT_EQ(made->found.islands[0].voxels, 20 * 20 * 20);
}

}  // namespace
}  // namespace osteon::import
