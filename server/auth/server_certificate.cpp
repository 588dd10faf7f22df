#include "server/auth/server_certificate.hpp"

#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <vector>

#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/wire/x509.hpp"

namespace osteon {

Result<double> certificate_days_left(const std::filesystem::path& pem) {
  const Result<std::string> text = read_file(pem);
  if (!text) return tl::unexpected(text.error());
  const std::unique_ptr<BIO, decltype(&BIO_free)> bytes(BIO_new_mem_buf(text->data(), static_cast<int>(text->size())),
                                                        BIO_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(
      PEM_read_bio_X509(bytes.get(), nullptr, nullptr, nullptr), X509_free);
  int days = 0, seconds = 0;
  if (!certificate || ASN1_TIME_diff(&days, &seconds, nullptr, X509_get0_notAfter(certificate.get())) != 1)
    return failure(ErrorCode::invalid_input,
                   pem.string() + " holds no certificate; give a PEM file, as deploy/certs writes it");
  return days + seconds / 86400.0;
}

void log_server_certificate(const std::filesystem::path& pem, std::chrono::sys_seconds now) {
  const Result<std::string> text = read_file(pem);
  const std::vector<wire::X509Ptr> chain = wire::certificates_of(text ? *text : std::string());
  if (chain.empty()) return;  // this error is reported elsewhere
  const wire::Validity valid = wire::validity_of(*chain.front());
  const std::string machines = wire::machines_of(*chain.front());
  log::info("server certificate", {{"for", machines}, {"until", wire::text_of(valid.ends)}});
  const auto warn = [](const std::string& said) { log::warn("server certificate", {{"said", said}}); };
  if (now >= valid.ends)
    warn("it expired at " + wire::text_of(valid.ends) +
         ", and no client takes it; make a new one with deploy/certs server");
  if (now < valid.begins)
    warn("it holds only from " + wire::text_of(valid.begins) + " on, and no client takes it; set this machine's clock");
  if (machines == wire::kNoMachine)
    warn("it is for no machine, and no client takes it; make one with deploy/certs server NAME...");
}

}  // namespace osteon
