#include "common/phantoms/femur.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "common/geometry/triangle_distance.hpp"
#include "common/phantoms/structures.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
// Widths in which parts grow together, mm. [A]
constexpr double kNeckBlend = 10.0, kHeadBlend = 4.0, kTrochanterBlend = 9.5, kLesserBlend = 5.0, kCondyleBlend = 10.0,
                 kTrochleaBlend = 6.0, kEpicondyleBlend = 2.5, kEndBlend = 8.0;
// Sizes of parts without a parameter, as parts of the head's radius or of the medial condyle's. [A], by the look of
// real bones.
constexpr double kTrochanterSize = 0.75, kTrochanterTipSize = 0.42, kLesserSize = 0.45, kLesserProminence = 0.33;
constexpr double kEpicondyleSize = 0.45, kTrochleaSize = 0.7, kGroove = 0.25, kCondyleLift = 0.15;
constexpr double kIsthmus = 0.52;     // where the neck is narrowest, as a part of its length from the shaft
constexpr double kNeckFlare = 1.3;    // how much it widens towards the shaft
constexpr double kLesserTurn = 45.0;  // degrees by which the lesser trochanter lies behind medial
constexpr double kFlarePart = 0.09, kFlareWidth = 1.3, kFlareDepth = 1.0;  // of the shaft above the condyles
constexpr double kHiatus = 0.26;     // where the femoral artery passes behind the shaft, as a part of the length
constexpr double kHollow_mm = 50.0;  // that vessels and nerves span
constexpr double kGrain_mm = 1.5;    // of the texture

using Field = ParameterField<FemurParameters>;
using P = FemurParameters;
constexpr Field kFields[] = {
    {"length_mm", &P::length_mm, 300.0, 540.0},
    {"head_diameter_mm", &P::head_diameter_mm, 32.0, 60.0},
    {"neck_shaft_degrees", &P::neck_shaft_degrees, 115.0, 140.0},
    {"anteversion_degrees", &P::anteversion_degrees, 0.0, 30.0},
    {"offset_mm", &P::offset_mm, 28.0, 60.0},
    {"neck_height_mm", &P::neck_height_mm, 20.0, 48.0},
    {"neck_depth_mm", &P::neck_depth_mm, 16.0, 44.0},
    {"proximal_width_mm", &P::proximal_width_mm, 65.0, 125.0},
    {"trochanter_height_mm", &P::trochanter_height_mm, -15.0, 15.0},
    {"trochanters_mm", &P::trochanters_mm, 42.0, 98.0},
    {"shaft_valgus_degrees", &P::shaft_valgus_degrees, 2.0, 13.0},
    {"shaft_lateral_mm", &P::shaft_lateral_mm, -6.0, 8.0},
    {"shaft_forward_mm", &P::shaft_forward_mm, 10.0, 45.0},
    {"bow_radius_mm", &P::bow_radius_mm, 500.0, 2500.0},
    {"bow_apex", &P::bow_apex, 0.15, 0.7},
    {"width_15_mm", &P::width_15_mm, 26.0, 58.0},
    {"depth_15_mm", &P::depth_15_mm, 24.0, 50.0},
    {"cortex_15_mm", &P::cortex_15_mm, 1.0, 6.0},
    {"width_25_mm", &P::width_25_mm, 20.0, 44.0},
    {"depth_25_mm", &P::depth_25_mm, 20.0, 44.0},
    {"cortex_25_mm", &P::cortex_25_mm, 1.5, 9.0},
    {"width_40_mm", &P::width_40_mm, 18.0, 40.0},
    {"depth_40_mm", &P::depth_40_mm, 18.0, 42.0},
    {"cortex_40_mm", &P::cortex_40_mm, 2.0, 11.0},
    {"width_55_mm", &P::width_55_mm, 18.0, 40.0},
    {"depth_55_mm", &P::depth_55_mm, 18.0, 42.0},
    {"cortex_55_mm", &P::cortex_55_mm, 2.0, 11.0},
    {"width_74_mm", &P::width_74_mm, 18.0, 42.0},
    {"depth_74_mm", &P::depth_74_mm, 18.0, 42.0},
    {"cortex_74_mm", &P::cortex_74_mm, 2.0, 11.0},
    {"width_80_mm", &P::width_80_mm, 20.0, 48.0},
    {"depth_80_mm", &P::depth_80_mm, 18.0, 44.0},
    {"cortex_80_mm", &P::cortex_80_mm, 1.5, 9.0},
    {"shell_mm", &P::shell_mm, 0.6, 4.0},
    {"marrow_from", &P::marrow_from, 0.16, 0.4},
    {"marrow_to", &P::marrow_to, 0.6, 0.82},
    {"bicondylar_width_mm", &P::bicondylar_width_mm, 58.0, 106.0},
    {"condyle_depth_mm", &P::condyle_depth_mm, 42.0, 80.0},
    {"medial_condyle_radius_mm", &P::medial_condyle_radius_mm, 14.0, 28.0},
    {"lateral_condyle_radius_mm", &P::lateral_condyle_radius_mm, 14.0, 28.0},
    {"condyle_width_mm", &P::condyle_width_mm, 18.0, 36.0},
    {"notch_width_mm", &P::notch_width_mm, 12.0, 30.0},
    {"cartilage_mm", &P::cartilage_mm, 0.5, 6.0},
    {"cortical_g_cm3", &P::cortical_g_cm3, 1.5, 2.1},
    {"cancellous_g_cm3", &P::cancellous_g_cm3, 0.05, 0.8},
    {"compressive_g_cm3", &P::compressive_g_cm3, 0.05, 0.95},
    {"tensile_g_cm3", &P::tensile_g_cm3, 0.05, 0.95},
    {"marrow_g_cm3", &P::marrow_g_cm3, 0.02, 0.2},
    {"texture", &P::texture, 0.0, 0.5},
};

