// osteon-viewer: shows a room's bone and tools in a window.
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <optional>
#include <string>
#include <thread>

#include "common/input/space_mouse.hpp"
#include "common/runtime/command_line.hpp"
#include "common/runtime/files.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/number_option.hpp"
#include "common/runtime/stop_signal.hpp"
#include "viewer_client/app/console.hpp"
#include "viewer_client/app/viewer.hpp"
#include "viewer_client/net/people_client.hpp"
#include "viewer_client/net/room_subscription.hpp"
#include "viewer_client/render/window.hpp"

namespace {

using namespace osteon;

constexpr const char* kProgram = "osteon-viewer";

constexpr const char* kScriptHelp =
    "Script commands, one per line, each answered by `ok ...` or `error ...` on standard output:\n"
    "  wait surface                          until the whole surface is drawn\n"
    "  wait seq N                            until the room's event N is drawn\n"
    "  wait bodies N                         until the room has N bodies\n"
    "  wait items N                          until N guides, pins, screws and implants are placed\n"
    "  undo N, redo N                        the newest N events of all; N undo events; prints how many\n"
    "  mark LABEL                            gives this moment a name; prints its number\n"
    "  undo to MARK                          all events after the mark with that number\n"
    "  take-away BODY                        removes a sawn-off piece\n"
    "  place TOOL near X Y Z [WAY] [on BODY] a guide, pin, screw or implant, on the nearest surface\n"
    "  place TOOL at X Y Z WAY [on BODY]     the same, exactly there\n"
    "                                        (WAY: along X Y Z (into the bone) [across X Y Z])\n"
    "  move ITEM near X Y Z [WAY]            an item, by the number that `place` printed\n"
    "  move ITEM at X Y Z WAY                pins along their axis only, guides unless pins fix them\n"
    "  turn ITEM TURNS                       a screw by its thread, in or (negative) out,\n"
    "                                        until its head is on bone\n"
    "  seat ITEM [MOST_MM]                   an implant along its axis until bone stops it,\n"
    "                                        at most MOST_MM, 20 unless given\n"
    "  remove ITEM                           an item, except a guide that pins fix\n"
    "                                        (the answers give the item's position; `seated`: a guide\n"
    "                                        held by two pins, a screw with its head on bone, an\n"
    "                                        implant with half of it on bone)\n"
    "  save [NAME.vdb]                       the cut fields, on the server beside its --save\n"
    "  look overview                         the whole bone\n"
    "  look at X Y Z from X Y Z up X Y Z     millimetres in the bone's frame (x left, y back, z up)\n"
    "  look tool DIST_MM                     the tip of the tool from this distance\n"
    "  look as WHO, follow WHO, follow off   the view of a person, by name or #NUMBER: once, or always\n"
    "  point X Y Z [WORDS]                   an arrow for all to see, one per person; prints its number\n"
    "  draw X Y Z X Y Z ...                  a line through all points\n"
    "  label X Y Z WORDS                     words at a point\n"
    "  wipe NUMBER|all                       removes an annotation; all: all that you drew\n"
    "  wait drawn N                          until N arrows, lines and labels are shown\n"
    "  say [WHO|all] WORDS                   to one person, or to all; \"A NAME\" with blanks in quotes\n"
    "  tool on|off                           draw the tool and its gauges\n"
    "  screenshot FILE.png\n"
    "  status FILE.json                      blocks, triangles, hash and times so far\n"
    "  quit                                  ends the viewer; so does the end of the script\n"
    "Mouse: left rotates, middle or shift-left shifts, right or wheel zooms.\n"
    "Keys: O overview, T tool, Q quit; P then a click: point there, L then a drag: draw a line,\n"
    "X: remove what you drew, Esc: cancel.\n"
    "SpaceMouse (--spacemouse): the bone follows the cap; first button overview, second tool.";

struct Arguments {
  wire::CredentialArguments credentials;
  std::string server, room, name, hand, size = "1280x720", script, screenshot, frame_log, summary;
  double patience_s = 5.0, most_frames_hz = kMostFrames_hz;
  bool space_mouse = false, console = false;
};

Result<WindowOptions> window_options(const std::string& size) {
  WindowOptions options;
  const char* end = size.data() + size.size();
  const auto width = std::from_chars(size.data(), end, options.width_px);
  if (width.ec == std::errc{} && width.ptr != end && *width.ptr == 'x') {
    const auto height = std::from_chars(width.ptr + 1, end, options.height_px);
    const auto usable = [](int pixels) { return pixels >= 64 && pixels <= 8192; };
    if (height.ec == std::errc{} && height.ptr == end && usable(options.width_px) && usable(options.height_px)) {
      return options;
    }
  }
  return failure(ErrorCode::invalid_input,
                 "--size " + size + " is not a size: give WIDTHxHEIGHT in pixels, each 64 to 8192, as in 1280x720");
}

// Answers commands as they arrive, until the input ends.
Result<void> run_console(const Arguments& arguments) {
  StopSignal stop;
  const Result<wire::ClientCredentials> credentials = wire::client_credentials(arguments.credentials);
  if (!credentials) return tl::unexpected(credentials.error());
  PeopleClientOptions options{.address = arguments.server, .room = arguments.room, .credentials = *credentials};
  if (!arguments.name.empty()) options.name = arguments.name;
  options.patience = std::chrono::milliseconds(static_cast<long>(1000.0 * arguments.patience_s));
  const auto room = PeopleClient::start(options, [&stop] { return stop.requested(); });
  if (!room) return tl::unexpected(room.error());
  auto lines = ScriptReader::open("-");
  if (!lines) return tl::unexpected(lines.error());
  Console console(**room);
  while (!console.over() && !lines->ended() && !stop.requested()) {
    if (const auto failed = (*room)->failure_seen()) return tl::unexpected(*failed);
    const std::optional<std::string> line = lines->next();
    if (!line) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      continue;
    }
    const std::optional<std::string> answer = console.answer(*line);
    if (!answer) continue;
    std::printf("%s\n", answer->c_str());
    std::fflush(stdout);
  }
  return {};
}

