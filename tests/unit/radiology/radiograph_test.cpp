// Radiographs: closed forms under the cone, convergence, symmetry, conservation, and that rays cast again after a cut
// give the same image as all rays.
#include "common/radiology/radiograph.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "common/radiology/attenuation.hpp"
#include "common/radiology/intensifier.hpp"
#include "common/radiology/metal.hpp"
#include "common/radiology/sampling.hpp"
#include "common/tools/implicit.hpp"
#include "common/tools/tool_solid.hpp"
#include "common/volume/fragments.hpp"
#include "tests/support/scenes/random_cuts.hpp"
#include "tests/unit/radiology/beams.hpp"

namespace osteon::radiology {
namespace {

using Distance = std::function<double(const Vec3&)>;

constexpr double kDensity_g_cm3 = 1.2;
double bone_per_mm(double density_g_cm3 = kDensity_g_cm3) {
  return attenuation_per_mm((density_g_cm3 - kDefaultLine.intercept_g_cm3) / kDefaultLine.slope_g_cm3_per_hu);
}

Case solid_bone(const Box& extent, double pitch_mm, const Distance& distance, double density = kDensity_g_cm3) {
  return test::make_bone(extent, pitch_mm, distance, [=](const Vec3&) { return density; });
}

BoneHu hu_of(const Case& bone) {
  auto made = BoneHu::make(bone);
  EXPECT_TRUE(made.has_value());
  return std::move(*made);
}

Radiograph image_of(const BoneHu& bone, const ConeBeam& beam, Projection projection = Projection::attenuation) {
  Radiograph image(beam, projection);
  image.cast(bone);
  return image;
}

// A beam of few pixels, turned away from the axes of the lattice.
ConeBeam small_beam(double orbit_rad = 0.3, double tilt_rad = 0.2) {
  CArm arm;
  arm.orbit_rad = orbit_rad;
  arm.tilt_rad = tilt_rad;
  arm.detector_mm = 80.0;
  arm.columns = 96;
  arm.rows = 72;
  return good_beam(arm);
}

// Length of a line in a solid that is the part of space between the two roots of a quadratic in the line's position.
double chord(double a, double b, double c) {
  const double under = b * b - 4.0 * a * c;
  return a > 0.0 && under > 0.0 ? std::sqrt(under) / a : 0.0;
}

double length_in_ball(const ConeBeam& beam, const Vec3& pixel, double radius) {
  const Vec3 d = (pixel - beam.source_mm).normalized(), s = beam.source_mm;
  return chord(1.0, 2.0 * d.dot(s), s.squaredNorm() - radius * radius);
}

// About the z axis, long enough that no ray leaves at its ends.
double length_in_tube(const ConeBeam& beam, const Vec3& pixel, double outer, double inner) {
  const Vec3 d = (pixel - beam.source_mm).normalized(), s = beam.source_mm;
  const double a = d.head<2>().squaredNorm(), b = 2.0 * d.head<2>().dot(s.head<2>()), c = s.head<2>().squaredNorm();
  return chord(a, b, c - outer * outer) - chord(a, b, c - inner * inner);
}

// Of the ray within half-spaces n · p <= offset, mm from the source. None if the last is not beyond the first.
struct Part {
  double first = 0.0, last = 1e9;
};
Part part_in_wedge(const ConeBeam& beam, const Vec3& pixel, const std::vector<HalfSpace>& faces) {
  const Vec3 d = (pixel - beam.source_mm).normalized();
  Part part;
  for (const HalfSpace& face : faces) {
    const double along = face.normal.dot(d), left = face.offset_mm - face.normal.dot(beam.source_mm);
    if (along > 0.0) part.last = std::min(part.last, left / along);
    if (along < 0.0) part.first = std::max(part.first, left / along);
    if (along == 0.0 && left < 0.0) return {1.0, 0.0};
  }
  return part;
}

// Of a solid in closed form, for a ray from the source to a pixel.
struct ClosedForm {
  std::function<double(const ConeBeam&, const Vec3&)> length_mm;
  // How far the ray passes from the nearest rim: where a length changes by a root of the distance from it, or has a
  // kink.
  std::function<double(const ConeBeam&, const Vec3&)> rim_mm;
};

// Away from rims: three voxels of the coarser bone.
constexpr double kFromRim_mm = 1.5;

struct Errors {
  double rms = 0.0, worst = 0.0;  // of the range: within the shadow, and of single pixels away from rims
  std::size_t away = 0;           // pixels away from rims
};

Errors errors(const Radiograph& image, const ClosedForm& solid) {
  const ConeBeam& beam = image.beam();
  const PixelGrid& grid = beam.detector;
  Errors found;
  double range = 0.0, squares = 0.0;
  std::size_t shadow = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const Vec3 pixel = grid.at(column, row);
      const double exact = bone_per_mm() * solid.length_mm(beam, pixel);
      const double value = static_cast<double>(image.attenuation()[grid.index(column, row)]), error = value - exact;
      const double rim_mm = solid.rim_mm(beam, pixel);
      range = std::max(range, exact);
      if (exact == 0.0) {
        if (rim_mm > kFromRim_mm) {
          EXPECT_EQ(value, 0.0);  // beside the shadow there is nothing
        }
        continue;
      }
      squares += error * error;
      ++shadow;
      if (rim_mm <= kFromRim_mm) continue;
      found.worst = std::max(found.worst, std::abs(error));
      ++found.away;
    }
  EXPECT_GT(range, 0.1);
  found.rms = std::sqrt(squares / static_cast<double>(shadow)) / range;
  found.worst /= range;
  return found;
}

// One percent of the range at the pitch of a CT, both as root mean square in the shadow and in each pixel away from
// rims. The error falls with the pitch.
void expect_closed_form(const Box& extent, const Distance& distance, const ClosedForm& solid) {
  const ConeBeam beam = small_beam();
  Errors found[2];
  for (const int finer : {0, 1})
    found[finer] = errors(image_of(hu_of(solid_bone(extent, finer ? 0.25 : 0.5, distance)), beam), solid);
  EXPECT_LT(found[0].rms, 0.01);
  EXPECT_LT(found[0].worst, 0.01);
  EXPECT_LT(found[1].rms, found[0].rms / 1.5);
  EXPECT_LT(found[1].worst, found[0].worst / 1.5);
  EXPECT_GT(found[0].away, 1000U);
  std::printf("[ error    ] of the range: rms %.3f %%, worst %.3f %%; at half the pitch %.3f %%, %.3f %%\n",
              100.0 * found[0].rms, 100.0 * found[0].worst, 100.0 * found[1].rms, 100.0 * found[1].worst);
}

TEST(Radiograph, OfABall) {
  const auto rim_mm = [](const ConeBeam& beam, const Vec3& pixel) {
    const Vec3 d = (pixel - beam.source_mm).normalized();
    return std::abs(12.0 - beam.source_mm.cross(d).norm());
  };
  expect_closed_form(
      {Vec3(-12, -12, -12), Vec3(12, 12, 12)}, [](const Vec3& p) { return p.norm() - 12.0; },
      {[](const ConeBeam& beam, const Vec3& pixel) { return length_in_ball(beam, pixel, 12.0); }, rim_mm});
}

TEST(Radiograph, OfATube) {
  // The distance between the ray and the tube's axis, from either wall.
  const auto rim_mm = [](const ConeBeam& beam, const Vec3& pixel) {
    const Vec3 d = pixel - beam.source_mm, s = beam.source_mm;
    const double nearest = std::abs(s.x() * d.y() - s.y() * d.x()) / std::hypot(d.x(), d.y());
    return std::min(std::abs(11.0 - nearest), std::abs(6.0 - nearest));
  };
  expect_closed_form(
      {Vec3(-11, -11, -45), Vec3(11, 11, 45)},
      [](const Vec3& p) {
        const double r = std::hypot(p.x(), p.y());
        return std::max({r - 11.0, 6.0 - r, std::abs(p.z()) - 45.0});
      },
      {[](const ConeBeam& beam, const Vec3& pixel) { return length_in_tube(beam, pixel, 11.0, 6.0); }, rim_mm});
}

TEST(Radiograph, OfAWedge) {
  const std::vector<HalfSpace> faces{{Vec3(-1, 0, 0), 12.0},
                                     {Vec3(0, -1, 0), 2.0},
                                     {Vec3(1, 2, 0).normalized(), 12.0},
                                     {Vec3(0, 0, 1), 13.3},
                                     {Vec3(0, 0, -1), 13.3}};
  // Where the ray enters and leaves: the distance from the nearest face but its own.
  const auto rim_mm = [&](const ConeBeam& beam, const Vec3& pixel) {
    const Vec3 d = (pixel - beam.source_mm).normalized();
    const Part part = part_in_wedge(beam, pixel, faces);
    if (part.last <= part.first) return 0.0;
    double least = 1e9;
    for (const double at : {part.first, part.last}) {
      std::vector<double> from;
      for (const HalfSpace& face : faces)
        from.push_back(std::abs(face.normal.dot(beam.source_mm + at * d) - face.offset_mm));
      std::ranges::nth_element(from, from.begin() + 1);
      least = std::min(least, from[1]);
    }
    return least;
  };
  const Implicit solid = convex(faces);
  expect_closed_form(solid.bounds, solid.distance_mm,
                     {[&](const ConeBeam& beam, const Vec3& pixel) {
                        const Part part = part_in_wedge(beam, pixel, faces);
                        return std::max(0.0, part.last - part.first);
                      },
                      rim_mm});
}

// Along a ray through the middle of a ball, every view gives the same, to half a pitch: the ends of a ray fall between
// two planes.
TEST(Radiograph, OfABallIsTheSameFromEverywhere) {
  const BoneHu bone =
      hu_of(solid_bone({Vec3(-8, -8, -8), Vec3(8, 8, 8)}, 0.5, [](const Vec3& p) { return p.norm() - 8.0; }));
  test::Random random(3);
  for (int i = 0; i < 40; ++i) {
    ConeBeam beam;
    const Vec3 axis = random.direction();
    beam.source_mm = -500.0 * axis;
    beam.detector = {200.0 * axis, pose_along(Vec3::Zero(), axis).direction(Vec3::UnitX()),
                     pose_along(Vec3::Zero(), axis).direction(Vec3::UnitY()), 1, 1};
    EXPECT_NEAR(static_cast<double>(image_of(bone, beam).attenuation()[0]), 16.0 * bone_per_mm(),
                0.5 * bone.pitch_mm() * bone_per_mm());
  }
}

TEST(Radiograph, OfAMirroredBoneIsMirrored) {
  const auto blob = [](const Vec3& p) {
    return std::min((p - Vec3(5, 1, 2)).norm() - 6.0, (p - Vec3(-4, -2, -1)).norm() - 8.0);
  };
  const Box extent{Vec3(-13, -13, -13), Vec3(13, 13, 13)};
  const BoneHu bone = hu_of(solid_bone(extent, 0.5, blob));
  const BoneHu mirrored =
      hu_of(solid_bone(extent, 0.5, [&](const Vec3& p) { return blob(Vec3(-p.x(), p.y(), p.z())); }));
  const ConeBeam beam = small_beam(0.0, 0.25);  // in the plane of the mirror
  const Radiograph a = image_of(bone, beam), b = image_of(mirrored, beam);
  const PixelGrid& grid = beam.detector;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      ASSERT_NEAR(static_cast<double>(a.attenuation()[grid.index(column, row)]),
                  static_cast<double>(b.attenuation()[grid.index(grid.columns - 1 - column, row)]), 1e-4);
}

// Two densities whose attenuations are as one to two.
TEST(Radiograph, ScalesWithTheAttenuation) {
  const auto ball = [](const Vec3& p) { return p.norm() - 9.0; };
  const Box extent{Vec3(-9, -9, -9), Vec3(9, 9, 9)};
  const double once = 0.5, at_once = bone_per_mm(once);
  const double hu = (2.0 * at_once - kWater_per_mm) / (kCorticalBone_per_mm - kWater_per_mm) * kCorticalBone_hu;
  const double twice = kDefaultLine.intercept_g_cm3 + kDefaultLine.slope_g_cm3_per_hu * hu;
  ASSERT_NEAR(bone_per_mm(twice), 2.0 * at_once, 1e-9);
  const ConeBeam beam = small_beam();
  const auto inner = [&](double density) {
    const BoneHu bone = hu_of(solid_bone(extent, 0.5, ball, density));
    return static_cast<double>(image_of(bone, beam).attenuation()[beam.detector.index(47, 35)]);
  };
  EXPECT_NEAR(inner(twice), 2.0 * inner(once), 0.002 * inner(twice));
}

// From far away rays are parallel: the sum of all pixels is the sum of all voxels, however the bone lies.
TEST(Radiograph, HoldsTheWholeBone) {
  const Case ball = solid_bone({Vec3(-6, -6, -6), Vec3(6, 6, 6)}, 0.5, [](const Vec3& p) { return p.norm() - 6.0; });
  const BoneHu bone = hu_of(ball);
  double voxels = 0.0;
  const CoordBox& box = bone.box();
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) voxels += bone.attenuation_per_mm({x, y, z}) * 0.125;
  CArm arm;
  arm.orbit_rad = 0.4;
  arm.tilt_rad = -0.3;
  arm.source_isocentre_mm = 1e5;
  arm.source_detector_mm = 1e5 + 100.0;
  arm.detector_mm = 16.0;
  arm.columns = arm.rows = 64;
  const Radiograph image = image_of(bone, good_beam(arm));
  double pixels = 0.0;
  for (const float a : image.attenuation()) pixels += static_cast<double>(a) * 0.25 * 0.25;
  EXPECT_NEAR(pixels, voxels, 0.003 * voxels);
}