struct Station {
  const char* name;
  double P::*width;
  double P::*depth;
  double P::*cortex;
};
constexpr Station kStations[] = {
    {"cortex_15_mm", &P::width_15_mm, &P::depth_15_mm, &P::cortex_15_mm},
    {"cortex_25_mm", &P::width_25_mm, &P::depth_25_mm, &P::cortex_25_mm},
    {"cortex_40_mm", &P::width_40_mm, &P::depth_40_mm, &P::cortex_40_mm},
    {"cortex_55_mm", &P::width_55_mm, &P::depth_55_mm, &P::cortex_55_mm},
    {"cortex_74_mm", &P::width_74_mm, &P::depth_74_mm, &P::cortex_74_mm},
    {"cortex_80_mm", &P::width_80_mm, &P::depth_80_mm, &P::cortex_80_mm},
};
static_assert(std::size(kStations) == kFemurStations.size());

// The means of women where a source has them, otherwise those of men scaled by the ratio of a like length.
FemurParameters female() {
  FemurParameters p;
  scale_lengths<FemurParameters>(p, kFields, 38.844 / 41.978);
  p.length_mm = 388.4;
  p.head_diameter_mm = 42.0;
  p.neck_shaft_degrees = 123.0;
  p.anteversion_degrees = 16.4;
  p.offset_mm = 39.4;
  p.neck_height_mm = 30.0;
  p.neck_depth_mm = 24.7;
  p.proximal_width_mm = 87.8;
  p.trochanters_mm = 59.9;
  for (const Station& station : kStations) p.*station.cortex *= 0.9;
  p.bow_radius_mm = 943.0;
  p.bicondylar_width_mm = 74.1;
  p.condyle_depth_mm = 55.9;
  p.medial_condyle_radius_mm = 20.1;
  p.lateral_condyle_radius_mm = 19.2;
  p.condyle_width_mm = 24.1;
  p.notch_width_mm = 18.7;
  return p;
}

// The shortest woman's and the longest man's femur of Noussios 2019, in the proportions of the mean.
FemurParameters preset(std::string_view name) {
  const bool is_female = name == "female" || name == "small";
  FemurParameters p = is_female ? female() : FemurParameters{};
  if (name == "small") scale_lengths<FemurParameters>(p, kFields, 341.0 / p.length_mm);
  if (name == "large") scale_lengths<FemurParameters>(p, kFields, 483.0 / p.length_mm);
  return p;
}

