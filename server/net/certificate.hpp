// How long a server's certificate is still good, and for whom.
#pragma once
#include <chrono>
#include <filesystem>
#include <string>

#include "common/core/result.hpp"

namespace osteon {

// Days from now to the notAfter of the first certificate of a PEM file; negative once it is over. Errors: not_found (no
// file), invalid_input (no certificate in it).
[[nodiscard]] Result<double> certificate_days_left(const std::filesystem::path& pem);

// Writes into the log by which names clients may come and until when, and a warning where they cannot come at `now`:
// before it begins, after its end, or without a name. `pem`: with the server's certificate first.
void log_server_certificate(const std::filesystem::path& pem, std::chrono::sys_seconds now);

}  // namespace osteon
