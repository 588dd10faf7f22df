// Which role may do what. The one table for calls, datagrams of a session and contents of streams. Anything that is not
// in the table is refused.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>

#include "common/access/role.hpp"

namespace osteon {

class RoleSet {
 public:
  constexpr RoleSet() = default;
  constexpr RoleSet(std::initializer_list<Role> roles) {
    for (const Role role : roles) bits_ |= 1u << static_cast<unsigned>(role);
  }
  [[nodiscard]] constexpr bool has(Role role) const { return (bits_ >> static_cast<unsigned>(role) & 1u) != 0; }

 private:
  std::uint32_t bits_ = 0;
};

// A call by its full name, as in :path of HTTP/2.
struct CallRow {
  std::string_view method;
  RoleSet roles;
};
[[nodiscard]] std::span<const CallRow> call_rows();
// Null if the table does not contain the call.
[[nodiscard]] const CallRow* find_call(std::string_view method);
[[nodiscard]] bool may_call(Role role, std::string_view method);
// "DeleteRoom" of "/osteon.v1.RoomsService/DeleteRoom"; "call" of nothing.
[[nodiscard]] std::string_view call_name(std::string_view method);

// Contents of a session's packets, up and down: proto/osteon/v1/link.proto.
enum class DatagramContent : std::uint8_t {
  cuts,
  tool_state,
  bone_push,
  acknowledgements,  // decisions about the client's own cuts
  committed_cuts,    // cuts of others
  partners,          // tools of others
  supervision,       // decisions about the client
  bone_seen,
};
inline constexpr int kDatagrams = 8;
// Whether the role may send what goes up, or receive what comes down.
[[nodiscard]] bool may_carry(Role role, DatagramContent kind);

// Contents of streams. A stream leaves out what the role may not receive.
enum class StreamContent : std::uint8_t {
  surface,             // blocks of the bone
  tool_states,         // of everyone
  scene,               // items on the bone, and annotations
  field,               // leaves, committed cuts
  people,              // presence
  own_supervision,     // decisions about the reader
  others_supervision,  // decisions about others
  own_words,           // messages to all, to the reader or from the reader
  others_words,        // messages between others
  shots,               // of everyone's C-arm
};
inline constexpr int kStreamContents = 10;
[[nodiscard]] bool may_receive(Role role, StreamContent content);

// Rights that the name of a call does not determine.
enum class Right : std::uint8_t {
  hold_a_tool,   // join as a haptic client
  undo_own,      // events of the same person
  undo_anyones,  // also events of others, and back to a mark, but not all events of others at once
  undo_all,      // also everything, back to the imported bone
};
inline constexpr int kRights = 4;
[[nodiscard]] bool has_right(Role role, Right right);

}  // namespace osteon
