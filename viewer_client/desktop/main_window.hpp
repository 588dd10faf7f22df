// The window of Osteon: the start page, and the page on which a person operates.
#pragma once
#include <QCoreApplication>
#include <QElapsedTimer>
#include <QMainWindow>
#include <QTimer>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/input/pointer_link.hpp"
#include "common/input/space_mouse.hpp"
#include "viewer_client/desktop/inside_link.hpp"
#include "viewer_client/desktop/library.hpp"
#include "viewer_client/desktop/practice_room.hpp"
#include "viewer_client/desktop/room_link.hpp"
#include "viewer_client/desktop/server_fields.hpp"
#include "viewer_client/desktop/stale_files.hpp"
#include "viewer_client/desktop/tour.hpp"

class QAction;
class QKeySequence;
class QLabel;
class QMenu;
class QStackedWidget;

namespace osteon {

class BoneView;
class CArmPanel;
class ClippingPanel;
class GaugesPanel;
class GamePadController;
class ImagingPage;
class PlanBar;
class PropertiesPanel;
class SoundControl;
class RiskGauge;
class SendDialog;
class SlicesPanel;
class StartPage;
class SurgeryToolBar;
class ViewOptions;
struct ConnectionState;
struct CuttingState;

class MainWindow : public QMainWindow {
  Q_DECLARE_TR_FUNCTIONS(MainWindow)

 public:
  MainWindow();
  ~MainWindow() override;

  // Opens a case to practise on, alone. `session`: a folder of an earlier session to go on with; empty: a new one.
  // `name`: shown to people; empty: the title of the case.
  void practise(const std::filesystem::path& bone, const std::filesystem::path& session = {}, const QString& name = {});
  // A case in one file. It is unpacked into the user's data folder first, once for each content.
  void open_case_file(const std::filesystem::path& file);
  // The case of the practice room as one file. Goes on in the background. A window that is closed meanwhile waits for
  // its end; closed once more, it leaves the file as it was.
  void save_case_file(const QString& file);
  // Opens the dialog that sends a case to a server. `what`: the folder of a case, or a file with one. A dialog that is
  // at work, or has this case, stays instead.
  void send_case(const std::filesystem::path& what);
  // The same for a case that image processing has made to be sent: it stays on this computer only if it is sent. While
  // another one is being sent, it stays, and no dialog opens for it. Returns what the user does next.
  QString send_made_case(const std::filesystem::path& bone);
  void open_example(const ExampleBone& bone);
  void join(const RoomAddress& room);
  // Joins, but only to look: no tool can be taken, and nothing be placed or undone. The view follows the work.
  void watch(const RoomAddress& room);
  // The tool that the hand holds as soon as a room to practise in is open. A tool that can_hold() refuses is ignored.
  void hold_first(const std::string& tool);
  // Whether a hand can hold a tool of this name.
  [[nodiscard]] static bool can_hold(const std::string& tool);
  void import_scan(const QString& source);
  // Opens a folder or file with a CT on the page on which a person chooses its series and bones.
  void process_images(const QString& source);

