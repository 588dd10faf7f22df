// Says how long a server's certificate is valid, and for which names.
#pragma once
#include <chrono>
#include <filesystem>
#include <string>

#include "common/core/result.hpp"

namespace osteon {

// Days from now to the notAfter of the first certificate of a PEM file; negative after its end. Errors: not_found (no
// file), invalid_input (no certificate in the file).
[[nodiscard]] Result<double> certificate_days_left(const std::filesystem::path& pem);

// Logs the names under which clients may connect, and until when. Logs a warning if clients cannot connect at `now`:
// the certificate is not yet valid, has expired, or has no name. `pem`: the server's certificate comes first.
void log_server_certificate(const std::filesystem::path& pem, std::chrono::sys_seconds now);

}  // namespace osteon
