// Valid values of each type that is sent. Targets use them as seeds.
#pragma once
#include "common/field/cut.hpp"
#include "common/field/restrictions.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/scene_item.hpp"

namespace osteon::fuzz {

[[nodiscard]] Cut a_cut();  // the first cut of author 1, with a drill
[[nodiscard]] SceneItem an_item();
[[nodiscard]] Restrictions a_supervision();
[[nodiscard]] Annotation an_annotation();
[[nodiscard]] CuttingState a_state();
[[nodiscard]] ViewFrustum a_look();

}  // namespace osteon::fuzz
