// The people of a room and the requests that a supervisor may send. Plain data, no gRPC.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/restrictions.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/c_arm_shot.hpp"

namespace osteon {

struct PersonSeen {
  AuthorId author;
  std::string name;  // empty: no name
  Role role = Role::none;
  bool here = false, hand = false;
  Restrictions supervision;  // what is in force for the hand
  // sequence numbers: of the newest decision (null: none), and the newest that their client acknowledged
  RoomSeq decided, acknowledged;
  AuthorId decided_by;              // who decided it; null: unknown
  std::optional<ViewFrustum> look;  // their view, if it is known
  std::uint32_t cuts = 0;           // accepted
  ShotTotals shots;                 // of their C-arm, as far as they said
  [[nodiscard]] bool pending() const { return decided && acknowledged < decided; }
};

struct WordsSeen {
  RoomSeq place;
  AuthorId from, to;  // null: to all
  std::string words;
};

struct RoomSeen {
  std::string name;
  RoomSeq room_seq;
  Digest field_hash{};
  double removed_mm3 = 0;
  std::uint64_t rejected = 0;
  std::vector<BodyId> bodies;
  std::vector<std::pair<RoomSeq, std::string>> marks;
};

// Exactly one of them is set.
struct UndoSelection {
  std::uint32_t count = 0;
  AuthorId of{};  // with count; null: of all people
  RoomSeq to{};
  std::chrono::milliseconds newest{};
  bool all = false;
};

struct DemonstrationSource {
  std::string room;      // empty: this one
  AuthorId of{};         // null: of all people
  RoomSeq from{}, to{};  // null: its beginning, its end
  double speed = 1.0;
};

// Requests wait for the answer. Errors: invalid_input, not_found, denied, unavailable.
class SupervisionClient {
 public:
  virtual ~SupervisionClient() = default;
  [[nodiscard]] virtual AuthorId self() const = 0;
  // As received from the room.
  [[nodiscard]] virtual std::vector<PersonSeen> people() const = 0;
  [[nodiscard]] virtual std::vector<Annotation> annotations() const = 0;
  [[nodiscard]] virtual std::vector<WordsSeen> words() const = 0;
  // Waits until `done` returns true; it is called after every update. False: `patience` is over, or the program is to
  // stop.
  [[nodiscard]] virtual bool wait(const std::function<bool()>& done, std::chrono::milliseconds patience) const = 0;

  // The sequence number of the event, or of the last of several. `subject` null: every hand that can be supervised.
  [[nodiscard]] virtual Result<RoomSeq> supervise(AuthorId subject, const Restrictions& supervision) = 0;
  [[nodiscard]] virtual Result<std::pair<RoomSeq, std::size_t>> undo(
      const UndoSelection& what) = 0;  // and the number of events
  [[nodiscard]] virtual Result<std::pair<RoomSeq, std::size_t>> redo(std::uint32_t count) = 0;
  [[nodiscard]] virtual Result<RoomSeq> mark(const std::string& label) = 0;
  [[nodiscard]] virtual Result<std::uint32_t> draw(const Annotation& drawn) = 0;         // its number
  [[nodiscard]] virtual Result<void> wipe_off(std::uint32_t annotation) = 0;             // 0: all of one's own
  [[nodiscard]] virtual Result<RoomSeq> say(AuthorId to, const std::string& words) = 0;  // null: to all
  // The demonstrator, and the number of cuts to be shown.
  [[nodiscard]] virtual Result<std::pair<AuthorId, std::size_t>> demonstrate(const DemonstrationSource& what) = 0;
  [[nodiscard]] virtual Result<void> end_demonstration(AuthorId demonstrator) = 0;
  [[nodiscard]] virtual Result<std::vector<std::pair<std::string, Digest>>> tools() = 0;  // by name
  [[nodiscard]] virtual Result<RoomSeen> status() = 0;
};

}  // namespace osteon
