#include "viewer_client/desktop/main_window.hpp"

#include <malloc.h>

#include <QAction>
#include <QCloseEvent>
#include <QDateTime>
#include <QDialog>
#include <QDialogButtonBox>
#include <QDir>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QFileDialog>
#include <QFormLayout>
#include <QInputDialog>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QLocale>
#include <QMessageBox>
#include <QMimeData>
#include <QScrollArea>
#include <QScrollBar>
#include <QSettings>
#include <QStackedWidget>
#include <QStandardPaths>
#include <QStatusBar>
#include <QUrl>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <span>
#include <utility>

#include "common/tools/tool.hpp"
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/c_arm_panel.hpp"
#include "viewer_client/desktop/clipping_panel.hpp"
#include "viewer_client/desktop/connection_panel.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/field_sentences.hpp"
#include "viewer_client/desktop/force_menu.hpp"
#include "viewer_client/desktop/game_pad_controller.hpp"
#include "viewer_client/desktop/gauges_panel.hpp"
#include "viewer_client/desktop/imaging_page.hpp"
#include "viewer_client/desktop/plan_bar.hpp"
#include "viewer_client/desktop/properties_panel.hpp"
#include "viewer_client/desktop/risk_gauge.hpp"
#include "viewer_client/desktop/send_dialog.hpp"
#include "viewer_client/desktop/slices_panel.hpp"
#include "viewer_client/desktop/sound_control.hpp"
#include "viewer_client/desktop/start_page.hpp"
#include "viewer_client/desktop/tool_bar.hpp"
#include "viewer_client/desktop/tool_names.hpp"
#include "viewer_client/desktop/view_options.hpp"
#include "viewer_client/scene/held_tools.hpp"