Result<void> run(const Arguments& arguments) {
  if (arguments.console) return run_console(arguments);
  StopSignal stop;

  // Report wrong arguments before anything starts.
  const Result<wire::ClientCredentials> credentials = wire::client_credentials(arguments.credentials);
  if (!credentials) return tl::unexpected(credentials.error());
  auto window_size = window_options(arguments.size);
  if (!window_size) return tl::unexpected(window_size.error());
  std::optional<ScriptReader> script;
  if (!arguments.script.empty()) {
    auto opened = ScriptReader::open(arguments.script);
    if (!opened) return tl::unexpected(opened.error());
    script.emplace(std::move(*opened));
  } else if (!arguments.screenshot.empty()) {
    script.emplace(ScriptReader::of("wait surface\nlook overview\nscreenshot " + arguments.screenshot + "\nquit\n"));
  }
  const bool scripted = script.has_value();

  auto window = BoneWindow::open(*window_size);
  if (!window) return tl::unexpected(window.error());

  RenderQueue render_queue;
  RoomSubscriptionOptions watch_options;
  watch_options.address = arguments.server;
  watch_options.room = arguments.room;
  watch_options.credentials = *credentials;
  if (!arguments.name.empty()) watch_options.name = arguments.name;
  watch_options.patience = std::chrono::milliseconds(static_cast<long>(1000.0 * arguments.patience_s));
  watch_options.keep_trying = !scripted;
  const auto seen_from = [size = *window_size](const CameraView& view) {
    return look_of(view, size.width_px, size.height_px);
  };
  watch_options.first_look = [seen_from](const Box& bone) { return seen_from(overview(bone)); };
  auto watch = RoomSubscription::start(watch_options, render_queue, [&stop] { return stop.requested(); });
  if (!watch) {
    if (stop.requested()) return {};
    return tl::unexpected(watch.error());
  }

  // If the server sends nothing about its people, the bone is shown all the same.
  PeopleClientOptions people_options;
  people_options.address = arguments.server;
  people_options.patience = watch_options.patience;
  people_options.window = [&watch = **watch] { return watch.joined(); };
  const auto people = PeopleClient::start(people_options, [&stop] { return stop.requested(); });
  if (!people) log::warn("people of the room are not shown", {{"reason", people.error().message}});

  ViewerOptions options;
  if (people) options.people = people->get();
  options.hand = arguments.hand;
  options.case_title = (*watch)->room().case_title;
  options.bounds = (*watch)->room().bounds;
  options.frame_log = arguments.frame_log;
  options.most_frames_hz = arguments.most_frames_hz;
  options.ask = [&watch = **watch](const RoomRequest& request) {
    return std::visit(
        [&](const auto& asked) -> Result<RoomAnswer> {
          using Asked = std::decay_t<decltype(asked)>;
          if constexpr (std::is_same_v<Asked, UndoLast>) return watch.undo(asked.count);
          if constexpr (std::is_same_v<Asked, RedoLast>) return watch.redo(asked.count);
          if constexpr (std::is_same_v<Asked, UndoTo>) return watch.undo_to(asked.mark);
          if constexpr (std::is_same_v<Asked, MarkMoment>) return watch.mark(asked.label);
          if constexpr (std::is_same_v<Asked, TakeAway>) return watch.remove_body(asked.body);
          if constexpr (std::is_same_v<Asked, PlaceTool>) return watch.place(asked.tool, asked.where, asked.body);
          if constexpr (std::is_same_v<Asked, MoveItem>) return watch.move_item(asked.item, asked.where);
          if constexpr (std::is_same_v<Asked, TurnItem>) return watch.turn_item(asked.item, asked.turns);
          if constexpr (std::is_same_v<Asked, SeatItem>) return watch.seat_item(asked.item, asked.most_mm);
          if constexpr (std::is_same_v<Asked, RemoveItem>) return watch.remove_item(asked.item);
          if constexpr (std::is_same_v<Asked, SaveBone>) return watch.save(asked.file_name);
        },
        request);
  };
  options.looked = [&watch = **watch, seen_from](const CameraView& view) { watch.look(seen_from(view)); };
  std::optional<SpaceMouseWatch> cap;
  if (arguments.space_mouse) {
    cap.emplace([](const std::string& sentence) { log::info(sentence); });
    options.cap = [&cap] { return cap->cap(); };
  }
  options.answers = !arguments.script.empty();
  options.stop_at_error = scripted && arguments.script != "-";
  auto viewer = Viewer::make(options, **window, render_queue, std::move(script));
  if (!viewer) return tl::unexpected(viewer.error());
  log::info("watching", {{"server", arguments.server}, {"case", options.case_title}});

  Result<void> outcome;
  while (outcome && !stop.requested()) {
    const auto state = viewer->turn((*watch)->interrupted());
    if (!state) {
      outcome = tl::unexpected(state.error());
    } else if (*state == Viewer::State::finished) {
      break;
    } else if (const auto failed = (*watch)->failure_seen(); failed && !stop.requested()) {
      outcome = tl::unexpected(*failed);
    }
  }

  // With --script and --screenshot both: save the last picture of the run.
  if (outcome && !arguments.script.empty() && !arguments.screenshot.empty()) {
    outcome = (*window)->scene().save_png(arguments.screenshot);
  }
  if (!arguments.summary.empty()) {
    const auto written = write_file(arguments.summary, viewer->summary_json());
    if (outcome) outcome = written;
  }
  return outcome;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Shows the bone of an Osteon server and the tools that work on it.", kProgram};
  app.footer(std::string(kScriptHelp) + "\n\n" + Console::help());
  app.add_option("--server,--connect", arguments.server, "Address of the server, HOST:PORT")->required();
  app.add_option("--name", arguments.name, "Who you are, shown to others");
  app.add_option("--supervise-for", arguments.hand,
                 "The tool operator at this window, NAME or #NUMBER: shows the restrictions of that hand");
  app.add_flag("--console", arguments.console, "No window: supervise the room by commands on standard input");
  app.add_option("--room", arguments.room, "Name of the room; not needed where the server has one");
  wire::add_credential_options(app, arguments.credentials);
  app.add_option("--size", arguments.size, "Size of the window in pixels")->capture_default_str();
  app.add_option("--script", arguments.script, "File of commands, - for standard input; its end closes the viewer");
  app.add_option("--screenshot", arguments.screenshot,
                 "Without a script: wait for the surface, save the whole bone as PNG, exit. With one: save the last "
                 "picture");
  app.add_flag("--spacemouse", arguments.space_mouse, "A SpaceMouse moves the camera, whenever one is plugged in");
  app.add_option("--most-frames", arguments.most_frames_hz,
                 "Pictures a second at most; fewer leave time to other programs of a machine that draws in software")
      ->capture_default_str()
      ->check(number_in(0.1, 60.0));
  app.add_option("--frame-log", arguments.frame_log, "CSV: when each event's surface came in and was drawn");
  app.add_option("--summary", arguments.summary, "JSON written at the end: blocks, triangles, hash, times");
  app.add_option("--timeout", arguments.patience_s, "Seconds to wait for the server")
      ->capture_default_str()
      ->check(number_in(0.0, 3600.0));
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  log::open(kProgram);
  if (const auto outcome = run(arguments); !outcome) return log::exit_with(kProgram, outcome.error());
  return 0;
}
