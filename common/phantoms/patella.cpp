#include "common/phantoms/patella.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "common/phantoms/structures.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kPatellaDegree = std::numbers::pi / 180.0;
// Shapes without a parameter. [A], by the look of real bones.
constexpr double kDome = 1.25;  // radius of the front, as a part of height and width
constexpr double kApexSize = 0.15, kSideSize = 0.21, kBaseSize = 0.42;  // radii, as parts of height and width
constexpr double kWidestHeight = 0.16;                                  // above the middle, as a part of the height
constexpr double kEdgeBlend = 0.4;  // of the thickness beside it: how far an edge is rounded
constexpr double kRidgeBlend = 3.0;
constexpr double kPoleFrom = -0.25, kPoleDegrees = 38.0;  // the back of the apex, which has no cartilage
constexpr double kThinnestRim = 0.14;                     // of the thickness
constexpr double kPatellaGrain_mm = 1.5;
constexpr double kNoMarrow_mm = 1e3;  // farther than any point of the bone from it

using PatellaField = ParameterField<PatellaParameters>;
using K = PatellaParameters;
constexpr PatellaField kPatellaFields[] = {
    {"height_mm", &K::height_mm, 28.0, 62.0},
    {"width_mm", &K::width_mm, 28.0, 64.0},
    {"thickness_mm", &K::thickness_mm, 12.0, 34.0},
    {"facets_degrees", &K::facets_degrees, 110.0, 160.0},
    {"ridge_mm", &K::ridge_mm, 0.0, 9.0},
    {"shell_mm", &K::shell_mm, 0.6, 4.0},
    {"cartilage_mm", &K::cartilage_mm, 0.5, 7.0},
    {"cortical_g_cm3", &K::cortical_g_cm3, 1.5, 2.1},
    {"cancellous_g_cm3", &K::cancellous_g_cm3, 0.05, 0.95},
    {"texture", &K::texture, 0.0, 0.5},
};

PatellaParameters patella_preset(std::string_view name) {
  PatellaParameters p;
  // As much smaller or larger than the mean as the femur of that preset.
  if (name == "female" || name == "small") scale_lengths<PatellaParameters>(p, kPatellaFields, 38.844 / 41.978);
  if (name == "small") scale_lengths<PatellaParameters>(p, kPatellaFields, 341.0 / 388.4);
  if (name == "large") scale_lengths<PatellaParameters>(p, kPatellaFields, 483.0 / 419.8);
  return p;
}

double dome_radius(const PatellaParameters& p) { return kDome * std::max(p.height_mm, p.width_mm); }

// Where the front and the back are, along y, before the edges are rounded.
double front_y(const PatellaParameters& p, double x, double z) {
  const double radius = dome_radius(p);
  return 0.5 * p.thickness_mm - radius + std::sqrt(std::max(0.0, radius * radius - x * x - z * z));
}
double back_y(const PatellaParameters& p, double x, double z) {
  const double rise = 1.0 / std::tan(0.5 * p.facets_degrees * kPatellaDegree);
  const double facets = rise * std::abs(x + p.ridge_mm);
  const double pole = std::tan(kPoleDegrees * kPatellaDegree) * (kPoleFrom * p.height_mm - z);
  return -0.5 * p.thickness_mm + std::max(facets, pole);
}

double thickness_at(const PatellaParameters& p, double x, double z) { return front_y(p, x, z) - back_y(p, x, z); }

// Where the outline is widest and highest.
double rim_mm(const PatellaParameters& p) {
  const double h = 0.5 * p.height_mm, w = 0.5 * p.width_mm, z = kWidestHeight * p.height_mm;
  return std::min({thickness_at(p, 0.0, -h), thickness_at(p, 0.0, h), thickness_at(p, -w, z), thickness_at(p, w, z)});
}

}  // namespace

std::span<const ParameterField<PatellaParameters>> patella_fields() { return kPatellaFields; }

Result<void> check_patella(const PatellaParameters& p) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  // As much thicker as the thinnest part of the rim is too thin.
  const double thickness_mm = (p.thickness_mm - rim_mm(p)) / (1.0 - kThinnestRim);
  const DependentLimit limits[] = {
      {"width_mm", 0.75 * p.height_mm, 1.35 * p.height_mm, "height_mm"},
      {"ridge_mm", -kNoLimit, 0.15 * p.width_mm, "width_mm"},
      {"thickness_mm", thickness_mm, 0.8 * std::min(p.height_mm, p.width_mm),
       "height_mm, width_mm, ridge_mm and facets_degrees"},
      {"shell_mm", -kNoLimit, 0.15 * p.thickness_mm, "thickness_mm"},
  };
  return check_parameters<PatellaParameters>(p, kPatellaFields, limits);
}

Result<PatellaParameters> patella_parameters(const BoneRecipe& recipe) {
  PatellaParameters p = patella_preset(recipe.preset);
  const ConditionFactors factors = factors_of(recipe.condition);
  p.shell_mm *= factors.cortex;
  p.cancellous_g_cm3 *= factors.cancellous;
  if (auto changed = change<PatellaParameters>(p, kPatellaFields, recipe.changes); !changed)
    return tl::unexpected(changed.error());
  if (auto good = check_patella(p); !good) return tl::unexpected(good.error());
  return p;
}