namespace osteon {

namespace {

constexpr std::chrono::seconds kJoinRefusedPatience{1};  // where nothing listens, a server may be about to start
constexpr int kGaugePeriod_ms = 50;
// The pointer also sends while it rests, so that the haptic client knows that the window lives.
constexpr int kPointerPeriod_ms = 50;
constexpr int kCapPeriod_ms = 16;
constexpr int kMessage_ms = 8000;
constexpr double kMostRiskLimit_mm = 50.0;
constexpr const char* kFirstTool = "drill-3.2";

// What changes the room, beside the tools.
constexpr const char* kWorkActions[] = {"undo",       "redo",       "mark",      "put_down",  "spindle",  "draw_axis",
                                        "draw_plane", "plan_point", "plan_name", "plan_wipe", "plan_undo"};
constexpr const char* kOpeningActions[] = {"open_case", "import_scan", "join_room"};

// The first file or folder that somebody drags over the window. Empty: none on this computer.
std::filesystem::path dragged_path(const QMimeData& data) {
  for (const QUrl& url : data.urls())
    if (url.isLocalFile()) return url.toLocalFile().toStdString();
  return {};
}

}  // namespace

bool MainWindow::can_hold(const std::string& name) {
  const Result<Tool> tool = find_tool(name);
  return tool && tool->cuts() && tool->kind != ToolKind::pin && tool->kind != ToolKind::screw;
}

MainWindow::MainWindow() {
  setWindowTitle("Osteon");
  setObjectName("osteon");
  resize(1280, 800);
  setAcceptDrops(true);
  sockets_ = QStandardPaths::writableLocation(QStandardPaths::RuntimeLocation).toStdString();
  stale_files_ = std::make_unique<StaleFiles>(sockets_);
  pages_ = new QStackedWidget;
  start_ = new StartPage({[this](const ExampleBone& bone) { open_example(bone); },
                          [this](const RecentEntry& entry) { practise(entry.bone, entry.session); },
                          [this] { choose_case(); }, [this] { choose_scan(); }, [this] { choose_room(); },
                          [this] {
                            if (maker_) return maker_->cancel();
                            if (checker_) return checker_->cancel();
                            leave_room();  // a room that does not answer
                          }});
  view_ = new BoneView;
  view_->setObjectName("bone");
  view_->setAccessibleName(tr("The bone"));
  view_->set_events({[this] { send_pointer(); },
                     [this] {
                       tour_->did(TourStep::push);
                       mark_before(tr("Before %1").arg(tool_title(view_->pointer().tool())));
                     },
                     [this](const SurfaceHit& hit) { place_item(hit); },
                     [this](const ViewFrustum& from) {
                       if (room_) room_->look(from);
                     },
                     [this] { return room_ ? room_->people() : std::vector<PersonSeen>(); }});
  pages_->addWidget(start_);
  pages_->addWidget(view_);
  make_imaging_page();
  setCentralWidget(pages_);
  make_panels();
  make_actions();
  make_status();
  tour_ = new Tour(this);
  enable_room_actions(false);
  clock_.start();
  connect(&gauge_timer_, &QTimer::timeout, this, [this] { refresh_gauges(); });
  connect(&pointer_timer_, &QTimer::timeout, this, [this] { send_pointer(); });
  connect(&cap_timer_, &QTimer::timeout, this, [this] {
    constexpr double kLongest_s = 0.1;
    view_->follow_cap(space_mouse_.cap(), std::min(kLongest_s, 1e-3 * static_cast<double>(capped_.restart())));
    follow_pad();
  });
  const QSettings settings;
  restoreGeometry(settings.value("window/geometry").toByteArray());
  restoreState(settings.value("window/state").toByteArray());
}

MainWindow::~MainWindow() {
  leave_room();
  delete c_arm_;  // it uses a member, and Qt would delete it after those
}

void MainWindow::make_panels() {
  tools_ = new SurgeryToolBar([this](const std::string& tool) { take_tool(tool); }, this);
  addToolBar(Qt::LeftToolBarArea, tools_);
  const auto dock = [this](const QString& title, const char* name, QWidget* widget, Qt::DockWidgetArea area) {
    auto* made = new QDockWidget(title, this);
    made->setObjectName(name);
    auto* scrolled = new QScrollArea;  // all panels together may be higher than the screen
    scrolled->setFrameShape(QFrame::NoFrame);
    scrolled->setWidgetResizable(true);
    scrolled->setWidget(widget);
    scrolled->setMinimumWidth(widget->minimumSizeHint().width() + scrolled->verticalScrollBar()->sizeHint().width());
    made->setWidget(scrolled);
    addDockWidget(area, made);
    return made;
  };
  clipping_ =
      new ClippingPanel([this](const Clipping& visible) { view_->clip(visible); }, [this] { return view_->camera(); });
  gauges_ = new GaugesPanel;
  properties_ = new PropertiesPanel(
      [this](const PropertiesPanel::Chosen& chosen) {
        if (chosen.push_n != view_->pointer().push_n()) tour_->did(TourStep::strength);
        view_->pointer().set_spindle_speed(chosen.spindle_rpm);
        view_->pointer().set_push(chosen.push_n);
        view_->pointer().set_wear_and_law(chosen.wear_and_law.wear, chosen.wear_and_law.law);
        send_pointer();
      },
      [this](const std::string& tool) { take_tool(tool); });
  QDockWidget* tool = dock(tr("Tool"), "tool_panel", properties_, Qt::RightDockWidgetArea);
  QDockWidget* gauges = dock(tr("Gauges"), "gauges_panel", gauges_, Qt::RightDockWidgetArea);
  QDockWidget* clipping = dock(tr("Clipping"), "clipping_panel", clipping_, Qt::RightDockWidgetArea);
  QDockWidget* connections = dock(tr("Connections"), "connection_panel",
                                  new ConnectionPanel([this] { return this->connections(); }), Qt::RightDockWidgetArea);
  make_slices();
  QDockWidget* slices = dock(tr("Slices"), "slices_panel", slices_, Qt::BottomDockWidgetArea);
  setCorner(Qt::BottomRightCorner, Qt::RightDockWidgetArea);  // the gauges keep their height
  c_arm_ = make_c_arm();
  dock(tr("C-arm"), "c_arm_panel", c_arm_, Qt::LeftDockWidgetArea)->hide();
  // One above the other, four panels would show little of each. Three tabs beside each other would cut their titles.
  tabifyDockWidget(tool, clipping);
  tabifyDockWidget(gauges, connections);
  for (QDockWidget* panel : {clipping, connections, slices}) {
    panel->hide();
    connect(panel->toggleViewAction(), &QAction::triggered, panel, [panel](bool on) {
      if (on) panel->raise();
    });
  }
  connections->toggleViewAction()->setObjectName("connections");
  connections->toggleViewAction()->setShortcut(QKeySequence("Ctrl+Shift+N"));
  slices->toggleViewAction()->setObjectName("slices");
  slices->toggleViewAction()->setShortcut(QKeySequence("Ctrl+Shift+L"));
}

void MainWindow::make_slices() {
  slices_ = new SlicesPanel(
      inside_, {[this](const Vec3& point_mm, const Vec3& into) { plan_->add_point(point_mm, into); },
                [this](std::uint32_t id, std::size_t end, const Vec3& point_mm) { plan_->drag(id, end, point_mm); },
                [this] { plan_->drop(); }});
  plan_ = new PlanBar({*view_, *slices_, [this] { return room_.get(); }, [this] { put_tool_down(); },
                       [this](const QString& sentence) { say(sentence); }});
  slices_->add_row(plan_);
}

void MainWindow::make_status() {
  risk_ = new RiskGauge;
  risk_->setObjectName("risk");
  device_ = new QLabel;
  device_->setObjectName("device");
  other_hand_ = new QLabel;
  other_hand_->setObjectName("other_hand");
  position_ = new QLabel;
  position_->setObjectName("position");
  connection_ = new QLabel;
  connection_->setObjectName("connection");
  for (QLabel* label : std::initializer_list<QLabel*>{risk_, other_hand_, device_, position_, connection_})
    statusBar()->addPermanentWidget(label);
  risk_->hide();  // the bar has shown it
}

void MainWindow::enable_room_actions(bool on) {
  const QString no_room =
      practice_ || room_ ? tr("The room opens. Wait for it.") : tr("Open a bone or join a room first.");
  const QString watches = tr("You only watch this room.");
  for (QAction* action : room_actions_) set_enabled(*action, on, no_room);
  tools_->set_tools_enabled(on && !watching_, on ? watches : no_room);
  no_tool_ = !on ? no_room : watching_ ? watches : tr("Choose a tool on the left first.");
  properties_->show_none(no_tool_);
  for (QDockWidget* panel : findChildren<QDockWidget*>())  // that of the connections says why there is no room
    set_enabled(*panel, on || panel->objectName() == "connection_panel", no_room);
  // A pointer's hand has another one. Who watches has no pointer.
  for (QAction* action : {irrigation_, suction_})
    set_enabled(*action, on && pointer_,
                on ? tr("Irrigation and suction work only with a bone that you opened in this window.") : no_room);
  if (watching_)
    for (const char* name : kWorkActions) set_enabled(*findChild<QAction*>(name), false, watches);
}

// A sentence of another program may be longer than the bar. Then its tool tip has the rest.
void MainWindow::say(const QString& sentence) {
  const int width = statusBar()->width();
  int room = width * 11 / 20;     // before the labels say anything
  constexpr int kMargin_px = 60;  // they grow with what they say
  if (!position_->text().isEmpty()) {
    room = width;
    for (const QLabel* label :
         std::initializer_list<const QLabel*>{risk_, other_hand_, device_, position_, connection_})
      if (label->isVisible() && !label->text().isEmpty()) room = std::min(room, label->x());
  }
  const QString shown =
      statusBar()->fontMetrics().elidedText(sentence, Qt::ElideRight, std::max(kMargin_px, room - kMargin_px));
  statusBar()->setToolTip(sentence);
  statusBar()->showMessage(shown, kMessage_ms);
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
  if (!is_busy() && !dragged_path(*event->mimeData()).empty()) event->acceptProposedAction();
}

void MainWindow::dropEvent(QDropEvent* event) {
  const std::filesystem::path path = dragged_path(*event->mimeData());
  if (is_busy() || path.empty()) return;
  event->acceptProposedAction();
  // Later, so that the program from which it comes need not wait.
  QTimer::singleShot(0, this, [this, path] {
    if (is_busy()) return;
    if (is_case(path)) return practise(path);
    if (is_file(path) && path.extension() == ".osteon") return open_case_file(path);
    say(tr("%1 is no case: drop an .osteon file, or the folder of a case.").arg(text_of(path)));
  });
}

void MainWindow::choose_room() {
  QDialog dialog(this);
  dialog.setWindowTitle(tr("Join a room"));
  auto* form = new QFormLayout(&dialog);
  ServerFields fields(*form);
  fields.add_address();
  QLineEdit* room = fields.add(tr("Room (empty: the only one)"), "room");
  QLineEdit* name = fields.add(tr("Your name"), "name");
  fields.add_credentials();
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Ok | QDialogButtonBox::Cancel);
  form->addRow(buttons);
  connect(buttons, &QDialogButtonBox::accepted, &dialog, &QDialog::accept);
  connect(buttons, &QDialogButtonBox::rejected, &dialog, &QDialog::reject);
  if (dialog.exec() != QDialog::Accepted) return;
  fields.remember();
  const auto credentials = fields.credentials();
  if (!credentials) {
    QMessageBox::warning(this, "Osteon", sentence_of(credentials.error()));
    return;
  }
  join({fields.address(), room->text(), name->text(), *credentials});
}

