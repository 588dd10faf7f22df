// What a simulated room has promised, noted where it was heard, and what is wrong with its journal in the light of
// that.
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

// Which promise was broken.
enum class Invariant {
  one_bone,      // after quiet all hold the same
  set_of_cuts,   // any order and repetition of the standing cuts gives that bone
  acknowledged,  // what anyone was told is in the journal: when they hear of it, and after every crash
  replay,        // replay = live = checkpoint and tail
  lease,         // nothing of a stale lease is committed
  bounds,        // queues stay within them
  author_order,  // no gap, duplicate or foreign cut of an author
  felt,          // a hand feels those of its cuts that may still be taken, and no others
  decided,       // every cut of a client that is there is decided
  served,        // nobody is turned away, and what must work works
  datagrams,     // only what a peer has sealed is taken, once, and it says what the stream says
  supervised,      // what an instructor forbids is not committed, and after quiet each hand knows what holds for it
  settled,       // after quiet all is decided and told within two seconds
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

  // An author's cuts as he made them; numbered from 1.
  void made(const Cut& cut, std::chrono::nanoseconds now);
  // So long ago; none where there is no such cut.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> age(const Cut& cut, std::chrono::nanoseconds now) const;
  void kept_up_to(RoomSeq place) { kept_ = std::max(kept_, place); }  // what anyone may be told of
  // What a client heard, or was answered.
  void told_committed(RoomSeq place, const Cut& cut);
  void told_rejected(RoomSeq place, AuthorId author, std::uint64_t author_seq);
  void told_event(RoomSeq place, EventKind kind);
  void told_up_to(RoomSeq place);                                // the room was said to stand there
  void told_decided(AuthorId author, std::uint64_t author_seq);  // up to this one
  // Where the room has put an author's cut, as it says to whoever comes back; null: it rejected the cut.
  void told_place(RoomSeq place, AuthorId author, std::uint64_t author_seq);

  // Everything that the entries of a journal can be held against.
  void check_entries(std::span<const LogEntry> entries);
  // What holds for each hand of whom anything was decided.
  [[nodiscard]] static std::map<AuthorId, Restrictions> held(std::span<const LogEntry> entries);
  // Cuts that no undo has taken back; nothing when pieces came apart.
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
  void told(RoomSeq place, const Told& what);
  // What an instructor forbids, in this page's own words: of a cut, made or done again by `by`, and of all else that
  // changes bone or scene.
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
  std::set<std::pair<AuthorId, std::uint64_t>> rejected_;  // that a room said to whoever came back
  RoomSeq furthest_, kept_;
  std::vector<Fault> faults_;
};

}  // namespace osteon::test
