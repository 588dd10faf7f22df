// Cartilage, vessels, nerves and footprints: beside bone, where anatomy says, and as labels of a finished case.
#include "common/phantoms/structures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "common/phantoms/femur.hpp"
#include "common/phantoms/patella.hpp"
#include "common/phantoms/phantom_case.hpp"
#include "common/phantoms/tibia.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

Structure structure(const PhantomBone& bone, const std::string& name) {
  for (Structure& found : bone.structures())
    if (found.name == name) return std::move(found);
  ADD_FAILURE() << "no structure " << name;
  return {};
}

Vec3 random_in(const Box& box, test::Random& random) {
  return {random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
          random.between(box.min_mm.z(), box.max_mm.z())};
}

double length_of(const std::vector<Vec3>& line) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) sum += (line[i + 1] - line[i]).norm();
  return sum;
}

TEST(Structures, ATubeIsTheDistanceToItsLine) {
  const auto nowhere = [](const Vec3&) { return 100.0; };
  const Structure made = tube("a", LabelKind::nerve, {Vec3::Zero(), {0.0, 0.0, 30.0}, {0.0, 40.0, 30.0}}, 3.0, nowhere);
  EXPECT_EQ(made.kind, LabelKind::nerve);
  EXPECT_NEAR(made.distance_mm({5.0, 0.0, 12.0}), 2.0, 1e-12);
  EXPECT_NEAR(made.distance_mm({0.0, 0.0, -4.0}), 1.0, 1e-12);
  EXPECT_NEAR(made.distance_mm({0.0, 20.0, 30.0}), -3.0, 1e-12);
  EXPECT_NEAR(made.bounds.max_mm.y(), 43.0, 1e-12);
}

// A ball of bone, of which everything is known.
double ball(const Vec3& at) { return at.norm() - 20.0; }

// The line goes through the ball.
TEST(Structures, ATubeEndsWhereItWouldMeetBone) {
  const Structure made = tube("a", LabelKind::vessel, {{-40.0, 0.0, 0.0}, {40.0, 0.0, 0.0}}, 3.0, ball);
  for (const double x : {0.0, 10.0, 19.9}) EXPECT_GT(made.distance_mm({x, 0.0, 0.0}), 0.0) << x;
  EXPECT_LT(made.distance_mm({20.2, 0.0, 0.0}), 0.0);
  EXPECT_NEAR(made.distance_mm({30.0, 0.0, 0.0}), -3.0, 1e-12);
}

TEST(Structures, CartilageOnABallIsAShell) {
  const Structure made = cartilage("a", 2.0, Box{Vec3::Constant(-22.0), Vec3::Constant(22.0)}, ball,
                                   [](const Vec3& at) { return -at.z(); });
  EXPECT_LT(made.distance_mm({0.0, 0.0, 21.9}), 0.0);
  EXPECT_GT(made.distance_mm({0.0, 0.0, 22.1}), 0.0);
  EXPECT_GT(made.distance_mm({0.0, 0.0, 19.9}), 0.0);   // bone
  EXPECT_GT(made.distance_mm({0.0, 0.0, -21.0}), 0.0);  // not in the region
  EXPECT_GT(made.distance_mm({21.9, 0.0, 0.1}), 0.0);   // thin at the edge
}

TEST(Structures, AFootprintIsNearItsPointAndNearBone) {
  const Structure made = footprint("a", {20.0, 0.0, 0.0}, 5.0, ball);
  EXPECT_LT(made.distance_mm({20.5, 0.0, 3.0}), 0.0);
  EXPECT_GT(made.distance_mm({20.0 + kFootprint_mm + 0.1, 0.0, 0.0}), 0.0);
  EXPECT_GT(made.distance_mm({19.9, 0.0, 0.0}), 0.0);
  EXPECT_GT(made.distance_mm({18.0, 9.0, 0.0}), 0.0);
}

