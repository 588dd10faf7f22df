#include "common/phantoms/pelvis.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "common/phantoms/structures.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kToRadians = std::numbers::pi / 180.0;
// Widths in which parts grow together, mm. [A]
constexpr double kIliumBlend = 9.0, kLimbBlend = 7.0, kKnobBlend = 5.5, kEdgeBlend = 3.0, kRimBlend = 1.5,
                 kWingEdge = 3.0, kSacrumEdge = 4.0, kTunnelBlend = 2.0;
// Radii of balls as parts of hip_centres_mm, and slopes and places of parts without a parameter. [A], by the look of
// real bones.
constexpr double kIliacSpineSize = 0.042, kTubercleSize = 0.036, kTuberositySize = 0.068, kPubisSize = 0.045;
constexpr double kRing =
    5.0;  // radius of the border of the obturator foramen, beside hip centres that are 180 mm apart
constexpr double kWall = 0.22;                           // of the acetabulum, as a part of its radius
constexpr double kJointForward = 0.32, kJointUp = 0.16;  // slopes of the sacroiliac joint's x along y and z
constexpr double kJointPart = 0.44;  // how far back its corner lies, as a part of the posterior spines'
constexpr double kHollow = 0.35;     // how hollow the iliac fossa is
constexpr double kCrestTop = 0.49, kCrestWidest = 0.41;  // where along its chord
constexpr double kSacrumTilt = 20.0 * kToRadians;        // of the chord of its axis, backwards from below
constexpr double kSacrumBow = 0.11;                      // of its axis, as a part of its height
constexpr double kSymphysisTilt = 35.0 * kToRadians;     // backwards from below
constexpr double kPelvisGrain_mm = 1.5;
constexpr double kNoCanal_mm = 1e3;

using PelvisField = ParameterField<PelvisParameters>;
using B = PelvisParameters;
constexpr PelvisField kPelvisFields[] = {
    {"hip_centres_mm", &B::hip_centres_mm, 140.0, 230.0},
    {"acetabulum_diameter_mm", &B::acetabulum_diameter_mm, 36.0, 66.0},
    {"acetabulum_depth", &B::acetabulum_depth, 0.6, 1.0},
    {"inclination_degrees", &B::inclination_degrees, 25.0, 60.0},
    {"anteversion_degrees", &B::anteversion_degrees, 0.0, 35.0},
    {"plane_forward_mm", &B::plane_forward_mm, 25.0, 58.0},
    {"spines_mm", &B::spines_mm, 180.0, 310.0},
    {"spine_height_mm", &B::spine_height_mm, 48.0, 100.0},
    {"posterior_spines_mm", &B::posterior_spines_mm, 60.0, 130.0},
    {"posterior_spine_height_mm", &B::posterior_spine_height_mm, 60.0, 120.0},
    {"posterior_spine_back_mm", &B::posterior_spine_back_mm, 80.0, 145.0},
    {"crests_mm", &B::crests_mm, 210.0, 350.0},
    {"crest_height_mm", &B::crest_height_mm, 95.0, 170.0},
    {"wing_mm", &B::wing_mm, 4.0, 12.0},
    {"crest_mm", &B::crest_mm, 8.0, 20.0},
    {"tubercles_mm", &B::tubercles_mm, 36.0, 90.0},
    {"tubercle_depth_mm", &B::tubercle_depth_mm, 5.0, 36.0},
    {"symphysis_mm", &B::symphysis_mm, 26.0, 54.0},
    {"tuberosities_mm", &B::tuberosities_mm, 84.0, 170.0},
    {"tuberosity_depth_mm", &B::tuberosity_depth_mm, 64.0, 112.0},
    {"tuberosity_back_mm", &B::tuberosity_back_mm, 12.0, 50.0},
    {"foramen_width_mm", &B::foramen_width_mm, 18.0, 50.0},
    {"foramen_height_mm", &B::foramen_height_mm, 28.0, 66.0},
    {"sacrum_width_mm", &B::sacrum_width_mm, 80.0, 140.0},
    {"sacrum_height_mm", &B::sacrum_height_mm, 80.0, 145.0},
    {"symphysis_gap_mm", &B::symphysis_gap_mm, 2.0, 10.0},
    {"sacroiliac_gap_mm", &B::sacroiliac_gap_mm, 1.5, 6.0},
    {"shell_mm", &B::shell_mm, 0.6, 3.0},
    {"subchondral_mm", &B::subchondral_mm, 0.8, 5.0},
    {"cartilage_mm", &B::cartilage_mm, 0.5, 4.0},
    {"cortical_g_cm3", &B::cortical_g_cm3, 1.5, 2.1},
    {"cancellous_g_cm3", &B::cancellous_g_cm3, 0.05, 0.8},
    {"texture", &B::texture, 0.0, 0.5},
};

// Scales all lengths but the joints' gaps.
void scale_pelvis(PelvisParameters& p, double factor) {
  const double symphysis = p.symphysis_gap_mm, sacroiliac = p.sacroiliac_gap_mm;
  scale_lengths<PelvisParameters>(p, kPelvisFields, factor);
  p.symphysis_gap_mm = symphysis;
  p.sacroiliac_gap_mm = sacroiliac;
}

