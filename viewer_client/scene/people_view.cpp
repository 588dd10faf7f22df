#include "viewer_client/scene/people_view.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <set>
#include <utility>

#include "common/tools/cut_body.hpp"
#include "common/tools/tool.hpp"

namespace osteon {

namespace {

bool starts_character(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) != 0x80; }  // UTF-8

std::string tool_names(const std::vector<Digest>& tools) {
  std::string names;
  std::size_t unknown = 0;
  for (const Digest& hash : tools) {
    const auto known = std::ranges::find_if(builtin_tools(), [&](const Tool& tool) { return tool.hash() == hash; });
    if (known == builtin_tools().end())
      ++unknown;
    else
      names += (names.empty() ? "" : ", ") + known->name;
  }
  const std::string others = std::to_string(unknown) + (unknown == 1 ? " other tool" : " other tools");
  if (unknown != 0) names += (names.empty() ? "" : " and ") + others;
  return names;
}

template <class... Number>
std::string printed(const char* form, Number... number) {
  char text[128];
  std::snprintf(text, sizeof text, form, number...);
  return text;
}

std::string radius_text(const ZoneLimit& zone) { return printed("%.1f mm", kQuantum_mm * zone.radius); }

}  // namespace

std::string wrapped(std::string_view text, std::size_t columns, std::size_t most) {
  std::vector<std::string> lines(1);
  std::size_t used = 0;  // characters of the last line
  for (std::size_t at = 0; at < text.size();) {
    if (static_cast<unsigned char>(text[at]) <= ' ') {
      ++at;
      continue;
    }
    std::size_t end = at, length = 0;
    for (; end < text.size() && static_cast<unsigned char>(text[end]) > ' '; ++end) {
      if (!starts_character(text[end])) continue;
      if (length == columns) break;  // no word is longer than a line
      ++length;
    }
    const bool glued = at > 0 && static_cast<unsigned char>(text[at - 1]) > ' ';
    const std::size_t blank = used > 0 && !glued ? 1 : 0;
    if (used > 0 && used + blank + length > columns) {
      lines.emplace_back();
      used = 0;
    } else if (blank != 0) {
      lines.back() += ' ';
      ++used;
    }
    lines.back() += text.substr(at, end - at);
    used += length;
    at = end;
  }
  std::string out;
  for (std::size_t i = 0; i < std::min(lines.size(), most); ++i) out += (i == 0 ? "" : "\n") + lines[i];
  return lines.size() > most ? out + " ..." : out;
}

std::uint32_t colour_of(AuthorId author) {
  // Distinct from bone, steel and each other, also for most colour-blind people (after Okabe and Ito 2008).
  constexpr std::array<std::uint32_t, 6> kColours{0xf0e442, 0x56b4e9, 0x1ecc8a, 0xff7a1a, 0xe377c2, 0x2f7fff};
  return kColours[author.value % kColours.size()];
}

void PeopleView::take(const PeopleSeen& seen, AuthorId self, Clock::time_point now) {
  self_ = self;
  std::map<AuthorId, PersonSeen> before = std::exchange(people_, {});
  for (const PersonSeen& person : seen.people) people_[person.author] = person;
  annotations_ = seen.annotations;

  for (const PersonSeen& person : seen.people) notice_decision(person, before[person.author].supervision, now);
  for (const WordsSeen& said : seen.words) {
    if (said.place <= newest_words_) continue;
    newest_words_ = said.place;
    const auto addressee = people_.find(said.to);
    const bool to_us = said.to && (said.to == self_ || (addressee != people_.end() && is_hand(addressee->second)));
    const std::string to = !said.to ? "" : " to " + (to_us ? std::string("you") : name_of(said.to));
    tell(name_of(said.from) + to + ": " + said.words, now);
  }
}

void PeopleView::tell(std::string text, Clock::time_point now) {
  if (notices_.size() == kMostNotices) notices_.pop_front();
  notices_.push_back({now + kShown, std::move(text)});
}

bool PeopleView::is_hand(const PersonSeen& person) const {
  if (hand_.empty()) return false;
  const Result<PersonSeen> ours = find(hand_, Fit::hand);
  return ours && ours->author == person.author;
}

// If the room does not say who decided, and there is only one instructor, it was that instructor.
std::string PeopleView::guard(const PersonSeen& person) const {
  if (person.decided_by) return name_of(person.decided_by);
  std::set<std::string> names;
  for (const auto& [author, one] : people_)
    if (one.role == Role::instructor) names.insert(name_of(author));
  return names.size() == 1 ? *names.begin() : "An instructor";
}

