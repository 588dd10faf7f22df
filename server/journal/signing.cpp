#include "server/journal/signing.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <system_error>
#include <utility>

#include "common/core/check.hpp"
#include "common/link/random_bytes.hpp"
#include "common/runtime/files.hpp"
#include "server/journal/bytes.hpp"
#include "server/journal/disk.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFirstLine = "osteon signing key 1";
constexpr std::size_t kSuccessionBytes = 2 * 32 + 2 * 64;

std::string hex_of(std::string_view bytes) {
  std::string text(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  text.pop_back();
  return text;
}

// Requires exactly as many bytes as `bytes` has.
bool read_hex(std::string_view text, std::span<std::uint8_t> bytes) {
  std::size_t count = 0;
  return text.size() == 2 * bytes.size() &&
         sodium_hex2bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &count, nullptr) == 0 &&
         count == bytes.size();
}

Digest message_of(const PublicKey& before, const PublicKey& after) {
  Hasher hasher;
  hasher.text("osteon signing key follows");
  hasher.text(text_of(before.bytes));
  hasher.text(text_of(after.bytes));
  return hasher.finish();
}

Digest message_of(RoomSeq since, const JournalHead& head) {
  Hasher hasher;
  hasher.text("osteon journal rows");
  hasher.integer(since.value);
  hasher.integer(head.seq.value);
  hasher.text(as_text(head.chain));
  return hasher.finish();
}

Digest message_of(const Digest& entry, const Digest& genesis) {
  Hasher hasher;
  hasher.text("osteon journal entry");
  hasher.text(as_text(genesis));
  hasher.text(as_text(entry));
  return hasher.finish();
}

bool holds(const Succession& one) {
  const Digest message = message_of(one.before, one.after);
  return verifies(one.before, message, one.by_before) && verifies(one.after, message, one.by_after);
}

std::string file_text(const SigningKeys& keys) {
  std::ostringstream text;
  text << kFirstLine << "\n# Whoever has this file can sign in this server's name. Nobody else may read it.\n"
       << "secret " << keys.key().seed_as_hex() << "\n";
  for (const Succession& one : keys.successions())
    text << "succession " << hex_of(encode_successions({&one, 1})) << "\n";
  return text.str();
}

Result<std::shared_ptr<const SigningKeys>> parse(const fs::path& file, const std::string& content) {
  const auto wrong = [&](int line, const std::string& what) {
    return failure(ErrorCode::invalid_input, file.string() + ":" + std::to_string(line) + " " + what +
                                                 "; name a file that osteon-server made as its signing key");
  };
  std::istringstream lines(content);
  std::string line;
  std::optional<SigningKey> key;
  std::vector<Succession> successions;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (number == 1 && line != kFirstLine) return wrong(1, "is not \"" + std::string(kFirstLine) + "\"");
    if (number == 1 || line.empty() || line.starts_with('#')) continue;
    const std::string name = line.substr(0, line.find(' ')),
                      value = line.substr(std::min(line.size(), name.size() + 1));
    if (name == "secret") {
      std::array<std::uint8_t, 32> seed{};
      if (key || !read_hex(value, seed)) return wrong(number, "is not the only secret of 64 hexadecimal digits");
      key = SigningKey::from_seed(seed);
      sodium_memzero(seed.data(), seed.size());
    } else if (name == "succession") {
      std::array<std::uint8_t, kSuccessionBytes> bytes{};
      const bool is_hex = read_hex(value, bytes);
      const auto one = decode_successions(text_of(bytes));
      if (!is_hex || !one || !holds(one->front())) return wrong(number, "is no succession that both its keys signed");
      successions.push_back(one->front());
    } else {
      return wrong(number, "is neither a secret nor a succession");
    }
  }
  if (!key)
    return failure(ErrorCode::invalid_input,
                   file.string() + " has no secret; name a file that osteon-server made as its signing key");
  return std::make_shared<const SigningKeys>(std::move(*key), std::move(successions));
}

tl::unexpected<Error> key_failure(const std::string& what, const fs::path& file, int reason) {
  return failure(ErrorCode::internal, "cannot " + what + " the signing key " + file.string() + ": " +
                                          std::generic_category().message(reason) + std::string(remedy_of(reason)));
}