// Past a ball, a line keeps its distance, and does not follow the hollows before and behind it.
TEST(Structures, ALineBesideBoneKeepsClearOfIt) {
  const std::vector<Vec3> line =
      line_beside({{{0.0, 0.0, -40.0}, Vec3::UnitX(), 6.0}, {{0.0, 0.0, 40.0}, Vec3::UnitX(), 6.0}}, 40.0, ball);
  for (const Vec3& at : line) {
    EXPECT_GE(ball(at), 5.9) << at.transpose();
    EXPECT_NEAR(at.y(), 0.0, 1e-12);
    if (std::abs(at.z()) < 12.0) {
      EXPECT_GT(at.x(), 20.0);
    }
  }
  EXPECT_NEAR((surface_from({1.0, 0.0, 0.0}, Vec3::UnitX(), ball) - Vec3(20.0, 0.0, 0.0)).norm(), 0.0, 0.02);
}

TEST(Structures, ARoundedLineHasItsEndsAndNoCorner) {
  const Vec3 end(40.0, 40.0, 0.0);
  const std::vector<Vec3> line = rounded({Vec3::Zero(), {40.0, 0.0, 0.0}, end});
  EXPECT_EQ(line.front(), Vec3::Zero());
  EXPECT_EQ(line.back(), end);
  for (const Vec3& at : line) EXPECT_GT(at.x() - at.y(), -1e-9);  // on the inner side of the corner
  double largest = 0.0;
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    const Vec3 before = line[i] - line[i - 1], after = line[i + 1] - line[i];
    largest = std::max(largest, std::atan2(before.cross(after).norm(), before.dot(after)));
  }
  EXPECT_LT(largest * 180.0 / std::numbers::pi, 20.0);
}

// The whole of each structure, on a lattice in its box: it is there, and it is never in bone. Those of a joint may be
// cut short.
void expect_beside_bone(const PhantomBone& bone, double coarsest_mm, double least_part, const std::string& what) {
  for (const Structure& found : bone.structures()) {
    const Box& box = found.bounds;
    const double step_mm = std::min(coarsest_mm, box.size_mm().minCoeff() / 12.0);
    double volume = 0.0;
    for (double x = box.min_mm.x(); x < box.max_mm.x(); x += step_mm)
      for (double y = box.min_mm.y(); y < box.max_mm.y(); y += step_mm)
        for (double z = box.min_mm.z(); z < box.max_mm.z(); z += step_mm) {
          if (found.distance_mm({x, y, z}) >= 0.0) continue;
          volume += step_mm * step_mm * step_mm;
          ASSERT_GE(bone.depths({x, y, z}).surface_mm, -1e-9) << found.name << ", " << what;
        }
    EXPECT_GT(volume, 0.0) << found.name << ", " << what;
    if (found.line_mm.empty()) continue;
    // A tube does not come apart.
    int broken = 0, points = 0;
    for (const Vec3& at : found.line_mm) {
      if (least_part < 1.0 && ((at.array() < box.min_mm.array()).any() || (at.array() > box.max_mm.array()).any()))
        continue;
      ++points;
      broken += found.distance_mm(at) >= 0.0 ? 1 : 0;
    }
    EXPECT_LE(broken, (1.0 - least_part) * points) << found.name << ", " << what;
  }
}

TEST(Structures, NeverReachIntoBone) {
  test::Random random(91);
  for (const char* kind : {"femur", "tibia", "patella", "pelvis", "hip"})
    for (const std::string_view preset : kPresets)
      expect_beside_bone(*bone_of({.kind = kind, .preset = std::string(preset)}), 2.3,
                         kind == std::string("hip") ? 0.9 : 1.0, std::string(kind) + " " + std::string(preset));
  for (const char* kind : {"femur", "tibia", "patella", "knee"})
    for (int set = 0; set < 6; ++set) {
      const auto bone = random_bone(kind, kind == std::string("knee") ? 0.05 : 0.08, random);
      ASSERT_TRUE(bone);
      expect_beside_bone(*bone, 2.9, kind == std::string("knee") ? 0.9 : 1.0, kind + (" set " + std::to_string(set)));
    }
}

