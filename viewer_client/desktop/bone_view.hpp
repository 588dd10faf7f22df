// The picture of the bone in the window, and the mouse over it. Without a tool the left button turns the bone, as in an
// image viewer. With a tool the left button pushes, the right button turns the tool, and the wheel sets the push. The
// middle button always moves the camera. A pen pushes with its tip, as hard as it is pressed. A game pad does the same
// by its sticks and triggers.
#pragma once
#include <QCoreApplication>
#include <QPoint>
#include <QTimer>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <QVTKOpenGLNativeWidget.h>

#include "common/input/space_mouse_report.hpp"
#include "viewer_client/pad/game_pad_mapping.hpp"
#include "viewer_client/render/bone_scene.hpp"
#include "viewer_client/render/scene_updater.hpp"
#include "viewer_client/scene/supervision_client.hpp"
#include "viewer_client/scene/tool_pointer.hpp"

namespace osteon {

// [GUI thread]
class BoneView : public QVTKOpenGLNativeWidget {
  Q_DECLARE_TR_FUNCTIONS(BoneView)

 public:
  struct Events {
    std::function<void()> pointed;                    // pointer() changed
    std::function<void()> pressed;                    // a push begins
    std::function<void(const SurfaceHit&)> clicked;   // a click on the bone while placing() is on
    std::function<void(const ViewFrustum&)> looked;   // the camera moved
    std::function<std::vector<PersonSeen>()> people;  // those of the room, as far as they are known
  };

  explicit BoneView(QWidget* parent = nullptr);
  ~BoneView() override;

  // Shows what arrives in this queue. The scene is empty again. The queue must outlive the next call. Null: no room.
  void show_room(RenderQueue* queue, const Box& bounds);
  void set_events(Events events) { events_ = std::move(events); }
  // Something waits in the queue.
  void arrived();

  [[nodiscard]] ToolPointer& pointer() { return pointer_; }
  // The mouse holds the tool. False: it moves the camera.
  void set_holding(bool on);
  [[nodiscard]] bool holding() const { return holding_; }
  // The next click says where an item is to stand.
  void set_placing(bool on);
  [[nodiscard]] bool placing() const { return placing_; }

  void look(const CameraView& view);
  [[nodiscard]] CameraView camera() const;
  void look_overview();
  // From a direction: the eye lies that way from the middle of the bone.
  void look_from(const Vec3& side);
  // At the first tool in a hand. That of an ended session is in no hand.
  void look_tool();
  // The camera goes after that tool, until look() or the mouse moves it. look_tool() sends it after the tool
  // again.
  void set_following(bool on);
  // The cap of a SpaceMouse was held so for dt_s. Its twist turns the tool in the hand, and its push moves the bone.
  // Without a tool the bone follows both.
  void follow_cap(const SpaceMouseState& cap, double dt_s);
  // A game pad asked for this for dt_s. Its left stick moves the tool over the bone, its right one turns the tool.
  // Without a tool they move and turn the bone.
  void follow_pad(const GamePadCommand& command, double dt_s);
  // The pad is away: the mouse says again where the tool is.
  void pad_gone();
  [[nodiscard]] bool pad_leads() const { return pad_leads_; }
  [[nodiscard]] bool following() const { return following_; }
  void set_notice(const QString& notice);
  // How the bone is drawn. It holds for the rooms that follow too.
  void show_marker(bool on);
  void show_planned(bool on);
  void show_risks(bool on);
  void clip(const Clipping& visible);
  // What people have drawn on the bone of this room.
  void show_annotations(const std::vector<Annotation>& drawn);
  // False: the display does not have the mode, and stereo is off.
  [[nodiscard]] bool set_stereo(StereoMode mode);

  [[nodiscard]] const SceneUpdater* updater() const { return updater_ ? &*updater_ : nullptr; }
  // A sentence why structures at risk are missing, once. Empty: none.
  [[nodiscard]] std::string take_plan_fault() { return updater_ ? updater_->take_plan_fault() : std::string(); }
  [[nodiscard]] BoneScene& scene() { return *scene_; }
  // Marks the picture as old. It is drawn soon, at most at the display's rate.
  void redraw();
  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] bool surface_shown() const { return surface_shown_; }

 protected:
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void tabletEvent(QTabletEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  void draw();
  void point_at(const QPoint& at);
  // The line of sight through a pixel of the picture, or of one of the two pictures side by side.
  [[nodiscard]] SightRay sight(const QPoint& at) const;
  // Looks from there, so that the whole bone is in the picture, also when the window becomes smaller.
  void look_whole(const CameraView& from);
  void turn_camera(const QPoint& by, Qt::KeyboardModifiers keys);
  void camera_moved();
  // Null: all hands are empty.
  [[nodiscard]] const CuttingState* held_tool() const;
  void follow_tool();
  void pointer_moved();
  void lift_pen();
  [[nodiscard]] bool begin_pen_push();

  bool whole_ = false;  // nobody has moved the camera since look_whole()
  Events events_;
  std::unique_ptr<BoneScene> scene_;
  std::optional<SceneUpdater> updater_;
  Box bounds_;
  ToolPointer pointer_;
  bool holding_ = false, placing_ = false;
  bool follows_ = false;       // the camera is one that goes after the tool
  bool following_ = false;     // it does so now
  QPoint last_;                // position of the mouse, device pixels
  QPoint pressed_;             // where a button went down
  bool second_click_ = false;  // the button that went down last made it a double click
  bool camera_drag_ = false;
  std::optional<double> wheel_push_n_;  // while a pen or a pad pushes: what the wheel has set
  bool pad_leads_ = false, pad_pushes_ = false, pad_fine_ = false;
  QString notice_;
  bool marker_ = false, planned_ = false, risks_ = false;
  Clipping clipping_;
  std::vector<Annotation> annotations_;
  StereoMode stereo_ = StereoMode::off;
  QTimer frame_timer_;
  std::chrono::steady_clock::time_point next_frame_{};
  bool drawing_ = false, surface_shown_ = false;
  std::uint64_t frames_ = 0;
};

}  // namespace osteon
