// Stores who made a room or a backup, in a file beside the journal. So the note outlives a restart and is deleted with
// the journal. It can be erased, unlike an entry in the journal's chain of hashes.
#pragma once
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <system_error>

#include "common/core/result.hpp"

namespace osteon {

// The user of a certificate. Empty: unknown, as for journals made over plain text or before owners were stored.
[[nodiscard]] std::string owner_of(const std::filesystem::path& journal);
// Writes the note, durable and readable by the file's owner alone. Empty `user`: removes an existing note. Errors:
// those of Disk.
[[nodiscard]] Result<void> note_owner(const std::filesystem::path& journal, const std::string& user);
// The names, without `ending`, of journals in a folder that have this ending and this owner.
[[nodiscard]] std::set<std::string> owned_by(const std::string& user, const std::filesystem::path& folder,
                                             std::string_view ending);
// Removes notes that are this many days old or older. Returns how many.
std::size_t forget_owners(const std::filesystem::path& folder, std::chrono::days older_than);

// Makes a journal. Notes its owner first, so that no journal exists without its owner. Returns what `make` returns.
template <class Make>
auto make_owned(const std::filesystem::path& journal, const std::string& user, const Make& make) -> decltype(make()) {
  if (const Result<void> noted = note_owner(journal, user); !noted) return tl::unexpected(noted.error());
  auto made = make();
  std::error_code ignored;
  if (!made && !std::filesystem::exists(journal, ignored)) (void)note_owner(journal, {});
  return made;
}

}  // namespace osteon
