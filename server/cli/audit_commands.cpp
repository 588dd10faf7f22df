#include "server/cli/audit_commands.hpp"

#include <pwd.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/audit/audit_check.hpp"
#include "server/cli/key_command.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

struct AuditArguments {
  fs::path file, signing_key;
  std::vector<std::string> keys;
  std::string expected, person, room, since;
  bool json = false;
};

std::string system_user() {
  const passwd* user = ::getpwuid(::geteuid());
  return "system:" + (user != nullptr ? std::string(user->pw_name) : std::to_string(::geteuid()));
}

// Accepts keys of the servers that --key names, or of the one whose signing.key lies beside the log.
Result<std::function<bool(const PublicKey&)>> trusted(const AuditArguments& given) {
  std::vector<std::string> names = given.keys;
  if (names.empty()) names.push_back(folder_of(given.file) / kSigningKeyFile);
  std::vector<std::function<bool(const PublicKey&)>> all;
  for (const std::string& name : names) {
    if (const auto keys = load_signing_keys(name)) {
      all.emplace_back([line = *keys](const PublicKey& key) { return line->trusts(key); });
      continue;
    }
    const Result<PublicKey> one = public_key_of(name);
    if (!one && given.keys.empty())
      return failure(ErrorCode::not_found, "there is no " + name + " that says whose signatures are good; give --key");
    if (!one) return tl::unexpected(one.error());
    all.emplace_back([single = *one](const PublicKey& key) { return key == single; });
  }
  return
      [all](const PublicKey& key) { return std::ranges::any_of(all, [&](const auto& trusts) { return trusts(key); }); };
}

Result<void> verify_file(const AuditArguments& given) {
  const auto trusts = trusted(given);
  if (!trusts) return tl::unexpected(trusts.error());
  std::optional<Digest> expected;
  if (!given.expected.empty()) {
    const Result<Digest> hash = digest_from_hex(given.expected);
    if (!hash) return failure(ErrorCode::invalid_input, "--expect-last is not 64 hexadecimal digits");
    expected = *hash;
  }
  const Result<AuditReport> report = verify_audit(system_disk(), given.file, *trusts, expected);
  if (!report) return tl::unexpected(report.error());
  for (const std::string& note : report->notes) std::printf("note:      %s\n", note.c_str());
  if (!report->sound()) return failure(ErrorCode::invalid_input, given.file.string() + ": " + *report->fault);
  std::printf("records:   %llu, number %llu to %llu\nlast hash: %s\nverdict:   sound%s\n",
              static_cast<unsigned long long>(report->records), static_cast<unsigned long long>(report->first),
              static_cast<unsigned long long>(report->last), to_hex(report->last_hash).c_str(),
              expected ? "" : "; whether records are missing at the end, only --expect-last can tell");
  return {};
}

std::string who_text(const AuditEntry& entry) {
  if (entry.record.identity.empty()) return "the server";
  if (entry.is_erased) return "somebody who was erased, " + entry.record.identity;
  const AuditIdentity& who = entry.who;
  std::string text = who.person.empty() ? "somebody unknown" : who.person;
  if (!who.certificate.empty()) text += ", certificate " + who.certificate;
  if (!who.ticket.empty()) text += ", ticket " + who.ticket;
  if (!who.address.empty()) text += ", from " + who.address;
  return text;
}

void print_entry(const AuditEntry& entry) {
  const AuditRecord& record = entry.record;
  std::string line = record.time + "  " + record.action;
  if (!record.object.empty()) line += " " + record.object;
  line += ": " + record.result;
  if (!record.detail.empty()) line += " (" + record.detail + ")";
  std::printf("%s  by %s\n", line.c_str(), who_text(entry).c_str());
}

void print_json(const AuditEntry& entry) {
  const AuditRecord& record = entry.record;
  const nlohmann::ordered_json fields{{"sequence", record.sequence}, {"time", record.time},
                                      {"person", entry.who.person},  {"certificate", entry.who.certificate},
                                      {"ticket", entry.who.ticket},  {"address", entry.who.address},
                                      {"identity", record.identity}, {"erased", entry.is_erased},
                                      {"action", record.action},     {"object", record.object},
                                      {"result", record.result},     {"detail", record.detail}};
  std::printf("%s\n", fields.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace).c_str());
}

