#include "viewer_client/app/console.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/core/read_number.hpp"
#include "common/tools/cut_body.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kUntilSaid{5000};  // until the people's state shows the decision
constexpr double kAcknowledgePatience_s = 30.0;

std::string at(RoomSeq seq) { return "at " + std::to_string(seq.value); }

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", value);
  return text;
}

std::string text_of(const Vec3& v) { return text_of(v.x()) + " " + text_of(v.y()) + " " + text_of(v.z()); }

// Quotes names, labels and words, so that the answer stays on its line.
std::string quoted(std::string_view words) {
  std::string out = "\"";
  for (const char c : words) out += c == '"' ? '\'' : static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  return out + '"';
}

// In steps of 2^-10 mm. Error invalid_input: more than about a kilometre away.
Result<std::int32_t> steps(double mm) {
  const double steps = std::round(mm / kQuantum_mm);
  if (std::abs(steps) > 1 << 30) return bad_input(text_of(mm) + " mm is too far away");
  return static_cast<std::int32_t>(steps);
}

Result<std::array<std::int32_t, 3>> point_at(const std::vector<std::string>& words, std::size_t first) {
  std::array<std::int32_t, 3> point{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto mm = first + i < words.size() ? read_number<double>(words[first + i]) : std::nullopt;
    if (!mm) return bad_input("a point is three numbers in millimetres, X Y Z");
    const Result<std::int32_t> in_steps = steps(*mm);
    if (!in_steps) return tl::unexpected(in_steps.error());
    point[i] = *in_steps;
  }
  return point;
}

std::string joined(const std::vector<std::string>& words, std::size_t first) {
  std::string out;
  for (std::size_t i = first; i < words.size(); ++i) out += (i > first ? " " : "") + words[i];
  return out;
}

// Removes `key` and the word behind it, and returns that word.
std::optional<std::string> take_pair(std::vector<std::string>& words, std::string_view key) {
  const auto found = std::ranges::find(words, key);
  if (found == words.end() || found + 1 == words.end()) return std::nullopt;
  std::string value = *(found + 1);
  words.erase(found, found + 2);
  return value;
}

const char* kind_of(AnnotationKind kind) {
  switch (kind) {
    case AnnotationKind::pointer:
      return "pointer";
    case AnnotationKind::line:
      return "line";
    case AnnotationKind::label:
      return "label";
    case AnnotationKind::axis:
      return "axis";
    case AnnotationKind::plane:
      break;
  }
  return "plane";
}

}  // namespace

Result<std::vector<std::string>> words_of_line(std::string_view line) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] == ' ' || line[i] == '\t' || line[i] == '\r') {
      ++i;
      continue;
    }
    std::string word;
    for (; i < line.size() && line[i] != ' ' && line[i] != '\t' && line[i] != '\r'; ++i) {
      if (line[i] != '"') {
        word += line[i];
        continue;
      }
      const std::size_t end = line.find('"', i + 1);
      if (end == std::string_view::npos) return bad_input("a quote has no end");
      word += line.substr(i + 1, end - i - 1);
      i = end;
    }
    words.push_back(std::move(word));
  }
  return words;
}

struct Console::Command {
  const char* name;
  Answer (Console::*obey)(const Words&);
  const char* form;
  const char* what;
};

