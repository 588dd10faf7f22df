#include "server/net/person_certificate.hpp"

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <ctime>
#include <memory>

#include "common/access/ticket.hpp"

namespace osteon {
namespace {

constexpr std::string_view kPerson = "osteon://person/";

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* what) const {
    Free(what);
  }
};
void free_text(char* text) { OPENSSL_free(text); }
using Bio = std::unique_ptr<BIO, Freed<BIO_free>>;
using X509Ptr = std::unique_ptr<X509, Freed<X509_free>>;
using Names = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;
using Number = std::unique_ptr<BIGNUM, Freed<BN_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Text = std::unique_ptr<char, Freed<free_text>>;

Bio reader_of(std::string_view pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

X509Ptr first_of(std::string_view pem) {
  const Bio bio = reader_of(pem);
  return X509Ptr(bio ? PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr) : nullptr);
}

}  // namespace

Result<PersonCertificate> read_person_certificate(std::string_view pem) {
  const X509Ptr x509 = first_of(pem);
  if (!x509) return failure(ErrorCode::invalid_input, "the certificate cannot be read; ask for a new one");
  PersonCertificate certificate;

  const Names names(static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(x509.get(), NID_subject_alt_name, nullptr, nullptr)));
  int people = 0;
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* name = sk_GENERAL_NAME_value(names.get(), i);
    if (name->type != GEN_URI) continue;
    const ASN1_IA5STRING* uri = name->d.uniformResourceIdentifier;
    // By its length: a zero byte within ends no name.
    const std::string_view text(reinterpret_cast<const char*>(ASN1_STRING_get0_data(uri)), static_cast<std::size_t>(ASN1_STRING_length(uri)));
    if (!text.starts_with(kPerson)) continue;
    ++people;
    certificate.user = text.substr(kPerson.size());
  }
  if (people != 1 || !is_user_name(certificate.user))
    return failure(ErrorCode::invalid_input,
                   "the certificate does not name one person (osteon://person/NAME); make one with deploy/certs person NAME");

  const Number number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(x509.get()), nullptr));
  const Text digits(number ? BN_bn2hex(number.get()) : nullptr);
  std::tm ends{};
  if (!digits || ASN1_TIME_to_tm(X509_get0_notAfter(x509.get()), &ends) != 1)
    return failure(ErrorCode::invalid_input, "the certificate has no number or no end; ask for a new one");
  certificate.serial = digits.get();
  certificate.ends = std::chrono::sys_seconds{std::chrono::seconds(timegm(&ends))};
  return certificate;
}

Result<void> check_key_pair(std::string_view certificate_pem, std::string_view key_pem) {
  const X509Ptr x509 = first_of(certificate_pem);
  if (!x509) return failure(ErrorCode::invalid_input, "the certificate cannot be read");
  const Bio bio = reader_of(key_pem);
  const Key key(bio ? PEM_read_bio_PrivateKey(bio.get(), nullptr, [](char*, int, int, void*) { return 0; }, nullptr) : nullptr);
  if (!key) return failure(ErrorCode::invalid_input, "the key cannot be read (it may have no pass phrase)");
  if (X509_check_private_key(x509.get(), key.get()) != 1) return failure(ErrorCode::invalid_input, "the key is not that of the certificate");
  return {};
}

}  // namespace osteon
