// The instructor's console: a command a line, a line of answer each, so that a person or a script can supervise a room
// without a window.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "viewer_client/scene/supervision_client.hpp"

namespace osteon {

// The words of a line; what stands in double quotes is one word. Error invalid_input: a quote without its end.
[[nodiscard]] Result<std::vector<std::string>> words_of_line(std::string_view line);

// One thread.
class Console {
 public:
  // The room must outlive it.
  explicit Console(SupervisionClient& room) : room_(room) {}

  // What there is to say to a line, "ok ..." or "error ...", without its end; nothing for an empty line and for one
  // that begins with #. May wait for the room.
  [[nodiscard]] std::optional<std::string> answer(std::string_view line);
  // It was told to quit.
  [[nodiscard]] bool over() const { return over_; }
  [[nodiscard]] static const char* help();  // every command, a line each

 private:
  using Words = std::vector<std::string>;
  using Answer = Result<std::string>;
  struct Command;
  [[nodiscard]] static const std::vector<Command>& commands();

  [[nodiscard]] Result<PersonSeen> find(const std::string& name) const;
  [[nodiscard]] std::string name_of(AuthorId author) const;
  [[nodiscard]] std::string tool_name(const Digest& tool) const;
  [[nodiscard]] std::string text_of(const PersonSeen& person) const;
  // Changes what holds for one hand, or for all, and waits until the room has said so.
  [[nodiscard]] Answer supervise(const std::string& name, const std::function<void(Restrictions&)>& change);
  [[nodiscard]] Answer draw(AnnotationKind kind, const Words& words, std::size_t first);

  [[nodiscard]] Answer people(const Words& words);
  [[nodiscard]] Answer freeze(const Words& words);
  [[nodiscard]] Answer free(const Words& words);
  [[nodiscard]] Answer take(const Words& words);
  [[nodiscard]] Answer give_back(const Words& words);
  [[nodiscard]] Answer guide(const Words& words);
  [[nodiscard]] Answer unguide(const Words& words);
  [[nodiscard]] Answer limit(const Words& words);
  [[nodiscard]] Answer undo(const Words& words);
  [[nodiscard]] Answer redo(const Words& words);
  [[nodiscard]] Answer mark(const Words& words);
  [[nodiscard]] Answer point(const Words& words);
  [[nodiscard]] Answer line(const Words& words);
  [[nodiscard]] Answer label(const Words& words);
  [[nodiscard]] Answer wipe(const Words& words);
  [[nodiscard]] Answer drawn(const Words& words);
  [[nodiscard]] Answer say(const Words& words);
  [[nodiscard]] Answer said(const Words& words);
  [[nodiscard]] Answer view(const Words& words);
  [[nodiscard]] Answer demonstrate(const Words& words);
  [[nodiscard]] Answer end_demonstration(const Words& words);
  [[nodiscard]] Answer wait(const Words& words);
  [[nodiscard]] Answer status(const Words& words);
  [[nodiscard]] Answer quit(const Words& words);

  SupervisionClient& room_;
  mutable std::vector<std::pair<std::string, Digest>> tools_;  // that the room was last known to have
  bool over_ = false;
};

}  // namespace osteon
