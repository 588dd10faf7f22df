#include "server/import/dicom_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace osteon::import {
namespace {

constexpr double kFarthestSlice_mm = 1e6;

}  // namespace

std::string trimmed(std::string text) {
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && is_padding(text.back())) text.pop_back();
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), is_padding));
  return text;
}

std::vector<double> numbers(const std::string& text) {
  std::vector<double> values;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\\', begin), text.size());
    const std::string number = trimmed(text.substr(begin, end - begin));
    char* stop = nullptr;
    const double value = std::strtod(number.c_str(), &stop);
    if (number.empty() || *stop != '\0' || !std::isfinite(value)) return {};
    values.push_back(value);
    begin = end + 1;
  }
  return values;
}

std::vector<double> near(std::vector<double> values) {
  if (std::ranges::any_of(values, [](double v) { return std::abs(v) > kFarthestSlice_mm; })) values.clear();
  return values;
}

int integer(const std::string& text, int otherwise) {
  const auto values = numbers(text);
  return values.empty() ? otherwise : static_cast<int>(std::clamp(values.front(), -1e9, 1e9));
}

}  // namespace osteon::import
