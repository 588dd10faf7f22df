#include "viewer_client/app/script.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "common/core/read_number.hpp"

namespace osteon {

namespace {

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  constexpr std::string_view kBlank = " \t\r";
  for (std::size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
  return words;
}

// The rest of the line after its first word: file names may contain spaces.
std::string rest_of(std::string_view line, std::string_view first_word) {
  constexpr std::string_view kBlank = " \t\r";
  line.remove_prefix(static_cast<std::size_t>(first_word.data() + first_word.size() - line.data()));
  const std::size_t from = line.find_first_not_of(kBlank);
  if (from == std::string_view::npos) return {};
  return std::string(line.substr(from, line.find_last_not_of(kBlank) - from + 1));
}

std::optional<Vec3> vector_at(const std::vector<std::string_view>& words, std::size_t first) {
  Vec3 v;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto component = read_number<double>(words[first + i]);
    if (!component) return std::nullopt;
    v[static_cast<Eigen::Index>(i)] = *component;
  }
  return v;
}

using Parsed = Result<std::optional<Command>>;

Parsed expected(std::string_view form) {
  return failure(ErrorCode::invalid_input, "expected `" + std::string(form) + "`");
}

Parsed parse_wait(const std::vector<std::string_view>& words) {
  if (words.size() == 2 && words[1] == "surface") return Command(WaitForSurface{});
  if (words.size() == 3 && words[1] == "seq") {
    if (const auto seq = read_number<std::uint64_t>(words[2])) return Command(WaitForSeq{RoomSeq{*seq}});
  }
  if (words.size() == 3 && (words[1] == "bodies" || words[1] == "items" || words[1] == "drawn")) {
    if (const auto count = read_number<std::size_t>(words[2])) {
      if (words[1] == "drawn") return Command(WaitForDrawn{*count});
      if (words[1] == "bodies") return Command(WaitForBodies{*count});
      return Command(WaitForItems{*count});
    }
  }
  return expected("wait surface`, `wait seq NUMBER`, `wait bodies NUMBER`, `wait items NUMBER` or `wait drawn NUMBER");
}

// undo N, redo N, take-away BODY: one number.
template <class Make>
Parsed parse_number(const std::vector<std::string_view>& words, std::string_view form, std::uint32_t least, Make make) {
  const auto value = words.size() == 2 ? read_number<std::uint32_t>(words[1]) : std::nullopt;
  if (!value || *value < least) return expected(form);
  return Command(RoomRequest(make(*value)));
}

// at X Y Z along X Y Z [across X Y Z], or near X Y Z [along X Y Z] [across X Y Z]; `next` goes on to what follows.
std::optional<ItemPlace> parse_where(const std::vector<std::string_view>& words, std::size_t& next) {
  const auto vector_after = [&](std::string_view word) -> std::optional<Vec3> {
    if (next + 4 > words.size() || words[next] != word) return std::nullopt;
    auto v = vector_at(words, next + 1);
    if (v) next += 4;
    return v;
  };
  const auto has_length = [](const std::optional<Vec3>& v) { return !v || v->norm() > 1e-9; };
  ItemPlace place;
  auto point = vector_after("at");
  if (!point) {
    point = vector_after("near");
    place.on_bone = true;
  }
  if (!point) return std::nullopt;
  place.point_mm = *point;
  place.along = vector_after("along");
  place.across = vector_after("across");
  if ((!place.along && !place.on_bone) || !has_length(place.along) || !has_length(place.across)) return std::nullopt;
  if (place.along && place.across &&
      place.across->cross(*place.along).norm() <= 1e-6 * place.across->norm() * place.along->norm())
    return std::nullopt;
  return place;
}

Parsed parse_place(const std::vector<std::string_view>& words) {
  constexpr std::string_view kForm =
      "place TOOL at X Y Z along X Y Z` or `place TOOL near X Y Z`, then `along X Y Z`, `across X Y Z`, `on BODY";
  std::size_t next = 2;
  const auto where = words.size() > 2 ? parse_where(words, next) : std::nullopt;
  auto body = std::optional<std::uint32_t>(0);
  if (next + 2 == words.size() && words[next] == "on") {
    body = read_number<std::uint32_t>(words[next + 1]);
    next += 2;
  }
  if (!where || !body || next != words.size()) return expected(kForm);
  return Command(RoomRequest(PlaceTool{std::string(words[1]), *where, BodyId{*body}}));
}

// move, turn, seat, remove: an item by its number.
Parsed parse_item_command(const std::vector<std::string_view>& words) {
  const std::string_view verb = words[0];
  const auto item = words.size() > 1 ? read_number<std::uint32_t>(words[1]) : std::nullopt;
  const bool known = item && *item > 0;
  if (verb == "move") {
    std::size_t next = 2;
    const auto where = known ? parse_where(words, next) : std::nullopt;
    if (!where || next != words.size())
      return expected("move ITEM at X Y Z along X Y Z` or `move ITEM near X Y Z`, then `along X Y Z`, `across X Y Z");
    return Command(RoomRequest(MoveItem{*item, *where}));
  }
  if (verb == "remove") {
    if (!known || words.size() != 2) return expected("remove ITEM");
    return Command(RoomRequest(RemoveItem{*item}));
  }
  const auto amount = words.size() == 3 ? read_number<double>(words[2]) : std::nullopt;
  if (verb == "turn") {
    if (!known || !amount) return expected("turn ITEM TURNS");
    return Command(RoomRequest(TurnItem{*item, *amount}));
  }
  SeatItem seat{known ? *item : 0};
  if (amount) seat.most_mm = *amount;
  if (!known || words.size() > 3 || (words.size() == 3 && !amount) || !(seat.most_mm > 0.0))
    return expected("seat ITEM` or `seat ITEM MOST_MM");
  return Command(RoomRequest(seat));
}

// A name, which may stand in quotes.
std::string unquoted(std::string name) {
  if (name.size() > 1 && name.front() == '"' && name.back() == '"') return name.substr(1, name.size() - 2);
  return name;
}

// look as WHO, follow WHO.
Parsed parse_who(std::string_view line, const std::vector<std::string_view>& words) {
  const bool look = words[0] == "look";
  const std::string who = unquoted(rest_of(line, look ? words[1] : words[0]));
  if (who.empty()) return expected(look ? "look as WHO" : "follow WHO` or `follow off");
  if (look) return Command(LookAs{who});
  return Command(Follow{who == "off" ? "" : who});
}

// point X Y Z [WORDS], label X Y Z WORDS, draw X Y Z X Y Z ...
Parsed parse_draw(std::string_view line, const std::vector<std::string_view>& words) {
  const std::string_view verb = words[0];
  const std::string_view form = verb == "draw"    ? "draw X Y Z X Y Z`, with as many more points as you like, `X Y Z"
                                : verb == "point" ? "point X Y Z` or `point X Y Z WORDS"
                                                  : "label X Y Z WORDS";
  Draw draw;
  draw.kind = verb == "draw" ? AnnotationKind::line : verb == "point" ? AnnotationKind::pointer : AnnotationKind::label;
  const std::size_t end = verb == "draw" ? words.size() : 4;
  if (words.size() < 4 || (end - 1) % 3 != 0) return expected(form);
  for (std::size_t first = 1; first < end; first += 3) {
    const auto point = vector_at(words, first);
    if (!point) return expected(form);
    draw.points_mm.push_back(*point);
  }
  if (verb != "draw") draw.words = rest_of(line, words[3]);
  if ((verb == "draw" && draw.points_mm.size() < 2) || (verb == "label" && draw.words.empty())) return expected(form);
  return Command(draw);
}

Parsed parse_wipe(const std::vector<std::string_view>& words) {
  if (words.size() == 2 && words[1] == "all") return Command(WipeOff{});
  const auto id = words.size() == 2 ? read_number<std::uint32_t>(words[1]) : std::nullopt;
  if (!id || *id == 0) return expected("wipe NUMBER` or `wipe all");
  return Command(WipeOff{*id});
}

// Who is meant is found out when the command runs: only the room knows its people.
Parsed parse_say(std::string_view line, const std::vector<std::string_view>& words) {
  const std::string text = rest_of(line, words[0]);
  const bool quoted = text.starts_with('"');
  const std::size_t end = quoted ? text.find('"', 1) : std::min(text.find_first_of(" \t"), text.size());
  if (text.empty() || end == std::string::npos) return expected("say WORDS`, `say WHO WORDS` or `say \"A NAME\" WORDS");
  const std::size_t next = text.find_first_not_of(" \t", end + (quoted ? 1 : 0));
  return Command(
      Say{quoted ? text.substr(1, end - 1) : text.substr(0, end), next == std::string::npos ? "" : text.substr(next)});
}

Parsed parse_look(const std::vector<std::string_view>& words) {
  if (words.size() == 2 && words[1] == "overview") return Command(LookAtWhole{});
  if (words.size() == 3 && words[1] == "tool") {
    const auto distance = read_number<double>(words[2]);
    if (distance && *distance > 0.0) return Command(LookAtTool{*distance});
  }
  if (words.size() == 13 && words[1] == "at" && words[5] == "from" && words[9] == "up") {
    const auto target = vector_at(words, 2), eye = vector_at(words, 6), up = vector_at(words, 10);
    if (target && eye && up) {
      const Vec3 sight = *target - *eye;
      if (sight.norm() > 1e-6 && sight.cross(*up).norm() > 1e-6 * sight.norm() * up->norm() && up->norm() > 0.0) {
        CameraView view;
        view.target_mm = *target;
        view.eye_mm = *eye;
        view.up = up->normalized();
        return Command(LookFrom{view});
      }
      return failure(ErrorCode::invalid_input,
                     "`look` needs an eye away from its target and an `up` across the line "
                     "of sight");
    }
  }
  return expected("look overview`, `look tool DISTANCE_MM`, `look as WHO` or `look at X Y Z from X Y Z up X Y Z");
}

}  // namespace

