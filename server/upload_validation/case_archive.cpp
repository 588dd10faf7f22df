#include "server/upload_validation/case_archive.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kChunk = 1 << 18;

struct CloseReader {
  void operator()(archive* a) const { archive_read_free(a); }
};
struct CloseWriter {
  void operator()(archive* a) const { archive_write_free(a); }
};
struct FreeEntry {
  void operator()(archive_entry* entry) const { archive_entry_free(entry); }
};
using Reader = std::unique_ptr<archive, CloseReader>;
using Writer = std::unique_ptr<archive, CloseWriter>;

Reader zip_reader() {
  Reader a(archive_read_new());
  archive_read_support_format_zip(a.get());
  return a;
}

std::string reason_of(archive* a) {
  const char* reason = archive_error_string(a);
  return reason != nullptr ? reason : "unknown reason";
}

// A zip archive ends with a record of its entries, and a comment of up to 64 KiB (APPNOTE 6.3.10, section 4.3.16).
constexpr std::size_t kEndRecord = 22, kMostEnd = kEndRecord + 0xffff;

// How many entries the record at the end says there are. None: there is no such record, or it leaves that to another
// record, as those of huge archives do.
std::optional<int> entries_by_end(std::string_view end) {
  constexpr std::size_t kCountAt = 10;
  constexpr unsigned kElsewhere = 0xffff;
  const std::size_t at = end.rfind("PK\5\6");
  if (at == std::string_view::npos || end.size() - at < kEndRecord) return {};
  const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(end[at + i])); };
  const unsigned count = byte(kCountAt) | byte(kCountAt + 1) << 8;
  return count == kElsewhere ? std::nullopt : std::optional(static_cast<int>(count));
}

// The last bytes of a file, where that record is.
std::string end_of(const fs::path& file, std::uint64_t bytes) {
  std::string end(std::min<std::uint64_t>(bytes, kMostEnd), '\0');
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(bytes - end.size()));
  in.read(end.data(), static_cast<std::streamsize>(end.size()));
  return end;
}

// Unpacks an open archive and counts the bytes on the way.
class Unpacker {
 public:
  // `said`: how many entries the archive says it has, if it does.
  Unpacker(archive* a, std::string name, std::uint64_t packed_bytes, std::optional<int> said, const UploadQuota& quota,
           const PutPiece& put)
      : archive_(a), name_(std::move(name)), packed_bytes_(packed_bytes), said_(said), quota_(quota), put_(put) {}

  Result<std::map<std::string, std::uint64_t>> run() {
    int entries = 0;
    archive_entry* entry = nullptr;
    while (true) {
      const int status = archive_read_next_header(archive_, &entry);
      if (status == ARCHIVE_EOF) break;
      if (status != ARCHIVE_OK && status != ARCHIVE_WARN) return damaged();
      if (++entries > quota_.entries)
        return failure(ErrorCode::exhausted, name_ + " has more than " + std::to_string(quota_.entries) +
                                                 " entries; a case has at most " +
                                                 std::to_string(std::size(kCaseFiles)) + " files");
      if (Result<void> taken = take(entry); !taken) return tl::unexpected(taken.error());
    }
    for (const std::string_view file : std::span(kCaseFiles).first(kNeededCaseFiles)) {
      if (files_.contains(std::string(file))) continue;
      // The library finds the entries by the list at the end. It takes a damaged list for a shorter one.
      if (entries == 0 || (said_ && *said_ != entries))
        return bad("is not a sound zip archive (its list of files is damaged); copy it or pack the case again");
      return bad("has no " + std::string(file) + "; pack the whole folder of a case");
    }
    return files_;
  }

 private:
  tl::unexpected<Error> bad(const std::string& what) const {
    return failure(ErrorCode::invalid_input, name_ + " " + what);
  }
  tl::unexpected<Error> damaged() const {
    return bad("is not a sound zip archive (" + reason_of(archive_) + "); copy it or pack the case again");
  }

  // The file of a case that an entry contains, if it may be one.
  Result<std::string> file_of(archive_entry* entry) {
    const char* given = archive_entry_pathname(entry);
    const std::string path = given != nullptr ? given : "";
    // The entry's name is omitted: a name of untrusted origin does not belong in a log.
    const auto refuse = [&](const std::string& why) -> Result<std::string> { return bad("has an entry that " + why); };
    if (archive_entry_is_encrypted(entry) != 0) return refuse("is encrypted; pack the case without a password");
    if (archive_entry_symlink(entry) != nullptr || archive_entry_hardlink(entry) != nullptr)
      return refuse("is a link; pack the files themselves");
    if (archive_entry_filetype(entry) != AE_IFREG)
      return refuse("is not a plain file; pack only the files of the case");
    const std::size_t slash = path.find('/');
    const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash);
    const std::string file = slash == std::string::npos ? path : path.substr(slash + 1);
    const bool plain = folder != ".." && folder != "." && (slash == std::string::npos || !folder.empty()) &&
                       folder.find('\\') == std::string::npos;
    if (!plain || std::ranges::find(kCaseFiles, file) == std::end(kCaseFiles))
      return refuse("is not a file of a case; pack only case.json, bone.vdb and scan.vdb");
    if (folder_ && *folder_ != folder) return refuse("lies in another folder than those before it; pack one case");
    folder_ = folder;
    if (files_.contains(file)) return refuse("comes twice; pack the case again");
    return file;
  }

  Result<void> take(archive_entry* entry) {
    // it has no content; its files are checked by their own names
    if (archive_entry_filetype(entry) == AE_IFDIR) return {};
    const Result<std::string> file = file_of(entry);
    if (!file) return tl::unexpected(file.error());
    std::uint64_t& size = files_[*file];
    std::vector<std::byte> piece(kChunk);
    while (true) {
      const la_ssize_t n = archive_read_data(archive_, piece.data(), piece.size());
      if (n < 0) return damaged();
      if (n == 0) return {};
      size += static_cast<std::uint64_t>(n);
      unpacked_bytes_ += static_cast<std::uint64_t>(n);
      if (unpacked_bytes_ > quota_.unpacked_bytes)
        return failure(ErrorCode::exhausted,
                       name_ + " holds more than the " + std::to_string(quota_.unpacked_bytes) +
                           " bytes that a case may have here; import it again with a smaller --margin");
      if (unpacked_bytes_ > quota_.ratio_free_bytes &&
          static_cast<double>(unpacked_bytes_) > quota_.ratio * static_cast<double>(packed_bytes_))
        return failure(ErrorCode::exhausted, name_ + " unpacks to more than " +
                                                 std::to_string(static_cast<int>(quota_.ratio)) +
                                                 " times its size; no case does that");
      if (Result<void> put = put_(*file, std::span(piece).first(static_cast<std::size_t>(n))); !put) return put;
    }
  }

  archive* const archive_;
  const std::string name_;
  const std::uint64_t packed_bytes_;
  const std::optional<int> said_;
  const UploadQuota& quota_;
  const PutPiece& put_;
  std::optional<std::string> folder_;
  std::map<std::string, std::uint64_t> files_;
  std::uint64_t unpacked_bytes_ = 0;
};

