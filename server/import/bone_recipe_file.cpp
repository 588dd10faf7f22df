#include "server/import/bone_recipe_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <span>

#include "common/core/bounded_text.hpp"
#include "server/import/yaml_fields.hpp"

namespace osteon::import {
namespace {

constexpr double kMostParameter = 1e6;  // of any; its own range is narrower
constexpr YamlList kParameterList{"parameters", "parameter", "write preset: female, and parameters: {length_mm: 400}",
                                  1};

std::string word_of(const YAML::Node& node, const std::string& field, std::span<const std::string_view> known) {
  if (node.IsScalar() && std::ranges::find(known, node.Scalar()) != known.end()) return node.Scalar();
  throw YamlFault{field + " is " + (node.IsScalar() ? quoted_value(node.Scalar()) : "not a word") + "; write one of " +
                  names_in(known, [](std::string_view name) { return name; })};
}

void take_fields(const YAML::Node& root, phantoms::BoneRecipe& recipe) {
  if (!root.IsMap()) throw YamlFault{std::string("it has no fields; ") + kParameterList.remedy};
  check_fields(root, "the file", {}, {"preset", "condition", "side", "parameters"});
  if (const YAML::Node node = root["preset"]) recipe.preset = word_of(node, "preset", phantoms::kPresets);
  if (const YAML::Node node = root["condition"]) recipe.condition = word_of(node, "condition", phantoms::kConditions);
  constexpr std::string_view kSides[] = {"left", "right"};
  const YAML::Node side = root["side"];
  if (side && phantoms::has_both_sides(recipe.kind))
    throw YamlFault{"side is for a bone of one side; leave it out for a " + recipe.kind + ", which has both sides"};
  if (side) recipe.side = word_of(side, "side", kSides) == "left" ? phantoms::Side::left : phantoms::Side::right;
  const YAML::Node parameters = root["parameters"];
  if (!parameters) return;
  if (!parameters.IsMap()) throw YamlFault{std::string("parameters is not a map; ") + kParameterList.remedy};
  for (const auto& pair : parameters) {
    if (!pair.first.IsScalar())
      throw YamlFault{std::string("a name in parameters is not a word; ") + kParameterList.remedy};
    const std::string name = bounded_text(pair.first.Scalar(), 60);
    const double value =
        number_of(pair.second, name, -kMostParameter, kMostParameter, "write a number, such as 40 or 0.5");
    if (!recipe.changes.emplace(name, value).second) throw YamlFault{name + " is there twice; remove one"};
  }
}

}  // namespace

Result<phantoms::BoneRecipe> parse_bone_recipe(std::string_view text, const std::string& file_name,
                                               phantoms::BoneRecipe recipe) try {
  take_fields(YAML::Load(std::string(text)), recipe);
  return recipe;
} catch (const YamlFault& fault) {
  return bad_input(file_name + ": " + fault.what);
} catch (const YAML::Exception& error) {
  const std::string line = error.mark.is_null() ? "" : ", line " + std::to_string(error.mark.line + 1);
  return bad_input(file_name + line + ": this is not YAML (" + bounded_text(error.msg, 120) + "); " +
                   kParameterList.remedy);
}

Result<phantoms::BoneRecipe> read_bone_recipe(const std::filesystem::path& file, phantoms::BoneRecipe recipe) {
  const auto text = read_yaml_list(file, kParameterList);
  if (!text) return tl::unexpected(text.error());
  return parse_bone_recipe(*text, file.string(), std::move(recipe));
}

}  // namespace osteon::import
