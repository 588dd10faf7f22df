// A pelvis: its anatomy, its three bones, what can be measured in a finished case, and parameters that no pelvis has.
#include "common/phantoms/pelvis.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "common/phantoms/phantom_case.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kToDegrees = 180.0 / std::numbers::pi;

BoneRecipe pelvis_recipe() { return {.kind = "pelvis"}; }

TEST(Pelvis, LandmarksLieOnTheSurfaceAndSpanTheAnteriorPelvicPlane) {
  for (const std::string_view preset : kPresets) {
    const auto bone = bone_of({.kind = "pelvis", .preset = std::string(preset)});
    const BoneAnatomy anatomy = bone->anatomy();
    for (const Landmark& found : anatomy.landmarks)
      if (found.name.find("centre") == std::string::npos) {
        EXPECT_NEAR(bone->depths(found.point_mm).surface_mm, 0.0, 0.05) << found.name << ", " << preset;
      }
    ASSERT_EQ(anatomy.planes.size(), 1u);
    const PlannedPlane& plane = anatomy.planes.front();
    EXPECT_EQ(plane.name, "anterior pelvic plane");
    EXPECT_EQ(plane.normal, Vec3(0.0, -1.0, 0.0));
    for (const char* side : {"left ", "right "})
      for (const char* name : {"anterior superior iliac spine", "pubic tubercle"})
        EXPECT_NEAR((landmark(*bone, std::string(side) + name) - plane.point_mm).dot(plane.normal), 0.0, 1e-9);
    const Vec3 middle = landmark(*bone, "left acetabular centre") + landmark(*bone, "right acetabular centre");
    EXPECT_EQ(middle, Vec3::Zero());
    EXPECT_GT(landmark(*bone, "left acetabular centre").x(), 0.0);  // LPS
  }
}

TEST(Pelvis, IsItsOwnMirrorImage) {
  const auto bone = bone_of(pelvis_recipe());
  ASSERT_EQ(bone->names(), (std::vector<std::string>{"left hip bone", "right hip bone", "sacrum"}));
  test::Random random(53);
  const Box box = bone->bounds();
  std::array<int, 4> solid{};
  for (int i = 0; i < 20000; ++i) {
    const Vec3 at(random.between(box.min_mm.x(), box.max_mm.x()), random.between(box.min_mm.y(), box.max_mm.y()),
                  random.between(box.min_mm.z(), box.max_mm.z()));
    const BoneDepths here = bone->depths(at), there = bone->depths(Vec3(-at.x(), at.y(), at.z()));
    EXPECT_EQ(here.surface_mm, there.surface_mm);
    EXPECT_EQ(here.cortex_mm, there.cortex_mm);
    EXPECT_EQ(there.bone, here.bone == 3 ? 3 : 3 - here.bone);
    if (here.surface_mm < 0.0) {
      ++solid[static_cast<std::size_t>(here.bone)];
      if (here.bone != 3) {
        EXPECT_EQ(here.bone, at.x() > 0.0 ? 1 : 2);
      }
    }
  }
  for (int bone_number = 1; bone_number <= 3; ++bone_number)
    EXPECT_GT(solid[static_cast<std::size_t>(bone_number)], 100);
}

