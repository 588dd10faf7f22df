#include "tests/unit/upload_validation/zip_bytes.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <gtest/gtest.h>

namespace osteon::test {

static_assert(kFileEntry == AE_IFREG && kFolderEntry == AE_IFDIR && kLinkEntry == AE_IFLNK);

Bytes zip(const std::vector<Entry>& entries, const char* options) {
  std::size_t most = std::size_t{1} << 16;
  for (const Entry& one : entries) most += 4 * one.path.size() + 2 * one.content.size() + 1024;
  Bytes bytes(most);
  std::size_t used = 0;
  archive* a = archive_write_new();
  archive_write_set_format_zip(a);
  if (options != nullptr) {
    EXPECT_EQ(archive_write_set_options(a, options), ARCHIVE_OK);
    archive_write_set_passphrase(a, "secret");
  }
  archive_write_open_memory(a, bytes.data(), bytes.size(), &used);
  for (const Entry& one : entries) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, one.path.c_str());
    archive_entry_set_filetype(entry, one.type);
    archive_entry_set_perm(entry, 0644);
    if (!one.link.empty()) (one.hard ? archive_entry_set_hardlink : archive_entry_set_symlink)(entry, one.link.c_str());
    archive_entry_set_size(entry, static_cast<la_int64_t>(one.content.size()));
    EXPECT_LE(archive_write_header(a, entry), ARCHIVE_OK);
    archive_write_data(a, one.content.data(), one.content.size());
    archive_entry_free(entry);
  }
  archive_write_close(a);
  archive_write_free(a);
  bytes.resize(used);
  return bytes;
}

}  // namespace osteon::test
