// Codes cuts in few bytes: consecutive cuts of one author, as items of a SendWindow.
//
// A cut is coded against the one before it. Its first pose is the last pose of that cut and is not sent. Each further
// pose is a byte that says which of its seven numbers differ from the expected ones, followed by these differences as
// zigzag varints. The expected pose is the previous pose, or the previous pose moved by the previous step, whichever
// takes fewer bytes. What consecutive cuts have in common, and the pose to continue from, is the head of a run. Only
// the first of neighbouring items has it. The spindle speed is not in the head, because under load it differs slightly
// in every cut.
//
//     cut:   knots << 3 | speed differs << 2 | own first << 1 | time differs, [path_us], [difference of spindle_rpm],
//            knots x (second order << 7 | which of x y z qx qy qz qw, ...)
//     entry: (index step - 1) << 1 | more, [room_seq step - index step, author_seq step - 1], cut
//
// The steps of a run's first entry are ignored, because its head gives the numbers. Every cut is decoded exactly,
// whatever its numbers. The room checks whether they make sense.
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

// Short numbers for tools, as the room has sent them reliably to this session. A sender uses a number from here, or
// else the whole hash. A receiver drops a run with an unknown number, because the run will be sent again.
class ToolNumbers {
 public:
  void add(std::uint32_t number, const Digest& tool);  // from 1; a known number keeps its tool
  [[nodiscard]] std::optional<std::uint32_t> number_of(const Digest& tool) const;
  [[nodiscard]] std::optional<Digest> tool_of(std::uint32_t number) const;

 private:
  std::map<std::uint32_t, Digest> tools_;
  std::map<Digest, std::uint32_t> numbers_;
};

// What is known of a stretch of cuts before the next one.
struct RunState {
  Cut last;            // without its path
  QuantisedPose pose;  // that the next cut continues from
};

// Cuts with more knots may be too long for a packet, whatever their numbers. They go over the stream.
inline constexpr std::size_t kMostKnotsInPacket = 24;
[[nodiscard]] inline bool fits_a_packet(const Cut& cut) { return cut.path.size() <= kMostKnotsInPacket; }

// Codes an author's own cuts. Item numbers are the cuts' author_seq, so the window begins with the first cut's.
class CutSender {
 public:
  // Both arguments must outlive this object.
  CutSender(SendWindow& window, const ToolNumbers& tools) : window_(window), tools_(tools) {}
  // False, with nothing changed, if the window is full. The cut's author_seq must be window.next(), and it must fit a
  // packet.
  [[nodiscard]] bool push(const Cut& cut);

 private:
  SendWindow& window_;
  const ToolNumbers& tools_;
  std::optional<RunState> state_;
};

// What a session receives. Entries are numbered from 1, in the order of the session.
enum class SessionEntryKind : std::uint8_t { committed, rejected, streamed, supervised };
struct SessionEntry {
  RoomSeq room_seq;
  SessionEntryKind kind = SessionEntryKind::streamed;  // streamed: the content comes over the stream
  Cut cut{};                                           // committed
  std::uint64_t author_seq = 0;                        // rejected: of the session's own cut
  std::uint32_t reason = 0;                            // rejected: number in the room's list of reasons
  std::uint64_t lease_epoch = 0;                       // rejected, supervised: of the session, from now on
  Restrictions supervision{};                          // supervised: of the session's person, from now on
  Decider by{};                                        // supervised: who decided
  friend bool operator==(const SessionEntry&, const SessionEntry&) = default;
};

// The same for an entry of any kind. A supervision with many tools, or by a person with a long name, goes over the
// stream too.
inline constexpr std::size_t kMostToolsInPacket = 8, kMostNameInPacket = 64;
[[nodiscard]] inline bool fits_a_packet(const SessionEntry& entry) {
  return entry.kind != SessionEntryKind::streamed && fits_a_packet(entry.cut) &&
         entry.supervision.tools.size() <= kMostToolsInPacket && entry.by.name.size() <= kMostNameInPacket;
}

// Codes the entries of one session as items. Item numbers are the entries' indices.
class EntrySender {
 public:
  EntrySender(SendWindow& window, const ToolNumbers& tools) : window_(window), tools_(tools) {}
  // False, with nothing changed, if the window is full. A cut that does not fit a packet must be sent as streamed.
  [[nodiscard]] bool push(const SessionEntry& entry);
  // The author has left: no more cuts of this author come.
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

// One author's cuts in order, with consecutive author_seq. Errors: invalid_input (bytes that no sender produces),
// not_found (a tool number that is not known yet).
[[nodiscard]] Result<std::vector<Cut>> cuts_of(const v1::CutRun& run, AuthorId author, const ToolNumbers& tools);

struct IndexedEntry {
  std::uint64_t index = 0;
  SessionEntry entry;
};
// All entries of a packet in order of their index. Runs whose tool is not known yet are left out; `left_out`, if given,
// counts them. Error invalid_input as above; then ignore the whole packet.
[[nodiscard]] Result<std::vector<IndexedEntry>> entries_of(const v1::DownPacket& packet, const ToolNumbers& tools,
                                                           std::size_t* left_out = nullptr);

}  // namespace osteon::wire