PelvisParameters pelvis_preset(std::string_view name) {
  PelvisParameters p;
  if (name == "female" || name == "small") {
    // Lower and smaller than a man's, but as wide between spines, tubercles and tuberosities.
    scale_pelvis(p, 0.93);
    p.hip_centres_mm = 174.0;
    p.acetabulum_diameter_mm = 47.0;
    p.anteversion_degrees = 21.3;
    p.spines_mm = 238.0;
    p.spine_height_mm = 74.0;
    p.tubercle_depth_mm = 18.7;
    p.crests_mm = 272.0;
    p.posterior_spines_mm = 100.0;
    p.tubercles_mm = 62.0;
    p.tuberosities_mm = 130.0;
    p.sacrum_width_mm = 108.0;
    p.sacrum_height_mm = 102.0;
  }
  // As much smaller or larger than the mean as the femur of that preset.
  if (name == "small") scale_pelvis(p, 341.0 / 388.4);
  if (name == "large") scale_pelvis(p, 483.0 / 419.8);
  return p;
}

// Points of the lower half of a hip bone, in the directions of the left half.
struct LowerHip {
  Vec3 tubercle, tuberosity;  // centres of their balls
  Vec3 pubis_top, pubis_bottom, pubis_corner, crest, ramus, ischium;
  // Beside the obturator foramen, besides the ramus above it.
  [[nodiscard]] Vec3 below() const { return 0.5 * (pubis_corner + tuberosity); }
  [[nodiscard]] Vec3 medial() const { return 0.5 * (crest + pubis_corner); }
  [[nodiscard]] Vec3 beside() const { return 0.5 * (ischium + tuberosity); }
};

LowerHip lower_hip(const PelvisParameters& p) {
  const double u = p.hip_centres_mm / 180.0, pubis = kPubisSize * p.hip_centres_mm, r = 0.5 * p.acetabulum_diameter_mm;
  const Vec3 down(0.0, -std::sin(kSymphysisTilt), -std::cos(kSymphysisTilt));
  LowerHip at;
  at.tubercle = {0.5 * p.tubercles_mm, p.plane_forward_mm - kTubercleSize * p.hip_centres_mm, -p.tubercle_depth_mm};
  at.tuberosity = {0.5 * p.tuberosities_mm, -p.tuberosity_back_mm,
                   kTuberositySize * p.hip_centres_mm - p.tuberosity_depth_mm};
  at.pubis_top = {0.0, p.plane_forward_mm - 5.0 * u - pubis, -p.tubercle_depth_mm - 3.0 * u};
  at.pubis_bottom = at.pubis_top + (p.symphysis_mm - 2.0 * pubis) * down;
  at.pubis_corner = at.pubis_bottom + (at.tubercle.x() - 12.0 * u) * Vec3::UnitX();
  at.crest = at.pubis_top + Vec3(at.tubercle.x() - 2.0 * u, 0.0, 1.0 * u);
  const Vec3 ramus_end(0.5 * p.hip_centres_mm - 0.75 * r, 0.65 * r, -2.0 * u);
  at.ramus = 0.5 * (at.crest + ramus_end) + Vec3(0.0, 4.0 * u, 1.0 * u);
  at.ischium = {0.5 * p.hip_centres_mm - 0.40 * r, -0.85 * r, -0.5 * r};
  return at;
}

double slope_of(const Profile& curve, double x) {
  constexpr double kStep = 0.5;
  return (curve(x + kStep) - curve(x - kStep)) / (2.0 * kStep);
}

// The middle of the sacroiliac joint: a plane through the foremost lateral corner of the sacrum, which is a little
// rounded.
double joint_x_at(const PelvisParameters& p, double y, double z) {
  const double u = p.hip_centres_mm / 180.0;
  const double corner_y = -kJointPart * p.posterior_spine_back_mm, corner_z = p.posterior_spine_height_mm - 7.0 * u;
  return 0.5 * (p.sacrum_width_mm + p.sacroiliac_gap_mm) + u + kJointForward * (y - corner_y) +
         kJointUp * (z - corner_z);
}

}  // namespace

std::span<const ParameterField<PelvisParameters>> pelvis_fields() { return kPelvisFields; }

