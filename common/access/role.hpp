// What a person may do in a room.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace osteon {

// Kept in journals, in tickets and sent, as Role of the protocol: numbers stay.
enum class Role : std::uint8_t {
  none = 0,
  observer = 1,      // watches and listens
  trainee = 2,       // cuts, and takes back what is their own
  collaborator = 3,  // cuts, and takes back what is anyone's
  instructor = 4,    // supervises the others too
  operator_ = 5,     // makes and deletes rooms
};
inline constexpr int kRoles = 6;

[[nodiscard]] std::string_view to_string(Role role);  // "observer", …, "operator"
// Nothing where it is none of these.
[[nodiscard]] std::optional<Role> parse_role(std::string_view text);

}  // namespace osteon
