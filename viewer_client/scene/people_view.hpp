// What a window shows of the people: notices that pass, what holds for a hand, what is drawn, who is called what.
#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "viewer_client/scene/people_seen.hpp"

namespace osteon {

// The text in lines of at most `columns` characters, broken at blanks where there are some; after `most` lines it is
// cut off.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t columns, std::size_t most);

// In which somebody draws: red, green, blue. Those who come one after the other have different ones.
[[nodiscard]] std::uint32_t colour_of(AuthorId author);

// [render]
class PeopleView {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kShown{12};
  static constexpr std::size_t kMostNotices = 5;

  // `hand`: who sits before this window with a hand, by name or as #NUMBER; empty: nobody.
  explicit PeopleView(std::string hand = {}) : hand_(std::move(hand)) {}

  // `self`: this window's own identity; what is said to it is said "to you".
  void take(const PeopleSeen& seen, AuthorId self, Clock::time_point now);

  // A notice of the program's own.
  void tell(std::string text, Clock::time_point now);

  // By name, or by # and the author's number. Of several of one name - a person's hand and their window - those who fit
  // better, then those who are here, then the newest. Error not_found, naming those who are here.
  enum class Fit { anybody, looking, hand };
  [[nodiscard]] Result<PersonSeen> find(std::string_view who, Fit fit = Fit::anybody) const;
  // "Ada", or "#3" for somebody without a name.
  [[nodiscard]] std::string name_of(AuthorId author) const;
  [[nodiscard]] std::map<AuthorId, std::string> names() const;
  [[nodiscard]] const std::vector<Annotation>& annotations() const { return annotations_; }

  // Who said what and what was decided lately, oldest first.
  [[nodiscard]] std::vector<std::string> notices(Clock::time_point now) const;
  // What holds for the hand as long as it does, in lines; empty: nothing.
  [[nodiscard]] std::string holding() const;

 private:
  struct Notice {
    Clock::time_point until;
    std::string text;
  };
  [[nodiscard]] bool is_hand(const PersonSeen& person) const;
  [[nodiscard]] std::string guard(const PersonSeen& person) const;  // who decided last about them
  void notice_decision(const PersonSeen& person, const Restrictions& before, Clock::time_point now);

  std::string hand_;
  AuthorId self_{};
  std::map<AuthorId, PersonSeen> people_;
  std::vector<Annotation> annotations_;
  std::deque<Notice> notices_;
  RoomSeq newest_words_{};
};

}  // namespace osteon
