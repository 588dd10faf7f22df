#include "server/app/journal_commands.hpp"

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "common/field/kernel.hpp"
#include "common/runtime/progress.hpp"
#include "common/volume/case.hpp"
#include "common/volume/field_file.hpp"
#include "server/journal/upkeep.hpp"
#include "server/net/journal_rows.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  fs::path file, to, case_folder, fields;
  std::uint64_t at = 0;
  std::string person;
  int days = 0;
};

void say(const std::string& what, const std::string& value) { std::printf("%-12s %s\n", (what + ":").c_str(), value.c_str()); }

std::string text_of(const JournalHead& head) { return std::to_string(head.place.value) + ", chain " + to_hex(head.chain).substr(0, 16); }

// Makes the room again up to a place, 0 for all of it.
Result<Room> replayed(const fs::path& file, const fs::path& case_folder, std::uint64_t to) {
  const Result<Case> bone = Case::load(case_folder);
  if (!bone) return tl::unexpected(bone.error());
  Result<Journal> journal = Journal::open(file);
  if (!journal) return tl::unexpected(journal.error());
  const Result<RoomGenesis> genesis = genesis_from_bytes(journal->genesis());
  if (!genesis) return tl::unexpected(genesis.error());
  Result<Room> room = begin_room(*bone, *genesis, {});
  if (!room) return room;
  const std::uint64_t last = to == 0 ? journal->head().place.value : to;
  if (last > journal->head().place.value)
    return failure(ErrorCode::invalid_input, "--to " + std::to_string(last) + " lies beyond the last event of " + file.string() + ", " +
                                                 std::to_string(journal->head().place.value));
  Progress progress("replay");
  Result<void> outcome;
  const Result<void> read = journal->read(RoomSeq{1}, [&](const JournalRow& one) {
    if (one.place.value > last) return false;
    const Result<RoomRow> row = row_from_bytes(one.place, std::chrono::nanoseconds(one.at_ns), one.bytes);
    outcome = row ? room->replay(*row) : Result<void>(tl::unexpected(row.error()));
    progress.update(static_cast<double>(one.place.value) / static_cast<double>(last));
    return outcome.has_value();
  });
  if (!outcome) return failure(outcome.error().code, file.string() + ": " + outcome.error().message);
  if (!read) return tl::unexpected(read.error());
  return room;
}

Result<void> verify(const Arguments& given) {
  const Result<VerifyReport> report = verify_journal(given.file);
  if (!report) return tl::unexpected(report.error());
  say("events", text_of(report->head));
  say("witnessed", std::to_string(report->witnessed.value));
  say("closed", report->closed_cleanly ? "cleanly" : "not cleanly: the server was ended otherwise, or runs");
  for (const std::string& fault : report->faults) say("fault", fault);
  if (!report->sound())
    return failure(ErrorCode::invalid_input, given.file.string() + " is damaged; osteon-server recover " + given.file.string() +
                                                 " NEW copies what can be confirmed");
  if (!given.case_folder.empty()) {
    const Result<Room> room = replayed(given.file, given.case_folder, 0);
    if (!room) return tl::unexpected(room.error());
    say("field hash", to_hex(room->field_hash()));
    say("room hash", to_hex(room->room_hash()));
  }
  say("verdict", "sound");
  return {};
}

Result<void> recover(const Arguments& given) {
  const Result<RecoverReport> report = recover_journal(given.file, given.to);
  if (!report) return tl::unexpected(report.error());
  for (const std::string& fault : report->faults) say("fault", fault);
  say("recovered", text_of(report->head));
  if (report->lost() > 0) say("lost", std::to_string(report->lost()) + " events that were vouched for");
  say("new journal", given.to.string());
  return {};
}

Result<void> replay(const Arguments& given) {
  const Result<Room> room = replayed(given.file, given.case_folder, given.at);
  if (!room) return tl::unexpected(room.error());
  say("events", std::to_string(room->room_seq().value));
  say("time", std::to_string(std::chrono::duration_cast<std::chrono::seconds>(room->time()).count()) + " s");
  for (const auto& [place, label] : room->marks()) say("mark", std::to_string(place.value) + " " + label);
  say("field hash", to_hex(room->field_hash()));
  say("room hash", to_hex(room->room_hash()));
  if (given.fields.empty()) return {};
  SavedFields saved;
  saved.case_hash = room->bone().hash();
  saved.kernel_version = kKernelVersion;
  saved.room_seq = room->room_seq();
  saved.pitch_mm = room->bone().pitch_mm();
  saved.bodies = room->bodies();
  for (const BodyId body : saved.bodies) std::ranges::move(room->find_field(body)->leaves(), std::back_inserter(saved.leaves));
  saved.items = room->items();
  const std::shared_ptr<ToolBox> built_in = builtin_tool_box();
  for (const ToolBox::Entry* entry : room->tools()->entries())
    if (!built_in->find(entry->hash)) saved.tools.push_back(entry->tool);
  return save_fields(given.fields, saved);
}

