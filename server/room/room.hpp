// The room: owns the bone, puts cuts in one order, judges them, applies them. A function of what it was given: no
// clock, thread, log, file or network, so a test runs it on virtual time.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/surface/surface_blocks.hpp"
#include "common/tools/tool.hpp"
#include "common/volume/cut_field.hpp"
#include "server/room/block_store.hpp"

namespace osteon {

// What a client may do here: only a surgeon's cuts are taken.
enum class MemberKind : std::uint8_t { surgeon, watcher };

// Bounds on a cut, checked before any of it is evaluated.
struct CutLimits {
  int path_knots = 64;
  double beyond_bone_mm = 60.0;     // how far outside the bone's box a tool's tip may be
  double swept_mm = 25.0;           // way of the cutting part in one cut, its turning included
  std::uint32_t spindle_rpm = 120000;
};

enum class Rejection : std::uint8_t {
  none,
  body,       // no such body
  lease,      // made under a lease that is over
  tool,       // not a registered tool, or one that does not cut
  level,      // finer than the tool or the case allows
  path,       // no knots or too many
  rotation,   // a quaternion far from unit
  place,      // too far from the bone
  sweep,      // too long a way for one cut
  spindle,    // faster than any spindle
};
[[nodiscard]] std::string_view sentence(Rejection reason);

// A decided cut: its place in the room's order and whether it was applied there.
struct Outcome {
  RoomSeq room_seq;
  Rejection rejection = Rejection::none;
  bool repeated = false;   // decided before: this is its first outcome
  CutReport report;        // of an applied cut
  [[nodiscard]] bool committed() const { return rejection == Rejection::none; }
};

struct RoomCounts {
  std::uint64_t committed = 0;
  std::uint64_t rejected = 0;
  std::uint64_t repeated = 0;
  std::uint64_t refused = 0;  // breaches that got no place in the order
};

// Not synchronised: one thread calls the changing functions, or several the const ones.
class Room {
 public:
  explicit Room(Case bone, CutLimits limits = {}, std::shared_ptr<ToolBox> tools = builtin_tool_box());

  // A new identity, never given twice.
  AuthorId join(MemberKind kind);
  [[nodiscard]] bool knows(AuthorId author) const;
  [[nodiscard]] bool may_cut(AuthorId author) const { return surgeons_.contains(author); }
  [[nodiscard]] std::uint64_t lease_epoch() const { return 1; }  // no event of this room ends a lease

  // Gives the cut its place and applies it. Error invalid_input, without a place in the order: an author that may not
  // cut, a gap in author_seq, or a number that was decided with other bytes.
  Result<Outcome> submit(const Cut& cut);

  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }
  [[nodiscard]] const RoomCounts& counts() const { return counts_; }
  [[nodiscard]] const Case& bone() const { return field_.bone(); }
  [[nodiscard]] const CutField& field() const { return field_; }
  [[nodiscard]] Digest field_hash() const { return field_.hash(); }

  // Blocks whose payload the cuts since the last call have made stale, each once.
  [[nodiscard]] std::vector<BlockKey> take_stale_blocks();
  [[nodiscard]] std::size_t stale_blocks() const { return stale_.size(); }
  // Every block that the uncut bone may have a surface in.
  [[nodiscard]] std::vector<BlockKey> bone_blocks() const;
  // Copies what make_block() needs, so that only this has to be kept from running beside submit().
  [[nodiscard]] BlockSamples gather_block(const BlockKey& key) const;

 private:
  struct Decided {
    Digest bytes;
    RoomSeq room_seq;
    Rejection rejection = Rejection::none;
  };
  [[nodiscard]] Rejection judge(const Cut& cut) const;

  CutLimits limits_;
  std::shared_ptr<ToolBox> tools_;  // shared with the field and, beyond the room, with those that list tools
  CutField field_;
  SurfaceBlocks surface_;
  std::set<BlockKey> stale_;
  RoomSeq room_seq_;
  std::uint64_t authors_ = 0;
  std::map<AuthorId, std::vector<Decided>> surgeons_;  // row author_seq − 1
  RoomCounts counts_;
};

}  // namespace osteon
