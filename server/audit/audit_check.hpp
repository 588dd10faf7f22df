// Reads an audit log and says whether it is whole: "osteon-server audit verify" and "show".
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
  std::optional<std::string> fault;  // names the first line that is not as it was written; nothing: all are
  std::vector<std::string> notes;    // what is no fault of the log, one sentence each
  [[nodiscard]] bool sound() const { return !fault; }
};

// Nobody can see that records are missing at the end: the log before them was whole as well. `expected`, the hash of a
// record as the system's log has it, shows that: it must be the hash of some line.
// `trusts`: whether a key is the server's. Errors: those of Disk::read; invalid_input (it is no log).
[[nodiscard]] Result<AuditReport> verify_audit(Disk& disk, const std::filesystem::path& file,
                                               const std::function<bool(const PublicKey&)>& trusts,
                                               const std::optional<Digest>& expected = {});

// A record as people read it.
struct AuditEntry {
  AuditRecord record;
  AuditIdentity who;       // as far as it is known
  bool is_erased = false;  // nobody knows any more whose pseudonym it is
};
// All records in order. Returns how many lines are none: verify_audit() names the first. Errors as there.
[[nodiscard]] Result<std::size_t> read_audit(Disk& disk, const std::filesystem::path& file,
                                             const std::function<void(const AuditEntry&)>& take);

}  // namespace osteon