double squared_distance(const Vec3& at, const Vec3& a, const Vec3& b) {
  return squared_distance_to_segment<double>(at, a, b);
}

// Half of a width along the shaft. It is `flare` times as large at `flare_along`, below the first station.
Profile half_profile(const std::array<double, kFemurStations.size()>& along, const FemurParameters& p,
                     double P::*Station::*member, double flare_along, double flare) {
  std::vector<Profile::Point> points{{flare_along, 0.5 * flare * (p.*(kStations[0].*member))}};
  for (std::size_t i = 0; i < along.size(); ++i) points.push_back({along[i], 0.5 * (p.*(kStations[i].*member))});
  return Profile(std::move(points));
}

}  // namespace

std::span<const ParameterField<FemurParameters>> femur_fields() { return kFields; }

Result<void> check_femur(const FemurParameters& p) {
  const double large = std::max(p.medial_condyle_radius_mm, p.lateral_condyle_radius_mm);
  const double small = std::min(p.medial_condyle_radius_mm, p.lateral_condyle_radius_mm);
  const double condyles_mm = p.notch_width_mm + 2.0 * p.condyle_width_mm;
  // A neck that leaves the shaft before it meets the head.
  const double least_offset_mm =
      (0.5 * p.width_80_mm + 0.55 * p.head_diameter_mm) * std::sin(p.neck_shaft_degrees * kRadians);
  // Where the lateral face of the shaft would be beside the neck, as far from the medial face of the head.
  const double beside_mm = p.offset_mm + 0.5 * p.head_diameter_mm + 0.5 * p.width_80_mm;
  // The shaft ends behind the front of the condyles.
  const double from_apex_mm = (p.bow_apex - kFlarePart) * p.length_mm;
  const double front_mm = p.condyle_depth_mm - p.medial_condyle_radius_mm - 0.5 * kFlareDepth * p.depth_15_mm +
                          from_apex_mm * from_apex_mm / (2.0 * p.bow_radius_mm);
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  std::vector<DependentLimit> limits;
  for (const Station& s : kStations)
    limits.push_back({s.name, -kNoLimit, 0.38 * std::min(p.*s.width, p.*s.depth), "the shaft's width and depth there"});
  const DependentLimit others[] = {
      {"neck_height_mm", -kNoLimit, 0.9 * p.head_diameter_mm, "head_diameter_mm"},
      {"neck_depth_mm", -kNoLimit, p.neck_height_mm, "neck_height_mm"},
      {"offset_mm", least_offset_mm, kNoLimit, "neck_shaft_degrees, head_diameter_mm and width_80_mm"},
      {"proximal_width_mm", beside_mm - 8.0, beside_mm + 22.0, "offset_mm, head_diameter_mm and width_80_mm"},
      {"lateral_condyle_radius_mm", p.medial_condyle_radius_mm - 4.0, p.medial_condyle_radius_mm + 4.0,
       "medial_condyle_radius_mm"},
      {"condyle_width_mm", -kNoLimit, 1.5 * small, "the condyles' radii"},
      {"condyle_depth_mm", 2.3 * large, 3.8 * small, "the condyles' radii"},
      {"bicondylar_width_mm", condyles_mm + 2.0 * kEpicondyleBlend, condyles_mm + 20.0,
       "notch_width_mm and condyle_width_mm"},
      {"shaft_forward_mm", front_mm - 22.0, front_mm + 2.0, "condyle_depth_mm, depth_15_mm and the bow"},
      {"trochanters_mm", 1.1 * p.head_diameter_mm, 0.24 * p.length_mm, "head_diameter_mm and length_mm"},
  };
  limits.insert(limits.end(), std::begin(others), std::end(others));
  return check_parameters<FemurParameters>(p, kFields, limits);
}

Result<FemurParameters> femur_parameters(const BoneRecipe& recipe) {
  FemurParameters p = preset(recipe.preset);
  const ConditionFactors factors = factors_of(recipe.condition);
  for (const Station& station : kStations) p.*station.cortex *= factors.cortex;
  p.shell_mm *= factors.cortex;
  for (double P::*const density : {&P::cancellous_g_cm3, &P::compressive_g_cm3, &P::tensile_g_cm3})
    p.*density *= factors.cancellous;
  if (auto changed = change<FemurParameters>(p, kFields, recipe.changes); !changed)
    return tl::unexpected(changed.error());
  if (auto good = check_femur(p); !good) return tl::unexpected(good.error());
  return p;
}

