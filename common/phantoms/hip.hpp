// A hip: one hip bone, and the proximal end of a femur whose head is in the acetabulum. The two do not touch.
#pragma once
#include <memory>
#include <span>

#include "common/phantoms/bone_parameters.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

struct HipParameters {
  double shaft_mm = 60.0;  // of the femur, from the tip of the lesser trochanter to the cut
};

[[nodiscard]] std::span<const ParameterField<HipParameters>> hip_fields();

// The frame is that of a pelvis, in which the femur stands upright: its z is that of the pelvis. The centres of head
// and acetabulum are one point. A recipe changes `shaft_mm`, and parameters of the bones as pelvis.NAME and femur.NAME.
// Error: invalid_input, naming the parameter that is wrong, such as a head that does not fit the acetabulum.
[[nodiscard]] Result<std::unique_ptr<PhantomBone>> make_hip(const BoneRecipe& recipe);

}  // namespace osteon::phantoms
