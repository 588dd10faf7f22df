#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

using test::plain_block;
using test::straight_cut;
constexpr double kPi = std::numbers::pi;

TEST(Case, MeasuresTheVolumeOfABlock) {
  const Case bone = plain_block(12.0, 10.0, 0.5);
  // Edges are rounded by the pitch, so a little volume is missing.
  EXPECT_NEAR(bone.volume_mm3(), 12.0 * 12.0 * 10.0, 0.01 * 1440.0);
}

TEST(Case, KnowsDistanceDensityAndClearance) {
  const Case bone = test::layered_block({{4.0, 1.9}, {6.0, 0.3}}, 20.0, 0.5);
  EXPECT_NEAR(bone.surface_mm({0.0, 0.0, 0.7}), 0.7, 1e-3);
  EXPECT_NEAR(bone.surface_mm({0.1, 0.2, -1.3}), -1.3, 1e-3);
  EXPECT_NEAR(bone.density_g_cm3({1.0, 2.0, -2.0}), 1.9, 1e-6);
  EXPECT_NEAR(bone.density_g_cm3({1.0, 2.0, -8.0}), 0.3, 1e-6);
  EXPECT_EQ(bone.tissue({0, 0, -4}), Tissue::cortical);
  EXPECT_EQ(bone.tissue({0, 0, -16}), Tissue::trabecular);
  EXPECT_EQ(bone.tissue({0, 0, 2}), Tissue::none);
  // Never more than the true distance, and still useful far away.
  for (double height = 0.0; height < 60.0; height += 0.7)
    EXPECT_LE(bone.clearance_mm({0.3, 0.2, height}), height + 1e-6);
  EXPECT_GT(bone.clearance_mm({0.0, 0.0, 50.0}), 20.0);
}

TEST(Case, ComesBackFromItsFolderUnchanged) {
  const test::TempDir temp;
  const Case bone = plain_block(12.0, 10.0, 0.5);
  ASSERT_TRUE(bone.save(temp / "case"));
  const auto loaded = Case::load(temp / "case");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->hash(), bone.hash());
  EXPECT_EQ(loaded->info(), bone.info());
  EXPECT_DOUBLE_EQ(loaded->volume_mm3(), bone.volume_mm3());
  EXPECT_DOUBLE_EQ(loaded->surface_mm({1.1, 2.2, -0.3}), bone.surface_mm({1.1, 2.2, -0.3}));
}

TEST(Case, IsNamedByItsContent) {
  EXPECT_EQ(plain_block(12.0, 10.0, 0.5).hash(), plain_block(12.0, 10.0, 0.5).hash());
  EXPECT_NE(plain_block(12.0, 10.0, 0.5).hash(), plain_block(12.0, 10.5, 0.5).hash());
  EXPECT_NE(plain_block(12.0, 10.0, 0.5, 1.9).hash(), plain_block(12.0, 10.0, 0.5, 1.8).hash());
}

void replace_in(const std::filesystem::path& file, const std::string& from, const std::string& to) {
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  in.close();
  ASSERT_NE(text.find(from), std::string::npos);
  text.replace(text.find(from), from.size(), to);
  std::ofstream(file) << text;
}

TEST(Case, RefusesWhatIsNotACaseInOneSentenceNamingIt) {
  const test::TempDir temp;
  const auto message = [&](const std::string& folder) {
    const auto loaded = Case::load(temp / folder);
    EXPECT_FALSE(loaded);
    return loaded ? std::string() : loaded.error().message;
  };
  EXPECT_NE(message("nothing").find("nothing"), std::string::npos);
  std::filesystem::create_directory(temp / "empty");
  EXPECT_NE(message("empty").find("case.json"), std::string::npos);

  const Case bone = plain_block(8.0, 8.0, 0.5);
  for (const char* name : {"version", "tampered", "broken", "cut-off"}) ASSERT_TRUE(bone.save(temp / name));
  replace_in(temp / "version" / "case.json", "\"schema_version\": 2", "\"schema_version\": 99");
  EXPECT_NE(message("version").find("99"), std::string::npos);
  // Undefined behaviour as an int: the sanitizers would detect it.
  replace_in(temp / "version" / "case.json", "\"schema_version\": 99", "\"schema_version\": 1e17");
  EXPECT_NE(message("version").find("schema_version is 1e+17"), std::string::npos);
  replace_in(temp / "tampered" / "case.json", "\"pitch_mm\": 0.5", "\"pitch_mm\": 0.6");
  EXPECT_NE(message("tampered").find("content_hash"), std::string::npos);
  replace_in(temp / "broken" / "case.json", "{", "");
  EXPECT_NE(message("broken").find("case.json"), std::string::npos);
  std::filesystem::resize_file(temp / "cut-off" / "bone.vdb", 5000);
  EXPECT_NE(message("cut-off").find("bone.vdb"), std::string::npos);
}