Result<void> check_pelvis(const PelvisParameters& p) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  const double hips = p.hip_centres_mm, u = hips / 180.0, r = 0.5 * p.acetabulum_diameter_mm;
  const double joint_mm =
      joint_x_at(p, kIliacSpineSize * hips - p.posterior_spine_back_mm, p.posterior_spine_height_mm);
  const LowerHip at = lower_hip(p);
  const double wide_mm = (at.beside() - at.medial()).norm() - 18.0 * u,
               high_mm = (at.ramus - at.below()).norm() - 9.0 * u;
  const DependentLimit limits[] = {
      {"acetabulum_diameter_mm", 0.23 * hips, 0.34 * hips, "hip_centres_mm"},
      {"plane_forward_mm", 0.17 * hips, 0.29 * hips, "hip_centres_mm"},
      {"spines_mm", 1.15 * hips, 1.55 * hips, "hip_centres_mm"},
      {"spine_height_mm", r + 32.0 * u, r + 65.0 * u, "acetabulum_diameter_mm and hip_centres_mm"},
      {"crests_mm", p.spines_mm + 20.0 * u, p.spines_mm + 70.0 * u, "spines_mm"},
      {"posterior_spine_back_mm", 0.52 * hips, 0.74 * hips, "hip_centres_mm"},
      {"posterior_spine_height_mm", 0.40 * hips, 0.60 * hips, "hip_centres_mm"},
      {"posterior_spines_mm", 2.0 * joint_mm + 9.0 * u, 2.0 * joint_mm + 40.0 * u,
       "sacrum_width_mm and posterior_spine_back_mm"},
      {"crest_height_mm", std::max(p.spine_height_mm + 40.0 * u, p.posterior_spine_height_mm + 25.0 * u),
       p.spine_height_mm + 90.0 * u, "spine_height_mm and posterior_spine_height_mm"},
      {"crest_mm", p.wing_mm + 2.0, 3.0 * p.wing_mm, "wing_mm"},
      {"shell_mm", -kNoLimit, 0.36 * p.wing_mm, "wing_mm"},
      {"subchondral_mm", -kNoLimit, 0.7 * kWall * r, "acetabulum_diameter_mm"},
      {"tubercles_mm", 0.25 * hips, 0.42 * hips, "hip_centres_mm"},
      {"tubercle_depth_mm", 0.03 * hips, 0.17 * hips, "hip_centres_mm"},
      {"symphysis_mm", 0.17 * hips, 0.26 * hips, "hip_centres_mm"},
      {"tuberosities_mm", 0.52 * hips, 0.82 * hips, "hip_centres_mm"},
      {"tuberosity_depth_mm", r + 54.0 * u, r + 78.0 * u, "acetabulum_diameter_mm and hip_centres_mm"},
      {"tuberosity_back_mm", 0.08 * hips, 0.24 * hips, "hip_centres_mm"},
      {"foramen_width_mm", 0.5 * wide_mm, wide_mm, "tubercles_mm, tuberosities_mm and plane_forward_mm"},
      {"foramen_height_mm", 0.5 * high_mm, high_mm, "tubercle_depth_mm, tuberosity_depth_mm and symphysis_mm"},
      {"sacrum_width_mm", 0.52 * hips, 0.70 * hips, "hip_centres_mm"},
      {"sacrum_height_mm", 0.50 * hips, 0.75 * hips, "hip_centres_mm"},
  };
  return check_parameters<PelvisParameters>(p, kPelvisFields, limits);
}

Result<PelvisParameters> pelvis_parameters(const BoneRecipe& recipe) {
  PelvisParameters p = pelvis_preset(recipe.preset);
  const ConditionFactors factors = factors_of(recipe.condition);
  p.shell_mm *= factors.cortex;
  p.subchondral_mm *= factors.cortex;
  p.cancellous_g_cm3 *= factors.cancellous;
  if (auto changed = change<PelvisParameters>(p, kPelvisFields, recipe.changes); !changed)
    return tl::unexpected(changed.error());
  if (auto good = check_pelvis(p); !good) return tl::unexpected(good.error());
  return p;
}

Pelvis::Pelvis(const PelvisParameters& parameters, std::optional<Side> only)
    : p_(parameters),
      only_(only),
      unit_mm_(parameters.hip_centres_mm / 180.0),
      radius_mm_(0.5 * parameters.acetabulum_diameter_mm),
      rim_mm_((parameters.acetabulum_depth - 1.0) * radius_mm_),
      centre_(0.5 * parameters.hip_centres_mm, 0.0, 0.0) {
  const double inclination = p_.inclination_degrees * kToRadians, anteversion = p_.anteversion_degrees * kToRadians;
  opening_ = {std::cos(anteversion) * std::sin(inclination), std::sin(anteversion),
              -std::cos(anteversion) * std::cos(inclination)};
  const double spine = kIliacSpineSize * p_.hip_centres_mm;
  spine_ = {0.5 * p_.spines_mm, p_.plane_forward_mm - spine, p_.spine_height_mm};
  posterior_spine_ = {0.5 * p_.posterior_spines_mm, spine - p_.posterior_spine_back_mm, p_.posterior_spine_height_mm};
  const LowerHip lower = lower_hip(p_);
  tubercle_ = lower.tubercle;
  tuberosity_ = lower.tuberosity;
  place_sacrum();
  place_wing();
  place_ilium();
  place_pubis_and_ischium();
}

