#include "common/access/ticket.hpp"

#include <sodium.h>

#include <algorithm>
#include <cctype>
#include <ctime>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "common/core/digest.hpp"

namespace osteon {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::string_view kPrefix = "osteon1.";
// Signed before the contents, so that the key's signature on other data is never valid for a ticket.
constexpr std::string_view kPurpose = "osteon join ticket 1\n";
constexpr int kBase64 = sodium_base64_VARIANT_URLSAFE_NO_PADDING;
constexpr std::size_t kMostNameBytes = 255;

std::string to_base64(std::span<const std::uint8_t> bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), kBase64), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), kBase64);
  text.pop_back();  // its final zero
  return text;
}

// Accepts only the one canonical text for these bytes. Nothing for any other text.
std::optional<Bytes> from_base64(std::string_view text) {
  if (text.empty()) return {};  // no ticket has an empty part, and an empty vector has no memory to write to
  Bytes bytes(text.size());
  std::size_t size = 0;
  const char* end = nullptr;
  if (sodium_base642bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &size, &end, kBase64) != 0 ||
      end != text.data() + text.size())
    return {};
  bytes.resize(size);
  // The library accepts some characters that are not base64.
  if (to_base64(bytes) != text) return {};
  return bytes;
}

// id, expiry (8 bytes, little endian), role, then each name after its length.
Bytes contents_of(const Ticket& ticket) {
  Bytes bytes(ticket.id.begin(), ticket.id.end());
  const auto seconds = static_cast<std::uint64_t>(ticket.expires.time_since_epoch().count());
  for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<std::uint8_t>(seconds >> (8 * i)));
  bytes.push_back(static_cast<std::uint8_t>(ticket.role));
  for (const std::string* name : {&ticket.room, &ticket.user}) {
    bytes.push_back(static_cast<std::uint8_t>(name->size()));
    bytes.insert(bytes.end(), name->begin(), name->end());
  }
  return bytes;
}

bool is_room_name(std::string_view text) {
  return !text.empty() && text.size() <= kMostNameBytes &&
         std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) >= 0x20 && c != 0x7f; });
}

std::optional<Ticket> parse_contents(std::span<const std::uint8_t> bytes) {
  Ticket ticket;
  if (bytes.size() < ticket.id.size() + 9) return {};
  std::ranges::copy(bytes.first(ticket.id.size()), ticket.id.begin());
  bytes = bytes.subspan(ticket.id.size());
  std::uint64_t seconds = 0;
  for (std::size_t i = 0; i < 8; ++i) seconds |= static_cast<std::uint64_t>(bytes[i]) << (8 * i);
  // The year 9999 is late enough, and its seconds fit into every type.
  if (seconds > 253'402'300'799) return {};
  ticket.expires = UnixTime{std::chrono::seconds(seconds)};
  if (bytes[8] == 0 || bytes[8] >= kRoles) return {};
  ticket.role = static_cast<Role>(bytes[8]);
  bytes = bytes.subspan(9);
  for (std::string* name : {&ticket.room, &ticket.user}) {
    if (bytes.empty() || bytes.size() < 1u + bytes[0]) return {};
    name->assign(bytes.begin() + 1, bytes.begin() + 1 + bytes[0]);
    bytes = bytes.subspan(1u + bytes[0]);
  }
  if (!bytes.empty() || !is_room_name(ticket.room) || !is_user_name(ticket.user)) return {};
  return ticket;
}

Bytes signed_bytes(std::span<const std::uint8_t> contents) {
  Bytes all(kPurpose.size() + contents.size());
  std::ranges::copy(contents, std::ranges::copy(kPurpose, all.begin()).out);
  return all;
}

struct SigningKey {
  std::array<std::uint8_t, crypto_sign_PUBLICKEYBYTES> check{};
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> secret{};
  explicit SigningKey(const TicketKey& key) {
    OSTEON_CHECK(sodium_init() >= 0);
    crypto_sign_seed_keypair(check.data(), secret.data(), key.seed.data());
  }
  ~SigningKey() { sodium_memzero(secret.data(), secret.size()); }
  SigningKey(const SigningKey&) = delete;
  SigningKey& operator=(const SigningKey&) = delete;
};

std::string time_text(UnixTime time) {
  const std::time_t seconds = time.time_since_epoch().count();
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

Result<std::array<std::uint8_t, 32>> parse_hex(std::string_view text, const char* what) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  const Result<Digest> bytes = digest_from_hex(text);
  if (!bytes)
    return failure(ErrorCode::invalid_input,
                   std::string("the ") + what + " is not 64 hexadecimal digits (0-9, a-f); make one with deploy/certs");
  return bytes->bytes;
}

tl::unexpected<Error> no_ticket(const char* why) {
  return failure(ErrorCode::invalid_input,
                 std::string("the ticket is malformed (") + why + "); ask for a new one, and copy all of it");
}

}  // namespace

bool is_user_name(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '.' || c == '_' ||
           c == '-' || c == '@';
  });
}

std::string to_hex(const std::array<std::uint8_t, 16>& ticket_id) {
  char text[2 * 16 + 1];
  return sodium_bin2hex(text, sizeof text, ticket_id.data(), ticket_id.size());
}