// Of the files of a case that are there.
std::uint64_t bytes_of_case(const fs::path& folder) {
  std::uint64_t bytes = 0;
  for (const std::string_view name : kCaseFiles) {
    std::error_code error;
    const std::uint64_t size = fs::file_size(folder / name, error);
    if (!error) bytes += size;
  }
  return bytes;
}

}  // namespace

Result<std::map<std::string, std::uint64_t>> unpack_case(const fs::path& file, const UploadQuota& quota,
                                                         const PutPiece& put) {
  std::error_code error;
  const std::uint64_t bytes = fs::file_size(file, error);
  if (error) return failure(ErrorCode::not_found, file.string() + " cannot be read: " + error.message());
  const std::string name = file.filename().string();
  if (bytes > quota.archive_bytes)
    return failure(ErrorCode::exhausted,
                   name + " is larger than the " + std::to_string(quota.archive_bytes) +
                       " bytes that an archive may have here; import it again with a smaller --margin");
  const Reader a = zip_reader();
  if (archive_read_open_filename(a.get(), file.c_str(), kChunk) != ARCHIVE_OK)
    return failure(ErrorCode::invalid_input,
                   name + " is not a zip archive (" + reason_of(a.get()) + "); pack the case as a zip archive");
  return Unpacker(a.get(), name, bytes, entries_by_end(end_of(file, bytes)), quota, put).run();
}

Result<std::map<std::string, std::uint64_t>> unpack_case(std::span<const std::byte> bytes, const std::string& name,
                                                         const UploadQuota& quota, const PutPiece& put) {
  const Reader a = zip_reader();
  if (archive_read_open_memory(a.get(), bytes.data(), bytes.size()) != ARCHIVE_OK)
    return failure(ErrorCode::invalid_input,
                   name + " is not a zip archive (" + reason_of(a.get()) + "); pack the case as a zip archive");
  const auto end = bytes.last(std::min(bytes.size(), kMostEnd));
  const std::string_view text(reinterpret_cast<const char*>(end.data()), end.size());
  return Unpacker(a.get(), name, bytes.size(), entries_by_end(text), quota, put).run();
}

Result<void> pack_case(const fs::path& folder, const fs::path& file, const KeepGoing& keep_going) {
  const Writer a(archive_write_new());
  const auto disk = [&] {
    return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + reason_of(a.get()) +
                                            "; make room on the disk or choose another place");
  };
  archive_write_set_format_zip(a.get());
  // The first level takes half the time of the usual one, for 3 % more bytes.
  archive_write_set_format_option(a.get(), "zip", "compression-level", "1");
  if (archive_write_open_filename(a.get(), file.c_str()) != ARCHIVE_OK) return disk();
  const double all_bytes = static_cast<double>(std::max<std::uint64_t>(1, bytes_of_case(folder)));
  double packed_bytes = 0.0;
  for (const std::string_view name : kCaseFiles) {
    const fs::path from = folder / name;
    std::error_code error;
    const std::uint64_t size = fs::file_size(from, error);
    std::ifstream in(from, std::ios::binary);
    const bool needed = name != kCaseFiles[kNeededCaseFiles];
    if (!needed && error == std::errc::no_such_file_or_directory) continue;
    if (error || !in)
      return failure(ErrorCode::not_found, folder.string() + " is not a case: it has no " + std::string(name));
    const std::unique_ptr<archive_entry, FreeEntry> entry(archive_entry_new());
    archive_entry_set_pathname(entry.get(), std::string(name).c_str());
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(size));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    if (archive_write_header(a.get(), entry.get()) != ARCHIVE_OK) return disk();
    std::vector<char> piece(kChunk);
    while (in.read(piece.data(), static_cast<std::streamsize>(piece.size())), in.gcount() > 0) {
      if (archive_write_data(a.get(), piece.data(), static_cast<std::size_t>(in.gcount())) != in.gcount())
        return disk();
      packed_bytes += static_cast<double>(in.gcount());
      if (keep_going && !keep_going(std::min(1.0, packed_bytes / all_bytes))) return stopped_while("packing the case");
    }
  }
  return archive_write_close(a.get()) == ARCHIVE_OK ? Result<void>{} : disk();
}

}  // namespace osteon
