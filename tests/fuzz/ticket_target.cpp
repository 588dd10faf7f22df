#include "tests/fuzz/ticket_target.hpp"

#include <sodium.h>

#include <array>
#include <chrono>
#include <string>
#include <string_view>

#include "common/access/access_list.hpp"
#include "common/access/ticket.hpp"
#include "common/core/check.hpp"
#include "tests/fuzz/import_files.hpp"

namespace osteon::fuzz {
namespace {

constexpr UnixTime kExpires{std::chrono::seconds(1'800'000'000)};

TicketKey fixed_key() {
  TicketKey key;
  key.seed.fill(0x5a);
  return key;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), sodium_base64_VARIANT_URLSAFE_NO_PADDING), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_URLSAFE_NO_PADDING);
  text.pop_back();
  return text;
}

// An accepted ticket is exactly the text that the key signs. No other spelling of it is accepted.
void open_text(std::string_view text) {
  static const TicketCheckKey check_key = check_key_of(fixed_key());
  const Result<Ticket> ticket = open_ticket(text, check_key);
  if (!ticket) {
    OSTEON_CHECK(!ticket.error().message.empty() && ticket.error().message.size() < 300);
    return;
  }
  OSTEON_CHECK(ticket->role != Role::none && is_user_name(ticket->user) && !ticket->room.empty());
  OSTEON_CHECK(sign_ticket(*ticket, fixed_key()) == text);
}

using SecretKey = std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES>;

SecretKey secret_key() {
  std::array<std::uint8_t, crypto_sign_PUBLICKEYBYTES> open{};
  SecretKey secret{};
  crypto_sign_seed_keypair(open.data(), secret.data(), fixed_key().seed.data());
  return secret;
}

void open_signed(std::span<const std::uint8_t> contents) {
  if (contents.size() > 700) return;
  static const SecretKey secret = secret_key();
  Bytes all = bytes_of_text("osteon join ticket 1\n");
  all.insert(all.end(), contents.begin(), contents.end());
  std::array<std::uint8_t, crypto_sign_BYTES> signature{};
  crypto_sign_detached(signature.data(), nullptr, all.data(), all.size(), secret.data());
  open_text("osteon1." + base64(contents) + "." + base64(signature));
}

void read_list(std::span<const std::uint8_t> data) {
  const Result<AccessList> list =
      AccessList::parse({reinterpret_cast<const char*>(data.data()), data.size()}, "access.txt");
  if (!list) {
    OSTEON_CHECK(list.error().message.starts_with("access.txt:"));
    return;
  }
  (void)list->refuses("0A", "anna", "ff");
  OSTEON_CHECK(list->role("nobody.at.all", "a room", Role::trainee) == Role::trainee || list->size() > 0);
}

std::string a_ticket(const std::string& room, const std::string& user) {
  Ticket ticket = make_ticket(room, user, Role::trainee, kExpires).value();
  ticket.id.fill(7);
  return sign_ticket(ticket, fixed_key());
}

// The contents of a ticket: id, expiry, role, room, user.
Bytes contents(const std::string& room, const std::string& user) {
  Bytes bytes(16, 7);
  for (const int byte : {0x00, 0xd2, 0x49, 0x6b, 0, 0, 0, 0, 2}) bytes.push_back(static_cast<std::uint8_t>(byte));
  for (const std::string& name : {room, user}) {
    bytes.push_back(static_cast<std::uint8_t>(name.size()));
    bytes.insert(bytes.end(), name.begin(), name.end());
  }
  return bytes;
}

}  // namespace

Target ticket_target() {
  return {.name = "ticket",
          .run =
              [](std::span<const std::uint8_t> data) {
                open_text({reinterpret_cast<const char*>(data.data()), data.size()});
              },
          .seeds = {bytes_of_text(a_ticket("ward", "anna")),
                    bytes_of_text(a_ticket(std::string(255, 'r'), std::string(64, 'u')))}};
}

Target ticket_contents_target() {
  return {.name = "ticket_contents", .run = open_signed, .seeds = {contents("ward", "anna"), contents("*", "b")}};
}

Target access_list_target() {
  return {.name = "access_list",
          .run = read_list,
          .seeds = {bytes_of_text("# left\nrevoke user anna\nrevoke certificate 0A:1f\nrevoke ticket 00ff\nrole ben "
                                  "observer my room\nrole eve instructor\n")}};
}

}  // namespace osteon::fuzz
