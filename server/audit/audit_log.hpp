// The audit log on the disk: "audit.log", one record a line, with "audit.people" and "audit.lock" beside it, all for
// their owner alone. Several processes may append to one log, as a server and a command beside it: each holds the lock
// meanwhile.
#pragma once
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/audit/audit_people.hpp"
#include "server/audit/audit_record.hpp"

namespace osteon {

// Its name, where nobody says another: in the folder of the journals.
inline constexpr const char* kAuditLogFile = "audit.log";

// Not thread safe. After an error the same call may be made again. Errors: those of the disk; unavailable (another
// process held the lock for five seconds).
class AuditLog {
 public:
  // What becomes of a log whose last record is damaged, or of another server's key. A server sets it aside under
  // another name, says so in its log and in the new audit log, and begins one. A command refuses, with invalid_input.
  enum class Unfit { set_aside, refuse };
  [[nodiscard]] static Result<AuditLog> open(Disk& disk, std::filesystem::path file,
                                             std::shared_ptr<const SigningKeys> keys, Unfit unfit);

  struct Written {
    AuditRecord record;
    Digest hash;  // of its line
  };
  // All of them, safely on the disk, or an error and none that counts.
  [[nodiscard]] Result<std::vector<Written>> append(std::span<const AuditEvent> events);
  // Removes the records from before `time`, and the identities that only they name. A record says so. Returns how many.
  [[nodiscard]] Result<std::size_t> remove_before(std::chrono::system_clock::time_point time);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  AuditLog(Disk& disk, std::filesystem::path file, std::shared_ptr<const SigningKeys> keys, Unfit unfit);
  // Learns where the log ends now. Under the lock, as all below.
  [[nodiscard]] Result<void> refresh();
  [[nodiscard]] Result<void> read_end(std::uint64_t size);
  [[nodiscard]] Result<void> replace(const std::string& why);  // as `unfit_` says
  void warn_of_loss() const;
  [[nodiscard]] Result<void> note_identity();
  [[nodiscard]] Result<std::vector<Written>> write(std::span<const AuditEvent> events);
  [[nodiscard]] Result<void> put_at_end(const std::string& lines);
  [[nodiscard]] Result<void> forget_unnamed();
  // Puts the bytes from one offset to another in place of the file.
  [[nodiscard]] Result<void> keep_only(std::uint64_t from, std::uint64_t to);

  Disk* disk_;
  std::filesystem::path file_;
  std::shared_ptr<const SigningKeys> keys_;  // shared with the journals
  Unfit unfit_;
  AuditPeople people_;
  std::optional<FileIdentity> seen_;     // the file as this object left it; its size: of the whole lines
  std::uint64_t sequence_ = 0;           // of the last record
  Digest last_;                          // hash of its line
  std::optional<AuditEvent> aside_;      // to be recorded with the next
  std::uint64_t unsure_ = 0;             // bytes after seen_->size that a failed write may have left
  bool opened_ = false, named_ = false;  // named_: the folder was synced since this made the file
};

// Removes a person's identities from beside a log; the records stay. Returns how many. Errors: those of the disk;
// unavailable, as above.
[[nodiscard]] Result<std::size_t> erase_person(Disk& disk, const std::filesystem::path& log, std::string_view person);

// What a retention record says: its detail, and that again.
struct AuditStart {
  std::uint64_t sequence = 0;  // of the first record that was kept
  Digest previous;             // hash of the line before it
  friend bool operator==(const AuditStart&, const AuditStart&) = default;
};
[[nodiscard]] std::string detail_of(const AuditStart& start);
[[nodiscard]] std::optional<AuditStart> start_of(const AuditRecord& record);  // nothing: it says no such thing

}  // namespace osteon
