#include "tests/fuzz/upload_target.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "common/core/check.hpp"
#include "server/upload_validation/case_archive.hpp"
#include "tests/fuzz/archive_bytes.hpp"

namespace osteon::fuzz {
namespace {

// Small limits, so that an input of a few hundred bytes can exceed each.
constexpr UploadQuota kQuota{.unpacked_bytes = 1 << 16, .entries = 4, .ratio = 50, .ratio_free_bytes = 1 << 10};

void unpack(std::span<const std::uint8_t> data) {
  std::map<std::string, std::uint64_t, std::less<>> put;
  std::uint64_t all = 0;
  const auto out =
      unpack_case(std::as_bytes(data), "upload", kQuota, [&](std::string_view file, std::span<const std::byte> piece) {
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
  OSTEON_CHECK(out->size() >= kNeededCaseFiles && out->size() <= std::size(kCaseFiles));
  for (const auto& [file, size] : *out) OSTEON_CHECK(size == (put.contains(file) ? put.at(file) : 0));
}

}  // namespace

Target upload_target() {
  const std::string text(300, 'a');
  Target target{"upload",
                unpack,
                {an_archive({{"case.json", "{}"}, {"bone.vdb", text}}, {}),
                 an_archive({{"case.json", "{}"}, {"bone.vdb", text}}, {.zip_compression = "store"}),
                 an_archive({{"case.json", "{}"}, {"bone.vdb", text}, {"scan.vdb", text}}, {}),
                 an_archive({{"skull/case.json", "{}"}, {"skull/bone.vdb", std::string(40000, '\0')}}, {})}};
  target.mutations = 5000;
  return target;
}

}  // namespace osteon::fuzz
