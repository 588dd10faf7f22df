#include "server/net/certificate.hpp"

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

#include "common/runtime/files.hpp"

namespace osteon {

Result<double> certificate_days_left(const std::filesystem::path& pem) {
  const Result<std::string> text = read_file(pem);
  if (!text) return tl::unexpected(text.error());
  const std::unique_ptr<BIO, decltype(&BIO_free)> bytes(BIO_new_mem_buf(text->data(), static_cast<int>(text->size())), BIO_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(PEM_read_bio_X509(bytes.get(), nullptr, nullptr, nullptr),
                                                                X509_free);
  int days = 0, seconds = 0;
  if (!certificate || ASN1_TIME_diff(&days, &seconds, nullptr, X509_get0_notAfter(certificate.get())) != 1)
    return failure(ErrorCode::invalid_input, pem.string() + " holds no certificate; give a PEM file, as deploy/certs writes it");
  return days + seconds / 86400.0;
}

}  // namespace osteon
