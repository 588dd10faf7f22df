// Surfaces between slices of 3 mm with pixels of 0.5 mm: 1 to 6. The truth is a ball or a cylinder.
#include "common/imaging/slice_shapes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "common/imaging/resample.hpp"
#include "tests/unit/imaging/always.hpp"

namespace osteon::imaging {
namespace {

constexpr double kThickSlice_mm = 3.0, kThinPixel_mm = 0.5, kAround_hu = 50.0, kSolid_hu = 1000.0, kContour_hu = 226.0;
const SurfaceLevel kContour{kContour_hu};

// Signed distance, negative inside.
using Shape = std::function<double(const Vec3&)>;

// What a scanner sees whose slices are as thick as they are apart: the mean over 2 x 2 x 12 points of each voxel.
HuVolume scan_of(const Shape& shape) {
  HuVolume volume;
  volume.dims = {64, 64, 12};
  volume.spacing_mm = {kThinPixel_mm, kThinPixel_mm, kThickSlice_mm};
  volume.origin_mm = {-15.75, -15.75, -16.3};
  for (int z = 0; z < volume.dims[2]; ++z)
    for (int y = 0; y < volume.dims[1]; ++y)
      for (int x = 0; x < volume.dims[0]; ++x) {
        double bone = 0.0;
        for (int i = 0; i < 48; ++i) {
          const Vec3 part((i % 2 - 0.5) / 2.0, (i / 2 % 2 - 0.5) / 2.0, (i / 4 + 0.5) / 12.0 - 0.5);
          bone += std::clamp(0.5 - shape(volume.position_mm(Vec3(x, y, z) + part)) / 0.25, 0.0, 1.0) / 48.0;
        }
        volume.values.push_back(static_cast<std::int16_t>(std::lround(kAround_hu + (kSolid_hu - kAround_hu) * bone)));
      }
  return volume;
}

SparseMask bones_of(const HuVolume& volume) {
  VoxelMask bones(volume.dims);
  for (std::size_t i = 0; i < bones.values.size(); ++i) bones.values[i] = volume.values[i] >= kContour_hu ? 1 : 0;
  return SparseMask(bones);
}

constexpr CoordBox kBox{{-30, -30, -30}, {30, 30, 30}};  // ±15 mm

// Values over kBox, inside at 0 and above.
class Field {
 public:
  explicit Field(std::vector<float> values) : values_(std::move(values)) {}
  [[nodiscard]] double at(const Vec3& point_mm) const {
    const Vec3 p = point_mm / kThinPixel_mm - Vec3(kBox.min.x, kBox.min.y, kBox.min.z);
    const Vec3 low = p.array().floor();
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
      const Vec3 weight = Vec3::Ones() - (p - low - step).cwiseAbs();
      const Vec3 c = low + step;
      sum += weight.prod() * static_cast<double>(values_[static_cast<std::size_t>((c.x() * 61 + c.y()) * 61 + c.z())]);
    }
    return sum;
  }
  [[nodiscard]] const std::vector<float>& values() const { return values_; }

