// Certificates that nobody would make on purpose.
#pragma once
#include <chrono>
#include <filesystem>

namespace osteon::test {

// Signs the certificate in the PEM file anew, to hold from `begins` to `ends` from now. `authority`: the folder with
// ca.pem and ca.key, as deploy/certs authority makes it.
void resign(const std::filesystem::path& certificate, const std::filesystem::path& authority,
            std::chrono::seconds begins, std::chrono::seconds ends);

}  // namespace osteon::test
