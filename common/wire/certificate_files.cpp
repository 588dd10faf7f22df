#include "common/wire/certificate_files.hpp"

#include <openssl/x509v3.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

namespace osteon::wire {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAsk = "; ask whoever runs the server for it";

Result<std::string> read(const fs::path& folder, const char* name, const char* what) {
  const fs::path file = folder / name;
  std::error_code unknown;
  if (!fs::is_directory(folder, unknown))
    return failure(ErrorCode::not_found, folder.string() +
                                             " is no folder; give with --certificates the one that holds " +
                                             "ca.pem, person.pem and person.key");
  // The two common mistakes with the folders that deploy/certs writes.
  if (!fs::exists(file, unknown) && fs::exists(folder / "server.key", unknown))
    return failure(ErrorCode::not_found, folder.string() + " is the folder of a server; give that of a person with " +
                                             "--certificates, such as certs/people/anna");
  const bool is_authoritys = fs::exists(folder / "people", unknown) || fs::exists(folder / "ca.key", unknown);
  if (!fs::exists(file, unknown) && is_authoritys)
    return failure(ErrorCode::not_found, folder.string() +
                                             " is a folder of the authority; give that of a person with " +
                                             "--certificates, such as certs/people/anna");
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (in && !text.empty()) return text;
  return failure(ErrorCode::not_found,
                 file.string() + ", " + what +
                     (fs::exists(file, unknown) ? ", is empty or cannot be read" : ", is missing") + kAsk);
}

// Binary, as Windows exports certificates: one ASN.1 sequence whose length matches.
bool is_der(const std::string& text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::size_t>(static_cast<unsigned char>(text[i])); };
  if (text.size() < 4 || byte(0) != 0x30) return false;
  if (byte(1) < 0x80) return text.size() == 2 + byte(1);
  if (byte(1) == 0x81) return text.size() == 3 + byte(2);
  return byte(1) == 0x82 && text.size() == 4 + (byte(2) << 8 | byte(3));
}

tl::unexpected<Error> no_certificate(const fs::path& file, const std::string& text) {
  const std::string name = file.string();
  if (is_der(text))
    return failure(ErrorCode::invalid_input,
                   name + " is binary (DER) and has to be text (PEM); convert it with: openssl x509 -inform DER -in " +
                       name + " -out NEW.pem");
  return failure(
      ErrorCode::invalid_input,
      name + " holds no certificate: no part begins with -----BEGIN CERTIFICATE----- and can be read" + kAsk);
}

tl::unexpected<Error> no_key(const fs::path& file, const std::string& text) {
  const std::string name = file.string();
  if (text.find("ENCRYPTED") != std::string::npos)
    return failure(ErrorCode::invalid_input, name +
                                                 " is protected by a pass phrase, which no program asks for; write " +
                                                 "it without one with: openssl pkey -in " + name + " -out NEW.key");
  if (is_der(text))
    return failure(
        ErrorCode::invalid_input,
        name + " is a binary key (DER) and has to be text (PEM); convert it with: openssl pkey -inform DER -in " +
            name + " -out NEW.key");
  return failure(ErrorCode::invalid_input,
                 name + " holds no key: no part begins with -----BEGIN PRIVATE KEY----- and can be read" + kAsk);
}

bool is_authority(const X509Ptr& one) { return X509_check_ca(one.get()) != 0; }

}  // namespace

Result<ProbeFiles> read_certificate_files(const fs::path& folder) {
  const Result<std::string> authority = read(folder, "ca.pem", "the authority's certificate"),
                            certificate = read(folder, "person.pem", "your certificate"),
                            key = read(folder, "person.key", "your key");
  for (const auto* file : {&authority, &certificate, &key})
    if (!*file) return tl::unexpected(file->error());
  const std::vector<X509Ptr> authorities = certificates_of(*authority), chain = certificates_of(*certificate);
  const KeyPtr secret = key_of(*key);
  if (authorities.empty()) return no_certificate(folder / "ca.pem", *authority);
  if (chain.empty()) return no_certificate(folder / "person.pem", *certificate);
  if (!secret) return no_key(folder / "person.key", *key);
  if (std::ranges::none_of(authorities, is_authority))
    return failure(ErrorCode::invalid_input, (folder / "ca.pem").string() +
                                                 " holds a certificate that is no authority's; give ca.pem of " +
                                                 "whoever runs the server");
  const auto fits = [&](const X509Ptr& one) { return X509_check_private_key(one.get(), secret.get()) == 1; };
  if (fits(chain.front())) return ProbeFiles{*authority, *certificate, *key};
  if (std::ranges::any_of(chain, fits))
    return failure(ErrorCode::invalid_input, (folder / "person.pem").string() +
                                                 " begins with another certificate than yours; put yours first in it");
  return failure(ErrorCode::invalid_input,
                 (folder / "person.key").string() +
                     " is not the key of the certificate in person.pem beside it; take both " +
                     "from the folder that you were given");
}

}  // namespace osteon::wire
