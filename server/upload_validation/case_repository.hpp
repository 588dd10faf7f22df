// A folder of uploaded cases. Each case is in a folder of its own, named by its hash.
#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/mutex.hpp"
#include "common/core/result.hpp"
#include "server/upload_validation/case_archive.hpp"

namespace osteon {

struct StoredCase {
  Digest hash;
  std::string title;
  std::filesystem::path folder;
  std::uint64_t bytes = 0;         // on the disk
  bool known = false;              // it was there before
  std::uint64_t memory_bytes = 0;  // memory that it takes when it is loaded; 0: unknown
};

// An archive that is being uploaded, in a file of the repository. The destructor removes the file.
class Upload {
 public:
  ~Upload();
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;
  // Errors: exhausted (beyond the quota), internal (disk).
  [[nodiscard]] Result<void> add(std::string_view piece);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  friend class CaseRepository;
  Upload(std::filesystem::path folder, const UploadQuota& quota, std::atomic<int>& open);
  std::filesystem::path folder_;
  const UploadQuota quota_;
  std::atomic<int>& open_;
  std::uint64_t bytes_ = 0;
  struct File;
  std::unique_ptr<File> file_;
};

// Any thread.
class CaseRepository {
 public:
  static constexpr int kMostUploads = 4;  // at once

  // `program`: what check_case() starts. Removes what an earlier process left unfinished. Error internal: the folder
  // cannot be made or written.
  [[nodiscard]] static Result<std::unique_ptr<CaseRepository>> open(std::filesystem::path folder,
                                                                    std::filesystem::path program,
                                                                    UploadQuota quota = {});

  // Error exhausted: too many uploads are under way, or the repository is full.
  [[nodiscard]] Result<std::unique_ptr<Upload>> begin();
  // Checks the upload and stores it. This takes long. Errors: those of check_case(), exhausted (the repository is
  // full), internal (disk), cancelled (`stop` returned true).
  [[nodiscard]] Result<StoredCase> keep(std::unique_ptr<Upload> upload, const std::function<bool()>& stop = {});
  // Folders of the stored cases, in the order of their hashes.
  [[nodiscard]] std::vector<std::filesystem::path> folders() const;
  // Describes one of them without reading its bone. Error invalid_input: its description cannot be read.
  [[nodiscard]] static Result<StoredCase> peek(const std::filesystem::path& folder);
  [[nodiscard]] const UploadQuota& quota() const { return quota_; }

 private:
  CaseRepository(std::filesystem::path folder, std::filesystem::path program, UploadQuota quota)
      : folder_(std::move(folder)), program_(std::move(program)), quota_(quota) {}
  [[nodiscard]] std::uint64_t case_bytes() const;  // of the stored cases

  const std::filesystem::path folder_, program_;
  const UploadQuota quota_;
  Mutex keeping_{LockRank::leaf};  // guards the folder: one case at a time is moved to it
  std::atomic<int> open_{0};
  std::atomic<std::uint64_t> next_{0};
};

}  // namespace osteon