// The base lies in front of the posterior spines. The axis of the sacrum is an arc, hollow in front.
void Pelvis::place_sacrum() {
  const double height = p_.sacrum_height_mm, width = p_.sacrum_width_mm, bow = kSacrumBow * height;
  const Vec3 base(0.0, -0.40 * p_.posterior_spine_back_mm, p_.posterior_spine_height_mm + 2.0 * unit_mm_);
  const Vec3 down(0.0, -std::sin(kSacrumTilt), -std::cos(kSacrumTilt));
  bow_forward_ = {0.0, std::cos(kSacrumTilt), -std::sin(kSacrumTilt)};
  bow_mm_ = (0.25 * height * height + bow * bow) / (2.0 * bow);
  bow_half_ = std::asin(0.5 * height / bow_mm_);
  bow_centre_ = base + 0.5 * height * down + (bow_mm_ - bow) * bow_forward_;
  const double length = 2.0 * bow_half_ * bow_mm_;
  sacrum_half_width_ = Profile({{0.0, 0.56 * width},
                                {0.30 * length, 0.56 * width},
                                {0.52 * length, 0.37 * width},
                                {0.74 * length, 0.25 * width},
                                {0.88 * length, 0.20 * width},
                                {length, 0.08 * width}});
  const double depth = 17.0 * height / 112.0;
  sacrum_middle_ = base + 0.5 * height * down;
  sacrum_reach_mm_ = std::hypot(0.5 * height, 0.5 * width) + depth;
  sacrum_half_depth_ =
      Profile({{0.0, depth}, {0.3 * length, 0.8 * depth}, {0.6 * length, 0.55 * depth}, {length, 0.3 * depth}});
}

double Pelvis::joint_x(double y, double z) const { return joint_x_at(p_, y, z); }

double Pelvis::joint_mm(const Vec3& at) const {
  return (at.x() - joint_x(at.y(), at.z())) / std::sqrt(1.0 + kJointForward * kJointForward + kJointUp * kJointUp);
}

void Pelvis::place_wing() {
  const double u = unit_mm_;
  chord_ = posterior_spine_ - spine_;
  chord_.z() = 0.0;
  chord_mm_ = chord_.norm();
  chord_ /= chord_mm_;
  out_ = {-chord_.y(), chord_.x(), 0.0};
  const double front = p_.spine_height_mm, back = p_.posterior_spine_height_mm;
  // The crest is an arch as high and as wide as asked.
  crest_rise_mm_ = crest_bulge_mm_ = std::numeric_limits<double>::infinity();
  for (int percent = 10; percent < 80; ++percent) {
    const double t = 0.01 * percent;
    const double rise = p_.crest_height_mm - front - t * (back - front);
    crest_rise_mm_ = std::min(crest_rise_mm_, rise / arch(t, kCrestTop).value);
    const double beside = 0.5 * p_.crests_mm - spine_.x() - t * chord_mm_ * chord_.x() - 0.55 * p_.crest_mm * out_.x();
    crest_bulge_mm_ = std::min(crest_bulge_mm_, beside / (out_.x() * arch(t, kCrestWidest).value));
  }

  // The floor goes from above the acetabulum along the brim to the sacroiliac joint.
  const auto at = [&](const Vec3& p) { return Profile::Point{(p - spine_).dot(chord_), (p - spine_).dot(out_)}; };
  const Vec3 above(centre_.x() + 5.0 * u, 14.0 * u, 0.0);
  const Vec3 brim(centre_.x() - 19.0 * u, -38.0 * u, 0.0);
  const double y = -0.78 * p_.posterior_spine_back_mm;
  const Vec3 joint(joint_x(y, 0.6 * back) + 6.0 * u, y, 0.0);
  floor_out_ = Profile({at(above), at(brim), at(joint), {chord_mm_, at(posterior_spine_).y}});
  floor_z_ = Profile({{at(above).x, radius_mm_ - 4.0 * u},
                      {at(brim).x, 20.0 * u},
                      {at(joint).x, 0.52 * back},
                      {chord_mm_, 0.70 * back}});
  front_ = Profile({{radius_mm_ + 4.0 * u, at(above).x - 6.0 * u},
                    {0.5 * (radius_mm_ + front), at(above).x - 8.0 * u},
                    {front - 9.0 * u, 4.5 * u},
                    {front, 2.0 * u}});
}

void Pelvis::place_ilium() {
  const double u = unit_mm_, spine = kIliacSpineSize * p_.hip_centres_mm, r = radius_mm_;
  const auto beside_joint = [&](double y, double z, double beyond) { return Vec3(joint_x(y, z) + beyond, y, z); };
  // A point in the middle of the wing, at a part of the chord and a part of the height there.
  const auto in_wing = [&](double t, double height) {
    const double v = t * chord_mm_, z = floor_z_(v) + height * (crest_z(v).value - floor_z_(v));
    const double s = height + kHollow * height * (1.0 - height);
    Vec3 at = spine_ + v * chord_ + (floor_out_(v) + s * (crest_out(v).value - floor_out_(v))) * out_;
    at.z() = z;
    return at;
  };
  const Vec3 lower_spine(centre_.x() + 0.28 * r, std::min(p_.plane_forward_mm - 14.0 * u, 0.85 * r), r + 5.0 * u);
  const Vec3 roof(centre_.x() - 2.0 * u, -2.0 * u, 0.85 * r);
  const Vec3 buttress = beside_joint(-0.56 * p_.posterior_spine_back_mm, 0.56 * p_.posterior_spine_height_mm, 5.0 * u);
  const Vec3 tail = beside_joint(-0.88 * p_.posterior_spine_back_mm, 0.68 * p_.posterior_spine_height_mm, 3.5 * u);
  const double blend = kIliumBlend * u, knob = kKnobBlend * u;
  const Vec3 back = Vec3::UnitY() * -u;
  ilium_ = {
      // Anterior inferior spine, iliac pillar, and the thick bone beside the pelvic brim.
      {lower_spine, 8.0 * u, roof, 15.0 * u, blend},
      {roof, 17.0 * u, in_wing(0.27, 0.90) + 1.0 * u * out_, 4.5 * u, blend},
      {{centre_.x() - 8.0 * u, -14.0 * u, 10.0 * u}, 16.0 * u, buttress, 11.0 * u, blend},
      {buttress, 11.0 * u, tail, 7.0 * u, blend},
      // The ends of the crest. Only one ball reaches to the tip of each spine, so the tip is where it is said to be.
      {in_wing(0.86, 0.75), 0.5 * p_.crest_mm, posterior_spine_ - 8.0 * back, 0.6 * spine, blend},
      {tail, 7.0 * u, posterior_spine_, spine, knob},
      {in_wing(0.20, 0.92), 6.5 * u, spine_ + 8.5 * back, 7.2 * u, 1.5 * knob},
      {in_wing(0.12, 0.75), 5.5 * u, spine_, spine, knob},
  };
  ilium_bottom_ = -10.0 * u;
}

