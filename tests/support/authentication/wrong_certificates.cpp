#include "tests/support/authentication/wrong_certificates.hpp"
#include "tests/support/content.hpp"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>

namespace osteon::test {
namespace {

namespace fs = std::filesystem;
constexpr long kDay = 86400;

struct Freed {
  void operator()(X509* what) const { X509_free(what); }
  void operator()(EVP_PKEY* what) const { EVP_PKEY_free(what); }
  void operator()(X509_EXTENSION* what) const { X509_EXTENSION_free(what); }
  void operator()(std::FILE* what) const { std::fclose(what); }
};
using Certificate = std::unique_ptr<X509, Freed>;
using Key = std::unique_ptr<EVP_PKEY, Freed>;
using File = std::unique_ptr<std::FILE, Freed>;

// A valid person's certificate, until a field is changed.
struct Form {
  std::string common_name = "anna", names = "URI:osteon://person/anna";  // `names` empty: none
  long begins_s = -kDay, ends_s = kDay;
  std::string basic = "critical,CA:FALSE", usage = "critical,digitalSignature", purpose = "clientAuth";
  std::string unknown{};  // a critical extension that no program knows; empty: none
  const EVP_MD* digest = EVP_sha256();
  bool weak_key = false;
};
struct Issued {
  Certificate certificate;
  Key key;
};

void check(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(std::string("a certificate cannot be made: ") + what);
}

void add(X509* certificate, X509* issuer, const char* name, const std::string& value) {
  if (value.empty()) return;
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed> extension(X509V3_EXT_conf(nullptr, &context, name, value.c_str()));
  check(extension && X509_add_ext(certificate, extension.get(), -1) == 1, name);
}

// `issuer` null: self-signed.
Issued issue(const Form& form, const Issued* issuer) {
  Issued made{Certificate(X509_new()), Key(form.weak_key ? EVP_PKEY_Q_keygen(nullptr, nullptr, "RSA", std::size_t{1024})
                                                         : EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256"))};
  X509* certificate = made.certificate.get();
  std::uint32_t serial = 0;
  check(certificate && made.key && RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1, "key");
  X509* by = issuer ? issuer->certificate.get() : certificate;
  X509_set_version(certificate, X509_VERSION_3);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate), serial);
  X509_gmtime_adj(X509_getm_notBefore(certificate), form.begins_s);
  X509_gmtime_adj(X509_getm_notAfter(certificate), form.ends_s);
  X509_set_pubkey(certificate, made.key.get());
  if (!form.common_name.empty())
    X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate), "CN", MBSTRING_UTF8,
                               reinterpret_cast<const unsigned char*>(form.common_name.c_str()), -1, -1, 0);
  X509_set_issuer_name(certificate, X509_get_subject_name(by));
  add(certificate, by, "basicConstraints", form.basic);
  add(certificate, by, "keyUsage", form.usage);
  add(certificate, by, "extendedKeyUsage", form.purpose);
  add(certificate, by, "subjectAltName", form.names);
  add(certificate, by, "1.2.3.4.5", form.unknown);
  check(X509_sign(certificate, issuer ? issuer->key.get() : made.key.get(), form.digest) > 0, "signature");
  return made;
}

File open(const fs::path& file, const char* mode) {
  File opened(std::fopen(file.c_str(), mode));
  check(opened != nullptr, file.c_str());
  return opened;
}

Issued read_authority(const fs::path& folder) {
  return {Certificate(PEM_read_X509(open(folder / "ca.pem", "r").get(), nullptr, nullptr, nullptr)),
          Key(PEM_read_PrivateKey(open(folder / "ca.key", "r").get(), nullptr, nullptr, nullptr))};
}

// In the order of clients: their own first, then those between it and the authority.
void write(const fs::path& folder, std::initializer_list<const Issued*> chain) {
  fs::create_directories(folder);
  const File certificates = open(folder / "person.pem", "w");
  for (const Issued* one : chain) PEM_write_X509(certificates.get(), one->certificate.get());
  PEM_write_PrivateKey(open(folder / "person.key", "w").get(), (*chain.begin())->key.get(), nullptr, nullptr, 0,
                       nullptr, nullptr);
}

