// Converts a room's log entries to bytes of its journal, and back.
#pragma once
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "server/journal/journal_parts.hpp"
#include "server/room/room.hpp"

namespace osteon {

// The journal register that holds the last number given to a person.
inline constexpr const char* kPeopleRegister = "people";
// The journal register that holds the key of the witnesses sent to clients.
inline constexpr const char* kWitnessRegister = "witness key";

// The journal register that holds the name of the room, if it differs from the name at the beginning.
inline constexpr const char* kNameRegister = "room name";

// How a room began: enough to make it again, together with the case.
struct RoomGenesis {
  Digest case_hash;
  std::uint32_t kernel_version = 0;
  std::vector<Tool> tools;
  Digest room_genesis;  // Room::genesis()
  std::string room;     // name of the room
  // Only of a branch: where it comes from.
  std::string parent;
  RoomSeq parent_room_seq;
  Digest parent_chain;
};
[[nodiscard]] RoomGenesis genesis_of(const Room& room, std::string name);
[[nodiscard]] std::string to_bytes(const RoomGenesis& genesis);
// Errors: invalid_input (not such bytes), unsupported (from a later version).
[[nodiscard]] Result<RoomGenesis> genesis_from_bytes(std::string_view bytes);
// The room as it began. Errors: unsupported (another case or kernel than here), invalid_input.
[[nodiscard]] Result<Room> begin_room(const Case& bone, const RoomGenesis& genesis, const CutLimits& limits);

// Without sequence number and time, which a journal stores beside these bytes.
[[nodiscard]] std::string to_bytes(const LogEntry& entry);
// Error invalid_input, naming the entry and the field.
[[nodiscard]] Result<LogEntry> entry_from_bytes(RoomSeq seq, std::chrono::nanoseconds at, std::string_view bytes);

// {"room_seq": 12, "at_s": 3.25, "event": {...}}, on one line.
[[nodiscard]] Result<std::string> entry_as_json(RoomSeq seq, std::chrono::nanoseconds at, std::string_view bytes);

// Exports everything that a journal has of one person, as lines of JSON.
class PersonExport {
 public:
  PersonExport(std::uint32_t person, const std::vector<Person>& people);
  // {"person": 3, "label": "...", "joined_day": 20778}; nothing if the person was erased or does not exist.
  [[nodiscard]] const std::optional<std::string>& who() const { return who_; }
  // The next entry as in entry_as_json() if it belongs to this person: their join, or what they asked for under any of
  // their author numbers.
  [[nodiscard]] Result<std::optional<std::string>> of(const JournalEntry& entry);
  [[nodiscard]] tl::unexpected<Error> nobody() const;  // error not_found

 private:
  std::uint32_t person_;
  std::optional<std::string> who_;
  std::set<AuthorId> authors_;
};

}  // namespace osteon
