// Reads and checks the files of a client's certificate before anything is sent to a server.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"
#include "common/wire/tls_probe.hpp"

namespace osteon::wire {

// `folder` contains ca.pem, person.pem and person.key. Errors: not_found (a file is missing or empty), invalid_input (a
// file is not what its name says, or the key does not belong to the certificate). Validity times are left to the
// server, because its clock counts.
[[nodiscard]] Result<ProbeFiles> read_certificate_files(const std::filesystem::path& folder);

}  // namespace osteon::wire
