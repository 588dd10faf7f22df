// How long a certificate is still good.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"

namespace osteon {

// Days from now to the notAfter of the first certificate of a PEM file; negative once it is over. Errors: not_found (no file),
// invalid_input (no certificate in it).
[[nodiscard]] Result<double> certificate_days_left(const std::filesystem::path& pem);

}  // namespace osteon