void Pelvis::place_pubis_and_ischium() {
  const double u = unit_mm_, r = radius_mm_, blend = kLimbBlend * u;
  const double tubercle = kTubercleSize * p_.hip_centres_mm, tuberosity = kTuberositySize * p_.hip_centres_mm;
  const LowerHip at = lower_hip(p_);
  pubis_radius_mm_ = kPubisSize * p_.hip_centres_mm;
  pubis_top_ = at.pubis_top;
  pubis_bottom_ = at.pubis_bottom;
  pubis_end_x_ = at.pubis_corner.x();
  // The foramen lies in the middle of what surrounds it.
  const Vec3 upwards = at.ramus - at.below(), sideways = at.beside() - at.medial();
  foramen_ = 0.25 * (at.ramus + at.below() + at.beside() + at.medial());
  foramen_up_ = upwards.normalized();
  foramen_out_ = upwards.cross(sideways).normalized();
  foramen_across_ = foramen_up_.cross(-foramen_out_);
  const double width = 0.5 * p_.foramen_width_mm + kRing * u, height = 0.5 * p_.foramen_height_mm + kRing * u;
  const auto on_ring = [&](double across, double up) {
    return Vec3(foramen_ + across * width * foramen_across_ + up * height * foramen_up_);
  };
  // In the rim's plane, the notch of the acetabulum is where it is lowest. Behind it lies bone.
  const Vec3 notch = (-Vec3::UnitZ() + opening_.z() * opening_).normalized();
  const auto at_notch = [&](double down, double deep) {
    return Vec3(centre_ + down * r * notch - deep * r * opening_);
  };
  const Vec3 upper_tuberosity = at.tuberosity + Vec3(7.0 * u, -7.0 * u, 24.0 * u);
  pubis_ = {
      {at.crest, 7.0 * u, at.ramus, 7.5 * u, blend},  // superior ramus
      {at.ramus, 7.5 * u, {centre_.x() - 0.75 * r, 0.65 * r, -2.0 * u}, 11.0 * u, blend},
      {at.ischium, 14.0 * u, upper_tuberosity, 11.5 * u, blend},
      {centre_ + Vec3(-0.5 * r, -0.1 * r, -0.75 * r), 10.0 * u, upper_tuberosity, 9.0 * u, blend},
      {at_notch(0.7, 0.85), 7.5 * u, at_notch(1.2, 0.40), 7.5 * u, blend},
      {on_ring(1.0, 0.0), 5.0 * u, upper_tuberosity, 8.0 * u, blend},
      {on_ring(0.7, -0.7), 5.0 * u, at.tuberosity, 5.0 * u, blend},
      {at.pubis_corner, 6.0 * u, on_ring(0.0, -1.0), 5.5 * u, blend},  // inferior ramus
      {on_ring(0.0, -1.0), 5.5 * u, at.tuberosity, 5.0 * u, blend},
      {upper_tuberosity, 11.5 * u, at.tuberosity, tuberosity, kKnobBlend * u},
      {at.ischium - Vec3(4.0 * u, 6.0 * u, 0.0), 9.0 * u, at.ischium - Vec3(22.0 * u, 23.0 * u, 2.0 * u), 3.0 * u,
       blend},  // ischial spine
      {at.tubercle, tubercle, at.tubercle - Vec3(3.0 * u, 6.0 * u, 2.0 * u), tubercle, kKnobBlend * u},
  };
  pubis_top_z_ = r * (1.0 + kWall) + 2.0 * u;
  fossa_ = {at_notch(0.0, 0.64), 0.42 * r, at_notch(1.05, 0.0), 0.32 * r, kRimBlend};
}

// From 0 at 0 to 0 at 1, and 1 at `top`. Constant beyond.
Pelvis::Slope Pelvis::arch(double part, double top) {
  if (part <= 0.0 || part >= 1.0) return {};
  const double power = std::log(0.5) / std::log(top), turn = std::numbers::pi * std::pow(part, power);
  return {std::sin(turn), std::cos(turn) * turn * power / part};
}

