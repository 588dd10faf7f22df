// The menus of the window, and the bar above its picture.
#include <QAction>
#include <QApplication>
#include <QDockWidget>
#include <QMenu>
#include <QMenuBar>
#include <QMessageBox>
#include <QToolBar>
#include <utility>

#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/force_menu.hpp"
#include "viewer_client/desktop/language.hpp"
#include "viewer_client/desktop/main_window.hpp"
#include "viewer_client/desktop/menu_keys.hpp"
#include "viewer_client/desktop/plan_bar.hpp"
#include "viewer_client/desktop/practice_room.hpp"
#include "viewer_client/desktop/properties_panel.hpp"
#include "viewer_client/desktop/sound_control.hpp"
#include "viewer_client/desktop/tool_bar.hpp"
#include "viewer_client/desktop/view_options.hpp"

namespace osteon {

QAction* MainWindow::add_action(QMenu* menu, const QString& words, const char* name, const QKeySequence& keys,
                                std::function<void()> call, bool in_room) {
  auto* made = new QAction(words, this);
  made->setObjectName(name);
  made->setShortcut(keys);
  connect(made, &QAction::triggered, this, [call = std::move(call)] { call(); });
  menu->addAction(made);
  if (in_room) room_actions_.push_back(made);
  return made;
}

void MainWindow::make_file_menu() {
  QMenu* file = menuBar()->addMenu(tr("&File"));
  add_action(
      file, tr("&Start page"), "start_page", QKeySequence("Ctrl+Home"), [this] { leave_room(); }, true);
  add_action(
      file, tr("&Open a case…"), "open_case", QKeySequence::Open, [this] { choose_case(); }, false);
  add_action(
      file, tr("&Import a CT…"), "import_scan", QKeySequence("Ctrl+I"), [this] { choose_scan(); }, false);
  add_action(
      file, tr("&Join a room…"), "join_room", QKeySequence("Ctrl+J"), [this] { choose_room(); }, false);
  file->addSeparator();
  add_action(
      file, tr("Save a &picture…"), "save_picture", QKeySequence::Save, [this] { save_picture(); }, true);
  add_action(
      file, tr("Save &bone as…"), "save_bone", QKeySequence("Ctrl+E"), [this] { save_bone_as(); }, true);
  add_action(
      file, tr("S&end a case to a server…"), "send_case", QKeySequence("Ctrl+U"), [this] { choose_case_to_send(); },
      false);
  file->addSeparator();
  add_action(
      file, tr("&Quit"), "quit", QKeySequence::Quit, [this] { close(); }, false);
}

void MainWindow::make_edit_menu() {
  QMenu* edit = menuBar()->addMenu(tr("&Edit"));
  add_action(
      edit, tr("&Undo"), "undo", QKeySequence::Undo, [this] { undo(); }, true);
  add_action(
      edit, tr("&Redo"), "redo", QKeySequence::Redo,
      [this] { ask([](RoomSubscription& room) { return room.redo(1); }, tr("Done again.")); }, true);
  add_action(
      edit, tr("&Mark this moment…"), "mark", QKeySequence("Ctrl+M"), [this] { mark_moment(); }, true);
}

void MainWindow::make_view_menu() {
  QMenu* view = menuBar()->addMenu(tr("&View"));
  add_action(
      view, tr("&Whole bone"), "overview", Qt::Key_O, [this] { view_->look_overview(); }, true);
  add_action(
      view, tr("At the &tool"), "look_tool", Qt::Key_T, [this] { view_->look_tool(); }, true);
  view->addSeparator();
  struct Side {
    QString words;
    const char* name;
    const char* keys;
    Vec3 side;  // LPS: x to the patient's left, y to the back, z to the head
  };
  const Side sides[] = {{tr("From the &front"), "front", "Ctrl+1", {0, -1, 0}},
                        {tr("From the &back"), "back", "Ctrl+2", {0, 1, 0}},
                        {tr("From the patient's &left"), "left", "Ctrl+3", {1, 0, 0}},
                        {tr("From the patient's &right"), "right", "Ctrl+4", {-1, 0, 0}},
                        {tr("From &above"), "above", "Ctrl+5", {0, 0, 1}},
                        {tr("From b&elow"), "below", "Ctrl+6", {0, 0, -1}}};
  for (const Side& side : sides)
    add_action(
        view, side.words, side.name, QKeySequence(side.keys), [this, from = side.side] { view_->look_from(from); },
        true);
  view->addSeparator();
  add_action(
      view, tr("F&ull screen"), "full_screen", QKeySequence::FullScreen,
      [this] { isFullScreen() ? showNormal() : showFullScreen(); }, false);
  view_options_ = new ViewOptions(
      *view_, *view,
      [this](QMenu* menu, const QString& words, const char* name, const QKeySequence& keys,
             std::function<void()> call) { return add_action(menu, words, name, keys, std::move(call), true); },
      [this](const QString& sentence) { say(sentence); }, this);
  QMenu* overlays = view_options_->overlays();
  add_action(
      overlays, tr("Warn near structures at risk…"), "risk_limit", {}, [this] { choose_risk_limit(); }, false);
  view->addSeparator();
  QMenu* panels = view->addMenu(tr("Panels"));
  for (QDockWidget* panel : findChildren<QDockWidget*>()) panels->addAction(panel->toggleViewAction());
  view->addSeparator();
  fill_language_menu(*view->addMenu(tr("La&nguage")), [this](const QString& sentence) { say(sentence); });
}

void MainWindow::make_plan_menu() {
  plan_->fill(*menuBar()->addMenu(tr("&Plan")), [this](QMenu* menu, const QString& words, const char* name,
                                                       const QKeySequence& keys, std::function<void()> call) {
    return add_action(menu, words, name, keys, std::move(call), true);
  });
}

void MainWindow::make_tools_menu() {
  QMenu* tools = menuBar()->addMenu(tr("&Tools"));
  tools_->fill(*tools);
  tools->addSeparator();
  add_action(
      tools, tr("&Put the tool down"), "put_down", Qt::Key_Escape,
      [this] {
        put_tool_down();
        say(tr("Choose a tool on the left, then hold the left button on the bone."));
      },
      true);
  spindle_ = add_action(
      tools, tr("Run the &spindle"), "spindle", Qt::Key_R,
      [this] {
        view_->pointer().set_spindle(spindle_->isChecked());
        send_pointer();
      },
      true);
  spindle_->setCheckable(true);
  make_other_hand(tools);
  fill_force_menu(*tools->addMenu(tr("Force on the hand")), [this] {
    if (!practice_) return say(tr("The next practice room shows force in this way."));
    practice_->show_force(chosen_force());
    say(tr("The haptic client starts again to show force in this way."));
  });
  sound_ = add_action(
      tools, tr("S&ound"), "sound", QKeySequence("Ctrl+Shift+S"),
      [this] { sound_control_->set_on(sound_->isChecked()); }, false);
  sound_control_ = new SoundControl({[this](bool on) {
                                       sound_->setChecked(on);
                                       if (on && practice_) practice_->want_sound();
                                     },
                                     [this](const QString& sentence) { say(sentence); }},
                                    this);
  sound_->setCheckable(true);
  sound_->setChecked(sound_control_->on());
  add_action(
      tools, tr("&Volume and waveform…"), "sound_settings", QKeySequence("Ctrl+Shift+V"),
      [this] { sound_control_->show_dialog(); }, false);
}

void MainWindow::make_other_hand(QMenu* tools) {
  irrigation_ = add_action(
      tools, tr("&Irrigation"), "irrigation", Qt::Key_I,
      [this] {
        view_->pointer().set_irrigation(irrigation_->isChecked());
        send_pointer();
      },
      true);
  suction_ = add_action(
      tools, tr("S&uction"), "suction", Qt::Key_U,
      [this] {
        view_->pointer().set_suction(suction_->isChecked());
        send_pointer();
      },
      true);
  for (QAction* action : {irrigation_, suction_}) {
    action->setCheckable(true);
    properties_->add_switch(*action);
  }
}

void MainWindow::make_help_menu() {
  QMenu* help = menuBar()->addMenu(tr("&Help"));
  add_action(
      help, tr("&How to hold a tool"), "help", QKeySequence::HelpContents, [this] { show_help(); }, false);
  add_action(
      help, tr("&Tour"), "tour_again", QKeySequence("Ctrl+F1"), [this] { tour_->begin(next_step()); }, false);
  add_action(
      help, tr("&About Osteon"), "about", {},
      [this] {
        QMessageBox::about(
            this, tr("About Osteon"),
            tr("Osteon %1 simulates bone surgery. It is for research and teaching. It is not a medical device.")
                .arg(QApplication::applicationVersion()));
      },
      false);
}

void MainWindow::make_actions() {
  make_file_menu();
  make_edit_menu();
  make_view_menu();
  make_plan_menu();
  make_tools_menu();
  make_help_menu();
  for (const QAction* menu : menuBar()->actions()) {
    add_menu_keys(*menu->menu());
    show_tool_tips(*menu->menu());
  }
  QToolBar* upper = addToolBar(tr("Actions"));
  upper->setObjectName("actions");
  for (const char* name :
       {"open_case", "save_picture", "undo", "redo", "mark", "overview", "look_tool", "spindle", "put_down"})
    upper->addAction(findChild<QAction*>(name));
  upper->widgetForAction(findChild<QAction*>("undo"))->setObjectName("undo_button");
}

}  // namespace osteon
