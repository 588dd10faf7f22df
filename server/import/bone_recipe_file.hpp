// The YAML file in which a person writes the parameters of a phantom bone.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "common/phantoms/phantom_bone.hpp"

namespace osteon::import {

// Fields, all optional: preset, condition and side are words, and parameters a map from a parameter's name to a number.
// What the file does not name keeps the value of `recipe`. Error: invalid_input, naming the file, the field and the
// remedy. Ranges are checked by phantoms::make_bone().
[[nodiscard]] Result<phantoms::BoneRecipe> parse_bone_recipe(std::string_view text, const std::string& file_name,
                                                             phantoms::BoneRecipe recipe);

// Errors: not_found, unavailable (no permission), invalid_input (longer than 1 MiB) too.
[[nodiscard]] Result<phantoms::BoneRecipe> read_bone_recipe(const std::filesystem::path& file,
                                                            phantoms::BoneRecipe recipe);

}  // namespace osteon::import