TEST(Pelvis, TissuesLieInsideOneAnother) {
  const auto bone = bone_of(pelvis_recipe());
  const PelvisParameters p;
  const Vec3 tubercle = landmark(*bone, "left ischial tuberosity");
  EXPECT_EQ(bone->tissue(tubercle + Vec3(0, 0, 0.5 * p.shell_mm)), BoneTissue::cortical);
  EXPECT_EQ(bone->density_g_cm3(tubercle + Vec3(0, 0, 0.5 * p.shell_mm), 0.3), p.cortical_g_cm3);
  EXPECT_EQ(bone->tissue(tubercle - Vec3(0, 0, 0.5)), BoneTissue::none);
  const Vec3 within = tubercle + Vec3(0, 0, 8.0);
  EXPECT_EQ(bone->tissue(within), BoneTissue::cancellous);
  EXPECT_NEAR(bone->density_g_cm3(within, 0.3), p.cancellous_g_cm3, p.texture * p.cancellous_g_cm3);
  // The roof of the acetabulum: first the subchondral plate, then cancellous bone.
  const Vec3 centre = landmark(*bone, "right acetabular centre");
  const double radius = 0.5 * p.acetabulum_diameter_mm;
  EXPECT_EQ(bone->tissue(centre + Vec3(0, 0, radius - 0.1)), BoneTissue::none);
  EXPECT_EQ(bone->tissue(centre + Vec3(0, 0, radius + p.subchondral_mm - 0.1)), BoneTissue::cortical);
  EXPECT_EQ(bone->tissue(centre + Vec3(0, 0, radius + p.subchondral_mm + 0.1)), BoneTissue::cancellous);
}

TEST(Pelvis, ConditionsOrderCortexAndDensity) {
  double shell = 0.0, subchondral = 0.0, cancellous = 0.0;
  for (const char* condition : {"osteoporotic", "adult", "young"}) {
    const auto p = pelvis_parameters({.kind = "pelvis", .condition = condition});
    ASSERT_TRUE(p) << p.error().message;
    EXPECT_GT(p->shell_mm, shell);
    EXPECT_GT(p->subchondral_mm, subchondral);
    EXPECT_GT(p->cancellous_g_cm3, cancellous);
    shell = p->shell_mm;
    subchondral = p->subchondral_mm;
    cancellous = p->cancellous_g_cm3;
  }
}

// Each bone is one piece within the bounds, and no sample of a bone is beside another bone's. The right half is the
// mirror image of the left one, so the left one and a little of the right one are enough.
void expect_three_bones(const PhantomBone& bone, double pitch_mm, const std::string& which) {
  CoordBox box = covering_samples(bone.bounds().grown(2.0 * pitch_mm), pitch_mm);
  box.min.x = -4;
  const Coord dims = box.dims();
  std::array<std::vector<float>, 3> solid;
  std::vector<int> number;
  for (std::vector<float>& values : solid) values.assign(to_index(dims.x) * to_index(dims.y) * to_index(dims.z), 1.0f);
  const Box bounds = bone.bounds();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = position_mm({x, y, z}, pitch_mm);
        const BoneDepths depths = bone.depths(at);
        if (depths.surface_mm < 0.0) {
          solid[to_index(depths.bone) - 1][number.size()] = -1.0f;
          ASSERT_TRUE((at.array() >= bounds.min_mm.array()).all() && (at.array() <= bounds.max_mm.array()).all())
              << at.transpose() << ", " << which;
        }
        number.push_back(depths.surface_mm < 0.0 ? depths.bone : 0);
      }
  // Samples may fall beside a thin edge, and finer ones do not.
  for (const std::size_t i : {0u, 2u})
    if (pitch_mm > kFinest_mm && count_islands(dims, solid[i]) > 1) return expect_three_bones(bone, 0.6 * pitch_mm, which);
  for (const std::size_t i : {0u, 2u}) {
    const std::vector<Island> islands = find_islands(dims, solid[i]);
    ASSERT_EQ(islands.size(), 1u) << bone.names()[i] << ", " << which << "\n"
                                  << islands_text(bone, islands, box.min, pitch_mm);
  }
  // Between neighbouring samples of two bones there is a place without bone.
  const std::size_t steps[] = {to_index(dims.y) * to_index(dims.z), to_index(dims.z), 1};
  for (std::size_t n = 0; n < number.size(); ++n)
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t next = n + steps[axis];
      if (next >= number.size() || number[n] == 0 || number[next] == 0 || number[n] == number[next]) continue;
      const auto rest = static_cast<int>(n % steps[0]);
      Vec3 at = position_mm(
          {box.min.x + static_cast<int>(n / steps[0]), box.min.y + rest / dims.z, box.min.z + rest % dims.z}, pitch_mm);
      double farthest = -1.0;
      for (int part = 0; part <= 20; ++part) {
        Vec3 between = at;
        between[axis] += 0.05 * part * pitch_mm;
        farthest = std::max(farthest, bone.depths(between).surface_mm);
      }
      ASSERT_GT(farthest, 0.2) << at.transpose() << ", " << which;
    }
}

