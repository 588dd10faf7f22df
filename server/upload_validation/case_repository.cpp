#include "server/upload_validation/case_repository.hpp"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "common/volume/case_scan.hpp"
#include "server/upload_validation/case_check.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kIncoming = "incoming-", kArchive = "upload.zip";
constexpr std::uintmax_t kMostDescription = 1 << 20;  // bytes
constexpr std::string_view kNote = "memory.json";     // in a case's folder: the memory that it takes when it is loaded

tl::unexpected<Error> disk(const fs::path& where, const std::string& why) {
  return failure(ErrorCode::internal, "cannot write " + where.string() + ": " + why);
}

std::uint64_t bytes_in(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    if (std::error_code none; at->is_regular_file(none)) bytes += at->file_size(none);
  return bytes;
}

}  // namespace

struct Upload::File {
  std::ofstream out;
};

Upload::Upload(fs::path folder, const UploadQuota& quota, std::atomic<int>& open)
    : folder_(std::move(folder)), quota_(quota), open_(open), file_(std::make_unique<File>()) {
  file_->out.open(folder_ / kArchive, std::ios::binary | std::ios::trunc);
}

Upload::~Upload() {
  file_.reset();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  --open_;
}

Result<void> Upload::add(std::string_view piece) {
  bytes_ += piece.size();
  if (bytes_ > quota_.archive_bytes)
    return failure(ErrorCode::exhausted, "the upload is larger than the " + std::to_string(quota_.archive_bytes) +
                                             " bytes that this server accepts; ask the operator for a larger quota");
  file_->out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
  return file_->out ? Result<void>{} : Result<void>(disk(folder_ / kArchive, "the disk accepts no more data"));
}

Result<std::unique_ptr<CaseRepository>> CaseRepository::open(fs::path folder, fs::path program, UploadQuota quota) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && ::access(folder.c_str(), W_OK) != 0) error = std::error_code(errno, std::generic_category());
  if (error)
    return failure(ErrorCode::internal,
                   "the folder --cases " + folder.string() + " cannot be written: " + error.message());
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with(kIncoming)) left.push_back(entry.path());
  for (const fs::path& one : left) fs::remove_all(one, error);
  folder = fs::absolute(folder);
  return std::unique_ptr<CaseRepository>(new CaseRepository(std::move(folder), std::move(program), quota));
}

std::uint64_t CaseRepository::case_bytes() const {
  std::uint64_t bytes = 0;
  for (const fs::path& one : folders()) bytes += bytes_in(one);
  return bytes;
}

Result<std::unique_ptr<Upload>> CaseRepository::begin() {
  if (++open_ > kMostUploads) {
    --open_;
    return failure(ErrorCode::exhausted, std::to_string(kMostUploads) + " uploads are under way; try again later");
  }
  if (case_bytes() >= quota_.kept_bytes) {
    --open_;
    return failure(ErrorCode::exhausted, "the server's folder of cases is full; ask the operator to delete some");
  }
  fs::path place;
  std::error_code error;
  do place = folder_ / (std::string(kIncoming) + std::to_string(++next_));
  while (!fs::create_directory(place, error) && !error);
  if (error) {
    --open_;
    return disk(place, error.message());
  }
  return std::unique_ptr<Upload>(new Upload(place, quota_, open_));
}

Result<StoredCase> CaseRepository::keep(std::unique_ptr<Upload> upload, const std::function<bool()>& stop) {
  upload->file_->out.close();
  if (!upload->file_->out) return disk(upload->folder(), "the disk accepts no more data");
  const fs::path sound = upload->folder() / kSoundCase;
  std::error_code error;
  const Result<CheckedCase> checked = check_case(program_, upload->folder() / kArchive, upload->folder(), quota_, stop);
  if (!checked) return tl::unexpected(checked.error());

  std::ofstream(sound / kNote) << nlohmann::json{{"memory_bytes", checked->memory_bytes}} << "\n";

  const MutexLock lock(keeping_);
  StoredCase stored{checked->hash,
                    checked->title,
                    folder_ / to_hex(checked->hash),
                    bytes_in(sound),
                    fs::exists(folder_ / to_hex(checked->hash), error),
                    checked->memory_bytes};
  // A case that was stored without its scan gets it from a later upload.
  const bool has_all =
      stored.known && (fs::exists(stored.folder / kScanFile, error) || !fs::exists(sound / kScanFile, error));
  if (has_all) return stored;
  const fs::path from = stored.known ? sound / kScanFile : sound,
                 to = stored.known ? stored.folder / kScanFile : stored.folder;
  const std::uint64_t bytes = stored.known ? fs::file_size(from, error) : stored.bytes;
  // Other cases may have been stored since this upload began.
  if (case_bytes() + bytes > quota_.kept_bytes)
    return failure(ErrorCode::exhausted, "the server's folder of cases has no " + std::to_string(bytes) +
                                             " bytes left for this one; ask the operator to delete some");
  if (stop && stop()) return failure(ErrorCode::cancelled, "the case is not kept, since its sender has cancelled");
  fs::rename(from, to, error);
  if (error) return disk(to, error.message());
  return stored;
}

std::vector<fs::path> CaseRepository::folders() const {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error))
    if (digest_from_hex(entry.path().filename().string())) found.push_back(entry.path());
  std::ranges::sort(found);
  return found;
}

Result<StoredCase> CaseRepository::peek(const fs::path& folder) {
  const Result<Digest> hash = digest_from_hex(folder.filename().string());
  if (!hash) return failure(ErrorCode::invalid_input, folder.string() + " is not named by the hash of a case");
  std::error_code none;
  if (fs::file_size(folder / "case.json", none) > kMostDescription || none)
    return failure(
        ErrorCode::invalid_input,
        (folder / "case.json").string() + " is missing or too long; delete the folder and upload the case again");
  std::ifstream described(folder / "case.json"), noted(folder / kNote);
  const nlohmann::json about = nlohmann::json::parse(described, nullptr, false),
                       note = nlohmann::json::parse(noted, nullptr, false);
  if (!about.is_object() || !about.contains("title") || !about["title"].is_string())
    return failure(
        ErrorCode::invalid_input,
        (folder / "case.json").string() + " does not describe a case; delete the folder and upload the case again");
  // Without the note, as in an earlier version, the size is known once the case is loaded.
  const bool known = note.is_object() && note.contains("memory_bytes") && note["memory_bytes"].is_number_unsigned();
  return StoredCase{*hash,  about["title"].get<std::string>(),
                    folder, bytes_in(folder),
                    true,   known ? note["memory_bytes"].get<std::uint64_t>() : 0};
}

}  // namespace osteon