// A durable file beside the named one that only its owner may read. The destructor removes it.
class Draft {
 public:
  explicit Draft(const fs::path& file) : path_(file.string() + ".XXXXXX") {}
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  ~Draft() { ::unlink(path_.c_str()); }
  // The system's error number, or 0.
  [[nodiscard]] int write(std::string_view content) {
    const int fd = ::mkostemp(path_.data(), O_CLOEXEC);  // with mode 0600
    if (fd < 0) return errno;
    int reason = 0;
    while (!content.empty() && reason == 0) {
      const ssize_t put = ::write(fd, content.data(), content.size());
      if (put < 0 && errno == EINTR) continue;
      if (put < 0)
        reason = errno;
      else
        content.remove_prefix(static_cast<std::size_t>(put));
    }
    if (reason == 0 && ::fsync(fd) != 0) reason = errno;
    ::close(fd);
    return reason;
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

std::string to_hex(const PublicKey& key) { return hex_of(text_of(key.bytes)); }

Result<PublicKey> parse_public_key(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first != text.npos) text = text.substr(first, text.find_last_not_of(kSpace) - first + 1);
  PublicKey key;
  if (read_hex(text, key.bytes)) return key;
  return failure(ErrorCode::invalid_input,
                 "a public key is 64 hexadecimal digits, as osteon-server key show prints them");
}

bool verifies(const PublicKey& key, const Digest& message, const Signature& signature) {
  return crypto_sign_verify_detached(signature.bytes.data(), message.bytes.data(), message.bytes.size(),
                                     key.bytes.data()) == 0;
}

SigningKey SigningKey::make() {
  std::array<std::uint8_t, 32> seed{};
  system_random()(seed);
  const SigningKey made = from_seed(seed);
  sodium_memzero(seed.data(), seed.size());
  return made;
}

SigningKey SigningKey::from_seed(const std::array<std::uint8_t, 32>& seed) {
  OSTEON_CHECK(sodium_init() >= 0);
  SigningKey made;
  crypto_sign_seed_keypair(made.public_.bytes.data(), made.secret_.data(), seed.data());
  return made;
}

SigningKey::~SigningKey() { sodium_memzero(secret_.data(), secret_.size()); }

Signature SigningKey::sign(const Digest& message) const {
  Signature signature;
  crypto_sign_detached(signature.bytes.data(), nullptr, message.bytes.data(), message.bytes.size(), secret_.data());
  return signature;
}

std::string SigningKey::seed_as_hex() const {
  return hex_of(text_of(secret_).substr(0, crypto_sign_SEEDBYTES));  // the secret's first half is the seed
}

Succession succeed(const SigningKey& before, const SigningKey& after) {
  const Digest message = message_of(before.public_key(), after.public_key());
  return {before.public_key(), after.public_key(), before.sign(message), after.sign(message)};
}

std::string encode_successions(std::span<const Succession> all) {
  std::string bytes;
  for (const Succession& one : all) {
    bytes += text_of(one.before.bytes);
    bytes += text_of(one.after.bytes);
    bytes += text_of(one.by_before.bytes);
    bytes += text_of(one.by_after.bytes);
  }
  return bytes;
}

std::optional<std::vector<Succession>> decode_successions(std::string_view bytes) {
  if (bytes.size() % kSuccessionBytes != 0) return std::nullopt;
  std::vector<Succession> all(bytes.size() / kSuccessionBytes);
  const auto take = [&](auto& field) {
    std::memcpy(field.data(), bytes.data(), field.size());
    bytes.remove_prefix(field.size());
  };
  for (Succession& one : all) {
    take(one.before.bytes);
    take(one.after.bytes);
    take(one.by_before.bytes);
    take(one.by_after.bytes);
  }
  return all;
}

std::set<PublicKey> keys_of_line(const PublicKey& key, std::span<const Succession> successions) {
  std::set<PublicKey> line{key};
  for (bool more = true; more;) {
    more = false;
    for (const Succession& one : successions)
      if (line.contains(one.before) != line.contains(one.after) && holds(one)) {
        line.insert(one.before);
        line.insert(one.after);
        more = true;
      }
  }
  return line;
}

SigningKeys::SigningKeys(const SigningKey& key, std::vector<Succession> successions)
    : key_(key), successions_(std::move(successions)), line_(keys_of_line(key_.public_key(), successions_)) {}

Result<std::shared_ptr<const SigningKeys>> load_signing_keys(const fs::path& file) {
  OSTEON_CHECK(sodium_init() >= 0);
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0 && errno == ENOENT)
    return failure(ErrorCode::not_found,
                   "there is no signing key " + file.string() +
                       "; name the one that the server made at its first start, or start it once");
  if ((found.st_mode & 077) != 0)
    return failure(ErrorCode::invalid_input, "others may read the signing key " + file.string() + "; chmod 600 " +
                                                 file.string() + ", or move it away if anybody may have read it");
  if (found.st_uid != ::geteuid() && found.st_uid != 0)
    return failure(ErrorCode::invalid_input, "the signing key " + file.string() +
                                                 " belongs to another user; chown it to the one who runs the server");
  const Result<std::string> content = read_file(file);
  if (!content) return tl::unexpected(content.error());
  return parse(file, *content);
}