Femur::Femur(const FemurParameters& parameters, Side side)
    : p_(parameters), side_(side == Side::left ? 1.0 : -1.0), head_radius_mm_(0.5 * parameters.head_diameter_mm) {
  place_shaft();
  place_hip();
  place_trabeculae();
}

double Femur::height_of(double part_of_length) const {
  return (part_of_length * p_.length_mm - p_.medial_condyle_radius_mm) / up_.z();
}

Vec3 Femur::shaft_centre(double along) const {
  const double from_apex = along - height_of(p_.bow_apex);
  const double forward = p_.shaft_forward_mm - from_apex * from_apex / (2.0 * p_.bow_radius_mm);
  return along * up_ + p_.shaft_lateral_mm * lateral_ + forward * Vec3::UnitY();
}

void Femur::place_shaft() {
  const double valgus = p_.shaft_valgus_degrees * kRadians;
  up_ = {std::sin(valgus), 0.0, std::cos(valgus)};
  lateral_ = {std::cos(valgus), 0.0, -std::sin(valgus)};
  std::array<double, kFemurStations.size()> along{};
  for (std::size_t i = 0; i < along.size(); ++i) along[i] = height_of(kFemurStations[i]);
  half_width_ = half_profile(along, p_, &Station::width, height_of(kFlarePart), kFlareWidth);
  half_depth_ = half_profile(along, p_, &Station::depth, height_of(kFlarePart), kFlareDepth);
  std::vector<Profile::Point> cortex{{height_of(0.04), p_.shell_mm}};
  for (std::size_t i = 0; i < along.size(); ++i) cortex.push_back({along[i], p_.*kStations[i].cortex});
  cortex.push_back({height_of(0.9), p_.shell_mm});
  cortex_ = Profile(std::move(cortex));

  // Both condyles end at the same height below, and equally far behind. Their anterior circles lie a little higher, so
  // the posterior ones touch the plane.
  const double r = p_.medial_condyle_radius_mm, l = p_.lateral_condyle_radius_mm;
  const double x = 0.5 * (p_.notch_width_mm + p_.condyle_width_mm);
  medial_ = {-x, r, Vec3::Zero(), {0.0, p_.condyle_depth_mm - 2.0 * r, kCondyleLift * r}};
  lateral_condyle_ = {x, l, {0.0, l - r, l - r}, {0.0, p_.condyle_depth_mm - r - l, l - r + kCondyleLift * l}};
  trochlea_ = {0.0, p_.condyle_depth_mm - r - kGroove * r - kTrochleaSize * r, 0.5 * r};
  bottom_ = 0.35 * r;
}

void Femur::place_hip() {
  const double angle = p_.neck_shaft_degrees * kRadians, turn = p_.anteversion_degrees * kRadians;
  neck_ = -std::cos(angle) * up_ + std::sin(angle) * (-std::cos(turn) * lateral_ + std::sin(turn) * Vec3::UnitY());
  neck_up_ = (up_ - up_.dot(neck_) * neck_).normalized();
  neck_front_ = neck_up_.cross(neck_);
  neck_length_mm_ = p_.offset_mm / std::sin(angle);
  const double radius = head_radius_mm_;
  const double head_z = p_.length_mm - p_.medial_condyle_radius_mm - radius;
  const auto along_at = [&](double z) { return (z - p_.shaft_lateral_mm * lateral_.z()) / up_.z(); };
  neck_base_ = shaft_centre(along_at(head_z - neck_length_mm_ * neck_.z()));
  head_ = neck_base_ + neck_length_mm_ * neck_;
  top_ = along_shaft(neck_base_) + 0.25 * radius;

  const double trochanter_z = head_z + p_.trochanter_height_mm;
  trochanter_ = {head_.x() - radius + p_.proximal_width_mm - kTrochanterSize * radius, neck_base_.y() - 0.25 * radius,
                 neck_base_.z() + 0.1 * radius};
  trochanter_tip_ = {trochanter_.x() - 0.2 * radius, neck_base_.y() - 0.55 * radius,
                     trochanter_z - kTrochanterTipSize * radius};
  // The lesser trochanter stands on the shaft. Its tip is a little higher than the shaft's axis there, and how far away
  // depends on the shaft's section.
  const double behind = kLesserTurn * kRadians;
  const Vec3 out = -std::cos(behind) * lateral_ - std::sin(behind) * Vec3::UnitY();
  double tip = 0.0;
  for (int round = 0; round < 20; ++round) {
    const double along = along_at(trochanter_z - p_.trochanters_mm - tip * out.z());
    const double shaft = 1.0 / std::hypot(std::cos(behind) / half_width_(along), std::sin(behind) / half_depth_(along));
    tip = shaft + kLesserProminence * radius;
    lesser_tip_ = shaft_centre(along) + tip * out;
  }
  lesser_ = lesser_tip_ - kLesserSize * radius * out;
}