Pelvis::Slope Pelvis::crest_z(double along_mm) const {
  const double t = along_mm / chord_mm_, within = std::clamp(t, 0.0, 1.0);
  const double fall = p_.posterior_spine_height_mm - p_.spine_height_mm;
  const Slope rise = arch(t, kCrestTop);
  return {p_.spine_height_mm + within * fall + crest_rise_mm_ * rise.value,
          ((t == within ? fall : 0.0) + crest_rise_mm_ * rise.slope) / chord_mm_};
}

Pelvis::Slope Pelvis::crest_out(double along_mm) const {
  const Slope out = arch(along_mm / chord_mm_, kCrestWidest);
  return {crest_bulge_mm_ * out.value, crest_bulge_mm_ * out.slope / chord_mm_};
}

Vec3 Pelvis::own(const Vec3& at_mm) const {
  const double x = !only_ ? std::abs(at_mm.x()) : *only_ == Side::left ? at_mm.x() : -at_mm.x();
  return {x, -at_mm.y(), at_mm.z()};
}

double Pelvis::lunate_mm(const Vec3& at) const {
  const Vec3 from = at - centre_;
  const double fossa = round_cone_mm(at, fossa_.a, fossa_.radius_a_mm, fossa_.b, fossa_.radius_b_mm);
  return std::max({from.norm() - radius_mm_ - 1.0, from.dot(opening_) - rim_mm_, -fossa});
}

double Pelvis::socket_mm(const Vec3& at) const {
  const Vec3 from = at - centre_;
  const double q = from.dot(opening_);
  return (q > 0.0 ? std::sqrt(std::max(0.0, from.squaredNorm() - q * q)) : from.norm()) - radius_mm_;
}

double Pelvis::wing_mm(const Vec3& at) const {
  const Vec3 from = at - spine_;
  const double v = from.dot(chord_), u = from.dot(out_), z = at.z();
  const Slope crest_z = this->crest_z(v), crest_out = this->crest_out(v);
  const double top = crest_z.value, bottom = floor_z_(v), high = crest_out.value, low = floor_out_(v);
  const double t = std::clamp((z - bottom) / (top - bottom), 0.0, 1.0), s = t + kHollow * t * (1.0 - t);
  const double rise = (high - low) * (1.0 + kHollow * (1.0 - 2.0 * t)) / (top - bottom);
  const double run = (1.0 - s) * slope_of(floor_out_, v) + s * crest_out.slope;
  const double edge = (z - top) / std::sqrt(1.0 + crest_z.slope * crest_z.slope);
  const double thick = 0.5 * p_.wing_mm + 0.5 * (p_.crest_mm - p_.wing_mm) * smooth_step(edge, -18.0 * unit_mm_, -3.0);
  const double across = std::abs(u - low - s * (high - low)) / std::sqrt(1.0 + rise * rise + run * run);
  double d = smooth_max(across - thick, edge, kWingEdge);
  const double lean = slope_of(front_, z);
  d = smooth_max(d, (front_(z) - v) / std::sqrt(1.0 + lean * lean), kWingEdge);
  d = smooth_max(d, v - chord_mm_ + 1.0, kWingEdge);
  return smooth_max(d, bottom - z, kWingEdge);
}

double Pelvis::limbs_mm(const Vec3& at, double d, std::span<const Limb> limbs) {
  for (const Limb& limb : limbs) {
    // Beyond the blend's reach it changes nothing.
    const double near = d + limb.blend_mm + limb.reach_mm;
    if (near < 0.0 || (at - limb.middle).squaredNorm() > near * near) continue;
    d = smooth_min(d, round_cone_mm(at, limb.a, limb.radius_a_mm, limb.b, limb.radius_b_mm), limb.blend_mm);
  }
  return d;
}

double Pelvis::ilium_mm(const Vec3& at) const {
  const double d = limbs_mm(at, wing_mm(at), ilium_);
  return smooth_max(d, 0.5 * p_.sacroiliac_gap_mm - joint_mm(at), kEdgeBlend);
}

double Pelvis::pubis_mm(const Vec3& at) const {
  const Vec3 from = at - centre_;
  const double u = unit_mm_, wall = radius_mm_ * (1.0 + kWall);
  double d = smooth_max(from.norm() - wall, from.dot(opening_) - rim_mm_, kRimBlend);
  // The body of the pubis.
  const Vec3 line = pubis_bottom_ - pubis_top_;
  const double t = std::clamp((at - pubis_top_).dot(line) / line.squaredNorm(), 0.0, 1.0);
  const Vec3 off = at - pubis_top_ - t * line;
  const double across = std::hypot(off.y(), off.z());
  d = smooth_min(d, std::hypot(std::max(0.0, at.x() - pubis_end_x_), across) - pubis_radius_mm_, kLimbBlend * u);
  // A ring around the foramen closes its border.
  const Vec3 beside = at - foramen_;
  const double x = beside.dot(foramen_across_), y = beside.dot(foramen_up_), z = beside.dot(foramen_out_);
  const double width = 0.5 * p_.foramen_width_mm, height = 0.5 * p_.foramen_height_mm;
  const double ring = std::hypot(ellipse_mm(x, y, width + kRing * u, height + kRing * u), z) - kRing * u;
  d = limbs_mm(at, smooth_min(d, ring, kLimbBlend * u), pubis_);
  const double hole = std::max(ellipse_mm(x, y, width, height), std::abs(z) - 4.0 * kRing * u);
  return smooth_max(d, -hole, kTunnelBlend);
}

