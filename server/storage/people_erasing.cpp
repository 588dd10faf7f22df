#include "server/storage/people_erasing.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <utility>
#include <variant>

#include "server/storage/journal_entries.hpp"
#include "server/storage/room_owners.hpp"

namespace osteon {
namespace {

std::string lower(std::string_view text) {
  std::string low(text);
  for (char& c : low)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return low;
}

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || static_cast<unsigned char>(c) >= 0x80;
}

bool has_word(std::string_view text, std::string_view word) {
  for (std::size_t at = text.find(word); at != text.npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_letter(text[at - 1])) && (end == text.size() || !is_letter(text[end]))) return true;
  }
  return false;
}

std::uint32_t number_of(const Person& person) {
  std::uint32_t number = 0;
  std::from_chars(person.pseudonym.data(), person.pseudonym.data() + person.pseudonym.size(), number);
  return number;
}

// The words of an entry, if it has any.
std::string* words_in(LogEntry& entry) {
  if (auto* mark = std::get_if<MarkEntry>(&entry.what)) return &mark->label;
  if (auto* said = std::get_if<WordsEntry>(&entry.what)) return &said->words;
  if (auto* one = std::get_if<SuperviseEntry>(&entry.what)) return &one->supervision.words;
  if (auto* one = std::get_if<AnnotationEntry>(&entry.what); one != nullptr && one->drawn) return &one->drawn->words;
  return nullptr;
}

}  // namespace

bool WordEraser::names_one(std::string_view words) const {
  const std::string low = lower(words);
  return std::ranges::any_of(names_,
                             [&](const std::string& name) { return !name.empty() && has_word(low, lower(name)); });
}

std::optional<std::string> WordEraser::operator()(const JournalEntry& entry) {
  Result<LogEntry> read = entry_from_bytes(entry.seq, std::chrono::nanoseconds(entry.at_ns), entry.bytes);
  if (!read) return std::nullopt;
  if (const auto* join = std::get_if<JoinEntry>(&read->what); join != nullptr && people_.contains(join->person))
    authors_.insert(join->author);
  std::string* words = words_in(*read);
  if (words == nullptr || words->empty() || *words == kErasedWords) return std::nullopt;
  bool theirs = is_of(read->author) || names_one(*words);
  if (const auto* said = std::get_if<WordsEntry>(&read->what)) theirs = theirs || is_of(said->to);
  if (const auto* one = std::get_if<SuperviseEntry>(&read->what)) theirs = theirs || is_of(one->subject);
  if (const auto* one = std::get_if<AnnotationEntry>(&read->what)) theirs = theirs || is_of(one->drawn->author);
  if (!theirs) return std::nullopt;
  *words = kErasedWords;
  return to_bytes(*read);
}

Result<ErasedPeople> erase_people(Journal& journal, const std::function<bool(const Person&)>& whom,
                                  std::uint32_t number) {
  const Result<std::vector<Person>> all = journal.people();
  if (!all) return tl::unexpected(all.error());
  std::set<std::uint32_t> people;
  std::vector<std::string> names, pseudonyms;
  for (const Person& person : *all)
    if (whom(person) || (number != 0 && number_of(person) == number)) {
      people.insert(number_of(person));
      names.push_back(person.label);
      pseudonyms.push_back(person.pseudonym);
    }
  if (number != 0) people.insert(number);  // the name may be erased already
  if (people.empty()) return ErasedPeople{};
  const Result<std::size_t> entries = journal.erase_entries(WordEraser(std::move(people), names));
  if (!entries) return tl::unexpected(entries.error());
  ErasedPeople erased{0, *entries, names};
  if (pseudonyms.empty()) return erased;
  const Result<std::size_t> gone = journal.erase_people_if(
      [&](const Person& person) { return std::ranges::find(pseudonyms, person.pseudonym) != pseudonyms.end(); });
  if (!gone) return tl::unexpected(gone.error());
  erased.people = *gone;
  return erased;
}

Result<void> erase_owner(const std::filesystem::path& journal, const ErasedPeople& erased) {
  const std::string owner = owner_of(journal);
  if (owner.empty() || std::ranges::find(erased.names, owner) == erased.names.end()) return {};
  return note_owner(journal, {});
}

}  // namespace osteon