TEST(Structures, LieWhereAnatomySays) {
  const auto femur = bone_of({}), tibia = bone_of({.kind = "tibia"}), knee = bone_of({.kind = "knee"});
  // +x is lateral and +y behind. The femoral artery begins before the head, and ends medially behind the shaft.
  const std::vector<Vec3> artery = structure(*femur, "femoral artery").line_mm;
  EXPECT_LT(artery.front().y(), landmark(*femur, "head centre").y() - 30.0);
  EXPECT_LT(artery[artery.size() / 2].x(), landmark(*femur, "medial epicondyle").x() + 45.0);
  for (const Vec3& at : artery) EXPECT_GT(femur->depths(at).surface_mm, 4.5);
  // The sciatic nerve passes between the trochanter and the head, behind both.
  const Vec3 nerve = structure(*femur, "sciatic nerve").line_mm.front();
  EXPECT_GT(nerve.x(), landmark(*femur, "head centre").x());
  EXPECT_LT(nerve.x(), landmark(*femur, "greater trochanter").x());
  EXPECT_GT(nerve.y(), landmark(*femur, "head centre").y() + 20.0);
  // Origins of ligaments, in the notch and at the epicondyles: the anterior one at the lateral condyle.
  const auto middle = [](const Structure& found) { return found.bounds.centre_mm(); };
  const Vec3 anterior = middle(structure(*femur, "anterior cruciate ligament, femur"));
  const Vec3 posterior = middle(structure(*femur, "posterior cruciate ligament, femur"));
  EXPECT_GT(anterior.x(), 3.0);
  EXPECT_LT(posterior.x(), -3.0);
  EXPECT_GT(anterior.y(), posterior.y());
  EXPECT_LT(std::max(anterior.x(), -posterior.x()), 0.5 * FemurParameters{}.notch_width_mm + 3.0);
  EXPECT_LT(
      (middle(structure(*femur, "medial collateral ligament, femur")) - landmark(*femur, "medial epicondyle")).norm(),
      1e-6);
  // On the tibia the anterior one is in front.
  EXPECT_LT(middle(structure(*tibia, "anterior cruciate ligament, tibia")).y() + 15.0,
            middle(structure(*tibia, "posterior cruciate ligament, tibia")).y());
  // The peroneal nerve goes from behind the fibula's head around its lateral side to the front, below the head.
  const std::vector<Vec3> peroneal = structure(*tibia, "common peroneal nerve").line_mm;
  const Vec3 head = landmark(*tibia, "fibular head");
  EXPECT_GT(peroneal.front().y(), head.y() + 10.0);
  EXPECT_LT(peroneal.back().y(), peroneal.front().y() - 20.0);
  EXPECT_GT(peroneal[peroneal.size() / 2].x(), head.x());
  EXPECT_LT(peroneal.back().z(), head.z() - 25.0);
  // Behind the knee, the artery is nearer to bone than the nerve, and both are behind the plateau.
  const double level = landmark(*knee, "tibia, knee centre").z();
  const auto y_at = [&](const char* name) {
    double y = 0.0, nearest = 1e9;
    for (const Vec3& at : structure(*knee, name).line_mm)
      if (std::abs(at.z() - level) < nearest) {
        nearest = std::abs(at.z() - level);
        y = at.y();
      }
    return y;
  };
  EXPECT_GT(y_at("popliteal artery"), landmark(*knee, "tibia, knee centre").y() + 24.0);
  EXPECT_GT(y_at("tibial nerve"), y_at("popliteal artery") + 5.0);
  EXPECT_GT(length_of(structure(*knee, "popliteal artery").line_mm), 120.0);
}

TEST(Structures, OfARightKneeAreTheMirrorImage) {
  const auto left = bone_of({.kind = "knee"}), right = bone_of({.kind = "knee", .side = Side::right});
  const auto of_left = left->structures(), of_right = right->structures();
  ASSERT_EQ(of_left.size(), of_right.size());
  test::Random random(92);
  for (std::size_t i = 0; i < of_left.size(); ++i) {
    EXPECT_EQ(of_left[i].name, of_right[i].name);
    for (int k = 0; k < 300; ++k) {
      const Vec3 at = random_in(of_left[i].bounds, random);
      EXPECT_NEAR(of_left[i].distance_mm(at), of_right[i].distance_mm({-at.x(), at.y(), at.z()}), 1e-6)
          << of_left[i].name;
    }
  }
}

