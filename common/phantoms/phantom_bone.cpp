#include "common/phantoms/phantom_bone.hpp"

#include <algorithm>
#include <span>

#include "common/phantoms/femur.hpp"
#include "common/phantoms/hip.hpp"
#include "common/phantoms/knee.hpp"
#include "common/phantoms/patella.hpp"
#include "common/phantoms/pelvis.hpp"
#include "common/phantoms/tibia.hpp"

namespace osteon::phantoms {
namespace {

// The part of a sample of `width_mm` that lies on the negative side of a face.
double share_beyond(double distance_mm, double width_mm) { return std::clamp(0.5 - distance_mm / width_mm, 0.0, 1.0); }

Result<void> check_word(const char* what, const std::string& word, std::span<const std::string_view> known) {
  if (std::ranges::find(known, word) != known.end()) return {};
  std::string all;
  for (const std::string_view name : known) all += (all.empty() ? "" : ", ") + std::string(name);
  return bad_input(std::string(what) + " \"" + word + "\" is not known; give one of " + all);
}

template <class Bone, class Parameters>
Result<std::unique_ptr<PhantomBone>> made(Result<Parameters> parameters, Side side) {
  if (!parameters) return tl::unexpected(parameters.error());
  return std::make_unique<Bone>(*parameters, side);
}

}  // namespace

BoneTissue tissue_of(const BoneDepths& at) {
  if (at.surface_mm >= 0.0) return BoneTissue::none;
  if (at.cortex_mm >= 0.0) return BoneTissue::cortical;
  return at.marrow_mm >= 0.0 ? BoneTissue::cancellous : BoneTissue::marrow;
}

Box with_structures(Box bounds, std::span<const Structure> structures) {
  for (const Structure& structure : structures) {
    bounds.include(structure.bounds.min_mm);
    bounds.include(structure.bounds.max_mm);
  }
  return bounds;
}

double PhantomBone::density_g_cm3(const Vec3& at_mm, double blur_mm) const {
  const BoneDepths at = depths(at_mm);
  const double inner = share_beyond(at.cortex_mm, blur_mm);
  const double cortical = cortical_g_cm3(at.bone), marrow = marrow_g_cm3(at.bone);
  if (inner == 0.0) return cortical;
  const double canal = share_beyond(at.marrow_mm, blur_mm);
  const double within = canal == 1.0 ? marrow : canal * marrow + (1.0 - canal) * cancellous_g_cm3(at_mm);
  return inner * within + (1.0 - inner) * cortical;
}

Result<std::unique_ptr<PhantomBone>> make_bone(const BoneRecipe& recipe) {
  if (auto known = check_word("the bone", recipe.kind, kBoneKinds); !known) return tl::unexpected(known.error());
  if (auto known = check_word("the preset", recipe.preset, kPresets); !known) return tl::unexpected(known.error());
  if (auto known = check_word("the condition", recipe.condition, kConditions); !known)
    return tl::unexpected(known.error());
  if (recipe.kind == "knee") return make_knee(recipe);
  if (recipe.kind == "patella") return made<Patella>(patella_parameters(recipe), recipe.side);
  if (recipe.kind == "tibia") return made<Tibia>(tibia_parameters(recipe), recipe.side);
  if (recipe.kind == "hip") return make_hip(recipe);
  if (recipe.kind == "pelvis") {
    const auto parameters = pelvis_parameters(recipe);
    if (!parameters) return tl::unexpected(parameters.error());
    return std::make_unique<Pelvis>(*parameters);
  }
  return made<Femur>(femur_parameters(recipe), recipe.side);
}

}  // namespace osteon::phantoms
