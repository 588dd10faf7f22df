#include "common/phantoms/tibia.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "common/phantoms/structures.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
// Widths in which parts grow together, mm, and sizes of parts as parts of the plateau's width. [A], by the look of real
// bones.
constexpr double kPlateauBlend = 3.0, kMalleolusBlend = 6.0, kTuberosityBlend = 6.0, kFibulaBlend = 6.0;
constexpr double kSpineSize = 0.06, kSpineApart = 0.07, kMalleolusSize = 0.11, kTuberositySize = 0.13;
constexpr double kTuberosityPart = 0.89;  // of the length
constexpr double kFibulaFootPart = 0.85;  // its radius, as a part of the width of the tibia's end
constexpr double kTibiaGrain_mm = 1.5;

using TibiaField = ParameterField<TibiaParameters>;
using T = TibiaParameters;
constexpr TibiaField kTibiaFields[] = {
    {"length_mm", &T::length_mm, 260.0, 480.0},
    {"plateau_width_mm", &T::plateau_width_mm, 54.0, 98.0},
    {"plateau_depth_mm", &T::plateau_depth_mm, 34.0, 66.0},
    {"slope_degrees", &T::slope_degrees, 0.0, 15.0},
    {"width_12_mm", &T::width_12_mm, 20.0, 50.0},
    {"depth_12_mm", &T::depth_12_mm, 18.0, 44.0},
    {"cortex_12_mm", &T::cortex_12_mm, 1.0, 6.0},
    {"width_30_mm", &T::width_30_mm, 14.0, 34.0},
    {"depth_30_mm", &T::depth_30_mm, 15.0, 36.0},
    {"cortex_30_mm", &T::cortex_30_mm, 1.5, 8.0},
    {"width_50_mm", &T::width_50_mm, 15.0, 36.0},
    {"depth_50_mm", &T::depth_50_mm, 18.0, 42.0},
    {"cortex_50_mm", &T::cortex_50_mm, 1.5, 10.0},
    {"width_70_mm", &T::width_70_mm, 18.0, 44.0},
    {"depth_70_mm", &T::depth_70_mm, 20.0, 50.0},
    {"cortex_70_mm", &T::cortex_70_mm, 1.5, 9.0},
    {"width_86_mm", &T::width_86_mm, 30.0, 66.0},
    {"depth_86_mm", &T::depth_86_mm, 26.0, 58.0},
    {"cortex_86_mm", &T::cortex_86_mm, 1.0, 6.0},
    {"shell_mm", &T::shell_mm, 0.6, 4.0},
    {"marrow_from", &T::marrow_from, 0.16, 0.4},
    {"marrow_to", &T::marrow_to, 0.55, 0.82},
    {"malleolus_mm", &T::malleolus_mm, 7.0, 20.0},
    {"tuberosity_mm", &T::tuberosity_mm, 0.0, 10.0},
    {"fibula_length_mm", &T::fibula_length_mm, 250.0, 470.0},
    {"fibula_width_mm", &T::fibula_width_mm, 8.0, 20.0},
    {"fibula_head_mm", &T::fibula_head_mm, 16.0, 34.0},
    {"fibula_cortex_mm", &T::fibula_cortex_mm, 1.0, 5.0},
    {"gap_mm", &T::gap_mm, 1.5, 8.0},
    {"cartilage_mm", &T::cartilage_mm, 0.5, 6.0},
    {"cortical_g_cm3", &T::cortical_g_cm3, 1.5, 2.1},
    {"cancellous_g_cm3", &T::cancellous_g_cm3, 0.05, 0.8},
    {"marrow_g_cm3", &T::marrow_g_cm3, 0.02, 0.2},
    {"texture", &T::texture, 0.0, 0.5},
};

struct TibiaStation {
  const char* name;
  double T::*width;
  double T::*depth;
  double T::*cortex;
};
constexpr TibiaStation kTibiaRows[] = {
    {"cortex_12_mm", &T::width_12_mm, &T::depth_12_mm, &T::cortex_12_mm},
    {"cortex_30_mm", &T::width_30_mm, &T::depth_30_mm, &T::cortex_30_mm},
    {"cortex_50_mm", &T::width_50_mm, &T::depth_50_mm, &T::cortex_50_mm},
    {"cortex_70_mm", &T::width_70_mm, &T::depth_70_mm, &T::cortex_70_mm},
    {"cortex_86_mm", &T::width_86_mm, &T::depth_86_mm, &T::cortex_86_mm},
};
static_assert(std::size(kTibiaRows) == kTibiaStations.size());