Result<void> show_audit(const AuditArguments& given) {
  std::string since = given.since;
  if (since.ends_with('Z')) since.pop_back();  // a time with more digits is later than one with fewer
  if (since.find_first_not_of("0123456789-:.T") != std::string::npos || (!since.empty() && since.size() < 10))
    return failure(ErrorCode::invalid_input,
                   "--since " + given.since + " is no time; write 2026-11-25 or 2026-11-25T12:00:00Z, in UTC");
  const auto unreadable = read_audit(system_disk(), given.file, [&](const AuditEntry& entry) {
    if (!given.person.empty() && !is_of(entry.who, given.person)) return;
    if (!given.room.empty() && entry.record.object != given.room) return;
    if (entry.record.time < since) return;
    given.json ? print_json(entry) : print_entry(entry);
  });
  if (!unreadable) return tl::unexpected(unreadable.error());
  if (*unreadable == 0) return {};
  return failure(ErrorCode::invalid_input, std::to_string(*unreadable) + " lines of " + given.file.string() +
                                               " are no records; \"osteon-server audit verify\" names the first");
}

Result<void> erase_from_audit(const AuditArguments& given) {
  const AuditEvent event{.action = "audit-erase-person", .result = kOk};
  return run_audited(given.file, given.signing_key, event, [&]() -> Result<void> {
    const Result<std::size_t> gone = erase_person(system_disk(), given.file, given.person);
    if (!gone) return tl::unexpected(gone.error());
    if (*gone == 0)
      return failure(ErrorCode::not_found, given.file.string() + " has no person of the name " + given.person);
    std::printf("erased: %zu identities (what they did stays, under pseudonyms)\n", *gone);
    return {};
  });
}

}  // namespace

void record_beside(const fs::path& file, const fs::path& signing_key, AuditEvent event) {
  const fs::path log = folder_of(file) / kAuditLogFile;
  if (const auto there = system_disk().identity(log); there && !*there) return;
  event.who.person = system_user();
  const auto written =
      load_signing_keys(signing_key.empty() ? folder_of(file) / kSigningKeyFile : signing_key)
          .and_then([&](const auto& keys) { return AuditLog::open(system_disk(), log, keys, AuditLog::Unfit::refuse); })
          .and_then([&](AuditLog&& opened) {
            return opened.append({&event, 1});
          });
  if (!written)
    std::fprintf(stderr, "note: this is not recorded in %s: %s\n", log.c_str(), written.error().message.c_str());
}

Result<void> run_audited(const fs::path& file, const fs::path& signing_key, AuditEvent event,
                         const std::function<Result<void>()>& command) {
  const Result<void> outcome = command();
  event.result = outcome ? kOk : kFailed;
  record_beside(file, signing_key, std::move(event));
  return outcome;
}

void add_audit_commands(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<AuditArguments>();  // shared by the options and the function that runs
  CLI::App* audit = app.add_subcommand("audit", "Checks or shows who did what on a server, or erases who somebody was");
  audit->require_subcommand(1);
  const auto command = [&](const char* name, const char* what, Result<void> (*run)(const AuditArguments&)) {
    CLI::App* sub = audit->add_subcommand(name, what);
    sub->add_option("file", given->file, "The audit log: audit.log beside the journals")->required();
    sub->callback([&chosen, given, run] { chosen = [given, run] { return run(*given); }; });
    return sub;
  };
  CLI::App* check = command(
      "verify", "Names the first record that was changed, is missing, or is signed by another key", verify_file);
  check->add_option(
      "--key", given->keys,
      "Public key of the server, as \"key show\" prints it, or its signing key; by default signing.key beside the log");
  check->add_option("--expect-last", given->expected,
                    "Hash of a record, as the system's log has it: says whether records are missing at the end");
  CLI::App* shown = command("show", "Prints the records, and who it was as far as that is known", show_audit);
  shown->add_option("--person", given->person, "Only what this person did, or somebody who claimed to be them");
  shown->add_option("--room", given->room, "Only what was done to this room");
  shown->add_option("--since", given->since, "Only from this time on, in UTC: 2026-11-25 or 2026-11-25T12:00:00Z");
  shown->add_flag("--json", given->json, "A line of JSON for each record");
  CLI::App* gone =
      command("erase-person", "Erases who a person was; what they did stays, under a pseudonym", erase_from_audit);
  gone->add_option("--person", given->person, "Name in the certificate")->required();
  gone->add_option("--signing-key", given->signing_key,
                   "The server's signing key; by default signing.key beside the log");
}

}  // namespace osteon