// A beam in which the rays have different dominant axes.
ConeBeam wide_beam() {
  CArm arm;
  arm.orbit_rad = 0.8;  // not 45°, where two axes would be equally long
  arm.tilt_rad = 0.6;
  arm.source_isocentre_mm = 60.0;
  arm.source_detector_mm = 100.0;
  arm.detector_mm = 60.0;
  arm.columns = 101;
  arm.rows = 77;
  return good_beam(arm);
}

// One of each dominant axis, and all together.
std::vector<ConeBeam> beams_of_all_axes() {
  return {small_beam(1.4, 0.1), small_beam(0.2, -0.3), small_beam(0.3, 1.3), wide_beam()};
}

// The values of a ray, 1/mm, on every plane that it meets, in 64 bits: Joseph's interpolation as it is written, without
// bricks or packets.
std::vector<double> plain_planes(const BoneHu& bone, const Vec3& source_mm, const Vec3& pixel_mm) {
  const double h = bone.pitch_mm();
  const Vec3 from = source_mm / h, d = (pixel_mm - source_mm) / h;
  int axis = 0;
  d.cwiseAbs().maxCoeff(&axis);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto sample = [&](int k, int i, int j) {
    std::array<std::int32_t, 3> at{};
    at[static_cast<std::size_t>(axis)] = k;
    at[static_cast<std::size_t>(u)] = i;
    at[static_cast<std::size_t>(v)] = j;
    return bone.attenuation_per_mm({at[0], at[1], at[2]});
  };
  const std::array<std::int32_t, 3> low{bone.box().min.x, bone.box().min.y, bone.box().min.z},
      high{bone.box().max.x, bone.box().max.y, bone.box().max.z};
  std::vector<double> values;
  for (int k = low[static_cast<std::size_t>(axis)]; k <= high[static_cast<std::size_t>(axis)]; ++k) {
    const double at = (k - from[axis]) / d[axis];
    if (at < 0.0 || at > 1.0) continue;
    const double x = from[u] + at * d[u], y = from[v] + at * d[v];
    const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
    const double a = x - i, b = y - j;
    values.push_back((1.0 - a) * ((1.0 - b) * sample(k, i, j) + b * sample(k, i, j + 1)) +
                     a * ((1.0 - b) * sample(k, i + 1, j) + b * sample(k, i + 1, j + 1)));
  }
  return values;
}

