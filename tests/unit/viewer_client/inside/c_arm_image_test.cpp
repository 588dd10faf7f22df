// The pictures of the C-arm: closed forms of what gets through, and that a picture after changes is the whole picture.
#include "viewer_client/inside/c_arm_image.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

using Pictures = std::vector<std::shared_ptr<const CArmPicture>>;

constexpr double kThick_mm = 20.0, kDensity_g_cm3 = 1.9;
// The line of Rho 1995, of a case without one of its own.
const double kBone_per_mm = radiology::attenuation_per_mm((kDensity_g_cm3 - 0.131) / 0.001067);
// 1 µGy at 1 m, in 1 mm², of which 65 % count (intensifier_test.cpp).
constexpr double kPhotons_per_ugy_mm2 = 30460.0 * 0.65;

// Along z, about the middle of a plate.
CArmPosition axial(double orbit_rad = 0.0) {
  return {{0, 0, -0.5 * kThick_mm}, orbit_rad, 1.5707963267948966, {0, 0, 0}};
}

ShotOrder order_at(std::uint64_t id, const CArmPosition& position) { return {id, ShotMode::single, position, 70 + id}; }

// A C-arm before a bone.
struct Arm {
  Pictures pictures;
  std::function<void()> when_shown;
  CArmImage image;
  explicit Arm(const radiology::Intensifier& intensifier = {})
      : image(
            [this](std::shared_ptr<const CArmPicture> picture) {
              pictures.push_back(std::move(picture));
              if (when_shown) when_shown();
            },
            intensifier) {}
  Pictures paint(const radiology::BoneHu& bone, const InsideChange& change, bool wanted = true) {
    image.paint(bone, change, [wanted](double) { return wanted; });
    return std::exchange(pictures, {});
  }
  Pictures shoot(const radiology::BoneHu& bone, const ShotOrder& order, const InsideChange& change = {},
                 std::vector<PlacedMetal> metal = {}) {
    image.make(order, 1796050000123, std::move(metal));
    return paint(bone, change);
  }
};

class CArmPictures : public testing::Test {
 protected:
  // A ball of 5 mm through the plate, at x.
  InsideChange bore(double x_mm) {
    const CutReport report =
        field_.apply(test::straight_cut(*find_tool("burr-round-5"), {x_mm, 0, 3}, {x_mm, 0, -26}, {0, 0, -1}, ++cuts_));
    return {false, bone_.update(std::vector<const CutField*>{&field_},
                                std::vector{ChangedLeaves{report.level, report.changed_leaves}})};
  }
  // What a C-arm that has seen nothing before shows.
  [[nodiscard]] std::shared_ptr<const CArmPicture> fresh(const ShotOrder& order, std::vector<PlacedMetal> metal = {}) {
    const Pictures both = Arm().shoot(bone_, order, {.all = true}, std::move(metal));
    EXPECT_EQ(both.size(), 2u);
    return both.back();
  }
  // The same at its second shot from there: then the whole picture sets the kerma, as after a change, and not the
  // coarse one.
  [[nodiscard]] std::shared_ptr<const CArmPicture> second(const ShotOrder& order,
                                                          const std::vector<PlacedMetal>& metal = {}) {
    Arm arm;
    (void)arm.shoot(bone_, order_at(999, order.position), {.all = true}, metal);
    const Pictures one = arm.shoot(bone_, order, {}, metal);
    EXPECT_EQ(one.size(), 1u);
    return one.back();
  }
  // Mean number of photons of a pixel, within a circle on the plate about (x, 0).
  static double photons_at(const CArmPicture& picture, double x_mm, double radius_mm) {
    const auto beam = radiology::beam_of(c_arm_at(picture.shot.position));
    const Vec3 middle(x_mm, 0, -0.5 * kThick_mm);
    double sum = 0.0, count = 0.0;
    for (int row = 0; row < picture.rows; ++row)
      for (int column = 0; column < picture.columns; ++column) {
        const Vec3 pixel = beam->detector.at(column, row);
        const Vec3 on_plate =
            beam->source_mm + 0.6 * (pixel - beam->source_mm);  // the isocentre is 600 of 1000 mm away
        if ((on_plate - middle).norm() > radius_mm) continue;
        const double grey = picture.grey[beam->detector.index(column, row)] / 255.0;
        const double black = std::log(static_cast<double>(picture.contrast.black));
        sum += std::exp(black + grey * (std::log(static_cast<double>(picture.contrast.white)) - black));
        count += 1.0;
      }
    EXPECT_GT(count, 10.0);
    return sum / count;
  }

