// Names of tools, of their groups and of force laws in the user's language.
#pragma once
#include <QString>
#include <string>

namespace osteon {

// The title of a built-in tool; the name itself if there is no such tool.
[[nodiscard]] QString tool_title(const std::string& name);
// `name`: of a group in tool_groups().
[[nodiscard]] QString group_title(const std::string& name);
// `name`: of a law in force_laws().
[[nodiscard]] QString law_title(const std::string& name);

}  // namespace osteon
