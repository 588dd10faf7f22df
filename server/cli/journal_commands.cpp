#include "server/cli/journal_commands.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "common/core/bounded_text.hpp"
#include "common/field/kernel.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/progress.hpp"
#include "common/volume/case.hpp"
#include "common/volume/field_file.hpp"
#include "server/cli/audit_commands.hpp"
#include "server/cli/key_command.hpp"
#include "server/journal/journal_file.hpp"
#include "server/journal/maintenance.hpp"
#include "server/journal/signing.hpp"
#include "server/storage/journal_entries.hpp"
#include "server/storage/people_erasing.hpp"
#include "server/storage/room_files.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

struct JournalArguments {
  fs::path file, to, case_folder, fields;
  std::string name, key;
  fs::path signing_key;
  std::uint64_t at = 0;
  std::uint32_t person = 0;
  std::optional<int> days;
  bool branches = false, alone = false;
};

void say(const std::string& what, const std::string& value) {
  std::printf("%-12s %s\n", (what + ":").c_str(), bounded_text(value).c_str());
}
void say_unsigned() { say("note", "not signed: there is no signing.key beside the journal; give --signing-key FILE"); }

std::string text_of(const JournalHead& head) {
  return std::to_string(head.seq.value) + ", chain " + to_hex(head.chain).substr(0, 16);
}

// Reads a journal and writes nothing, neither to it nor beside it.
template <class Do>
auto with_journal(const fs::path& file, const Do& what) -> decltype(what(std::declval<Journal&>())) {
  Result<Journal> journal = Journal::open_to_read(file);
  if (!journal) return tl::unexpected(journal.error());
  return what(*journal);
}

// The key that signs changes: the given one, or the one in the journal's folder. Null: there is none.
Result<std::shared_ptr<const SigningKeys>> keys_for(const JournalArguments& given) {
  if (!given.signing_key.empty()) return load_signing_keys(given.signing_key);
  auto keys = load_signing_keys(folder_of(given.file) / kSigningKeyFile);
  if (!keys && keys.error().code == ErrorCode::not_found) return nullptr;
  return keys;
}

// Opens a journal, changes it and closes it, also after an error, so that its footer is valid again.
template <class Do>
auto change_journal(const JournalArguments& given, const Do& what) -> decltype(what(std::declval<Journal&>())) {
  Result<std::shared_ptr<const SigningKeys>> keys = keys_for(given);
  if (!keys) return tl::unexpected(keys.error());
  Result<Journal> journal = Journal::open(given.file, {.keys = std::move(*keys)});
  if (!journal) return tl::unexpected(journal.error());
  auto done = what(*journal);
  const Result<void> closed = journal->close();
  if (done && !closed) return tl::unexpected(closed.error());
  return done;
}

// The last event that is meant: that of --to, or the journal's last one if the journal confirms all of its own.
Result<RoomSeq> last_of(const Journal& journal, const JournalArguments& given) {
  const RoomSeq head = journal.head().seq;
  if (given.at == 0) return check_whole(journal, "--to").map([&] { return head; });
  const Error* closed = journal.closed_because();
  if (given.at > head.value)
    return failure(ErrorCode::invalid_input,
                   "--to " + std::to_string(given.at) + " lies beyond the last event of " + given.file.string() +
                       (closed != nullptr ? " that is confirmed, " : ", ") + std::to_string(head.value) +
                       (closed != nullptr ? ": " + closed->message : ""));
  if (closed != nullptr) say("fault", closed->message);
  return RoomSeq{given.at};
}

// Refuses a target file that the next opening would take for a part of the journal.
Result<void> check_apart(const fs::path& journal, const fs::path& to) {
  std::error_code ignored;
  if (!fs::equivalent(folder_of(journal), folder_of(to), ignored) || !belongs_to(journal, to.filename().string()))
    return {};
  return failure(ErrorCode::exists,
                 to.string() + " would belong to the journal " + journal.string() + " itself; give another name");
}

Error cannot_write(const fs::path& file, int reason) {
  return {ErrorCode::internal, "cannot write " + file.string() + ": " + std::generic_category().message(reason) +
                                   std::string(remedy_of(reason))};
}

