// Who the pseudonyms of an audit log stand for: a file beside it, so that a person can be erased without a change of
// the log. A pseudonym is a salted hash of the identity. So the log confirms an entry as long as the entry is there,
// and says nothing about the person once it is erased.
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

// "audit.people" beside a log, whether it is named "audit.log" or "audit.log.20261125".
[[nodiscard]] std::filesystem::path people_file_of(const std::filesystem::path& log);
// The entries of the file; none where it is missing. A line that cannot be read is left out and counted in
// `unreadable`. Errors: those of Disk::read.
[[nodiscard]] Result<std::vector<AuditPerson>> read_people(Disk& disk, const std::filesystem::path& file,
                                                           std::size_t* unreadable = nullptr);
// Whether the identity is of that person, also where it was only claimed.
[[nodiscard]] bool is_of(const AuditIdentity& who, std::string_view person);

// Writes the file. Not thread safe; other processes may write the file between two calls of refresh().
class AuditPeople {
 public:
  static constexpr std::size_t kMost = 65536;  // identities in memory; beyond, they get new pseudonyms
  AuditPeople(Disk& disk, std::filesystem::path file) : disk_(&disk), file_(std::move(file)) {}
  // Reads the file where it is not as this object left it. Takes lines away that cannot be read.
  [[nodiscard]] Result<void> refresh();
  // The same for the same identity, also before save(); "" for one that is empty. After refresh().
  [[nodiscard]] std::string pseudonym(const AuditIdentity& who);
  // Puts those that are new into the file, safely on the disk. May be tried again after an error.
  [[nodiscard]] Result<void> save();
  // Takes all for which `gone` is true out of the file. Returns how many. After save().
  [[nodiscard]] Result<std::size_t> erase_if(const std::function<bool(const AuditPerson&)>& gone);

 private:
  Disk* disk_;
  std::filesystem::path file_;
  std::optional<FileIdentity> seen_;  // the file as this object left it
  std::string waiting_;               // lines that are not yet in it
  bool failed_ = false;               // the last save()
  std::map<AuditIdentity, std::string> known_;
};

}  // namespace osteon
