// Icons of the tools, drawn from their own shapes, so that a new size or tool needs no new picture.
#pragma once
#include <QIcon>

#include "common/tools/tool.hpp"

namespace osteon {

// The tool from the side, its tip below. Cutting parts are in another colour than the shank.
[[nodiscard]] QIcon tool_icon(const Tool& tool);

}  // namespace osteon
