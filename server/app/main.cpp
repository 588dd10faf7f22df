// osteon-server: loads a case, runs its room, says how it fares, and leaves a summary.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>

#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/progress.hpp"
#include "common/runtime/stop_signal.hpp"
#include "server/net/room_server.hpp"

namespace {

using namespace osteon;
constexpr const char* kProgram = "osteon-server";
constexpr std::chrono::seconds kHealthEvery{10};

struct Options {
  std::filesystem::path case_folder;
  std::string listen = "127.0.0.1:0";
  std::filesystem::path address_file;
  std::filesystem::path summary_file;
};

void log_health(const HostHealth& health) {
  log::info("health", {{"room_seq", health.room_seq.value},
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
                       {"cutting_streams", health.cutting_streams}});
}

nlohmann::json durations(const DurationHistogram& histogram) {
  return {{"count", histogram.count()},
          {"p50_us", histogram.percentile_us(50)},
          {"p99_us", histogram.percentile_us(99)},
          {"max_us", histogram.max_us()}};
}

nlohmann::json summary_of(const RoomServerSummary& summary, const Case& bone) {
  const HostHealth& health = summary.health;
  return {{"case_hash", to_hex(bone.hash())},
          {"field_hash", to_hex(summary.bone.field_hash)},
          {"mesh_hash", to_hex(summary.surface_hash)},
          {"room_seq", summary.bone.room_seq.value},
          {"removed_mm3", summary.bone.removed_mm3},
          {"committed", health.counts.committed},
          {"rejected", health.counts.rejected},
          {"repeated", health.counts.repeated},
          {"refused", health.counts.refused},
          {"surface_blocks", health.blocks},
          {"tick",
           {{"ticks", health.tick.work.count()},
            {"missed", health.tick.missed},
            {"lateness", durations(health.tick.lateness)},
            {"work", durations(health.tick.work)}}},
          {"mesh_update_after_cut", durations(health.mesh_update)}};
}

Result<void> run(const Options& options, const StopSignal& stop) {
  // An address of an earlier run must not be taken for this one's.
  if (!options.address_file.empty()) {
    std::error_code ignored;
    std::filesystem::remove(options.address_file, ignored);
  }
  if (Result<void> usable = RoomServer::check_listen(options.listen); !usable) return usable;
  Result<Case> bone = Case::load(options.case_folder);
  if (!bone) return tl::unexpected(bone.error());
  log::info("case", {{"title", bone->info().title},
                     {"pitch_mm", bone->pitch_mm()},
                     {"volume_mm3", bone->volume_mm3()},
                     {"hash", to_hex(bone->hash())}});

  RoomServerOptions server_options;
  server_options.listen = options.listen;
  server_options.case_folder = options.case_folder;
  Result<std::unique_ptr<RoomServer>> server = [&] {
    Progress progress("surface");
    return RoomServer::start(Room(*bone), server_options, [&](double fraction) { progress.update(fraction); });
  }();
  if (!server) return tl::unexpected(server.error());
  log::info("listening", {{"address", (*server)->address()}, {"surface_blocks", (*server)->health().blocks}});
  if (!options.address_file.empty())
    if (Result<void> written = write_file(options.address_file, (*server)->address() + "\n"); !written)
      return tl::unexpected(written.error());

  while (!stop.wait_for(kHealthEvery)) log_health((*server)->health());

  log::info("stopping");
  const RoomServerSummary summary = (*server)->stop();
  log_health(summary.health);
  if (options.summary_file.empty()) return {};
  return write_file(options.summary_file, summary_of(summary, *bone).dump(2) + "\n");
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Owns the bone of a case: applies the cuts of haptic clients in one order and streams the surface and the "
               "tools' states to viewers and audio clients.",
               kProgram);
  app.add_option("--case", options.case_folder, "Folder of the case, as osteon-import writes it")->required();
  app.add_option("--listen", options.listen, "HOST:PORT on this machine; port 0 lets the system choose")->capture_default_str();
  app.add_option("--address-file", options.address_file, "Written with HOST:PORT when clients may come");
  app.add_option("--summary", options.summary_file, "JSON written at the end: field hash, counts, ticks, latencies");
  if (const auto code = parse_arguments(app, argc, argv)) return *code;

  log::open(kProgram);
  const StopSignal stop;
  const Result<void> outcome = run(options, stop);
  return outcome ? 0 : log::exit_with(kProgram, outcome.error());
}
