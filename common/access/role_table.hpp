// Which role may do what: the one table for calls, for the datagrams of a session, and for what streams carry. What is
// not in it is refused.
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

// A call by its full name, as HTTP/2 has it in :path.
struct CallRow {
  std::string_view method;
  RoleSet roles;
};
[[nodiscard]] std::span<const CallRow> call_rows();
// Null for a call that the table does not know.
[[nodiscard]] const CallRow* find_call(std::string_view method);
[[nodiscard]] bool may_call(Role role, std::string_view method);

// What a session's packets carry, up and down: proto/osteon/v1/link.proto.
enum class DatagramContent : std::uint8_t {
  cuts,
  tool_state,
  bone_push,
  acknowledgements,  // what became of the client's own cuts
  committed_cuts,    // of others
  partners,          // others' tools
  supervision,       // what was decided about the client
  bone_seen,
};
inline constexpr int kDatagrams = 8;
// As sender of what goes up, as hearer of what comes down.
[[nodiscard]] bool may_carry(Role role, DatagramContent kind);

// What streams tell. Of what a role may not be told the stream goes on without it.
enum class StreamContent : std::uint8_t {
  surface,             // blocks of the bone
  tool_states,         // of everyone
  scene,               // what stands on the bone, and what is drawn there
  field,               // leaves, committed cuts
  people,              // who is there
  own_supervision,     // what was decided about the reader
  others_supervision,  // what was decided about others
  own_words,           // said to all, to the reader or by the reader
  others_words,        // said between others
};
inline constexpr int kStreamContents = 9;
[[nodiscard]] bool may_receive(Role role, StreamContent content);

// What a call does that its name does not say.
enum class Right : std::uint8_t {
  hold_a_tool,   // join as a haptic client
  undo_own,      // events of the same person
  undo_anyones,  // those of others too, and back to a mark, but not all that others did
  undo_all,      // that too, and back to the imported bone
};
inline constexpr int kRights = 4;
[[nodiscard]] bool has_right(Role role, Right right);

}  // namespace osteon
