// The fourth picture of the page of image processing: what is kept, in three dimensions, with the crosshair of the
// planes, and with soft tissue round it on demand. It is made anew after each edit, on a thread of its own.
#pragma once
#include <QCoreApplication>
#include <QThread>
#include <QTimer>
#include <QWidget>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "viewer_client/desktop/imaging_plane.hpp"
#include "viewer_client/desktop/solid_view.hpp"
#include "viewer_client/imaging/kept_surface.hpp"

class QCheckBox;
class QLabel;
class QStackedWidget;

namespace osteon {

// [GUI thread]
class ImagingSolid : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingSolid)

 public:
  struct Events {
    std::function<void(const std::array<int, 3>& voxel)> look_at;  // the user has chosen a voxel of a bone
    std::function<void(int bone, const std::array<int, 3>& voxel)> choose_bone;  // or a bone, at a voxel
  };
  // `scene` outlives it.
  ImagingSolid(const ImagingScene& scene, Events events, QWidget* parent = nullptr);
  ~ImagingSolid() override;

  // Call this before the scan or the islands of the scene change, because the other thread reads them. It stops that
  // thread, which takes the time of a slice, or that of a surface's smoothing.
  void release();
  // Another scan.
  void begin();
  // The scene has changed.
  void refresh();

  [[nodiscard]] SolidView& view() { return *view_; }
  // Whether the surface is that of the scene's edits.
  [[nodiscard]] bool current() const { return shown_ == kept(); }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void showEvent(QShowEvent* event) override;

 private:
  struct Job;

  [[nodiscard]] KeptParts kept() const;
  // Starts what is to be made. The newest wish wins: an older one is cancelled, and its end asks again.
  void ask();
  void make(std::unique_ptr<Job> job);
  void take(Job& done);
  void show_cross();
  // The tints of the bones, as on the planes.
  void show_tints();
  // `all`: also those that are there, with another radius.
  void show_marks(bool all = false);
  void show_boxes();
  // Which picture there is, and what it says.
  void show_state();

  const ImagingScene& scene_;
  Events events_;
  std::optional<KeptParts> wanted_, shown_;  // `shown_`: nothing if islands or scan have changed since
  std::optional<std::array<int, 3>> cross_;  // the crosshair of the picture
  std::map<int, Tint> tints_;                // of the bones of the picture
  std::array<std::vector<Vec3>, 3> marks_;   // by SolidMark, mm
  double mark_mm_ = 0.0;                     // their radius
  std::shared_ptr<const KeptBoxes> boxes_;   // of the picture
  int chosen_ = -1;                          // section of them
  bool has_surface_ = false, has_soft_ = false;
  QString problem_;  // why there is no surface
  QString notice_;   // in the picture
  QTimer pause_;     // since the last edit
  QCheckBox* soft_;
  QLabel* hint_;
  QStackedWidget* stack_;
  SolidView* view_;
  // The other thread writes into the job, and the GUI thread reads it when that has ended.
  std::unique_ptr<Job> job_;
  std::unique_ptr<QThread> maker_;
  std::uint64_t jobs_ = 0;  // so far
};

}  // namespace osteon