// A new file under a name that does not exist yet. It is written beside its place and gets its name when it is
// complete. If it is dropped before, it leaves nothing.
class NewFile {
 public:
  static Result<NewFile> begin(const fs::path& file) {
    NewFile made(file);
    if (made.is_taken()) return made.taken();
    const int fd = ::open(made.partial_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0 && errno == EEXIST)
      return failure(ErrorCode::exists, "there is " + made.partial_.string() +
                                            ", which an export that was cut short may have "
                                            "left; remove it, or give another name than " +
                                            file.string());
    if (fd < 0 && errno == ENOENT)
      return failure(ErrorCode::not_found, "there is no folder " + folder_of(file).string() + "; make it first");
    if (fd < 0) return tl::unexpected(cannot_write(file, errno));
    made.out_ = ::fdopen(fd, "w");
    return made;
  }
  NewFile(NewFile&& from) noexcept
      : file_(std::move(from.file_)), partial_(std::move(from.partial_)), out_(std::exchange(from.out_, nullptr)) {}
  NewFile& operator=(NewFile&&) = delete;
  ~NewFile() {
    if (out_ == nullptr) return;
    std::fclose(out_);
    ::unlink(partial_.c_str());
  }

  [[nodiscard]] bool write(const std::string& line) {
    return std::fwrite(line.data(), 1, line.size(), out_) == line.size() && std::fputc('\n', out_) != EOF;
  }
  [[nodiscard]] Error failed() const { return cannot_write(file_, errno); }

  Result<void> finish() {
    if (std::fflush(out_) != 0 || ::fsync(::fileno(out_)) != 0) return tl::unexpected(failed());
    bool named = ::renameat2(AT_FDCWD, partial_.c_str(), AT_FDCWD, file_.c_str(), RENAME_NOREPLACE) == 0;
    // Some file systems have only the older way to avoid replacing a file.
    if (!named && errno == EINVAL)
      named = ::link(partial_.c_str(), file_.c_str()) == 0 && ::unlink(partial_.c_str()) == 0;
    if (!named && errno == EEXIST) return taken();
    if (!named) return tl::unexpected(failed());
    std::fclose(std::exchange(out_, nullptr));
    return {};
  }

 private:
  explicit NewFile(const fs::path& file) : file_(file), partial_(file.string() + std::string(kPartial)) {}
  [[nodiscard]] bool is_taken() const {
    std::error_code ignored;
    return fs::exists(fs::symlink_status(file_, ignored));
  }
  [[nodiscard]] tl::unexpected<Error> taken() const {
    return failure(ErrorCode::exists, "there is " + file_.string() + " already; give another name");
  }
  fs::path file_, partial_;
  std::FILE* out_ = nullptr;
};

// Replays the room up to the sequence number of --to, or completely.
Result<Room> replayed(const JournalArguments& given) {
  const Result<Case> bone = Case::load(given.case_folder);
  if (!bone) return tl::unexpected(bone.error());
  return with_journal(given.file, [&](Journal& journal) -> Result<Room> {
    const Result<RoomGenesis> genesis = genesis_from_bytes(journal.genesis());
    if (!genesis) return tl::unexpected(genesis.error());
    const Result<RoomSeq> last = last_of(journal, given);
    if (!last) return tl::unexpected(last.error());
    Result<Room> room = begin_room(*bone, *genesis, {});
    if (!room) return room;
    Progress progress("replay");
    Result<void> outcome;
    const Result<void> read = journal.read(RoomSeq{1}, [&](const JournalEntry& one) {
      if (one.seq > *last) return false;
      const Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
      outcome = entry ? room->replay(*entry) : Result<void>(tl::unexpected(entry.error()));
      progress.update(static_cast<double>(one.seq.value) / static_cast<double>(last->value));
      return outcome.has_value();
    });
    if (!outcome) return failure(outcome.error().code, given.file.string() + ": " + outcome.error().message);
    if (!read) return tl::unexpected(read.error());
    return room;
  });
}

std::string entries_text(RoomSeq from, RoomSeq to) {
  return std::to_string(from.value) + " to " + std::to_string(to.value);
}