void Femur::place_trabeculae() {
  // The principal compressive group goes from the medial cortex below the neck to the top of the head. The tensile one
  // arches from the lateral cortex through the upper neck into the lower part of the head.
  const double radius = head_radius_mm_, half = half_width_(along_shaft(neck_base_));
  compressive_from_ = neck_base_ - 0.75 * half * lateral_ - 8.0 * up_;
  compressive_to_ = head_ + 0.8 * radius * Vec3::UnitZ();
  const Vec3 from = neck_base_ + 0.75 * half * lateral_ - 10.0 * up_;
  const Vec3 above = neck_base_ + 0.45 * neck_length_mm_ * neck_ + 1.1 * radius * neck_up_;
  const Vec3 to = head_ - 0.35 * radius * neck_up_ + 0.5 * radius * neck_;
  constexpr int kParts = 12;
  for (int i = 0; i <= kParts; ++i) {
    const double t = static_cast<double>(i) / kParts, s = 1.0 - t;
    tensile_.emplace_back(s * s * from + 2.0 * s * t * above + t * t * to);
  }
}

double Femur::shaft_mm(const Vec3& at) const {
  const double along = along_shaft(at);
  const Vec3 from_centre = at - shaft_centre(along);
  const double across = ellipse_mm(from_centre.dot(lateral_), from_centre.y(), half_width_(along), half_depth_(along));
  return smooth_max(smooth_max(across, bottom_ - along, kEndBlend), along - top_, kEndBlend);
}

double Femur::neck_mm(const Vec3& at) const {
  const Vec3 from = at - neck_base_;
  const double along = from.dot(neck_);
  const double short_of = std::clamp(kIsthmus - along / neck_length_mm_, 0.0, 1.0);
  const double scale = 1.0 + kNeckFlare * short_of * short_of;
  const double across = ellipse_mm(from.dot(neck_up_), from.dot(neck_front_), 0.5 * scale * p_.neck_height_mm,
                                   0.5 * scale * p_.neck_depth_mm);
  return smooth_max(smooth_max(across, -4.0 - along, kEndBlend), along - neck_length_mm_, kEndBlend);
}

double Femur::condyle_mm(const Condyle& condyle, const Vec3& at) const {
  const double half = 0.5 * p_.condyle_width_mm, inner = condyle.radius_mm - half;
  const double in_plane = round_cone_mm({0.0, at.y(), at.z()}, condyle.posterior, inner, condyle.anterior, inner);
  const double beyond = std::max(0.0, in_plane), beside = at.x() - condyle.x;
  return std::sqrt(beyond * beyond + beside * beside) - half;
}

Vec3 Femur::epicondyle(const Condyle& condyle) const {
  return {std::copysign(0.5 * p_.bicondylar_width_mm, condyle.x), 0.25 * condyle.radius_mm, 0.25 * condyle.radius_mm};
}

double Femur::proximal_mm(const Vec3& at, double shaft) const {
  const double radius = head_radius_mm_;
  double d = smooth_min(shaft, neck_mm(at), kNeckBlend);
  d = smooth_min(d, ball_mm(at, head_, radius), kHeadBlend);
  d = smooth_min(d,
                 round_cone_mm(at, trochanter_, kTrochanterSize * radius, trochanter_tip_, kTrochanterTipSize * radius),
                 kTrochanterBlend);
  return smooth_min(d, ball_mm(at, lesser_, kLesserSize * radius), kLesserBlend);
}

