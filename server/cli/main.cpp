// osteon-server: loads a case, runs its rooms, logs their state, and writes a summary at the end.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/mechanics/force_law.hpp"
#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/progress.hpp"
#include "common/runtime/stop_signal.hpp"
#include "common/volume/mesh_distance.hpp"
#include "server/audit/audit_trail.hpp"
#include "server/cli/audit_commands.hpp"
#include "server/cli/case_commands.hpp"
#include "server/cli/journal_commands.hpp"
#include "server/cli/key_command.hpp"
#include "server/cli/room_commands.hpp"
#include "server/cli/server_config.hpp"
#include "server/cli/ticket_command.hpp"
#include "server/journal/signing.hpp"
#include "server/rpc/metrics.hpp"
#include "server/rpc/room_server.hpp"
#include "server/storage/room_files.hpp"

namespace {

using namespace osteon;
constexpr const char* kProgram = "osteon-server";
constexpr std::chrono::seconds kHealthEvery{10};

void log_health(const std::string& room, const RuntimeHealth& health) {
  log::info("health", {{"room", room},
                       {"room_seq", health.room_seq.value},
                       {"committed", health.counts.committed},
                       {"rejected", health.counts.rejected},
                       {"refused", health.counts.refused},
                       {"tick_late_p99_us", health.tick.lateness.percentile_us(99)},
                       {"tick_work_p99_us", health.tick.work.percentile_us(99)},
                       {"ticks_missed", health.tick.missed},
                       {"queued_cuts", health.queued_cuts},
                       {"stale_blocks", health.stale_blocks},
                       {"furthest_behind", health.furthest_behind},
                       {"sessions", health.sessions},
                       {"mesh_streams", health.mesh_streams},
                       {"cutting_streams", health.cutting_streams},
                       {"waiting_entries", health.waiting_entries},
                       {"commit_p99_us", health.commit.percentile_us(99)}});
}

void log_health(RoomServer& server) {
  for (const std::shared_ptr<OpenRoom>& room : server.rooms().open_rooms())
    log_health(room->name, room->runtime().health());
  const LinkServerHealth links = server.link_health();
  log::info("fast path", {{"links", links.links},
                          {"links_alive", links.alive},
                          {"datagrams_in", links.port.received},
                          {"datagrams_out", links.port.sent},
                          {"unauthenticated", links.unauthenticated}});
}

nlohmann::json durations(const DurationHistogram& histogram) {
  return {{"count", histogram.count()},
          {"p50_us", histogram.percentile_us(50)},
          {"p99_us", histogram.percentile_us(99)},
          {"max_us", histogram.max_us()}};
}

nlohmann::json summary_of(const RoomSummary& summary) {
  const RuntimeHealth& health = summary.health;
  nlohmann::json bodies = nlohmann::json::array();
  for (const BodyId body : summary.bone.bodies) bodies.push_back(body.value);
  return {{"case_hash", to_hex(summary.case_hash)},
          {"field_hash", to_hex(summary.bone.field_hash)},
          {"mesh_hash", to_hex(summary.surface_hash)},
          {"room_seq", summary.bone.room_seq.value},
          {"bodies", bodies},
          {"removed_mm3", summary.bone.removed_mm3},
          {"committed", health.counts.committed},
          {"rejected", health.counts.rejected},
          {"repeated", health.counts.repeated},
          {"refused", health.counts.refused},
          {"surface_blocks", health.blocks},
          {"surface_bytes", health.surface_bytes},
          {"tick",
           {{"ticks", health.tick.work.count()},
            {"missed", health.tick.missed},
            {"lateness", durations(health.tick.lateness)},
            {"work", durations(health.tick.work)}}},
          {"mesh_update_after_cut", durations(health.mesh_update)}};
}

// Loads every tool file of a folder, in order of their names.
Result<void> load_tools(const std::filesystem::path& folder, ToolBox& box) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  if (error)
    return failure(ErrorCode::not_found,
                   "the tools' folder " + folder.string() + " cannot be read: " + error.message());
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    const Result<Tool> tool = load_tool_file(file);
    if (!tool) return tl::unexpected(tool.error());
    // Otherwise the person who holds the tool would find out too late.
    if (const Result<const ForceLaw*> law = choose_law(*tool); !law)
      return failure(law.error().code, file.string() + ": \"law\": " + law.error().message);
    const auto entries = box.entries();
    const auto same =
        std::find_if(entries.begin(), entries.end(), [&](const auto* e) { return e->tool.name == tool->name; });
    if (same != entries.end() && (*same)->hash != tool->hash())
      return failure(ErrorCode::exists, file.string() + ": there is another tool of the name " + tool->name +
                                            "; give this one a name of its own");
    const ToolBox::Entry& entry = box.add(*tool);
    log::info("tool", {{"name", entry.tool.name}, {"hash", to_hex(entry.hash)}, {"file", file.filename().string()}});
  }
  return {};
}