void MainWindow::enable_opening(bool on) {
  for (const char* name : kOpeningActions)
    set_enabled(*findChild<QAction*>(name), on, tr("A case is made or checked. Wait for it, or cancel it."));
}

void MainWindow::practise(const std::filesystem::path& bone, const std::filesystem::path& session,
                          const QString& name) {
  leave_room();
  if (sender_) sender_->keep(bone);  // the start page knows a case only when its room is open
  PracticeOptions options;
  options.bone = bone;
  options.folder = session.empty() ? new_session_folder(bone) : session;
  options.cache = data_folder() / "cache";
  // Another person who joins has another name, so the window finds its own hand by it.
  own_name_ = QString("osteon-%1").arg(QCoreApplication::applicationPid());
  options.hand_name = own_name_;
  options.tool = first_tool_.empty() ? kFirstTool : QString::fromStdString(first_tool_);
  options.force_choice = chosen_force();
  options.sound = sound_->isChecked();
  QDir().mkpath(text_of(options.cache));

  // A socket's path has at most 107 characters, so it is in the folder of this login and not beside the session.
  options.pointer = socket_path(sockets_, "pointer");
  auto pointer = PointerServer::listen(options.pointer);
  if (!pointer) return room_ended(QString::fromStdString(pointer.error().message));
  pointer_ = std::move(*pointer);
  options.sound_socket = socket_path(sockets_, "sound");
  if (const auto sound = sound_control_->listen(options.sound_socket); !sound)
    return room_ended(QString::fromStdString(sound.error().message));
  const QString title = name.isEmpty() ? case_on_screen(bone) : name;
  opened_ = RecentEntry{title, bone, options.folder, name, QDateTime::currentDateTime()};
  if (!session.empty())
    for (const RecentEntry& entry : recent_entries())
      if (entry.session == session) opened_ = entry;

  setWindowTitle(tr("%1 – Osteon").arg(title));
  view_->set_notice(tr("The room opens…"));
  pages_->setCurrentWidget(view_);
  practice_ = std::make_unique<PracticeRoom>(
      options, PracticeRoom::Events{[this](const QString& address) { room_opened(address); },
                                    [this](const QString& sentence) { say(sentence); },
                                    [this](const QString& sentence) { practice_failed(sentence); }});
  practice_->start();
  enable_room_actions(false);
}