Parsed parse_command(std::string_view line) {
  const auto words = words_of(line);
  if (words.empty() || words[0].starts_with('#')) return std::optional<Command>{};
  const std::string_view verb = words[0];
  if (verb == "wait") return parse_wait(words);
  if (verb == "follow" || (verb == "look" && words.size() > 1 && words[1] == "as")) return parse_who(line, words);
  if (verb == "look") return parse_look(words);
  if (verb == "point" || verb == "draw" || verb == "label") return parse_draw(line, words);
  if (verb == "wipe") return parse_wipe(words);
  if (verb == "say") return parse_say(line, words);
  if (verb == "tool") {
    if (words.size() == 2 && (words[1] == "on" || words[1] == "off")) return Command(ShowTool{words[1] == "on"});
    return expected("tool on` or `tool off");
  }
  if (verb == "screenshot" || verb == "status") {
    const std::string file = rest_of(line, verb);
    if (file.empty()) return expected(verb == "status" ? "status FILE.json" : "screenshot FILE.png");
    if (verb == "status") return Command(SaveStatus{file});
    return Command(SaveScreenshot{file});
  }
  if (verb == "mark") {
    const std::string label = rest_of(line, verb);
    if (label.empty()) return expected("mark LABEL");
    return Command(RoomRequest(MarkMoment{label}));
  }
  if (verb == "undo" && words.size() == 3 && words[1] == "to") {
    const auto mark = read_number<std::uint64_t>(words[2]);
    if (!mark || *mark == 0) return expected("undo to MARK");
    return Command(RoomRequest(UndoTo{RoomSeq{*mark}}));
  }
  if (verb == "undo") return parse_number(words, "undo NUMBER", 1, [](std::uint32_t n) { return UndoLast{n}; });
  if (verb == "redo") return parse_number(words, "redo NUMBER", 1, [](std::uint32_t n) { return RedoLast{n}; });
  if (verb == "take-away")
    return parse_number(words, "take-away BODY", 0, [](std::uint32_t n) { return TakeAway{BodyId{n}}; });
  if (verb == "place") return parse_place(words);
  if (verb == "move" || verb == "turn" || verb == "seat" || verb == "remove") return parse_item_command(words);
  if (verb == "save") return Command(RoomRequest(SaveBone{rest_of(line, verb)}));
  if (verb == "quit" && words.size() == 1) return Command(Quit{});
  return failure(ErrorCode::invalid_input,
                 "there is no command `" + std::string(verb) +
                     "`; the commands are wait, look, follow, tool, mark, undo, redo, take-away, place, move, "
                     "turn, seat, remove, point, draw, label, wipe, say, save, screenshot, status and quit");
}