// Gives the tool box that every new room begins with. Tools are loaded once, so that a later change of the folder
// changes no room.
Result<std::function<std::shared_ptr<ToolBox>()>> tool_boxes(const ServerConfig& options) {
  const std::shared_ptr<ToolBox> loaded = builtin_tool_box();  // shared with the function below
  if (!options.tools_folder.empty())
    if (Result<void> done = load_tools(options.tools_folder, *loaded); !done) return tl::unexpected(done.error());
  return [loaded] {
    std::shared_ptr<ToolBox> box = builtin_tool_box();
    for (const ToolBox::Entry* entry : loaded->entries()) box->add(entry->tool);
    return box;
  };
}

Result<Room> make_room(const ServerConfig& options, const Case& bone, std::shared_ptr<ToolBox> tools) {
  if (options.resume_file.empty()) return Room(bone, options.limits, std::move(tools));
  const Result<SavedFields> saved = load_fields(options.resume_file);
  if (!saved) return tl::unexpected(saved.error());
  Result<Room> room = Room::resume(bone, *saved, options.limits, std::move(tools));
  if (!room) return failure(room.error().code, options.resume_file.string() + ": " + room.error().message);
  log::info(
      "resumed",
      {{"file", options.resume_file.string()}, {"room_seq", saved->room_seq.value}, {"bodies", saved->bodies.size()}});
  return room;
}

// The room in the journal, or a new one in a new journal.
Result<Room> open_journal(const ServerConfig& options, const Case& bone, std::shared_ptr<ToolBox> tools,
                          std::shared_ptr<const SigningKeys> keys, std::unique_ptr<RoomStore>& store) {
  RoomStore::Options keeping{.name = options.journal_file.stem().string(),
                             .limits = options.limits,
                             .tools = std::move(tools),
                             .journal = {},
                             .today = {},
                             .random = {}};
  keeping.journal.keys = std::move(keys);
  keeping.retention_days = options.retention_days;
  Progress progress("journal");
  Result<PersistedRoom> kept =
      RoomStore::open(options.journal_file, bone, keeping, [&](double fraction) { progress.update(fraction); });
  if (!kept) return tl::unexpected(kept.error());
  log::info("journal", {{"file", options.journal_file.string()},
                        {"made", kept->made},
                        {"room_seq", kept->room.room_seq().value},
                        {"evaluated", kept->store->evaluated()},
                        {"server_epoch", kept->store->server_epoch()}});
  store = std::move(kept->store);
  return std::move(kept->room);
}

// Cases uploaded earlier are served like those of the command line, and read when a room uses them. Cases without a
// readable description are left out.
Result<std::vector<KnownCase>> open_uploads(const std::filesystem::path& folder, RoomsOptions& rooms) {
  Result<std::unique_ptr<CaseRepository>> store = CaseRepository::open(folder, "/proc/self/exe");
  if (!store) return tl::unexpected(store.error());
  std::vector<KnownCase> known;
  for (const std::filesystem::path& kept : (*store)->folders()) {
    const Result<StoredCase> stored = CaseRepository::peek(kept);
    if (!stored) {
      log::error("an uploaded case cannot be read", {{"folder", kept.string()}, {"reason", stored.error().message}});
      continue;
    }
    log::info("case", {{"title", stored->title}, {"hash", to_hex(stored->hash)}, {"uploaded", true}});
    known.push_back({stored->hash, stored->title, kept, stored->memory_bytes});
  }
  rooms.case_repository = std::move(*store);
  return known;
}

