// osteon-haptic: joins a room and runs a tool at 1 kHz. A person or a plan moves it.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "haptic_client/app/check_command.hpp"
#include "haptic_client/app/client.hpp"
#include "haptic_client/app/devices_command.hpp"
#include "haptic_client/app/laws_command.hpp"
#include "haptic_client/app/plan_command.hpp"
#include "haptic_client/app/tool_operator.hpp"

namespace {

using namespace osteon;
using namespace osteon::haptic;
using nlohmann::json;
constexpr const char* kProgram = "osteon-haptic";

struct Options {
  RoomSessionOptions room;
  wire::CredentialArguments credentials;
  double patience_s = 5.0;
  std::optional<double> force_scale;
  std::string force_choice;
  std::filesystem::path cut_log, summary;
  ToolOperatorOptions hand;
  ClientOptions client;
};

json json_vector(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }

json means(const LayerMeans& m) {
  return {{"force_n", m.force_n},
          {"feed_mm_per_s", m.feed_mm_per_s},
          {"density_g_cm3", m.density_g_cm3},
          {"seconds", 1e-3 * static_cast<double>(m.ticks)}};
}

json step_summary(const ReadyStep& step, const std::vector<ToolModel>& tools, const StepResult& result,
                  double removed_mm3) {
  json out{{"completed", result.completed}, {"duration_s", result.duration_s}};
  if (result.gave_up) {
    out["gave_up_in"] = name(*result.gave_up);
    out["gave_up_because"] = given_up_words(result);
  }
  if (result.on_metal_s > 0.0) out["on_metal_s"] = result.on_metal_s;
  out["action"] = name(step.plan.action);
  if (step.plan.action == Action::wait) return out;
  if (step.plan.action == Action::place) {
    out["tool"] = step.plan.tool;
    out["entry_mm"] = json_vector(step.site.entry_mm);
    out["axis"] = json_vector(step.site.axis);
    return out;
  }
  out["law"] = law_name(tools[static_cast<std::size_t>(step.tool)]);
  if (step.plan.action == Action::free_hand) {
    out["tool"] = step.plan.tool;
    out["spindle_rpm"] = step.spindle_rpm;
    out["entry_mm"] = json_vector(step.site.entry_mm);
    out["removed_mm3"] = removed_mm3;
    out["peak_force_n"] = result.peak_force_n;
    return out;
  }
  const bool drill = step.feeds();
  constexpr const char* kHands[] = {"expert", "novice", "rig"};
  out["tool"] = step.plan.tool;
  out["hand"] = kHands[static_cast<int>(step.plan.hand)];
  out["spindle_rpm"] = step.spindle_rpm;
  out["entry_mm"] = json_vector(step.site.entry_mm);
  out["axis"] = json_vector(step.site.axis);
  out["thickness_mm"] = step.site.thickness_mm;
  out["flatness_mm"] = step.site.flatness_mm;
  out["removed_mm3"] = removed_mm3;
  out["peak_force_n"] = result.peak_force_n;
  out["asked_mm"] = step.asked_mm();  // of the tip, like the depth reached
  out["deepest_mm"] = result.deepest_mm;
  // A broach cuts only in the ticks of its blows. So there is no mean force or feed of cutting.
  if (step.item.kind != ToolKind::broach) out["while_cutting"] = means(result.all);
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

// An instructor's decisions about the hand, and their effects. Times: since the loop's first tick.
json haptic_restrictions(const ClientOutcome& outcome) {
  const auto seconds = [&](std::int64_t mono_ns) {
    return 1e-9 * static_cast<double>(mono_ns - outcome.haptic.began_ns);
  };
  json notes = json::array(), words = json::array();
  for (const RestrictionNote& note : outcome.restrictions) {
    notes.push_back({{"at_s", seconds(note.mono_ns)}, {"what", note.what}});
    if (!note.by.empty()) notes.back()["by"] = note.by;
    if (note.room_seq != 0) notes.back()["room_seq"] = note.room_seq;
  }
  for (const WordsNote& note : outcome.replica.words)
    words.push_back(
        {{"at_s", seconds(note.mono_ns)}, {"room_seq", note.room_seq}, {"from", note.from}, {"words", note.words}});
  return {{"restrictions", notes},
          {"words", words},
          {"supervised",
           {{"forbidden_s", 1e-3 * static_cast<double>(outcome.telemetry.forbidden_ticks)},
            {"cuts_stopped", outcome.replica.cuts_stopped},
            {"cuts_taken", outcome.replica.cuts_taken},
            {"cuts_elsewhere", outcome.replica.cuts_elsewhere},
            {"force_step_n", outcome.telemetry.supervised_step_n},
            {"guide_mm", outcome.telemetry.guide_mm},
            {"guide_most_mm", outcome.telemetry.guide_most_mm}}}};
}

json summary_of(const ClientOutcome& outcome, const ReadyPlan& plan, const ToolOperator& hand, int losses) {
  const TickStats& ticks = outcome.haptic.ticks;
  json outside = json::object();
  for (const RangeWatch::Use& use : outcome.telemetry.outside_range)
    outside[std::string(use.law->name)] = {{"ticks", use.ticks}, {"what", out_of_range_words(use.bits)}};
  json steps = json::array();
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    steps.push_back(step_summary(plan.steps[i], plan.tools, outcome.steps[i], outcome.replica.removed_mm3[i]));
  json summary = {
      {"device", hand.device_name()},
      {"pointer_sources", hand.pushed()},
      {"device_losses", losses},
      {"device_limits",
       {{"peak_n", outcome.limits.peak_n},
        {"continuous_n", outcome.limits.continuous_n},
        {"stiffness_n_per_mm", outcome.limits.stiffness_n_per_mm},
        {"workspace_radius_mm", outcome.limits.workspace_radius_mm}}},
      {"force_scale", outcome.loop.force_scale},
      {"force_choice", name(outcome.loop.choice)},
      {"force_knee_n", outcome.loop.compression.knee_n},
      {"force_budget_n", outcome.loop.peak_n},
      {"coupling_n_per_mm", outcome.coupling_n_per_mm},
      {"workspace_scale", outcome.workspace_scale},
      {"loop",
       {{"ticks", ticks.work.count()},
        {"missed", ticks.missed},
        {"stalls", outcome.haptic.stalls},
        {"longest_stall_ms", outcome.haptic.longest_stall_ms},
        {"realtime", outcome.haptic.realtime},
        {"late_p50_us", ticks.lateness.percentile_us(50)},
        {"late_p99_us", ticks.lateness.percentile_us(99)},
        {"late_p999_us", ticks.lateness.percentile_us(99.9)},
        {"late_max_us", ticks.lateness.max_us()},
        {"work_p50_us", ticks.work.percentile_us(50)},
        {"work_p99_us", ticks.work.percentile_us(99)},
        {"work_p999_us", ticks.work.percentile_us(99.9)},
        {"work_max_us", ticks.work.max_us()}}},
      {"patches",
       {{"built", outcome.replica.patches},
        {"p50_us", outcome.replica.patch_p50_us},
        {"p99_us", outcome.replica.patch_p99_us},
        {"uncovered_ticks", outcome.haptic.uncovered_ticks},
        {"cuts_waiting_ticks", outcome.haptic.cuts_waiting_ticks}}},
      {"held_for_room_ticks", outcome.haptic.held_for_room_ticks},
      {"interruptions", outcome.replica.interruptions},
      {"fast_path",
       {{"alive", outcome.fast_path.alive},
        {"round_trip_ms", outcome.fast_path.round_trip_ms},
        {"loss", outcome.fast_path.loss},
        {"packets_sent", outcome.fast_path.packets_sent},
        {"bytes_sent", outcome.fast_path.bytes_sent},
        {"packets_received", outcome.fast_path.packets_received}}},
      {"mount",
       {{"there", outcome.haptic.mount.there},
        {"most_mm", outcome.haptic.mount.most_mm},
        {"most_rad", outcome.haptic.mount.most_rad},
        {"put_in_mj", outcome.haptic.mount.put_in_mj},
        {"released_mj", outcome.haptic.mount.released_mj},
        {"given_mj", outcome.haptic.mount.given_mj},
        {"granted_mj", outcome.haptic.mount.granted_mj},
        {"low_pass_s", outcome.haptic.mount.low_pass_s}}},
      {"rows_dropped", outcome.haptic.rows_dropped},
      {"recording",
       {{"rows", outcome.recording.rows},
        {"dropped", outcome.recording.dropped},
        {"trouble", outcome.recording.trouble}}},
      {"cuts", outcome.replica.cuts.size()},
      {"rejected", outcome.replica.rejected},
      {"laws_outside_range", outside},
      {"steps", steps},
      {"removed_mm3", outcome.replica.removed_total_mm3},
      {"field_hash", outcome.replica.field_hash ? json(to_hex(*outcome.replica.field_hash)) : json(nullptr)},
      {"unconfirmed", outcome.replica.unconfirmed},
      {"room_seq", outcome.replica.room_seq.value},
      {"stopped", outcome.stopped},
      {"lost", outcome.lost ? json(outcome.lost->message) : json(nullptr)}};
  summary.update(haptic_restrictions(outcome));
  return summary;
}

// Reports events of the devices to the user, as they happen.
void report(DeviceEvent event, std::string_view device, const std::string& sentence) {
  switch (event) {
    case DeviceEvent::lost:
      log::warn("device lost", {{"device", device}, {"because", sentence}, {"force", "none until it is back"}});
      break;
    case DeviceEvent::back:
      log::info("device back", {{"device", device}});
      break;
    case DeviceEvent::advice:
      log::warn("device waits", {{"device", device}, {"for", sentence}});
      break;
    case DeviceEvent::ready:
      log::info("device ready", {{"device", device}});
      break;
  }
}

Result<void> check_outputs(const Options& options) {
  // A recording cannot be made again, and may be the one that is being played.
  std::error_code ignored;
  if (!options.client.record.empty() && std::filesystem::is_regular_file(options.client.record, ignored))
    return failure(ErrorCode::exists, "there is a file " + options.client.record.string() +
                                          " already; give --record another name, or move that one away");
  if (Result<void> usable = check_writable(options.client.record, "the recording", "--record"); !usable) return usable;
  if (Result<void> usable = check_writable(options.client.session_log, "the session log", "--session-log"); !usable)
    return usable;
  if (Result<void> usable = check_writable(options.cut_log, "the cut log", "--cut-log"); !usable) return usable;
  return check_writable(options.summary, "the summary", "--summary");
}

// Error unavailable: the first step whose time, or whose recording, ran out. A step that a signal stopped is no error.
Result<void> all_finished(const ReadyPlan& plan, const ClientOutcome& outcome) {
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    if (outcome.steps[i].gave_up)
      return failure(ErrorCode::unavailable, "step " + std::to_string(i + 1) + " (" + name(plan.steps[i].plan.action) +
                                                 ") did not finish: " + given_up_words(outcome.steps[i]));
  // Without a stop nothing else leaves a step of a plan incomplete.
  if (outcome.stopped) return {};
  for (std::size_t i = 0; i < plan.steps.size(); ++i)
    if (!outcome.steps[i].completed && plan.steps[i].plan.action != Action::free_hand)
      return failure(ErrorCode::unavailable,
                     "step " + std::to_string(i + 1) + " (" + name(plan.steps[i].plan.action) +
                         ") did not finish: the recording ends here; play one that was made to its end");
  return {};
}

Result<void> run(Options& options, const StopSignal& stop) {
  // Reports everything that can be wrong without a server before one is contacted.
  if (options.force_scale && !(*options.force_scale > 0.0 && *options.force_scale <= 1.0))
    return failure(ErrorCode::invalid_input, "--scale must be a number above 0 and at most 1");
  if (!options.force_choice.empty()) {
    const Result<ForceChoice> choice = find_force_choice(options.force_choice);
    if (!choice) return failure(choice.error().code, "--force-choice: " + choice.error().message);
    if (*choice != ForceChoice::proportional && options.force_scale)
      return failure(ErrorCode::invalid_input,
                     "--scale is for --force-choice proportional; leave out one of the two, the others scale by the "
                     "device");
    options.hand.force_choice = *choice;
  }
  if (!(options.patience_s >= 0.0 && options.patience_s <= 3600.0))
    return failure(ErrorCode::invalid_input, "--timeout must be from 0 to 3600 seconds");
  const Result<wire::ClientCredentials> credentials = wire::client_credentials(options.credentials);
  if (!credentials) return tl::unexpected(credentials.error());
  options.room.credentials = *credentials;
  if (Result<void> usable = check_outputs(options); !usable) return usable;
  Result<ToolOperator> hand = ToolOperator::make(options.hand, report);
  if (!hand) return tl::unexpected(hand.error());

  options.room.patience = std::chrono::milliseconds(std::llround(1e3 * options.patience_s));
  Result<RoomSession> room = RoomSession::join(options.room, [&] { return stop.requested(); });
  if (!room) return tl::unexpected(room.error());
  log::info("joined", {{"case", room->bone().info().title}, {"author", room->room().author.value}});
  Result<std::unique_ptr<Session>> session = hand->on(room->bone(), *room->tools(), options.force_scale.value_or(0.0));
  if (!session) return tl::unexpected(session.error());
  const LoopParams& shown = (*session)->loop().params();
  log::info("in hand", {{"device", hand->device_name()},
                        {"peak_n", shown.peak_n},
                        {"continuous_n", shown.continuous_n},
                        {"force_choice", name(shown.choice)},
                        {"force_scale", shown.force_scale}});

  options.client.played = hand->recorded();
  const Result<ClientOutcome> outcome = run_client(*room, **session, options.client, stop);
  const int losses = hand->losses();
  hand->disconnect();
  if (!outcome) return tl::unexpected(outcome.error());
  const ReadyPlan& plan = (*session)->plan();
  // Both files are written, whatever the result of the other and of the session.
  Result<void> cut_log = write_cut_log(options.cut_log, outcome->replica.cuts);
  Result<void> summary = options.summary.empty()
                             ? Result<void>()
                             : write_file(options.summary, summary_of(*outcome, plan, *hand, losses).dump(2) + "\n");
  const auto finished = std::ranges::count_if(outcome->steps, &StepResult::completed);
  const std::string field =
      outcome->replica.field_hash ? to_hex(*outcome->replica.field_hash).substr(0, 12) : "unknown";
  std::string unconfirmed;
  if (outcome->replica.unconfirmed > 0)
    unconfirmed = " (" + std::to_string(outcome->replica.unconfirmed) +
                  " of them not confirmed, and not in the following figures)";
  std::printf(
      "%s: %s, %lld of %zu steps done, %zu cuts of its own%s, %.1f mm3 gone from the bone in all, "
      "field %s at %llu; %llu of %llu ms missed\n",
      kProgram,
      outcome->lost      ? "broken off"
      : outcome->stopped ? "stopped"
                         : "ended",
      static_cast<long long>(finished), plan.steps.size(), outcome->replica.cuts.size(), unconfirmed.c_str(),
      outcome->replica.removed_total_mm3, field.c_str(),
      static_cast<unsigned long long>(outcome->replica.room_seq.value),
      static_cast<unsigned long long>(outcome->haptic.ticks.missed),
      static_cast<unsigned long long>(outcome->haptic.ticks.missed + outcome->haptic.ticks.work.count()));
  if (outcome->lost) return tl::unexpected(*outcome->lost);
  if (!cut_log) return cut_log;
  if (!summary) return summary;
  return all_finished(plan, *outcome);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && (std::string_view(argv[1]) == "check" || std::string_view(argv[1]) == "--check"))
    return run_check(argc - 1, argv + 1);
  if (argc > 1 && std::string_view(argv[1]) == "laws") return run_laws(argc - 1, argv + 1);
  if (argc > 1 && std::string_view(argv[1]) == "devices") return run_devices(argc - 1, argv + 1);
  if (argc > 1 && std::string_view(argv[1]) == "plan") return run_plan(argc - 1, argv + 1);
  Options options;
  CLI::App app(
      "Feels and cuts the bone of a room at 1 kHz: with your hand at a haptic device, or with a simulated one that "
      "carries out a plan. Other commands: check, devices, laws, plan (each with --help).",
      kProgram);
  app.add_option("--server", options.room.address, "HOST:PORT of osteon-server")->required();
  app.add_option("--room", options.room.room, "Name of the room; not needed where the server has one");
  wire::add_credential_options(app, options.credentials);
  app.add_option("--name", options.room.name,
                 "Your name for others in the room; over plain text it is also your identity, which is new each time "
                 "without it");
  app.add_option("--plan", options.hand.plan, "JSON file with the steps of a simulated surgeon");
  app.add_option("--tool", options.hand.tool,
                 "The tool for your own hand, of the box or of the server's --tools, e.g. drill-3.2; no --plan then");
  app.add_option(
         "--device", options.hand.device,
         "simulated or simulated-3.3N (a simulated hand, with a --plan), recorded:FILE (a recording, with its "
         "--plan or "
         "--tool), pointer:SOCKET (the mouse of the window osteon, which starts this program), or for your hand "
         "one of osteon-haptic devices, others added by \"+\": phantom, falcon+spacemouse+pedal")
      ->capture_default_str();
  app.add_option(
      "--view", options.hand.view,
      "Your hand: from where you look, front (unless said otherwise), back, left, right, top or bottom of the "
      "patient, or the direction x,y,z");
  app.add_option("--at", options.hand.at,
                 "Your hand: the point x,y,z in mm above which the tool begins; by default the bone nearest to"
                 " its middle");
  app.add_option("--rpm", options.hand.spindle_rpm, "Your hand: the spindle's full speed; by default the tool's own");
  app.add_option(
      "--law", options.hand.law,
      "Your hand: the force law by which the tool resists, see osteon-haptic laws; by default the tool's own");
  app.add_option("--wear", options.hand.wear,
                 "Your hand: how blunt the tool is, from 1, sharp (unless said otherwise); about 2 is blunt");
  add_device_options(app, options.hand.devices);
  app.add_option("--scale", options.force_scale,
                 "Rendered over physical force; by default the device's continuous force / 30 N");
  app.add_option("--force-choice", options.force_choice,
                 "How a weak device shows strong forces: proportional (unless said otherwise), compressed (a logarithm "
                 "up to its continuous force) or feed-cue (a small force, and a vibration that grows with the feed)");
  app.add_option("--session-log", options.client.session_log, "CSV with a row for each millisecond");
  app.add_option(
      "--record", options.client.record,
      "HDF5 file with a row for each millisecond: poses, wrenches, spindle, bone; --device recorded:FILE plays it. "
      "An existing file is not overwritten");
  app.add_option("--cut-log", options.cut_log, "CSV with a row for each cut");
  app.add_option("--summary", options.summary, "JSON written at the end: steps, forces, loop times, field hash");
  app.add_option(
      "--udp", options.room.fast_path,
      "HOST:PORT for the sealed datagrams beside the stream, or off; by default the port that the server names");
  app.add_option("--cache", options.room.cache, "Folder where fetched cases are kept")->capture_default_str();
  app.add_option("--timeout", options.patience_s, "Seconds to wait for the server")->capture_default_str();
  app.add_flag("--status", options.client.status, "A short line on standard output each second");
  if (const auto code = parse_arguments(app, argc, argv)) return *code;

  log::open(kProgram);
  const StopSignal stop;
  const Result<void> outcome = run(options, stop);
  if (outcome) return 0;
  // A stop requested while joining is a clean stop too.
  if (outcome.error().code == ErrorCode::cancelled) return 0;
  return log::exit_with(kProgram, outcome.error());
}
