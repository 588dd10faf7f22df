#include "tests/fuzz/upload_target.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <map>
#include <utility>

#include "common/core/check.hpp"
#include "server/intake/case_archive.hpp"

namespace osteon::fuzz {
namespace {

// Small, so that an input of a few hundred bytes can go beyond each.
constexpr IntakeQuota kQuota{.unpacked_bytes = 1 << 16, .entries = 4, .ratio = 50, .ratio_free_bytes = 1 << 10};

void unpack(std::span<const std::uint8_t> data) {
  std::map<std::string, std::uint64_t, std::less<>> put;
  std::uint64_t all = 0;
  const auto out = unpack_case(std::as_bytes(data), "upload", kQuota, [&](std::string_view file, std::span<const std::byte> piece) {
    OSTEON_CHECK(std::ranges::find(kCaseFiles, file) != std::end(kCaseFiles));
    put[std::string(file)] += piece.size();
    all += piece.size();
    OSTEON_CHECK(all <= kQuota.unpacked_bytes);
    return Result<void>{};
  });
  if (!out) {
    OSTEON_CHECK(out.error().code == ErrorCode::invalid_input || out.error().code == ErrorCode::exhausted);
    return;
  }
  OSTEON_CHECK(out->size() == std::size(kCaseFiles));
  for (const auto& [file, size] : *out) OSTEON_CHECK(size == (put.contains(file) ? put.at(file) : 0));
}

Bytes an_archive(const std::vector<std::pair<std::string, std::string>>& files, const char* compression) {
  Bytes bytes(1 << 16);
  std::size_t used = 0;
  archive* a = archive_write_new();
  archive_write_set_format_zip(a);
  archive_write_set_format_option(a, "zip", "compression", compression);
  OSTEON_CHECK(archive_write_open_memory(a, bytes.data(), bytes.size(), &used) == ARCHIVE_OK);
  for (const auto& [name, content] : files) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, name.c_str());
    archive_entry_set_filetype(entry, AE_IFREG);
    archive_entry_set_size(entry, static_cast<la_int64_t>(content.size()));
    archive_write_header(a, entry);
    archive_write_data(a, content.data(), content.size());
    archive_entry_free(entry);
  }
  archive_write_close(a);
  archive_write_free(a);
  bytes.resize(used);
  return bytes;
}

}  // namespace

Target upload_target() {
  const std::string text(300, 'a');
  Target target{"upload", unpack,
                {an_archive({{"case.json", "{}"}, {"bone.vdb", text}}, "deflate"), an_archive({{"case.json", "{}"}, {"bone.vdb", text}}, "store"),
                 an_archive({{"skull/case.json", "{}"}, {"skull/bone.vdb", std::string(40000, '\0')}}, "deflate")}};
  target.mutations = 5000;
  return target;
}

}  // namespace osteon::fuzz