void PeopleView::notice_decision(const PersonSeen& person, const Restrictions& was, Clock::time_point now) {
  const Restrictions& is = person.supervision;
  if (is == was) return;
  const bool ours = is_hand(person);
  const std::string whom = ours ? "you" : name_of(person.author), whose = ours ? "your" : name_of(person.author) + "'s";
  const std::string hand = whose + " hand", tool = whose + " tool", by = guard(person);
  std::vector<std::string> said;
  if (is.stopped != was.stopped)
    said.push_back(by + (is.stopped ? " has stopped " + hand : " has set " + hand + " free"));
  if (is.taken_by != was.taken_by)
    said.push_back(is.taken_by ? name_of(is.taken_by) + " has taken over " + tool
                               : by + " has given " + tool + " back");
  if (is.guide != was.guide)
    said.push_back(by + " leads " + hand + (is.guide ? " along the tool of " + name_of(is.guide) : " no more"));
  if (is.force_limit != was.force_limit)
    said.push_back(by + " limits " + whose + " force " +
                   (is.force_limit != 0 ? "to " + printed("%.2f N", is.force_limit_n()) : "no more"));
  if (is.zone != was.zone)
    said.push_back(by + " lets " + whom + " cut " +
                   (is.zone ? "only within " + radius_text(*is.zone) + " of a point" : "everywhere"));
  if (is.tools != was.tools)
    said.push_back(by + " lets " + whom + " cut with " +
                   (is.tools.empty() ? "every tool" : tool_names(is.tools) + " only"));
  if (is.words != was.words && !is.words.empty()) {
    if (said.empty()) said.push_back(by + " about " + hand);
    said.back() += ": " + is.words;
  }
  for (std::string& text : said) tell(std::move(text), now);
}

Result<PersonSeen> PeopleView::find(std::string_view who, Fit fit) const {
  const PersonSeen* found = nullptr;
  if (who.starts_with('#')) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(who.data() + 1, who.data() + who.size(), number);
    const auto person = people_.find(AuthorId{number});
    if (error == std::errc{} && end == who.data() + who.size() && person != people_.end()) found = &person->second;
  }
  const auto rank = [fit](const PersonSeen& person) {
    const bool fits = fit == Fit::looking ? person.look.has_value() : fit == Fit::hand && person.hand;
    return std::pair(fits, person.here);
  };
  std::string known;
  for (const auto& [author, person] : people_) {
    if (!person.name.empty() && person.name == who && (found == nullptr || rank(person) >= rank(*found)))
      found = &person;
    if (person.here) known += (known.empty() ? "" : ", ") + name_of(author);
  }
  if (found != nullptr) return *found;
  if (known.empty()) known = "none yet";
  return failure(ErrorCode::not_found, "nobody is called " + std::string(who) + "; there are " + known);
}

std::string PeopleView::name_of(AuthorId author) const {
  const auto person = people_.find(author);
  return person != people_.end() && !person->second.name.empty() ? person->second.name
                                                                 : "#" + std::to_string(author.value);
}

std::map<AuthorId, std::string> PeopleView::names() const {
  std::map<AuthorId, std::string> names;
  for (const auto& [author, person] : people_) names.emplace(author, name_of(author));
  return names;
}

std::vector<std::string> PeopleView::notices(Clock::time_point now) const {
  std::vector<std::string> shown;
  for (const Notice& notice : notices_)
    if (now < notice.until) shown.push_back(notice.text);
  return shown;
}

std::string PeopleView::holding() const {
  if (hand_.empty()) return {};
  const Result<PersonSeen> ours = find(hand_, Fit::hand);
  if (!ours) return {};
  const Restrictions& holds = ours->supervision;
  std::string text;
  const auto line = [&](const std::string& one) { text += (text.empty() ? "" : "\n") + one; };
  if (holds.stopped) line("Your hand is stopped");
  if (holds.taken_by) line(name_of(holds.taken_by) + " holds your tool");
  if (holds.guide) line("Your hand is led along the tool of " + name_of(holds.guide));
  if (holds.force_limit != 0) line("Force: " + printed("%.2f N", holds.force_limit_n()) + " at most");
  if (holds.zone) {
    const auto& at = holds.zone->centre;
    line("Cut only within " + radius_text(*holds.zone) +
         printed(" of %.1f %.1f %.1f", kQuantum_mm * at[0], kQuantum_mm * at[1], kQuantum_mm * at[2]));
  }
  if (!holds.tools.empty()) line("Cut only with " + tool_names(holds.tools));
  if (!holds.words.empty()) line(holds.words);
  if (!text.empty() && ours->decided_by) line("Decided by " + name_of(ours->decided_by));
  return text;
}

}  // namespace osteon