// Behind the rim and beside the notch, every way out of the socket leads into bone.
void expect_closed_socket(const PhantomBone& bone, const std::string& which) {
  const Vec3 centre = landmark(bone, "left acetabular centre");
  const PlannedAxis opening = bone.anatomy().axes.front();
  ASSERT_EQ(opening.name, "left acetabular opening");
  test::Random random(67);
  for (int i = 0; i < 400; ++i) {
    const Vec3 way = random.direction();
    if (way.dot(opening.direction) > -0.45) continue;
    double least = 1.0;
    for (double away = 18.0; away < 48.0; away += 0.5)
      least = std::min(least, bone.depths(centre + away * way).surface_mm);
    ASSERT_LT(least, -0.5) << way.transpose() << ", " << which;
  }
}

TEST(Pelvis, EveryPresetIsThreeBonesThatDoNotTouch) {
  for (const std::string_view preset : kPresets) {
    const auto bone = bone_of({.kind = "pelvis", .preset = std::string(preset)});
    ASSERT_TRUE(bone);
    ASSERT_NO_FATAL_FAILURE(expect_three_bones(*bone, 2.5, std::string(preset)));
    ASSERT_NO_FATAL_FAILURE(expect_closed_socket(*bone, std::string(preset)));
    for (const std::string_view condition : kConditions)
      EXPECT_TRUE(make_bone({.kind = "pelvis", .preset = std::string(preset), .condition = std::string(condition)}));
  }
}

TEST(Pelvis, RandomPelvesAreThreeBonesEach) {
  test::Random random(61);
  int refused = 0;
  for (int made = 0; made < random_sets();) {
    BoneRecipe recipe = pelvis_recipe();
    recipe.preset = kPresets[random.index(std::size(kPresets))];
    recipe.condition = kConditions[random.index(std::size(kConditions))];
    const auto p = pelvis_parameters(recipe);
    ASSERT_TRUE(p) << p.error().message;
    for (const auto& field : pelvis_fields()) {
      const double value = *p.*field.value, spread = 0.08 * value;
      recipe.changes[std::string(field.name)] =
          std::clamp(value + random.between(-spread, spread), field.least, field.most);
    }
    const auto bone = make_bone(recipe);
    if (!bone) {
      ASSERT_LT(++refused, 20 * random_sets()) << bone.error().message;
      continue;
    }
    ++made;
    ASSERT_NO_FATAL_FAILURE(expect_three_bones(**bone, 2.5, "set " + std::to_string(made)));
    ASSERT_NO_FATAL_FAILURE(expect_closed_socket(**bone, "set " + std::to_string(made)));
    for (const Landmark& found : (*bone)->anatomy().landmarks)
      if (found.name.find("centre") == std::string::npos) {
        EXPECT_NEAR((*bone)->depths(found.point_mm).surface_mm, 0.0, 0.3) << found.name << ", set " << made;
      }
  }
}

