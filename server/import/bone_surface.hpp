// The whole surface of a bone, cut or not, as one closed mesh: coarse where it is uncut, fine where tools were.
#pragma once
#include "common/geometry/triangle_mesh.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon::import {

// The surface that viewers get at full detail, with shared vertices of blocks joined. It includes the normals.
// Error: cancelled, invalid_input (nothing is left of the bone).
[[nodiscard]] Result<TriangleMesh> bone_surface(const CutField& field, const KeepGoing& keep_going);

}  // namespace osteon::import
