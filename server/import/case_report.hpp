// The text of `osteon-import info` about a case.
#pragma once
#include <string>

#include "common/volume/case.hpp"

namespace osteon::import {

[[nodiscard]] std::string report_text(const Case& bone);
[[nodiscard]] std::string report_json(const Case& bone);

}  // namespace osteon::import
