// Who made a room or a backup: a file beside the journal. So it outlives a restart, is deleted with the journal, and
// can be forgotten, which the journal's chain of hashes could not.
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

// The user of a certificate; empty: nobody knows, as of what was made over plain text, or before owners were noted.
[[nodiscard]] std::string owner_of(const std::filesystem::path& journal);
// For its owner alone, safe on the disk. Empty `user`: a note that is there is removed. Errors: those of Disk.
[[nodiscard]] Result<void> note_owner(const std::filesystem::path& journal, const std::string& user);
// The names, without `ending`, of the journals in a folder that have this ending and this owner.
[[nodiscard]] std::set<std::string> owned_by(const std::string& user, const std::filesystem::path& folder,
                                             std::string_view ending);
// Removes what was noted so many days ago or earlier. Gives how many.
std::size_t forget_owners(const std::filesystem::path& folder, std::chrono::days older_than);

// Makes a journal, and notes first whose it is: so that none is there without. Gives what `make` gives.
template <class Make>
auto make_owned(const std::filesystem::path& journal, const std::string& user, const Make& make) -> decltype(make()) {
  if (const Result<void> noted = note_owner(journal, user); !noted) return tl::unexpected(noted.error());
  auto made = make();
  std::error_code ignored;
  if (!made && !std::filesystem::exists(journal, ignored)) (void)note_owner(journal, {});
  return made;
}

}  // namespace osteon