// The file of the audit log. Empty: there is none, since nothing else is stored either.
std::filesystem::path audit_file_of(const ServerConfig& options) {
  if (!options.audit_file.empty()) return options.audit_file;
  if (!options.rooms_folder.empty()) return options.rooms_folder / kAuditLogFile;
  return options.journal_file.empty() ? std::filesystem::path() : folder_of(options.journal_file) / kAuditLogFile;
}

// Null: see above. Records the start.
Result<std::shared_ptr<AuditTrail>> open_audit(const ServerConfig& options, std::shared_ptr<const SigningKeys> keys) {
  const std::filesystem::path file = audit_file_of(options);
  if (file.empty()) return nullptr;
  auto trail = AuditTrail::open({.file = file,
                                 .keys = std::move(keys),
                                 .syslog = options.audit_syslog,
                                 .retention_days = options.audit_retention_days});
  if (!trail)
    return failure(trail.error().code, "the audit log cannot be written: " + trail.error().message +
                                           "; mend that, or choose another file with --audit");
  log::info("audit log", {{"file", file.string()}, {"retention_days", options.audit_retention_days}});
  return std::shared_ptr<AuditTrail>(std::move(*trail));
}

// The keys that sign the journals and the audit log. Null: there is none of both.
Result<std::shared_ptr<const SigningKeys>> open_signing_keys(const ServerConfig& options) {
  const std::filesystem::path audit = audit_file_of(options);
  if (audit.empty()) return nullptr;
  const std::filesystem::path folder = !options.rooms_folder.empty()   ? options.rooms_folder
                                       : !options.journal_file.empty() ? folder_of(options.journal_file)
                                                                       : folder_of(audit);
  const std::filesystem::path file = options.signing_key.empty() ? folder / kSigningKeyFile : options.signing_key;
  auto keys = load_or_make_signing_keys(file);
  if (keys) log::info("signing key", {{"file", file.string()}, {"public", to_hex((*keys)->key().public_key())}});
  return keys;
}

// What the command line asks for: the rooms of a folder, or one room.
Result<std::unique_ptr<Rooms>> open_rooms(const ServerConfig& options) {
  Result<std::function<std::shared_ptr<ToolBox>()>> tools = tool_boxes(options);
  if (!tools) return tl::unexpected(tools.error());
  Result<std::shared_ptr<const SigningKeys>> keys = open_signing_keys(options);
  if (!keys) return tl::unexpected(keys.error());
  RoomsOptions rooms_options;
  rooms_options.folder = options.rooms_folder;
  rooms_options.limits = options.limits;
  rooms_options.tools = *tools;
  rooms_options.detail = options.detail;
  rooms_options.rates.mount = options.mount;
  rooms_options.retention_days = options.retention_days;
  rooms_options.most_rooms = options.most_rooms;
  rooms_options.most_rooms_per_person = options.most_rooms_per_person;
  rooms_options.most_backups_per_person = options.most_backups_per_person;
  rooms_options.keys = *keys;
  Result<std::shared_ptr<AuditTrail>> trail = open_audit(options, *keys);
  if (!trail) return tl::unexpected(trail.error());
  rooms_options.trail = std::move(*trail);
  rooms_options.case_memory_bytes = static_cast<std::uint64_t>(options.case_memory_mib) << 20;
  std::uint64_t case_bytes = 0;
  for (const std::filesystem::path& folder : options.case_folders) {
    Result<Case> bone = Case::load(folder);
    if (!bone) return tl::unexpected(bone.error());
    log::info("case", {{"title", bone->info().title},
                       {"pitch_mm", bone->pitch_mm()},
                       {"volume_mm3", bone->volume_mm3()},
                       {"hash", to_hex(bone->hash())}});
    case_bytes += bone->memory_bytes();
    if (case_bytes > rooms_options.case_memory_bytes)
      return failure(ErrorCode::exhausted,
                     "the cases up to " + folder.string() + " take more than the " +
                         std::to_string(options.case_memory_mib) +
                         " MiB of memory that they may; give fewer with --case, or a larger --case-memory-mib");
    rooms_options.cases.push_back({std::move(*bone), folder});
  }
  Result<std::vector<KnownCase>> uploaded;
  if (!options.uploads_folder.empty()) uploaded = open_uploads(options.uploads_folder, rooms_options);
  if (!uploaded) return tl::unexpected(uploaded.error());
  const Case bone = rooms_options.cases.front().bone;
  auto rooms = std::make_unique<Rooms>(std::move(rooms_options));
  for (KnownCase& known : *uploaded) rooms->add_case(std::move(known));
  Progress progress("surface");
  const auto tell = [&](double fraction) { progress.update(fraction); };
  if (!options.rooms_folder.empty()) {
    rooms->resume_all(tell);
    return rooms;
  }
  std::unique_ptr<RoomStore> store;
  Result<Room> room = options.journal_file.empty() ? make_room(options, bone, (*tools)())
                                                   : open_journal(options, bone, (*tools)(), *keys, store);
  if (!room) return tl::unexpected(room.error());
  const std::string name = store ? store->genesis().room : "room";
  if (auto added = rooms->add(name, std::move(*room), std::move(store), options.save_file, tell); !added)
    return tl::unexpected(added.error());
  return rooms;
}