const std::vector<Console::Command>& Console::commands() {
  static const std::vector<Command> kCommands{
      {"people", &Console::people, "people", "who is here, what restricts whom, and who has not acknowledged it yet"},
      {"freeze", &Console::freeze, "freeze NAME|all [WORDS]",
       "stops the person's hand: it cannot cut; they see the words"},
      {"free", &Console::free, "free NAME|all", "ends the stop: the hand may cut again"},
      {"take", &Console::take, "take NAME [WORDS]", "takes over the person's tool"},
      {"give-back", &Console::give_back, "give-back NAME", "gives the tool back to the person"},
      {"guide", &Console::guide, "guide NAME along NAME [share 0..1]",
       "pulls the hand along another person's tool; share: how firmly"},
      {"unguide", &Console::unguide, "unguide NAME", "ends the guidance"},
      {"limit", &Console::limit, "limit force NAME N|none | zone NAME X Y Z R|none | tools NAME TOOL,TOOL|none",
       "largest force in newtons; the ball in which the hand may cut; the tools that may cut"},
      {"undo", &Console::undo, "undo N s | undo to MARK | undo all | undo N [of NAME]",
       "the last N seconds; all after a mark (its number or label); everything; the newest N events"},
      {"redo", &Console::redo, "redo [N]", "repeats what the newest N undos took back"},
      {"mark", &Console::mark, "mark LABEL", "gives this moment a name"},
      {"point", &Console::point, "point X Y Z [WORDS]",
       "an arrow to this point, mm in the bone's frame; replaces your last arrow"},
      {"draw", &Console::line, "draw X Y Z X Y Z ...", "a line through these points"},
      {"label", &Console::label, "label X Y Z WORDS", "words at a point"},
      {"wipe", &Console::wipe, "wipe ID|all", "removes one annotation, or all of yours"},
      {"drawn", &Console::drawn, "drawn", "lists the annotations and their numbers"},
      {"say", &Console::say, "say [NAME|all] WORDS", "sends words to one person, or to all"},
      {"said", &Console::said, "said", "lists the newest words"},
      {"view", &Console::view, "view NAME", "the eye and the target of the person's view, mm in the bone's frame"},
      {"demonstrate", &Console::demonstrate, "demonstrate [ROOM] [of NAME] [from A] [to B] [speed S]",
       "repeats the cuts of a room here, from event A to event B"},
      {"end-demonstration", &Console::end_demonstration, "end-demonstration ID",
       "by the number that `demonstrate` printed"},
      {"wait", &Console::wait, "wait acknowledged NAME [SECONDS]",
       "until they have acknowledged the newest decision about them"},
      {"status", &Console::status, "status", "the room's newest event, the hash of its bone, its marks"},
      {"quit", &Console::quit, "quit", "ends the console; so does the end of the input"},
  };
  return kCommands;
}

const char* Console::help() {
  static const std::string kHelp = [] {
    std::string out =
        "Commands of --console, one per line, each answered by `ok ...` or `error ...` on standard output.\n"
        "NAME: a name, in quotes where it has spaces, or #3 for author 3.\n";
    for (const Command& command : commands())
      out += "  " + std::string(command.form) + "\n      " + command.what + "\n";
    return out;
  }();
  return kHelp.c_str();
}

std::optional<std::string> Console::answer(std::string_view line) {
  const Result<Words> words = words_of_line(line);
  if (!words) return "error " + words.error().message;
  if (words->empty() || words->front().starts_with('#')) return std::nullopt;
  const auto command =
      std::ranges::find(commands(), words->front(), [](const Command& one) { return std::string_view(one.name); });
  if (command == commands().end()) {
    std::string known;
    for (const Command& one : commands()) known += (known.empty() ? "" : ", ") + std::string(one.name);
    return "error there is no command " + quoted(words->front()) + "; known are " + known;
  }
  const Answer answer = (this->*command->obey)(*words);
  if (answer) return answer->empty() ? "ok" : "ok " + *answer;
  const bool misread = answer.error().code == ErrorCode::invalid_input && answer.error().message.empty();
  return "error " + (misread ? "the form is: " + std::string(command->form) : answer.error().message);
}

Result<PersonSeen> Console::find(const std::string& name) const {
  std::vector<PersonSeen> all = room_.people();
  if (name.starts_with('#')) {
    const auto author = read_number<std::uint64_t>(std::string_view(name).substr(1));
    const auto found =
        std::ranges::find_if(all, [&](const PersonSeen& one) { return author && one.author.value == *author; });
    if (found == all.end()) return failure(ErrorCode::not_found, "there is no author " + name);
    return *found;
  }
  std::erase_if(all, [&](const PersonSeen& one) { return one.name != name; });
  if (all.empty())
    return failure(ErrorCode::not_found, "there is nobody called " + quoted(name) + "; `people` says who there is");
  // Prefer somebody's hand to their viewer, and those who are here to those who left.
  for (const auto& better : {&PersonSeen::hand, &PersonSeen::here})
    if (std::ranges::any_of(all, better)) std::erase_if(all, [&](const PersonSeen& one) { return !(one.*better); });
  if (all.size() > 1) {
    std::string which;
    for (const PersonSeen& one : all) which += (which.empty() ? "#" : ", #") + std::to_string(one.author.value);
    return bad_input("several are called " + quoted(name) + "; say which: " + which);
  }
  return all.front();
}

