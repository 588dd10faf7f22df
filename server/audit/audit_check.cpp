#include "server/audit/audit_check.hpp"

#include <map>
#include <set>
#include <utility>

#include "server/audit/audit_log.hpp"

namespace osteon {
namespace {

// Why the record cannot follow the one before it.
std::optional<std::string> gap(const AuditRecord& record, const AuditReport& before) {
  const std::uint64_t due = before.last + 1;
  if (record.sequence > due)
    return std::to_string(record.sequence - due) + " records are missing before it: it has the number " +
           std::to_string(record.sequence) + " instead of " + std::to_string(due);
  if (record.sequence < due)
    return "it is repeated or out of order: it has the number " + std::to_string(record.sequence) + " instead of " +
           std::to_string(due);
  if (record.previous != before.last_hash) return "it does not follow on the line before it, which was replaced";
  return {};
}

class Verifier {
 public:
  Verifier(const std::function<bool(const PublicKey&)>& trusts, const std::optional<Digest>& expected)
      : trusts_(trusts), expected_(expected) {}

  // False: the line is at fault.
  bool take(std::string_view line) {
    ++lines_;
    if (const auto why = judge(line)) report_.fault = "line " + std::to_string(lines_) + ": " + *why;
    return report_.sound();
  }
  AuditReport finish(std::uint64_t rest) {
    if (rest > 0)
      report_.notes.push_back("the last line is incomplete, " + std::to_string(rest) +
                              " bytes: its writer was killed or is still writing; the server removes it");
    if (!report_.sound()) return std::move(report_);
    if (report_.records == 0)
      report_.fault = "there is no record in it; a log has at least that of the server's start";
    else if (!starts_well())
      report_.fault = "line 1: all records before number " + std::to_string(report_.first) +
                      " are missing, and no record says that they were removed because of their age";
    else if (expected_ && !found_)
      report_.fault = "no line has the hash " + to_hex(*expected_) + ": records are missing after line " +
                      std::to_string(lines_) + ", or it is another log's";
    return std::move(report_);
  }

 private:
  std::optional<std::string> judge(std::string_view line) {
    const Result<AuditRecord> record = decode_record(line);
    if (!record) return record.error().message;
    if (!trusts_(record->key)) return "it is signed by an unknown key, " + to_hex(record->key);
    if (report_.records == 0) {
      report_.first = record->sequence;
      begins_ = {record->sequence, record->previous};
    } else if (auto why = gap(*record, report_)) {
      return why;
    }
    if (const auto start = start_of(*record)) starts_.push_back(*start);
    ++report_.records;
    report_.last = record->sequence;
    report_.last_hash = hash_of_line(line);
    found_ = found_ || (expected_ && report_.last_hash == *expected_);
    return {};
  }
  [[nodiscard]] bool starts_well() const {
    if (begins_ == AuditStart{.sequence = 1, .previous = {}}) return true;
    for (const AuditStart& start : starts_)
      if (start == begins_) return true;
    return false;
  }

  const std::function<bool(const PublicKey&)>& trusts_;
  const std::optional<Digest>& expected_;
  AuditReport report_;
  AuditStart begins_;
  std::vector<AuditStart> starts_;  // those that retention records name
  std::uint64_t lines_ = 0;
  bool found_ = false;
};

}  // namespace

Result<AuditReport> verify_audit(Disk& disk, const std::filesystem::path& file,
                                 const std::function<bool(const PublicKey&)>& trusts,
                                 const std::optional<Digest>& expected) {
  Verifier verifier(trusts, expected);
  const auto rest =
      for_each_line(disk, file, [&](std::string_view line, std::uint64_t) { return verifier.take(line); });
  if (!rest) return tl::unexpected(rest.error());
  AuditReport report = verifier.finish(*rest);
  std::size_t unreadable = 0;
  const auto people = read_people(disk, people_file_of(file), &unreadable);
  if (!people) return tl::unexpected(people.error());
  std::size_t wrong = unreadable;
  for (const AuditPerson& one : *people) wrong += one.fits() ? 0 : 1;
  if (wrong > 0)
    report.notes.push_back(std::to_string(wrong) + " lines of " + people_file_of(file).string() +
                           " do not fit their pseudonyms, and count as erased");
  return report;
}

Result<std::size_t> read_audit(Disk& disk, const std::filesystem::path& file,
                               const std::function<void(const AuditEntry&)>& take) {
  const auto people = read_people(disk, people_file_of(file));
  if (!people) return tl::unexpected(people.error());
  std::map<std::string, AuditIdentity> known;
  for (const AuditPerson& one : *people)
    if (one.fits()) known.emplace(one.pseudonym, one.who);
  std::size_t unreadable = 0;
  const auto show = [&](std::string_view line, std::uint64_t) {
    const Result<AuditRecord> record = decode_record(line);
    if (!record) {
      ++unreadable;
      return true;
    }
    const auto who = known.find(record->identity);
    take({.record = *record,
          .who = who == known.end() ? AuditIdentity{} : who->second,
          .is_erased = !record->identity.empty() && who == known.end()});
    return true;
  };
  return for_each_line(disk, file, show).map([&](std::uint64_t) { return unreadable; });
}

}  // namespace osteon
