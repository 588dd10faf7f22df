// What the commands of osteon-import check of a number on their command line.
#pragma once
#include <CLI/CLI.hpp>

namespace osteon::import {

// A number within these limits. Unlike CLI::Range it refuses "nan".
[[nodiscard]] CLI::Validator within(double low, double high);

}  // namespace osteon::import
