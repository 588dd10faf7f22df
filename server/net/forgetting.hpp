// Forgetting who people were: their names, and what they said, drew as words and called moments of the room.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "server/journal/journal.hpp"
#include "server/room/log_entry.hpp"

namespace osteon {

// What stands where words were.
inline constexpr std::string_view kErasedWords = "(erased)";

// Takes the words out of entries: those by these people, to one of them or about one of them, and any in which one of
// their names is a word. What they cut and where they drew stays. For all entries of a journal in their order.
class WordEraser {
 public:
  WordEraser(std::set<std::uint32_t> people, std::vector<std::string> names)
      : people_(std::move(people)), names_(std::move(names)) {}
  // The entry's bytes without the words. Nothing: it has none of these, or cannot be read.
  [[nodiscard]] std::optional<std::string> operator()(const JournalEntry& entry);

 private:
  [[nodiscard]] bool is_of(AuthorId author) const { return authors_.contains(author); }
  [[nodiscard]] bool names_one(std::string_view words) const;
  const std::set<std::uint32_t> people_;
  const std::vector<std::string> names_;
  std::set<AuthorId> authors_ = {};  // as whom they came
};

struct Forgotten {
  std::size_t people = 0;  // whose names are gone
  std::size_t entries = 0;    // whose words are gone
  std::vector<std::string> names = {};
};
// Both, of the people that `whom` names and of the person of that number, 0: nobody. First the words, so that it can be
// done again where it was cut short. Errors: those of Journal::erase_entries() and of Journal::forget_person().
[[nodiscard]] Result<Forgotten> forget_people(Journal& journal, const std::function<bool(const Person&)>& whom,
                                              std::uint32_t number = 0);

// The note of who made the journal, where that is one of these.
[[nodiscard]] Result<void> forget_owner(const std::filesystem::path& journal, const Forgotten& forgotten);

}  // namespace osteon
