// Erases who people were: their names, their messages, the texts that they drew, and the marks that they named.
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

// Stands in place of erased words.
inline constexpr std::string_view kErasedWords = "(erased)";

// Removes words from entries: those by these people, to one of them or about one of them, and all words that contain
// one of their names. Their cuts, and where they drew, stay. Takes all entries of a journal in their order.
class WordEraser {
 public:
  WordEraser(std::set<std::uint32_t> people, std::vector<std::string> names)
      : people_(std::move(people)), names_(std::move(names)) {}
  // The entry's bytes without the words. Nothing: the entry has no such words, or cannot be read.
  [[nodiscard]] std::optional<std::string> operator()(const JournalEntry& entry);

 private:
  [[nodiscard]] bool is_of(AuthorId author) const { return authors_.contains(author); }
  [[nodiscard]] bool names_one(std::string_view words) const;
  const std::set<std::uint32_t> people_;
  const std::vector<std::string> names_;
  std::set<AuthorId> authors_ = {};  // the authors that these people were
};

struct ErasedPeople {
  std::size_t people = 0;   // people whose names are erased
  std::size_t entries = 0;  // entries whose words are erased
  std::vector<std::string> names = {};
};
// Erases words and names of the people that `whom` selects and of the person with that number (0: nobody). Words are
// erased first, so that an interrupted call can be repeated. Errors: those of Journal::erase_entries() and of
// Journal::erase_person().
[[nodiscard]] Result<ErasedPeople> erase_people(Journal& journal, const std::function<bool(const Person&)>& whom,
                                                std::uint32_t number = 0);

// Removes the note of who made the journal, if that is one of these people.
[[nodiscard]] Result<void> erase_owner(const std::filesystem::path& journal, const ErasedPeople& erased);

}  // namespace osteon