// Makes the folder of rooms if it is missing, and locks it for this process while the result exists. Null: no folder.
Result<std::unique_ptr<DiskLock>> take_rooms_folder(const std::filesystem::path& folder) {
  if (folder.empty()) return nullptr;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return failure(ErrorCode::internal,
                   "the folder --rooms " + folder.string() + " cannot be made: " + error.message());
  Result<std::unique_ptr<DiskLock>> taken = lock_rooms(folder);
  // Leaves another server's folder untouched. If the folder cannot be written, reports this with the name of the
  // option.
  if (taken || taken.error().code != ErrorCode::exists)
    if (Result<void> usable = check_writable(folder / "open-rooms", "which rooms are open", "--rooms"); !usable)
      return tl::unexpected(usable.error());
  return taken;
}

// The summary of the only room, or one for each room by its name.
nlohmann::json summary_of(const std::map<std::string, RoomSummary>& rooms, bool many) {
  if (!many && rooms.size() == 1) return summary_of(rooms.begin()->second);
  nlohmann::json all = nlohmann::json::object();
  for (const auto& [name, summary] : rooms) all[name] = summary_of(summary);
  return {{"rooms", all}};
}

Result<void> run(const ServerConfig& options, const StopSignal& stop) {
  // Locked first, so that nothing of a running server is touched; released last.
  const Result<std::unique_ptr<DiskLock>> folder = take_rooms_folder(options.rooms_folder);
  if (!folder) return tl::unexpected(folder.error());
  // An address file of an earlier run must not be taken for this run's.
  if (!options.address_file.empty()) {
    std::error_code ignored;
    std::filesystem::remove(options.address_file, ignored);
  }
  const ConnectionOptions connections{.certificates = options.certificates,
                                      .most_connections = static_cast<std::size_t>(options.most_connections),
                                      .proxy_socket = options.proxy_socket,
                                      .udp_listen = options.udp_listen,
                                      .most_ticket_life = std::chrono::hours(options.most_ticket_hours)};
  if (Result<void> usable = RoomServer::check_listen(options.listen, connections); !usable) return usable;
  if (Result<void> usable = check_writable(options.save_file, "the fields", "--save"); !usable) return usable;
  Result<std::unique_ptr<Rooms>> rooms = open_rooms(options);
  if (!rooms) return tl::unexpected(rooms.error());
  Result<std::unique_ptr<RoomServer>> server = RoomServer::start(std::move(*rooms), options.listen, connections);
  if (!server) return tl::unexpected(server.error());
  const RuntimeHealth first = (*server)->health();
  log::info("listening", {{"address", (*server)->address()},
                          {"udp_port", (*server)->link_port()},
                          {"surface_blocks", first.blocks},
                          {"surface_bytes", first.surface_bytes}});
  Result<std::unique_ptr<Metrics>> metrics;
  if (!options.metrics.empty()) {
    metrics =
        Metrics::start(options.metrics, **server,
                       options.certificates.empty() ? std::filesystem::path() : options.certificates / "server.pem");
    if (!metrics) return tl::unexpected(metrics.error());
    log::info("metrics", {{"address", (*metrics)->address()}});
  }
  if (!options.address_file.empty())
    if (Result<void> written = write_file(options.address_file, (*server)->address() + "\n"); !written)
      return tl::unexpected(written.error());

  while (!stop.wait_for(kHealthEvery)) log_health(**server);
  (*server)->drain(std::chrono::seconds(options.drain_seconds),
                   [&](std::chrono::milliseconds time) { return stop.wait_for_second(time); });

  log::info("stopping");
  if (metrics) metrics->reset();
  const std::map<std::string, RoomSummary> summaries = (*server)->stop_all();
  for (const auto& [name, summary] : summaries) log_health(name, summary.health);
  for (const auto& [name, summary] : summaries)
    if (!summary.save.empty())
      if (Result<void> saved = save_fields(summary.save, summary.fields); !saved) return saved;
  if (options.summary_file.empty()) return {};
  return write_file(options.summary_file, summary_of(summaries, !options.rooms_folder.empty()).dump(2) + "\n");
}