// What a surgeon measures in a finished case. It asks the case's field alone.
class MeasuredPelvis {
 public:
  explicit MeasuredPelvis(const Case& bone) : bone_(bone) {
    const CoordBox box = bone.bounds_samples();
    const Coord dims = box.dims();
    std::vector<float> surface(to_index(dims.x) * to_index(dims.y) * to_index(dims.z));
    bone.gather_surface(box, surface);
    const auto at = [&](int x, int y, int z) {
      return surface[(to_index(x - box.min.x) * to_index(dims.y) + to_index(y - box.min.y)) * to_index(dims.z) +
                     to_index(z - box.min.z)];
    };
    // Where edges between samples cross the surface.
    for (int x = box.min.x; x < box.max.x; ++x)
      for (int y = box.min.y; y < box.max.y; ++y)
        for (int z = box.min.z; z < box.max.z; ++z) {
          const float here = at(x, y, z);
          const Coord next[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
          for (const Coord& step : next) {
            const float there = at(x + step.x, y + step.y, z + step.z);
            if ((here < 0.0f) == (there < 0.0f)) continue;
            const double t = static_cast<double>(here) / (static_cast<double>(here) - static_cast<double>(there));
            points_.emplace_back(bone.pitch_mm() * Vec3(x + t * step.x, y + t * step.y, z + t * step.z));
          }
        }
  }

  // The point of a rounded tip that lies farthest along `way`, among those of a part of the bones.
  template <class Part>
  [[nodiscard]] Vec3 tip(const Vec3& way, const Part& part) const {
    double farthest = -1e9;
    for (const Vec3& p : points_)
      if (part(p)) farthest = std::max(farthest, p.dot(way));
    std::vector<Vec3> cap;
    for (const Vec3& p : points_)
      if (part(p) && p.dot(way) > farthest - 1.0) cap.push_back(p);
    const auto [centre, radius] = ball(cap);
    return centre + radius * way;
  }

  struct Ball {
    Vec3 centre;
    double radius = 0.0;
  };
  // Least squares of |p|² = 2 c·p + (r² - |c|²).
  [[nodiscard]] static Ball ball(const std::vector<Vec3>& points) {
    Eigen::MatrixXd rows(points.size(), 4);
    Eigen::VectorXd squares(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      rows.row(static_cast<Eigen::Index>(i)) << 2.0 * points[i].transpose(), 1.0;
      squares[static_cast<Eigen::Index>(i)] = points[i].squaredNorm();
    }
    const Eigen::VectorXd c = rows.colPivHouseholderQr().solve(squares);
    return {c.head<3>(), std::sqrt(c[3] + c.head<3>().squaredNorm())};
  }

  // The lunate surface: what lies on one ball, beginning with a guess of a surgeon's finger.
  [[nodiscard]] Ball acetabulum(double side) const {
    Ball found{Vec3(side * 88.0, 2.0, 1.0), 25.0};
    for (const double within_mm : {4.0, 2.0, 1.0, 0.6, 0.4, 0.4}) {
      std::vector<Vec3> near;
      for (const Vec3& p : points_) {
        const Vec3 from = p - found.centre;
        if (std::abs(from.norm() - found.radius) < within_mm && side * from.x() < 0.3 * from.norm() &&
            from.z() > -0.3 * from.norm())
          near.push_back(p);
      }
      found = ball(near);
    }
    return found;
  }

  // The normal of the plane of the bony rim, outwards. Around the ball it is the end of the wall; its notch is no part.
  [[nodiscard]] Vec3 opening(const Ball& socket, double side) const {
    Vec3 normal = Vec3(side * 0.7, -0.2, -0.7).normalized();
    const double wall_mm = socket.radius + 2.5;
    for (int round = 0; round < 6; ++round) {
      const Vec3 across = normal.cross(Vec3::UnitY()).normalized(), up = across.cross(normal);
      std::vector<Vec3> rim;
      for (int step = 0; step < 180; ++step) {
        const double turn = 2.0 * step / kToDegrees;
        const Vec3 out = std::cos(turn) * across + std::sin(turn) * up;
        if (out.z() < -0.45) continue;
        const auto at = [&](double latitude) {
          return Vec3(socket.centre + wall_mm * (std::cos(latitude) * out + std::sin(latitude) * normal));
        };
        double in = -0.8, beyond = 0.8;
        if (!(bone_.surface_mm(at(in)) < 0.0 && bone_.surface_mm(at(beyond)) > 0.0)) continue;
        while (beyond - in > 1e-5) {
          const double middle = 0.5 * (in + beyond);
          (bone_.surface_mm(at(middle)) < 0.0 ? in : beyond) = middle;
        }
        rim.push_back(at(in));
      }
      Vec3 mean = Vec3::Zero();
      for (const Vec3& p : rim) mean += p / static_cast<double>(rim.size());
      Eigen::MatrixXd off(rim.size(), 3);
      for (std::size_t i = 0; i < rim.size(); ++i) off.row(static_cast<Eigen::Index>(i)) = (rim[i] - mean).transpose();
      const Vec3 found = off.jacobiSvd(Eigen::ComputeThinV).matrixV().col(2);
      normal = found.dot(normal) < 0.0 ? Vec3(-found) : found;
    }
    return normal;
  }

  // The length of a gap along x, from bone to bone, times the cosine between x and its faces' normal.
  [[nodiscard]] double gap_mm(Vec3 from, double to_x) const {
    std::vector<Vec3> faces;
    constexpr double kStep = 0.01;
    for (Vec3 at = from; at.x() < to_x; at.x() += kStep)
      if ((bone_.surface_mm(at) < 0.0) != (bone_.surface_mm(at + kStep * Vec3::UnitX()) < 0.0)) faces.push_back(at);
    EXPECT_EQ(faces.size(), 2u);
    if (faces.size() != 2) return 0.0;
    Vec3 normal;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 off = Vec3::Zero();
      off[axis] = 0.3;
      normal[axis] = bone_.surface_mm(faces[0] + off) - bone_.surface_mm(faces[0] - off);
    }
    return (faces[1].x() - faces[0].x()) * normal.normalized().x();
  }