// ∫ μ dl of a ray, plane by plane: Joseph's sum.
double plain_sum(const BoneHu& bone, const Vec3& source_mm, const Vec3& pixel_mm) {
  double sum = 0.0;
  for (const double value : plain_planes(bone, source_mm, pixel_mm)) sum += value;
  const Vec3 d = pixel_mm - source_mm;
  return sum * bone.pitch_mm() * d.norm() / d.cwiseAbs().maxCoeff();
}

// A hollow ball with a hole in it, so that bricks within it are empty too. 32 bits place a ray to some 1e-5 of a
// sample.
TEST(Radiograph, IsTheSumOverAllPlanesWhateverBricksAreEmpty) {
  const Case ball = solid_bone({Vec3(-14, -14, -14), Vec3(14, 14, 14)}, 0.5,
                               [](const Vec3& p) { return std::abs(p.norm() - 12.0) - 2.0; });
  CutField field(ball, {});
  field.apply(test::straight_cut(*find_tool("burr-round-5"), {3, 0, 12}, {3, 0, 2}, {0, 0, -1}));
  BoneHu bone = hu_of(ball);
  EXPECT_TRUE(bone.renew(std::vector<const CutField*>{&field}).has_value());
  for (const ConeBeam& beam : beams_of_all_axes()) {
    const Radiograph image = image_of(bone, beam);
    const PixelGrid& grid = beam.detector;
    for (int row = 0; row < grid.rows; row += 3)
      for (int column = row / 3 % 2; column < grid.columns; column += 2)
        ASSERT_NEAR(static_cast<double>(image.attenuation()[grid.index(column, row)]),
                    plain_sum(bone, beam.source_mm, grid.at(column, row)), 5e-4);
    EXPECT_GT(*std::ranges::max_element(image.attenuation()), 0.2f);
  }
}

