// Elements of a DICOM file as bytes, explicit little endian, for tests that write files without GDCM.
#pragma once
#include <cstdint>
#include <cstdio>
#include <string>

namespace osteon::import {

[[nodiscard]] inline std::string little_endian(std::size_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> 8 * i & 0xff);
  return text;
}

// `vr`: the two letters of its type. Pads the value to an even length, as PS3.5, section 6.2 says.
[[nodiscard]] inline std::string element(std::uint16_t group, std::uint16_t number, const std::string& vr,
                                         std::string value) {
  const bool is_binary = vr == "OB" || vr == "OW", is_long = is_binary || vr == "SQ";
  if (value.size() % 2 != 0) value += vr == "UI" || is_binary ? '\0' : ' ';
  return little_endian(group, 2) + little_endian(number, 2) + vr + (is_long ? std::string(2, '\0') : "") +
         little_endian(value.size(), is_long ? 4 : 2) + value;
}

[[nodiscard]] inline std::string item(const std::string& content) {
  return little_endian(0xfffe, 2) + little_endian(0xe000, 2) + little_endian(content.size(), 4) + content;
}
[[nodiscard]] inline std::string sequence(std::uint16_t group, std::uint16_t number, const std::string& items) {
  return element(group, number, "SQ", items);
}

// A number of type DS, which has at most 16 characters.
[[nodiscard]] inline std::string decimal(double value) {
  char text[17];
  std::snprintf(text, sizeof text, "%.9f", value);
  return text;
}

}  // namespace osteon::import
