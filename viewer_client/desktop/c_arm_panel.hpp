// The C-arm: X-ray pictures of the bone as it is now. A person turns the arm, presses a pedal, and reads what was shot.
// Nothing is computed and no X-ray is shot unless somebody asks for it while the panel is shown. The others in the room
// are told of each shot, and theirs can be seen here.
#pragma once
#include <QCoreApplication>
#include <QImage>
#include <QTimer>
#include <QWidget>
#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "viewer_client/desktop/others_shots.hpp"
#include "viewer_client/inside/c_arm_console.hpp"
#include "viewer_client/inside/c_arm_image.hpp"
#include "viewer_client/inside/shared_shots.hpp"
#include "viewer_client/inside/shot_file.hpp"
#include "viewer_client/scene/room_answer.hpp"

class QComboBox;
class QDoubleSpinBox;
class QFormLayout;
class QLabel;
class QLayout;
class QPushButton;
class QSlider;

namespace osteon {

class CArmScreen;
class InsideLink;

// As a screen of the C-arm shows it. Null image: there is none.
struct ScreenPicture {
  QImage image;
  EdgeLetters letters;
};

// [GUI thread]
class CArmPanel : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(CArmPanel)

 public:
  struct InBeam {  // what the room has now; used at once
    std::span<const CuttingState> states{};
    std::span<const SceneItem> items{};
    std::span<const Tool> tools{};  // that are not built in; only more of them come
    std::optional<Vec3> tip_mm{};   // of the tool in the user's hand
  };
  struct Events {
    std::function<InBeam()> in_beam;
    std::function<void(const QString&)> say;
    // Of everybody in the room, this window included.
    std::function<ShotsOfAll()> shots;
    // Tells the room. The answer comes in the GUI thread, unless the room is left.
    std::function<void(const SharedShots::Message&, std::function<void(const Result<RoomAnswer>&)>)> share;
  };
  // `inside` must outlive it.
  CArmPanel(InsideLink& inside, Events events, QWidget* parent = nullptr);
  ~CArmPanel() override;

  // A room, with the shots of its session. `session`: the folder in which they are kept; empty: nowhere.
  void enter(const Box& bone, const std::filesystem::path& session);
  void leave();

  [[nodiscard]] const CArmConsole& console() const { return console_; }
  // Of the last shot. Null: there is none in this window.
  [[nodiscard]] const std::shared_ptr<const CArmPicture>& picture() const { return picture_; }
  // Of another person, made again here. Null: the own ones are shown, or there is none yet.
  [[nodiscard]] const std::shared_ptr<const CArmPicture>& others_picture() const { return others_picture_; }
  // Writes the picture that is shown. Error: exists, unless `replace`; not_found (no picture); internal.
  [[nodiscard]] Result<void> save(const std::filesystem::path& file, bool replace) const;

 protected:
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;
  void changeEvent(QEvent* event) override;
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  struct Row {  // a slider with its spin box
    QSlider* slider = nullptr;
    QDoubleSpinBox* box = nullptr;
  };
  // Where pictures of another thread arrive. It outlives the panel, if that thread does.
  struct Mailbox;

  QLayout* make_screens();
  QLayout* make_pedals();
  QLayout* make_views();
  void make_rows(QFormLayout& form);
  void make_counters(QFormLayout& form);
  Row add_row(QFormLayout& form, const QString& what, const char* name, int most, const QString& unit,
              std::function<void(double)> set);
  void show_position();
  void show_counters();
  void show_status();
  void show_screens();
  [[nodiscard]] const ScreenPicture& shown() const;
  [[nodiscard]] QString words_about(const InsideStatus& now) const;  // while pictures can be made
  void choose_file();

  void stop();  // nothing is made or waited for any more
  void press(ShotMode mode);
  void release();
  void tick();
  void moved();  // by the user
  void receive(const std::shared_ptr<const CArmPicture>& picture);
  void keep_shot();
  void share();
  void take_others();
  void show_others(const std::optional<ShotRun>& run);
  void receive_others(const std::shared_ptr<const CArmPicture>& picture);
  [[nodiscard]] bool maximum() const;  // the panel shows maximum intensity, and no X-rays
  void show_maximum();
  [[nodiscard]] std::vector<PlacedMetal> metal_in_beam();
  [[nodiscard]] QString trouble() const;  // why no picture can be made; empty: one can

  InsideLink& inside_;
  Events events_;
  CArmConsole console_;
  std::optional<ShotFile> file_;
  std::optional<MetalInBeam> metal_;  // of this room; none: nothing was shot yet
  std::size_t tools_known_ = 0;
  std::shared_ptr<Mailbox> mailbox_;  // shared with both images
  std::shared_ptr<CArmImage> image_;  // shared with the inside of the bone
  bool in_room_ = false;
  bool run_begins_ = false;  // the next shot is the first one of a press
  QTimer pedal_timer_, status_timer_, share_timer_;

  SharedShots shared_;
  bool observes_ = false;            // the others are not told
  std::optional<Error> not_shared_;  // why the room does not take them
  OthersShots* others_ = nullptr;
  std::shared_ptr<CArmImage> others_image_;  // shared with the inside of the bone
  std::uint64_t others_id_ = 0;              // of the newest picture that others_image_ was asked for
  std::uint64_t others_first_id_ = 1;        // of the first one of the same press
  std::optional<ShotRun> others_run_;        // the press that they are of
  QString others_time_;                      // when the newest picture was asked for
  std::shared_ptr<const CArmPicture> others_picture_;

  std::shared_ptr<const CArmPicture> picture_;
  CArmScreen *last_ = nullptr, *before_ = nullptr;
  ScreenPicture shot_, shot_before_, projection_, others_shot_;
  QComboBox* kind_ = nullptr;
  QPushButton *single_ = nullptr, *pulse_ = nullptr, *live_ = nullptr, *save_ = nullptr;
  QLabel *shots_ = nullptr, *seconds_ = nullptr, *dose_ = nullptr, *words_ = nullptr;
  std::array<Row, 5> rows_{};  // orbit, tilt, and along the three axes
  bool showing_ = false;       // its own change of a value is none of the user's
  QString fault_;              // of the file of this session
};

}  // namespace osteon
