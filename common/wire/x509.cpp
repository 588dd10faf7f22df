#include "common/wire/x509.hpp"

#include <arpa/inet.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>

#include <cstddef>
#include <ctime>

namespace osteon::wire {
namespace {

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* what) const {
    Free(what);
  }
};
using Bio = std::unique_ptr<BIO, Freed<BIO_free>>;
using Names = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;
using Store = std::unique_ptr<X509_STORE, Freed<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Freed<X509_STORE_CTX_free>>;

Bio reader_of(std::string_view pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

std::chrono::sys_seconds time_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return {};
  return std::chrono::sys_seconds{std::chrono::seconds(timegm(&parts))};
}

// Empty: it does not name a machine.
std::string machine_of(const GENERAL_NAME& name) {
  if (name.type != GEN_DNS && name.type != GEN_IPADD) return {};
  const ASN1_STRING* value = name.type == GEN_DNS ? name.d.dNSName : name.d.iPAddress;
  const unsigned char* bytes = ASN1_STRING_get0_data(value);
  const auto size = static_cast<std::size_t>(ASN1_STRING_length(value));
  if (name.type == GEN_DNS) return {reinterpret_cast<const char*>(bytes), size};
  char text[INET6_ADDRSTRLEN] = "";
  if (size == 4) (void)::inet_ntop(AF_INET, bytes, text, sizeof text);
  if (size == 16) (void)::inet_ntop(AF_INET6, bytes, text, sizeof text);
  return text;
}

}  // namespace

std::vector<X509Ptr> certificates_of(std::string_view pem) {
  std::vector<X509Ptr> all;
  const Bio bio = reader_of(pem);
  while (X509* one = bio ? PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr) : nullptr) all.emplace_back(one);
  ERR_clear_error();
  return all;
}

KeyPtr key_of(std::string_view pem) {
  const Bio bio = reader_of(pem);
  const auto no_pass_phrase = [](char*, int, int, void*) { return -1; };
  KeyPtr key(bio ? PEM_read_bio_PrivateKey(bio.get(), nullptr, no_pass_phrase, nullptr) : nullptr);
  ERR_clear_error();
  return key;
}

Validity validity_of(const X509& certificate) {
  return {time_of(X509_get0_notBefore(&certificate)), time_of(X509_get0_notAfter(&certificate))};
}

std::string machines_of(const X509& certificate) {
  const Names names(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(&certificate, NID_subject_alt_name, nullptr, nullptr)));
  std::vector<std::string> machines;
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i)
    if (std::string name = machine_of(*sk_GENERAL_NAME_value(names.get(), i)); !name.empty())
      machines.push_back(std::move(name));
  if (machines.empty()) return std::string(kNoMachine);
  std::string all = machines.front();
  for (std::size_t i = 1; i < machines.size(); ++i) all += (i + 1 < machines.size() ? ", " : " and ") + machines[i];
  return all;
}

int verify_own(const std::vector<X509Ptr>& chain, const std::vector<X509Ptr>& authorities) {
  const Store store(X509_STORE_new());
  const StoreContext context(X509_STORE_CTX_new());
  STACK_OF(X509)* between = sk_X509_new_null();  // holds no references
  const std::unique_ptr<STACK_OF(X509), void (*)(STACK_OF(X509)*)> freed(between,
                                                                         [](STACK_OF(X509) * s) { sk_X509_free(s); });
  if (chain.empty() || !store || !context || !between) return X509_V_ERR_UNSPECIFIED;
  for (const X509Ptr& one : authorities) X509_STORE_add_cert(store.get(), one.get());
  for (std::size_t i = 1; i < chain.size(); ++i) sk_X509_push(between, chain[i].get());
  if (X509_STORE_CTX_init(context.get(), store.get(), chain.front().get(), between) != 1) return X509_V_ERR_UNSPECIFIED;
  X509_STORE_CTX_set_default(context.get(), "ssl_client");
  const bool holds = X509_verify_cert(context.get()) == 1;
  const int error = X509_STORE_CTX_get_error(context.get());
  ERR_clear_error();
  return holds ? X509_V_OK : error;
}

bool is_unknown_authority(int verify_error) {
  switch (verify_error) {
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_CERT_SIGNATURE_FAILURE:
      return true;
    default:
      return false;
  }
}

std::string text_of(std::chrono::sys_seconds time) {
  const std::time_t seconds = time.time_since_epoch().count();
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

}  // namespace osteon::wire