  Case plate_ = test::plain_block(100.0, kThick_mm, 1.0, kDensity_g_cm3);
  CutField field_{plate_, {}};
  radiology::BoneHu bone_ = std::move(*radiology::BoneHu::make(plate_));
  std::uint64_t cuts_ = 0;
};

TEST_F(CArmPictures, NothingIsMadeUnlessSomebodyAsks) {
  Arm arm;
  EXPECT_TRUE(arm.paint(bone_, {.all = true}).empty());
  EXPECT_TRUE(arm.paint(bone_, bore(0.0)).empty());
  arm.image.make(order_at(1, axial()), 0, {});
  arm.image.drop();
  EXPECT_TRUE(arm.paint(bone_, {}).empty());
}

TEST_F(CArmPictures, AShotFromANewPlaceIsCoarseFirst) {
  Arm arm;
  const Pictures both = arm.shoot(bone_, order_at(3, axial()), {.all = true});
  ASSERT_EQ(both.size(), 2u);
  EXPECT_TRUE(both[0]->coarse);
  EXPECT_EQ(both[0]->columns, 200);
  EXPECT_EQ(both[0]->rows, 150);
  EXPECT_FALSE(both[1]->coarse);
  EXPECT_EQ(both[1]->columns, 800);
  EXPECT_EQ(both[1]->rows, 600);
  EXPECT_EQ(both[1]->grey.size(), 480000u);
  for (const auto& picture : both) EXPECT_EQ(picture->order, 3u);
  // From above the head, with the face below.
  for (const auto& picture : both) EXPECT_EQ(picture->letters, (EdgeLetters{"R", "L", "P", "A"}));
  EXPECT_EQ(both[0]->shot, both[1]->shot) << "the photons are there once";
  EXPECT_EQ(both[1]->shot.position, axial());
  EXPECT_EQ(both[1]->shot.seed, 73u);
  EXPECT_EQ(both[1]->shot.time_unix_ms, 1796050000123);
  EXPECT_GT(both[1]->shot.exposure_s, 0.0);
  // From the same place it is whole at once, and has other photons.
  const Pictures next = arm.shoot(bone_, order_at(4, axial()));
  ASSERT_EQ(next.size(), 1u);
  EXPECT_FALSE(next[0]->coarse);
  EXPECT_NE(next[0]->grey, both[1]->grey);
}

// Of a record alone, by another C-arm: the same bytes, whichever picture had set the kerma.
TEST_F(CArmPictures, AShotIsMadeAgainFromItsRecord) {
  const auto seen = fresh(order_at(3, axial())), seen_next = second(order_at(4, axial()));
  Arm other;
  for (const auto& made : {seen, seen_next, seen}) {
    CArmShot record = made->shot;
    record.number = 17;
    other.image.make_again(5, record, {});
    const Pictures again = other.paint(bone_, {});
    ASSERT_FALSE(again.empty());
    EXPECT_FALSE(again.back()->coarse);
    EXPECT_EQ(again.back()->order, 5u);
    EXPECT_EQ(again.back()->shot, record);
    EXPECT_EQ(again.back()->grey, made->grey);
  }
  EXPECT_NE(seen->grey, seen_next->grey);
  // Of another bone it is another picture.
  const InsideChange change = bore(0.0);
  other.image.make_again(6, seen->shot, {});
  EXPECT_NE(other.paint(bone_, change).back()->grey, seen->grey);
}