std::string Console::name_of(AuthorId author) const {
  for (const PersonSeen& one : room_.people())
    if (one.author == author && !one.name.empty()) return "#" + std::to_string(author.value) + " " + quoted(one.name);
  return "#" + std::to_string(author.value);
}

std::string Console::tool_name(const Digest& tool) const {
  const auto found = std::ranges::find(tools_, tool, &std::pair<std::string, Digest>::second);
  return found == tools_.end() ? to_hex(tool).substr(0, 8) : found->first;
}

std::string Console::text_of(const PersonSeen& person) const {
  std::string out = "#" + std::to_string(person.author.value) + " " + quoted(person.name);
  if (person.role != Role::none) out += " " + std::string(to_string(person.role));
  out += person.here ? " here" : " away";
  if (person.author == room_.self()) out += " you";
  if (person.hand) out += " haptic";
  const Restrictions& word = person.supervision;
  if (word.stopped) out += " frozen";
  if (word.taken_by) out += " taken by #" + std::to_string(word.taken_by.value);
  if (word.guide)
    out += " guided along #" + std::to_string(word.guide.value) + " share " + osteon::text_of(1e-3 * word.guide_share);
  if (word.force_limit > 0) out += " force " + osteon::text_of(word.force_limit_n());
  if (word.zone) {
    out += " zone";
    for (const std::int32_t steps : word.zone->centre) out += " " + osteon::text_of(steps * kQuantum_mm);
    out += " " + osteon::text_of(word.zone->radius * kQuantum_mm);
  }
  for (std::size_t i = 0; i < word.tools.size(); ++i) out += (i == 0 ? " tools " : ",") + tool_name(word.tools[i]);
  if (!word.words.empty()) out += " words " + quoted(word.words);
  if (person.decided) out += person.pending() ? " pending" : " acknowledged";
  if (person.decided && person.decided_by) out += " decided by #" + std::to_string(person.decided_by.value);
  if (person.hand) out += " cuts " + std::to_string(person.cuts);
  return out;
}

Console::Answer Console::people(const Words& words) {
  if (words.size() != 1) return bad_input("");
  if (auto tools = room_.tools()) tools_ = std::move(*tools);
  const std::vector<PersonSeen> all = room_.people();
  std::string out = std::to_string(all.size()) + " people";
  for (const PersonSeen& person : all) out += (&person == &all.front() ? ": " : "; ") + text_of(person);
  return out;
}

Console::Answer Console::supervise(const std::string& name, const std::function<void(Restrictions&)>& change) {
  // Wait until the change is published, so that later commands start from it.
  const auto said = [&](RoomSeq seq) {
    const auto seen = [&] {
      return std::ranges::any_of(room_.people(), [&](const PersonSeen& one) { return one.decided >= seq; });
    };
    (void)room_.wait(seen, kUntilSaid);
    return at(seq);
  };
  if (name != "all") {
    const Result<PersonSeen> person = find(name);
    if (!person) return tl::unexpected(person.error());
    Restrictions word = person->supervision;
    change(word);
    const Result<RoomSeq> seq = room_.supervise(person->author, word);
    if (!seq) return tl::unexpected(seq.error());
    return said(*seq);
  }
  // One request if the same restrictions result for all. Else one request each, so that everyone keeps their other
  // restrictions.
  std::vector<PersonSeen> hands = room_.people();
  std::erase_if(hands, [&](const PersonSeen& one) {
    return !one.hand || one.role == Role::instructor || one.author == room_.self();
  });
  const auto changed = [&](const PersonSeen& one) {
    Restrictions word = one.supervision;
    change(word);
    return word;
  };
  const bool same =
      std::ranges::all_of(hands, [&](const PersonSeen& one) { return changed(one) == changed(hands.front()); });
  if (hands.empty() || same) {
    const Result<RoomSeq> seq = room_.supervise({}, hands.empty() ? Restrictions{} : changed(hands.front()));
    if (!seq) return tl::unexpected(seq.error());
    return said(*seq);
  }
  RoomSeq last;
  for (const PersonSeen& one : hands) {
    const Result<RoomSeq> seq = room_.supervise(one.author, changed(one));
    if (!seq) return tl::unexpected(seq.error());
    last = *seq;
  }
  return said(last);
}