Result<ScriptReader> ScriptReader::open(const std::string& file) {
  ScriptReader reader;
  if (file == "-") {
    reader.descriptor_ = ::dup(STDIN_FILENO);
  } else {
    reader.descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  }
  if (reader.descriptor_ < 0) {
    return failure(ErrorCode::not_found, "the script " + file + " cannot be read: " + std::strerror(errno));
  }
  return reader;
}

ScriptReader ScriptReader::of(std::string text) {
  ScriptReader reader;
  reader.text_ = std::move(text);
  return reader;
}

ScriptReader::ScriptReader(ScriptReader&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), text_(std::move(other.text_)) {}

ScriptReader::~ScriptReader() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::optional<std::string> ScriptReader::next() {
  // Reads what has arrived, up to a page at a time, until a line is whole.
  while (text_.find('\n') == std::string::npos && descriptor_ >= 0) {
    pollfd input{descriptor_, POLLIN, 0};
    if (::poll(&input, 1, 0) <= 0) return std::nullopt;
    std::array<char, 4096> page;
    const ssize_t got = ::read(descriptor_, page.data(), page.size());
    if (got < 0 && errno == EINTR) continue;
    if (got > 0) {
      text_.append(page.data(), static_cast<std::size_t>(got));
    } else {
      ::close(descriptor_);
      descriptor_ = -1;
    }
  }
  if (text_.empty()) return std::nullopt;
  const std::size_t end = std::min(text_.find('\n'), text_.size());
  std::string line = text_.substr(0, end);
  text_.erase(0, end + 1);
  return line;
}

bool ScriptReader::ended() const { return descriptor_ < 0 && text_.empty(); }

}  // namespace osteon
