// A pelvis: its anatomy, its three bones, what can be measured in a finished case, and parameters that no pelvis has.
#include "common/phantoms/pelvis.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>

#include "common/phantoms/phantom_case.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/phantoms/islands.hpp"
#include "tests/unit/phantoms/made_bones.hpp"
#include "tests/unit/phantoms/measured_femur.hpp"

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
    if (pitch_mm > kFinest_mm && count_islands(dims, solid[i]) > 1)
      return expect_three_bones(bone, 0.6 * pitch_mm, which);
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
    const auto [centre, radius] = fitted_ball(cap);
    return centre + radius * way;
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
      found = fitted_ball(near);
    }
    return found;
  }

  struct Rim {
    Vec3 normal;            // outwards
    double plane_mm = 0.0;  // along it, from the ball's centre
  };
  // The plane of the bony rim. Around the ball it is the end of the wall; its notch is no part.
  [[nodiscard]] Rim rim_of(const Ball& socket, double side) const {
    double plane_mm = 0.0;
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
      const Eigen::Matrix3d spread = off.transpose() * off;
      const Vec3 found = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
      normal = found.dot(normal) < 0.0 ? Vec3(-found) : found;
      plane_mm = (mean - socket.centre).dot(normal);
    }
    return {normal, plane_mm};
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

  // Outwards.
  [[nodiscard]] Vec3 normal(const Vec3& at) const {
    Vec3 normal;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 off = 0.6 * Vec3::Unit(axis);
      normal[axis] = bone_.surface_mm(at + off) - bone_.surface_mm(at - off);
    }
    return normal.normalized();
  }

  // How far it is along a line until it leaves what it begins in, bone or none.
  [[nodiscard]] double reach_mm(const Vec3& from, const Vec3& way, double most_mm) const {
    constexpr double kStep = 0.25;
    const bool solid = bone_.surface_mm(from) < 0.0;
    const auto inside = [&](double away) { return (bone_.surface_mm(from + away * way) < 0.0) == solid; };
    double near = 0.0;
    while (inside(near + kStep)) {
      near += kStep;
      if (near > most_mm) return most_mm;
    }
    double far = near + kStep;
    while (far - near > 1e-4) {
      const double middle = 0.5 * (near + far);
      (inside(middle) ? near : far) = middle;
    }
    return near;
  }

  // The clear opening of the obturator foramen, seen along the axis along which it is largest. Of an ellipse, the
  // second moments of its area are squares of the half axes, over four.
  struct Opening {
    double width_mm = 0.0, height_mm = 0.0, area_mm2 = 0.0;
    Vec3 middle;
  };
  [[nodiscard]] Opening opening_along(const Vec3& axis, const Vec3& inside) const {
    constexpr int kRays = 120;
    constexpr double kDepth_mm = 8.0, kFar_mm = 60.0;
    const Vec3 across = axis.cross(Vec3::UnitZ()).normalized(), up = across.cross(axis);
    Vec3 middle = inside;
    Eigen::Matrix2d moments;
    double area = 0.0;
    for (int round = 0; round < 2; ++round) {
      std::vector<Eigen::Vector2d> outline;
      for (int ray = 0; ray < kRays; ++ray) {
        const double turn = 2.0 * std::numbers::pi * ray / kRays;
        const Vec3 way = std::cos(turn) * across + std::sin(turn) * up;
        double least = kFar_mm;
        for (double along = -kDepth_mm; along <= kDepth_mm; along += 1.0)
          least = std::min(least, reach_mm(middle + along * axis, way, least));
        outline.emplace_back(least * std::cos(turn), least * std::sin(turn));
      }
      // Of the triangles from the middle to each side of the outline.
      area = 0.0;
      moments.setZero();
      Eigen::Vector2d first = Eigen::Vector2d::Zero();
      for (std::size_t i = 0; i < outline.size(); ++i) {
        const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
        const double part = 0.5 * (a.x() * b.y() - a.y() * b.x());
        area += part;
        first += part * (a + b) / 3.0;
        moments += part * (a * a.transpose() + b * b.transpose() + (a + b) * (a + b).transpose()) / 12.0;
      }
      first /= area;
      moments = (moments / area - first * first.transpose()).eval();
      if (round == 0) middle += first.x() * across + first.y() * up;
    }
    const Eigen::Vector2d squares =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>().computeDirect(moments).eigenvalues();
    return {4.0 * std::sqrt(squares[0]), 4.0 * std::sqrt(squares[1]), area, middle};
  }
  [[nodiscard]] Opening foramen() const {
    // As a surgeon looks through it: from before, from the side and from below.
    Vec3 axis = Vec3(0.46, -0.68, -0.57).normalized();
    Opening best = opening_along(axis, {44.0, -4.0, -35.0});
    for (double step = 0.08; step > 0.004; step *= 0.5)
      for (bool better = true; better;) {
        better = false;
        for (const Vec3& off : {Vec3(axis.unitOrthogonal()), Vec3(axis.cross(axis.unitOrthogonal()))})
          for (const double way : {step, -step}) {
            const Vec3 next = (axis + way * off).normalized();
            const Opening found = opening_along(next, best.middle);
            if (found.area_mm2 <= best.area_mm2) continue;
            best = found;
            axis = next;
            better = true;
          }
      }
    return best;
  }

  // The middle of a flat end of the sacrum, in the median plane: of the face that looks that way.
  [[nodiscard]] Vec3 sacrum_end(const Vec3& way) const {
    std::vector<std::pair<Vec3, Vec3>> face;  // points and normals
    double farthest = -1e9;
    const auto in_sacrum = [&](const Vec3& v) { return std::abs(v.x()) < 3.0 && bone_beside(bone_, v) == 3; };
    for (const Vec3& v : points_)
      if (in_sacrum(v)) farthest = std::max(farthest, v.dot(way));
    for (const Vec3& v : points_)
      if (in_sacrum(v) && v.dot(way) > farthest - 25.0) face.emplace_back(v, normal(v));
    // Begin with the farthest point, and keep what is level with it and looks that way.
    Vec3 at = Vec3::Zero(), out = way;
    for (const auto& [v, n] : face)
      if (v.dot(way) == farthest) at = v;
    for (const double level_mm : {3.0, 2.0, 1.0, 1.0}) {
      Vec3 sum = Vec3::Zero(), mean = Vec3::Zero();
      double count = 0.0;
      for (const auto& [v, n] : face)
        if (n.dot(out) > 0.93 && std::abs((v - at).dot(out)) < level_mm) {
          sum += n;
          mean += v;
          count += 1.0;
        }
      EXPECT_GT(count, 0.0) << "no face";
      out = Vec3(0.0, sum.y(), sum.z()).normalized();
      at = mean / count;
    }
    const Vec3 along = out.cross(Vec3::UnitX());
    std::vector<double> places;
    for (const auto& [v, n] : face)
      if (n.dot(out) > 0.93 && std::abs((v - at).dot(out)) < 1.0) places.push_back((v - at).dot(along));
    std::ranges::sort(places);
    return at + places[places.size() / 2] * along;
  }

  struct Place {
    double thick_mm = 0.0;  // of the bone there
    Vec3 at, in;            // on the surface, and along the normal into the bone
  };
  // The thinnest fifth of the left wing: places on its outer face.
  [[nodiscard]] std::vector<Place> wing() const {
    std::vector<Place> found;
    for (const Vec3& v : points_) {
      if (v.x() < 50.0 || v.z() < 45.0 || v.z() > 115.0 || v.y() < -30.0 || v.y() > 90.0) continue;
      const Vec3 out = normal(v);
      constexpr double kInside_mm = 0.05;
      if (out.x() > 0.3) found.push_back({reach_mm(v - kInside_mm * out, -out, 30.0) + kInside_mm, v, -out});
    }
    std::ranges::sort(found, {}, &Place::thick_mm);
    found.resize(found.size() / 5);
    return found;
  }

  // Thickness of the left crest around its highest point, 3 mm below: between both faces in a horizontal section, times
  // the cosine between that line and the normal of the blade, whose middle leans outwards.
  [[nodiscard]] double crest_mm() const {
    constexpr double kBelow_mm = 3.0;
    Vec3 top = Vec3::Zero();
    for (const Vec3& v : points_)
      if (v.x() > 40.0 && v.z() > top.z()) top = v;
    // The middles of both faces, along the crest and down.
    const auto section = [&](double y, double z, const Vec3& across) {
      Vec3 inside(top.x() + 15.0, y, z);
      while (bone_.surface_mm(inside) > -1.0 && inside.x() > 0.0) inside.x() -= 0.5;
      const double one = reach_mm(inside, across, 30.0), other = reach_mm(inside, -across, 30.0);
      return std::pair<Vec3, double>(inside + 0.5 * (one - other) * across, one + other);
    };
    const double z = top.z() - kBelow_mm;
    Vec3 across = Vec3::UnitX(), normal = Vec3::UnitX();
    for (int round = 0; round < 4; ++round) {
      const Vec3 along = section(top.y() + 6.0, z, across).first - section(top.y() - 6.0, z, across).first;
      across = Vec3(along.y(), -along.x(), 0.0).normalized();
      const Vec3 down = section(top.y(), z - 2.0, across).first - section(top.y(), z + 1.0, across).first;
      normal = along.cross(down).normalized();
    }
    return section(top.y(), z, across).second * std::abs(across.dot(normal));
  }

  // Thickness of dense bone under a point of the surface, along the normal: what its mass is more than that of the
  // cancellous bone below. Both densities are measured, too.
  [[nodiscard]] double cortex_mm(const Vec3& at, const Vec3& in, double cortical, double cancellous,
                                 double deep_mm) const {
    constexpr double kStep = 0.05;
    double mass = 0.0;
    for (double away = 0.5 * kStep; away < deep_mm; away += kStep)
      mass += kStep * (bone_.density_g_cm3(at + away * in) - cancellous);
    return mass / (cortical - cancellous);
  }

  // Length of the pubis along the slope of its joint, in a section beside the joint's rounded edge.
  [[nodiscard]] double symphysis_mm() const {
    const double tilt = 35.0 / kToDegrees;
    const Vec3 slope(0.0, std::sin(tilt), -std::cos(tilt));
    double first = 1e9, last = -1e9;
    for (const Vec3& v : points_)
      if (v.x() > 5.5 && v.x() < 7.5 && v.z() < 10.0 && v.y() < 30.0) {
        first = std::min(first, v.dot(slope));
        last = std::max(last, v.dot(slope));
      }
    return last - first;
  }

  [[nodiscard]] const std::vector<Vec3>& points() const { return points_; }

 private:
  const Case& bone_;
  std::vector<Vec3> points_;
};

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Cancellous bone at samples at least 4.5 mm below the surface, away from the plate around the acetabulum; then cortex
// of the wing and that plate, which are denser.
void expect_tissues(const MeasuredPelvis& measured, const Case& bone, const PelvisParameters& p) {
  const auto near = [](double found, double value, const char* name) {
    std::printf("[          ] %-26s %8.3f, measured %8.3f\n", name, value, found);
    EXPECT_NEAR(found, value, 0.02 * value) << name;
  };
  const auto socket = measured.acetabulum(1.0);
  const CoordBox box = bone.bounds_samples();
  double cortical = 0.0;  // the densest bone
  std::vector<double> cancellous;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = position_mm({x, y, z}, bone.pitch_mm());
        const double surface = bone.surface_mm(at);
        if (surface < 0.0) cortical = std::max(cortical, bone.density_g_cm3(at));
        if (at.x() < 0.0 || surface > -4.5 || (at - socket.centre).norm() < 40.0) continue;
        const double density = bone.density_g_cm3(at);
        cancellous.push_back(density);
      }
  ASSERT_GT(cancellous.size(), 10000u);
  // Where parts grow together, cortex may reach so deep. It is denser than texture makes cancellous bone.
  std::ranges::nth_element(cancellous, cancellous.begin() + static_cast<std::ptrdiff_t>(cancellous.size() / 2));
  const double median = cancellous[cancellous.size() / 2];
  std::erase_if(cancellous, [&](double density) { return density > (1.0 + 2.0 * p.texture) * median; });
  const double mean = mean_of(cancellous);
  near(mean, p.cancellous_g_cm3, "cancellous_g_cm3");
  double squares = 0.0;
  for (const double density : cancellous) squares += std::pow(density / mean - 1.0, 2);
  // Noise between lattice points, interpolated with smooth weights, has this deviation.
  constexpr double kDeviation = 0.3698;
  const double texture = std::sqrt(squares / static_cast<double>(cancellous.size())) / kDeviation;
  std::printf("[          ] %-26s %8.3f, measured %8.3f\n", "texture", p.texture, texture);
  EXPECT_NEAR(texture, p.texture, 0.05 * p.texture);

  near(cortical, p.cortical_g_cm3, "cortical_g_cm3");
  std::vector<double> wing, shell, plate;
  for (const auto& place : measured.wing()) {
    wing.push_back(place.thick_mm);
    shell.push_back(measured.cortex_mm(place.at, place.in, cortical, mean, 0.5 * place.thick_mm));
  }
  ASSERT_GT(wing.size(), 500u);
  near(mean_of(wing), p.wing_mm, "wing_mm");
  near(mean_of(shell), p.shell_mm, "shell_mm");
  // Rays from the centre through the roof, away from the rim.
  for (double x = -0.5; x < 0.1; x += 0.05)
    for (double y = -0.3; y < 0.5; y += 0.05) {
      const Vec3 way = Vec3(x, y, 1.0).normalized();
      const double face = measured.reach_mm(socket.centre, way, 60.0);
      plate.push_back(measured.cortex_mm(socket.centre + face * way, way, cortical, mean, 5.5));
    }
  near(mean_of(plate), p.subchondral_mm, "subchondral_mm");
}