void MainWindow::room_opened(const QString& address) {
  if (room_) return;  // the server is back at its address; the link finds it by itself
  enter_room({address, {}, {}, {}});
}

void MainWindow::join(const RoomAddress& room) {
  leave_room();
  own_name_ = room.name;  // that of the user's haptic client, if there is one
  sound_control_->join(listening_command(room.address, room.room, room.credentials));
  start_->show_work(tr("Joining the room at %1").arg(room.address));
  enter_room(room);
  enable_room_actions(false);
}

void MainWindow::enter_room(const RoomAddress& room) {
  address_ = room.address;
  room_name_ = room.room;
  RoomSubscriptionOptions options;
  options.address = room.address.toStdString();
  options.room = room.room.toStdString();
  options.credentials = room.credentials;
  if (!room.name.isEmpty()) options.name = room.name.toStdString();
  options.refused_patience = kJoinRefusedPatience;
  options.keep_trying = true;
  options.cache = data_folder() / "cache";  // that of the haptic client too
  options.first_look = [width = std::max(1, view_->width()), height = std::max(1, view_->height())](const Box& bone) {
    return look_of(overview(bone), width, height);
  };
  room_ = std::make_unique<RoomLink>(
      options,
      RoomLink::Events{[this] { view_->arrived(); }, [this](const WatchedRoom& joined) { show_joined(joined); },
                       [this](const Error& error) { room_ended(sentence_of(error)); }});
}