TibiaParameters tibia_preset(std::string_view name) {
  TibiaParameters p;
  if (name == "female" || name == "small") {
    scale_lengths<TibiaParameters>(p, kTibiaFields, 67.6 / 76.1);
    p.length_mm = p.length_mm / (67.6 / 76.1) * (38.844 / 41.978);
    p.fibula_length_mm = p.length_mm - 7.0;
    p.plateau_depth_mm = 43.2;
    p.gap_mm = TibiaParameters{}.gap_mm;
  }
  // As much shorter or longer than the mean as the femur of that preset.
  if (name == "small") scale_lengths<TibiaParameters>(p, kTibiaFields, 341.0 / 388.4, "gap");
  if (name == "large") scale_lengths<TibiaParameters>(p, kTibiaFields, 483.0 / 419.8, "gap");
  return p;
}

}  // namespace

std::span<const ParameterField<TibiaParameters>> tibia_fields() { return kTibiaFields; }

Result<void> check_tibia(const TibiaParameters& p) {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  std::vector<DependentLimit> limits;
  for (const TibiaStation& s : kTibiaRows)
    limits.push_back({s.name, -kNoLimit, 0.38 * std::min(p.*s.width, p.*s.depth), "the shaft's width and depth there"});
  const DependentLimit others[] = {
      {"width_86_mm", 0.4 * p.plateau_width_mm, 0.85 * p.plateau_width_mm, "plateau_width_mm"},
      {"depth_86_mm", 0.5 * p.plateau_depth_mm, p.plateau_depth_mm, "plateau_depth_mm"},
      {"fibula_length_mm", 0.94 * p.length_mm, 1.02 * p.length_mm, "length_mm"},
      {"fibula_cortex_mm", -kNoLimit, 0.42 * p.fibula_width_mm, "fibula_width_mm"},
      {"fibula_head_mm", 1.2 * p.fibula_width_mm, 2.6 * p.fibula_width_mm, "fibula_width_mm"},
  };
  limits.insert(limits.end(), std::begin(others), std::end(others));
  return check_parameters<TibiaParameters>(p, kTibiaFields, limits);
}

Result<TibiaParameters> tibia_parameters(const BoneRecipe& recipe) {
  TibiaParameters p = tibia_preset(recipe.preset);
  const ConditionFactors factors = factors_of(recipe.condition);
  for (const TibiaStation& station : kTibiaRows) p.*station.cortex *= factors.cortex;
  for (double T::*const thickness : {&T::shell_mm, &T::fibula_cortex_mm}) p.*thickness *= factors.cortex;
  p.cancellous_g_cm3 *= factors.cancellous;
  if (auto changed = change<TibiaParameters>(p, kTibiaFields, recipe.changes); !changed)
    return tl::unexpected(changed.error());
  if (auto good = check_tibia(p); !good) return tl::unexpected(good.error());
  return p;
}

