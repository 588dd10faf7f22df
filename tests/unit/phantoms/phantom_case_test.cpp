// Cases of phantom bones: exact truth, closed surfaces, and what the case says of itself.
#include "common/phantoms/phantom_case.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/temp_dir.hpp"
#include "tests/unit/phantoms/islands.hpp"

namespace osteon::phantoms {
namespace {

constexpr DensityCalibration kLine{0.001067, 0.131};

Result<PhantomCase> made(
    const PhantomBone& bone, double pitch_mm, const KeepGoing& keep_going = [](double) { return true; }) {
  return build_phantom_case(bone, {.pitch_mm = pitch_mm, .title = "A bone", .calibration = kLine}, keep_going);
}

// How many pieces of solid samples the case has. Its surface is closed if none of them is at the end of the box.
int islands_of(const Case& bone) {
  const CoordBox box = bone.bounds_samples();
  const Coord dims = box.dims();
  std::vector<float> surface(to_index(dims.x) * to_index(dims.y) * to_index(dims.z));
  bone.gather_surface(box, surface);
  std::size_t n = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z, ++n)
        if (x == box.min.x || y == box.min.y || z == box.min.z || x == box.max.x || y == box.max.y || z == box.max.z) {
          EXPECT_GT(surface[n], 0.0f);
        }
  return count_islands(dims, surface);
}

TEST(PhantomBoneCase, IsOneClosedBoneForEachName) {
  for (const char* kind : {"femur", "tibia", "patella"}) {
    const auto bone = make_bone({.kind = kind});
    ASSERT_TRUE(bone) << bone.error().message;
    const auto found = made(**bone, 1.2);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(islands_of(found->bone), static_cast<int>((*bone)->names().size())) << kind;
  }
}

TEST(PhantomBoneCase, SurfaceLabelsAndDensityAreThoseOfTheBone) {
  const auto bone = make_bone({});
  ASSERT_TRUE(bone);
  const double pitch = 1.2;
  const auto found = made(**bone, pitch);
  ASSERT_TRUE(found) << found.error().message;
  const CaseScan& scan = found->scan;
  std::size_t n = 0;
  double volume = 0.0;
  int near = 0, alike = 0;
  for (int k = 0; k < scan.geometry.dims[2]; ++k)
    for (int j = 0; j < scan.geometry.dims[1]; ++j)
      for (int i = 0; i < scan.geometry.dims[0]; ++i, ++n) {
        const Vec3 at = scan.geometry.position_mm(Vec3(i, j, k));
        const BoneTissue tissue = (*bone)->tissue(at);
        const BoneDepths depths = (*bone)->depths(at);
        // A voxel exactly on a face may be on either side of it.
        if (std::min({std::abs(depths.surface_mm), std::abs(depths.cortex_mm), std::abs(depths.marrow_mm)}) < 1e-9)
          continue;
        // Beside bone, labels after those of the tissues are structures.
        const int label = scan.labels[n] > 3 ? 0 : scan.labels[n];
        ASSERT_EQ(label, static_cast<int>(tissue)) << at.transpose();
        ASSERT_EQ(scan.tissue[n], tissue == BoneTissue::none ? 0 : tissue == BoneTissue::cortical ? 1 : 2);
        volume += tissue == BoneTissue::none ? 0.0 : pitch * pitch * pitch;
        const double s = depths.surface_mm;
        if (n % 7 != 0 || std::abs(s) > 1.0) continue;
        // The case has the Euclidean distance, the bone one that is like it, which grows slower in grooves. Both have
        // the same zero.
        const double measured = found->bone.surface_mm(at);
        ++near;
        alike += std::abs(measured - s) < 0.1 + 0.1 * std::abs(s) ? 1 : 0;
        EXPECT_NEAR(measured, s, 0.15 + std::abs(s)) << at.transpose();
        if (s < -0.1) {
          EXPECT_NEAR(found->bone.density_g_cm3(at), (*bone)->density_g_cm3(at, pitch), 1e-5) << at.transpose();
        }
      }
  EXPECT_GT(near, 1000);
  EXPECT_GT(alike, 0.9 * near);
  EXPECT_NEAR(found->bone.volume_mm3(), volume, 0.01 * volume);
}

TEST(PhantomBoneCase, HuAreThoseOfTheDensity) {
  const auto bone = make_bone({});
  ASSERT_TRUE(bone);
  const auto found = made(**bone, 1.5);
  ASSERT_TRUE(found);
  for (std::size_t n = 0; n < found->scan.hu.size(); ++n) {
    const double density = kLine.intercept_g_cm3 + kLine.slope_g_cm3_per_hu * found->scan.hu[n];
    const int label = found->scan.labels[n];
    if (label == 0) {
      ASSERT_EQ(found->scan.hu[n], 40);
    } else if (label == 1 || label == 3) {
      ASSERT_NEAR(density, label == 1 ? (*bone)->cortical_g_cm3(1) : (*bone)->marrow_g_cm3(1), 1e-3);
    }
  }
}

TEST(PhantomBoneCase, IsSavedAndSaysWhatItIs) {
  const test::TempDir folder;
  const auto bone = make_bone({.kind = "tibia", .side = Side::right});
  ASSERT_TRUE(bone);
  const auto found = made(**bone, 1.5);
  ASSERT_TRUE(found) << found.error().message;
  const auto saved = found->bone.save(folder / "case", found->scan);
  ASSERT_TRUE(saved) << saved.error().message;
  const auto loaded = Case::load(folder / "case");
  ASSERT_TRUE(loaded) << loaded.error().message;
  ASSERT_TRUE(load_scan(folder / "case", *loaded));
  const CaseInfo& info = loaded->info();
  EXPECT_EQ(info.schema_version, 2);
  EXPECT_EQ(info.title, "A bone");
  ASSERT_GE(info.labels.size(), 6u);
  EXPECT_EQ(info.labels[0].name, "tibia, cortical");
  EXPECT_EQ(info.labels[4].name, "fibula, cancellous");
  EXPECT_EQ(info.labels[0].provenance.parameters.at("slope_degrees"), 7.0);
  EXPECT_FALSE(info.landmarks.empty());
  for (const PlannedAxis& axis : info.axes) EXPECT_NEAR(axis.direction.norm(), 1.0, 1e-9) << axis.name;
  // Bone numbers follow the names: the fibula is at the lateral side, at -x of a right leg.
  std::set<int> numbers;
  const CoordBox box = loaded->bounds_samples();
  for (int x = box.min.x; x <= box.max.x; x += 2)
    for (int y = box.min.y; y <= box.max.y; y += 2)
      for (int z = box.min.z; z <= box.max.z; z += 2) numbers.insert(loaded->bone_number({x, y, z}));
  EXPECT_EQ(numbers, (std::set<int>{0, 1, 2}));
}

TEST(PhantomBoneCase, PitchesThatDoNotFitAreOneSentence) {
  const auto bone = make_bone({});
  ASSERT_TRUE(bone);
  for (const double pitch : {0.03, 5.0}) {
    const auto found = made(**bone, pitch);
    ASSERT_FALSE(found);
    EXPECT_EQ(found.error().code, ErrorCode::invalid_input);
    EXPECT_NE(found.error().message.find("--pitch"), std::string::npos) << found.error().message;
  }
}

// A ball of bone, and as many names as asked.
class Ball final : public PhantomBone {
 public:
  Ball(const Vec3& centre, double radius_mm, std::size_t bones)
      : centre_(centre), radius_mm_(radius_mm), bones_(bones) {}