TicketKey new_ticket_key() {
  OSTEON_CHECK(sodium_init() >= 0);
  TicketKey key;
  randombytes_buf(key.seed.data(), key.seed.size());
  return key;
}

TicketCheckKey check_key_of(const TicketKey& key) { return {SigningKey(key).check}; }

Result<TicketKey> parse_ticket_key(std::string_view text) {
  const auto bytes = parse_hex(text, "key for tickets");
  if (!bytes) return tl::unexpected(bytes.error());
  return TicketKey{*bytes};
}
Result<TicketCheckKey> parse_check_key(std::string_view text) {
  const auto bytes = parse_hex(text, "key that checks tickets");
  if (!bytes) return tl::unexpected(bytes.error());
  return TicketCheckKey{*bytes};
}
Result<std::vector<TicketCheckKey>> parse_check_keys(std::string_view text) {
  constexpr std::size_t kMostKeys = 4;
  std::vector<TicketCheckKey> keys;
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view one = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (one.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const Result<TicketCheckKey> key = parse_check_key(one);
    if (!key) return failure(ErrorCode::invalid_input, "line " + std::to_string(line) + ": " + key.error().message);
    keys.push_back(*key);
  }
  if (!keys.empty() && keys.size() <= kMostKeys) return keys;
  return failure(ErrorCode::invalid_input, "it has " + std::to_string(keys.size()) +
                                               " keys that check tickets, and not 1 to " + std::to_string(kMostKeys) +
                                               "; make it with deploy/certs");
}
std::string to_text(const TicketKey& key) { return to_hex(Digest{key.seed}); }
std::string to_text(const TicketCheckKey& key) { return to_hex(Digest{key.bytes}); }

Result<Ticket> make_ticket(std::string room, std::string user, Role role, UnixTime expires) {
  if (!is_room_name(room))
    return failure(ErrorCode::invalid_input, "a ticket's room needs a name of 1 to 255 bytes, or * for any room");
  if (!is_user_name(user))
    return failure(ErrorCode::invalid_input, "a ticket's user needs a name of 1 to 64 letters, digits and . _ - @");
  if (role == Role::none) return failure(ErrorCode::invalid_input, "a ticket needs a role");
  Ticket ticket{.id = {}, .room = std::move(room), .user = std::move(user), .role = role, .expires = expires};
  OSTEON_CHECK(sodium_init() >= 0);
  randombytes_buf(ticket.id.data(), ticket.id.size());
  return ticket;
}

std::string sign_ticket(const Ticket& ticket, const TicketKey& key) {
  const SigningKey signing(key);
  const Bytes contents = contents_of(ticket), to_sign = signed_bytes(contents);
  std::array<std::uint8_t, crypto_sign_BYTES> signature{};
  crypto_sign_detached(signature.data(), nullptr, to_sign.data(), to_sign.size(), signing.secret.data());
  return std::string(kPrefix) + to_base64(contents) + "." + to_base64(signature);
}

Result<Ticket> open_ticket(std::string_view text, const TicketCheckKey& key) {
  OSTEON_CHECK(sodium_init() >= 0);
  if (text.size() > kMostTicketChars) return no_ticket("it is too long");
  if (!text.starts_with(kPrefix)) return no_ticket("it does not begin with osteon1.");
  text.remove_prefix(kPrefix.size());
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos) return no_ticket("it has no signature");
  const auto contents = from_base64(text.substr(0, dot)), signature = from_base64(text.substr(dot + 1));
  if (!contents || !signature || signature->size() != crypto_sign_BYTES)
    return no_ticket("it is not base64 of the right length");
  // The contents must not be read before the signature is verified.
  const Bytes said = signed_bytes(*contents);
  if (crypto_sign_verify_detached(signature->data(), said.data(), said.size(), key.bytes.data()) != 0)
    return failure(ErrorCode::invalid_input,
                   "the ticket's signature is not this server's; ask whoever runs the server for a ticket");
  const std::optional<Ticket> ticket = parse_contents(*contents);
  if (!ticket) return no_ticket("its contents are of another version");
  return *ticket;
}

Result<void> check_time(const Ticket& ticket, UnixTime now) {
  if (now < ticket.expires) return {};
  return failure(ErrorCode::unavailable, "the ticket expired at " + time_text(ticket.expires) + "; ask for a new one");
}

Result<void> check_life(const Ticket& ticket, UnixTime now, std::chrono::hours most) {
  constexpr std::chrono::minutes kClocksDiffer{1};
  if (most == std::chrono::hours(0) || ticket.expires <= now + most + kClocksDiffer) return {};
  const auto left = std::chrono::ceil<std::chrono::hours>(ticket.expires - now);
  return failure(ErrorCode::unavailable, "the ticket is valid for " + std::to_string(left.count()) +
                                             " more hours, but this server accepts at most " +
                                             std::to_string(most.count()) + "; ask for a shorter one");
}

Result<void> check_room(const Ticket& ticket, std::string_view room) {
  if (ticket.room == kAnyRoom || ticket.room == room) return {};
  return failure(ErrorCode::unsupported,
                 "the ticket is for room " + ticket.room + " and not for this one; ask for one for this room");
}

}  // namespace osteon
