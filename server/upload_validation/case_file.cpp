#include "server/upload_validation/case_file.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/replace_text.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"

namespace osteon {
namespace {

constexpr std::uint64_t kMostFileBytes = std::uint64_t{16} << 30;
constexpr std::size_t kFilePiece = std::size_t{1} << 18;
constexpr const char* kGiven = "given";  // folder of the copy that the checking process reads

// Removes what is not finished.
class Unfinished {
 public:
  explicit Unfinished(std::filesystem::path path) : path_(std::move(path)) {}
  ~Unfinished() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
};

// The folders above a path that are not there yet. At the end those that are still empty go.
class NewParents {
 public:
  explicit NewParents(const std::filesystem::path& path) {
    std::error_code error;
    for (auto folder = path.parent_path(); !folder.empty() && !std::filesystem::exists(folder, error);
         folder = folder.parent_path())
      missing_.push_back(folder);
  }
  ~NewParents() {
    std::error_code ignored;
    for (const std::filesystem::path& folder : missing_) std::filesystem::remove(folder, ignored);
  }
  NewParents(const NewParents&) = delete;
  NewParents& operator=(const NewParents&) = delete;

 private:
  std::vector<std::filesystem::path> missing_;  // the deepest first
};

std::filesystem::path partial_name(const std::filesystem::path& target) {
  return target.string() + ".partial-" + std::to_string(::getpid());
}

tl::unexpected<Error> already_there(const std::filesystem::path& path) {
  return failure(ErrorCode::exists, path.string() + " is already there; choose another name or remove it first");
}

tl::unexpected<Error> cannot_make(const std::filesystem::path& path, const std::error_code& why) {
  return failure(ErrorCode::internal,
                 "cannot make " + path.string() + ": " + why.message() + "; choose a place where you may write");
}

// Only a plain file: a pipe would be waited for, and a folder is a case already or none.
Result<std::uint64_t> plain_file_bytes(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found)
    return failure(ErrorCode::not_found, file.string() + " is not there; check the name");
  if (status.type() == std::filesystem::file_type::directory)
    return bad_input(file.string() + " is a folder and not a file; the folder of a case needs no unpacking");
  if (status.type() != std::filesystem::file_type::regular)
    return bad_input(file.string() + " is not a plain file; name one that \"osteon-import pack\" wrote");
  const std::uint64_t bytes = std::filesystem::file_size(file, error);
  if (error)
    return failure(ErrorCode::not_found, file.string() + " cannot be read: " + error.message() + "; check its rights");
  return bytes;
}

// Reads the file from its begin to its end, piece by piece.
Result<void> read_pieces(const std::filesystem::path& file, const KeepGoing& keep_going,
                         const std::function<Result<void>(std::span<const char>)>& take) {
  const Result<std::uint64_t> bytes = plain_file_bytes(file);
  if (!bytes) return tl::unexpected(bytes.error());
  std::ifstream in(file, std::ios::binary);
  const auto unreadable = [&] {
    return failure(ErrorCode::not_found,
                   file.string() + " cannot be read; check that you may read it, or copy it again");
  };
  if (!in) return unreadable();
  std::vector<char> piece(kFilePiece);
  double done = 0.0;
  while (in.read(piece.data(), static_cast<std::streamsize>(piece.size())), in.gcount() > 0) {
    const auto size = static_cast<std::size_t>(in.gcount());
    if (Result<void> taken = take(std::span(piece).first(size)); !taken) return taken;
    done += static_cast<double>(size);
    if (!keep_going(std::min(1.0, done / static_cast<double>(std::max<std::uint64_t>(1, *bytes)))))
      return stopped_while("reading " + file.string());
  }
  return in.eof() ? Result<void>{} : unreadable();
}

// The message without the names of folders that nobody has seen.
std::string without_partial(std::string text) {
  constexpr std::string_view kMark = ".partial-";
  for (std::size_t at = 0; (at = text.find(kMark, at)) != std::string::npos;)
    text.erase(at, text.find_first_not_of("0123456789", at + kMark.size()) - at);
  return text;
}

Result<void> copy_file_to(const std::filesystem::path& file, const std::filesystem::path& copy,
                          const KeepGoing& keep_going) {
  std::ofstream out(copy, std::ios::binary);
  const auto full = [&] {
    return failure(ErrorCode::internal, "cannot unpack " + file.filename().string() + " to " +
                                            without_partial(copy.parent_path().parent_path().string()) +
                                            ": the disk accepts no more data; make room on it");
  };
  Result<void> read = read_pieces(file, keep_going, [&](std::span<const char> piece) -> Result<void> {
    out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
    return out ? Result<void>{} : full();
  });
  if (!read) return read;
  out.close();
  return out ? Result<void>{} : full();
}

std::uint64_t bytes_below(const std::filesystem::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;  // the other process may remove a file meanwhile
    if (at->is_regular_file(gone)) bytes += at->file_size(gone);
  }
  return bytes;
}

