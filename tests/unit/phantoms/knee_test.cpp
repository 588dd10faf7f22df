#include "common/phantoms/knee.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "common/phantoms/patella.hpp"
#include "common/phantoms/phantom_case.hpp"
#include "common/phantoms/tibia.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

std::unique_ptr<PhantomBone> knee_of(Side side, std::map<std::string, double> changes = {}) {
  return bone_of({.kind = "knee", .side = side, .changes = std::move(changes)});
}

const std::vector<int> kFourPieces(4, 1);

TEST(Knee, HasFourBonesInTheirPlaces) {
  const auto knee = knee_of(Side::left);
  EXPECT_EQ(knee->names(), (std::vector<std::string>{"femur", "tibia", "fibula", "patella"}));
  const auto bone_at = [&](const Vec3& at) { return knee->depths(at).surface_mm < 0.1 ? knee->depths(at).bone : 0; };
  EXPECT_EQ(bone_at(landmark(*knee, "medial epicondyle")), 1);
  EXPECT_EQ(bone_at(landmark(*knee, "tibial tuberosity")), 2);
  EXPECT_EQ(bone_at(landmark(*knee, "fibular head")), 3);
  EXPECT_EQ(bone_at(landmark(*knee, "patellar apex")), 4);
  EXPECT_GT(landmark(*knee, "fibular head").x(), 0.0);  // lateral is at +x of a left knee
  // The patella lies before the trochlea, its apex not far above the plateau, its ridge before the groove.
  EXPECT_LT(landmark(*knee, "patellar ridge").y(), landmark(*knee, "medial epicondyle").y() - 20.0);
  EXPECT_NEAR(landmark(*knee, "patellar ridge").x(), 0.0, 1e-9);
  const double above = landmark(*knee, "patellar apex").z() - landmark(*knee, "tibia, knee centre").z();
  EXPECT_GT(above, 0.0);
  EXPECT_LT(above, 20.0);
  EXPECT_LT(landmark(*knee, "tibia, knee centre").z(), landmark(*knee, "medial distal condyle").z());
}

// Insall 1971: from the patella's apex to where its ligament ends, as a part of the patella's height.
TEST(Knee, ThePatellaIsAsHighAsItsRatioSays) {
  const TibiaParameters tibia;
  for (const double ratio : {0.9, 1.2}) {
    const auto knee = knee_of(Side::left, {{"insall_salvati", ratio}});
    const Vec3 end = landmark(*knee, "tibial tuberosity") + 0.1 * tibia.plateau_width_mm * Vec3::UnitZ();
    const double ligament =
        std::hypot(landmark(*knee, "patellar apex").z() - end.z(), landmark(*knee, "patellar apex").y() - end.y());
    EXPECT_NEAR(ligament / PatellaParameters{}.height_mm, ratio, 0.01);
  }
}

// Where it is made, it is as high as asked, and otherwise the ratio is named.
TEST(Knee, APatellaThatItsLigamentDoesNotReachIsRefused) {
  const TibiaParameters tibia;
  const auto expect_reached = [&](std::map<std::string, double> changes) {
    const double ratio = changes.at("insall_salvati"), height = changes.at("patella.height_mm");
    const auto made = make_bone({.kind = "knee", .changes = std::move(changes)});
    if (!made) {
      EXPECT_TRUE(made.error().message.starts_with("insall_salvati is ")) << made.error().message;
      EXPECT_NE(made.error().message.find("does not reach a patella"), std::string::npos) << made.error().message;
      return false;
    }
    const Vec3 apex = landmark(**made, "patellar apex");
    const Vec3 end = landmark(**made, "tibial tuberosity") + 0.1 * tibia.plateau_width_mm * Vec3::UnitZ();
    EXPECT_NEAR(std::hypot(apex.z() - end.z(), apex.y() - end.y()) / height, ratio, 1e-6);
    return true;
  };
  for (const double height : {35.0, 45.0, 60.0})
    for (const double ratio : {0.7, 1.0, 1.6})
      for (const double gap : {5.5, 12.0})
        expect_reached({{"insall_salvati", ratio}, {"patella_gap_mm", gap}, {"patella.height_mm", height}});
  EXPECT_FALSE(expect_reached({{"insall_salvati", 0.7},
                               {"patella_gap_mm", 12.0},
                               {"patella.height_mm", 28.0},
                               {"patella.width_mm", 37.0},
                               {"patella.thickness_mm", 20.0},
                               {"femur.condyle_depth_mm", 78.0},
                               {"tibia.tuberosity_mm", 0.0},
                               {"tibia.plateau_depth_mm", 38.0},
                               {"tibia.depth_86_mm", 30.0}}));
}

