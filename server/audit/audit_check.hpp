// Reads an audit log and reports whether it is complete and unchanged: "osteon-server audit verify" and "show".
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/audit/audit_people.hpp"
#include "server/audit/audit_record.hpp"

namespace osteon {

struct AuditReport {
  std::uint64_t records = 0, first = 0, last = 0;  // first, last: sequence numbers
  Digest last_hash;                                // of the last line
  std::optional<std::string> fault;  // names the first line that is not as it was written; nothing: there is none
  std::vector<std::string> notes;    // findings that are no fault of the log, one sentence each
  [[nodiscard]] bool sound() const { return !fault; }
};

// The log alone cannot show that records are missing at its end, because the rest is still correct. `expected` can: it
// is the hash of a record as the system's log has it, and must be the hash of some line.
// `trusts`: whether a key is the server's. Errors: those of Disk::read; invalid_input (not an audit log).
[[nodiscard]] Result<AuditReport> verify_audit(Disk& disk, const std::filesystem::path& file,
                                               const std::function<bool(const PublicKey&)>& trusts,
                                               const std::optional<Digest>& expected = {});

// A record in the form that people read.
struct AuditEntry {
  AuditRecord record;
  AuditIdentity who;       // as far as it is known
  bool is_erased = false;  // the person behind the pseudonym was erased
};
// Reads all records in order. Returns the number of lines that are not records; verify_audit() names the first. Errors
// as there.
[[nodiscard]] Result<std::size_t> read_audit(Disk& disk, const std::filesystem::path& file,
                                             const std::function<void(const AuditEntry&)>& take);

}  // namespace osteon