 private:
  std::vector<float> values_;
};

Field by_shapes(const HuVolume& volume) {
  const SparseMask bones = bones_of(volume);
  const auto shapes = SliceShapes::make(volume, bones, kContour, always);
  EXPECT_TRUE(shapes);
  std::vector<float> values(61 * 61 * 61);
  shapes->read(kBox, kThinPixel_mm, values);
  return Field(std::move(values));
}

Field by_hu(const HuVolume& volume) {
  auto values = resample(volume, kBox, kThinPixel_mm, always);
  EXPECT_TRUE(values);
  for (float& hu : values->values) hu -= static_cast<float>(kContour_hu);
  return Field(std::move(values->values));
}

// How far a field's surface is from points of the true one, along the true normals, and how far its normals turn.
struct Deviation {
  double mean_mm = 0.0, most_mm = 0.0, normal_deg = 0.0;
};

struct SurfacePoint {
  Vec3 point_mm, normal;
};

Deviation deviation(const Field& field, const std::vector<SurfacePoint>& surface) {
  constexpr double kStep_mm = 0.05, kReach_mm = 3.0;
  std::vector<double> apart_mm, turned_deg;
  for (const SurfacePoint& s : surface) {
    double nearest = kReach_mm, before = field.at(s.point_mm - kReach_mm * s.normal);
    for (double t = -kReach_mm + kStep_mm; t < kReach_mm; t += kStep_mm) {
      const double here = field.at(s.point_mm + t * s.normal);
      if ((before >= 0.0) != (here >= 0.0) && std::abs(t) < std::abs(nearest)) nearest = t;
      before = here;
    }
    apart_mm.push_back(std::abs(nearest));
    const Vec3 at = s.point_mm + nearest * s.normal;
    Vec3 inwards;
    for (int axis = 0; axis < 3; ++axis)
      inwards[axis] = field.at(at + 0.25 * Vec3::Unit(axis)) - field.at(at - 0.25 * Vec3::Unit(axis));
    const double cosine = std::clamp(-inwards.normalized().dot(s.normal), -1.0, 1.0);
    turned_deg.push_back(std::acos(cosine) * 180.0 / std::numbers::pi);
  }
  std::ranges::sort(apart_mm);
  Deviation found{.most_mm = apart_mm[apart_mm.size() * 95 / 100]};
  for (const double d : apart_mm) found.mean_mm += d / static_cast<double>(apart_mm.size());
  for (const double d : turned_deg) found.normal_deg += d / static_cast<double>(turned_deg.size());
  return found;
}

void print(const char* what, const Deviation& d) {
  std::printf("%s: mean %.2f mm, 95 %% %.2f mm, normal %.1f deg\n", what, d.mean_mm, d.most_mm, d.normal_deg);
}

TEST(SliceShapes, ABallHasNoSteps) {
  constexpr double kRadius_mm = 10.0;
  const HuVolume scan = scan_of([](const Vec3& p) { return p.norm() - kRadius_mm; });
  std::vector<SurfacePoint> surface;
  constexpr int kPoints = 1500;
  for (int i = 0; i < kPoints; ++i) {  // a spiral of equal areas
    const double z = (i + 0.5) * 2.0 / kPoints - 1.0, angle = 2.399963 * i, r = std::sqrt(1.0 - z * z);
    const Vec3 n(r * std::cos(angle), r * std::sin(angle), z);
    surface.push_back({kRadius_mm * n, n});
  }
  const Deviation before = deviation(by_hu(scan), surface), after = deviation(by_shapes(scan), surface);
  print("ball by HU", before);
  print("ball by shapes", after);
  EXPECT_LT(after.mean_mm, 0.6);
  EXPECT_LT(after.mean_mm, 0.7 * before.mean_mm);
  EXPECT_LT(after.most_mm, 0.7 * before.most_mm);
  EXPECT_LT(after.normal_deg, 0.5 * before.normal_deg);
}

TEST(SliceShapes, ATiltedCylinderHasNoSteps) {
  constexpr double kRadius_mm = 6.0;
  for (const double tilt_deg : {40.0, 60.0}) {
    const double tilt = tilt_deg * std::numbers::pi / 180.0;
    const Vec3 axis(std::sin(tilt), 0.0, std::cos(tilt)), across(std::cos(tilt), 0.0, -std::sin(tilt));
    const HuVolume scan = scan_of([&](const Vec3& p) { return (p - p.dot(axis) * axis).norm() - kRadius_mm; });
    std::vector<SurfacePoint> surface;
    for (double along = -5.0; along < 5.0; along += 0.37)
      for (double angle = 0.0; angle < 6.28; angle += 0.1) {
        const Vec3 n = std::cos(angle) * across + std::sin(angle) * Vec3::UnitY();
        surface.push_back({along * axis + kRadius_mm * n, n});
      }
    const Deviation before = deviation(by_hu(scan), surface), after = deviation(by_shapes(scan), surface);
    std::printf("tilted by %.0f deg: ", tilt_deg);
    print("by HU", before);
    print("by shapes", after);
    EXPECT_LT(after.mean_mm, 0.6);
    EXPECT_LT(after.mean_mm, 0.7 * before.mean_mm);
    EXPECT_LT(after.most_mm, 0.7 * before.most_mm);
    EXPECT_LT(after.normal_deg, 0.5 * before.normal_deg);
  }
}

// A plane that leans by one pixel for each slice is a straight edge in each slice, half a pixel of its own away from
// the pixels. So the distances, and what is between them, are exact.
TEST(SliceShapes, ALeaningPlaneIsExact) {
  HuVolume volume;
  volume.dims = {40, 8, 6};
  volume.spacing_mm = {kThinPixel_mm, kThinPixel_mm, kThickSlice_mm};
  for (int z = 0; z < 6; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 40; ++x)
        volume.values.push_back(static_cast<std::int16_t>(100.0 * (x - 16.3 - 1.4 * z)));  // a ramp across the edge
  SparseMask bones;
  bones.dims = volume.dims;
  for (const std::int16_t value : volume.values) bones.values.push_back(value >= 0 ? 1 : 0);
  const SurfaceLevel zero;
  const auto shapes = SliceShapes::make(volume, bones, zero, always);
  ASSERT_TRUE(shapes);
  const CoordBox box{{5, 2, 0}, {30, 4, 30}};
  std::vector<float> values(26 * 3 * 31);
  shapes->read(box, kThinPixel_mm, values);
  // 30000 units are twenty slices.
  const double unit_mm = 20.0 * kThickSlice_mm / 30000.0;
  for (int x = 5; x <= 30; ++x)
    for (int z = 6; z <= 24; ++z) {  // where two slices are on either side
      const double edge_mm = kThinPixel_mm * (16.3 + 1.4 * (z * kThinPixel_mm / kThickSlice_mm)),
                   from_edge = x * kThinPixel_mm - edge_mm;
      const float value = values[static_cast<std::size_t>(((x - 5) * 3 + 1) * 31 + z)];
      EXPECT_NEAR(unit_mm * static_cast<double>(value), from_edge, 0.02) << x << " " << z;
    }
}

TEST(SliceShapes, EveryVoxelKeepsItsSide) {
  const HuVolume scan =
      scan_of([](const Vec3& p) { return std::max(p.norm() - 11.0, 5.0 - (p - Vec3(4, 0, 2)).norm()); });
  HuVolume aligned = scan;
  aligned.origin_mm = {-15.5, -15.5, -16.5};  // voxels lie on samples
  const Field field = by_shapes(aligned);
  for (int z = 1; z < 11; ++z)
    for (int y = 1; y < 62; ++y)
      for (int x = 1; x < 62; ++x) {
        const Vec3 at = aligned.position_mm(Vec3(x, y, z));
        if (at.cwiseAbs().maxCoeff() >= 15.0) continue;
        EXPECT_EQ(field.at(at) >= 0.0, aligned.at(x, y, z) >= kContour_hu) << at.transpose();
      }
}

TEST(SliceShapes, BoxesAreNeverOnOneSideOnlyBecauseTheirVoxelsAre) {
  const HuVolume scan = scan_of([](const Vec3& p) { return p.norm() - 10.0; });
  const SparseMask bones = bones_of(scan);
  const auto shapes = SliceShapes::make(scan, bones, kContour, always);
  ASSERT_TRUE(shapes);
  std::vector<float> values(512);
  int sides[3] = {};
  for (int x = -32; x < 24; x += 8)
    for (int y = -32; y < 24; y += 8)
      for (int z = -32; z < 24; z += 8) {
        const CoordBox box{{x, y, z}, {x + 7, y + 7, z + 7}};
        shapes->read(box, kThinPixel_mm, values);
        const auto count = std::ranges::count_if(values, [](float v) { return v >= 0.0f; });
        const Inside inside = shapes->inside(box, kThinPixel_mm);
        EXPECT_TRUE(inside != Inside::none || count == 0);
        EXPECT_TRUE(inside != Inside::all || count == 512);
        ++sides[static_cast<int>(inside)];
      }
  EXPECT_GT(sides[0], 0);
  EXPECT_GT(sides[1], 0);
  EXPECT_GT(sides[2], 0);
}

TEST(SliceShapes, CanBeStopped) {
  const HuVolume scan = scan_of([](const Vec3& p) { return p.norm() - 10.0; });
  const SparseMask bones = bones_of(scan);
  for (const double at : {0.0, 0.15, 0.7}) {
    const auto stopped = SliceShapes::make(scan, bones, kContour, [&](double done) { return done < at; });
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

TEST(SliceShapes, AreForSlicesFartherApartThanTwoPixels) {
  HuVolume volume;
  volume.spacing_mm = {0.957, 0.957, 1.5};
  EXPECT_FALSE(has_thick_slices(volume));
  volume.spacing_mm = {0.84, 0.84, 3.0};
  EXPECT_TRUE(has_thick_slices(volume));
}

}  // namespace
}  // namespace osteon::imaging