// Says who signed what. Error invalid_input: the key does not vouch for everything.
Result<void> check_signatures(const VerifyReport& report, const JournalArguments& given, const PublicKey& key) {
  const Vouched vouched = vouched_by(key, report);
  const auto by = [&](const PublicKey& who) {
    return "by " + to_hex(who).substr(0, 16) + (who == key ? "" : ", an earlier or later key of this server");
  };
  for (const SignedRange& one : vouched.ranges) say("signed", entries_text(one.from, one.to) + " " + by(one.key));
  for (const SignedRange& one : vouched.by_others)
    say("not signed", entries_text(one.from, one.to) + " by this key, but by " + to_hex(one.key));
  for (const auto& [from, to] : vouched.by_nobody) say("not signed", entries_text(from, to) + " by anybody");
  for (const std::string& entry : vouched.other_seals) say("not signed", entry + " by this server");
  if (vouched.all()) return {};
  if (vouched.ranges.empty() && vouched.seals == 0) say("not signed", "anything by this server");
  return failure(ErrorCode::invalid_input,
                 given.file.string() + " fits together, but the key " + to_hex(key).substr(0, 16) +
                     " does not vouch for all of it; give the key of the server that wrote it, or "
                     "do not trust what is not signed");
}

Result<void> verify_file(const JournalArguments& given) {
  const Result<std::optional<PublicKey>> key =
      given.key.empty() ? Result<std::optional<PublicKey>>(std::nullopt)
                        : public_key_of(given.key).map([](const PublicKey& found) { return std::optional(found); });
  if (!key) return tl::unexpected(key.error());
  const Result<VerifyReport> report = verify_journal(given.file);
  if (!report) return tl::unexpected(report.error());
  say("events", text_of(report->head));
  say("witnessed", std::to_string(report->witnessed.value));
  say("closed", report->closed_cleanly ? "cleanly" : "not cleanly: the server was ended otherwise, or runs");
  for (const std::string& note : report->notes) say("note", note);
  for (const std::string& fault : report->faults) say("fault", fault);
  if (!report->sound())
    return failure(ErrorCode::invalid_input, given.file.string() + " is damaged; osteon-server salvage " +
                                                 given.file.string() + " NEW copies what can be confirmed");
  if (!given.case_folder.empty()) {
    const Result<Room> room = replayed(given);
    if (!room) return tl::unexpected(room.error());
    say("field hash", to_hex(room->field_hash()));
    say("room hash", to_hex(room->room_hash()));
  }
  if (*key) {
    if (const Result<void> vouched = check_signatures(*report, given, **key); !vouched) return vouched;
    say("verdict", "sound");
  } else {
    say("verdict", "unsigned: it fits together, but no signature was checked; give --key");
  }
  return {};
}

Result<void> salvage(const JournalArguments& given) {
  const Result<std::shared_ptr<const SigningKeys>> keys = keys_for(given);
  if (!keys) return tl::unexpected(keys.error());
  const Result<RecoverReport> report = salvage_journal(given.file, given.to, nullptr, {}, RoomSeq{given.at}, *keys);
  if (!report) return tl::unexpected(report.error());
  for (const std::string& fault : report->faults) say("fault", fault);
  if (!*keys) say_unsigned();
  say("recovered", text_of(report->head));
  if (report->lost() > 0) say("lost", std::to_string(report->lost()) + " events that were vouched for");
  say("new journal", given.to.string());
  return {};
}

Result<void> copy(const JournalArguments& given, decltype(backup_journal)* make) {
  return keys_for(given).and_then([&](const auto& keys) { return make(given.file, given.to, nullptr, keys); });
}

// Only older files of cut fields may be replaced. Checked before long work, and again before writing.
Result<void> check_fields_file(const JournalArguments& given) {
  const fs::path &file = given.fields, folder = folder_of(file);
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    return failure(ErrorCode::not_found,
                   "there is no folder " + folder.string() + " for --fields " + file.string() + "; make it first");
  if (::access(folder.c_str(), W_OK) != 0) return tl::unexpected(cannot_write(file, errno));
  if (const Result<void> apart = check_apart(given.file, file); !apart) return apart;
  if (!fs::exists(fs::symlink_status(file, ignored)) || load_fields(file)) return {};
  return failure(ErrorCode::exists, "there is " + file.string() +
                                        ", which is no file of fields, to be replaced by newer ones; "
                                        "give --fields another name");
}

