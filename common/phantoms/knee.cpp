#include "common/phantoms/knee.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "common/phantoms/femur.hpp"
#include "common/phantoms/joint.hpp"
#include "common/phantoms/patella.hpp"
#include "common/phantoms/structures.hpp"
#include "common/phantoms/tibia.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kTibiaForward = 0.12;  // of its plateau's middle before the condyles, as a part of its depth [A]
constexpr double kLigamentEnd = 0.1;  // of the patellar ligament above the tuberosity's tip, of the plateau's width [A]
constexpr double kApart_mm = 1.0;     // of any two bones, at least
constexpr double kSampleStep_mm = 2.0;  // of the patella's back

using KneeField = ParameterField<KneeParameters>;
using N = KneeParameters;
constexpr KneeField kKneeFields[] = {
    {"joint_gap_mm", &N::joint_gap_mm, 1.5, 10.0},    {"patella_gap_mm", &N::patella_gap_mm, 1.5, 12.0},
    {"insall_salvati", &N::insall_salvati, 0.7, 1.6}, {"femur_cut_mm", &N::femur_cut_mm, 60.0, 160.0},
    {"tibia_cut_mm", &N::tibia_cut_mm, 60.0, 160.0},
};

struct KneeBones {
  KneeParameters knee;
  FemurParameters femur;
  TibiaParameters tibia;
  PatellaParameters patella;
};

Result<KneeBones> knee_bones(const BoneRecipe& recipe) {
  const std::vector<std::string_view> names = names_of<KneeParameters>(kKneeFields);
  const MemberParameters bones[] = {{"femur", names_of(femur_fields())},
                                    {"tibia", names_of(tibia_fields())},
                                    {"patella", names_of(patella_fields())}};
  auto changes = joint_changes("knee", recipe.changes, names, bones);
  if (!changes) return tl::unexpected(changes.error());
  KneeBones found;
  KneeParameters& k = found.knee;
  if (recipe.preset == "female" || recipe.preset == "small")
    for (double N::*const gap : {&N::joint_gap_mm, &N::patella_gap_mm}) k.*gap *= 38.844 / 41.978;
  if (auto changed = change<KneeParameters>(k, kKneeFields, changes->own); !changed)
    return tl::unexpected(changed.error());

  // What a recipe does not say of cartilage follows from the gaps. It fills them as far as a bone's cartilage may.
  const auto part_of = [&](std::string_view member, const auto& fields, double cartilage_mm) {
    std::map<std::string, double>& own = changes->members.find(member)->second;
    const auto& field = field_of(fields, "cartilage_mm");
    own.emplace("cartilage_mm", std::clamp(cartilage_mm, field.least, field.most));
    return BoneRecipe{std::string(member), recipe.side, recipe.preset, recipe.condition, own};
  };
  const double most_mm = k.patella_gap_mm - field_of(patella_fields(), "cartilage_mm").least;
  const auto femur =
      of_member("femur", femur_parameters(part_of("femur", femur_fields(), std::min(0.5 * k.joint_gap_mm, most_mm))));
  if (!femur) return tl::unexpected(femur.error());
  const auto tibia =
      of_member("tibia", tibia_parameters(part_of("tibia", tibia_fields(), k.joint_gap_mm - femur->cartilage_mm)));
  if (!tibia) return tl::unexpected(tibia.error());
  const auto patella = of_member(
      "patella", patella_parameters(part_of("patella", patella_fields(), k.patella_gap_mm - femur->cartilage_mm)));
  if (!patella) return tl::unexpected(patella.error());
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  const DependentLimit gaps[] = {
      {"joint_gap_mm", femur->cartilage_mm + tibia->cartilage_mm, kNoLimit, "cartilage_mm of femur and tibia"},
      {"patella_gap_mm", femur->cartilage_mm + patella->cartilage_mm, kNoLimit, "cartilage_mm of femur and patella"}};
  if (auto fits = check_parameters<KneeParameters>(k, kKneeFields, gaps); !fits) return tl::unexpected(fits.error());
  found.femur = *femur;
  found.tibia = *tibia;
  found.patella = *patella;
  return found;
}