double Femur::distal_mm(const Vec3& at, double shaft) const {
  const double r = p_.medial_condyle_radius_mm;
  const Vec3 across = medial_.x * Vec3::UnitX();
  const double trochlea = std::sqrt(squared_distance(at, trochlea_ + across, trochlea_ - across)) - kTrochleaSize * r;
  double d = std::min(condyle_mm(medial_, at), condyle_mm(lateral_condyle_, at));
  d = smooth_min(smooth_min(d, trochlea, kTrochleaBlend), shaft, kCondyleBlend);
  for (const Condyle* condyle : {&medial_, &lateral_condyle_}) {
    const double size = kEpicondyleSize * r;
    const Vec3 centre = epicondyle(*condyle) - Vec3(std::copysign(size, condyle->x), 0.0, 0.0);
    d = smooth_min(d, ball_mm(at, centre, size), kEpicondyleBlend);
  }
  return d;
}

double Femur::surface_mm(const Vec3& at) const {
  const double shaft = shaft_mm(at);
  // The ends are far beyond each other's reach.
  return at.z() > 0.45 * p_.length_mm ? proximal_mm(at, shaft) : distal_mm(at, shaft);
}

std::vector<std::string> Femur::names() const { return {"femur"}; }

std::vector<NamedValue> Femur::parameters() const { return values_of<FemurParameters>(p_, kFields); }

BoneDepths Femur::depths(const Vec3& at_mm) const {
  const Vec3 at = own(at_mm);
  const double along = along_shaft(at);
  BoneDepths depths;
  depths.surface_mm = surface_mm(at);
  depths.cortex_mm = depths.surface_mm + cortex_(along);
  depths.marrow_mm = std::max({depths.cortex_mm, height_of(p_.marrow_from) - along, along - height_of(p_.marrow_to)});
  return depths;
}

double Femur::cancellous_g_cm3(const Vec3& at_mm) const {
  const Vec3 at = own(at_mm);
  const double along = along_shaft(at);
  // Densest at the ends; it thins out towards the marrow.
  const double near_end = std::max(1.0 - smooth_step(along, height_of(0.08), height_of(p_.marrow_from)),
                                   smooth_step(along, height_of(p_.marrow_to), height_of(0.88)));
  double density = p_.cancellous_g_cm3 * (0.85 + 0.15 * near_end);
  if (along > height_of(0.7)) {
    const auto group = [&](double squared_mm2, double width_mm) {
      return std::exp(-0.5 * squared_mm2 / (width_mm * width_mm));
    };
    double nearest = squared_distance(at, tensile_[0], tensile_[1]);
    for (std::size_t i = 1; i + 1 < tensile_.size(); ++i)
      nearest = std::min(nearest, squared_distance(at, tensile_[i], tensile_[i + 1]));
    const double tensile = group(nearest, 0.16 * head_radius_mm_);
    density += (p_.tensile_g_cm3 - density) * tensile;
    const double compressive = group(squared_distance(at, compressive_from_, compressive_to_), 0.25 * head_radius_mm_);
    density += (p_.compressive_g_cm3 - density) * compressive;
  }
  return density * (1.0 + p_.texture * grain_noise(at, kGrain_mm));
}