  [[nodiscard]] const std::vector<Vec3>& points() const { return points_; }

 private:
  const Case& bone_;
  std::vector<Vec3> points_;
};

// Two pelves: their parameters are measured back from cases of 1.2 mm.
TEST(PelvisCase, ParametersAreMeasuredBack) {
  const BoneRecipe recipes[] = {{.kind = "pelvis", .changes = {{"sacroiliac_gap_mm", 4.0}, {"symphysis_gap_mm", 5.0}}},
                                {.kind = "pelvis",
                                 .preset = "female",
                                 .changes = {{"inclination_degrees", 48.0},
                                             {"anteversion_degrees", 11.0},
                                             {"acetabulum_depth", 0.8},
                                             {"tuberosities_mm", 122.0},
                                             {"sacroiliac_gap_mm", 5.0},
                                             {"symphysis_gap_mm", 6.0}}}};
  for (const BoneRecipe& recipe : recipes) {
    const auto p = pelvis_parameters(recipe);
    ASSERT_TRUE(p) << p.error().message;
    const auto made = build_phantom_case(Pelvis(*p), {.pitch_mm = 1.2, .calibration = {0.001067, 0.131}},
                                         [](double) { return true; });
    ASSERT_TRUE(made) << made.error().message;
    const MeasuredPelvis measured(made->bone);
    const auto near = [](double found, double value, const char* name) {
      EXPECT_NEAR(found, value, 0.02 * value) << name;
    };
    for (const double side : {1.0, -1.0}) {
      const auto socket = measured.acetabulum(side);
      EXPECT_NEAR((socket.centre - Vec3(side * 0.5 * p->hip_centres_mm, 0.0, 0.0)).norm(), 0.0, 0.3);
      near(2.0 * socket.radius, p->acetabulum_diameter_mm, "acetabulum_diameter_mm");
      // Murray 1993, radiographic: the axis in the coronal plane, and out of that plane.
      const Vec3 opening = measured.opening(socket, side);
      EXPECT_NEAR(std::atan2(side * opening.x(), -opening.z()) * kToDegrees, p->inclination_degrees, 0.5);
      EXPECT_NEAR(std::asin(-opening.y()) * kToDegrees, p->anteversion_degrees, 0.5);
    }
    const Vec3 front = -Vec3::UnitY(), back = Vec3::UnitY(), down = -Vec3::UnitZ(), up = Vec3::UnitZ();
    const Vec3 spine = measured.tip(front, [](const Vec3& v) { return v.x() > 60.0 && v.z() > 45.0; });
    const Vec3 tubercle = measured.tip(front, [](const Vec3& v) { return v.x() > 5.0 && v.z() < 10.0; });
    const Vec3 tuberosity = measured.tip(down, [](const Vec3& v) { return v.x() > 5.0; });
    const Vec3 posterior = measured.tip(back, [](const Vec3& v) { return v.x() > 20.0 && v.z() > 30.0; });
    near(2.0 * spine.x(), p->spines_mm, "spines_mm");
    near(-spine.y(), p->plane_forward_mm, "plane_forward_mm");
    near(spine.z(), p->spine_height_mm, "spine_height_mm");
    near(2.0 * tubercle.x(), p->tubercles_mm, "tubercles_mm");
    near(-tubercle.y(), p->plane_forward_mm, "plane_forward_mm");
    EXPECT_NEAR(-tubercle.z(), p->tubercle_depth_mm, 0.5);
    near(2.0 * tuberosity.x(), p->tuberosities_mm, "tuberosities_mm");
    near(-tuberosity.z(), p->tuberosity_depth_mm, "tuberosity_depth_mm");
    EXPECT_NEAR(tuberosity.y(), p->tuberosity_back_mm, 0.6);
    near(2.0 * posterior.x(), p->posterior_spines_mm, "posterior_spines_mm");
    near(posterior.y(), p->posterior_spine_back_mm, "posterior_spine_back_mm");
    near(posterior.z(), p->posterior_spine_height_mm, "posterior_spine_height_mm");
    double widest = 0.0, highest = 0.0, sacrum_side = 0.0;
    for (const Vec3& v : measured.points()) {
      widest = std::max(widest, v.x());
      highest = std::max(highest, v.dot(up));
      const Eigen::Vector3i sample = (v / made->bone.pitch_mm()).array().round().cast<int>();
      if (made->bone.bone_number({sample.x(), sample.y(), sample.z()}) == 3) sacrum_side = std::max(sacrum_side, v.x());
    }
    near(2.0 * widest, p->crests_mm, "crests_mm");
    near(highest, p->crest_height_mm, "crest_height_mm");
    near(2.0 * sacrum_side, p->sacrum_width_mm, "sacrum_width_mm");
    const double z = -p->tubercle_depth_mm - 0.5 * p->symphysis_mm, y = 0.45 * p->plane_forward_mm;
    EXPECT_NEAR(measured.gap_mm({-12.0, -y, z}, 12.0), p->symphysis_gap_mm, 0.1);
    EXPECT_NEAR(measured.gap_mm({20.0, 0.62 * p->posterior_spine_back_mm, 0.68 * p->posterior_spine_height_mm}, 55.0),
                p->sacroiliac_gap_mm, 0.1);
  }
}

TEST(Pelvis, ImpossibleParametersAreOneSentence) {
  const auto refused = [](const std::string& name, double value, const std::string& also) {
    expect_refused("pelvis", name, value, also);
  };
  expect_ranges("pelvis", pelvis_fields());
  refused("acetabulum_diameter_mm", 64.0, "hip_centres_mm");
  refused("crests_mm", 240.0, "spines_mm");
  refused("crest_height_mm", 100.0, "spine_height_mm");
  refused("posterior_spines_mm", 60.0, "sacrum_width_mm");
  refused("shell_mm", 2.9, "wing_mm");
  refused("foramen_height_mm", 64.0, "tuberosity_depth_mm");
  refused("tuberosities_mm", 168.0, "hip_centres_mm");
  refused("head_diameter_mm", 44.0, "no parameter");
}

}  // namespace
}  // namespace osteon::phantoms