Tibia::Tibia(const TibiaParameters& parameters, Side side) : p_(parameters), side_(side == Side::left ? 1.0 : -1.0) {
  std::vector<Profile::Point> width, depth, cortex{{height_of(0.04), p_.shell_mm}};
  for (std::size_t i = 0; i < kTibiaStations.size(); ++i) {
    const double z = height_of(kTibiaStations[i]);
    width.push_back({z, 0.5 * (p_.*kTibiaRows[i].width)});
    depth.push_back({z, 0.5 * (p_.*kTibiaRows[i].depth)});
    cortex.push_back({z, p_.*kTibiaRows[i].cortex});
  }
  width.insert(width.begin(), {plafond(), 0.62 * p_.width_12_mm});
  depth.insert(depth.begin(), {plafond(), 0.62 * p_.depth_12_mm});
  width.push_back({height_of(0.965), 0.5 * p_.plateau_width_mm});
  depth.push_back({height_of(0.965), 0.5 * p_.plateau_depth_mm});
  cortex.push_back({height_of(0.96), p_.shell_mm});
  half_width_ = Profile(std::move(width));
  half_depth_ = Profile(std::move(depth));
  cortex_ = Profile(std::move(cortex));

  malleolus_radius_mm_ = kMalleolusSize * p_.plateau_width_mm;
  malleolus_ = {-(half_width_(plafond()) - malleolus_radius_mm_), 0.0, height_of(0.0) + malleolus_radius_mm_};
  const double tuberosity = kTuberositySize * p_.plateau_width_mm, tuberosity_z = height_of(kTuberosityPart);
  tuberosity_ = {0.0, half_depth_(tuberosity_z) + p_.tuberosity_mm - tuberosity, tuberosity_z};

  // The fibula begins behind and below the lateral part of the plateau, and ends beside the ankle, a little deeper than
  // the tibia. Its joint faces are a gap away from the tibia.
  const double head = 0.5 * p_.fibula_head_mm, half = 0.5 * p_.fibula_width_mm;
  const double top = height_of(0.965) - 0.4 * head;
  const double aside = half_width_(top) + head + p_.gap_mm;
  constexpr double kBehind = 35.0 * kDegree;
  fibula_head_ = {aside * std::cos(kBehind), -aside * std::sin(kBehind), top - head};
  fibula_foot_radius_mm_ = kFibulaFootPart * 0.35 * p_.width_12_mm;
  fibula_foot_ = {half_width_(plafond()) + fibula_foot_radius_mm_ + p_.gap_mm, -0.1 * p_.width_12_mm,
                  top - p_.fibula_length_mm + fibula_foot_radius_mm_};
  const double low = fibula_foot_.z(), high = fibula_head_.z(), length = high - low;
  fibula_radius_ = Profile({{low, 0.9 * fibula_foot_radius_mm_},
                            {low + 0.15 * length, half},
                            {low + 0.85 * length, half},
                            {high, 0.8 * head}});
}

Vec3 Tibia::fibula_centre(double z) const {
  const double t = std::clamp((z - fibula_foot_.z()) / (fibula_head_.z() - fibula_foot_.z()), 0.0, 1.0);
  return fibula_foot_ + t * (fibula_head_ - fibula_foot_);
}

double Tibia::tibia_mm(const Vec3& at) const {
  const double across = ellipse_mm(at.x(), at.y(), half_width_(at.z()), half_depth_(at.z()));
  const double slope = p_.slope_degrees * kDegree;
  double d = smooth_max(across, std::cos(slope) * at.z() - std::sin(slope) * at.y(), kPlateauBlend);
  d = smooth_max(d, plafond() - at.z(), kPlateauBlend);
  if (at.z() < height_of(0.4)) {
    const Vec3 above(malleolus_.x(), malleolus_.y(), plafond() + 2.0 * malleolus_radius_mm_);
    return smooth_min(d, round_cone_mm(at, malleolus_, malleolus_radius_mm_, above, 1.2 * malleolus_radius_mm_),
                      kMalleolusBlend);
  }
  const double tuberosity = kTuberositySize * p_.plateau_width_mm, spine = kSpineSize * p_.plateau_width_mm;
  d = smooth_min(d, ball_mm(at, tuberosity_, tuberosity), kTuberosityBlend);
  for (const double x : {-kSpineApart, kSpineApart})
    d = smooth_min(d, ball_mm(at, {x * p_.plateau_width_mm, 0.0, 0.0}, spine), kPlateauBlend);
  return d;
}

double Tibia::fibula_mm(const Vec3& at) const {
  const Vec3 centre = fibula_centre(at.z());
  double d = std::hypot(at.x() - centre.x(), at.y() - centre.y()) - fibula_radius_(at.z());
  d = smooth_max(smooth_max(d, fibula_foot_.z() - at.z(), 2.0), at.z() - fibula_head_.z(), 2.0);
  d = smooth_min(d, ball_mm(at, fibula_head_, 0.5 * p_.fibula_head_mm), kFibulaBlend);
  return smooth_min(d, ball_mm(at, fibula_foot_, fibula_foot_radius_mm_), kFibulaBlend);
}

std::vector<NamedValue> Tibia::parameters() const { return values_of<TibiaParameters>(p_, kTibiaFields); }

