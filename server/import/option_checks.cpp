#include "server/import/option_checks.hpp"

#include <cstdio>
#include <string>

namespace osteon::import {

CLI::Validator within(double low, double high) {
  char text[64];
  std::snprintf(text, sizeof text, "NUMBER in [%g - %g]", low, high);
  const auto check = [low, high](const std::string& value) {
    double number = 0.0;
    if (CLI::detail::lexical_cast(value, number) && number >= low && number <= high) return std::string();
    char wrong[64];
    std::snprintf(wrong, sizeof wrong, " is not a number from %g to %g", low, high);
    return value + wrong;
  };
  return {check, text, "within"};
}

}  // namespace osteon::import
