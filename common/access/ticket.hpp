// Join tickets: which person may enter which room, in which role, until when. Whoever runs the server signs them with
// Ed25519. A certificate says who a person is. The ticket says what the person may do.
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
  std::array<std::uint8_t, 16> id{};  // unique to this ticket
  std::string room;                   // room name; kAnyRoom: every room of the server
  std::string user;                   // as in osteon://person/USER of the certificate
  Role role = Role::none;
  UnixTime expires{};
  friend bool operator==(const Ticket&, const Ticket&) = default;
};
inline constexpr std::string_view kAnyRoom = "*";
inline constexpr std::size_t kMostTicketChars = 1024;  // of the text form
inline constexpr std::chrono::hours kLongTicket{168};  // longer validity needs a reason

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
// 64 hexadecimal digits; surrounding white space is ignored. Error invalid_input for anything else. The message does
// not contain the text.
[[nodiscard]] Result<TicketKey> parse_ticket_key(std::string_view text);
[[nodiscard]] Result<TicketCheckKey> parse_check_key(std::string_view text);
// One to four keys, one in each line. While a new key replaces an old one, tickets of both are valid. Empty lines are
// ignored. Error invalid_input, naming the line.
[[nodiscard]] Result<std::vector<TicketCheckKey>> parse_check_keys(std::string_view text);
[[nodiscard]] std::string to_text(const TicketKey& key);
[[nodiscard]] std::string to_text(const TicketCheckKey& key);

// Gives the ticket a new id. Errors: invalid_input (no role, or a bad name).
[[nodiscard]] Result<Ticket> make_ticket(std::string room, std::string user, Role role, UnixTime expires);
// Text "osteon1.CONTENTS.SIGNATURE", both parts in base64url.
[[nodiscard]] std::string sign_ticket(const Ticket& ticket, const TicketKey& key);
// The ticket that was signed with this key. Error invalid_input: it is no ticket, is unsigned, or was signed with
// another key.
[[nodiscard]] Result<Ticket> open_ticket(std::string_view text, const TicketCheckKey& key);
// Error unavailable: the ticket has expired.
[[nodiscard]] Result<void> check_time(const Ticket& ticket, UnixTime now);
// Error unavailable: from now on, the ticket is valid for longer than the server allows; a `most` of zero allows any
// time. The ticket does not say when it was made. One minute is added for clocks that differ.
[[nodiscard]] Result<void> check_life(const Ticket& ticket, UnixTime now, std::chrono::hours most);
// Error unsupported: the ticket is for another room.
[[nodiscard]] Result<void> check_room(const Ticket& ticket, std::string_view room);

}  // namespace osteon
