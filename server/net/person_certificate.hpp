// What a certificate in PEM says of the person who holds it.
#pragma once
#include <chrono>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon {

struct PersonCertificate {
  std::string user;    // of its name osteon://person/USER
  std::string serial;  // hexadecimal, upper case
  std::chrono::sys_seconds ends{};
};

// The first one in `pem`. Says nothing of who signed it: that was checked in the handshake. Errors: invalid_input (it cannot be
// read, or names no person or several).
[[nodiscard]] Result<PersonCertificate> read_person_certificate(std::string_view pem);
// Error invalid_input: one of them cannot be read, or the key is not that of the certificate.
[[nodiscard]] Result<void> check_key_pair(std::string_view certificate_pem, std::string_view key_pem);

}  // namespace osteon