void MainWindow::watch(const RoomAddress& room) {
  join(room);
  set_watching(true);
}

void MainWindow::hold_first(const std::string& tool) {
  if (can_hold(tool)) first_tool_ = tool;
}

void MainWindow::set_watching(bool on) {
  watching_ = on;
  view_->set_following(on);
}

void MainWindow::show_joined(const WatchedRoom& room) {
  start_->end_work({});
  view_->show_room(&room_->queue(), room.bounds);
  clipping_->reset(room.bounds);
  slices_->reset(room.bounds, room.pitch_mm);
  inside_.set_room(room_.get(), opened_ ? opened_->bone : std::filesystem::path());
  c_arm_->enter(room.bounds, opened_ ? opened_->session : std::filesystem::path());
  view_options_->show_bone(QString::fromStdString(room.case_title));
  view_->set_notice({});
  view_->arrived();
  pages_->setCurrentWidget(view_);
  if (!practice_) setWindowTitle(tr("%1 – Osteon").arg(QString::fromStdString(room.case_title)));
  enable_room_actions(true);
  set_enabled(*findChild<QAction*>("save_bone"), opened_.has_value(),
              tr("Only a bone that you opened in this window can be saved here."));
  gauge_timer_.start(kGaugePeriod_ms);
  capped_.start();
  cap_timer_.start(kCapPeriod_ms);
  if (pointer_) pointer_timer_.start(kPointerPeriod_ms);
  if (!pad_)
    pad_ = std::make_unique<GamePadController>(
        *view_, GamePadController::Events{[this](const QString& sentence) { say(sentence); },
                                          [this] { findChild<QAction*>("undo")->trigger(); }});
  if (opened_) remember(*opened_);
  made_anew_.clear();
  view_->setFocus();
  tour_->did(TourStep::open);
  if (watching_) tour_->end();
  if (watching_) return say(tr("You watch. The view follows the tool; a drag turns the bone, T follows again."));
  say(tr("Choose a tool on the left, then hold the left button on the bone."));
  if (practice_ && !first_tool_.empty()) take_tool(std::exchange(first_tool_, {}));
}

void MainWindow::leave_room() {
  gauge_timer_.stop();
  pointer_timer_.stop();
  cap_timer_.stop();
  if (pad_) pad_->rest();
  put_tool_down();
  rest_other_hand();
  undo_points_.clear();
  view_->show_room(nullptr, {});
  risk_->set_plan(nullptr);
  c_arm_->leave();
  inside_.set_room(nullptr);
  room_.reset();
  slices_->reset({}, 1.0);
  plan_->clear();
  practice_.reset();
  pointer_.reset();
  sound_control_->close();
  opened_.reset();
  set_watching(false);
  enable_room_actions(false);
  address_.clear();
  own_name_.clear();
  room_name_.clear();
  setWindowTitle("Osteon");
  for (QLabel* label : {device_, position_, connection_}) label->clear();
  if (!is_busy()) start_->end_work({});
  start_->refresh();
  pages_->setCurrentWidget(start_);
  // The C library keeps what the threads of a room have freed. After ten rooms that was more than what is used.
  ::malloc_trim(0);
}

void MainWindow::room_ended(const QString& sentence) {
  // The object that reports this is still at work, so it goes later.
  QTimer::singleShot(0, this, [this, sentence] {
    leave_room();
    start_->end_work(sentence);
  });
}

