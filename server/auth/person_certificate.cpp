#include "server/auth/person_certificate.hpp"

#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include <ctime>
#include <memory>
#include <optional>
#include <vector>

#include "common/access/ticket.hpp"
#include "common/wire/x509.hpp"

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
using Crl = std::unique_ptr<X509_CRL, Freed<X509_CRL_free>>;
using Store = std::unique_ptr<X509_STORE, Freed<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Freed<X509_STORE_CTX_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Text = std::unique_ptr<char, Freed<free_text>>;

Bio reader_of(std::string_view pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

X509Ptr first_of(std::string_view pem) {
  const Bio bio = reader_of(pem);
  return X509Ptr(bio ? PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr) : nullptr);
}

// Empty: it cannot be read.
std::string hex_of(const ASN1_INTEGER* serial) {
  const Number number(ASN1_INTEGER_to_BN(serial, nullptr));
  const Text digits(number ? BN_bn2hex(number.get()) : nullptr);
  return digits ? digits.get() : "";
}

// All objects of one kind in a PEM text. Nothing if any of them cannot be read. Other kinds are skipped.
template <class Ptr, auto Read>
std::optional<std::vector<Ptr>> all_of(std::string_view pem) {
  const Bio bio = reader_of(pem);
  if (!bio) return {};
  std::vector<Ptr> all;
  ERR_clear_error();
  while (auto* one = Read(bio.get(), nullptr, nullptr, nullptr)) all.emplace_back(one);
  // Reaching the end of the text is the only accepted error.
  const unsigned long last = ERR_peek_last_error();
  ERR_clear_error();
  if (ERR_GET_LIB(last) != ERR_LIB_PEM || ERR_GET_REASON(last) != PEM_R_NO_START_LINE) return {};
  return all;
}
std::optional<std::vector<X509Ptr>> certificates_of(std::string_view pem) {
  return all_of<X509Ptr, PEM_read_bio_X509>(pem);
}
std::optional<std::vector<Crl>> lists_of(std::string_view pem) { return all_of<Crl, PEM_read_bio_X509_CRL>(pem); }

// The same strength as Debian requires for TLS: 112 bits, no SHA-1.
constexpr int kSecurityLevel = 2;

// Accepts an expired list, and an authority without a list. OpenSSL checks revocations before signatures and times. So
// a revocation is only noted here and the check goes on: a certificate is called revoked only if nothing else is wrong
// with it.
int accept_old_lists(int ok, X509_STORE_CTX* context) {
  const int error = X509_STORE_CTX_get_error(context);
  if (error == X509_V_ERR_CERT_REVOKED) {
    *static_cast<bool*>(X509_STORE_CTX_get_app_data(context)) = true;
    return 1;
  }
  const bool is_old = error == X509_V_ERR_CRL_HAS_EXPIRED || error == X509_V_ERR_CRL_NOT_YET_VALID;
  return is_old || error == X509_V_ERR_UNABLE_TO_GET_CRL ? 1 : ok;
}

// The authorities and lists, ready for checks. Null if one of them cannot be read.
Store store_of(const Authorities& authorities) {
  const auto trusted = certificates_of(authorities.certificates);
  const auto lists = lists_of(authorities.revocation_lists);
  Store store(X509_STORE_new());
  if (!store || !trusted || trusted->empty() || !lists) return {};
  for (const X509Ptr& one : *trusted) X509_STORE_add_cert(store.get(), one.get());
  for (const Crl& one : *lists) X509_STORE_add_crl(store.get(), one.get());
  if (!lists->empty()) X509_STORE_set_flags(store.get(), X509_V_FLAG_CRL_CHECK | X509_V_FLAG_CRL_CHECK_ALL);
  X509_STORE_set_verify_cb(store.get(), accept_old_lists);
  return store;
}

ChainRefusal refusal_of(int error) {
  if (wire::is_unknown_authority(error))
    return {ChainFault::unknown_authority,
            "the certificate is of an authority that this server does not know; ask whoever runs it for one"};
  switch (error) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return {ChainFault::expired, "the certificate has expired; ask for a new one"};
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return {ChainFault::not_yet_valid, "the certificate does not hold yet; set the clocks of both machines"};
    case X509_V_ERR_CERT_REVOKED:
      return {ChainFault::revoked, "the certificate was revoked; ask for a new one"};
    case X509_V_ERR_INVALID_PURPOSE:
      return {ChainFault::purpose, "the certificate is not for a person; make one with deploy/certs person NAME"};
    default:
      return {ChainFault::other,
              "the certificate cannot be accepted: " + std::string(X509_verify_cert_error_string(error))};
  }
}

}  // namespace