// Photons behind the plate are those of the kerma, times exp(−μ d). Brightness control gives 600 in each mm² there.
// The dose-area product is the kerma at 1 m on the detector there: 30 x 22.5 cm.
TEST_F(CArmPictures, PhotonsFollowTheLawOfBeerAndLambert) {
  Arm arm({.glare = 0.0});
  const auto picture = arm.shoot(bone_, order_at(1, axial()), {.all = true}).back();
  const double kerma_ugy = picture->shot.air_kerma_at_metre_ugy, pixel_mm2 = 0.375 * 0.375;
  const double through = std::exp(-kBone_per_mm * kThick_mm);
  const double expected = kerma_ugy * kPhotons_per_ugy_mm2 * pixel_mm2 * through;
  EXPECT_NEAR(photons_at(*picture, 0.0, 10.0), expected, 0.02 * expected);
  EXPECT_NEAR(expected / pixel_mm2, 600.0, 0.03 * 600.0);
  EXPECT_NEAR(picture->shot.dose_area_gy_cm2, kerma_ugy * 1e-6 * 30.0 * 22.5, 1e-9);
  // Through a hole along the rays nothing weakens them.
  const InsideChange change = bore(0.0);
  const auto bored = arm.shoot(bone_, order_at(2, axial()), change).back();
  const double open = bored->shot.air_kerma_at_metre_ugy * kPhotons_per_ugy_mm2 * pixel_mm2;
  EXPECT_NEAR(photons_at(*bored, 0.0, 1.2), open, 0.03 * open);
  EXPECT_NEAR(photons_at(*bored, 20.0, 5.0), open * through, 0.03 * open * through);
}

// Cuts that come while nobody shoots are in the next picture too.
TEST_F(CArmPictures, AfterCutsIsTheWholePicture) {
  Arm arm;
  const auto before = arm.shoot(bone_, order_at(1, axial(0.2)), {.all = true}).back();
  EXPECT_TRUE(arm.paint(bone_, bore(-12.0)).empty());
  EXPECT_TRUE(arm.paint(bone_, bore(0.0)).empty());
  const InsideChange last = bore(14.0);
  const Pictures after = arm.shoot(bone_, order_at(2, axial(0.2)), last);
  ASSERT_EQ(after.size(), 1u);
  const auto whole = second(order_at(2, axial(0.2)));
  EXPECT_EQ(after[0]->grey, whole->grey);
  EXPECT_EQ(after[0]->shot, whole->shot);
  EXPECT_NE(after[0]->grey, before->grey);
  // A whole new bone, as after a lost connection.
  const Pictures again = arm.shoot(bone_, order_at(3, axial(0.2)), {.all = true});
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[1]->grey, fresh(order_at(3, axial(0.2)))->grey);
}

// A drill that goes on, beside a pin that stays.
TEST_F(CArmPictures, MetalMovesInThePicture) {
  MetalInBeam shapes;
  const auto metal_at = [&](double x_mm) {
    std::vector<CuttingState> states(2);
    states[0].tool_name = "drill-3.2";
    states[0].pose_bone_tool = pose_along(Vec3(x_mm, 10, 2), Vec3(0, 1, 0));
    states[1].tool_name = "pin-1";
    states[1].pose_bone_tool = pose_along(Vec3(-15, 0, 0), Vec3(0, 0.6, -0.8));
    return shapes.of(states, {});
  };
  Arm arm({.glare = 0.0});
  const auto without = arm.shoot(bone_, order_at(1, axial()), {.all = true}).back();
  const auto with = arm.shoot(bone_, order_at(2, axial()), {}, metal_at(15.0)).back();
  // 2.8 to 3.2 mm of steel let 1 in 70 to 140 through: one or two of the 84 photons of a pixel. Or it is black, where
  // the darkest hundredth of the picture is brighter.
  EXPECT_LT(photons_at(*with, 15.0, 0.8), std::max(4.0, 1.05 * static_cast<double>(with->contrast.black)));
  EXPECT_LT(photons_at(*with, 15.0, 0.8), 0.9 * photons_at(*without, 15.0, 0.8));
  Arm glaring;
  (void)glaring.shoot(bone_, order_at(3, axial()), {.all = true}, metal_at(15.0));
  const auto moved = glaring.shoot(bone_, order_at(4, axial()), {}, metal_at(13.0)).back();
  EXPECT_EQ(moved->grey, second(order_at(4, axial()), metal_at(13.0))->grey);
  const auto gone = glaring.shoot(bone_, order_at(5, axial())).back();
  EXPECT_EQ(gone->grey, second(order_at(5, axial()))->grey);
}

