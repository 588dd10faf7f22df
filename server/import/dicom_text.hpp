// Values of DICOM attributes as text and as numbers.
#pragma once
#include <string>
#include <vector>

namespace osteon::import {

// Without the blanks and zeros that pad it.
[[nodiscard]] std::string trimmed(std::string text);

// "1.0\0.0": values separated by backslashes. Empty if any is not a finite number.
[[nodiscard]] std::vector<double> numbers(const std::string& text);
// The first of them, rounded down to zero; `otherwise` if there is none.
[[nodiscard]] int integer(const std::string& text, int otherwise);
// Lengths and positions within 1 km. Values beyond it count as missing.
[[nodiscard]] std::vector<double> near(std::vector<double> values);

}  // namespace osteon::import