// A shell whose density rises towards the head, with a hole. The search by hand looks at every plane.
TEST(Radiograph, TheMaximumIsThatOfAllPlanes) {
  const Case shell = test::make_bone(
      {Vec3(-14, -14, -14), Vec3(14, 14, 14)}, 0.5, [](const Vec3& p) { return std::abs(p.norm() - 12.0) - 2.0; },
      [](const Vec3& p) { return 1.2 + 0.05 * p.z(); });
  CutField field(shell, {});
  field.apply(test::straight_cut(*find_tool("burr-round-5"), {3, 0, 12}, {3, 0, 2}, {0, 0, -1}));
  BoneHu bone = hu_of(shell);
  EXPECT_TRUE(bone.renew(std::vector<const CutField*>{&field}).has_value());
  for (const ConeBeam& beam : beams_of_all_axes()) {
    const Radiograph image = image_of(bone, beam, Projection::most);
    const PixelGrid& grid = beam.detector;
    float brightest = kAir_hu, darkest = 3000.0f;
    for (int row = 0; row < grid.rows; row += 3)
      for (int column = row / 3 % 2; column < grid.columns; column += 2) {
        double most = 0.0;
        for (const double value : plain_planes(bone, beam.source_mm, grid.at(column, row)))
          most = std::max(most, value);
        const float found = image.values()[grid.index(column, row)];
        // A step is 1.05 HU. Rounding of the ray's place in 32 bits moves a value by less.
        ASSERT_NEAR(found, hu_of_steps(static_cast<float>(most / kStep_per_mm)), 0.5f);
        brightest = std::max(brightest, found);
        darkest = std::min(darkest, found);
      }
    EXPECT_EQ(darkest, kAir_hu) << "beside the bone";
    EXPECT_GT(brightest, 900.0f) << "above 1.1 g/cm3";
  }
}

