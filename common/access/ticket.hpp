// Join tickets: who may come into which room in what role, until when. Signed with Ed25519 by whoever runs the server;
// a person's certificate says who they are, the ticket what they may do.
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/result.hpp"

namespace osteon {

// Seconds since 1970, UTC.
using UnixTime = std::chrono::sys_seconds;

struct Ticket {
  std::array<std::uint8_t, 16> id{};  // of this ticket alone
  std::string room;                   // its name; kAnyRoom: every room of the server
  std::string user;                   // as in the certificate's osteon://person/USER
  Role role = Role::none;
  UnixTime expires{};
  friend bool operator==(const Ticket&, const Ticket&) = default;
};
inline constexpr std::string_view kAnyRoom = "*";
inline constexpr std::size_t kMostTicketChars = 1024;  // of its text form
inline constexpr std::chrono::hours kLongTicket{168};  // more than that wants a reason

struct TicketKey {
  std::array<std::uint8_t, 32> seed{};  // secret
};
struct TicketCheckKey {
  std::array<std::uint8_t, 32> bytes{};  // public
  friend bool operator==(const TicketCheckKey&, const TicketCheckKey&) = default;
};

// 1 to 64 letters, digits and . _ - @.
[[nodiscard]] bool is_user_name(std::string_view text);
// 32 hexadecimal digits.
[[nodiscard]] std::string to_hex(const std::array<std::uint8_t, 16>& ticket_id);

[[nodiscard]] TicketKey new_ticket_key();
[[nodiscard]] TicketCheckKey check_key_of(const TicketKey& key);
// 64 hexadecimal digits; white space around them does not count. Error invalid_input: anything else, with a sentence
// without the text.
[[nodiscard]] Result<TicketKey> parse_ticket_key(std::string_view text);
[[nodiscard]] Result<TicketCheckKey> parse_check_key(std::string_view text);
// One to four keys, a line each: while one takes over from another, tickets of both count. Empty lines do not matter.
// Error invalid_input, naming the line.
[[nodiscard]] Result<std::vector<TicketCheckKey>> parse_check_keys(std::string_view text);
[[nodiscard]] std::string to_text(const TicketKey& key);
[[nodiscard]] std::string to_text(const TicketCheckKey& key);

// Gives the ticket an id of its own and signs it. Errors: invalid_input (no role, a name that is none).
[[nodiscard]] Result<Ticket> make_ticket(std::string room, std::string user, Role role, UnixTime expires);
// "osteon1.CONTENTS.SIGNATURE", both in base64 of URLs.
[[nodiscard]] std::string sign_ticket(const Ticket& ticket, const TicketKey& key);
// What was signed with that key. Error invalid_input: it is no ticket, or signed with another key or not at all.
[[nodiscard]] Result<Ticket> open_ticket(std::string_view text, const TicketCheckKey& key);
// Error unavailable: it has expired.
[[nodiscard]] Result<void> check_time(const Ticket& ticket, UnixTime now);
// Error unavailable: it is good for longer than a server may take, zero for any time, from now on: it does not say
// since when. A minute more is for clocks that differ.
[[nodiscard]] Result<void> check_life(const Ticket& ticket, UnixTime now, std::chrono::hours most);
// Error unsupported: it is for another room.
[[nodiscard]] Result<void> check_room(const Ticket& ticket, std::string_view room);

}  // namespace osteon
