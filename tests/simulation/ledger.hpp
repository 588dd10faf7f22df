// What a simulated room has promised, recorded from the messages that clients received. It finds faults in the room's
// journal by these promises.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/room/room.hpp"

namespace osteon::test {

// The promise that was broken.
enum class Invariant {
  one_bone,      // after quiet all have the same bone
  set_of_cuts,   // any order and repetition of the cuts not undone gives that bone
  acknowledged,  // what any client received is in the journal: at the time of receipt, and after every crash
  replay,        // replay = live = checkpoint and tail
  lease,         // nothing of a stale lease is committed
  bounds,        // queues stay within their bounds
  author_order,  // no gap, duplicate or foreign cut of an author
  felt,          // a hand feels those of its own cuts that may still be accepted, and no others
  decided,       // every cut of a present client is decided
  served,        // no client is refused, and what must work works
  datagrams,     // a receiver accepts only what a peer has sealed, once, and it agrees with the stream
  supervised,    // nothing that an instructor forbids is committed, and after quiet each hand knows its restrictions
  settled,       // after quiet all is decided and sent within two seconds
};
[[nodiscard]] std::string_view name(Invariant invariant);

struct Fault {
  Invariant invariant;
  std::string sentence;
};

class Ledger {
 public:
  void fault(Invariant invariant, std::string sentence);
  void check(bool holds, Invariant invariant, const std::string& sentence) {
    if (!holds) fault(invariant, sentence);
  }

  // An author's cuts as they were made; numbered from 1.
  void made(const Cut& cut, std::chrono::nanoseconds now);
  // The age of a cut. None if there is no such cut.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> age(const Cut& cut, std::chrono::nanoseconds now) const;
  void kept_up_to(RoomSeq seq) { kept_ = std::max(kept_, seq); }  // entries that are durable and may be sent
  // What a client received, in a stream or as an answer.
  void told_committed(RoomSeq seq, const Cut& cut);
  void told_rejected(RoomSeq seq, AuthorId author, std::uint64_t author_seq);
  void told_event(RoomSeq seq, EventKind kind);
  void told_up_to(RoomSeq seq);                                  // newest sequence number that the room reported
  void told_decided(AuthorId author, std::uint64_t author_seq);  // up to this one
  // The room's decision about an author's cut, as sent to a returning client: its sequence number. Null: it rejected
  // the cut.
  void acknowledged_seq(RoomSeq seq, AuthorId author, std::uint64_t author_seq);

  // Checks everything that the entries of a journal must satisfy.
  void check_entries(std::span<const LogEntry> entries);
  // The restrictions of each hand about which anything was decided.
  [[nodiscard]] static std::map<AuthorId, Restrictions> held(std::span<const LogEntry> entries);
  // Cuts that are not undone. Nothing if pieces have separated.
  [[nodiscard]] static std::optional<std::vector<Cut>> standing(std::span<const LogEntry> entries);

  [[nodiscard]] const std::vector<Fault>& faults() const { return faults_; }
  [[nodiscard]] std::uint64_t acknowledged() const { return told_.size(); }  // entries

 private:
  struct Told {
    EventKind kind = EventKind::cut;
    bool rejected = false;
    AuthorId author;  // of a cut
    std::uint64_t author_seq = 0;
    Digest bytes;  // of a committed cut
    friend bool operator==(const Told&, const Told&) = default;
  };
  void told(RoomSeq seq, const Told& what);
  // What an instructor forbids, implemented here independently of the room: of a cut, made or redone by `by`, and of
  // all else that changes bone or scene.
  struct Hands;
  void check_held(const LogEntry& entry, const Hands& hands);
  void check_cut(const LogEntry& entry, const Hands& hands, AuthorId by, const Cut& cut);
  void check_carried(std::span<const LogEntry> entries, std::size_t join, Hands& hands);
  void check_author(const LogEntry& entry, AuthorId author, std::uint64_t author_seq, const Digest& bytes,
                    std::map<AuthorId, std::uint64_t>& newest);

  std::map<AuthorId, std::vector<Cut>> made_;
  std::map<AuthorId, std::vector<std::chrono::nanoseconds>> made_at_;
  std::map<RoomSeq, Told> told_;
  std::map<AuthorId, std::uint64_t> decided_;
  std::set<std::pair<AuthorId, std::uint64_t>> rejected_;  // as a room reported to a returning client
  RoomSeq furthest_, kept_;
  std::vector<Fault> faults_;
};

}  // namespace osteon::test