// Two pelves: their parameters are measured back from cases of 1.2 mm.
TEST(PelvisCase, ParametersAreMeasuredBack) {
  // The second one takes 6 s, and changes less.
  const BoneRecipe recipes[] = {{.kind = "pelvis",
                                 .preset = "female",
                                 .changes = {{"inclination_degrees", 48.0},
                                             {"anteversion_degrees", 11.0},
                                             {"acetabulum_depth", 0.8},
                                             {"tuberosities_mm", 122.0},
                                             {"sacroiliac_gap_mm", 5.0},
                                             {"symphysis_gap_mm", 6.0}}},
                                {.kind = "pelvis", .changes = {{"sacroiliac_gap_mm", 4.0}, {"symphysis_gap_mm", 5.0}}}};
  for (const BoneRecipe& recipe : std::span(recipes).first(test::trials(2, 1))) {
    const auto p = pelvis_parameters(recipe);
    ASSERT_TRUE(p) << p.error().message;
    const auto made = build_phantom_case(Pelvis(*p), {.pitch_mm = 1.2, .calibration = {0.001067, 0.131}},
                                         [](double) { return true; });
    ASSERT_TRUE(made) << made.error().message;
    const MeasuredPelvis measured(made->bone);
    const auto near = [](double found, double value, const char* name) {
      std::printf("[          ] %-26s %8.3f, measured %8.3f\n", name, value, found);
      EXPECT_NEAR(found, value, 0.02 * value) << name;
    };
    for (const double side : {1.0, -1.0}) {
      const auto socket = measured.acetabulum(side);
      EXPECT_NEAR((socket.centre - Vec3(side * 0.5 * p->hip_centres_mm, 0.0, 0.0)).norm(), 0.0, 0.3);
      near(2.0 * socket.radius, p->acetabulum_diameter_mm, "acetabulum_diameter_mm");
      // Murray 1993, radiographic: the axis in the coronal plane, and out of that plane.
      const auto [opening, plane_mm] = measured.rim_of(socket, side);
      near(1.0 + plane_mm / socket.radius, p->acetabulum_depth, "acetabulum_depth");
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
      if (bone_beside(made->bone, v) == 3) sacrum_side = std::max(sacrum_side, v.x());
    }
    near(2.0 * widest, p->crests_mm, "crests_mm");
    near(highest, p->crest_height_mm, "crest_height_mm");
    near(2.0 * sacrum_side, p->sacrum_width_mm, "sacrum_width_mm");
    const auto hole = measured.foramen();
    near(hole.width_mm, p->foramen_width_mm, "foramen_width_mm");
    near(hole.height_mm, p->foramen_height_mm, "foramen_height_mm");
    const Vec3 base = measured.sacrum_end((up + front).normalized()), apex = measured.sacrum_end(down);
    near((base - apex).norm(), p->sacrum_height_mm, "sacrum_height_mm");
    near(measured.crest_mm(), p->crest_mm, "crest_mm");
    near(measured.symphysis_mm(), p->symphysis_mm, "symphysis_mm");
    expect_tissues(measured, made->bone, *p);
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