  [[nodiscard]] std::vector<std::string> names() const override { return std::vector<std::string>(bones_, "ball"); }
  [[nodiscard]] std::vector<NamedValue> parameters() const override { return {{"radius_mm", radius_mm_, 0.0, 99.0}}; }
  [[nodiscard]] BoneAnatomy anatomy() const override { return {}; }
  [[nodiscard]] Box bounds() const override { return Box{centre_, centre_}.grown(radius_mm_); }
  [[nodiscard]] BoneDepths depths(const Vec3& at_mm) const override {
    const double surface_mm = (at_mm - centre_).norm() - radius_mm_;
    return {surface_mm, surface_mm + 1.0, 1e3};
  }
  [[nodiscard]] double cancellous_g_cm3(const Vec3& /*at_mm*/) const override { return 0.3; }
  [[nodiscard]] double cortical_g_cm3(int /*bone*/) const override { return 1.9; }
  [[nodiscard]] double marrow_g_cm3(int /*bone*/) const override { return 0.1; }

 private:
  Vec3 centre_;
  double radius_mm_;
  std::size_t bones_;
};

TEST(PhantomBoneCase, ABoneBetweenVoxelsIsOneSentence) {
  const auto found = made(Ball({0.5, 0.5, 0.5}, 0.2, 1), 1.0);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::invalid_input);
  EXPECT_EQ(found.error().message, "no voxel of a pitch of 1 mm is in this bone; give a smaller --pitch");
}

// Labels are bytes, three for each bone.
TEST(PhantomBoneCase, MoreLabelsThanBytesAreABrokenPromise) {
  ASSERT_TRUE(made(Ball(Vec3::Zero(), 3.0, 85), 1.0));
  EXPECT_DEATH(static_cast<void>(made(Ball(Vec3::Zero(), 3.0, 86), 1.0)), "first_structure");
}

TEST(PhantomBoneCase, StopsWhenAsked) {
  const auto bone = make_bone({});
  ASSERT_TRUE(bone);
  const auto found = made(**bone, 2.0, [](double) { return false; });
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::phantoms
