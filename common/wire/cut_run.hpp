// Cuts in few bytes: those of one author, one after the other, as items of a SendWindow.
//
// A cut is coded against the one before it: of its first pose, which is that one's last, nothing is sent; each further
// pose is a byte that says which of its seven numbers differ from what was expected, and these differences as zigzag
// varints. Expected is the pose before, or that pose moved on by the step before, whichever takes fewer bytes. What
// cuts of a stretch have in common, and the pose to go on from, is the head of a run; it goes before the first of
// neighbouring items only. The speed of the spindle is no part of that: under load it is another in every cut, by a
// little.
//
//   cut:   knots << 3 | speed differs << 2 | own first << 1 | time differs, [path_us], [difference of spindle_rpm],
//          knots x (second order << 7 | which of x y z qx qy qz qw, ...)
//   entry:   (index step - 1) << 1 | more, [room_seq step - index step, author_seq step - 1], cut
//
// The steps of a run's first entry are passed over, since its head says where it is. Every cut comes back as it was,
// whatever its numbers; whether they make sense is for the room to judge.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/field/restrictions.hpp"
#include "common/link/send_window.hpp"
#include "osteon/v1/link.pb.h"

namespace osteon::wire {

// Short names of tools, as the room has told them to this session in a way that does not lose anything. A sender uses
// what is here and the whole hash otherwise; a receiver that does not know a number yet drops the run, which will come
// again.
class ToolNumbers {
 public:
  void add(std::uint32_t number, const Digest& tool);  // from 1; one that is known keeps its tool
  [[nodiscard]] std::optional<std::uint32_t> number_of(const Digest& tool) const;
  [[nodiscard]] std::optional<Digest> tool_of(std::uint32_t number) const;

 private:
  std::map<std::uint32_t, Digest> tools_;
  std::map<Digest, std::uint32_t> numbers_;
};

// What of a stretch of cuts is known before the next.
struct RunState {
  Cut last;            // without its path
  QuantisedPose pose;  // that the next one goes on from
};

// Cuts of more knots may be too long for a packet, whatever their numbers: they go over the stream.
inline constexpr std::size_t kMostKnotsInPacket = 24;
[[nodiscard]] inline bool fits_a_packet(const Cut& cut) { return cut.path.size() <= kMostKnotsInPacket; }

// Codes an author's own cuts. Item numbers are the cuts' author_seq, so the window begins with the first of them.
class CutSender {
 public:
  // Both must outlive this.
  CutSender(SendWindow& window, const ToolNumbers& tools) : window_(window), tools_(tools) {}
  // False, and nothing has changed, when the window is full. The cut's author_seq must be window.next(), and it must
  // fit a packet.
  [[nodiscard]] bool push(const Cut& cut);

 private:
  SendWindow& window_;
  const ToolNumbers& tools_;
  std::optional<RunState> state_;
};

// What a session is told, in its own order, which numbers these from 1.
enum class SessionEntryKind : std::uint8_t { committed, rejected, streamed, supervised };
struct SessionEntry {
  RoomSeq room_seq;
  SessionEntryKind kind = SessionEntryKind::streamed;  // what it was comes over the stream
  Cut cut{};                                       // committed
  std::uint64_t author_seq = 0;                    // rejected: of the session's own cut
  std::uint32_t reason = 0;                        // rejected: as the room numbers its reasons
  std::uint64_t lease_epoch = 0;                   // rejected, supervised: of the session, from now on
  Restrictions supervision{};                      // supervised: of the session's own hand, from now on
  Decider by{};                                    // supervised: whose decision
  friend bool operator==(const SessionEntry&, const SessionEntry&) = default;
};

// The same of an entry of any kind; a supervision of many tools, or of somebody with a long name, goes over the stream
// too.
inline constexpr std::size_t kMostToolsInPacket = 8, kMostNameInPacket = 64;
[[nodiscard]] inline bool fits_a_packet(const SessionEntry& entry) {
  return entry.kind != SessionEntryKind::streamed && fits_a_packet(entry.cut) &&
         entry.supervision.tools.size() <= kMostToolsInPacket && entry.by.name.size() <= kMostNameInPacket;
}

// Codes the entries of one session, as items whose numbers are their index.
class EntrySender {
 public:
  EntrySender(SendWindow& window, const ToolNumbers& tools) : window_(window), tools_(tools) {}
  // False, and nothing has changed, when the window is full. A cut that does not fit a packet must be told as streamed.
  [[nodiscard]] bool push(const SessionEntry& entry);
  // An author who has left: nothing of them comes any more.
  void forget(AuthorId author) { states_.erase(author); }

 private:
  struct AuthorState {
    RunState run;
    std::uint64_t index = 0;
    RoomSeq room_seq;
  };
  SendWindow& window_;
  const ToolNumbers& tools_;
  std::map<AuthorId, AuthorState> states_;
};

// One author's cuts, in order: their author_seq follow each other. Errors: invalid_input (bytes that no sender makes),
// not_found (a tool number that is not known yet).
[[nodiscard]] Result<std::vector<Cut>> cuts_of(const v1::CutRun& run, AuthorId author, const ToolNumbers& tools);

struct IndexedEntry {
  std::uint64_t index = 0;
  SessionEntry entry;
};
// All entries of a packet in order of their index. Runs whose tool is not known yet are left out; `left_out` counts them
// where it is given. Error invalid_input as above; then nothing of the packet is to be believed.
[[nodiscard]] Result<std::vector<IndexedEntry>> entries_of(const v1::DownPacket& packet, const ToolNumbers& tools,
                                                      std::size_t* left_out = nullptr);

}  // namespace osteon::wire