TEST(Case, DoesNotOverwriteAndLeavesNothingBehind) {
  const test::TempDir temp;
  const Case bone = plain_block(8.0, 8.0, 0.5);
  ASSERT_TRUE(bone.save(temp / "case"));
  const auto again = bone.save(temp / "case");
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(temp.path()), std::filesystem::directory_iterator()), 1);
}

// Cuts on level 2, so a pitch of 4h gives cuts at h.
double drilled_mm3(double cut_pitch) {
  const Tool drill = *find_tool("drill-3.2");
  CutField field(plain_block(12.0, 8.0, 4.0 * cut_pitch), {});
  field.apply(straight_cut(drill, {0.03, 0.02, 1.0}, {0.03, 0.02, -12.0}, {0, 0, -1}));
  return field.removed_mm3();
}

TEST(CutField, ADrillHoleHasTheVolumeOfItsCylinder) {
  const double exact = kPi * 1.6 * 1.6 * 8.0;
  EXPECT_NEAR(drilled_mm3(0.125), exact, 0.005 * exact);
}

double burred_mm3(double cut_pitch) {
  const Tool burr = *find_tool("burr-round-5");
  CutField field(plain_block(16.0, 8.0, 4.0 * cut_pitch), {});
  const Vec3 tip{0.013, 0.027, -4.0};  // the sphere's middle is 1.5 mm below the face
  field.apply(straight_cut(burr, tip, tip, {0, 0, -1}));
  return field.removed_mm3();
}

TEST(CutField, ASphereCutsItsCapAndTheErrorShrinksWithThePitch) {
  // Of a sphere of radius R, all but the cap of height R − 1.5 above the face is in bone.
  const double r = 2.5, cap = r - 1.5;
  const double exact = 4.0 / 3.0 * kPi * r * r * r - kPi * cap * cap * (3.0 * r - cap) / 3.0;
  EXPECT_NEAR(burred_mm3(0.125), exact, 0.005 * exact);
  EXPECT_LT(std::abs(burred_mm3(0.125) - exact), 0.5 * std::abs(burred_mm3(0.25) - exact) + 1e-3 * exact);
}

std::vector<Cut> some_cuts() {
  const Tool drill = *find_tool("drill-3.2"), burr = *find_tool("burr-round-5");
  std::vector<Cut> cuts{straight_cut(drill, {0, 0, 1}, {0, 0, -5}, {0, 0, -1}),
                        straight_cut(burr, {-3, 0, -1}, {4, 2, -1.5}, {0.1, 0, -1}),
                        straight_cut(drill, {3, 1, 1}, {2, 1, -6}, {-0.1, 0, -1})};
  cuts[2].level = 1;
  return cuts;
}

TEST(CutField, DoesNotDependOnOrderOrRepetition) {
  const Case bone = plain_block(16.0, 8.0, 0.5);
  std::vector<Cut> cuts = some_cuts();
  CutField forward(bone, {});
  for (const Cut& cut : cuts) forward.apply(cut);
  std::ranges::reverse(cuts);
  CutField backward(bone, {});
  for (const Cut& cut : cuts) backward.apply(cut);
  EXPECT_EQ(backward.apply(cuts[0]).modified, 0);
  EXPECT_EQ(forward.hash(), backward.hash());
  EXPECT_NE(forward.hash(), CutField(bone, {}).hash());
}

TEST(CutField, IsRestoredFromItsLeaves) {
  const Case bone = plain_block(16.0, 8.0, 0.5);
  CutField field(bone, {});
  for (const Cut& cut : some_cuts()) field.apply(cut);
  CutField copy(bone, {});
  for (const FieldLeaf& leaf : field.leaves()) copy.restore(leaf);
  EXPECT_EQ(copy.hash(), field.hash());
  EXPECT_DOUBLE_EQ(copy.removed_mm3(), field.removed_mm3());
}