BoneAnatomy Femur::anatomy() const {
  BoneAnatomy found;
  const auto landmark = [&](const char* name, const Vec3& at) { found.landmarks.push_back({name, world(at)}); };
  const auto axis = [&](const char* name, const Vec3& at, const Vec3& direction) {
    found.axes.push_back({name, world(at), world(direction.normalized())});
  };
  const auto circle = [](const Condyle& condyle) {
    return Vec3(condyle.x, condyle.posterior.y(), condyle.posterior.z());
  };
  const auto beyond = [&](const Condyle& condyle, const Vec3& direction) {
    return Vec3(circle(condyle) + condyle.radius_mm * direction);
  };
  const Vec3 knee = 0.5 * (circle(medial_) + circle(lateral_condyle_));
  const Vec3 medial = epicondyle(medial_), lateral = epicondyle(lateral_condyle_);
  landmark("head centre", head_);
  landmark("knee centre", knee);
  landmark("medial epicondyle", medial);
  landmark("lateral epicondyle", lateral);
  landmark("medial posterior condyle", beyond(medial_, -Vec3::UnitY()));
  landmark("lateral posterior condyle", beyond(lateral_condyle_, -Vec3::UnitY()));
  landmark("medial distal condyle", beyond(medial_, -Vec3::UnitZ()));
  landmark("lateral distal condyle", beyond(lateral_condyle_, -Vec3::UnitZ()));
  landmark("greater trochanter", trochanter_tip_ + kTrochanterTipSize * head_radius_mm_ * Vec3::UnitZ());
  landmark("lesser trochanter", lesser_tip_);
  landmark("neck centre", neck_base_ + kIsthmus * neck_length_mm_ * neck_);
  axis("mechanical axis", knee, head_ - knee);
  axis("anatomical axis", shaft_centre(height_of(p_.bow_apex)), up_);
  axis("neck axis", neck_base_, neck_);
  axis("transepicondylar axis", medial, lateral - medial);
  axis("posterior condylar axis", beyond(medial_, -Vec3::UnitY()), Vec3::UnitX());
  return found;
}

double Femur::lowest_along_mm(const Vec3& direction) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Condyle* condyle : {&medial_, &lateral_condyle_})
    for (const Vec3& centre : {condyle->posterior, condyle->anterior})
      least = std::min(least, direction.dot(world(centre)) - condyle->radius_mm);
  return least;
}