BoneDepths Tibia::depths(const Vec3& at_mm) const {
  const Vec3 at = own(at_mm);
  const double tibia = tibia_mm(at), fibula = fibula_mm(at);
  BoneDepths depths;
  depths.bone = tibia <= fibula ? 1 : 2;
  depths.surface_mm = std::min(tibia, fibula);
  double thickness = cortex_(at.z()), from = height_of(p_.marrow_from), to = height_of(p_.marrow_to);
  if (depths.bone == 2) {
    const double low = fibula_foot_.z(), length = fibula_head_.z() - low;
    from = low + 0.15 * length;
    to = low + 0.85 * length;
    const double middle = smooth_step(at.z(), low, from) - smooth_step(at.z(), to, fibula_head_.z());
    thickness = p_.shell_mm + (p_.fibula_cortex_mm - p_.shell_mm) * middle;
  }
  depths.cortex_mm = depths.surface_mm + thickness;
  depths.marrow_mm = std::max({depths.cortex_mm, from - at.z(), at.z() - to});
  return depths;
}

double Tibia::cancellous_g_cm3(const Vec3& at_mm) const {
  const Vec3 at = own(at_mm);
  // Densest below the plateau and above the ankle; it thins out towards the marrow.
  const double near_end = std::max(1.0 - smooth_step(at.z(), height_of(0.08), height_of(p_.marrow_from)),
                                   smooth_step(at.z(), height_of(p_.marrow_to), height_of(0.92)));
  return p_.cancellous_g_cm3 * (0.85 + 0.15 * near_end) * (1.0 + p_.texture * grain_noise(at, kTibiaGrain_mm));
}

BoneAnatomy Tibia::anatomy() const {
  BoneAnatomy found;
  const auto landmark = [&](const char* name, const Vec3& at) { found.landmarks.push_back({name, world(at)}); };
  const auto axis = [&](const char* name, const Vec3& at, const Vec3& direction) {
    found.axes.push_back({name, world(at), world(direction.normalized())});
  };
  const Vec3 ankle(0.0, 0.0, plafond());
  const Vec3 tuberosity(0.0, tuberosity_.y() + kTuberositySize * p_.plateau_width_mm, tuberosity_.z());
  const double slope = p_.slope_degrees * kDegree;
  landmark("knee centre", Vec3::Zero());
  landmark("ankle centre", ankle);
  landmark("tibial tuberosity", tuberosity);
  landmark("medial malleolus", malleolus_ - malleolus_radius_mm_ * Vec3::UnitZ());
  landmark("lateral malleolus", fibula_foot_ - fibula_foot_radius_mm_ * Vec3::UnitZ());
  landmark("fibular head", fibula_head_ + 0.5 * p_.fibula_head_mm * Vec3::UnitZ());
  axis("mechanical axis", ankle, Vec3::UnitZ());
  axis("plateau slope", Vec3::Zero(), Vec3(0.0, -std::cos(slope), -std::sin(slope)));
  return found;
}

Vec3 Tibia::between_bones(double z) const {
  const Vec3 middle(0.0, 0.0, z), fibula = fibula_centre(z), apart = fibula - middle;
  const Vec3 across = Vec3(apart.x(), apart.y(), 0.0).normalized();
  const double tibia = surface_from(middle, across, [this](const Vec3& at) { return tibia_mm(at); }).dot(across);
  return middle + 0.5 * (tibia + apart.norm() - fibula_radius_(z)) * across;
}

double Tibia::joint_face_mm(const Vec3& at) const {
  // An ellipse on each side of the eminences, as parts of the plateau, and nothing below it.
  constexpr double kAside = 0.29, kHalfWidth = 0.155, kHalfDepth = 0.38, kBelow_mm = 1.0;
  const double slope = p_.slope_degrees * kDegree;
  const double beside = ellipse_mm(std::abs(at.x()) - kAside * p_.plateau_width_mm, at.y(),
                                   kHalfWidth * p_.plateau_width_mm, kHalfDepth * p_.plateau_depth_mm);
  return std::max(beside, -kBelow_mm - std::cos(slope) * at.z() + std::sin(slope) * at.y());
}

