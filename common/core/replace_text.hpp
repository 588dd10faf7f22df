// Changes of names in sentences.
#pragma once
#include <string>
#include <string_view>

namespace osteon {

// `old` is not empty.
void replace_all(std::string& text, std::string_view old, std::string_view now);

}  // namespace osteon