Result<void> replay(const JournalArguments& given) {
  if (!given.fields.empty())
    if (const Result<void> may = check_fields_file(given); !may) return may;
  const Result<Room> room = replayed(given);
  if (!room) return tl::unexpected(room.error());
  say("events", std::to_string(room->room_seq().value));
  say("time", std::to_string(std::chrono::duration_cast<std::chrono::seconds>(room->time()).count()) + " s");
  for (const auto& [seq, label] : room->marks()) say("mark", std::to_string(seq.value) + " " + label);
  say("field hash", to_hex(room->field_hash()));
  say("room hash", to_hex(room->room_hash()));
  if (given.fields.empty()) return {};
  SavedFields saved;
  saved.case_hash = room->bone().hash();
  saved.kernel_version = kKernelVersion;
  saved.room_seq = room->room_seq();
  saved.pitch_mm = room->bone().pitch_mm();
  saved.bodies = room->bodies();
  for (const BodyId body : saved.bodies)
    std::ranges::move(room->find_field(body)->leaves(), std::back_inserter(saved.leaves));
  saved.items = room->items();
  const std::shared_ptr<ToolBox> built_in = builtin_tool_box();
  for (const ToolBox::Entry* entry : room->tools()->entries())
    if (!built_in->find(entry->hash)) saved.tools.push_back(entry->tool);
  if (const Result<void> may = check_fields_file(given); !may) return may;
  return save_fields(given.fields, saved);
}

Result<void> branch(const JournalArguments& given) {
  Progress progress("branch");
  const Result<JournalHead> made = branch_journal(given.file, given.to, RoomSeq{given.at}, given.to.stem().string(),
                                                  {[&](double fraction) { progress.update(fraction); }, {}});
  if (!made) return tl::unexpected(made.error());
  say("branch", given.to.string() + " of " + given.file.string() + " at " + std::to_string(made->seq.value));
  return {};
}

// The user must say what happens to its branches, since a deleted room cannot be restored.
Result<void> remove_journal(const JournalArguments& given) {
  const Result<std::vector<RoomFile>> branches = branches_of(folder_of(given.file), given.file);
  if (!branches && branches.error().code != ErrorCode::not_found) return tl::unexpected(branches.error());
  if (branches && !branches->empty() && !given.branches && !given.alone) {
    for (const RoomFile& branch : *branches) say("branch", branch.file.string());
    return failure(ErrorCode::invalid_input, given.file.string() +
                                                 " has branches, which hold what was cut in it; "
                                                 "say --branches or --alone");
  }
  const Result<std::vector<fs::path>> gone = delete_room(given.file, given.branches);
  if (!gone) return tl::unexpected(gone.error());
  for (const fs::path& file : *gone) say("deleted", file.string());
  say("not deleted", "backups, and branches in other folders: their places are not stored");
  return {};
}

// Writes one line of text for each event, of everybody or of one person.
Result<void> write_out(const JournalArguments& given) {
  if (const Result<void> apart = check_apart(given.file, given.to); !apart) return apart;
  Result<NewFile> out = NewFile::begin(given.to);
  if (!out) return tl::unexpected(out.error());
  return with_journal(given.file, [&](Journal& journal) -> Result<void> {
    const Result<RoomSeq> last = last_of(journal, given);
    if (!last) return tl::unexpected(last.error());
    std::optional<PersonExport> of_person;
    if (given.person != 0) {
      const Result<std::vector<Person>> people = journal.people();
      if (!people) return tl::unexpected(people.error());
      of_person.emplace(given.person, *people);
      if (of_person->who() && !out->write(*of_person->who())) return tl::unexpected(out->failed());
    }
    Result<void> outcome;
    std::uint64_t events = 0;
    const auto put = [&](const std::string& line) {
      ++events;
      if (!out->write(line)) outcome = tl::unexpected(out->failed());
    };
    const Result<void> read = journal.read(RoomSeq{1}, [&](const JournalEntry& entry) {
      if (entry.seq > *last) return false;
      if (of_person) {
        const Result<std::optional<std::string>> line = of_person->of(entry);
        if (!line)
          outcome = tl::unexpected(line.error());
        else if (*line)
          put(**line);
      } else {
        const Result<std::string> line = entry_as_json(entry.seq, std::chrono::nanoseconds(entry.at_ns), entry.bytes);
        if (!line)
          outcome = tl::unexpected(line.error());
        else
          put(*line);
      }
      return outcome.has_value();
    });
    if (!outcome) return outcome;
    if (!read) return read;
    if (of_person && !of_person->who() && events == 0) return of_person->nobody();
    if (const Result<void> named = out->finish(); !named) return named;
    say("events", std::to_string(events));
    return {};
  });
}

