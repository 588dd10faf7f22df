// What the definition of each kind of tool may contain: its fields, their limits, and how they must fit together. One
// table serves files, edits and messages from the network.
#pragma once
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/tools/tool.hpp"

namespace osteon {

inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;

struct KindName {
  ToolKind kind;
  std::string_view name;
};
[[nodiscard]] std::span<const KindName> tool_kinds();

struct FieldRule {
  std::string_view name;  // of the member of Tool
  double Tool::*number = nullptr;
  int Tool::*count = nullptr;      // instead of `number`
  double lowest = 0, highest = 0;  // both inclusive
  bool required = true;
  bool editable = false;
  [[nodiscard]] bool whole() const { return count != nullptr; }
};
// The fields of one kind, in the order in which they are written.
[[nodiscard]] std::vector<FieldRule> field_rules(ToolKind kind);

[[nodiscard]] double get_field(const Tool& tool, const FieldRule& rule);
void set_field(Tool& tool, const FieldRule& rule, double value);
// Sets the lengths that follow from others: the cutting length of a round bur, a sphere reamer or a trial cup.
void derive_fields(Tool& tool);

// "from 0.5 to 20". Angles in degrees.
[[nodiscard]] std::string limits_sentence(const FieldRule& rule);
// The fault, as a sentence with the field and the remedy. Nothing if there is none.
[[nodiscard]] std::optional<std::string> value_fault(const FieldRule& rule, double value);
[[nodiscard]] std::optional<std::string> tool_fault(const Tool& tool);

}  // namespace osteon