Console::Answer Console::freeze(const Words& words) {
  if (words.size() < 2) return bad_input("");
  return supervise(words[1], [&](Restrictions& word) {
    word.stopped = true;
    word.words = joined(words, 2);
  });
}

Console::Answer Console::free(const Words& words) {
  if (words.size() != 2) return bad_input("");
  return supervise(words[1], [](Restrictions& word) {
    word.stopped = false;
    word.words.clear();
  });
}

Console::Answer Console::take(const Words& words) {
  if (words.size() < 2 || words[1] == "all") return bad_input("");
  // A person who has a hand in this room takes the tool into that hand.
  const std::vector<PersonSeen> all = room_.people();
  const auto self = std::ranges::find(all, room_.self(), &PersonSeen::author);
  const Result<PersonSeen> subject = find(words[1]);
  AuthorId holder = room_.self();
  for (const PersonSeen& one : all)
    if (self != all.end() && !one.name.empty() && one.name == self->name && one.role == self->role && one.hand &&
        one.here && (!subject || one.author != subject->author))
      holder = one.author;
  return supervise(words[1], [&](Restrictions& word) {
    word.taken_by = holder;
    word.words = joined(words, 2);
  });
}

Console::Answer Console::give_back(const Words& words) {
  if (words.size() != 2) return bad_input("");
  return supervise(words[1], [](Restrictions& word) {
    word.taken_by = {};
    word.words.clear();
  });
}

Console::Answer Console::guide(const Words& words) {
  const bool with_share = words.size() == 6 && words[4] == "share";
  if ((words.size() != 4 && !with_share) || words[2] != "along") return bad_input("");
  const auto share = with_share ? read_number<double>(words[5]) : std::optional(1.0);
  if (!share || *share < 0 || *share > 1) return bad_input("the share is a number from 0 to 1");
  const Result<PersonSeen> leader = find(words[3]);
  if (!leader) return tl::unexpected(leader.error());
  return supervise(words[1], [&](Restrictions& word) {
    word.guide = leader->author;
    word.guide_share = static_cast<int>(std::lround(*share * kWholeShare));
  });
}

Console::Answer Console::unguide(const Words& words) {
  if (words.size() != 2) return bad_input("");
  return supervise(words[1], [](Restrictions& word) {
    word.guide = {};
    word.guide_share = 0;
  });
}

