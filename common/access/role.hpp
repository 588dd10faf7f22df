// What a person may do in a room.
#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace osteon {

// The same numbers as Role of the protocol. Journals and tickets store them, so they never change.
enum class Role : std::uint8_t {
  none = 0,
  observer = 1,      // watches and listens
  trainee = 2,       // cuts, and undoes their own events
  collaborator = 3,  // cuts, and undoes anyone's events
  instructor = 4,    // supervises the others too
  operator_ = 5,     // creates and deletes rooms
};
inline constexpr int kRoles = 6;

[[nodiscard]] std::string_view to_string(Role role);  // "observer", …, "operator"
// Nothing if the text is none of these.
[[nodiscard]] std::optional<Role> parse_role(std::string_view text);

}  // namespace osteon