void MainWindow::take_tool(const std::string& tool) {
  if (!room_ || watching_) return tools_->show_held({});
  plan_->give_up();
  const bool held = can_hold(tool) && pointer_;
  properties_->show_tool(tool, held ? QString()
                               : can_hold(tool)
                                   ? tr("Wear and force law work only with a bone that you opened in this window.")
                                   : tr("A click places this tool. It has neither wear nor force law."));
  tools_->show_held(tool);
  if (held) {
    placing_.clear();
    view_->pointer().take(tool);
    const PropertiesPanel::WearAndLaw chosen = properties_->chosen().wear_and_law;
    view_->pointer().set_wear_and_law(chosen.wear, chosen.law);
    view_->set_holding(true);
    spindle_->setChecked(true);
    view_->pointer().set_spindle(true);
    properties_->show_push(view_->pointer().push_n());
    say(tr("The left button pushes on the bone, the right one turns the tool. The wheel sets the push."));
  } else {
    placing_ = tool;
    view_->set_placing(true);
    say(tr("Click on the bone to place it there."));
  }
  view_->setFocus();
  tour_->did(TourStep::take);
  send_pointer();
}

void MainWindow::put_tool_down() {
  plan_->give_up();
  placing_.clear();
  view_->set_placing(false);
  view_->set_holding(false);
  view_->pointer().set_spindle(false);
  if (spindle_) spindle_->setChecked(false);
  tools_->show_held({});
  properties_->show_none(no_tool_);
  send_pointer();
}

void MainWindow::rest_other_hand() {
  view_->pointer().set_irrigation(false);
  view_->pointer().set_suction(false);
  for (QAction* action : {irrigation_, suction_}) action->setChecked(false);
  other_hand_->clear();
}

void MainWindow::place_item(const SurfaceHit& hit) {
  if (plan_->click(hit.point_mm) || placing_.empty()) return;
  ItemPlace where;
  where.point_mm = hit.point_mm;
  where.on_bone = true;
  mark_before(tr("Before %1").arg(tool_title(placing_)));
  ask([tool = placing_, where, body = hit.body](RoomSubscription& room) { return room.place(tool, where, body); },
      tr("Placed."));
}

void MainWindow::send_pointer() {
  if (!pointer_) return;
  ToolPointer& pointer = view_->pointer();
  // A press that waited for a slow frame is a new one: the hand has not let it go.
  if (pointer.pushing() && sent_push_ && sent_.isValid() && sent_.hasExpired(kPointerSilence.count())) {
    pointer.release();
    say(tr("The window was busy for a second, so the hand stopped pushing. Press again."));
  }
  sent_.start();
  sent_push_ = pointer.pushing();
  if (spindle_->isChecked() != pointer.spindle()) spindle_->setChecked(pointer.spindle());
  if (std::abs(pointer.push_n() - properties_->chosen().push_n) >= 1.0) tour_->did(TourStep::strength);
  gauges_->show_push(pointer.push_n());
  properties_->show_push(pointer.push_n());
  pointer_->send(pointer.input());
}

void MainWindow::ask(RoomLink::Request request, const QString& done) {
  if (!room_) return;
  room_->ask(std::move(request),
             [this, done](const Result<RoomAnswer>& answer) { say(answer ? done : sentence_of(answer.error())); });
}

void MainWindow::mark_before(const QString& what) {
  if (!room_) return;
  room_->ask([label = what.toStdString()](RoomSubscription& room) { return room.mark(label); },
             [this](const Result<RoomAnswer>& answer) {
               if (!answer) return say(sentence_of(answer.error()));  // such as a full disk
               undo_points_.push_back(answer->place);
             });
}

void MainWindow::undo() {
  tour_->did(TourStep::undo);
  if (undo_points_.empty()) return ask([](RoomSubscription& room) { return room.undo(1); }, tr("Undone."));
  const RoomSeq to = undo_points_.back();
  undo_points_.pop_back();
  ask([to](RoomSubscription& room) { return room.undo_to(to); }, tr("Undone."));
}

void MainWindow::mark_moment() {
  bool ok = false;
  const QString label = QInputDialog::getText(this, tr("Mark this moment"), tr("Its name"), QLineEdit::Normal, {}, &ok);
  if (ok && !label.isEmpty())
    ask([label = label.toStdString()](RoomSubscription& room) { return room.mark(label); }, tr("Marked."));
}

void MainWindow::save_picture() {
  QString file = QFileDialog::getSaveFileName(this, tr("Save the picture"), "osteon.png", tr("Pictures (*.png)"));
  if (file.isEmpty()) return;
  if (!file.endsWith(".png")) file += ".png";
  const auto saved = view_->scene().save_png(file.toStdString());
  view_->redraw();
  say(saved ? tr("Saved %1.").arg(file) : QString::fromStdString(saved.error().message));
}