// Flips one bit of the signature.
void alter(X509* certificate) {
  const ASN1_BIT_STRING* signature = nullptr;
  X509_get0_signature(&signature, nullptr, certificate);
  const_cast<unsigned char*>(ASN1_STRING_get0_data(signature))[ASN1_STRING_length(signature) - 1] ^= 1;
}

std::string serial_of(const fs::path& person) {
  const Certificate certificate(PEM_read_X509(open(person / "person.pem", "r").get(), nullptr, nullptr, nullptr));
  const std::unique_ptr<BIGNUM, void (*)(BIGNUM*)> number(
      ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate.get()), nullptr), BN_free);
  char* text = BN_bn2hex(number.get());
  const std::string serial = text;
  OPENSSL_free(text);
  return serial;
}

}  // namespace

std::vector<WrongCertificate> wrong_certificates(People& people, const fs::path& into) {
  std::vector<WrongCertificate> all{{.kind = "none", .folder = {}}};
  const Issued ours = read_authority(people.ticket_key().parent_path());
  const auto place = [&](const std::string& kind) {
    all.push_back({.kind = kind, .folder = into / std::to_string(all.size())});
    return all.back().folder;
  };
  const auto of_ours = [&](const std::string& kind, const Form& form) {
    const Issued made = issue(form, &ours);
    write(place(kind), {&made});
  };
  const Form ca{.common_name = "Osteon local authority",
                .names = {},
                .basic = "critical,CA:TRUE",
                .usage = "critical,keyCertSign,cRLSign",
                .purpose = {}};

  const Issued alone = issue({}, nullptr), other = issue(ca, nullptr), strange = issue({}, &other);
  write(place("signed by itself"), {&alone});
  write(place("of another authority with the same name"), {&strange});
  write(place("of another authority, which it brings along"), {&strange, &other});
  of_ours("expired", {.begins_s = -2 * kDay, .ends_s = -60});
  of_ours("not yet valid", {.begins_s = kDay, .ends_s = 2 * kDay});
  of_ours("of a server", {.purpose = "serverAuth"});
  of_ours("for no key agreement", {.usage = "critical,keyCertSign"});
  of_ours("without a person's name", {.names = {}});
  of_ours("without any name", {.common_name = {}, .names = {}});
  of_ours("with an empty person's name", {.names = "URI:osteon://person/"});
  of_ours("of two people", {.names = "URI:osteon://person/anna,URI:osteon://person/ben"});
  of_ours("with a critical extension that nobody knows", {.unknown = "critical,ASN1:UTF8String:x"});
  of_ours("with an RSA key of 1024 bits", {.weak_key = true});
  of_ours("signed with SHA-1", {.digest = EVP_sha1()});
  Issued altered = issue({}, &ours);
  alter(altered.certificate.get());
  write(place("altered after it was signed"), {&altered});
  write(place("the authority's own"), {&ours});
  // The authority allows no intermediate one.
  const Issued between = issue(ca, &ours), beneath = issue({}, &between);
  write(place("without the certificate between"), {&beneath});
  write(place("by an authority beneath ours"), {&beneath, &between});
  const Issued person = issue({.common_name = "mallory", .names = "URI:osteon://person/mallory"}, &ours),
               made_up = issue({}, &person);
  write(place("signed by a person of ours"), {&made_up, &person});

  const fs::path access = people.server() / "access.txt", serials = people.server() / "revoked.lst";
  all.push_back({"revoked by the authority's list", people.person("listed"), "listed"});
  const std::string access_before = content(access), serials_before = content(serials);
  people.certs({"revoke", "listed"});
  std::ofstream(access) << access_before;
  std::ofstream(serials) << serials_before;
  all.push_back({"revoked by its number", people.person("numbered"), "numbered"});
  const std::string number = serial_of(all.back().folder);
  people.append_access("revoke certificate " + number);
  std::ofstream(serials) << serials_before << number << "\n";
  return all;
}

}  // namespace osteon::test