Console::Answer Console::limit(const Words& words) {
  if (words.size() < 4) return bad_input("");
  const std::string &what = words[1], &name = words[2];
  const bool none = words.size() == 4 && words[3] == "none";
  if (what == "force") {
    const auto newtons = none ? std::optional(0.0) : read_number<double>(words[3]);
    if (words.size() != 4 || !newtons || *newtons < 0) return bad_input("");
    if (*newtons > 0.01 * kMostForceLimit)
      return bad_input("the most that can be said is " + osteon::text_of(0.01 * kMostForceLimit) + " N");
    // A limit of 0 N must not become "no limit".
    const int hundredths = none ? 0 : std::max(1, static_cast<int>(std::lround(100 * *newtons)));
    return supervise(name, [&](Restrictions& word) { word.force_limit = hundredths; });
  }
  if (what == "zone") {
    if (none) return supervise(name, [](Restrictions& word) { word.zone.reset(); });
    const auto radius_mm = words.size() == 7 ? read_number<double>(words[6]) : std::nullopt;
    if (!radius_mm) return bad_input("");
    const auto centre = point_at(words, 3);
    if (!centre) return tl::unexpected(centre.error());
    const Result<std::int32_t> radius = steps(*radius_mm);
    if (!radius) return tl::unexpected(radius.error());
    return supervise(name, [&](Restrictions& word) { word.zone = ZoneLimit{*centre, *radius}; });
  }
  if (what != "tools" || words.size() != 4) return bad_input("");
  std::vector<Digest> allowed;
  if (!none) {
    auto known = room_.tools();
    if (!known) return tl::unexpected(known.error());
    tools_ = std::move(*known);
    std::string_view rest = words[3];
    while (!rest.empty()) {
      const std::string_view one = rest.substr(0, rest.find(','));
      rest.remove_prefix(std::min(rest.size(), one.size() + 1));
      const auto tool = std::ranges::find(tools_, one, &std::pair<std::string, Digest>::first);
      if (tool == tools_.end()) return failure(ErrorCode::not_found, "the room knows no tool " + quoted(one));
      allowed.push_back(tool->second);
    }
    std::ranges::sort(allowed);
    allowed.erase(std::unique(allowed.begin(), allowed.end()), allowed.end());
  }
  return supervise(name, [&](Restrictions& word) { word.tools = allowed; });
}

Console::Answer Console::undo(const Words& words) {
  UndoSelection what;
  if (words.size() == 2 && words[1] == "all") {
    what.all = true;
  } else if (words.size() >= 3 && words[1] == "to") {
    const Result<RoomSeen> seen = room_.status();
    if (!seen) return tl::unexpected(seen.error());
    const std::string label = joined(words, 2);
    // If several marks have this label, the newest counts.
    for (const auto& [seq, known] : seen->marks)
      if (known == label || std::to_string(seq.value) == label) what.to = seq;
    if (!what.to) return failure(ErrorCode::not_found, "the room has no mark " + quoted(label));
  } else {
    const bool seconds = words.size() == 3 && words[2] == "s";
    const bool of_one = words.size() == 4 && words[2] == "of";
    if (!(words.size() == 2 || seconds || of_one)) return bad_input("");
    if (seconds) {
      const auto asked = read_number<double>(words[1]);
      if (!asked || *asked <= 0 || *asked > 1e9) return bad_input("");
      what.newest = std::max(1ms, std::chrono::milliseconds(std::llround(1000 * *asked)));
    } else {
      const auto count = read_number<std::uint32_t>(words[1]);
      if (!count || *count == 0) return bad_input("");
      what.count = *count;
    }
    if (of_one) {
      const Result<PersonSeen> person = find(words[3]);
      if (!person) return tl::unexpected(person.error());
      what.of = person->author;
    }
  }
  const auto undone = room_.undo(what);
  if (!undone) return tl::unexpected(undone.error());
  return at(undone->first) + " events " + std::to_string(undone->second);
}

Console::Answer Console::redo(const Words& words) {
  const auto count = words.size() == 1   ? std::optional(1u)
                     : words.size() == 2 ? read_number<std::uint32_t>(words[1])
                                         : std::nullopt;
  if (!count || *count == 0) return bad_input("");
  const auto redone = room_.redo(*count);
  if (!redone) return tl::unexpected(redone.error());
  return at(redone->first) + " events " + std::to_string(redone->second);
}

Console::Answer Console::mark(const Words& words) {
  if (words.size() < 2) return bad_input("");
  const Result<RoomSeq> seq = room_.mark(joined(words, 1));
  if (!seq) return tl::unexpected(seq.error());
  return at(*seq);
}

Console::Answer Console::draw(AnnotationKind kind, const Words& words, std::size_t points) {
  Annotation drawn{.kind = kind};
  for (std::size_t i = 0; i < points; ++i) {
    const auto point = point_at(words, 1 + 3 * i);
    if (!point) return tl::unexpected(point.error());
    drawn.points.push_back(*point);
  }
  drawn.words = joined(words, 1 + 3 * points);
  const Result<std::uint32_t> which = room_.draw(drawn);
  if (!which) return tl::unexpected(which.error());
  const auto seen = [&] {
    return std::ranges::any_of(room_.annotations(),
                               [&](const Annotation& one) { return one.id == *which && one.points == drawn.points; });
  };
  (void)room_.wait(seen, kUntilSaid);
  return "drawing " + std::to_string(*which);
}