TEST(CutField, ACutInAirChangesNothingAndStoresNothing) {
  CutField field(plain_block(16.0, 8.0, 0.5), {});
  const CutReport report = field.apply(straight_cut(*find_tool("burr-round-5"), {0, 0, 30}, {5, 0, 30}, {0, 0, -1}));
  EXPECT_EQ(report.modified, 0);
  EXPECT_TRUE(field.leaves().empty());
}

TEST(CutField, GathersWhatItIsAtEveryPoint) {
  CutField field(plain_block(16.0, 8.0, 0.5), {});
  for (const Cut& cut : some_cuts()) field.apply(cut);
  for (int level = 0; level < kLevels; ++level) {
    const CoordBox box{{-9, -5, -13}, {11, 7, 6}};
    std::vector<float> solid(21 * 13 * 20);
    field.gather_solid(level, box, solid);
    std::size_t i = 0;
    for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
      for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
        for (std::int32_t z = box.min.z; z <= box.max.z; ++z, ++i)
          ASSERT_NEAR(static_cast<double>(solid[i]), field.solid_mm(position_mm({x, y, z}, level_pitch_mm(0.5, level))),
                      1e-4);
  }
}

TEST(CutField, UncutBoneKeepsItsDepthBesideACut) {
  CutField field(plain_block(16.0, 8.0, 0.5), {});
  const Vec3 deep{5.0, 5.0, -2.0};
  const double before = field.solid_mm(deep);
  field.apply(straight_cut(*find_tool("drill-3.2"), {0, 0, 1}, {0, 0, -5}, {0, 0, -1}));
  EXPECT_NEAR(before, -2.0, 1e-3);
  EXPECT_EQ(field.solid_mm(deep), before);
  // The same in a box that has cuts elsewhere.
  const CoordBox box{{0, 0, -4}, {10, 10, -4}};
  std::vector<float> solid(11 * 11);
  field.gather_solid(0, box, solid);
  EXPECT_NEAR(solid.back(), before, 1e-3);
}

// A large cut is distributed to threads and finds at once what matters in each leaf. A cut leaf by leaf does neither.
// The field and its report must be the same, also in leaves that became completely removed.
TEST(CutField, ALargeCutIsThatOfItsLeavesOneByOne) {
  const Case bone = plain_block(40.0, 20.0, 0.5);
  const Tool mill = *find_tool("burr-round-5");
  Cut cut = straight_cut(mill, {-15, -3, -4}, {15, 4, -2}, {0, 0, -1});
  cut.path.push_back(quantise(pose_along({-10, 10, -6}, {0.2, 0.1, -1})));
  CutField at_once(bone, {}), one_by_one(bone, {});
  const CutReport whole = at_once.apply(cut);
  ASSERT_GT(whole.reached_leaves.size(), 500u);
  EXPECT_EQ(whole.reached_leaves, one_by_one.reach(cut));
  std::int64_t modified = 0;
  std::vector<Coord> changed;
  for (const Coord leaf : whole.reached_leaves) {
    const CutReport part = one_by_one.apply_to(cut, std::span(&leaf, 1));
    modified += part.modified;
    changed.insert(changed.end(), part.changed_leaves.begin(), part.changed_leaves.end());
  }
  EXPECT_EQ(at_once.hash(), one_by_one.hash());
  EXPECT_EQ(whole.modified, modified);
  EXPECT_EQ(whole.changed_leaves, changed);
  EXPECT_EQ(at_once.memory_bytes(), one_by_one.memory_bytes());
  EXPECT_GT(at_once.memory_bytes(), 4u * kLeafVoxels * changed.size() / 2);
  // Applying it again changes nothing.
  EXPECT_EQ(at_once.apply(cut).modified, 0);
  EXPECT_EQ(at_once.hash(), one_by_one.hash());
}

TEST(CutField, CountsVisitedComputedAndModifiedSamples) {
  CutField field(plain_block(16.0, 8.0, 0.5), {});
  const CutReport report = field.apply(some_cuts()[0]);
  EXPECT_GE(report.visited, report.computed);
  EXPECT_GE(report.computed, report.modified);
  EXPECT_GT(report.modified, 0);
  EXPECT_FALSE(report.changed_leaves.empty());
}

}  // namespace
}  // namespace osteon