double Pelvis::hip_mm(const Vec3& at) const {
  // Skip the half that is too far away to change the result.
  const double blend = kIliumBlend * unit_mm_;
  double d = 0.0;
  if (at.z() > 0.0) {
    d = ilium_mm(at);
    if (at.z() - pubis_top_z_ < d + blend) d = smooth_min(d, pubis_mm(at), blend);
  } else {
    d = pubis_mm(at);
    if (ilium_bottom_ - at.z() < d + blend) d = smooth_min(d, ilium_mm(at), blend);
  }
  d = smooth_max(d, 0.5 * p_.symphysis_gap_mm - at.x(), kEdgeBlend);
  // Nothing stands before the rim of the acetabulum, and nothing in its ball.
  const Vec3 from = at - centre_;
  const double q = from.dot(opening_), radial = std::sqrt(std::max(0.0, from.squaredNorm() - q * q));
  d = smooth_max(d, -std::max(rim_mm_ - q, radial - radius_mm_ * (1.0 + kWall)), kRimBlend);
  d = smooth_max(d, -socket_mm(at), kRimBlend);
  const double fossa = round_cone_mm(at, fossa_.a, fossa_.radius_a_mm, fossa_.b, fossa_.radius_b_mm);
  return smooth_max(d, -fossa, fossa_.blend_mm);
}

Pelvis::SacrumPlace Pelvis::beside_sacrum(const Vec3& at) const {
  const double y = at.y() - bow_centre_.y(), z = at.z() - bow_centre_.z();
  // From the centre: -bow_forward_ is the middle of the axis, and down is its other direction.
  const double back = -(y * bow_forward_.y() + z * bow_forward_.z());
  const double down = y * bow_forward_.z() - z * bow_forward_.y();
  return {(std::atan2(down, back) + bow_half_) * bow_mm_, std::hypot(back, down) - bow_mm_};
}

Vec3 Pelvis::in_sacrum(double x, const SacrumPlace& place) const {
  const double angle = place.along_mm / bow_mm_ - bow_half_, radius = bow_mm_ + place.behind_mm;
  const Vec3 down(0.0, bow_forward_.z(), -bow_forward_.y());
  return bow_centre_ + radius * (-std::cos(angle) * bow_forward_ + std::sin(angle) * down) + x * Vec3::UnitX();
}

double Pelvis::sacrum_mm(const Vec3& at) const {
  const auto [along, behind] = beside_sacrum(at);
  const double u = unit_mm_, length = 2.0 * bow_half_ * bow_mm_, x = at.x();
  const double width = sacrum_half_width_(along), depth = sacrum_half_depth_(along);
  const double narrowing = slope_of(sacrum_half_width_, along);
  const double lateral = x / (0.5 * p_.sacrum_width_mm);
  // Thinner at its sides, which also lie further back at the base.
  const double middle = 5.0 * u * (1.0 - smooth_step(along, 0.0, 0.5 * length)) * smooth_step(lateral, 0.25, 0.7);
  double d = std::abs(behind - middle) - depth * (1.0 - 0.3 * std::min(1.0, lateral * lateral));
  d = smooth_max(d, (x - width) / std::sqrt(1.0 + narrowing * narrowing), kSacrumEdge);
  const double base = 9.0 * u * smooth_step(x, 20.0 * u, 38.0 * u);
  d = smooth_max(d, base - along, kSacrumEdge);
  d = smooth_max(d, along - length, kSacrumEdge);
  // The median crest, and the facets of the last lumbar joint.
  const auto ridge = [&](double part, double above) {
    return in_sacrum(0.0, {part * length, sacrum_half_depth_(part * length) + above * u});
  };
  d = smooth_min(d, round_cone_mm(at, ridge(0.14, 5.0), 3.5 * u, ridge(0.38, 4.0), 3.4 * u), 8.0);
  d = smooth_min(d, round_cone_mm(at, ridge(0.38, 4.0), 3.4 * u, ridge(0.66, 1.0), 3.0 * u), 8.0);
  d = smooth_min(d, ball_mm(at, in_sacrum(21.0 * u, {4.0 * u, 15.0 * u}), 6.0 * u), 8.0);
  // Four pairs of foramina.
  for (int pair = 0; pair < 4; ++pair) {
    const double place = (0.25 + 0.17 * pair) * length;
    const double tunnel = std::hypot(x - (19.0 - 2.0 * pair) * u, along - place) - (4.2 - 0.5 * pair) * u;
    d = smooth_max(d, -tunnel, kTunnelBlend);
  }
  return smooth_max(d, joint_mm(at) + 0.5 * p_.sacroiliac_gap_mm, kEdgeBlend);
}

std::vector<std::string> Pelvis::names() const {
  if (only_) return {"hip bone"};
  return {"left hip bone", "right hip bone", "sacrum"};
}

std::vector<NamedValue> Pelvis::parameters() const { return values_of<PelvisParameters>(p_, kPelvisFields); }