// `config`: the values of the file, replaced by those of the command line. Returns the program's exit code.
int check(const std::filesystem::path& file, std::vector<std::string> faults, const ServerConfig& config) {
  for (const Result<void>& said : {check_server_config(config), check_server_places(config)})
    if (!said) faults.push_back(file.string() + ": " + said.error().message);
  for (const std::string& fault : faults) std::fprintf(stderr, "%s: %s\n", kProgram, fault.c_str());
  if (faults.empty()) std::printf("%s: sound\n", file.c_str());
  return faults.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  case_check_command(argc, argv);
  ServerConfig options;
  CLI::App app(
      "Owns the bone of a case: applies the cuts of haptic clients in one order and streams the surface and the "
      "tools' states to viewers and audio clients.",
      kProgram);
  app.add_option("--case", options.case_folders,
                 "Folder of the case, as osteon-import writes it; with --rooms several, each for rooms of its own")
      ->allow_extra_args(false);
  std::function<Result<void>()> command;
  add_journal_commands(app, command);
  add_room_commands(app, command);
  add_case_commands(app, command);
  add_ticket_command(app, command);
  add_key_command(app, command);
  add_audit_commands(app, command);
  app.require_subcommand(0, 1);
  app.add_option("--listen", options.listen, "HOST:PORT on this machine; port 0 lets the system choose")
      ->capture_default_str();
  app.add_option(
      "--udp-listen", options.udp_listen,
      "HOST:PORT for the datagrams of the fast path, HOST numeric; by default the host of --listen, at a free port");
  app.add_option("--certificates", options.certificates,
                 "Folder with ca.pem, server.pem, server.key and tickets.pub, as deploy/certs makes it: clients "
                 "connect with a certificate and a ticket");
  app.add_option("--proxy-socket", options.proxy_socket,
                 "Unix socket for calls from a proxy on this machine; deploy/docs/security.md");
  app.add_flag("--plain", options.plain,
               "Plain text, without certificates and tickets, for clients on this machine alone");
  app.add_option("--most-connections", options.most_connections, "Of all clients together; more are closed at once")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  app.add_option("--most-ticket-hours", options.most_ticket_hours,
                 "Refuses tickets that are valid for more hours from the call; by default no limit")
      ->check(CLI::Range(1, 87600));
  app.add_option("--most-rooms", options.most_rooms,
                 "Open and closed ones together; no more are made, branched or replayed")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option("--most-rooms-per-person", options.most_rooms_per_person,
                 "Rooms, branches and replays together that one person may make; operators have no limit")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option("--most-backups-per-person", options.most_backups_per_person,
                 "Backups in the folder of rooms that one person may make, operators too")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option("--address-file", options.address_file, "Written with HOST:PORT when clients may connect");
  app.add_option(
      "--tools", options.tools_folder,
      "Folder of tool files (*.yaml, with the STL files they name) that the room knows beside the built-in tools");
  app.add_option("--save", options.save_file,
                 "The cut bone in all its bodies, the scene and added tools (.vdb), written at a clean stop and when a "
                 "client asks");
  CLI::Option* resume =
      app.add_option("--resume", options.resume_file,
                     "File that --save wrote: the room goes on from there; earlier cuts cannot be undone");
  app.add_option(
         "--journal", options.journal_file,
         "Journal of the room: every event is durable before it is published or acknowledged; if the file exists, the "
         "room goes on, and its cuts can still be undone")
      ->excludes(resume);
  app.add_option("--rooms", options.rooms_folder,
                 "Folder of many rooms, each with a journal: those that were open are opened, and \"osteon-server "
                 "rooms\" makes, closes, branches and deletes them")
      ->excludes(resume)
      ->excludes("--journal")
      ->excludes("--save");
  app.add_option(
      "--signing-key", options.signing_key,
      "File of the key that signs journals, made where it is missing; by default signing.key beside the journals");
  app.add_option("--audit", options.audit_file,
                 "File that says who did what, signed; by default audit.log beside the journals");
  app.add_option(
      "--audit-syslog", options.audit_syslog,
      "Unix datagram socket of the system's log, such as /dev/log, that is sent the same records, with names");
  app.add_option("--audit-retention-days", options.audit_retention_days,
                 "After so many days records are removed from the audit log; 0: never")
      ->check(CLI::Range(0, 36500))
      ->capture_default_str();
  app.add_option("--uploads", options.uploads_folder,
                 "Folder for cases that \"osteon-server cases upload\" sends, for rooms of their own; without it "
                 "uploads are refused");
  app.add_option("--case-memory-mib", options.case_memory_mib,
                 "Of all cases in memory: those of --case, and uploaded ones while a room uses them; a room that needs "
                 "more is refused")
      ->check(CLI::Range(1, kMostCaseMemoryMib))
      ->capture_default_str();
  app.add_option("--retention-days", options.retention_days,
                 "After this many days a room's journal erases who somebody was, at opening and once a day; what "
                 "they did stays")
      ->check(CLI::Range(1, 36500));
  const std::map<std::string, Detail> details{
      {"auto", Detail::automatic}, {"full", Detail::full}, {"near", Detail::near}};
  app.add_flag("--compliant-mount", options.mount,
               "The bone stands on a compliant mount: when somebody pushes it, everybody with a tool at it feels this");
  app.add_option(
         "--detail", options.detail,
         "full: viewers are sent the whole bone at its own pitch; near: that only where they look and where tools "
         "work, coarser elsewhere; auto: near for a bone of more than " +
             std::to_string(kMostFullBlocks) + " blocks")
      ->transform(CLI::CheckedTransformer(details, CLI::ignore_case).description("auto|full|near"))
      ->default_str("auto");
  app.add_option("--summary", options.summary_file, "JSON written at the end: field hash, counts, ticks, latencies");
  app.add_option("--metrics", options.metrics,
                 "PORT or HOST:PORT of this machine at which Prometheus reads figures of every room");
  app.add_option("--drain-seconds", options.drain_seconds,
                 "After SIGTERM or Ctrl-C, how long clients have to leave in good order; a second signal ends this")
      ->check(CLI::Range(0, 600))
      ->capture_default_str();
  std::filesystem::path config_file;
  bool only_check = false;
  CLI::Option* from_file =
      app.add_option("--config", config_file, "YAML file with all of these, and limits; the command line wins over it");
  app.add_flag("--check", only_check, "Checks the --config file, says what to change in it, and ends")
      ->needs(from_file);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  if (!config_file.empty() && !command) {
    const Result<ConfigRead> read = read_server_config(config_file);
    if (!read) return log::exit_with(kProgram, read.error());
    options = read->config;
    // Values of the command line replace those of the file.
    if (const auto code = parse_arguments(app, argc, argv)) return *code;
    if (only_check) return check(config_file, read->faults, options);
    if (!read->faults.empty()) return log::exit_with(kProgram, {ErrorCode::invalid_input, read->faults.front()});
  }

  if (command) {
    const Result<void> done = command();
    return done ? 0 : log::exit_with(kProgram, done.error());
  }
  log::open(kProgram);
  if (const Result<void> fits = check_server_config(options); !fits) return log::exit_with(kProgram, fits.error());
  const StopSignal stop;
  const Result<void> outcome = run(options, stop);
  return outcome ? 0 : log::exit_with(kProgram, outcome.error());
}
