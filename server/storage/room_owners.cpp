#include "server/storage/room_owners.hpp"

#include <system_error>

#include "common/runtime/files.hpp"
#include "server/journal/disk.hpp"
#include "server/journal/journal_file.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOwnerEnding = "-owner";  // as in owner_file_of()

}  // namespace

std::string owner_of(const fs::path& journal) {
  std::string user = read_file(owner_file_of(journal)).value_or("");
  if (user.ends_with('\n')) user.pop_back();
  return user;
}

Result<void> note_owner(const fs::path& journal, const std::string& user) {
  const fs::path file = owner_file_of(journal);
  if (user.empty()) return system_disk().remove(file);
  Result<DurableFile> note = DurableFile::begin(system_disk(), file);
  if (!note) return tl::unexpected(note.error());
  if (Result<void> written = note->write(user + "\n"); !written) return written;
  return note->finish().map([](const WrittenFile&) {});
}

std::set<std::string> owned_by(const std::string& user, const fs::path& folder, std::string_view ending) {
  std::set<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().extension() == ending && owner_of(entry.path()) == user)
      names.insert(entry.path().stem().string());
  return names;
}

std::size_t forget_owners(const fs::path& folder, std::chrono::days older_than) {
  const auto before = fs::file_time_type::clock::now() - older_than;
  std::size_t gone = 0;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if (entry.path().string().ends_with(kOwnerEnding) && entry.last_write_time(ignored) <= before)
      gone += fs::remove(entry.path(), ignored) ? 1 : 0;
  return gone;
}

}  // namespace osteon
