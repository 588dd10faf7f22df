// osteon: the window in which a person practises bone surgery.
#include <CLI/CLI.hpp>

#include <QVTKOpenGLNativeWidget.h>
#include <QApplication>
#include <QSurfaceFormat>
#include <QTimer>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/runtime/command_line.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/stop_signal.hpp"
#include "viewer_client/desktop/language.hpp"
#include "viewer_client/desktop/main_window.hpp"

namespace {

using namespace osteon;

constexpr const char* kProgram = "osteon";
constexpr int kStopPeriod_ms = 100;

struct Arguments {
  std::string bone, example, tool, server, room, name, language;
  bool watch = false;
  wire::CredentialArguments credentials;
};

void add_options(CLI::App& app, Arguments& arguments) {
  app.add_option("CASE", arguments.bone, "Case to open: an .osteon file, or a folder as osteon-import writes it");
  app.add_option("--example", arguments.example,
                 "Opens a bone that comes with Osteon: skull, femur, tibia, patella, "
                 "knee, hip or pelvis");
  app.add_option("--tool", arguments.tool,
                 "The tool that the hand holds at once, with CASE or --example; osteon-import tools names them");
  auto* server = app.add_option("--server", arguments.server, "Joins a room instead: HOST:PORT of osteon-server");
  app.add_flag("--watch", arguments.watch, "Only watches that room: the view follows the work, no tool can be taken")
      ->needs(server);
  app.add_option("--room", arguments.room, "Name of the room; not needed where the server has one");
  app.add_option("--name", arguments.name, "Who you are, shown to others");
  app.add_option("--language", arguments.language,
                 "Language of the window this time, en or de; without it, that of View > Language")
      ->check(CLI::IsMember({"en", "de"}));
  wire::add_credential_options(app, arguments.credentials);
}

// Errors: invalid_input (--tool without a bone), not_found (no hand can hold such a tool).
Result<void> check_tool(const Arguments& arguments) {
  if (arguments.tool.empty()) return {};
  if (arguments.bone.empty() && arguments.example.empty())
    return failure(ErrorCode::invalid_input, "--tool needs a bone: give CASE or --example");
  if (MainWindow::can_hold(arguments.tool)) return {};
  return failure(ErrorCode::not_found, "--tool " + arguments.tool +
                                           ": there is no such tool that a hand holds; osteon-import tools "
                                           "names them");
}

// Before there is a window, Qt ends with some lines and an abort where it reaches no display.
void say_no_display(QtMsgType type, const QMessageLogContext& context, const QString& text) {
  if (type == QtFatalMsg)
    std::_Exit(log::exit_with(
        kProgram, {ErrorCode::not_found,
                   "no window can be opened here: DISPLAY is \"" + qEnvironmentVariable("DISPLAY").toStdString() +
                       "\" and QT_QPA_PLATFORM is \"" + qEnvironmentVariable("QT_QPA_PLATFORM").toStdString() +
                       "\"; start it on a desktop, or with xvfb-run"}));
  if (!QString(context.category).startsWith("qt.qpa")) std::fprintf(stderr, "%s\n", text.toUtf8().constData());
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Practise bone surgery in a window: open a bone, take a tool with the mouse, and cut.", kProgram};
  add_options(app, arguments);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;
  log::open(kProgram);
  const StopSignal stop;
  if (const auto held = check_tool(arguments); !held) return log::exit_with(kProgram, held.error());

  if (qEnvironmentVariableIsEmpty("DISPLAY") && qEnvironmentVariableIsEmpty("QT_QPA_PLATFORM"))
    return log::exit_with(
        kProgram,
        {ErrorCode::not_found, "there is no X display: DISPLAY is empty; start it on a desktop, or with xvfb-run"});
  // Under Wayland the window uses XWayland: VTK 9.1 draws by GLX.
  if (qEnvironmentVariableIsEmpty("QT_QPA_PLATFORM")) qputenv("QT_QPA_PLATFORM", "xcb");
  QSurfaceFormat::setDefaultFormat(QVTKOpenGLNativeWidget::defaultFormat());
  QApplication::setAttribute(Qt::AA_EnableHighDpiScaling);
  qInstallMessageHandler(say_no_display);
  QApplication qt(argc, argv);
  qInstallMessageHandler(nullptr);
  QApplication::setApplicationName("osteon");
  QApplication::setOrganizationName("osteon");
  QApplication::setApplicationVersion(OSTEON_VERSION);
  speak(arguments.language.empty() ? chosen_language() : QString::fromStdString(arguments.language));

  MainWindow window;
  window.hold_first(arguments.tool);
  window.show();
  // A signal closes the window, which ends its children in order.
  QTimer stopping;
  QObject::connect(&stopping, &QTimer::timeout, [&] {
    if (!stop.requested()) return;
    if (!window.close()) window.close();  // it does not wait for a file that is being saved
    QApplication::quit();
  });
  stopping.start(kStopPeriod_ms);
  if (!arguments.server.empty()) {
    const auto credentials = wire::client_credentials(arguments.credentials);
    if (!credentials) return log::exit_with(kProgram, credentials.error());
    const RoomAddress room{QString::fromStdString(arguments.server), QString::fromStdString(arguments.room),
                           QString::fromStdString(arguments.name), *credentials};
    arguments.watch ? window.watch(room) : window.join(room);
  } else if (!arguments.bone.empty()) {
    if (is_case(arguments.bone)) {
      window.practise(arguments.bone);
    } else if (is_file(arguments.bone)) {
      window.open_case_file(arguments.bone);
    } else {
      return log::exit_with(
          kProgram,
          {ErrorCode::not_found, arguments.bone + " is neither a file nor the folder of a case: it has no "
                                                  "case.json; name an .osteon file, or what osteon-import wrote"});
    }
  } else if (!arguments.example.empty()) {
    std::string names;
    for (const ExampleBone& bone : example_bones()) {
      if (bone.id.toStdString() == arguments.example) {
        window.open_example(bone);
        return QApplication::exec();
      }
      names += (names.empty() ? "" : ", ") + bone.id.toStdString();
    }
    return log::exit_with(kProgram, {ErrorCode::not_found, "--example " + arguments.example +
                                                               ": there is no such bone; "
                                                               "choose one of " +
                                                               names});
  }
  return QApplication::exec();
}