TEST_F(CArmPictures, AnArmThatMovesOnNeedsNoWholePicture) {
  Arm arm;
  arm.when_shown = [&] {
    arm.when_shown = {};
    arm.image.make(order_at(2, axial(0.1)), 0, {});
  };
  const Pictures first = arm.shoot(bone_, order_at(1, axial()), {.all = true});
  ASSERT_EQ(first.size(), 1u);
  EXPECT_TRUE(first[0]->coarse);
  const Pictures second = arm.paint(bone_, {});
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(second[1]->order, 2u);
  EXPECT_EQ(second[1]->grey, fresh(order_at(2, axial(0.1)))->grey);
}

TEST_F(CArmPictures, EndSoonWhenTheyAreNotWantedAnyMore) {
  Arm arm;
  arm.image.make(order_at(1, axial()), 0, {});
  const Pictures shown = arm.paint(bone_, {.all = true}, false);
  ASSERT_EQ(shown.size(), 1u);
  EXPECT_TRUE(shown[0]->coarse);
  // It is added again: all is new to it.
  EXPECT_EQ(arm.shoot(bone_, order_at(2, axial()), {.all = true}).size(), 2u);
}

// The densest matter on the rays through a plate is the plate, and air in a hole along them.
TEST_F(CArmPictures, MaximumIntensityFollowsCutsWithoutAShot) {
  Arm arm;
  arm.image.show_maximum(axial());
  const Pictures both = arm.paint(bone_, {.all = true});
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[1]->order, 0u);
  EXPECT_EQ(both[1]->shot, CArmShot{});
  for (const auto& picture : both) EXPECT_EQ(picture->letters, (EdgeLetters{"R", "L", "P", "A"}));
  const auto grey_of = [](double hu) { return std::lround(255.0 * (hu + 200.0) / 2000.0); };
  const std::size_t middle = 300u * 800u + 400u;
  EXPECT_NEAR(both[1]->grey[middle], grey_of((kDensity_g_cm3 - 0.131) / 0.001067), 1.0);
  EXPECT_EQ(both[1]->grey[0], 0) << "air";
  EXPECT_TRUE(arm.paint(bone_, {}).empty()) << "nothing has changed";
  const Pictures after = arm.paint(bone_, bore(0.0));
  ASSERT_EQ(after.size(), 1u);
  EXPECT_EQ(after[0]->grey[middle], 0);
  Arm other;
  other.image.show_maximum(axial());
  EXPECT_EQ(other.paint(bone_, {.all = true}).back()->grey, after[0]->grey);
  arm.image.show_maximum(axial(0.3));
  EXPECT_EQ(arm.paint(bone_, {}).size(), 2u) << "another place";
  // X-rays of the same place come from layers of their own.
  const Pictures four = arm.shoot(bone_, order_at(9, axial(0.3)));
  ASSERT_EQ(four.size(), 4u);
  EXPECT_EQ(four[1]->grey, fresh(order_at(9, axial(0.3)))->grey);
  EXPECT_EQ(four[3]->order, 0u);
  // Somebody waits for the whole picture of a shot, wherever maximum intensity is looked for.
  const Pictures whole = arm.shoot(bone_, order_at(10, axial(0.5)));
  ASSERT_EQ(whole.size(), 4u);
  EXPECT_EQ(whole[1]->order, 10u);
  EXPECT_FALSE(whole[1]->coarse);
  arm.image.show_maximum(std::nullopt);
  EXPECT_TRUE(arm.paint(bone_, bore(9.0)).empty());
}

}  // namespace
}  // namespace osteon