TEST(Knee, NamesDoNotDependOnTheCuts) {
  const auto names_of_knee = [](const char* cut, double length_mm) {
    const BoneAnatomy anatomy = knee_of(Side::left, {{cut, length_mm}})->anatomy();
    std::pair<std::set<std::string>, std::set<std::string>> names;
    for (const Landmark& found : anatomy.landmarks) names.first.insert(found.name);
    for (const PlannedAxis& found : anatomy.axes) names.second.insert(found.name);
    return names;
  };
  const auto expected = names_of_knee("tibia_cut_mm", 110.0);
  EXPECT_TRUE(expected.second.contains("tibia, mechanical axis"));
  for (const char* cut : {"tibia_cut_mm", "femur_cut_mm"})
    for (double length_mm = 60.0; length_mm <= 160.0; length_mm += 1.0)
      EXPECT_EQ(names_of_knee(cut, length_mm), expected) << cut << " " << length_mm;
}

// Each parameter of the knee at the ends of its range: made, or refused by a sentence that names it.
TEST(Knee, EndsOfRangesAreMadeOrNamed) {
  for (const std::string_view preset : kPresets)
    for (const auto& field : knee_fields())
      for (const double value : {field.least, field.most}) {
        const std::string name(field.name);
        const auto made = make_bone({.kind = "knee", .preset = std::string(preset), .changes = {{name, value}}});
        if (made) continue;
        EXPECT_EQ(made.error().message.find(name + " is "), 0u)
            << preset << ", " << name << ": " << made.error().message;
      }
  // The widest gap before the femur is wider than cartilage of both bones.
  EXPECT_TRUE(make_bone({.kind = "knee", .changes = {{"patella_gap_mm", 12.0}}}));
}

TEST(Knee, RightIsTheMirrorImageOfLeft) {
  const auto left = knee_of(Side::left), right = knee_of(Side::right);
  test::Random random(71);
  const Box box = left->bounds();
  for (int i = 0; i < 3000; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const Vec3 mirrored(-at.x(), at.y(), at.z());
    EXPECT_NEAR(left->depths(at).surface_mm, right->depths(mirrored).surface_mm, 1e-9);
    if (left->depths(at).surface_mm < -1e-6) {
      EXPECT_EQ(left->depths(at).bone, right->depths(mirrored).bone);
    }
  }
}

TEST(Knee, IsSawnWhereItsParametersSay) {
  const auto knee = knee_of(Side::left, {{"femur_cut_mm", 90.0}, {"tibia_cut_mm", 70.0}});
  const double condyles = landmark(*knee, "medial distal condyle").z();
  const double plateau = landmark(*knee, "tibia, knee centre").z();
  double high = -1e9, low = 1e9;
  const Box box = knee->bounds();
  for (double x = box.min_mm.x(); x < box.max_mm.x(); x += 2.0)
    for (double y = box.min_mm.y(); y < box.max_mm.y(); y += 2.0)
      for (double z = box.min_mm.z(); z < box.max_mm.z(); z += 0.5)
        if (knee->depths({x, y, z}).surface_mm < 0.0) {
          high = std::max(high, z);
          low = std::min(low, z);
        }
  EXPECT_NEAR(high, condyles + 90.0, 0.5);
  EXPECT_NEAR(low, plateau - 70.0, 0.5);
}

TEST(Knee, EveryPresetAndRandomSetIsFourClosedPieces) {
  for (const std::string_view preset : kPresets)
    for (const std::string_view condition : kConditions) {
      const auto knee = bone_of({.kind = "knee", .preset = std::string(preset), .condition = std::string(condition)});
      ASSERT_TRUE(knee);
      if (condition == "adult") {
        EXPECT_EQ(islands_of(*knee, 2.5), kFourPieces) << preset;
      }
    }
  test::Random random(72);
  for (int set = 0; set < random_sets(); ++set) {
    const auto knee = random_bone("knee", 0.05, random);
    ASSERT_TRUE(knee);
    EXPECT_EQ(islands_of(*knee, 3.5), kFourPieces) << set;
  }
}

// Where lattice edges beside the joint leave each bone of a finished case.
std::map<int, std::vector<Vec3>> surface_points(const Case& knee) {
  constexpr double kBeside_mm = 45.0;
  const double pitch = knee.pitch_mm();
  CoordBox box = knee.bounds_samples();
  box.min.z = std::max(box.min.z, static_cast<int>(-kBeside_mm / pitch));
  box.max.z = std::min(box.max.z, static_cast<int>(kBeside_mm / pitch));
  const Coord dims = box.dims();
  std::vector<float> surface(to_index(dims.x) * to_index(dims.y) * to_index(dims.z));
  knee.gather_surface(box, surface);
  const auto at = [&](Coord c) {
    const Coord i = c - box.min;
    return static_cast<double>(
        surface[(to_index(i.x) * to_index(dims.y) + to_index(i.y)) * to_index(dims.z) + to_index(i.z)]);
  };
  std::map<int, std::vector<Vec3>> points;
  for (int x = box.min.x; x < box.max.x; ++x)
    for (int y = box.min.y; y < box.max.y; ++y)
      for (int z = box.min.z; z < box.max.z; ++z)
        for (const Coord step : {Coord{1, 0, 0}, Coord{0, 1, 0}, Coord{0, 0, 1}}) {
          const Coord c{x, y, z};
          const double s = at(c), t = at(c + step);
          if ((s < 0.0) == (t < 0.0)) continue;
          const Vec3 from = position_mm(c, pitch), to = position_mm(c + step, pitch);
          points[knee.bone_number(s < 0.0 ? c : c + step)].emplace_back(from + s / (s - t) * (to - from));
        }
  return points;
}