void expect_recast_equals_cast(const ConeBeam& beam, std::size_t cuts,
                               Projection projection = Projection::attenuation) {
  CutField field(test::ball_of_bone(), {});
  BoneHu bone = hu_of(field.bone());
  Radiograph again = image_of(bone, beam, projection);
  test::Random random(5);
  std::size_t cast = 0, images = 0;
  for (const Cut& cut : test::grazing_cuts(cuts, random)) {
    const CutReport report = field.apply(cut);
    const std::vector<CoordBox> changed = bone.update(std::vector<const CutField*>{&field},
                                                      std::vector{ChangedLeaves{report.level, report.changed_leaves}});
    for (const PixelBox& box : again.recast(bone, changed))
      cast += to_index((box.last_column - box.first_column + 1) * (box.last_row - box.first_row + 1));
    images += changed.empty() ? 0 : 1;
  }
  EXPECT_GT(images, cuts / 4);
  EXPECT_LT(cast, images * beam.detector.count() / 2);  // far from all pixels
  BoneHu fresh = hu_of(field.bone());
  EXPECT_TRUE(fresh.renew(std::vector<const CutField*>{&field}).has_value());
  EXPECT_TRUE(std::ranges::equal(again.values(), image_of(fresh, beam, projection).values()));
  EXPECT_FALSE(std::ranges::equal(again.values(), image_of(hu_of(field.bone()), beam, projection).values()));
}

