// A knee from parameters: the end of a femur, the upper ends of tibia and fibula, and a patella, in extension.
#pragma once
#include <memory>
#include <span>

#include "common/phantoms/bone_parameters.hpp"

namespace osteon::phantoms {

// The values are those of the preset "male". deploy/docs/phantoms.md says what each of them is, and its source. Those
// of the bones come after the bone's name, such as femur.length_mm; the fibula's are among the tibia's.
struct KneeParameters {
  double joint_gap_mm = 5.0;
  double patella_gap_mm = 5.5;
  double insall_salvati = 1.02;
  double femur_cut_mm = 110.0, tibia_cut_mm = 110.0;
};

[[nodiscard]] std::span<const ParameterField<KneeParameters>> knee_fields();

// The frame is that of the femur: the origin lies between its condyles, and z is the normal of the plane on which they
// rest. The tibia's shaft is along z. Bones are femur, tibia, fibula and patella. Errors: invalid_input, naming a
// parameter of the knee or, after its name, one of a bone; among them are parameters with which two bones touch.
[[nodiscard]] Result<std::unique_ptr<PhantomBone>> make_knee(const BoneRecipe& recipe);

}  // namespace osteon::phantoms