void MainWindow::show_help() {
  struct Line {
    QString input, effect;
  };
  const Line lines[] = {
      {tr("Left bar"), tr("the tools; a long click shows the others of a group")},
      {tr("Mouse over the bone"), tr("the tool rests where the pointer is")},
      {tr("Left button, held"), tr("the hand pushes")},
      {tr("Wheel"), tr("how hard the hand pushes")},
      {tr("Pen"), tr("its tip pushes, as hard as you press it")},
      {tr("Sticks of a game pad"), tr("the left one moves the tool, the right one turns it")},
      {tr("Triggers of a game pad"), tr("the right one pushes, the left one runs the spindle")},
      {tr("Buttons of a game pad"), tr("A: spindle, B: undo; shoulder buttons: motion ten times smaller")},
      {tr("Right button, dragged"), tr("turns the tool; with Ctrl about its own axis")},
      {tr("Shift"), tr("motion ten times smaller")},
      {tr("Space"), tr("spindle on or off")},
      {tr("I and U"), tr("irrigation and suction of the other hand, on or off")},
      {tr("Escape"), tr("puts the tool down")},
      {tr("Middle button"), tr("turns the bone; with Shift it moves it")},
      {tr("Ctrl and wheel"), tr("nearer or farther")},
      {tr("Beside the bone, or without a tool"), tr("the left button and the wheel move the view")},
  };
  QString text;
  for (const Line& line : lines) text += QString("<p><b>%1</b>: %2</p>").arg(line.input, line.effect);
  QMessageBox::information(this, tr("How to hold a tool"), text);
}

// Who watches can do no step but the first.
TourStep MainWindow::next_step() const {
  if (!room_ || !room_->joined() || watching_) return TourStep::open;
  return view_->holding() ? TourStep::push : TourStep::take;
}

void MainWindow::follow_pad() {
  if (!pad_) return;
  RumbleInput feel;
  const std::optional<PointerOutput> hand = pointer_ ? pointer_->newest() : std::nullopt;
  // A force of before says nothing of now: the haptic client may hang, or the room be away.
  constexpr std::chrono::milliseconds kFresh{60};
  if (hand && pointer_->silence() < kFresh && room_ && !room_->interrupted()) {
    const SceneUpdater* updater = view_->updater();
    feel.force_n = hand->force_hand_n.norm();
    feel.most_n = hand->device_holds_n;
    const auto states = updater != nullptr ? updater->states() : std::span<const CuttingState>();
    const CuttingState* own = own_state(states, room_->people(), own_name_.toStdString());
    feel.cuts = own != nullptr && own->phase == CuttingPhase::cutting;
  }
  pad_->tick(isActiveWindow(), feel);
}

void MainWindow::refresh_gauges() {
  if (!room_) return;
  if (const auto failed = room_->failure_seen()) return room_ended(sentence_of(*failed));
  sound_control_->refresh();
  connection_->setText(room_->interrupted() ? tr("Connection lost, trying again")
                                            : tr("Connected to %1").arg(address_));
  plan_->refresh();
  const std::optional<PointerOutput> hand = pointer_ ? pointer_->newest() : std::nullopt;
  const SceneUpdater* updater = view_->updater();
  const auto states = updater != nullptr ? updater->states() : std::span<const CuttingState>();
  const std::vector<PersonSeen> people = room_->people();
  const std::string own_name = own_name_.toStdString();
  const CuttingState* own = own_state(states, people, own_name);
  if (!states.empty()) {
    const CuttingState& state = own != nullptr ? *own : states.front();
    gauges_->show(state, hand, 1e-3 * static_cast<double>(clock_.elapsed()));
    show_offset(state);
    show_other_hand(state);
  } else {
    gauges_->show_plan({}, {});
  }
  const std::vector<HeldTool> tools = held_tools(states, people, own_name);
  // The tip of the own tool, also where another one is nearer to a structure. Who has no hand sees that of the only
  // tool.
  const auto tip = std::ranges::find_if(tools, &HeldTool::own);
  const HeldTool* shown = tip != tools.end() ? &*tip : own == nullptr && tools.size() == 1 ? &tools.front() : nullptr;
  if (shown != nullptr) {
    const Vec3& at = shown->state.pose_bone_tool.position_mm;
    position_->setText(tr("Tip %1, %2, %3 mm")
                           .arg(QLocale().toString(at.x(), 'f', 1), QLocale().toString(at.y(), 'f', 1),
                                QLocale().toString(at.z(), 'f', 1)));
  } else if (!position_->text().isEmpty()) {
    position_->clear();
  }
  risk_->set_plan(updater != nullptr ? updater->plan() : nullptr);
  risk_->show_tools(tools);
  const bool planned = updater != nullptr && findChild<QAction*>("planned")->isChecked();
  slices_->refresh(shown != nullptr ? &shown->state : nullptr, planned ? updater->plan().get() : nullptr);
  if (const QString fault = QString::fromStdString(view_->take_plan_fault()); !fault.isEmpty()) say(fault);
  if (pointer_)
    device_->setText(!pointer_->connected() ? tr("The pointer's device is away")
                     : view_->pad_leads()   ? tr("Game pad")
                                            : tr("Pointer"));
  if (hand && !hand->trouble.empty()) say(QString::fromStdString(hand->trouble));
}

