// The geometry of the C-arm: directions of the usual views, magnification, shadows.
#include "common/radiology/c_arm.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <numbers>
#include <string>

#include "tests/support/scenes/random.hpp"
#include "tests/unit/radiology/beams.hpp"

namespace osteon::radiology {
namespace {

Vec3 beam_direction(const ConeBeam& beam) {
  const PixelGrid& grid = beam.detector;
  return (grid.at(0.5 * (grid.columns - 1), 0.5 * (grid.rows - 1)) - beam.source_mm).normalized();
}

TEST(CArm, ViewsLookAlongThePatientsAxes) {
  const Vec3 centre(10, 20, 30);
  const ConeBeam front = good_beam(c_arm_at(View::anteroposterior, centre));
  EXPECT_LT((beam_direction(front) - Vec3(0, -1, 0)).norm(), 1e-12);  // the detector is in front of the patient
  EXPECT_GT(front.detector.column_mm.x(), 0.0);                       // the patient's left at the right
  EXPECT_LT(front.detector.row_mm.z(), 0.0);                          // the feet below
  const ConeBeam side = good_beam(c_arm_at(View::lateral, centre));
  EXPECT_LT((beam_direction(side) - Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT(side.detector.row_mm.z(), 0.0);
  const ConeBeam along = good_beam(c_arm_at(View::axial, centre));
  EXPECT_LT((beam_direction(along) - Vec3(0, 0, 1)).norm(), 1e-12);
  for (const ConeBeam& beam : {front, side, along}) {
    // The middle of the image shows the isocentre, and the image is as from the detector.
    EXPECT_LT((beam.source_mm + 600.0 * beam_direction(beam) - centre).norm(), 1e-9);
    EXPECT_LT((beam.detector.column_mm.cross(beam.detector.row_mm).normalized() + beam_direction(beam)).norm(), 1e-9);
  }
}

TEST(CArm, OrbitMovesTheDetectorToTheLeftAndTiltToTheHead) {
  CArm arm;
  arm.orbit_rad = 0.2;
  EXPECT_GT(beam_direction(good_beam(arm)).x(), 0.0);
  arm.orbit_rad = 0.0;
  arm.tilt_rad = 0.2;
  EXPECT_GT(beam_direction(good_beam(arm)).z(), 0.0);
  EXPECT_NEAR(beam_direction(good_beam(arm)).x(), 0.0, 1e-12);
  const ConeBeam there = good_beam(arm);
  arm.translation_mm = Vec3(3, 4, 5);
  EXPECT_LT((good_beam(arm).source_mm - there.source_mm - Vec3(3, 4, 5)).norm(), 1e-9);
}

// By hand: an orbit of 30° and a tilt of 45°, from the isocentre, as DICOM's primary and secondary angles. With the
// rotations in the other order, the detector would lie at (0.5, −0.6124, 0.6124).
TEST(CArm, OrbitAndTiltAreThePrimaryAndTheSecondaryAngle) {
  CArm arm;
  arm.orbit_rad = std::numbers::pi / 6.0;
  arm.tilt_rad = std::numbers::pi / 4.0;
  const ConeBeam beam = good_beam(arm);
  const Vec3 to_detector(0.5 * 0.70710678, -0.86602540 * 0.70710678, 0.70710678);
  EXPECT_LT((beam_direction(beam) - to_detector).norm(), 1e-7);
  EXPECT_LT((beam.source_mm + 600.0 * to_detector).norm(), 1e-4);
  // The rows of the image stay across the patient's long axis: the orbit alone turns them.
  EXPECT_LT((beam.detector.column_mm.normalized() - Vec3(0.86602540, 0.5, 0.0)).norm(), 1e-7);
  EXPECT_LT((beam.detector.row_mm.normalized() - Vec3(0.5 * 0.70710678, -0.86602540 * 0.70710678, -0.70710678)).norm(),
            1e-7);
}

// Intercept theorem: 30 mm at the isocentre are 50 mm on the detector.
TEST(CArm, Magnifies) {
  CArm arm;
  const ConeBeam beam = good_beam(arm);
  const PixelBox shadow = shadow_of({Vec3(-15, 0, -15), Vec3(15, 0, 15)}, beam);
  const double pixel = beam.detector.column_mm.norm();
  EXPECT_NEAR((shadow.last_column - shadow.first_column) * pixel, 50.0, 5.0 * pixel);
  EXPECT_NEAR((shadow.last_row - shadow.first_row) * pixel, 50.0, 5.0 * pixel);
}

TEST(CArm, AShadowHoldsAllRaysThroughTheBox) {
  test::Random random(21);
  for (int i = 0; i < 50; ++i) {
    CArm arm;
    arm.orbit_rad = random.between(-3.0, 3.0);
    arm.tilt_rad = random.between(-1.5, 1.5);
    arm.columns = 80;
    arm.rows = 60;
    const ConeBeam beam = good_beam(arm);
    const Vec3 middle = random.in_cube(60.0);
    const Box box{middle - Vec3(3, 4, 5), middle + Vec3(5, 3, 4)};
    const PixelBox shadow = shadow_of(box, beam);
    for (int row = 0; row < arm.rows; ++row)
      for (int column = 0; column < arm.columns; ++column) {
        const Vec3 pixel = beam.detector.at(column, row);
        bool meets = false;
        for (double at = 0.45; at < 0.75 && !meets; at += 0.0005) {
          const Vec3 p = beam.source_mm + at * (pixel - beam.source_mm);
          meets = (p.array() >= box.min_mm.array()).all() && (p.array() <= box.max_mm.array()).all();
        }
        if (meets) {
          ASSERT_TRUE(shadow.meets({column, row, column, row}));
        }
      }
  }
  // Beside the detector there is none.
  EXPECT_TRUE(shadow_of({Vec3(900, 0, 0), Vec3(901, 1, 1)}, good_beam(CArm{})).empty());
  // A box about the source is everywhere.
  const ConeBeam beam = good_beam(CArm{});
  EXPECT_EQ(shadow_of({beam.source_mm - Vec3(1, 1, 1), beam.source_mm + Vec3(1, 1, 1)}, beam),
            (PixelBox{0, 0, 799, 599}));
}

TEST(CArm, RefusesWhatIsNoBeamAndNamesTheField) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const auto refused = [](const char* field, const std::function<void(CArm&)>& change) {
    CArm arm;
    change(arm);
    const Result<ConeBeam> beam = beam_of(arm);
    ASSERT_FALSE(beam.has_value()) << field;
    EXPECT_EQ(beam.error().code, ErrorCode::invalid_input);
    EXPECT_NE(beam.error().message.find(field), std::string::npos) << beam.error().message;
  };
  refused("isocentre_mm", [&](CArm& arm) { arm.isocentre_mm.y() = nan; });
  refused("translation_mm", [&](CArm& arm) { arm.translation_mm.z() = inf; });
  refused("orbit_rad", [&](CArm& arm) { arm.orbit_rad = nan; });
  refused("tilt_rad", [&](CArm& arm) { arm.tilt_rad = inf; });
  refused("detector_mm", [](CArm& arm) { arm.detector_mm = 0.0; });
  refused("source_detector_mm", [](CArm& arm) { arm.source_detector_mm = -1000.0; });
  refused("source_isocentre_mm", [&](CArm& arm) { arm.source_isocentre_mm = nan; });
  refused("columns", [](CArm& arm) { arm.columns = -800; });
  refused("columns", [](CArm& arm) { arm.columns = std::numeric_limits<int>::max(); });
  refused("rows", [](CArm& arm) { arm.rows = 0; });
  EXPECT_TRUE(beam_of(CArm{}).has_value());
}

}  // namespace
}  // namespace osteon::radiology
