// Reads what a certificate in PEM says about its holder, and checks chains of certificates.
#pragma once
#include <chrono>
#include <set>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon {

struct PersonCertificate {
  std::string user;    // from its name osteon://person/USER
  std::string serial;  // hexadecimal, upper case
  std::chrono::sys_seconds ends{};
};

// Reads the first certificate in `pem`. Does not check who signed it: check_client_chain does. Errors: invalid_input
// (it cannot be read, or names no person or several).
[[nodiscard]] Result<PersonCertificate> read_person_certificate(std::string_view pem);

// What client certificates are checked against. Both in PEM; each may hold several, one after another.
struct Authorities {
  std::string certificates;
  std::string revocation_lists;  // CRLs of these authorities (RFC 5280, section 5); empty: there are none
  friend bool operator==(const Authorities&, const Authorities&) = default;
};
// revoked: nothing else is wrong with the certificate, so the person is known.
enum class ChainFault { unreadable, unknown_authority, not_yet_valid, expired, revoked, purpose, other };
struct ChainRefusal {
  ChainFault fault = ChainFault::other;
  std::string sentence;  // says what is wrong and the remedy
};
// Checks whether an authority signed the first certificate in `chain_pem` for TLS clients, and whether it is valid at
// `now`. The other certificates in `chain_pem` may be intermediate ones (RFC 5280, section 6). A revocation list still
// counts after its end: it is only older, and what it lists stays revoked.
[[nodiscard]] tl::expected<void, ChainRefusal> check_client_chain(std::string_view chain_pem,
                                                                  const Authorities& authorities,
                                                                  std::chrono::sys_seconds now);
// The serial numbers on the revocation lists, hexadecimal, upper case. Error invalid_input: a certificate or a list
// cannot be read, or there is no certificate.
[[nodiscard]] Result<std::set<std::string>> listed_serials(const Authorities& authorities);

// Error invalid_input: one of the two cannot be read, or the key does not belong to the certificate.
[[nodiscard]] Result<void> check_key_pair(std::string_view certificate_pem, std::string_view key_pem);

}  // namespace osteon
