#include "tests/support/content.hpp"
#include "tests/support/doors/altered.hpp"

#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/wire/x509.hpp"

namespace osteon::test {
void resign(const std::filesystem::path& certificate, const std::filesystem::path& authority,
            std::chrono::seconds begins, std::chrono::seconds ends) {
  const auto all = wire::certificates_of(content(certificate));
  const wire::KeyPtr key = wire::key_of(content(authority / "ca.key"));
  if (all.empty() || !key) throw std::runtime_error("no certificate or no key of an authority");
  X509* one = all.front().get();
  X509_gmtime_adj(X509_getm_notBefore(one), begins.count());
  X509_gmtime_adj(X509_getm_notAfter(one), ends.count());
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(certificate.c_str(), "w"), std::fclose);
  if (X509_sign(one, key.get(), EVP_sha256()) == 0 || !out || PEM_write_X509(out.get(), one) != 1)
    throw std::runtime_error("the certificate cannot be signed anew");
}

}  // namespace osteon::test
