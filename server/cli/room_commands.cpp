#include "server/cli/room_commands.hpp"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include "server/cli/asking.hpp"

namespace osteon {
namespace {

struct RoomArguments {
  std::string name, new_name, case_hash, file_name;
  std::uint64_t from = 0, to = 0;
  double speed = 1.0;
  bool with_branches = false;
};

void print_room(const RoomLine& room) {
  std::string about =
      room.open ? "open, at event " + std::to_string(room.room_seq.value) + ", " + std::to_string(room.sessions) +
                      " sessions, " + std::to_string(room.watchers) + " watchers"
      : room.room_seq ? "stopped, at event " + std::to_string(room.room_seq.value) + ": takes no more cuts"
                      : "closed";
  if (!room.kept && !room.replay) about += ", no journal";
  if (!room.parent.empty())
    about += (room.replay ? ", shows " : ", branch of ") + room.parent + (room.replay ? " up to " : " at ") +
             std::to_string(room.parent_room_seq.value);
  std::printf("%-20s %s  [%s]\n", room.name.c_str(), about.c_str(), room.case_title.c_str());
}

Result<void> print_room(const Result<RoomLine>& room) {
  if (!room) return tl::unexpected(room.error());
  print_room(*room);
  return {};
}

Result<void> list_rooms(RoomAdminClient& rooms, const RoomArguments&) {
  const Result<std::vector<RoomLine>> all = rooms.list();
  if (!all) return tl::unexpected(all.error());
  for (const RoomLine& room : *all) print_room(room);
  if (all->empty()) std::printf("no rooms; osteon-server rooms create NAME makes one\n");
  return {};
}

Result<void> verify_room(RoomAdminClient& rooms, const RoomArguments& given) {
  const Result<RoomAdminClient::Checked> checked = rooms.verify(given.name);
  if (!checked) return tl::unexpected(checked.error());
  std::printf("events:      %llu\nchain:       %s\nfield hash:  %s\ncheckpoints: %u\n",
              static_cast<unsigned long long>(checked->room_seq.value), to_hex(checked->chain).c_str(),
              to_hex(checked->field_hash).c_str(), checked->checkpoints);
  for (const std::string& fault : checked->faults) std::printf("fault:       %s\n", fault.c_str());
  if (!checked->faults.empty())
    return failure(
        ErrorCode::invalid_input,
        "the stored room " + given.name + " is not sound; close the room and see osteon-server verify and salvage");
  std::printf("verdict:     sound\n");
  return {};
}

Result<void> back_up(RoomAdminClient& rooms, const RoomArguments& given) {
  const Result<RoomAdminClient::Copied> copied = rooms.back_up(given.name, given.file_name);
  if (!copied) return tl::unexpected(copied.error());
  std::printf("%s: %llu events\n", copied->file.c_str(), static_cast<unsigned long long>(copied->room_seq.value));
  return {};
}

Result<void> remove_room(RoomAdminClient& rooms, const RoomArguments& given) {
  const Result<std::vector<std::string>> gone = rooms.remove(given.name, given.with_branches);
  if (!gone) return tl::unexpected(gone.error());
  for (const std::string& name : *gone) std::printf("deleted: %s\n", name.c_str());
  return {};
}

}  // namespace

void add_room_commands(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<RoomArguments>();  // shared by the options and the function that runs
  CLI::App* rooms = app.add_subcommand(
      "rooms", "Makes, lists, closes, branches, replays, checks, copies and deletes the rooms of a server that runs");
  rooms->require_subcommand(1);
  using Run = Result<void> (*)(RoomAdminClient&, const RoomArguments&);
  const auto command = [&](const char* name, const char* what, Run run) {
    return add_asking_command(*rooms, name, what, chosen,
                              [given, run](RoomAdminClient& client) { return run(client, *given); });
  };
  const auto of_room = [&](const char* name, const char* what, Run run) {
    CLI::App* sub = command(name, what, run);
    sub->add_option("room", given->name, "Name of the room")->required();
    return sub;
  };
  command("list", "Lists them all", list_rooms);
  of_room("create", "Makes a room and opens it",
          [](RoomAdminClient& c, const RoomArguments& a) { return print_room(c.create(a.name, a.case_hash)); })
      ->add_option("--case-hash", given->case_hash,
                   "Which of the server's cases, where it has several; as its log says it");
  of_room("close", "Closes a room for everybody in it; its journal stays",
          [](RoomAdminClient& c, const RoomArguments& a) { return print_room(c.close(a.name)); });
  of_room("resume", "Opens a closed room where it was left",
          [](RoomAdminClient& c, const RoomArguments& a) { return print_room(c.resume(a.name)); });
  CLI::App* branch = of_room("branch", "Makes a new room from another one as it was at one event",
                             [](RoomAdminClient& c, const RoomArguments& a) {
                               return print_room(c.branch(a.name, a.new_name, RoomSeq{a.to}));
                             });
  branch->add_option("new", given->new_name, "Name of the branch")->required();
  branch->add_option("--at", given->to, "room_seq of the last event that it takes over; all by default");
  CLI::App* replay = of_room("replay", "Opens a room that replays another one, for viewers",
                             [](RoomAdminClient& c, const RoomArguments& a) {
                               return print_room(c.replay(a.name, a.new_name, RoomSeq{a.from}, RoomSeq{a.to}, a.speed));
                             });
  replay->add_option("new", given->new_name, "Name of the room that shows it")->required();
  replay->add_option("--from", given->from, "room_seq of the event that it begins after");
  replay->add_option("--to", given->to, "room_seq of the last event; all by default");
  replay->add_option("--speed", given->speed, "Times as fast as it happened; 0: stands still at --from")
      ->capture_default_str();
  of_room("verify", "Checks a room's journal, and the bone that it makes, while the room is cut", verify_room);
  of_room("backup", "Copies a room's journal while the room is cut", back_up)
      ->add_option("file", given->file_name, "Plain name in the server's folder of rooms, ending in .backup")
      ->required();
  of_room("delete", "Deletes a room with all its files, or a backup by its name NAME.backup", remove_room)
      ->add_flag("--with-branches", given->with_branches, "Its branches, and theirs, too");
}

}  // namespace osteon