// What a finished case says of its labels.
struct Labelled {
  PhantomCase made;
  std::map<std::string, int> values;

  [[nodiscard]] int at(const Vec3& p) const {
    const ScanGeometry& geometry = made.scan.geometry;
    const Vec3 voxel = (p - geometry.origin_mm) / made.bone.pitch_mm();
    std::size_t index = 0;
    for (int axis = 2; axis >= 0; --axis) {
      const auto size = static_cast<std::size_t>(geometry.dims[static_cast<std::size_t>(axis)]);
      index = index * size + static_cast<std::size_t>(std::lround(voxel[axis]));
    }
    return made.scan.labels[index];
  }
};

Labelled labelled(const PhantomBone& bone, double pitch_mm) {
  auto made = build_phantom_case(bone, {.pitch_mm = pitch_mm, .title = "A bone", .calibration = {0.001067, 0.131}},
                                 [](double) { return true; });
  if (!made) throw std::runtime_error(made.error().message);
  Labelled found{std::move(*made), {}};
  for (const CaseLabel& label : found.made.bone.info().labels) found.values[label.name] = label.value;
  return found;
}

TEST(Structures, AreLabelsOfTheScanWithTheirKindAndHu) {
  const auto tibia = bone_of({.kind = "tibia"});
  const Labelled found = labelled(*tibia, 1.25);
  std::map<int, double> hu;
  std::map<int, LabelKind> kinds;
  for (const Structure& one : tibia->structures()) {
    ASSERT_TRUE(found.values.contains(one.name)) << one.name;
    EXPECT_GT(found.values.at(one.name), 6);  // after the tissues of two bones
    hu[found.values.at(one.name)] = one.hu;
    kinds[found.values.at(one.name)] = one.kind;
  }
  for (const CaseLabel& label : found.made.bone.info().labels)
    if (kinds.contains(label.value)) {
      EXPECT_EQ(label.kind, kinds[label.value]) << label.name;
    }
  std::map<int, double> volume;
  for (std::size_t n = 0; n < found.made.scan.hu.size(); ++n)
    if (const int label = found.made.scan.labels[n]; hu.contains(label)) {
      ASSERT_EQ(found.made.scan.hu[n], hu[label]);
      ASSERT_EQ(found.made.scan.tissue[n], 0);
      volume[label] += std::pow(found.made.bone.pitch_mm(), 3);
    }
  // A tube: its line's length times its section, and two half balls.
  for (const auto& [name, radius] : {std::pair{"common peroneal nerve", 2.5}, {"anterior tibial artery", 2.0}}) {
    const double expected =
        std::numbers::pi * radius * radius * (length_of(structure(*tibia, name).line_mm) + 4.0 / 3.0 * radius);
    EXPECT_NEAR(volume[found.values.at(name)], expected, 0.06 * expected) << name;
  }
}

// Thickness of a label along rays from points in bone, mean of many rays across the voxels.
double thickness_mm(const Labelled& found, const std::string& name, const std::vector<std::pair<Vec3, Vec3>>& rays,
                    double from_mm = 0.0, double to_mm = 20.0) {
  constexpr double kStep_mm = 0.05;
  const int label = found.values.at(name);
  double sum = 0.0;
  for (const auto& [from, way] : rays)
    for (double t = from_mm; t < to_mm; t += kStep_mm)
      sum += found.at(from + t * way) == label ? kStep_mm / static_cast<double>(rays.size()) : 0.0;
  return sum;
}

