// The people behind the pseudonyms of an audit log. They are in a file beside the log, so that a person can be erased
// without changing the log. A pseudonym is a salted hash of the identity. So the log confirms an identity while the
// file has it, and says nothing about the person once it is erased.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/audit/audit_record.hpp"

namespace osteon {

struct AuditPerson {
  std::string pseudonym;  // 32 hexadecimal digits
  std::string salt;       // 32 hexadecimal digits, random
  AuditIdentity who;
  // Whether the pseudonym is that of this identity.
  [[nodiscard]] bool fits() const;
};

// "audit.people" beside a log, whether the log is named "audit.log" or "audit.log.20261125".
[[nodiscard]] std::filesystem::path people_file_of(const std::filesystem::path& log);
// The people in the file; none if the file is missing. Unreadable lines are skipped and counted in `unreadable`.
// Errors: those of Disk::read.
[[nodiscard]] Result<std::vector<AuditPerson>> read_people(Disk& disk, const std::filesystem::path& file,
                                                           std::size_t* unreadable = nullptr);
// Whether the identity is that of the person, even if it was only claimed.
[[nodiscard]] bool is_of(const AuditIdentity& who, std::string_view person);

// Writes the file. Not thread safe. Other processes may write the file between two calls of refresh().
class AuditPeople {
 public:
  static constexpr std::size_t kMost = 65536;  // identities in memory; any more get new pseudonyms
  AuditPeople(Disk& disk, std::filesystem::path file) : disk_(&disk), file_(std::move(file)) {}
  // Reads the file if it is not as this object left it. Removes unreadable lines.
  [[nodiscard]] Result<void> refresh();
  // The same pseudonym for the same identity, even before save(); "" for an empty identity. Call it after refresh().
  [[nodiscard]] std::string pseudonym(const AuditIdentity& who);
  // Writes the new identities durably to the file. May be repeated after an error.
  [[nodiscard]] Result<void> save();
  // Removes all for which `gone` is true from the file. Returns their number. Call it after save().
  [[nodiscard]] Result<std::size_t> erase_if(const std::function<bool(const AuditPerson&)>& gone);

 private:
  Disk* disk_;
  std::filesystem::path file_;
  std::optional<FileIdentity> seen_;  // the file as this object left it
  std::string waiting_;               // lines that are not yet in it
  bool failed_ = false;               // whether the last save() failed
  std::map<AuditIdentity, std::string> known_;
};

}  // namespace osteon