Patella::Patella(const PatellaParameters& parameters, Side side)
    : p_(parameters), side_(side == Side::left ? 1.0 : -1.0), rim_mm_(rim_mm(parameters)) {
  const double h = p_.height_mm, w = p_.width_mm, z = kWidestHeight * h, base = kBaseSize * std::min(h, w);
  outline_ = {Disc{0.0, (kApexSize - 0.5) * h, kApexSize * h}, Disc{(0.5 - kSideSize) * w, z, kSideSize * w},
              Disc{0.0, 0.5 * h - base, base}, Disc{(kSideSize - 0.5) * w, z, kSideSize * w}};
  for (std::size_t i = 0; i < outline_.size(); ++i) {
    Disc& a = outline_[i];
    const Disc& b = outline_[(i + 1) % outline_.size()];
    const double dx = b.x - a.x, dz = b.z - a.z, length = std::hypot(dx, dz);
    // The tangent's normal n has n · (b - a) = radius of a - radius of b.
    const double along = (a.radius - b.radius) / length, across = std::sqrt(1.0 - along * along);
    a.normal_x = (along * dx + across * dz) / length;
    a.normal_z = (along * dz - across * dx) / length;
  }
}

// Distance to the hull of the circles: to the tangent that the point is farthest beyond, or to the circle between two
// tangents.
double Patella::outline_mm(double x, double z) const {
  double farthest = -std::numeric_limits<double>::infinity();
  const Disc* before = &outline_.back();
  for (const Disc& disc : outline_) {
    const double dx = x - disc.x, dz = z - disc.z;
    if (before->normal_x * dz - before->normal_z * dx >= 0.0 && disc.normal_x * dz - disc.normal_z * dx <= 0.0)
      return std::hypot(dx, dz) - disc.radius;
    farthest = std::max(farthest, disc.normal_x * dx + disc.normal_z * dz - disc.radius);
    before = &disc;
  }
  return farthest;
}

double Patella::surface_mm(const Vec3& at) const {
  const double half = 0.5 * p_.facets_degrees * kPatellaDegree, tilt = kPoleDegrees * kPatellaDegree;
  const double behind = -0.5 * p_.thickness_mm - at.y(), aside = at.x() + p_.ridge_mm;
  // Where both facets meet, rounding takes away a quarter of its width. They meet as much farther behind.
  const double facet = behind * std::sin(half) - 0.25 * kRidgeBlend;
  double back = smooth_max(facet + aside * std::cos(half), facet - aside * std::cos(half), kRidgeBlend);
  back = smooth_max(back, behind * std::cos(tilt) + (kPoleFrom * p_.height_mm - at.z()) * std::sin(tilt), kRidgeBlend);
  const double radius = dome_radius(p_);
  const double front = ball_mm(at, {0.0, 0.5 * p_.thickness_mm - radius, 0.0}, radius);
  const double blend = kEdgeBlend * std::clamp(thickness_at(p_, at.x(), at.z()), rim_mm_, p_.thickness_mm);
  return smooth_max(smooth_max(outline_mm(at.x(), at.z()), front, blend), back, blend);
}

std::vector<NamedValue> Patella::parameters() const { return values_of<PatellaParameters>(p_, kPatellaFields); }

BoneDepths Patella::depths(const Vec3& at_mm) const {
  BoneDepths depths;
  depths.surface_mm = surface_mm(own(at_mm));
  depths.cortex_mm = depths.surface_mm + p_.shell_mm;
  depths.marrow_mm = kNoMarrow_mm;
  return depths;
}

double Patella::cancellous_g_cm3(const Vec3& at_mm) const {
  return p_.cancellous_g_cm3 * (1.0 + p_.texture * grain_noise(own(at_mm), kPatellaGrain_mm));
}

BoneAnatomy Patella::anatomy() const {
  const auto middle = [&](double z) { return Vec3(0.0, 0.5 * (front_y(p_, 0.0, z) + back_y(p_, 0.0, z)), z); };
  const Vec3 ridge(-p_.ridge_mm, -0.5 * p_.thickness_mm, 0.0);
  BoneAnatomy found;
  found.landmarks = {{"patellar apex", world(middle(-0.5 * p_.height_mm))},
                     {"patellar base", world(middle(0.5 * p_.height_mm))},
                     {"patellar ridge", world(ridge)}};
  found.axes = {{"patellar ridge", world(ridge), Vec3::UnitZ()}};
  return found;
}

std::vector<Structure> Patella::structures() const {
  constexpr double kFromOutline = 0.08;  // where the joint face ends, as a part of the width
  const auto joint_face = [this](const Vec3& at_mm) {
    const Vec3 at = own(at_mm);
    const double middle = 0.5 * (front_y(p_, at.x(), at.z()) + back_y(p_, at.x(), at.z()));
    return std::max(
        {outline_mm(at.x(), at.z()) + kFromOutline * p_.width_mm, kPoleFrom * p_.height_mm - at.z(), at.y() - middle});
  };
  return {cartilage(
      "patellar cartilage", p_.cartilage_mm, bounds().grown(p_.cartilage_mm),
      [this](const Vec3& at) { return surface_mm(own(at)); }, joint_face)};
}

Box Patella::bounds() const {
  const Vec3 half = 0.5 * Vec3(p_.width_mm, p_.thickness_mm, p_.height_mm);
  return Box{-half, half}.grown(1.0);
}

}  // namespace osteon::phantoms
