// The audit log on the disk: "audit.log", one record per line, with "audit.people" and "audit.lock" beside it. Only
// their owner may read these files. Several processes may append to one log, for example a server and a command. Each
// holds the lock while it does so.
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

// Default name, in the folder of the journals.
inline constexpr const char* kAuditLogFile = "audit.log";

// Not thread safe. A call may be repeated after an error. Errors: those of the disk; unavailable (another process held
// the lock for five seconds).
class AuditLog {
 public:
  // What to do with a log whose last record is damaged, or signed by another server's key. A server renames it, reports
  // this in its log and in the new audit log, and begins a new one. A command refuses with invalid_input.
  enum class Unfit { set_aside, refuse };
  [[nodiscard]] static Result<AuditLog> open(Disk& disk, std::filesystem::path file,
                                             std::shared_ptr<const SigningKeys> keys, Unfit unfit);

  struct Written {
    AuditRecord record;
    Digest hash;  // of its line
  };
  // Appends all events durably; after an error none of them counts.
  [[nodiscard]] Result<std::vector<Written>> append(std::span<const AuditEvent> events);
  // Removes the records before `time`, and the identities that only these name. A record says so. Returns the number of
  // removed records.
  [[nodiscard]] Result<std::size_t> remove_before(std::chrono::system_clock::time_point time);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  AuditLog(Disk& disk, std::filesystem::path file, std::shared_ptr<const SigningKeys> keys, Unfit unfit);
  // Finds the present end of the log. This function and all below need the lock.
  [[nodiscard]] Result<void> refresh();
  [[nodiscard]] Result<void> read_end(std::uint64_t size);
  [[nodiscard]] Result<void> replace(const std::string& why);  // as `unfit_` says
  void warn_of_loss() const;
  [[nodiscard]] Result<void> note_identity();
  [[nodiscard]] Result<std::vector<Written>> write(std::span<const AuditEvent> events);
  [[nodiscard]] Result<void> put_at_end(const std::string& lines);
  [[nodiscard]] Result<void> forget_unnamed();
  // Replaces the file by its bytes from one offset to another.
  [[nodiscard]] Result<void> keep_only(std::uint64_t from, std::uint64_t to);

  Disk* disk_;
  std::filesystem::path file_;
  std::shared_ptr<const SigningKeys> keys_;  // shared with the journals
  Unfit unfit_;
  AuditPeople people_;
  std::optional<FileIdentity> seen_;     // the file as this object left it, with the size of its complete lines
  std::uint64_t sequence_ = 0;           // of the last record
  Digest last_;                          // hash of its line
  std::optional<AuditEvent> aside_;      // to be recorded with the next events
  std::uint64_t unsure_ = 0;             // bytes after seen_->size that a failed write may have left
  bool opened_ = false, named_ = false;  // named_: the folder was synced since this object made the file
};

// Removes a person's identities from the file beside a log; the records stay. Returns the number of removed identities.
// Errors: those of the disk; unavailable, as above.
[[nodiscard]] Result<std::size_t> erase_person(Disk& disk, const std::filesystem::path& log, std::string_view person);

// The content of a retention record. The functions convert it to the record's detail and back.
struct AuditStart {
  std::uint64_t sequence = 0;  // of the first record that was kept
  Digest previous;             // hash of the line before it
  friend bool operator==(const AuditStart&, const AuditStart&) = default;
};
[[nodiscard]] std::string detail_of(const AuditStart& start);
[[nodiscard]] std::optional<AuditStart> start_of(const AuditRecord& record);  // nothing: the record is not one

}  // namespace osteon
