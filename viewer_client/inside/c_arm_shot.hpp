// The record of a shot of the C-arm as a line of a file, and the C-arm that it was shot with.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "common/radiology/c_arm.hpp"
#include "common/tools/c_arm_shot.hpp"

namespace osteon {

[[nodiscard]] radiology::CArm c_arm_at(const CArmPosition& position);

// One line of JSON, without its end.
[[nodiscard]] std::string line_of(const CArmShot& shot);
// None: the line is no shot, or one of its numbers is not possible.
[[nodiscard]] std::optional<CArmShot> shot_of(std::string_view line);

}  // namespace osteon