TEST(Radiograph, RaysCastAgainEqualAllRays) {
  expect_recast_equals_cast(small_beam(0.5, -0.4), 200);
  for (const ConeBeam& beam : beams_of_all_axes()) {
    expect_recast_equals_cast(beam, 60);
    expect_recast_equals_cast(beam, 60, Projection::most);
  }
}

// A changed sample reaches several pixels of an eighth of a millimetre.
TEST(Radiograph, FineRaysCastAgainEqualAllRays) {
  CArm arm;
  arm.orbit_rad = 0.5;
  arm.detector_mm = 30.0;
  arm.columns = 240;
  arm.rows = 240;
  expect_recast_equals_cast(good_beam(arm), 60);
}

// Of the whole bone, 1/mm · mm³.
double mass_of(const BoneHu& bone) {
  const CoordBox& box = bone.box();
  const double h = bone.pitch_mm();
  double sum = 0.0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) sum += bone.attenuation_per_mm({x, y, z}) * h * h * h;
  return sum;
}

std::span<const std::uint16_t> steps_of(const BoneHu& bone) {
  const HuLattice lattice = bone.lattice();
  return {lattice.steps, to_index(lattice.dims.x) * to_index(lattice.dims.y) * to_index(lattice.dims.z)};
}

// A block, and the replica of a client that the room tells of a slot through it, of two bodies, and of one again.
struct SawnBlock {
  Case bone = test::plain_block(16.0, 8.0, 0.5);
  Replica replica{bone, BodyId{}};
  CutField field{bone, BodyId{}};  // the room's
  FragmentFinder finder{field};
  std::uint64_t seq = 0;
  double piece_mm3 = 0.0;