Console::Answer Console::point(const Words& words) { return draw(AnnotationKind::pointer, words, 1); }

Console::Answer Console::line(const Words& words) {
  if (words.size() < 7 || words.size() % 3 != 1) return bad_input("");
  return draw(AnnotationKind::line, words, words.size() / 3);
}

Console::Answer Console::label(const Words& words) {
  if (words.size() < 5) return bad_input("");
  return draw(AnnotationKind::label, words, 1);
}

Console::Answer Console::wipe(const Words& words) {
  const auto which = words.size() != 2   ? std::nullopt
                     : words[1] == "all" ? std::optional(0u)
                                         : read_number<std::uint32_t>(words[1]);
  if (!which || (*which == 0 && words[1] != "all")) return bad_input("");
  if (const Result<void> gone = room_.wipe_off(*which); !gone) return tl::unexpected(gone.error());
  const auto seen = [&] {
    return std::ranges::none_of(room_.annotations(), [&](const Annotation& one) {
      return one.id == *which || (*which == 0 && one.author == room_.self());
    });
  };
  (void)room_.wait(seen, kUntilSaid);
  return std::string();
}

Console::Answer Console::drawn(const Words& words) {
  if (words.size() != 1) return bad_input("");
  const std::vector<Annotation> all = room_.annotations();
  std::string out = std::to_string(all.size()) + " drawings";
  for (const Annotation& one : all) {
    out += (&one == &all.front() ? ": " : "; ") + std::to_string(one.id) + " " + kind_of(one.kind) + " of " +
           name_of(one.author) + " from";
    for (const std::int32_t steps : one.points.front()) out += " " + osteon::text_of(steps * kQuantum_mm);
    if (!one.words.empty()) out += " " + quoted(one.words);
  }
  return out;
}

Console::Answer Console::say(const Words& words) {
  if (words.size() < 2) return bad_input("");
  AuthorId to;
  std::size_t first = 1;
  if (words.size() > 2 && words[1] == "all") {
    first = 2;
  } else if (words.size() > 2) {
    const Result<PersonSeen> person = find(words[1]);
    // Words to all may begin with any word. A number, or a name that several people have, always means a person.
    if (!person && (person.error().code != ErrorCode::not_found || words[1].starts_with('#')))
      return tl::unexpected(person.error());
    if (person) {
      to = person->author;
      first = 2;
    }
  }
  const Result<RoomSeq> seq = room_.say(to, joined(words, first));
  if (!seq) return tl::unexpected(seq.error());
  (void)room_.wait(
      [&] { return std::ranges::any_of(room_.words(), [&](const WordsSeen& one) { return one.place >= *seq; }); },
      kUntilSaid);
  return at(*seq) + " to " + (to ? name_of(to) : "all");
}

Console::Answer Console::said(const Words& words) {
  if (words.size() != 1) return bad_input("");
  std::string out;
  for (const WordsSeen& one : room_.words())
    out += (out.empty() ? "" : "; ") + at(one.place) + " " + name_of(one.from) + " to " +
           (one.to ? name_of(one.to) : "all") + " " + quoted(one.words);
  return out;
}

Console::Answer Console::view(const Words& words) {
  if (words.size() != 2) return bad_input("");
  // The view belongs to the person's viewer, which has no hand.
  std::optional<ViewFrustum> look;
  const Result<PersonSeen> person = find(words[1]);
  if (!person) return tl::unexpected(person.error());
  look = person->look;
  for (const PersonSeen& one : room_.people())
    if (!look && !words[1].starts_with('#') && one.name == words[1] && one.look) look = one.look;
  if (!look) return failure(ErrorCode::not_found, "nobody knows where " + words[1] + " looks");
  const std::string up = look->up ? " up " + osteon::text_of(*look->up) : "";
  return "eye " + osteon::text_of(look->eye_mm) + " target " + osteon::text_of(look->target_mm) + up;
}