 protected:
  void closeEvent(QCloseEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;
  bool event(QEvent* event) override;
  void showEvent(QShowEvent* event) override;

 private:
  // An action in a menu. `in_room`: it is of use in a room only.
  QAction* add_action(QMenu* menu, const QString& words, const char* name, const QKeySequence& keys,
                      std::function<void()> call, bool in_room);
  void make_actions();
  void make_file_menu();
  void make_edit_menu();
  void make_view_menu();
  void make_plan_menu();
  void make_tools_menu();
  void make_other_hand(QMenu* tools);
  void make_help_menu();
  void make_panels();
  [[nodiscard]] CArmPanel* make_c_arm();
  void make_slices();
  void make_status();

  // `session`: to go on with in the case, as of practise().
  void make_case(const QString& what, const QStringList& how, const std::filesystem::path& out,
                 const QString& name = {}, const std::filesystem::path& session = {});
  // A case is made or checked.
  [[nodiscard]] bool is_busy() const;
  // The practice room has ended for good, for this reason.
  void practice_failed(const QString& sentence);
  // Checks a case. Makes a damaged one anew. For a sound one the start page shows `sentence`.
  void check_case(const RecentEntry& entry, const QString& sentence);
  // Makes the case of an example again and goes on with its session. Removes an unpacked case: the user opens its file
  // again.
  void make_anew(const RecentEntry& entry);
  void make_imaging_page();
  void lay_out_page();
  void choose_scan();
  // The folder or the file of a case; empty: none. `folder`: where the dialog begins.
  [[nodiscard]] std::filesystem::path chosen_case(const QString& title, const QString& folder);
  void choose_case();
  void save_bone_as();
  // The open bone, or else one that the user chooses.
  void choose_case_to_send();
  void open_send_dialog(const std::filesystem::path& what, const QString& title, bool stays);
  // A case is being sent: says so, and shows its dialog.
  bool sends_already();
  void raise_sender();
  void choose_room();
  void enter_room(const RoomAddress& room);
  void leave_room();
  void room_opened(const QString& address);
  void show_joined(const WatchedRoom& room);
  void room_ended(const QString& sentence);
  void take_tool(const std::string& tool);
  void put_tool_down();
  void rest_other_hand();
  void place_item(const SurfaceHit& hit);
  void send_pointer();
  void ask(RoomLink::Request request, const QString& done);
  // Undo goes back to the moment before a push or an item, not by single cuts: a second of drilling is hundreds of
  // them.
  void mark_before(const QString& what);
  void undo();
  void mark_moment();
  void save_picture();
  void show_help();
  // The step of the tour that the user has still to do.
  [[nodiscard]] TourStep next_step() const;
  void follow_pad();
  void refresh_gauges();
  void show_offset(const CuttingState& state);
  void show_other_hand(const CuttingState& state);
  [[nodiscard]] ConnectionState connections();
  void choose_risk_limit();
  void say(const QString& sentence);
  void enable_room_actions(bool on);
  // What opens something else. Not while a case is made, which then opens by itself.
  void enable_opening(bool on);
  void set_watching(bool on);

  QStackedWidget* pages_ = nullptr;
  QByteArray room_layout_;  // of panels and tools, while the page of image processing has their place
  StartPage* start_ = nullptr;
  ImagingPage* imaging_ = nullptr;
  BoneView* view_ = nullptr;
  SurgeryToolBar* tools_ = nullptr;
  GaugesPanel* gauges_ = nullptr;
  PropertiesPanel* properties_ = nullptr;
  ClippingPanel* clipping_ = nullptr;
  SlicesPanel* slices_ = nullptr;
  PlanBar* plan_ = nullptr;
  CArmPanel* c_arm_ = nullptr;
  ViewOptions* view_options_ = nullptr;
  SoundControl* sound_control_ = nullptr;
  Tour* tour_ = nullptr;
  RiskGauge* risk_ = nullptr;
  QLabel *position_ = nullptr, *device_ = nullptr, *connection_ = nullptr, *other_hand_ = nullptr;
  std::vector<QAction*> room_actions_;
  QAction *sound_ = nullptr, *spindle_ = nullptr, *irrigation_ = nullptr, *suction_ = nullptr;

  std::filesystem::path sockets_;
  std::unique_ptr<StaleFiles> stale_files_;  // outlives the programs below
  std::unique_ptr<CaseMaker> maker_;
  std::unique_ptr<ImporterRun> saver_, checker_;
  std::unique_ptr<SendDialog> sender_;
  std::filesystem::path made_anew_;  // the case that make_anew() got last; empty: a room has opened since
  std::unique_ptr<PointerServer> pointer_;
  std::unique_ptr<PracticeRoom> practice_;
  InsideLink inside_;
  std::unique_ptr<RoomLink> room_;
  std::optional<RecentEntry> opened_;
  std::vector<RoomSeq> undo_points_;  // before each push and each item, oldest first
  std::string first_tool_;            // that the hand takes in the next room; empty: none
  bool watching_ = false;
  bool closes_when_saved_ = false, closes_when_sent_ = false;
  std::string placing_;  // the item that the next click places
  QString address_, room_name_;
  QString own_name_;  // of the user's hand in the room; empty: none
  QString no_tool_;   // why the panel Tool has no tool
  QTimer gauge_timer_, pointer_timer_, cap_timer_;
  QElapsedTimer clock_;
  QElapsedTimer capped_;    // since the SpaceMouse was asked last
  QElapsedTimer sent_;      // since the last message to the hand
  bool sent_push_ = false;  // what it said
  SpaceMouseWatch space_mouse_{[](const std::string&) {}};
  std::unique_ptr<GamePadController> pad_;  // from the first room on
};

}  // namespace osteon
