// The table of a bone's parameters: one row names a member and its limits. Presets, files, checks and reports read it.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/check.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

template <class Parameters>
struct ParameterField {
  std::string_view name;
  double Parameters::*value;
  double least, most;
};

// "neck_shaft_degrees is 150; give a value from 115 to 140"
[[nodiscard]] inline tl::unexpected<Error> bad_parameter(std::string_view name, double value, double least,
                                                         double most) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%.*s is %g; give a value from %.5g to %.5g", static_cast<int>(name.size()),
                name.data(), value, least, most);
  return bad_input(text.data());
}

// The field of a name that the table has.
template <class Parameters>
[[nodiscard]] const ParameterField<Parameters>& field_of(std::span<const ParameterField<Parameters>> fields,
                                                         std::string_view name) {
  const auto field = std::ranges::find(fields, name, &ParameterField<Parameters>::name);
  OSTEON_CHECK(field != fields.end());
  return *field;
}

// Limits of a parameter that follow from other ones. They narrow those of its field.
struct DependentLimit {
  std::string_view name;
  double least, most;
  std::string_view others;  // from which the limits follow
};
inline constexpr double kLimitRounding = 1e-9;  // of a limit that is computed

// "crest_mm is 19, which does not fit wing_mm; give a value from 8 to 18". Limits are rounded to what they allow.
[[nodiscard]] inline tl::unexpected<Error> does_not_fit(double value, const DependentLimit& limit) {
  constexpr double kRounded = 0.01;
  const double least = kRounded * std::ceil((limit.least - kLimitRounding) / kRounded);
  const double most = kRounded * std::floor((limit.most + kLimitRounding) / kRounded);
  std::array<char, 80> number{}, range{};
  std::snprintf(number.data(), number.size(), " is %.5g", value);
  std::snprintf(range.data(), range.size(), "give a value from %.5g to %.5g", least, most);
  const std::string others(limit.others);
  return bad_input(std::string(limit.name) + number.data() + ", which does not fit " + others + "; " +
                   (least <= most ? range.data() : "change " + others));
}

// Values outside the limits of their fields, then those outside limits that follow from others. Error: invalid_input,
// naming the first such parameter and its range.
template <class Parameters>
[[nodiscard]] Result<void> check_parameters(const Parameters& parameters,
                                            std::span<const ParameterField<Parameters>> fields,
                                            std::span<const DependentLimit> limits) {
  for (const auto& field : fields)
    if (const double value = parameters.*field.value; !(value >= field.least && value <= field.most))
      return bad_parameter(field.name, value, field.least, field.most);
  for (const DependentLimit& limit : limits) {
    const auto& field = field_of<Parameters>(fields, limit.name);
    if (const double value = parameters.*field.value;
        !(value >= limit.least - kLimitRounding && value <= limit.most + kLimitRounding))
      return does_not_fit(
          value, {limit.name, std::max(limit.least, field.least), std::min(limit.most, field.most), limit.others});
  }
  return {};
}

// Sets what `changes` names. Errors: invalid_input, naming the parameter and its range, or the names that there are.
template <class Parameters>
[[nodiscard]] Result<void> change(Parameters& parameters, std::span<const ParameterField<Parameters>> fields,
                                  const std::map<std::string, double>& changes) {
  for (const auto& [name, value] : changes) {
    const auto field = std::ranges::find(fields, name, &ParameterField<Parameters>::name);
    if (field == fields.end()) {
      std::string message = "\"" + name + "\" is no parameter of this bone; write one of ";
      for (const auto& known : fields) {
        if (&known != &fields.front()) message += ", ";
        message += known.name;
      }
      return bad_input(message);
    }
    if (!(value >= field->least && value <= field->most)) return bad_parameter(name, value, field->least, field->most);
    parameters.*field->value = value;
  }
  return {};
}

template <class Parameters>
[[nodiscard]] std::vector<std::string_view> names_of(std::span<const ParameterField<Parameters>> fields) {
  std::vector<std::string_view> names;
  for (const auto& field : fields) names.push_back(field.name);
  return names;
}

template <class Parameters>
[[nodiscard]] std::vector<NamedValue> values_of(const Parameters& parameters,
                                                std::span<const ParameterField<Parameters>> fields) {
  std::vector<NamedValue> values;
  for (const auto& field : fields)
    values.push_back({std::string(field.name), parameters.*field.value, field.least, field.most});
  return values;
}

// Multiplies all lengths, whose names end in _mm, but for those that begin with one of `but`.
template <class Parameters>
void scale_lengths(Parameters& parameters, std::span<const ParameterField<Parameters>> fields, double factor,
                   std::string_view but = "\n") {
  for (const auto& field : fields)
    if (field.name.ends_with("_mm") && !field.name.starts_with(but)) parameters.*field.value *= factor;
}

// Cortex and cancellous bone of a condition of life, as factors of those of an adult.
struct ConditionFactors {
  double cortex = 1.0, cancellous = 1.0;
};
// Feik 1997 found a medullary canal of some 20 % of the section of the femur's midshaft in the young and of some 41 %
// in women in their eighties, without the pores of cortex. With these factors a young man's has 21 % and an
// osteoporotic woman's 42 %. [A] Cancellous bone.
[[nodiscard]] inline ConditionFactors factors_of(std::string_view condition) {
  if (condition == "young") return {1.1, 1.2};
  if (condition == "osteoporotic") return {0.8, 0.6};
  return {};
}

}  // namespace osteon::phantoms