BoneDepths Pelvis::depths(const Vec3& at_mm) const {
  const Vec3 at = own(at_mm);
  const double hip = hip_mm(at);
  BoneDepths depths;
  depths.marrow_mm = kNoCanal_mm;
  if (only_) {
    depths.surface_mm = hip;
    depths.cortex_mm = std::max(hip + p_.shell_mm, p_.subchondral_mm - socket_mm(at));
    return depths;
  }
  // Skip the sacrum where it is too far away to change the result.
  const double around = (at - sacrum_middle_).norm() - sacrum_reach_mm_;
  const double sacrum = around < hip ? sacrum_mm(at) : around;
  depths.bone = sacrum < hip ? 3 : at_mm.x() >= 0.0 ? 1 : 2;
  depths.surface_mm = std::min(hip, sacrum);
  depths.cortex_mm = depths.surface_mm + p_.shell_mm;
  if (depths.bone != 3) depths.cortex_mm = std::max(depths.cortex_mm, p_.subchondral_mm - socket_mm(at));
  return depths;
}

double Pelvis::cancellous_g_cm3(const Vec3& at_mm) const {
  return p_.cancellous_g_cm3 * (1.0 + p_.texture * grain_noise(own(at_mm), kPelvisGrain_mm));
}

std::vector<Structure> Pelvis::structures() const {
  std::vector<Structure> found;
  for (const double side : {1.0, -1.0}) {
    if (only_ && (*only_ == Side::left) != (side > 0.0)) continue;
    const Vec3 centre(side * centre_.x(), 0.0, 0.0);
    const std::string name = only_ ? "" : side > 0.0 ? "left " : "right ";
    found.push_back(cartilage(
        name + "acetabular cartilage", p_.cartilage_mm,
        Box{centre.array() - radius_mm_, centre.array() + radius_mm_}.grown(1.0),
        [this](const Vec3& at_mm) { return hip_mm(own(at_mm)); },
        [this](const Vec3& at_mm) { return lunate_mm(own(at_mm)); }));
  }
  return found;
}

BoneAnatomy Pelvis::anatomy() const {
  BoneAnatomy found;
  const double spine = kIliacSpineSize * p_.hip_centres_mm;
  const struct {
    const char* name;
    Vec3 at;
  } landmarks[] = {
      {"anterior superior iliac spine", spine_ + spine * Vec3::UnitY()},
      {"posterior superior iliac spine", posterior_spine_ - spine * Vec3::UnitY()},
      {"pubic tubercle", tubercle_ + kTubercleSize * p_.hip_centres_mm * Vec3::UnitY()},
      {"ischial tuberosity", tuberosity_ - kTuberositySize * p_.hip_centres_mm * Vec3::UnitZ()},
      {"acetabular centre", centre_},
  };
  for (const double side : {1.0, -1.0}) {
    if (only_ && (*only_ == Side::left) != (side > 0.0)) continue;
    const std::string prefix = only_ ? "" : side > 0.0 ? "left " : "right ";
    const auto world = [&](const Vec3& at) { return Vec3(side * at.x(), 0.0 - at.y(), at.z()); };
    for (const auto& landmark : landmarks) found.landmarks.push_back({prefix + landmark.name, world(landmark.at)});
    found.axes.push_back({prefix + "acetabular opening", world(centre_), world(opening_)});
  }
  found.planes.push_back({"anterior pelvic plane", {0.0, -p_.plane_forward_mm, 0.0}, {0.0, -1.0, 0.0}});
  return found;
}

Box Pelvis::bounds() const {
  constexpr double kBeyond_mm = 4.0;  // blends stand out a little
  Box box;
  // Of the left half, in LPS.
  const auto include = [&](const Vec3& at, double radius_mm) {
    const Vec3 world(at.x(), -at.y(), at.z());
    box.include(world - Vec3::Constant(radius_mm));
    box.include(world + Vec3::Constant(radius_mm));
  };
  include(centre_, radius_mm_ * (1.0 + kWall));
  include(pubis_top_, pubis_radius_mm_);
  include(pubis_bottom_, pubis_radius_mm_);
  for (const auto& limbs : {ilium_, pubis_})
    for (const Limb& limb : limbs) {
      include(limb.a, limb.radius_a_mm);
      include(limb.b, limb.radius_b_mm);
    }
  include({0.5 * p_.crests_mm, 0.0, p_.crest_height_mm}, 0.0);
  if (only_) {
    box = box.grown(kBeyond_mm);
    if (*only_ == Side::right)
      box = {{-box.max_mm.x(), box.min_mm.y(), box.min_mm.z()}, {-box.min_mm.x(), box.max_mm.y(), box.max_mm.z()}};
    return box;
  }
  const double length = 2.0 * bow_half_ * bow_mm_;
  for (int step = 0; step <= 10; ++step) {
    const double along = 0.1 * step * length;
    include(in_sacrum(0.0, {along, 0.0}), sacrum_half_depth_(along) + 9.0 * unit_mm_);
  }
  const double side = box.max_mm.x();
  box.include(Vec3(-side, box.min_mm.y(), box.min_mm.z()));
  return box.grown(kBeyond_mm);
}

}  // namespace osteon::phantoms
