// Knows who is in a room, what was decided about whom, what is drawn, the latest messages, and the latest shots of
// everybody's C-arm. WatchPeople sends this to each reader, as far as the reader's role allows.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/id.hpp"
#include "common/core/mutex.hpp"
#include "common/surface/view_frustum.hpp"
#include "common/tools/c_arm_shot.hpp"
#include "server/publish/send_queue.hpp"
#include "server/publish/subscriber.hpp"
#include "server/room/room.hpp"

namespace osteon {

class PresenceSubscriber : public Subscriber {
 public:
  virtual void changed() = 0;  // there may be news(): the subscriber asks for them when it can send
};

// How much a reader has received.
struct PresenceCursor {
  std::uint64_t revision = 0, words = 0, runs = 0;
  std::set<std::uint32_t> annotations;
  bool begun = false;
};

// What a reader may receive. "Own" means everything about anyone of the reader's name: several joins by one name are
// one person.
struct PeopleRights {
  bool people = true, drawings = true, own_supervision = true, others_supervision = true, own_words = true,
       others_words = true, shots = true;
};

// Any thread may call it.
class Presence {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostWords = 64;    // the latest ones
  static constexpr std::size_t kMostRuns = 64;     // of shots; beyond, see surplus_run()
  static constexpr std::size_t kMostAbsent = 256;  // people who have left; the latest ones
  static constexpr std::chrono::milliseconds kApart{100};

  // `names`: names of people by pseudonym, as far as they are known.
  Presence(const Room& room, const std::map<std::uint32_t, std::string>& names);

  void joined(AuthorId author, const std::string& name, Role role, bool hand);
  void came(AuthorId author);  // one more session or stream of theirs; ignored if the author is unknown
  void went(AuthorId author);
  void take(const RoomEvent& event);  // supervise, annotation, words; other kinds are ignored
  void took_cut(AuthorId author);
  void acknowledged(AuthorId author, RoomSeq seq);
  void looked(AuthorId author, const ViewFrustum& from);
  // The newest press of the author's C-arm, so far. It takes the place of what was known of this press. What is older
  // than that is ignored, and so is an unknown author.
  void shot(AuthorId author, ShotRun run, const ShotTotals& session);

  // People with a tool, present or not, who may be supervised together. Instructors are not among them.
  [[nodiscard]] std::vector<AuthorId> supervised_hands() const;
  [[nodiscard]] RoomSeq acknowledged_by(AuthorId author) const;
  [[nodiscard]] std::string name_of(AuthorId author) const;  // empty: unknown author, or name no longer known

  // The subscriber is notified of every change until it leaves or all streams end.
  void watch(PresenceSubscriber& subscriber);
  void leave(PresenceSubscriber& subscriber);
  void end_streams(const std::string& why);  // those open now and those opened later
  [[nodiscard]] std::size_t streams() const;
  // [tick] Notifies readers at most once every kApart.
  void publish(RoomSeq room_seq, Clock::time_point now);

  // A whole WatchPeopleResponse with what the reader lacks; null: nothing. Contains the newest state of each person,
  // annotation and press of a pedal, and the messages that are still stored.
  [[nodiscard]] Bytes news(PresenceCursor& cursor, AuthorId reader, const PeopleRights& rights) const;

 private:
  struct Entry {
    std::uint64_t revision = 0;
    std::string name;
    Role role = Role::none;
    bool hand = false;
    int streams = 0;
    Restrictions supervision;
    RoomSeq decided, acknowledged;
    AuthorId decided_by;
    std::optional<ViewFrustum> look;
    std::uint32_t cuts = 0;
    ShotTotals shots;
    std::uint64_t last_here = 0;  // revision
  };
  struct Drawn {
    std::uint64_t revision = 0;
    Annotation annotation;
  };
  struct ChatEntry {
    std::uint64_t number = 0;
    RoomSeq seq;
    AuthorId from, to;
    std::string words;
  };
  struct RunEntry {
    std::uint64_t number = 0;
    ShotRun run;
  };
  Entry* change(AuthorId author) OSTEON_REQUIRES(mutex_);  // null: unknown author

  mutable Mutex streams_mutex_{LockRank::people_streams};
  std::vector<PresenceSubscriber*> subscribers_ OSTEON_GUARDED_BY(streams_mutex_);
  std::optional<std::string> ended_ OSTEON_GUARDED_BY(streams_mutex_);
  Clock::time_point next_{};  // used by the tick thread

  mutable Mutex mutex_{LockRank::leaf};
  std::uint64_t revision_ OSTEON_GUARDED_BY(mutex_) = 1, published_ OSTEON_GUARDED_BY(mutex_) = 0;
  std::map<AuthorId, Entry> people_ OSTEON_GUARDED_BY(mutex_);
  std::map<std::uint32_t, Drawn> annotations_ OSTEON_GUARDED_BY(mutex_);
  std::deque<ChatEntry> words_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t words_said_ OSTEON_GUARDED_BY(mutex_) = 0;
  std::deque<RunEntry> runs_ OSTEON_GUARDED_BY(mutex_);
  std::uint64_t runs_told_ OSTEON_GUARDED_BY(mutex_) = 0;
  RoomSeq room_seq_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace osteon
