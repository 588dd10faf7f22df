// Certificates with unusual periods of validity.
#pragma once
#include <chrono>
#include <filesystem>

namespace osteon::test {

// Signs the certificate in the PEM file again. It is then valid from `begins` to `ends`, counted from now. `authority`:
// the folder with ca.pem and ca.key, as deploy/certs authority makes it.
void resign(const std::filesystem::path& certificate, const std::filesystem::path& authority,
            std::chrono::seconds begins, std::chrono::seconds ends);

}  // namespace osteon::test