// The plateau is the joint's gap away from both condyles, along its own normal.
Pose tibia_pose(const KneeBones& bones, const Femur& femur) {
  const double slope = bones.tibia.slope_degrees * std::numbers::pi / 180.0;
  const Vec3 normal(0.0, std::sin(slope), std::cos(slope));
  const double y = -kTibiaForward * bones.tibia.plateau_depth_mm;
  const double reach = femur.lowest_along_mm(normal) - bones.knee.joint_gap_mm;
  Pose pose;
  pose.position_mm = {0.0, y, (reach - normal.y() * y) / normal.z()};
  return pose;
}

// Points of the patella's back, in its frame.
std::vector<Vec3> back_of(const Patella& patella, const PatellaParameters& p) {
  const Distance bone = [&](const Vec3& at) { return patella.depths(at).surface_mm; };
  std::vector<Vec3> points;
  const int aside = static_cast<int>(0.5 * p.width_mm / kSampleStep_mm);
  const int high = static_cast<int>(p.height_mm / kSampleStep_mm);
  const int deep = static_cast<int>(2.0 * p.thickness_mm / kSampleStep_mm);
  for (int i = -aside; i <= aside; ++i)
    for (int j = 0; j <= high; ++j)
      for (int k = 0; k <= deep; ++k)
        if (const Vec3 at(i * kSampleStep_mm, 0.5 * (p.thickness_mm - k * kSampleStep_mm),
                          j * kSampleStep_mm - 0.5 * p.height_mm);
            bone(at) < 0.0) {
          points.push_back(surface_from(at, Vec3::UnitY(), bone));
          break;
        }
  return points;
}

// Its ridge lies before the middle of the groove. From the patella's apex to the end of its ligament it is as far as
// the patella's height times the ratio of Insall 1971. In turns, the patella moves along z to that length and along y
// to its gap from the femur, until both are as asked.
Result<Pose> patella_pose(const KneeBones& bones, const Femur& femur, const Patella& patella,
                          const Vec3& ligament_end) {
  constexpr int kMostRounds = 100;
  constexpr double kExact_mm = 1e-6, kGood_mm = 0.01;
  const std::vector<Vec3> back = back_of(patella, bones.patella);
  const Vec3 apex = point_of(patella, "patellar apex");
  const double ligament = bones.knee.insall_salvati * bones.patella.height_mm;
  Pose pose;
  pose.position_mm = {-point_of(patella, "patellar ridge").x(), -bones.femur.condyle_depth_mm, 0.0};
  double off_mm = std::numeric_limits<double>::infinity(), forward = 0.0;
  for (int round = 0; round < kMostRounds && std::abs(off_mm) > kExact_mm; ++round) {
    if (round > 0) pose.position_mm.y() += off_mm;
    forward = ligament_end.y() - pose.position_mm.y() - apex.y();
    pose.position_mm.z() =
        ligament_end.z() - apex.z() + std::sqrt(std::max(0.0, ligament * ligament - forward * forward));
    double gap = std::numeric_limits<double>::infinity();
    for (const Vec3& at : back) gap = std::min(gap, femur.depths(pose.point(at)).surface_mm);
    off_mm = gap - bones.knee.patella_gap_mm;
  }
  if (std::abs(off_mm) <= kGood_mm && ligament >= std::abs(forward)) return pose;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "insall_salvati is %.4g, with which the patellar ligament does not reach a patella before the femur; "
                "change it, patella_gap_mm or patella.height_mm",
                bones.knee.insall_salvati);
  return bad_input(text.data());
}

Result<void> check_knee_apart(const Joint& knee, const KneeParameters& p) {
  const auto found = knee.nearer_than(kApart_mm);
  if (!found) return {};
  const bool patella = found->second == "patella";
  const char* name = !patella ? "joint_gap_mm" : found->first == "femur" ? "patella_gap_mm" : "insall_salvati";
  const double value = !patella ? p.joint_gap_mm : found->first == "femur" ? p.patella_gap_mm : p.insall_salvati;
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(),
                "%s is %.4g, with which %s and %s come nearer than %g mm to each other; give a larger value", name,
                value, found->first.c_str(), found->second.c_str(), kApart_mm);
  return bad_input(text.data());
}

// Where vessels and nerves enter and leave a knee.
struct Passage {
  Vec3 hiatus, sciatic, anterior_tibial;  // ends of the femur's lines, and the begin of the tibia's
  Vec3 plateau;                           // its middle
  double lowest_z = 0.0, highest_z = 0.0;
};

