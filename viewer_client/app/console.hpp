// The instructor's console: a person or a script supervises a room without a window. One command per line, one line of
// answer for each.
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

// Splits a line into words. Text in double quotes is one word. Error invalid_input: a quote without its end.
[[nodiscard]] Result<std::vector<std::string>> words_of_line(std::string_view line);

// For one thread.
class Console {
 public:
  // `room` must outlive it.
  explicit Console(SupervisionClient& room) : room_(room) {}

  // The answer to a line: "ok ..." or "error ...", without a line end. Nothing for an empty line and for one that
  // begins with #. May wait for the room.
  [[nodiscard]] std::optional<std::string> answer(std::string_view line);
  // The quit command was given.
  [[nodiscard]] bool over() const { return over_; }
  [[nodiscard]] static const char* help();  // every command, one per line

 private:
  using Words = std::vector<std::string>;
  using Answer = Result<std::string>;
  struct Command;
  [[nodiscard]] static const std::vector<Command>& commands();

  [[nodiscard]] Result<PersonSeen> find(const std::string& name) const;
  [[nodiscard]] std::string name_of(AuthorId author) const;
  [[nodiscard]] std::string tool_name(const Digest& tool) const;
  [[nodiscard]] std::string text_of(const PersonSeen& person) const;
  // Changes the restrictions of one person or of all, and waits until the room has published the change.
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
  mutable std::vector<std::pair<std::string, Digest>> tools_;  // the newest list received from the room
  bool over_ = false;
};

}  // namespace osteon
