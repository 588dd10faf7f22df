// Every parameter of a tibia and its fibula, measured in the finished case from its surface and density alone.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/phantoms/phantom_case.hpp"
#include "tests/unit/phantoms/made_bones.hpp"
#include "tests/unit/phantoms/measured_femur.hpp"

namespace osteon::phantoms {
namespace {

using Values = std::map<std::string, double>;

// Both bones' points of the surface.
struct LegPoints {
  std::vector<Vec3> tibia, fibula;
};

LegPoints leg_points(const Case& bone, const BoneView& view) {
  LegPoints points;
  for (const Vec3& p : view.surface_points())
    (bone_beside(bone, view.world(p)) == 2 ? points.fibula : points.tibia).push_back(p);
  return points;
}

struct Extent {
  double least = 1e9, most = -1e9;
  void include(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
  [[nodiscard]] double size() const { return most - least; }
};

Extent extent_of(const std::vector<Vec3>& points, int axis) {
  Extent found;
  for (const Vec3& p : points) found.include(p[axis]);
  return found;
}

std::vector<Vec3> points_between(const std::vector<Vec3>& points, double low, double high) {
  std::vector<Vec3> found;
  for (const Vec3& p : points)
    if (p.z() > low && p.z() < high) found.push_back(p);
  return found;
}

// A plane through the plateau, on both sides of the eminences: its height in the middle, and how it falls backwards.
void measure_plateau(const BoneView& view, const std::vector<Vec3>& tibia, Values& found) {
  const double width = found["plateau_width_mm"], depth = found["plateau_depth_mm"];
  std::vector<Vec3> face;
  for (const Vec3& p : tibia)
    if (std::abs(p.x()) > 0.2 * width && std::abs(p.x()) < 0.3 * width && std::abs(p.y()) < 0.2 * depth &&
        p.z() > -0.15 * width)
      face.push_back(p);
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(face.size()), 3);
  Eigen::VectorXd heights(static_cast<Eigen::Index>(face.size()));
  for (std::size_t i = 0; i < face.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) << 1.0, face[i].x(), face[i].y();
    heights[static_cast<Eigen::Index>(i)] = face[i].z();
  }
  const Eigen::VectorXd plane = least_squares(rows, heights);
  const double slope = std::atan(plane[2]);
  found["slope_degrees"] = slope * 180.0 / std::numbers::pi;
  found["length_mm"] = plane[0] - extent_of(tibia, 2).least;
  double shell = 0.0;
  for (int i = -2; i <= 2; ++i)
    shell += view.cortex_mm({0.25 * width, 2.0 * i, -9.0}, Vec3::UnitZ(), 5.0) * std::cos(slope) / 5.0;
  found["shell_mm"] = shell;
}

// Thickness of cortex along a line outwards: its mass beyond that of what is deeper. Samples blur its inner face by up
// to a twelfth of their distance along the lattice, and keep its mass.
double cortex_by_mass_mm(const BoneView& view, const Vec3& from, const Vec3& way) {
  constexpr double kStep = 0.02;
  const double reach = view.reach_mm(from, way), about = view.cortex_mm(from, way, 12.0);
  const auto density = [&](double deep) { return view.density_g_cm3(from + (reach - deep) * way); };
  double within = 0.0, mass = 0.0;
  for (double deep = about + 1.0; deep < about + 2.0; deep += kStep) within += kStep * density(deep);
  for (double deep = 0.5 * kStep; deep < about + 1.5; deep += kStep) mass += kStep * (density(deep) - within);
  return mass / (density(0.0) - within);
}

void measure_shaft_of_tibia(const BoneView& view, double tip, Values& found) {
  for (const char* station : {"12", "30", "50", "70", "86"}) {
    const Vec3 middle(0.0, 0.0, tip + 0.01 * std::atof(station) * found["length_mm"]);
    const auto across = [&](const Vec3& way) { return view.reach_mm(middle, way) + view.reach_mm(middle, -way); };
    found[std::string("width_") + station + "_mm"] = across(Vec3::UnitX());
    // The tuberosity stands out in front.
    found[std::string("depth_") + station + "_mm"] =
        std::string_view(station) == "86" ? 2.0 * view.reach_mm(middle, -Vec3::UnitY()) : across(Vec3::UnitY());
    // The medial malleolus begins at 12 %.
    std::vector<Vec3> ways{Vec3::UnitX(), -Vec3::UnitY()};
    if (std::string_view(station) != "12") ways.push_back(-Vec3::UnitX());
    double cortex = 0.0;
    for (const Vec3& way : ways) cortex += cortex_by_mass_mm(view, middle, way) / static_cast<double>(ways.size());
    found[std::string("cortex_") + station + "_mm"] = cortex;
  }
  // Along the shaft's middle, the density falls to that of marrow and rises again.
  const double marrow = view.density_g_cm3({0.0, 0.0, tip + 0.5 * found["length_mm"]});
  found["marrow_g_cm3"] = marrow;
  for (const auto& [name, way] : {std::pair{"marrow_from", -1.0}, std::pair{"marrow_to", 1.0}}) {
    const auto density = [&, way = way](double along) {
      return view.density_g_cm3({0.0, 0.0, tip + (0.5 + way * along) * found["length_mm"]});
    };
    double along = 0.0;
    while (density(along) < 0.5 * (marrow + density(along + 0.015)) + 1e-3) along += 1e-5;
    found[name] = 0.5 + way * along;
  }
}

void measure_ends_of_tibia(const BoneView& view, double tip, Values& found) {
  const double length = found["length_mm"];
  const double plafond = 0.1 * length - view.reach_mm({2.0, 0.0, tip + 0.1 * length}, -Vec3::UnitZ());
  found["malleolus_mm"] = plafond;
  // The shaft is as deep behind its axis as before it, but for the tuberosity.
  double stands_out = -1e9;
  for (double z = tip + 0.86 * length; z < tip + 0.92 * length; z += 0.5)
    stands_out = std::max(stands_out,
                          view.reach_mm({0.0, 0.0, z}, Vec3::UnitY()) - view.reach_mm({0.0, 0.0, z}, -Vec3::UnitY()));
  found["tuberosity_mm"] = stands_out;
}

void measure_fibula(const BoneView& view, const LegPoints& points, Values& found) {
  const std::vector<Vec3>& fibula = points.fibula;
  const Extent height = extent_of(fibula, 2);
  found["fibula_length_mm"] = height.size();
  const double middle = 0.5 * (height.least + height.most);
  const std::vector<Vec3> ring = points_between(fibula, middle - 1.0, middle + 1.0);
  found["fibula_width_mm"] = extent_of(ring, 1).size();
  const Vec3 inside(0.5 * (extent_of(ring, 0).least + extent_of(ring, 0).most),
                    0.5 * (extent_of(ring, 1).least + extent_of(ring, 1).most), middle);
  found["fibula_cortex_mm"] =
      0.5 * (view.cortex_mm(inside, Vec3::UnitY(), 6.0) + view.cortex_mm(inside, -Vec3::UnitY(), 6.0));
  found["fibula_head_mm"] = 2.0 * fitted_ball(points_between(fibula, height.most - 4.0, height.most + 1.0)).radius;
  // Only points that are nearly as high can be nearest to each other.
  constexpr double kHigher_mm = 8.0;
  std::vector<Vec3> tibia = points.tibia;
  const auto z_of = [](const Vec3& p) { return p.z(); };
  std::ranges::sort(tibia, {}, z_of);
  double gap = 1e9;
  for (const auto& [low, high] : {std::pair{height.least, height.least + 60.0}, {height.most - 60.0, height.most}})
    for (const Vec3& f : points_between(fibula, low, high))
      for (auto t = std::ranges::upper_bound(tibia, f.z() - kHigher_mm, {}, z_of);
           t != tibia.end() && t->z() < f.z() + kHigher_mm; ++t)
        gap = std::min(gap, (*t - f).squaredNorm());
  found["gap_mm"] = std::sqrt(gap);
}

void measure_inside_of_tibia(const BoneView& view, double tip, Values& found) {
  const Vec3 middle(0.0, 0.0, tip + 0.5 * found["length_mm"]);
  const double reach = view.reach_mm(middle, Vec3::UnitY());
  found["cortical_g_cm3"] = view.density_g_cm3(middle + (reach - 0.5 * found["cortex_50_mm"]) * Vec3::UnitY());
  const double aside = 0.28 * found["plateau_width_mm"], deep = 0.22 * found["plateau_depth_mm"];
  double sum = 0.0, squares = 0.0;
  int count = 0;
  // At samples: between them, densities are means of theirs.
  const auto samples = [&](double mm) { return static_cast<int>(mm / view.pitch_mm()); };
  for (int x = samples(-aside); x <= samples(aside); ++x)
    for (int y = samples(-deep); y <= samples(deep); ++y)
      for (int z = samples(-0.065 * found["length_mm"]); z <= samples(-8.0); ++z, ++count) {
        const double density = view.density_g_cm3(view.pitch_mm() * Vec3(x, y, z));
        sum += density;
        squares += density * density;
      }
  const double mean = sum / count;
  found["cancellous_g_cm3"] = mean;
  // Noise between lattice points, interpolated with smooth weights, has this deviation.
  constexpr double kDeviation = 0.3698;
  found["texture"] = std::sqrt(squares / count - mean * mean) / mean / kDeviation;
}

void expect_measured_tibia(const BoneRecipe& recipe) {
  const auto bone = bone_of(recipe);
  const auto made = build_phantom_case(*bone, {.pitch_mm = 0.6, .title = "Tibia", .calibration = {0.001067, 0.131}},
                                       [](double) { return true; });
  ASSERT_TRUE(made) << made.error().message;
  const BoneView view(made->bone, recipe.side);
  const LegPoints points = leg_points(made->bone, view);
  const double tip = extent_of(points.tibia, 2).least;
  Values found;
  const std::vector<Vec3> upper = points_between(points.tibia, -11.5, -8.0);
  found["plateau_width_mm"] = extent_of(upper, 0).size();
  found["plateau_depth_mm"] = extent_of(upper, 1).size();
  measure_plateau(view, points.tibia, found);
  measure_shaft_of_tibia(view, tip, found);
  measure_ends_of_tibia(view, tip, found);
  measure_fibula(view, points, found);
  measure_inside_of_tibia(view, tip, found);
  for (const NamedValue& parameter : bone->parameters()) {
    const std::string& name = parameter.name;
    if (name == "cartilage_mm") continue;  // not in the bone; structures_test.cpp measures it
    ASSERT_TRUE(found.contains(name)) << name << " is not measured";
    std::printf("[          ] %-18s %8.3f, measured %8.3f\n", name.c_str(), parameter.value, found[name]);
    double tolerance = 0.02 * parameter.value;
    if (name == "slope_degrees") tolerance = 0.5;
    if (name == "texture") tolerance = 0.05 * parameter.value;  // there are some thousand grains only
    if (name == "tuberosity_mm") tolerance = 0.2;               // it blends with the shaft
    if (name == "gap_mm") {
      EXPECT_GE(found[name], parameter.value - 0.05);  // the bones are at least so far apart
    } else {
      EXPECT_NEAR(found[name], parameter.value, tolerance) << name;
    }
  }
}

TEST(MeasuredTibia, AMansLeftTibiaHasItsParameters) { expect_measured_tibia({.kind = "tibia"}); }

TEST(MeasuredTibia, AnOldWomansRightTibiaHasItsParameters) {
  expect_measured_tibia({.kind = "tibia",
                         .side = Side::right,
                         .preset = "female",
                         .condition = "osteoporotic",
                         .changes = {{"slope_degrees", 10.0}, {"gap_mm", 4.0}, {"malleolus_mm", 15.0}}});
}

}  // namespace
}  // namespace osteon::phantoms
