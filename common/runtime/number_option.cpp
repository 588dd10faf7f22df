#include "common/runtime/number_option.hpp"

#include <CLI/CLI.hpp>

#include <array>
#include <cstdio>
#include <string>

namespace osteon {
namespace {

std::string shown(double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", number);
  return text.data();
}

}  // namespace

CLI::Validator number_in(double least, double most) {
  const std::string wrong = " is not a number from " + shown(least) + " to " + shown(most);
  const auto check = [least, most, wrong](const std::string& text) {
    double number = 0.0;
    const bool good = CLI::detail::lexical_cast(text, number) && number >= least && number <= most;  // false for nan
    return good ? std::string() : text + wrong;
  };
  return {check, "NUMBER in [" + shown(least) + " - " + shown(most) + "]", "number in"};
}

}  // namespace osteon
