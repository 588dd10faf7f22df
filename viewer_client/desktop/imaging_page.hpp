// The page on which a person sees a CT, chooses its bones, and makes a case of them.
#pragma once
#include <QCoreApplication>
#include <QTimer>
#include <QWidget>
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "viewer_client/desktop/imaging_histogram.hpp"
#include "viewer_client/desktop/imaging_plane.hpp"
#include "viewer_client/desktop/imaging_steps.hpp"
#include "viewer_client/imaging/edit_history.hpp"

class QBoxLayout;
class QComboBox;
class QLabel;
class QListWidget;
class QListWidgetItem;
class QProgressBar;
class QPushButton;
class QSpinBox;
class QStackedWidget;

namespace osteon {

// [GUI thread]
class ImagingPage : public QWidget {
  Q_DECLARE_TR_FUNCTIONS(ImagingPage)

 public:
  struct Events {
    std::function<void(bool busy)> busy;  // a case is being made
    std::function<void(const std::filesystem::path& bone)> made;
    std::function<void()> leave;
  };
  explicit ImagingPage(Events events, QWidget* parent = nullptr);

  // A folder, zip, ISO image or file. What is open goes.
  void open_source(const QString& source);
  [[nodiscard]] bool making() const { return steps_.making(); }
  void cancel() { steps_.cancel(); }

 private:
  [[nodiscard]] ImagingSteps::Events step_events();
  QBoxLayout* make_head();
  QBoxLayout* make_work();
  QWidget* make_planes();
  QBoxLayout* make_side();
  QPushButton* add_button(QBoxLayout& to, const QString& words, const char* name, const QString& tip,
                          std::function<void()> call);

  void choose_folder();
  void choose_file();
  void show_work(const QString& what);
  // Empty: it went well.
  void end_work(const QString& sentence);
  void show_series(const std::vector<ListedSeries>& series);
  void read_row(const QListWidgetItem* item);
  void show_scan(ShownScan scan, const HuHistogram& histogram);
  void show_islands(std::vector<ListedIsland> list, IslandMap map);
  void find_islands();
  void show_largest_bone();
  void make_bone();

  void look_at(const std::array<int, 3>& voxel);
  void point_at(const std::array<int, 3>& voxel);
  void change_window(const HuWindow& window);
  void preview_threshold(int hu);
  // Into the history.
  void take_threshold();
  void apply_threshold();
  // A seed at the voxel, or near to it in its island.
  void keep_at(const std::array<int, 3>& voxel);
  void change_island(const QListWidgetItem* item);
  [[nodiscard]] bool kept(int island) const;
  // The history has another state now.
  void follow_edits();
  void refresh_list();
  void refresh_planes();
  void enable_parts();

  Events events_;
  ImagingScene scene_;
  EditHistory history_;
  std::vector<ListedIsland> islands_;
  std::optional<double> found_hu_;  // the threshold of the islands; nothing: none were found yet
  double searched_hu_ = 0.0;        // that of the islands that are being found
  ImagingSteps steps_;
  QString wanted_source_;       // to open when the step at work has ended
  bool wants_islands_ = false;  // the same
  bool filling_ = false;        // the list changes by itself
  std::vector<ListedSeries> series_;
  QStackedWidget* stack_;
  QListWidget *series_list_, *island_list_;
  QLabel *words_, *readout_;
  QProgressBar* progress_;
  QPushButton *cancel_, *back_, *find_, *keep_, *undo_, *redo_, *make_;
  QComboBox* preset_;
  QSpinBox* threshold_;
  ImagingHistogram* histogram_;
  std::array<ImagingPlane*, 3> planes_{};
  QTimer threshold_timer_;  // the user has stopped to change the threshold
};

}  // namespace osteon
