// A room's entries as bytes of its journal, and back.
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

// The register of a journal that has the last number given to a person.
inline constexpr const char* kPeopleRegister = "people";
// The one that has the key of what clients are told is safe.
inline constexpr const char* kWitnessRegister = "witness key";

// The name of the room, where it is no longer the one that it began with.
inline constexpr const char* kNameRegister = "room name";

// What a room began as: enough to make it again beside the case itself.
struct RoomGenesis {
  Digest case_hash;
  std::uint32_t kernel_version = 0;
  std::vector<Tool> tools;
  Digest room_genesis;  // Room::genesis()
  std::string room;     // its name
  // A branch: where it comes from.
  std::string parent;
  RoomSeq parent_room_seq;
  Digest parent_chain;
};
[[nodiscard]] RoomGenesis genesis_of(const Room& room, std::string name);
[[nodiscard]] std::string to_bytes(const RoomGenesis& genesis);
// Errors: invalid_input (not such bytes), unsupported (of a later version).
[[nodiscard]] Result<RoomGenesis> genesis_from_bytes(std::string_view bytes);
// The room as it began. Errors: unsupported (of another case or kernel than this), invalid_input.
[[nodiscard]] Result<Room> begin_room(const Case& bone, const RoomGenesis& genesis, const CutLimits& limits);

// Without place and time, which a journal keeps beside them.
[[nodiscard]] std::string to_bytes(const LogEntry& entry);
// Error invalid_input, naming the entry and the field.
[[nodiscard]] Result<LogEntry> entry_from_bytes(RoomSeq place, std::chrono::nanoseconds at, std::string_view bytes);

// {"place": 12, "at_s": 3.25, "event": {...}}, on one line.
[[nodiscard]] Result<std::string> entry_as_json(RoomSeq place, std::chrono::nanoseconds at, std::string_view bytes);

// All that a journal has of one person, as lines of JSON.
class PersonExport {
 public:
  PersonExport(std::uint32_t person, const std::vector<Person>& people);
  // {"person": 3, "label": "...", "joined_day": 20778}; nothing: it was forgotten, or there is no such.
  [[nodiscard]] const std::optional<std::string>& who() const { return who_; }
  // As entry_as_json(), of the next entry where it is this person's: its coming, and what it asked for as whoever it then
  // was.
  [[nodiscard]] Result<std::optional<std::string>> of(const JournalEntry& entry);
  [[nodiscard]] tl::unexpected<Error> nobody() const;  // error not_found

 private:
  std::uint32_t person_;
  std::optional<std::string> who_;
  std::set<AuthorId> authors_;
};

}  // namespace osteon