Result<void> list_people(const JournalArguments& given) {
  return with_journal(given.file, [](Journal& journal) -> Result<void> {
    const Result<std::vector<Person>> people = journal.people();
    if (!people) return tl::unexpected(people.error());
    for (const Person& person : *people) {
      const std::chrono::year_month_day day{std::chrono::sys_days{std::chrono::days{person.joined_day}}};
      std::printf("%s  %04d-%02u-%02u  %s\n", person.pseudonym.c_str(), static_cast<int>(day.year()),
                  static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()), person.label.c_str());
    }
    // If a journal has lost something, nobody knows whether the list is complete.
    if (const Error* closed = journal.closed_because()) return tl::unexpected(*closed);
    return {};
  });
}

// By number: erases that person in the audit log too, if the journal knows the name. By age: erases nobody there, since
// these people may work in other rooms.
Result<void> erase_in_audit_too(const JournalArguments& given, const std::vector<std::string>& names) {
  std::size_t erased = 0;
  for (const std::string& name : names) {
    const Result<std::size_t> gone = erase_person(system_disk(), folder_of(given.file) / kAuditLogFile, name);
    if (!gone) return tl::unexpected(gone.error());
    erased += *gone;
  }
  if (erased > 0)
    say("audit log", std::to_string(erased) + " identities erased (what they did stays, under pseudonyms)");
  return {};
}

Result<void> erase_from_journal(const JournalArguments& given) {
  if ((given.person == 0) == !given.days)
    return failure(ErrorCode::invalid_input,
                   "erase-person needs either --person NUMBER, as \"people\" lists it, or --older-than DAYS");
  const auto today = std::chrono::duration_cast<std::chrono::days>(std::chrono::system_clock::now().time_since_epoch());
  std::vector<std::string> names;
  const Result<void> done = change_journal(given, [&](Journal& journal) -> Result<void> {
    // Checked even if nobody is to be erased, since a name may be in entries that cannot be read.
    if (const Error* closed = journal.closed_because()) return tl::unexpected(*closed);
    const auto came_before = [&](const Person& person) {
      return given.days && person.joined_day < static_cast<std::int32_t>(today.count()) - *given.days;
    };
    const Result<ErasedPeople> erased = erase_people(journal, came_before, given.person);
    if (!erased) return tl::unexpected(erased.error());
    if (const Result<void> gone = erase_owner(given.file, *erased); !gone) return gone;
    if (given.person != 0 && erased->people == 0 && erased->entries == 0)
      return failure(ErrorCode::not_found, "nobody in " + given.file.string() + " has the number " +
                                               std::to_string(given.person) + "; \"people\" lists those it knows");
    say("erased", "the names of " + std::to_string(erased->people) + " people (what they did stays, under a number)");
    say("erased", "the words of " + std::to_string(erased->entries) + " events");
    say("not erased", "backups and branches made before: they have names and words, or words");
    if (given.person != 0) names = erased->names;
    return {};
  });
  return done.and_then([&] { return erase_in_audit_too(given, names); });
}

// The audit record of a command; nothing for commands that only read.
std::optional<AuditEvent> audited_as(const std::string& name, const JournalArguments& given) {
  if (name == "verify" || name == "people" || (name == "replay" && given.fields.empty())) return {};
  AuditEvent event{.action = name, .object = given.file.filename().string(), .result = kOk};
  if (!given.to.empty()) event.detail = "to " + given.to.filename().string();
  if (!given.fields.empty()) event.detail = "to " + given.fields.filename().string();
  if (!given.name.empty()) event.detail = "to " + given.name;
  if (given.person != 0) event.detail += " person " + std::to_string(given.person);
  if (given.days) event.detail += " older than " + std::to_string(*given.days) + " days";
  return event;
}

Result<void> run_command(const std::string& name, Result<void> (*run)(const JournalArguments&),
                         const JournalArguments& given) {
  std::optional<AuditEvent> event = audited_as(name, given);
  if (!event) return run(given);
  return run_audited(given.file, given.signing_key, std::move(*event), [&] { return run(given); });
}