std::vector<Structure> knee_structures(const Joint& knee, const Passage& p) {
  const Distance bone = [&knee](const Vec3& at) { return knee.depths(at).surface_mm; };
  constexpr double kHollowOfKnee_mm = 60.0;
  const auto behind = [](const Vec3& at, double clear_mm) { return Beside{at, Vec3::UnitY(), clear_mm}; };
  const auto passing = [&](const char* name, LabelKind kind, const std::vector<Vec3>& line, double radius_mm) {
    Structure made = tube(name, kind, rounded(line), radius_mm, bone);
    made.bounds.min_mm.z() = std::max(made.bounds.min_mm.z(), p.lowest_z);
    made.bounds.max_mm.z() = std::min(made.bounds.max_mm.z(), p.highest_z);
    made.distance_mm = [tube_mm = std::move(made.distance_mm), p](const Vec3& at) {
      return std::max({tube_mm(at), p.lowest_z - at.z(), at.z() - p.highest_z});
    };
    return made;
  };
  const Vec3 low(0.2 * p.anterior_tibial.x(), p.plateau.y(), 0.5 * (p.plateau.z() + p.anterior_tibial.z()));
  std::vector<Vec3> artery = line_beside({behind({p.sciatic.x(), 0.0, p.hiatus.z() - 20.0}, 9.0),
                                          behind({0.0, 0.0, p.plateau.z()}, 9.0), behind(low, 8.0)},
                                         kHollowOfKnee_mm, bone);
  artery.insert(artery.begin(), p.hiatus);
  artery.push_back(p.anterior_tibial);
  std::vector<Vec3> nerve =
      line_beside({behind({p.sciatic.x(), 0.0, p.sciatic.z() - 4.0}, 17.0), behind({0.0, 0.0, p.plateau.z()}, 18.0),
                   behind({0.0, p.plateau.y(), p.lowest_z}, 18.0)},
                  kHollowOfKnee_mm, bone);
  nerve.insert(nerve.begin(), p.sciatic);
  return {passing("popliteal artery", LabelKind::vessel, artery, kPopliteal_mm),
          passing("tibial nerve", LabelKind::nerve, nerve, 3.0)};
}

}  // namespace

std::span<const ParameterField<KneeParameters>> knee_fields() { return kKneeFields; }

Result<std::unique_ptr<PhantomBone>> make_knee(const BoneRecipe& recipe) {
  const auto bones = knee_bones(recipe);
  if (!bones) return tl::unexpected(bones.error());
  const KneeParameters& p = bones->knee;
  auto femur = std::make_unique<Femur>(bones->femur, recipe.side);
  auto tibia = std::make_unique<Tibia>(bones->tibia, recipe.side);
  auto patella = std::make_unique<Patella>(bones->patella, recipe.side);
  const Pose below = tibia_pose(*bones, *femur);
  const Vec3 ligament_end =
      point_of(*tibia, "tibial tuberosity") + kLigamentEnd * bones->tibia.plateau_width_mm * Vec3::UnitZ();
  const auto before = patella_pose(*bones, *femur, *patella, below.point(ligament_end));
  if (!before) return tl::unexpected(before.error());
  const Passage passage{line_of(*femur, "femoral artery").back(),
                        line_of(*femur, "sciatic nerve").back(),
                        below.point(line_of(*tibia, "anterior tibial artery").front()),
                        below.position_mm,
                        below.position_mm.z() - p.tibia_cut_mm,
                        femur->lowest_along_mm(Vec3::UnitZ()) + p.femur_cut_mm};
  std::vector<JointMember> members;
  members.push_back({"femur", std::move(femur), {}, Cut{{0.0, 0.0, passage.highest_z}, Vec3::UnitZ()}});
  members.push_back({"tibia", std::move(tibia), below, Cut{{0.0, 0.0, -p.tibia_cut_mm}, -Vec3::UnitZ()}});
  members.push_back({"patella", std::move(patella), *before});
  auto knee = std::make_unique<Joint>(std::move(members), values_of<KneeParameters>(p, kKneeFields));
  if (auto apart = check_knee_apart(*knee, p); !apart) return tl::unexpected(apart.error());
  knee->set_structures(knee_structures(*knee, passage));
  return knee;
}

}  // namespace osteon::phantoms