// The points that may lie within 8 mm of others.
std::vector<Vec3> points_near(const std::vector<Vec3>& points, const std::vector<Vec3>& others) {
  Box box;
  for (const Vec3& p : others) box.include(p);
  box = box.grown(8.0);
  std::vector<Vec3> found;
  for (const Vec3& p : points)
    if ((p.array() >= box.min_mm.array()).all() && (p.array() <= box.max_mm.array()).all()) found.push_back(p);
  return found;
}

double gap_mm(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double least = std::numeric_limits<double>::infinity();
  const std::vector<Vec3> near_b = points_near(a, b), near_a = points_near(b, near_b);
  for (const Vec3& p : near_b)
    for (const Vec3& q : near_a) least = std::min(least, (p - q).squaredNorm());
  return std::sqrt(least);
}

TEST(Knee, GapsOfTheFinishedCaseAreThoseAskedFor) {
  const auto knee = knee_of(
      Side::right, {{"joint_gap_mm", 6.0}, {"patella_gap_mm", 4.5}, {"femur_cut_mm", 70.0}, {"tibia_cut_mm", 60.0}});
  const auto made = build_phantom_case(*knee, {.pitch_mm = 1.0, .title = "Knee", .calibration = {0.001067, 0.131}},
                                       [](double) { return true; });
  ASSERT_TRUE(made) << made.error().message;
  const std::map<int, std::vector<Vec3>> points = surface_points(made->bone);
  const double joint = gap_mm(points.at(1), points.at(2)), patella = gap_mm(points.at(1), points.at(4));
  std::printf("[          ] joint %.2f mm, patella %.2f mm\n", joint, patella);
  EXPECT_NEAR(joint, 6.0, 0.25);
  EXPECT_NEAR(patella, 4.5, 0.25);
}

TEST(Knee, WhatDoesNotFitIsOneSentenceThatNamesTheParameter) {
  const auto refused = [](std::map<std::string, double> changes, const std::string& named, const std::string& also) {
    const auto made = make_bone({.kind = "knee", .changes = std::move(changes)});
    ASSERT_FALSE(made) << named;
    EXPECT_EQ(made.error().code, ErrorCode::invalid_input);
    EXPECT_NE(made.error().message.find(named), std::string::npos) << made.error().message;
    EXPECT_NE(made.error().message.find(also), std::string::npos) << made.error().message;
    EXPECT_EQ(made.error().message.find('\n'), std::string::npos) << made.error().message;
  };
  for (const auto& field : knee_fields()) {
    refused({{std::string(field.name), field.least - 0.1}}, std::string(field.name), "give a value from");
    refused({{std::string(field.name), field.most + 0.1}}, std::string(field.name), "give a value from");
  }
  refused({{"femur.neck_height_mm", 46.0}}, "femur.neck_height_mm is 46", "head_diameter_mm");
  refused({{"tibia.wing_mm", 1.0}}, "\"tibia.wing_mm\"", "no parameter");
  refused({{"wing.length_mm", 1.0}}, "\"wing.length_mm\" is no parameter of a knee", "femur.length_mm");
  refused({{"length_mm", 400.0}}, "\"length_mm\"", "femur.length_mm");
  refused({{"joint_gap_mm", 4.0}, {"femur.cartilage_mm", 2.5}, {"tibia.cartilage_mm", 2.5}}, "joint_gap_mm is 4",
          "cartilage_mm of femur and tibia");
  refused({{"patella_gap_mm", 4.0}, {"patella.cartilage_mm", 3.0}}, "patella_gap_mm is 4",
          "cartilage_mm of femur and patella");
  // Broad eminences between the condyles of a narrow notch.
  refused({{"joint_gap_mm", 1.5},
           {"femur.notch_width_mm", 12.0},
           {"femur.bicondylar_width_mm", 74.0},
           {"tibia.plateau_width_mm", 98.0}},
          "joint_gap_mm is 1.5", "femur and tibia come nearer than 1 mm to each other");
}

// What the recipe does not say of cartilage fills the gaps.
TEST(Knee, CartilageFollowsFromTheGaps) {
  std::map<std::string, double> found;
  for (const NamedValue& value : knee_of(Side::left, {{"joint_gap_mm", 4.0}, {"patella_gap_mm", 4.5}})->parameters())
    found[value.name] = value.value;
  EXPECT_EQ(found.at("femur.cartilage_mm"), 2.0);
  EXPECT_EQ(found.at("tibia.cartilage_mm"), 2.0);
  EXPECT_EQ(found.at("patella.cartilage_mm"), 2.5);
}

}  // namespace
}  // namespace osteon::phantoms
