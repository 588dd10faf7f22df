// Reads certificates from files and as a server shows them, and checks them.
#pragma once
#include <openssl/x509.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace osteon::wire {

struct X509Free {
  void operator()(X509* one) const { X509_free(one); }
};
using X509Ptr = std::unique_ptr<X509, X509Free>;
struct KeyFree {
  void operator()(EVP_PKEY* one) const { EVP_PKEY_free(one); }
};
using KeyPtr = std::unique_ptr<EVP_PKEY, KeyFree>;

// The certificates in a PEM text, up to the first one that cannot be read.
[[nodiscard]] std::vector<X509Ptr> certificates_of(std::string_view pem);
// Null if it cannot be read. No pass phrase is asked for.
[[nodiscard]] KeyPtr key_of(std::string_view pem);

struct Validity {
  std::chrono::sys_seconds begins{}, ends{};
};
[[nodiscard]] Validity validity_of(const X509& certificate);
inline constexpr std::string_view kNoMachine = "no machine";
// The DNS names and IP addresses of a server's certificate: "a, b and c". kNoMachine if there is none.
[[nodiscard]] std::string machines_of(const X509& certificate);
// X509_V_OK if an authority in `authorities` issued the first of `chain` for TLS clients and it is valid now. Otherwise
// the reason.
[[nodiscard]] int verify_own(const std::vector<X509Ptr>& chain, const std::vector<X509Ptr>& authorities);
// X509_V_ERR codes which say that no known authority issued a certificate.
[[nodiscard]] bool is_unknown_authority(int verify_error);

// "2026-11-25 14:00:00 UTC"
[[nodiscard]] std::string text_of(std::chrono::sys_seconds time);

}  // namespace osteon::wire
