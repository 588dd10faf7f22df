// osteon-haptic: joins a room and carries out a plan at a haptic device, a thousand times a second.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "haptic_client/app/client.hpp"
#include "haptic_client/app/laws_command.hpp"
#include "haptic_client/app/plan_file.hpp"

namespace {

using namespace osteon;
using namespace osteon::haptic;
using nlohmann::json;
constexpr const char* kProgram = "osteon-haptic";

struct Options {
  RoomSessionOptions room;
  double patience_s = 5.0;
  std::filesystem::path plan, cut_log, summary;
  std::string device = "simulated";
  ClientOptions client;
};

json durations(const DurationHistogram& histogram) {
  return {{"p50_us", histogram.percentile_us(50)}, {"p99_us", histogram.percentile_us(99)},
          {"p999_us", histogram.percentile_us(99.9)}, {"max_us", histogram.max_us()}};
}

json vector(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }

json means(const LayerMeans& m) {
  return {{"force_n", m.force_n}, {"feed_mm_per_s", m.feed_mm_per_s}, {"density_g_cm3", m.density_g_cm3},
          {"seconds", 1e-3 * static_cast<double>(m.ticks)}};
}

json step_summary(const ReadyStep& step, const StepResult& result, double removed_mm3) {
  json out{{"completed", result.completed}, {"duration_s", result.duration_s}};
  out["action"] = name(step.plan.action);
  if (step.plan.action == Action::wait) return out;
  if (step.plan.action == Action::place) {
    out["tool"] = step.plan.tool;
    out["entry_mm"] = vector(step.site.entry_mm);
    out["axis"] = vector(step.site.axis);
    return out;
  }
  const bool drill = step.feeds();
  constexpr const char* kHands[] = {"expert", "novice", "rig"};
  out["tool"] = step.plan.tool;
  out["hand"] = kHands[static_cast<int>(step.plan.hand)];
  out["spindle_rpm"] = step.spindle_rpm;
  out["entry_mm"] = vector(step.site.entry_mm);
  out["axis"] = vector(step.site.axis);
  out["thickness_mm"] = step.site.thickness_mm;
  out["flatness_mm"] = step.site.flatness_mm;
  out["removed_mm3"] = removed_mm3;
  out["peak_force_n"] = result.peak_force_n;
  out["deepest_mm"] = result.deepest_mm;
  out["while_cutting"] = means(result.all);
  if (drill) {
    out["near_cortex"] = means(result.near_cortex);
    out["medulla"] = means(result.medulla);
    out["far_cortex"] = means(result.far_cortex);
    out["broke_through"] = result.broke_through;
    out["plunge_mm"] = result.plunge_mm;
    out["plunge_after_exit_mm"] = result.after_exit_mm;
  }
  return out;
}

json summary_of(const ClientOutcome& outcome, const ReadyPlan& plan, const std::string& device) {
  const TickStats& ticks = outcome.ticks;
  json steps = json::array();
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    steps.push_back(step_summary(plan.steps[i], outcome.steps[i], outcome.removed_mm3[i]));
  return {{"device", device},
          {"device_limits",
           {{"peak_n", outcome.limits.peak_n},
            {"continuous_n", outcome.limits.continuous_n},
            {"stiffness_n_per_mm", outcome.limits.stiffness_n_per_mm},
            {"workspace_radius_mm", outcome.limits.workspace_radius_mm}}},
          {"force_scale", outcome.loop.force_scale},
          {"coupling_n_per_mm", outcome.coupling_n_per_mm},
          {"workspace_scale", outcome.workspace_scale},
          {"loop",
           {{"ticks", ticks.work.count()},
            {"missed", ticks.missed},
            {"realtime", outcome.realtime},
            {"late_p50_us", ticks.lateness.percentile_us(50)},
            {"late_p99_us", ticks.lateness.percentile_us(99)},
            {"late_p999_us", ticks.lateness.percentile_us(99.9)},
            {"late_max_us", ticks.lateness.max_us()},
            {"work_p50_us", ticks.work.percentile_us(50)},
            {"work_p99_us", ticks.work.percentile_us(99)},
            {"work_p999_us", ticks.work.percentile_us(99.9)},
            {"work_max_us", ticks.work.max_us()}}},
          {"lateness", durations(ticks.lateness)},
          {"work", durations(ticks.work)},
          {"patches", {{"built", outcome.patches}, {"p50_us", outcome.patch_p50_us}, {"p99_us", outcome.patch_p99_us},
                       {"uncovered_ticks", outcome.uncovered_ticks}, {"cuts_waiting_ticks", outcome.cuts_waiting_ticks}}},
          {"held_for_room_ticks", outcome.held_for_room_ticks},
          {"rows_dropped", outcome.rows_dropped},
          {"recording", {{"rows", outcome.recording.rows}, {"dropped", outcome.recording.dropped}, {"trouble", outcome.recording.trouble}}},
          {"cuts", outcome.cuts.size()},
          {"rejected", outcome.rejected},
          {"steps", steps},
          {"removed_mm3", outcome.removed_total_mm3},
          {"field_hash", to_hex(outcome.field_hash)},
          {"room_seq", outcome.room_seq.value},
          {"stopped", outcome.stopped}};
}

Result<void> run(Options& options, const StopSignal& stop) {
  // Everything that can be wrong without a server is said before one is looked for.
  const Result<SimulatedDeviceParams> device = find_simulated_device(options.device);
  if (!device) return tl::unexpected(device.error());
  if (options.client.force_scale < 0.0 || options.client.force_scale > 1.0)
    return failure(ErrorCode::invalid_input, "--scale must be a number above 0 and at most 1");
  if (!(options.patience_s >= 0.0 && options.patience_s <= 3600.0))
    return failure(ErrorCode::invalid_input, "--patience must be from 0 to 3600 seconds");
  if (Result<void> usable = check_writable(options.client.record, "the recording", "--record"); !usable) return usable;
  const Result<std::vector<PlanStep>> plan = read_plan(options.plan);
  if (!plan) return tl::unexpected(plan.error());

  options.room.patience = std::chrono::milliseconds(std::llround(1e3 * options.patience_s));
  Result<RoomSession> room = RoomSession::join(options.room, [&] { return stop.requested(); });
  if (!room) return tl::unexpected(room.error());
  log::info("joined", {{"case", room->bone().info().title}, {"author", room->room().author.value}});
  const Result<ReadyPlan> ready = make_ready(*plan, room->bone());
  if (!ready) return failure(ready.error().code, "the plan " + options.plan.string() + ", " + ready.error().message);

  const Result<ClientOutcome> outcome = run_client(*room, *ready, *device, options.client, stop);
  if (!outcome) return tl::unexpected(outcome.error());
  if (Result<void> written = write_cut_log(options.cut_log, outcome->cuts); !written) return written;
  if (!options.summary.empty())
    if (Result<void> written = write_file(options.summary, summary_of(*outcome, *ready, device->name).dump(2) + "\n"); !written) return written;
  std::printf("%s: %s %zu steps, %zu cuts, %.1f mm3 removed, field %.12s at %llu\n", kProgram,
              outcome->stopped ? "stopped in" : "done", ready->steps.size(), outcome->cuts.size(), outcome->removed_total_mm3,
              to_hex(outcome->field_hash).c_str(), static_cast<unsigned long long>(outcome->room_seq.value));
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "laws") return run_laws(argc - 1, argv + 1);
  Options options;
  CLI::App app("Carries out a surgeon's plan at a haptic device: feels and cuts the bone of a room at 1 kHz.", kProgram);
  app.add_option("--server", options.room.address, "HOST:PORT of osteon-server")->required();
  app.add_option("--plan", options.plan, "JSON file with the surgeon's steps")->required();
  app.add_option("--device", options.device, "simulated, one as strong as the drilling of bone, or simulated-3.3N, a desktop one; both with a simulated hand")->capture_default_str();
  app.add_option("--scale", options.client.force_scale, "Rendered over physical force; by default the device's continuous force / 30 N");
  app.add_option("--session-log", options.client.session_log, "CSV with a row for each millisecond");
  app.add_option("--record", options.client.record, "HDF5 file with a row for each millisecond: poses, wrenches, spindle, bone; --device recorded:FILE plays it");
  app.add_option("--cut-log", options.cut_log, "CSV with a row for each cut");
  app.add_option("--summary", options.summary, "JSON written at the end: steps, forces, loop times, field hash");
  app.add_option("--cache", options.room.cache, "Folder where fetched cases are kept")->capture_default_str();
  app.add_option("--patience", options.patience_s, "Seconds to wait for the server")->capture_default_str();
  app.add_flag("--status", options.client.status, "A short line on standard output each second");
  if (const auto code = parse_arguments(app, argc, argv)) return *code;

  log::open(kProgram);
  const StopSignal stop;
  const Result<void> outcome = run(options, stop);
  if (outcome) return 0;
  // Asked to stop while joining: a clean stop too.
  if (outcome.error().code == ErrorCode::cancelled) return 0;
  return log::exit_with(kProgram, outcome.error());
}