std::vector<Structure> Tibia::structures() const {
  const Distance own_bone = [this](const Vec3& at) { return std::min(tibia_mm(at), fibula_mm(at)); };
  const Distance bone = [own_bone, this](const Vec3& at_mm) { return own_bone(own(at_mm)); };
  const double w = p_.plateau_width_mm, d = p_.plateau_depth_mm, l = p_.length_mm, head = p_.fibula_head_mm;
  std::vector<Structure> found;
  Box plateau;
  plateau.include(world({-0.5 * w, -0.5 * d, -0.15 * d}));
  plateau.include(world({0.5 * w, 0.5 * d, 0.15 * d}));
  found.push_back(cartilage("tibial cartilage", p_.cartilage_mm, plateau.grown(p_.cartilage_mm), bone,
                            [this](const Vec3& at) { return joint_face_mm(own(at)); }));
  const auto from_below = [&](double x, double y) {
    return world(surface_from({x * w, y * d, -0.15 * d}, Vec3::UnitZ(), own_bone));
  };
  const Vec3 tuberosity(0.0, tuberosity_.y() + kTuberositySize * w, tuberosity_.z());
  found.push_back(footprint("anterior cruciate ligament, tibia", from_below(-0.02, 0.2), 6.0, bone));
  found.push_back(footprint("posterior cruciate ligament, tibia", from_below(0.0, -0.4), 6.0, bone));
  found.push_back(footprint("patellar ligament, tibia", world(tuberosity), 8.0, bone));
  found.push_back(
      footprint("lateral collateral ligament, fibula", world(fibula_head_ + 0.5 * head * Vec3::UnitX()), 4.0, bone));

  const auto line = [&](const std::vector<Beside>& points, double hollow_mm) {
    std::vector<Vec3> made = line_beside(points, hollow_mm, own_bone);
    for (Vec3& at : made) at = world(at);
    return made;
  };
  // The popliteal artery lies behind the plateau. The anterior tibial one passes between the bones.
  std::vector<Vec3> popliteal = line({{{0.0, 0.0, 8.0}, -Vec3::UnitY(), 9.0},
                                      {{0.02 * w, 0.0, -0.05 * l}, -Vec3::UnitY(), 8.0},
                                      {{0.04 * w, 0.0, -0.14 * l}, -Vec3::UnitY(), 8.0}},
                                     30.0);
  std::vector<Vec3> anterior;
  for (const auto& [part, forward_mm] :
       {std::pair{0.17, -12.0}, {0.185, -4.0}, {0.2, 3.0}, {0.23, 5.0}, {0.3, 4.0}, {0.4, 4.0}, {0.48, 4.0}})
    anterior.push_back(world(between_bones(-part * l) + forward_mm * Vec3::UnitY()));
  popliteal.push_back(anterior.front());
  // The common peroneal nerve winds around the fibula's neck, from behind its head to the front.
  const auto beside_neck = [&](double heads_down, const Vec3& direction, double clear_mm) {
    return Beside{fibula_centre(fibula_head_.z() - heads_down * head), direction, clear_mm};
  };
  std::vector<Vec3> peroneal = line({beside_neck(0.0, {0.1, -1.0, 0.0}, 7.0), beside_neck(0.5, {0.6, -0.8, 0.0}, 5.0),
                                     beside_neck(0.9, {1.0, -0.1, 0.0}, 4.0), beside_neck(1.3, {0.85, 0.5, 0.0}, 4.0)},
                                    8.0);
  found.push_back(tube("popliteal artery", LabelKind::vessel, rounded(popliteal), kPopliteal_mm, bone));
  found.push_back(tube("anterior tibial artery", LabelKind::vessel, rounded(anterior), 2.0, bone));
  found.push_back(tube("common peroneal nerve", LabelKind::nerve, std::move(peroneal), 2.5, bone));
  return found;
}

Box Tibia::bounds() const {
  constexpr double kBeyond_mm = 4.0;  // blends stand out a little
  Box box;
  const auto include = [&](const Vec3& at, double radius) {
    box.include(world(at) - Vec3::Constant(radius));
    box.include(world(at) + Vec3::Constant(radius));
  };
  for (int step = 0; step <= 50; ++step) {
    const double z = height_of(step / 50.0);
    const Vec3 half(half_width_(z), half_depth_(z), 0.0);
    box.include(world(Vec3(0.0, 0.0, z) - half));
    box.include(world(Vec3(0.0, 0.0, z) + half));
  }
  // The plateau rises towards the front, and the spines stand on it.
  include(Vec3::Zero(), kSpineSize * p_.plateau_width_mm);
  box.include(
      world({0.0, 0.5 * p_.plateau_depth_mm, 0.5 * p_.plateau_depth_mm * std::tan(p_.slope_degrees * kDegree)}));
  include(malleolus_, malleolus_radius_mm_);
  include(tuberosity_, kTuberositySize * p_.plateau_width_mm);
  include(fibula_head_, 0.5 * p_.fibula_head_mm);
  include(fibula_foot_, fibula_foot_radius_mm_);
  return box.grown(kBeyond_mm);
}

}  // namespace osteon::phantoms