Result<std::shared_ptr<const SigningKeys>> load_or_make_signing_keys(const fs::path& file) {
  auto loaded = load_signing_keys(file);
  if (loaded || loaded.error().code != ErrorCode::not_found) return loaded;
  Draft draft(file);
  if (const int reason = draft.write(file_text(SigningKeys(SigningKey::make()))); reason != 0)
    return key_failure("write", file, reason);
  // A link replaces nothing. If two servers start at once, both take the key of the first.
  if (::link(draft.path().c_str(), file.c_str()) != 0 && errno != EEXIST) return key_failure("write", file, errno);
  if (Result<void> synced = system_disk().sync_folder(folder_of(file)); !synced) return tl::unexpected(synced.error());
  return load_signing_keys(file);
}

Result<std::shared_ptr<const SigningKeys>> rotate_signing_keys(const fs::path& file) {
  auto before = load_signing_keys(file);
  if (!before) return before;
  const SigningKey after = SigningKey::make();
  std::vector<Succession> successions = (*before)->successions();
  successions.push_back(succeed((*before)->key(), after));
  Draft draft(file);
  if (const int reason = draft.write(file_text(SigningKeys(after, std::move(successions)))); reason != 0)
    return key_failure("write", file, reason);
  if (::rename(draft.path().c_str(), file.c_str()) != 0) return key_failure("replace", file, errno);
  if (Result<void> synced = system_disk().sync_folder(folder_of(file)); !synced) return tl::unexpected(synced.error());
  return load_signing_keys(file);
}

SignedEntries sign_entries(const SigningKey& key, RoomSeq since, const JournalHead& head) {
  return {since, head, key.public_key(), key.sign(message_of(since, head))};
}

bool fits(const SignedEntries& entries) {
  return entries.since && entries.since <= entries.head.seq &&
         verifies(entries.key, message_of(entries.since, entries.head), entries.signature);
}

std::string make_seal(const Digest& entry, const Digest& genesis, const SigningKey* key) {
  if (key == nullptr) return std::string(as_text(entry));
  std::string seal(text_of(key->public_key().bytes));
  seal += text_of(key->sign(message_of(entry, genesis)).bytes);
  return seal;
}

std::optional<Seal> check_seal(std::string_view seal, const Digest& entry, const Digest& genesis) {
  if (seal == as_text(entry)) return Seal{};
  PublicKey key;
  Signature signature;
  if (seal.size() != key.bytes.size() + signature.bytes.size()) return std::nullopt;
  std::memcpy(key.bytes.data(), seal.data(), key.bytes.size());
  std::memcpy(signature.bytes.data(), seal.data() + key.bytes.size(), signature.bytes.size());
  if (!verifies(key, message_of(entry, genesis), signature)) return std::nullopt;
  return Seal{key};
}

}  // namespace osteon
