// Who is in a room, what was decided about whom, what is drawn and what was said lately: what WatchPeople tells, and
// each reader as far as their role goes.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/access/role.hpp"
#include "common/core/id.hpp"
#include "common/surface/view_frustum.hpp"
#include "server/net/send_queue.hpp"
#include "server/net/subscriber.hpp"
#include "server/room/room.hpp"

namespace osteon {

class PresenceSubscriber : public Subscriber {
 public:
  virtual void changed() = 0;  // there may be news(): it asks for them when it can send
};

// How far a reader has come.
struct PresenceCursor {
  std::uint64_t revision = 0, words = 0;
  std::set<std::uint32_t> annotations;
  bool begun = false;
};

// What a reader may be told. Own is what concerns anyone of the reader's name: who has come by it is one person.
struct PeopleRights {
  bool people = true, drawings = true, own_supervision = true, others_supervision = true, own_words = true,
       others_words = true;
};

// Any thread. Lock order: that of the streams, then a stream's own, then that of the people.
class Presence {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostWords = 64;    // said last
  static constexpr std::size_t kMostAbsent = 256;  // people who are not here, those who were here last
  static constexpr std::chrono::milliseconds kApart{100};

  // `names`: of people by their pseudonym, as far as they are known.
  Presence(const Room& room, const std::map<std::uint32_t, std::string>& names);

  void joined(AuthorId author, const std::string& name, Role role, bool hand);
  void came(AuthorId author);  // one more session or stream of theirs; of nobody: nothing
  void went(AuthorId author);
  void take(const RoomEvent& event);  // supervise, annotation, words; of another kind: nothing
  void took_cut(AuthorId author);
  void heard(AuthorId author, RoomSeq place);
  void looked(AuthorId author, const ViewFrustum& from);

  // Of those who have a hand, here or not, and may be supervised together: instructors are not among them.
  [[nodiscard]] std::vector<AuthorId> supervised_hands() const;
  [[nodiscard]] RoomSeq acknowledged_by(AuthorId author) const;
  [[nodiscard]] std::string name_of(AuthorId author) const;  // empty: nobody's, or not known any more

  // The subscriber hears of every change until it leaves or all streams end.
  void watch(PresenceSubscriber& subscriber);
  void leave(PresenceSubscriber& subscriber);
  void end_streams(const std::string& why);  // those open now and those that come later
  [[nodiscard]] std::size_t streams() const;
  // [tick] Readers hear at most every kApart that there is something new.
  void publish(RoomSeq room_seq, Clock::time_point now);

  // A whole WatchPeopleResponse of what the reader lacks; null: nothing. The newest of each person and annotation, and
  // of words those that are still here.
  [[nodiscard]] Bytes news(PresenceCursor& cursor, AuthorId reader, const PeopleRights& rights) const;

 private:
  struct Entry {
    std::uint64_t revision = 0;
    std::string name;
    Role role = Role::none;
    bool hand = false;
    int streams = 0;
    Restrictions supervision;
    RoomSeq decided, heard;
    AuthorId decided_by;
    std::optional<ViewFrustum> look;
    std::uint32_t cuts = 0;
    std::uint64_t last_here = 0;  // revision
  };
  struct Drawn {
    std::uint64_t revision = 0;
    Annotation annotation;
  };
  struct Said {
    std::uint64_t number = 0;
    RoomSeq place;
    AuthorId from, to;
    std::string words;
  };
  Entry* change(AuthorId author);  // under mutex_; null: nobody is known by that

  mutable std::mutex streams_mutex_;
  std::vector<PresenceSubscriber*> subscribers_;
  std::optional<std::string> ended_;
  Clock::time_point next_{};  // of the tick

  mutable std::mutex mutex_;
  std::uint64_t revision_ = 1, told_ = 0;
  std::map<AuthorId, Entry> people_;
  std::map<std::uint32_t, Drawn> annotations_;
  std::deque<Said> words_;
  std::uint64_t words_said_ = 0;
  RoomSeq room_seq_;
};

}  // namespace osteon