double Femur::joint_face_mm(const Vec3& at) const {
  // The groove, seen from its middle, and the rounds of the condyles, but for what faces up.
  constexpr double kGrooveSpan = 0.66, kUpwards = 0.7, kFacePart = 0.8;
  const double y = at.y() - trochlea_.y(), z = at.z() - trochlea_.z();
  double face = std::max(std::abs(at.x()) - lateral_condyle_.x, kGrooveSpan * std::hypot(y, z) - y);
  for (const Condyle* condyle : {&medial_, &lateral_condyle_}) {
    const Vec3 in_plane(0.0, at.y(), at.z()), along = condyle->anterior - condyle->posterior;
    const double t = std::clamp((in_plane - condyle->posterior).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const Vec3 out = in_plane - condyle->posterior - t * along;
    face = std::min(face, std::max(std::abs(at.x() - condyle->x) - kFacePart * 0.5 * p_.condyle_width_mm,
                                   out.z() - kUpwards * out.norm()));
  }
  return face;
}

std::vector<Structure> Femur::structures() const {
  const Distance bone = [this](const Vec3& at_mm) { return surface_mm(own(at_mm)); };
  const Distance own_bone = [this](const Vec3& at) { return surface_mm(at); };
  const double r = p_.medial_condyle_radius_mm, radius = head_radius_mm_, thickness = p_.cartilage_mm;
  const Vec3 head = world(head_), neck = world(neck_);
  std::vector<Structure> found;
  found.push_back(cartilage("femoral head cartilage", thickness,
                            Box{head.array() - radius, head.array() + radius}.grown(thickness), bone,
                            [head, neck, radius](const Vec3& at) { return -0.3 * radius - neck.dot(at - head); }));
  Box knee;
  knee.include(world({-0.5 * p_.bicondylar_width_mm, -1.2 * r, -1.2 * r}));
  knee.include(world({0.5 * p_.bicondylar_width_mm, p_.condyle_depth_mm - r, 1.4 * r}));
  found.push_back(cartilage("femoral condyle cartilage", thickness, knee.grown(thickness), bone,
                            [this](const Vec3& at) { return joint_face_mm(own(at)); }));

  // Inside the notch: the anterior cruciate ligament behind and above at the lateral condyle, the posterior one before
  // and below at the medial condyle.
  const auto wall = [&](const Condyle& condyle, double y, double z) {
    return world(surface_from({condyle.x, y * r, z * r}, {condyle.x > 0.0 ? -1.0 : 1.0, 0.0, 0.0}, own_bone));
  };
  const Vec3 medial = world(epicondyle(medial_)), lateral = world(epicondyle(lateral_condyle_));
  found.push_back(footprint("anterior cruciate ligament, femur", wall(lateral_condyle_, -0.25, 0.35), 5.5, bone));
  found.push_back(footprint("posterior cruciate ligament, femur", wall(medial_, 0.15, -0.25), 6.0, bone));
  found.push_back(footprint("medial collateral ligament, femur", medial, 5.0, bone));
  found.push_back(footprint("lateral collateral ligament, femur", lateral, 4.0, bone));

  const auto shaft = [&](double part_of_length) { return shaft_centre(height_of(part_of_length)); };
  const auto line = [&](const std::vector<Beside>& points) {
    std::vector<Vec3> made = line_beside(points, kHollow_mm, own_bone);
    for (Vec3& at : made) at = world(at);
    return made;
  };
  // From before the head to the medial side, and behind the shaft where the popliteal artery begins.
  const Vec3 groin = head_ + 0.5 * radius * Vec3::UnitZ();
  const Beside hiatus{shaft(kHiatus), {-0.75, -0.65, 0.0}, 10.0};
  std::vector<Vec3> femoral = line({{groin, {0.0, 1.0, 0.0}, 18.0},
                                    {shaft(0.75), {-0.45, 0.9, 0.0}, 28.0},
                                    {shaft(0.5), {-0.85, 0.5, 0.0}, 20.0},
                                    {shaft(0.32), {-1.0, -0.2, 0.0}, 12.0},
                                    hiatus});
  std::vector<Vec3> popliteal = line({hiatus,
                                      {shaft(0.17), {-0.1, -1.0, 0.0}, 9.0},
                                      {{0.0, 0.0, 0.5 * r}, {0.0, -1.0, 0.0}, 10.0},
                                      {{0.0, 0.0, -r}, {0.0, -1.0, 0.0}, 10.0}});
  popliteal.insert(popliteal.begin(), femoral.back());
  // Between the greater trochanter and the ischium, and behind the shaft.
  const Vec3 buttock = neck_base_ + 0.4 * neck_length_mm_ * neck_ + radius * Vec3::UnitZ();
  std::vector<Vec3> sciatic = line({{buttock, {0.0, -1.0, 0.0}, 16.0},
                                    {shaft(0.7), {0.0, -1.0, 0.0}, 20.0},
                                    {shaft(0.45), {0.0, -1.0, 0.0}, 18.0},
                                    {shaft(kHiatus), {0.0, -1.0, 0.0}, 17.0}});
  found.push_back(tube("femoral artery", LabelKind::vessel, std::move(femoral), 4.5, bone));
  found.push_back(tube("popliteal artery", LabelKind::vessel, rounded(popliteal), kPopliteal_mm, bone));
  found.push_back(tube("sciatic nerve", LabelKind::nerve, std::move(sciatic), 5.0, bone));
  return found;
}

Box Femur::bounds() const {
  constexpr double kBeyond_mm = 4.0;  // blends stand out a little
  const double r = head_radius_mm_;
  Box box;
  const auto include = [&](const Vec3& at, double radius) {
    box.include(world(at) - Vec3::Constant(radius));
    box.include(world(at) + Vec3::Constant(radius));
  };
  include(head_, r);
  include(neck_base_, 0.75 * p_.neck_height_mm);
  include(trochanter_, kTrochanterSize * r);
  include(trochanter_tip_, kTrochanterTipSize * r);
  include(lesser_, kLesserSize * r);
  for (const Condyle* condyle : {&medial_, &lateral_condyle_}) {
    include(Vec3(condyle->x, condyle->posterior.y(), condyle->posterior.z()), condyle->radius_mm);
    include(Vec3(condyle->x, condyle->anterior.y(), condyle->anterior.z()), condyle->radius_mm);
    include(epicondyle(*condyle), 0.0);
  }
  for (int step = 2; step < 18; ++step) {
    const double along = height_of(step / 20.0);
    include(shaft_centre(along), std::max(half_width_(along), half_depth_(along)));
  }
  return box.grown(kBeyond_mm);
}

}  // namespace osteon::phantoms
