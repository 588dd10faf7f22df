// Ed25519 signatures (RFC 8032). With them a server vouches for what it wrote into a journal. The chain of hashes shows
// that entries fit together, but anybody can compute it. Only the owner of the secret key can sign.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/journal/chain.hpp"

namespace osteon {

struct PublicKey {
  std::array<std::uint8_t, 32> bytes{};
  friend auto operator<=>(const PublicKey&, const PublicKey&) = default;
};
struct Signature {
  std::array<std::uint8_t, 64> bytes{};
  friend bool operator==(const Signature&, const Signature&) = default;
};

// 64 hexadecimal digits.
[[nodiscard]] std::string to_hex(const PublicKey& key);
// White space around the digits is ignored. Error invalid_input: anything else.
[[nodiscard]] Result<PublicKey> parse_public_key(std::string_view text);
[[nodiscard]] bool verifies(const PublicKey& key, const Digest& message, const Signature& signature);

// A secret key. Its bytes are wiped when it is destroyed.
class SigningKey {
 public:
  [[nodiscard]] static SigningKey make();  // from the system's random bytes
  [[nodiscard]] static SigningKey from_seed(const std::array<std::uint8_t, 32>& seed);
  SigningKey(const SigningKey&) = default;
  SigningKey& operator=(const SigningKey&) = default;
  ~SigningKey();
  [[nodiscard]] const PublicKey& public_key() const { return public_; }
  [[nodiscard]] Signature sign(const Digest& message) const;
  [[nodiscard]] std::string seed_as_hex() const;

 private:
  SigningKey() = default;
  std::array<std::uint8_t, 64> secret_{};
  PublicKey public_;
};

// One key takes over from another. Both sign the change; otherwise anybody could name a key of their own as the earlier
// one.
struct Succession {
  PublicKey before, after;
  Signature by_before, by_after;
  friend bool operator==(const Succession&, const Succession&) = default;
};
[[nodiscard]] Succession succeed(const SigningKey& before, const SigningKey& after);
[[nodiscard]] std::string encode_successions(std::span<const Succession> all);
[[nodiscard]] std::optional<std::vector<Succession>> decode_successions(std::string_view bytes);
// The key, and all keys before and after it, as far as both signatures of each step are valid.
[[nodiscard]] std::set<PublicKey> keys_of_line(const PublicKey& key, std::span<const Succession> successions);

// The key with which a server signs, and its earlier keys. Immutable, so any thread may use it.
class SigningKeys {
 public:
  explicit SigningKeys(const SigningKey& key, std::vector<Succession> successions = {});
  [[nodiscard]] const SigningKey& key() const { return key_; }
  [[nodiscard]] const std::vector<Succession>& successions() const { return successions_; }
  [[nodiscard]] bool trusts(const PublicKey& key) const { return line_.contains(key); }

 private:
  SigningKey key_;
  std::vector<Succession> successions_;
  std::set<PublicKey> line_;
};

// Default name, in the folder of the journals.
inline constexpr const char* kSigningKeyFile = "signing.key";
// Loads the keys from a text file that only its owner may read. Errors, naming the file: not_found; invalid_input (not
// a key file, or others may read it).
[[nodiscard]] Result<std::shared_ptr<const SigningKeys>> load_signing_keys(const std::filesystem::path& file);
// The same. If the file is missing, makes a durable one with a new key that only its owner may read. Error internal: it
// cannot be written.
[[nodiscard]] Result<std::shared_ptr<const SigningKeys>> load_or_make_signing_keys(const std::filesystem::path& file);
// Puts a new key into the file, and the present key signs it. At every moment the file holds the old or the new key.
// Whoever has loaded the file signs with the old key until loading it again.
[[nodiscard]] Result<std::shared_ptr<const SigningKeys>> rotate_signing_keys(const std::filesystem::path& file);

// A key states: I decided the entries from `since` on, and they lead to `head`. Through the chain this covers the
// content of those entries.
struct SignedEntries {
  RoomSeq since;
  JournalHead head;
  PublicKey key;
  Signature signature;
};
[[nodiscard]] SignedEntries sign_entries(const SigningKey& key, RoomSeq since, const JournalHead& head);
// Whether the key made the signature, and such entries are possible.
[[nodiscard]] bool fits(const SignedEntries& entries);

// A seal stands beside each stored value that the chain does not cover. It is the value's hash, or the key that signed
// the hash with its signature. `genesis`: chain_0 of the journal, so that the seal is valid in no other journal.
[[nodiscard]] std::string make_seal(const Digest& entry, const Digest& genesis, const SigningKey* key);
struct Seal {
  std::optional<PublicKey> key;  // none: nobody signed it
};
// Nothing: it does not fit the value.
[[nodiscard]] std::optional<Seal> check_seal(std::string_view seal, const Digest& entry, const Digest& genesis);

}  // namespace osteon
