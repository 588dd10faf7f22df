#include "server/auth/cipher_order.hpp"

#include <openssl/bio.h>
#include <openssl/conf.h>
#include <openssl/crypto.h>

#include <memory>

namespace osteon {
namespace {

// As in /etc/ssl/openssl.cnf of Debian 12, with one option more.
constexpr char kDefaults[] =
    "openssl_conf = modules\n"
    "[modules]\nssl_conf = contexts\n"
    "[contexts]\nsystem_default = context\n"
    "[context]\nMinProtocol = TLSv1.2\nCipherString = DEFAULT:@SECLEVEL=2\nOptions = ServerPreference\n";

}  // namespace

Result<void> prefer_own_cipher_order() {
  // Reads the system's own file first. Read later, it would replace these settings.
  OPENSSL_init_crypto(OPENSSL_INIT_LOAD_CONFIG, nullptr);
  const std::unique_ptr<BIO, int (*)(BIO*)> text(BIO_new_mem_buf(kDefaults, sizeof kDefaults - 1), BIO_free);
  const std::unique_ptr<CONF, void (*)(CONF*)> read(NCONF_new(nullptr), NCONF_free);
  long line = 0;
  if (text && read && NCONF_load_bio(read.get(), text.get(), &line) > 0 &&
      CONF_modules_load(read.get(), nullptr, 0) > 0)
    return {};
  return failure(ErrorCode::internal, "OpenSSL takes no order of ciphers; tell whoever runs the server");
}

}  // namespace osteon
