// What all programs check of a number on their command line.
#pragma once

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class Validator;
}

namespace osteon {

// A number within these limits. Unlike CLI::Range it refuses "nan". Who calls it includes CLI/CLI.hpp.
[[nodiscard]] CLI::Validator number_in(double least, double most);

}  // namespace osteon
