#include "tests/fuzz/archive_bytes.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <string_view>

#include "common/core/check.hpp"

namespace osteon::fuzz {

Bytes an_archive(const std::vector<std::pair<std::string, std::string>>& files, const ArchiveForm& form) {
  Bytes bytes(std::size_t{1} << 20);
  std::size_t used = 0;
  archive* a = archive_write_new();
  OSTEON_CHECK(archive_write_set_format_by_name(a, form.format) == ARCHIVE_OK);
  if (std::string_view(form.format) == "zip")
    archive_write_set_format_option(a, "zip", "compression", form.zip_compression);
  if (form.gzip) archive_write_add_filter_gzip(a);
  archive_write_set_bytes_in_last_block(a, 1);
  OSTEON_CHECK(archive_write_open_memory(a, bytes.data(), bytes.size(), &used) == ARCHIVE_OK);
  for (const auto& [name, content] : files) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_mtime(entry, 0, 0);
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    archive_write_header(a, entry);
    archive_write_data(a, content.data(), content.size());
    archive_entry_free(entry);
  }
  OSTEON_CHECK(archive_write_close(a) == ARCHIVE_OK);
  archive_write_free(a);
  bytes.resize(used);
  return bytes;
}

}  // namespace osteon::fuzz