Console::Answer Console::demonstrate(const Words& words) {
  Words rest(words.begin() + 1, words.end());
  DemonstrationSource what;
  if (const auto name = take_pair(rest, "of")) {
    const Result<PersonSeen> person = find(*name);
    const auto author =
        name->starts_with('#') ? read_number<std::uint64_t>(std::string_view(*name).substr(1)) : std::nullopt;
    // In another room the number may belong to somebody else.
    if (!person && !author) return tl::unexpected(person.error());
    what.of = author ? AuthorId{*author} : person->author;
  }
  for (const auto& [key, seq] : {std::pair("from", &what.from), std::pair("to", &what.to)})
    if (const auto said = take_pair(rest, key)) {
      const auto value = read_number<std::uint64_t>(*said);
      if (!value) return bad_input("");
      *seq = RoomSeq{*value};
    }
  if (const auto said = take_pair(rest, "speed")) {
    const auto speed = read_number<double>(*said);
    if (!speed || *speed <= 0) return bad_input("the speed is a number above 0");
    what.speed = *speed;
  }
  if (rest.size() > 1) return bad_input("");
  if (!rest.empty()) what.room = rest.front();
  const auto shown = room_.demonstrate(what);
  if (!shown) return tl::unexpected(shown.error());
  // A later command guides hands by this number. The list of people may contain it later than this answer.
  const auto seen = [&] {
    return std::ranges::any_of(room_.people(), [&](const PersonSeen& one) { return one.author == shown->first; });
  };
  (void)room_.wait(seen, kUntilSaid);
  return "demonstrator #" + std::to_string(shown->first.value) + " cuts " + std::to_string(shown->second);
}

Console::Answer Console::end_demonstration(const Words& words) {
  if (words.size() != 2) return bad_input("");
  const std::string_view word = words[1];
  const auto which = read_number<std::uint64_t>(word.starts_with('#') ? word.substr(1) : word);
  if (!which) return bad_input("");
  if (const Result<void> ended = room_.end_demonstration(AuthorId{*which}); !ended)
    return tl::unexpected(ended.error());
  return std::string();
}

Console::Answer Console::wait(const Words& words) {
  const auto patience_s = words.size() == 4 ? read_number<double>(words[3]) : std::optional(kAcknowledgePatience_s);
  if (words.size() < 3 || words.size() > 4 || words[1] != "acknowledged" || !patience_s || *patience_s < 0 ||
      *patience_s > 1e6)
    return bad_input("");
  const auto acknowledged = [&] {
    const Result<PersonSeen> person = find(words[2]);
    return !person || !person->pending();
  };
  const bool in_time = room_.wait(acknowledged, std::chrono::milliseconds(std::llround(1000 * *patience_s)));
  const Result<PersonSeen> person = find(words[2]);
  if (!person) return tl::unexpected(person.error());
  if (!in_time)
    return failure(ErrorCode::unavailable, name_of(person->author) + " has not acknowledged event " +
                                               std::to_string(person->decided.value) + " yet");
  return at(person->acknowledged);
}

Console::Answer Console::status(const Words& words) {
  if (words.size() != 1) return bad_input("");
  const Result<RoomSeen> seen = room_.status();
  if (!seen) return tl::unexpected(seen.error());
  std::string out = "room " + quoted(seen->name) + " " + at(seen->room_seq) + " hash " + to_hex(seen->field_hash) +
                    " removed " + osteon::text_of(seen->removed_mm3) + " mm3 rejected " +
                    std::to_string(seen->rejected) + " bodies " + std::to_string(seen->bodies.size());
  for (const auto& [seq, label] : seen->marks) out += " mark " + std::to_string(seq.value) + " " + quoted(label);
  return out;
}

Console::Answer Console::quit(const Words& words) {
  if (words.size() != 1) return bad_input("");
  over_ = true;
  return std::string();
}

}  // namespace osteon