// A room of its own that begins with all that another one was up to a place.
Result<void> branch(const Arguments& given) {
  Result<Journal> from = Journal::open(given.file);
  if (!from) return tl::unexpected(from.error());
  Result<RoomGenesis> genesis = genesis_from_bytes(from->genesis());
  if (!genesis) return tl::unexpected(genesis.error());
  const std::uint64_t last = given.at == 0 ? from->head().place.value : given.at;
  if (last > from->head().place.value)
    return failure(ErrorCode::invalid_input, "--at " + std::to_string(last) + " lies beyond the last event of " + given.file.string());
  genesis->parent = genesis->room;
  genesis->parent_room_seq = RoomSeq{last};
  genesis->room = given.to.stem().string();
  std::vector<JournalRow> rows;
  JournalHead head = first_head(from->genesis());
  const Result<void> read = from->read(RoomSeq{1}, [&](const JournalRow& row) {
    if (row.place.value > last) return false;
    rows.push_back(row);
    head = next_head(head, row);
    return true;
  });
  if (!read) return read;
  genesis->parent_chain = head.chain;
  Result<Journal> made = Journal::create(given.to, to_bytes(*genesis));
  if (!made) return tl::unexpected(made.error());
  if (Result<void> copied = made->append(rows); !copied) return copied;
  say("branch", given.to.string() + " of " + genesis->parent + " at " + std::to_string(last));
  return made->close();
}

// One line of text for each event.
Result<void> write_out(const Arguments& given) {
  Result<Journal> journal = Journal::open(given.file);
  if (!journal) return tl::unexpected(journal.error());
  std::ofstream out(given.to);
  if (!out) return failure(ErrorCode::internal, "cannot write " + given.to.string() + "; give another file");
  Result<void> outcome;
  const Result<void> read = journal->read(RoomSeq{1}, [&](const JournalRow& row) {
    const Result<std::string> text = row_as_json(row.place, std::chrono::nanoseconds(row.at_ns), row.bytes);
    if (text) out << *text << '\n';
    else outcome = tl::unexpected(text.error());
    return outcome.has_value() && out.good();
  });
  if (!outcome) return outcome;
  if (!read) return read;
  if (!out.flush()) return failure(ErrorCode::internal, "cannot write all of " + given.to.string() + "; is the disk full?");
  say("events", std::to_string(journal->head().place.value));
  return {};
}

Result<void> list_people(const Arguments& given) {
  Result<Journal> journal = Journal::open(given.file);
  if (!journal) return tl::unexpected(journal.error());
  const Result<std::vector<Person>> people = journal->people();
  if (!people) return tl::unexpected(people.error());
  for (const Person& person : *people) {
    const std::chrono::year_month_day day{std::chrono::sys_days{std::chrono::days{person.joined_day}}};
    std::printf("%s  %04d-%02u-%02u  %s\n", person.pseudonym.c_str(), static_cast<int>(day.year()),
                static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()), person.label.c_str());
  }
  return {};
}

Result<void> forget(const Arguments& given) {
  if (given.person.empty() == (given.days == 0))
    return failure(ErrorCode::invalid_input, "forget needs either --person NUMBER, as \"people\" lists it, or --older-than DAYS");
  Result<Journal> journal = Journal::open(given.file);
  if (!journal) return tl::unexpected(journal.error());
  const auto today = std::chrono::duration_cast<std::chrono::days>(std::chrono::system_clock::now().time_since_epoch());
  const Result<std::size_t> forgotten = given.person.empty()
                                            ? journal->forget_people_before(static_cast<std::int32_t>(today.count()) - given.days)
                                            : journal->forget_person(given.person);
  if (!forgotten) return tl::unexpected(forgotten.error());
  say("forgotten", std::to_string(*forgotten) + " (what they did stays, under a number)");
  return journal->close();
}

}  // namespace

void add_journal_commands(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<Arguments>();  // shared by the options and by what runs
  const auto command = [&](const char* name, const char* what, Result<void> (*run)(const Arguments&)) {
    CLI::App* sub = app.add_subcommand(name, what);
    sub->add_option("file", given->file, "The journal; no server may have it open")->required();
    sub->callback([&chosen, given, run] { chosen = [given, run] { return run(*given); }; });
    return sub;
  };
  const auto copies = [&](const char* name, const char* what, Result<void> (*run)(const Arguments&)) {
    CLI::App* sub = command(name, what, run);
    sub->add_option("new", given->to, "The file to make; nothing may be there")->required();
    return sub;
  };
  command("verify", "Holds every event against the chain of hashes, and checkpoints and footer against it", verify)
      ->add_option("--case", given->case_folder, "Folder of the case: makes the room again, too, and says its hashes");
  copies("recover", "Copies what can be confirmed of a damaged journal into a new one", recover);
  copies("backup", "Copies a sound journal", [](const Arguments& a) { return backup_journal(a.file, a.to); });
  copies("migrate", "Copies a journal of an earlier version into one of today's", [](const Arguments& a) { return migrate_journal(a.file, a.to); });
  copies("branch", "Makes a room of its own from what another was at a place", branch)
      ->add_option("--at", given->at, "room_seq of the last event that it takes over; all by default");
  CLI::App* again = command("replay", "Makes the room again and says its hashes, marks and time", replay);
  again->add_option("--case", given->case_folder, "Folder of the case")->required();
  again->add_option("--to", given->at, "room_seq of the last event; all by default");
  again->add_option("--fields", given->fields, "Writes the bone as it was then (.vdb), for --resume and osteon-import surface");
  copies("export", "Writes each event as a line of JSON", write_out);
  command("people", "Lists the people whose numbers the events have", list_people);
  CLI::App* gone = command("forget", "Forgets who people were; what they did stays", forget);
  gone->add_option("--person", given->person, "Number of one, as \"people\" lists it");
  gone->add_option("--older-than", given->days, "All who came more than so many days ago");
}

}  // namespace osteon
