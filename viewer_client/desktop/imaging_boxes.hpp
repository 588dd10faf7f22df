// The sub-volumes of what is kept: bounding box, section boxes and the quadtree's leaves. While it is open, the planes
// and the picture in three dimensions show them. They are found anew after each edit, on a thread of their own.
#pragma once
#include <QCoreApplication>
#include <QDialog>
#include <QThread>
#include <QTimer>
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "viewer_client/desktop/imaging_plane.hpp"

class QBoxLayout;
class QLabel;
class QListWidget;
class QProgressBar;
class QPushButton;
class QSpinBox;

namespace osteon {

// [GUI thread]
class ImagingBoxes : public QDialog {
  Q_DECLARE_TR_FUNCTIONS(ImagingBoxes)

 public:
  struct Events {
    std::function<void(std::shared_ptr<const KeptBoxes> boxes)> show;  // in the scene; nothing: none
    std::function<void(const std::array<int, 3>& voxel)> look_at;
    std::function<void(const std::filesystem::path& folder, int subdivisions)> write;  // a folder that is not there
    std::function<void()> cancel;                                                      // what it writes
  };
  // `scene` outlives it, or release() is called before the scene goes.
  ImagingBoxes(const ImagingScene& scene, Events events, QWidget* parent);
  ~ImagingBoxes() override;

  // Call this before the scan or the islands of the scene change, because the other thread reads them. It stops that
  // thread, which takes the time of a slice.
  void release();
  // The scene has changed.
  void refresh();
  // Whether files may be written now. `reason`: why not.
  void allow(bool on, const QString& reason);
  // While the files are written, the dialog shows it and can cancel it. After any other work, end_work() does nothing.
  void begin_work(const QString& what);
  void show_progress(int percent);
  void end_work(const QString& sentence);
  [[nodiscard]] bool writing() const { return writing_; }
  void reject() override;

 protected:
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;

 private:
  struct Job;
  struct Wish {
    KeptParts kept;
    int subdivisions = 0;
    friend bool operator==(const Wish&, const Wish&) = default;
  };

  QBoxLayout* make_work();
  void ask();
  void take(Job& done);
  // None are known.
  void drop(const QString& why);
  // The list has the sections of the scene, and the one with the crosshair is chosen.
  void fill_list();
  void follow_crosshair();
  void choose(int section);
  void choose_folder();
  void enable_write();

  const ImagingScene& scene_;
  Events events_;
  std::optional<Wish> wanted_;
  bool filling_ = false;
  bool may_write_ = false;
  bool writing_ = false;
  QString why_not_;
  QTimer pause_;  // since the last edit
  QSpinBox* subdivisions_;
  QLabel* words_;
  QListWidget* list_;
  QLabel* work_;
  QProgressBar* progress_;
  QPushButton *write_, *cancel_, *close_;
  // The other thread writes into the job, and the GUI thread reads it when that has ended.
  std::unique_ptr<Job> job_;
  std::unique_ptr<QThread> finder_;
  std::uint64_t jobs_ = 0;  // so far
};

}  // namespace osteon
