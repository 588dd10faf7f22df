// Names of planned axes and of structures at risk in the user's language.
#pragma once
#include <QString>
#include <string>

namespace osteon {

// The name itself if it is none of Osteon's own phantoms: a case of the user's has the names that its user gave.
[[nodiscard]] QString structure_title(const std::string& name);

}  // namespace osteon