TEST(Structures, CartilageOfAPatellaIsAsThickAsAsked) {
  const PatellaParameters p;
  const auto bone = bone_of({.kind = "patella", .changes = {{"cartilage_mm", 3.4}}});
  const Labelled found = labelled(*bone, 0.5);
  // Along the normal of the lateral facet.
  const double half = 0.5 * p.facets_degrees * std::numbers::pi / 180.0;
  const Vec3 normal(std::cos(half), std::sin(half), 0.0);
  std::vector<std::pair<Vec3, Vec3>> rays;
  for (double x = 2.0; x < 8.0; x += 0.27)
    for (double z = -2.0; z < 6.0; z += 0.31) rays.emplace_back(Vec3(x, 0.0, z), normal);
  const double measured = thickness_mm(found, "patellar cartilage", rays);
  std::printf("[          ] cartilage of 3.4 mm, measured %.3f mm\n", measured);
  EXPECT_NEAR(measured, 3.4, 0.02 * 3.4);
}

TEST(Structures, CartilageOfAKneeIsAsThickAsAskedAndFillsTheGap) {
  const auto knee = bone_of({.kind = "knee",
                             .side = Side::right,
                             .changes = {{"joint_gap_mm", 6.0}, {"femur_cut_mm", 60.0}, {"tibia_cut_mm", 60.0}}});
  const Labelled found = labelled(*knee, 1.0);
  // Along the plateau's normal, and from the axis of the round condyles, down and backwards.
  const double slope = TibiaParameters{}.slope_degrees * std::numbers::pi / 180.0;
  const Vec3 normal(0.0, std::sin(slope), std::cos(slope)), plateau = landmark(*knee, "tibia, knee centre");
  double tibia = 0.0, femur = 0.0;
  for (const std::string side : {"medial", "lateral"}) {
    const Vec3 behind = landmark(*knee, side + " posterior condyle"),
               lowest = landmark(*knee, side + " distal condyle");
    std::vector<std::pair<Vec3, Vec3>> up, out;
    for (double x = -4.0; x <= 4.0; x += 0.37)
      for (double y = -8.0; y <= 8.0; y += 0.31)
        up.emplace_back(Vec3(lowest.x() + x, plateau.y() + y, plateau.z()) - 10.0 * normal, normal);
    for (double x = -0.5; x <= 0.5; x += 0.17)
      for (double turn = 0.0; turn < 1.4; turn += 0.01)
        out.emplace_back(Vec3(lowest.x() + x, lowest.y(), behind.z()), Vec3(0.0, std::sin(turn), -std::cos(turn)));
    tibia += 0.5 * thickness_mm(found, "tibial cartilage", up);
    femur += 0.5 * thickness_mm(found, "femoral condyle cartilage", out, 15.0, 28.0);
  }
  std::printf("[          ] cartilage of 3 mm: tibia %.3f mm, femur %.3f mm\n", tibia, femur);
  // A tenth of a voxel.
  EXPECT_NEAR(tibia, 3.0, 0.1);
  EXPECT_NEAR(femur, 3.0, 0.1);
}

TEST(Structures, CartilageOfAHeadHasTheVolumeOfAShell) {
  const FemurParameters p;
  const auto bone = bone_of({.changes = {{"cartilage_mm", 3.0}}});
  const Structure found = structure(*bone, "femoral head cartilage");
  const double radius = 0.5 * p.head_diameter_mm, step = 0.6;
  double volume = 0.0;
  const Vec3 head = landmark(*bone, "head centre"), knee = landmark(*bone, "neck centre");
  const Vec3 neck = (head - knee).normalized();
  // The half that faces away from the neck, where it is a whole shell.
  for (double x = found.bounds.min_mm.x(); x < found.bounds.max_mm.x(); x += step)
    for (double y = found.bounds.min_mm.y(); y < found.bounds.max_mm.y(); y += step)
      for (double z = found.bounds.min_mm.z(); z < found.bounds.max_mm.z(); z += step)
        if (const Vec3 at(x, y, z); neck.dot(at - head) > 0.0 && found.distance_mm(at) < 0.0)
          volume += step * step * step;
  const double expected = 2.0 / 3.0 * std::numbers::pi * (std::pow(radius + 3.0, 3) - std::pow(radius, 3));
  EXPECT_NEAR(volume, expected, 0.02 * expected);
}

}  // namespace
}  // namespace osteon::phantoms