  // Five millimetres wide, right of the middle.
  void saw() {
    for (double z = -1.0; z >= -10.0; z -= 1.5)
      for (double y = -10.0; y < 10.0; y += 4.0) {
        ++seq;
        const Cut cut = test::straight_cut(*find_tool("burr-round-5"), {3, y, z}, {3, y + 4.0, z}, {0, 0, -1}, seq);
        finder.touch(field, cut.level, field.apply(cut).changed_leaves);
        replica.commit(RoomSeq{seq}, cut, false);
      }
  }
  void split() {
    const std::vector<Fragment> pieces = finder.take_fragments(field);
    ASSERT_EQ(pieces.size(), 1U);
    piece_mm3 = pieces.front().volume_mm3;
    CutField piece(bone, BodyId{1});
    const auto of_piece = [](FieldLeaf leaf) {
      leaf.body = BodyId{1};
      return leaf;
    };
    for (const FieldLeaf& leaf : field.leaves()) piece.restore(of_piece(leaf));
    for (const FieldLeaf& leaf : pieces.front().left) piece.merge(of_piece(leaf));
    for (const FieldLeaf& leaf : pieces.front().taken) field.merge(leaf);
    std::vector<FieldLeaf> sent = field.leaves();
    std::ranges::copy(piece.leaves(), std::back_inserter(sent));
    tell({BodyId{}, BodyId{1}}, sent);
  }
  void take_piece_away() { tell({BodyId{}}, {}); }

 private:
  void tell(const std::vector<BodyId>& bodies, const std::vector<FieldLeaf>& leaves) {
    replica.change(RoomSeq{++seq}, bodies, leaves);
    replica.settle();
  }
};

TEST(Radiograph, ASawnPieceStaysUntilItIsTakenAway) {
  SawnBlock block;
  BoneHu bone = hu_of(block.bone);
  const ConeBeam beam = small_beam(0.4, 0.3);
  Radiograph again = image_of(bone, beam);
  const auto follow = [&] {
    again.recast(bone, bone.update(block.replica.bodies(), block.replica.take_changes()));
    BoneHu fresh = hu_of(block.bone);
    EXPECT_TRUE(fresh.renew(block.replica.bodies()).has_value());
    EXPECT_TRUE(std::ranges::equal(steps_of(bone), steps_of(fresh)));
    EXPECT_TRUE(std::ranges::equal(again.attenuation(), image_of(fresh, beam).attenuation()));
    return mass_of(bone);
  };
  const double per_mm = mass_of(bone) / (16.0 * 16.0 * 8.0);
  block.saw();
  const double sawn = follow();
  block.split();
  ASSERT_EQ(block.replica.bodies().size(), 2U);
  EXPECT_NEAR(follow(), sawn, 0.005 * sawn);  // a split takes nothing away
  block.take_piece_away();
  ASSERT_EQ(block.replica.bodies().size(), 1U);
  // The piece is all right of the slot: some 2.5 x 16 x 8 mm.
  EXPECT_NEAR(block.piece_mm3, 320.0, 40.0);
  EXPECT_NEAR(sawn - follow(), per_mm * block.piece_mm3, 0.03 * per_mm * block.piece_mm3);
}

// All that a viewer keeps from one change to the next, and what it shows.
struct Picture {
  Radiograph bone;
  std::vector<float> metal, photons;  // photons with their noise
  explicit Picture(const ConeBeam& beam) : bone(beam), metal(beam.detector.count()), photons(beam.detector.count()) {}

  void renew(std::span<const MetalSolid> solids, const PixelBox& box) {
    cast_metal(bone.beam(), solids, box, metal);
    count_photons(bone.beam(), {bone.attenuation(), metal}, {}, {}, box, photons);
    add_quantum_noise(bone.beam().detector, box, 99, photons);
  }
  [[nodiscard]] std::vector<std::uint8_t> shown() const {
    std::vector<float> light = photons;
    add_glare(bone.beam().detector, {}, light);
    return grey_of(light, automatic_window(light));
  }
};