void MainWindow::show_offset(const CuttingState& state) {
  const auto offset = plan_->offset_of(state);
  gauges_->show_plan(offset ? std::optional(offset->first) : std::nullopt, offset ? offset->second : QString());
}

// Of the tool that the gauges show, as everybody in the room sees it.
void MainWindow::show_other_hand(const CuttingState& state) {
  QStringList does;
  if (state.irrigation) does << tr("Irrigation");
  if (state.suction) does << tr("Suction");
  other_hand_->setText(does.join(", "));
}

ConnectionState MainWindow::connections() {
  if (room_) room_->ping();
  ConnectionState state;
  state.address = address_;
  state.room = room_name_;
  state.practice = practice_ != nullptr;
  state.watching = watching_;
  state.joined = room_ && room_->joined();
  state.interrupted = room_ && room_->interrupted();
  if (room_) state.round_trip_ms = room_->round_trip_ms();
  if (practice_) {
    state.server = practice_->server_state();
    state.haptic = practice_->haptic_state();
    state.audio = practice_->audio_state();
  }
  if (pointer_) {
    state.pointer_connected = pointer_->connected();
    state.hand = pointer_->newest();
    if (const auto silence = pointer_->silence()) state.pointer_silence_ms = silence->count();
  }
  state.sound_on = sound_control_->on();
  state.sound = sound_control_->report();
  return state;
}

bool MainWindow::event(QEvent* event) {
  // Before any short cut or part of the window has the key, which also puts the tool down.
  if (event->type() == QEvent::ShortcutOverride && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape)
    tour_->end();
  return QMainWindow::event(event);
}

void MainWindow::showEvent(QShowEvent* event) {
  QMainWindow::showEvent(event);
  // Later, when the parts have their places.
  QTimer::singleShot(0, this, [this] {
    if (!watching_) tour_->begin_once();
  });
}

void MainWindow::choose_risk_limit() {
  bool ok = false;
  const double limit_mm =
      QInputDialog::getDouble(this, tr("Structures at risk"), tr("Warn when the tip is nearer than (mm):"),
                              risk_->limit_mm(), 0.0, kMostRiskLimit_mm, 1, &ok);
  if (ok) risk_->set_limit_mm(limit_mm);
}

void MainWindow::closeEvent(QCloseEvent* event) {
  if (saver_ && !closes_when_saved_) {
    closes_when_saved_ = true;
    say(tr("The window closes when the bone is saved. Close it once more to give that up."));
    return event->ignore();
  }
  const bool sends = sender_ && sender_->sending();
  if (sends && !closes_when_sent_) {
    closes_when_sent_ = true;
    say(tr("The window closes when the case is sent. Close it once more to give that up."));
    return event->ignore();
  }
  saver_.reset();
  if (sends) sender_.reset();
  QSettings settings;
  settings.setValue("window/geometry", saveGeometry());
  settings.setValue("window/state", room_layout_.isEmpty() ? saveState() : room_layout_);
  if (maker_) maker_->cancel();
  imaging_->cancel();
  checker_.reset();
  leave_room();
  event->accept();
}

}  // namespace osteon
