#include "common/phantoms/hip.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "common/phantoms/femur.hpp"
#include "common/phantoms/joint.hpp"
#include "common/phantoms/pelvis.hpp"

namespace osteon::phantoms {
namespace {

// From the head's bone to the acetabulum's, mm. Cartilage of both fills it. [A]
constexpr double kNarrowestGap_mm = 1.0, kWidestGap_mm = 4.0;
constexpr double kNearest_mm = 1.0;  // elsewhere

constexpr ParameterField<HipParameters> kHipFields[] = {{"shaft_mm", &HipParameters::shaft_mm, 20.0, 150.0}};

Result<void> check_cartilage(double acetabulum_mm, double head_mm, double gap_mm) {
  if (acetabulum_mm + head_mm <= gap_mm + 1e-9) return {};
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "pelvis.cartilage_mm is %.3g and femur.cartilage_mm is %.3g; give values whose sum is at most the gap "
                "between head and acetabulum, %.3g",
                acetabulum_mm, head_mm, gap_mm);
  return bad_input(text.data());
}

}  // namespace

std::span<const ParameterField<HipParameters>> hip_fields() { return kHipFields; }

Result<std::unique_ptr<PhantomBone>> make_hip(const BoneRecipe& recipe) {
  const std::vector<std::string_view> names = names_of<HipParameters>(kHipFields);
  const MemberParameters bones[] = {{"pelvis", names_of(pelvis_fields())}, {"femur", names_of(femur_fields())}};
  auto changes = joint_changes("hip", recipe.changes, names, bones);
  if (!changes) return tl::unexpected(changes.error());
  HipParameters own;
  if (auto changed = change<HipParameters>(own, kHipFields, changes->own); !changed)
    return tl::unexpected(changed.error());
  const auto recipe_of = [&](std::string_view member) {
    BoneRecipe found = recipe;
    found.kind = member;
    found.changes = changes->members[std::string(member)];
    return found;
  };
  auto pelvis = of_member("pelvis", pelvis_parameters(recipe_of("pelvis")));
  if (!pelvis) return tl::unexpected(pelvis.error());
  auto femur = of_member("femur", femur_parameters(recipe_of("femur")));
  if (!femur) return tl::unexpected(femur.error());
  const double socket_mm = pelvis->acetabulum_diameter_mm;
  const DependentLimit head[] = {{"head_diameter_mm", socket_mm - 2.0 * kWidestGap_mm,
                                  socket_mm - 2.0 * kNarrowestGap_mm, "pelvis.acetabulum_diameter_mm"}};
  if (auto fits = of_member("femur", check_parameters<FemurParameters>(*femur, femur_fields(), head)); !fits)
    return tl::unexpected(fits.error());
  const double gap_mm = 0.5 * (socket_mm - femur->head_diameter_mm);
  if (!changes->members["pelvis"].contains("cartilage_mm")) pelvis->cartilage_mm = 0.5 * gap_mm;
  if (!changes->members["femur"].contains("cartilage_mm"))
    femur->cartilage_mm = std::max(0.5, gap_mm - pelvis->cartilage_mm);
  if (auto fits = check_cartilage(pelvis->cartilage_mm, femur->cartilage_mm, gap_mm); !fits)
    return tl::unexpected(fits.error());

  JointMember hip_bone{.name = "pelvis", .bone = std::make_unique<Pelvis>(*pelvis, recipe.side)};
  JointMember thigh{.name = "femur", .bone = std::make_unique<Femur>(*femur, recipe.side)};
  thigh.pose.position_mm = point_of(*hip_bone.bone, "acetabular centre") - point_of(*thigh.bone, "head centre");
  thigh.cut = Cut{point_of(*thigh.bone, "lesser trochanter") - own.shaft_mm * Vec3::UnitZ(), -Vec3::UnitZ()};
  std::vector<JointMember> members;
  members.push_back(std::move(hip_bone));
  members.push_back(std::move(thigh));
  auto hip = std::make_unique<Joint>(std::move(members), values_of<HipParameters>(own, kHipFields));
  if (hip->nearer_than(kNearest_mm))
    return bad_input(
        "this femur comes nearer than 1 mm to this hip bone; change femur.neck_shaft_degrees, "
        "femur.offset_mm or pelvis.acetabulum_depth");
  return hip;
}

}  // namespace osteon::phantoms