tl::expected<void, ChainRefusal> check_client_chain(std::string_view chain_pem, const Authorities& authorities,
                                                    std::chrono::sys_seconds now) {
  const auto chain = certificates_of(chain_pem);
  if (!chain || chain->empty())
    return tl::unexpected(ChainRefusal{ChainFault::unreadable, "the certificate cannot be read; ask for a new one"});
  const Store store = store_of(authorities);
  const StoreContext context(X509_STORE_CTX_new());
  STACK_OF(X509)* between = sk_X509_new_null();  // holds no references
  const std::unique_ptr<STACK_OF(X509), void (*)(STACK_OF(X509)*)> freed(between,
                                                                         [](STACK_OF(X509) * s) { sk_X509_free(s); });
  if (!store || !context || !between ||
      X509_STORE_CTX_init(context.get(), store.get(), chain->front().get(), between) != 1)
    return tl::unexpected(
        ChainRefusal{ChainFault::other, "the server cannot read its authority; tell whoever runs it"});
  for (std::size_t i = 1; i < chain->size(); ++i) sk_X509_push(between, (*chain)[i].get());
  X509_STORE_CTX_set_default(context.get(), "ssl_client");
  X509_VERIFY_PARAM* rules = X509_STORE_CTX_get0_param(context.get());
  X509_VERIFY_PARAM_set_auth_level(rules, kSecurityLevel);
  X509_VERIFY_PARAM_set_time(rules, static_cast<std::time_t>(now.time_since_epoch().count()));
  bool is_revoked = false;
  X509_STORE_CTX_set_app_data(context.get(), &is_revoked);
  const bool holds = X509_verify_cert(context.get()) == 1;
  const int error = holds ? X509_V_ERR_CERT_REVOKED : X509_STORE_CTX_get_error(context.get());
  ERR_clear_error();
  if (holds && !is_revoked) return {};
  return tl::unexpected(refusal_of(error));
}

Result<std::set<std::string>> listed_serials(const Authorities& authorities) {
  if (!store_of(authorities))
    return failure(ErrorCode::invalid_input, "a certificate or a revocation list in it cannot be read");
  std::set<std::string> serials;
  const auto lists = lists_of(authorities.revocation_lists);
  for (const Crl& list : *lists) {
    STACK_OF(X509_REVOKED)* revoked = X509_CRL_get_REVOKED(list.get());  // null if the list is empty
    for (int i = 0; i < sk_X509_REVOKED_num(revoked); ++i)
      serials.insert(hex_of(X509_REVOKED_get0_serialNumber(sk_X509_REVOKED_value(revoked, i))));
  }
  return serials;
}

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
    // By its length: a zero byte inside does not end the name.
    const std::string_view text(reinterpret_cast<const char*>(ASN1_STRING_get0_data(uri)),
                                static_cast<std::size_t>(ASN1_STRING_length(uri)));
    if (!text.starts_with(kPerson)) continue;
    ++people;
    certificate.user = text.substr(kPerson.size());
  }
  if (people != 1 || !is_user_name(certificate.user))
    return failure(
        ErrorCode::invalid_input,
        "the certificate does not name one person (osteon://person/NAME); make one with deploy/certs person NAME");

  certificate.serial = hex_of(X509_get0_serialNumber(x509.get()));
  std::tm ends{};
  if (certificate.serial.empty() || ASN1_TIME_to_tm(X509_get0_notAfter(x509.get()), &ends) != 1)
    return failure(ErrorCode::invalid_input, "the certificate has no number or no end; ask for a new one");
  certificate.ends = std::chrono::sys_seconds{std::chrono::seconds(timegm(&ends))};
  return certificate;
}

Result<void> check_key_pair(std::string_view certificate_pem, std::string_view key_pem) {
  const X509Ptr x509 = first_of(certificate_pem);
  if (!x509) return failure(ErrorCode::invalid_input, "the certificate cannot be read");
  const Bio bio = reader_of(key_pem);
  const Key key(bio ? PEM_read_bio_PrivateKey(
                          bio.get(), nullptr, [](char*, int, int, void*) { return 0; }, nullptr)
                    : nullptr);
  if (!key) return failure(ErrorCode::invalid_input, "the key cannot be read (it may have no pass phrase)");
  if (X509_check_private_key(x509.get(), key.get()) != 1)
    return failure(ErrorCode::invalid_input, "the key is not that of the certificate");
  return {};
}

}  // namespace osteon