// An error of the checking process about what is in `work`, with the names of the file and the target instead.
Error about_file(Error error, const std::filesystem::path& file, const std::filesystem::path& target,
                 const std::filesystem::path& work) {
  replace_all(error.message, (work / "sent").string(), file.filename().string());
  replace_all(error.message, (work / kSoundCase).string(), target.string());
  error.message = without_partial(error.message);
  if (error.message.find(file.filename().string()) == std::string::npos)
    error.message = file.string() + ": " + error.message;
  return error;
}

}  // namespace

UploadQuota case_file_quota() {
  UploadQuota quota;
  quota.archive_bytes = quota.unpacked_bytes = kMostFileBytes;
  const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
  if (pages > 0 && page > 0)
    quota.memory_bytes =
        std::max(quota.memory_bytes, static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page));
  quota.time = std::chrono::minutes(30);
  return quota;
}

Result<void> pack_case_file(const std::filesystem::path& folder, const std::filesystem::path& file, bool replace,
                            const KeepGoing& keep_going) {
  std::error_code error;
  if (!replace && std::filesystem::exists(file, error)) return already_there(file);
  if (std::filesystem::is_directory(file, error))
    return failure(ErrorCode::exists, file.string() + " is a folder; choose the name of a file");
  const Result<Case> bone = Case::load(folder);
  if (!bone) return tl::unexpected(bone.error());
  if (bone->info().scan && std::filesystem::exists(folder / kScanFile, error))
    if (const auto scan = load_scan(folder, *bone, part(keep_going, 0.1, 0.4)); !scan)
      return tl::unexpected(scan.error());
  const Unfinished partial(partial_name(file));
  if (Result<void> packed = pack_case(folder, partial.path(), part(keep_going, 0.4, 1.0)); !packed) {
    packed.error().message = without_partial(packed.error().message);
    return packed;
  }
  std::filesystem::rename(partial.path(), file, error);
  return error ? Result<void>(cannot_make(file, error)) : Result<void>{};
}

Result<CheckedCase> unpack_case_file(const std::filesystem::path& program, const std::filesystem::path& file,
                                     const std::filesystem::path& folder, const UploadQuota& quota,
                                     const KeepGoing& keep_going) {
  std::error_code error;
  const std::filesystem::path target = folder.has_filename() ? folder : folder.parent_path();
  if (std::filesystem::exists(target, error)) return already_there(target);
  const Result<std::uint64_t> bytes = plain_file_bytes(file);
  if (!bytes) return tl::unexpected(bytes.error());
  const NewParents parents(target);
  const Unfinished partial(partial_name(target));
  // The process may open files of this folder only. A link to the file would let it change the original.
  std::filesystem::create_directories(partial.path() / kGiven, error);
  if (error) return cannot_make(target, error);
  const std::filesystem::path copy = partial.path() / kGiven / file.filename();
  if (Result<void> copied = copy_file_to(file, copy, part(keep_going, 0.0, 0.1)); !copied)
    return tl::unexpected(copied.error());

  // It writes every byte twice: what was sent, and what it has read of that. A case shrinks by a third when it is
  // packed.
  const double expected = static_cast<double>(*bytes) * (1.0 + 2.0 * 1.5);
  double done = 0.1;
  const auto stop = [&] {
    const double written = static_cast<double>(bytes_below(partial.path()));
    done = std::max(done, 0.1 + 0.89 * std::clamp(written / std::max(1.0, expected), 0.0, 1.0));
    return !keep_going(done);
  };
  Result<CheckedCase> checked = check_case(program, copy, partial.path(), quota, stop);
  // Ctrl+C of a terminal ends the process too, which then seems to have died of the case.
  if (!checked && !keep_going(done)) return stopped_while("unpacking " + file.string());
  if (!checked) return tl::unexpected(about_file(checked.error(), file, target, partial.path()));
  if (!keep_going(1.0)) return stopped_while("unpacking " + file.string());
  std::filesystem::rename(partial.path() / kSoundCase, target, error);
  if (error) return cannot_make(target, error);
  return checked;
}

Result<std::filesystem::path> folder_of_case_file(const std::filesystem::path& library,
                                                  const std::filesystem::path& file, const KeepGoing& keep_going) {
  Hasher hasher;
  const Result<void> read = read_pieces(file, keep_going, [&](std::span<const char> piece) {
    hasher.bytes(std::as_bytes(piece));
    return Result<void>{};
  });
  if (!read) return tl::unexpected(read.error());
  return library / to_hex(hasher.finish());
}

}  // namespace osteon
