// What a window shows of the people: temporary notices, the restrictions of a hand, annotations and names.
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

// Wraps the text into lines of at most `columns` characters, at blanks where there are any. Text after `most` lines is
// cut off.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t columns, std::size_t most);

// The colour of a person's annotations: red, green, blue. Consecutive authors have different colours.
[[nodiscard]] std::uint32_t colour_of(AuthorId author);

// [render]
class PeopleView {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kShown{12};
  static constexpr std::size_t kMostNotices = 5;

  // `hand`: the tool operator at this window, by name or as #NUMBER; empty: nobody.
  explicit PeopleView(std::string hand = {}) : hand_(std::move(hand)) {}

  // `self`: this window's own identity. Words to it are shown as said "to you".
  void take(const PeopleSeen& seen, AuthorId self, Clock::time_point now);

  // A notice of the program itself.
  void tell(std::string text, Clock::time_point now);

  // By name, or by # and the author's number. Several can have one name, for example a person's hand and their window.
  // Then the better fit comes first, then those who are here, then the newest. Error not_found: names those who are
  // here.
  enum class Fit { anybody, looking, hand };
  [[nodiscard]] Result<PersonSeen> find(std::string_view who, Fit fit = Fit::anybody) const;
  // "Ada", or "#3" for a person without a name.
  [[nodiscard]] std::string name_of(AuthorId author) const;
  [[nodiscard]] std::map<AuthorId, std::string> names() const;
  [[nodiscard]] const std::vector<Annotation>& annotations() const { return annotations_; }

  // The newest words and decisions, oldest first.
  [[nodiscard]] std::vector<std::string> notices(Clock::time_point now) const;
  // The restrictions of the hand while they are in force, in lines. Empty: none.
  [[nodiscard]] std::string holding() const;

 private:
  struct Notice {
    Clock::time_point until;
    std::string text;
  };
  [[nodiscard]] bool is_hand(const PersonSeen& person) const;
  [[nodiscard]] std::string guard(const PersonSeen& person) const;  // who last decided about them
  void notice_decision(const PersonSeen& person, const Restrictions& before, Clock::time_point now);

  std::string hand_;
  AuthorId self_{};
  std::map<AuthorId, PersonSeen> people_;
  std::vector<Annotation> annotations_;
  std::deque<Notice> notices_;
  RoomSeq newest_words_{};
};

}  // namespace osteon
