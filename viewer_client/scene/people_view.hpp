// What a window shows of the people: notices that pass, what holds for a hand, what is drawn, who is called what.
#pragma once
#include <chrono>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "viewer_client/scene/person.hpp"

namespace osteon {

// The text in lines of at most `columns` characters, broken at blanks where there are some; after `most` lines it is cut off.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t columns, std::size_t most);

// [render]
class PeopleView {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kShown{12};
  static constexpr std::size_t kMostNotices = 5;

  // `hand`: who sits before this window with a hand, by name or as #NUMBER; empty: nobody.
  explicit PeopleView(std::string hand = {}) : hand_(std::move(hand)) {}

  void take(const PeopleChange& change, Clock::time_point now);
  // This window's own identity: what is said to it is said "to you".
  void set_self(AuthorId self) { self_ = self; }

  // By name, or by # and the author's number. Of several of one name those who are here, then the newest.
  // Error not_found, naming those who are known.
  [[nodiscard]] Result<Person> find(std::string_view who) const;
  // "Ada", or "#3" for somebody without a name.
  [[nodiscard]] std::string name_of(AuthorId author) const;
  [[nodiscard]] std::map<AuthorId, std::string> names() const;
  [[nodiscard]] std::vector<Annotation> annotations() const;  // in the order of their numbers
  [[nodiscard]] RoomSeq room_seq() const { return room_seq_; }

  // Who said what and what was decided lately, oldest first.
  [[nodiscard]] std::vector<std::string> notices(Clock::time_point now) const;
  // What holds for the hand as long as it does, in lines; empty: nothing.
  [[nodiscard]] std::string holding() const;

 private:
  struct Notice {
    Clock::time_point until;
    std::string text;
  };
  [[nodiscard]] bool is_hand(const Person& person) const;
  [[nodiscard]] std::string overseer() const;
  void notice_decision(const Person& person, const Supervision& before, Clock::time_point now);
  void notice(std::string text, Clock::time_point now);

  std::string hand_;
  AuthorId self_{};
  std::map<AuthorId, Person> people_;
  std::map<std::uint32_t, Annotation> annotations_;
  std::deque<Notice> notices_;
  RoomSeq room_seq_{}, newest_words_{};
};

}  // namespace osteon