// A drill that goes on cutting: only its shadows, before and after, and the rays through what it cut are new.
TEST(Radiograph, APictureOfWhatChangedIsTheWholePicture) {
  CutField field(test::ball_of_bone(), {});
  BoneHu bone = hu_of(field.bone());
  const ConeBeam beam = small_beam(0.5, -0.4);
  const Tool tool = *find_tool("drill-3.2");
  const auto solids_at = [](double z) {
    return std::vector<MetalSolid>{
        {placed(cylinder(1.6, 0.0, 15.0), pose_along(Vec3(1, 0, z), Vec3(0, 0, 1))), kSteel_per_mm},
        {ball(Vec3(-9, 3, 0), 1.5), kTitanium_per_mm}};
  };
  Picture again(beam);
  again.bone.cast(bone);
  again.renew(solids_at(12.0), beam.detector.whole());
  const std::vector<float> first = again.photons;
  std::size_t renewed = 0;
  for (int step = 0; step < 12; ++step) {
    const double from = 12.0 - step, to = from - 1.0;
    const CutReport report = field.apply(test::straight_cut(tool, {1, 0, from}, {1, 0, to}, {0, 0, -1}));
    std::vector<PixelBox> boxes =
        again.bone.recast(bone, bone.update(std::vector<const CutField*>{&field},
                                            std::vector{ChangedLeaves{report.level, report.changed_leaves}}));
    for (const double z : {from, to}) boxes.push_back(shadow_of(solids_at(z).front().solid.bounds, beam));
    const std::vector<MetalSolid> solids = solids_at(to);
    for (const PixelBox& box : boxes) {
      again.renew(solids, box);
      renewed += to_index((box.last_column - box.first_column + 1) * (box.last_row - box.first_row + 1));
    }
    Picture whole(beam);
    whole.bone.cast(bone);
    whole.renew(solids, beam.detector.whole());
    ASSERT_TRUE(std::ranges::equal(again.bone.attenuation(), whole.bone.attenuation()));
    ASSERT_EQ(again.metal, whole.metal);
    ASSERT_EQ(again.photons, whole.photons);
    ASSERT_EQ(again.shown(), whole.shown());
  }
  EXPECT_NE(again.photons, first);
  EXPECT_LT(renewed, 12 * beam.detector.count());  // less than all pixels each time
}

// The same with a beam in which the rays have different dominant axes.
TEST(Radiograph, DoesNotDependOnThreadsNorWidths) {
  const BoneHu bone = hu_of(solid_bone({Vec3(-12, -12, -12), Vec3(12, 12, 12)}, 0.5,
                                       [](const Vec3& p) { return std::abs(p.norm() - 10.0) - 2.0; }));
  const ConeBeam beam = wide_beam();
  const Radiograph all = image_of(bone, beam), most = image_of(bone, beam, Projection::most);
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_TRUE(std::ranges::equal(all.attenuation(), image_of(bone, beam).attenuation()));
  }
  const int widest = limit_sampling_lanes(8);
  limit_sampling_lanes(4);
  EXPECT_TRUE(std::ranges::equal(all.attenuation(), image_of(bone, beam).attenuation()));
  EXPECT_TRUE(std::ranges::equal(most.values(), image_of(bone, beam, Projection::most).values()));
  EXPECT_EQ(limit_sampling_lanes(8), widest);
  EXPECT_GT(*std::ranges::max_element(all.attenuation()), 0.1f);
}

// Bone behind the source or behind the detector weakens nothing.
TEST(Radiograph, CountsOnlyWhatIsBetweenSourceAndDetector) {
  const BoneHu bone =
      hu_of(solid_bone({Vec3(-8, -8, -8), Vec3(8, 8, 8)}, 0.5, [](const Vec3& p) { return p.norm() - 8.0; }));
  ConeBeam beam;
  beam.detector = {Vec3(0, -100, 0), Vec3::UnitX(), -Vec3::UnitZ(), 1, 1};
  beam.source_mm = Vec3(0, 0, 0);  // in the middle of the ball
  EXPECT_NEAR(static_cast<double>(image_of(bone, beam).attenuation()[0]), 8.0 * bone_per_mm(),
              0.03 * 16.0 * bone_per_mm());
  beam.source_mm = Vec3(0, -20, 0);
  EXPECT_EQ(image_of(bone, beam).attenuation()[0], 0.0f);
}

}  // namespace
}  // namespace osteon::radiology
