// A viewer's copy of the bone, made of what the field's stream sends.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/core/result.hpp"
#include "common/volume/replica.hpp"

namespace osteon::v1 {
class BoneChange;
class CommittedCut;
class FieldComplete;
class FieldLeaf;
class ToolAdded;
class WatchFieldResponse;
}  // namespace osteon::v1

namespace osteon {

// Where the bone has changed since somebody looked.
struct FieldChanges {
  bool all = false;                     // everywhere: what is listed is not all
  std::vector<ChangedLeaves> leaves{};  // in all bodies
};

// The bone is whole after each message: an event of several messages is applied with its last. Sawn pieces are bodies
// of the replica; they stay in the bone's frame. Not synchronised.
class FieldFollower {
 public:
  static constexpr std::size_t kMostBodies = 4096;        // [A] a server that names more is at fault
  static constexpr std::size_t kMostChanged = 64 * 1024;  // leaves that changes() lists

  // `most_bytes`: of cut fields, leaves that wait and tools together. The case itself is not counted.
  FieldFollower(const Case& bone, std::size_t most_bytes);

  // A stream begins: leaves and events are counted anew. The bone stays as it is until the new leaves are complete.
  void begin();
  // Errors: unavailable (a message is missing: ask again), exhausted (more than `most_bytes`), unsupported (a newer
  // server), invalid_input (no correct server sends that). After an error, nothing but begin() may follow.
  [[nodiscard]] Result<void> take(const v1::WatchFieldResponse& message);

  [[nodiscard]] bool whole() const { return whole_; }          // a bone was received
  [[nodiscard]] bool follows() const { return follows_; }      // of the present stream too
  [[nodiscard]] const Replica& bone() const { return bone_; }  // of whole()
  [[nodiscard]] std::size_t bytes() const { return field_bytes_ + waiting_bytes_ + tool_bytes_; }
  [[nodiscard]] FieldChanges take_changes();

 private:
  [[nodiscard]] Result<void> take_beginning(const v1::WatchFieldResponse& message);
  [[nodiscard]] Result<void> take_event(const v1::WatchFieldResponse& message);
  [[nodiscard]] Result<void> take(const v1::FieldComplete& complete);
  [[nodiscard]] Result<void> take(const v1::CommittedCut& committed);
  [[nodiscard]] Result<void> take(const v1::BoneChange& change);
  [[nodiscard]] Result<void> take(const v1::ToolAdded& added);
  [[nodiscard]] Result<void> keep_waiting(const v1::FieldLeaf& sent);
  [[nodiscard]] bool is_near(const Vec3& at_mm) const;
  [[nodiscard]] Result<void> weigh();  // the fields
  [[nodiscard]] Result<void> check_bytes() const;
  void note_changes();

  const double pitch_mm_;
  const Box near_;  // where leaves may begin and tips may be
  const std::size_t most_bytes_;
  const std::shared_ptr<ToolBox> tools_ = builtin_tool_box();  // shared with the replica's fields
  Replica bone_;
  bool whole_ = false, follows_ = false;
  std::uint64_t newest_ = 0;         // index of the newest message that was taken
  std::vector<FieldLeaf> waiting_;   // of a beginning, or of an event whose last message has not come
  std::optional<RoomSeq> changing_;  // that event
  std::size_t field_bytes_ = 0, waiting_bytes_ = 0, tool_bytes_ = 0;
  int cuts_unweighed_ = 0;
  bool all_changed_ = true;
  std::set<std::pair<int, Coord>> changed_;
};

}  // namespace osteon
