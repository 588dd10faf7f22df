// The files of a client's certificate, looked at before anything is sent to a server.
#pragma once
#include <filesystem>

#include "common/core/result.hpp"
#include "common/wire/tls_probe.hpp"

namespace osteon::wire {

// `folder`: with ca.pem, person.pem and person.key. Errors: not_found (a file is missing or empty), invalid_input (it
// is not what its name says, or the key is not that of the certificate). What depends on the time is left to the
// server, whose clock counts.
[[nodiscard]] Result<ProbeFiles> read_certificate_files(const std::filesystem::path& folder);

}  // namespace osteon::wire