// The file's name decides as which room a server serves it. So a new name must be given on purpose.
Result<void> rename_room(const JournalArguments& given) {
  return change_journal(given, [&](Journal& journal) -> Result<void> {
    if (const Error* closed = journal.closed_because()) return tl::unexpected(*closed);
    const Result<std::string> before = room_name(journal);
    if (!before) return tl::unexpected(before.error());
    if (const Result<void> named = journal.set_register(kNameRegister, given.name); !named) return named;
    say("renamed", *before + " to " + given.name);
    if (!journal.is_signed()) say_unsigned();
    return {};
  });
}

}  // namespace

void add_journal_commands(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<JournalArguments>();  // shared by the options and the function that runs
  const auto command = [&](const char* name, const char* what, Result<void> (*run)(const JournalArguments&)) {
    CLI::App* sub = app.add_subcommand(name, what);
    sub->add_option("file", given->file, "The journal; no server may have it open")->required();
    sub->callback(
        [&chosen, given, name, run] { chosen = [given, name, run] { return run_command(name, run, *given); }; });
    return sub;
  };
  const auto copies = [&](const char* name, const char* what, Result<void> (*run)(const JournalArguments&)) {
    CLI::App* sub = command(name, what, run);
    sub->add_option("new", given->to, "The file to make; nothing may be there")->required();
    return sub;
  };
  const auto signs = [&](CLI::App* sub) {
    sub->add_option("--signing-key", given->signing_key,
                    "The server's signing key; by default signing.key beside the journal, where that is there");
  };
  CLI::App* check =
      command("verify", "Checks every event, the checkpoints and the footer against the chain of hashes", verify_file);
  check->add_option("--case", given->case_folder, "Folder of the case: also replays the room and prints its hashes");
  check->add_option("--key", given->key,
                    "Public key of the server, as \"key show\" prints it: says which events were signed, and by whom");
  CLI::App* recovered = copies("salvage", "Copies what can be confirmed of a damaged journal into a new one", salvage);
  recovered->add_option("--to", given->at, "room_seq of the last event; all by default");
  signs(recovered);
  signs(copies("backup", "Copies a sound journal", [](const JournalArguments& a) { return copy(a, backup_journal); }));
  signs(copies("migrate", "Copies a journal of an earlier version into one of today's",
               [](const JournalArguments& a) { return copy(a, migrate_journal); }));
  CLI::App* branched = copies("branch", "Makes a new room from another one as it was at one event", branch);
  signs(branched);
  branched->add_option("--at", given->at, "room_seq of the last event that it takes over; all by default");
  CLI::App* again = command("replay", "Replays the room and prints its hashes, marks and time", replay);
  signs(again);
  again->add_option("--case", given->case_folder, "Folder of the case")->required();
  again->add_option("--to", given->at, "room_seq of the last event; all by default");
  again->add_option(
      "--fields", given->fields,
      "Writes the bone as it was then (.vdb), for --resume and osteon-import surface; replaces only earlier fields");
  CLI::App* lines = copies("export", "Writes each event as a line of JSON", write_out);
  signs(lines);
  lines->add_option("--person", given->person,
                    "Number of a person, as \"people\" lists it: exports only this person's data");
  lines->add_option("--to", given->at, "room_seq of the last event; all by default");
  command("people", "Lists the people whose numbers the events have", list_people);
  CLI::App* gone = command("erase-person", "Erases who people were; what they did stays", erase_from_journal);
  gone->add_option("--person", given->person, "Number of a person, as \"people\" lists it");
  gone->add_option("--older-than", given->days,
                   "Everybody who joined more than this many days ago; 0: everybody who joined before today")
      ->check(CLI::Range(0, 36500));
  signs(gone);
  CLI::App* renamed =
      command("rename-room", "Gives a room another name, which its file must have to be served", rename_room);
  renamed->add_option("name", given->name, "The new name: that of the file, without .journal")->required();
  signs(renamed);
  CLI::App* end = command("delete", "Removes a room: its journal and all files beside it", remove_journal);
  signs(end);
  CLI::Option* too = end->add_flag("--branches", given->branches, "And its branches in the same folder, and theirs");
  end->add_flag("--alone", given->alone, "Its branches stay")->excludes(too);
}

}  // namespace osteon
