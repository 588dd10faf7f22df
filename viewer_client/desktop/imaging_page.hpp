// The page on which a person sees a CT, chooses its bones, and makes a case of them.
#pragma once
#include <QCoreApplication>
#include <QElapsedTimer>
#include <QTimer>
#include <QWidget>
#include <array>
#include <bitset>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "viewer_client/desktop/imaging_boxes.hpp"
#include "viewer_client/desktop/imaging_histogram.hpp"
#include "viewer_client/desktop/imaging_landmarks.hpp"
#include "viewer_client/desktop/imaging_plane.hpp"
#include "viewer_client/desktop/imaging_solid.hpp"
#include "viewer_client/desktop/imaging_steps.hpp"
#include "viewer_client/desktop/imaging_tools.hpp"
#include "viewer_client/imaging/edit_history.hpp"

class QBoxLayout;
class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QFormLayout;
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
    // `said`: where the report is, if there is one.
    std::function<void(const std::filesystem::path& bone, const QString& said)> made;
    std::function<bool()> may_send;  // now; if not, it has told why
    // It was made for that. Returns what the user does next.
    std::function<QString(const std::filesystem::path& bone)> send;
    std::function<void()> leave;
  };
  explicit ImagingPage(Events events, QWidget* parent = nullptr);
  // The scene goes before the widgets that show it.
  ~ImagingPage() override { release_scene(); }

  // Asks whether the scan is a folder or a file, and then for it, beside the last one. Empty: none was chosen.
  static QString ask_for_source(QWidget* parent);
  // A folder, zip, ISO image or file. What is open goes.
  void open_source(const QString& source);
  [[nodiscard]] bool has_scan() const { return scene_.open(); }
  [[nodiscard]] bool making() const { return steps_.making(); }
  void cancel() { steps_.cancel(); }
  // Somebody may have removed the case that it made, which it says then.
  void check_made();

 protected:
  void hideEvent(QHideEvent* event) override;
  void showEvent(QShowEvent* event) override;

 private:
  // Before the scan or the islands of the scene change.
  void release_scene() {
    solid_->release();
    boxes_->release();
  }
  [[nodiscard]] ImagingSteps::Events step_events();
  QBoxLayout* make_head();
  QBoxLayout* make_work();
  QBoxLayout* make_planes();
  QBoxLayout* make_foot();
  void add_filter(QFormLayout& form);
  QBoxLayout* make_side();
  QPushButton* add_button(QBoxLayout& to, const QString& words, const char* name, const QString& tip,
                          std::function<void()> call);

  static QString ask_for_folder(QWidget* parent);
  static QString ask_for_file(QWidget* parent);
  void choose_folder();
  void choose_file();
  void show_work(const QString& what);
  // Empty: it went well.
  void end_work(const QString& sentence);
  void show_series(const std::vector<ListedSeries>& series);
  void read_row(const QListWidgetItem* item);
  // While the series is being read: its middle slice. Nothing, if the list has none.
  void show_first(const ListedSeries& of);
  // All planes and the picture in three dimensions, with the middle of the scan.
  void begin_planes();
  // It was not read: back to the list.
  void forget_first();
  void show_scan(ShownScan scan, const HuHistogram& histogram);
  void show_filtered(ShownScan scan, const HuHistogram& histogram);
  void show_islands(std::vector<ListedIsland> list, IslandMap map);
  void find_islands();
  void show_largest_bone();
  // Or takes the case again that it has just made of the same edits.
  void make_bone(bool sends);
  void make_and_send();
  void use_made(const std::filesystem::path& bone);

  void look_at(const std::array<int, 3>& voxel);
  void point_at(const std::array<int, 3>& voxel);
  // The row of a bone's part, at a voxel of its surface.
  void choose_part(int bone, const std::array<int, 3>& voxel);
  void change_window(const HuWindow& window);
  void preview_threshold(int hu);
  // Into the history.
  void take_threshold();
  void apply_threshold();
  // A seed at the voxel, or near to it in its island.
  void keep_at(const std::array<int, 3>& voxel);
  void change_island(const QListWidgetItem* item);
  static constexpr int kGaussianRow = 3;  // of the list of filters
  void take_filter();
  void show_filter(const ScanFilter& filter);
  void follow_tools();
  // Moves the crosshair at least, and says why no drag begins.
  bool begin_drag(const PlaneAxes& axes, const std::array<int, 3>& voxel);
  void end_drags(bool keep);
  void drag_to(const std::array<int, 3>& voxel);
  void end_drag(bool keep);
  void show_drag();
  // The edits with a seed at the bone nearest to a voxel. None: there is no bone, which it says, or the seed is there.
  std::optional<ImagingEdits> with_seed(const std::array<int, 3>& voxel, int bone);
  void keep_outside(const std::array<int, 3>& voxel);
  void name_bone(int bone, const QString& name);
  void fade_bone(int bone, int percent);
  [[nodiscard]] ImagingLandmarks* make_landmarks();
  void set_landmark(const std::array<int, 3>& voxel);
  void show_landmark(const std::string& name);
  [[nodiscard]] QCheckBox* make_report_choice();
  // Opens the report of a case, if it has one. What is said of the case.
  [[nodiscard]] QString show_report(const std::filesystem::path& bone) const;
  [[nodiscard]] QCheckBox* make_edge_choice();
  // Finds the edges, or takes them away.
  void choose_edges(bool on);
  void show_edges(VoxelFile<std::uint8_t> edges);
  // Into the history, with the time since the last edit for a bone; 0: for none.
  void take(ImagingEdits edits, int bone);
  // The bones at a voxel: that of its paint, or all that grow in its island.
  [[nodiscard]] std::bitset<256> bones_under(const std::array<int, 3>& voxel) const;
  // The lowest of them; 0: none.
  [[nodiscard]] int bone_at(const std::array<int, 3>& voxel) const;
  [[nodiscard]] bool kept(int island) const;
  // The history has another state now.
  void follow_edits();
  void refresh_list();
  // What the planes show of the edits.
  void refresh_look();
  void refresh_planes();
  void enable_parts();
  [[nodiscard]] QPushButton* make_boxes_button();
  void write_boxes(const std::filesystem::path& folder, int subdivisions);

  Events events_;
  ImagingScene scene_;
  EditHistory history_;
  std::vector<ListedIsland> islands_;
  // What the islands depend on.
  struct IslandSearch {
    double threshold_hu = 0.0;
    ScanFilter filter;
    std::optional<MarkedBox> box;
    friend bool operator==(const IslandSearch&, const IslandSearch&) = default;
  };
  [[nodiscard]] IslandSearch wanted() const {
    return {history_.now().threshold_hu, history_.now().filter, history_.now().box};
  }
  // Whether the planes and the parts are those of the edits.
  [[nodiscard]] bool current() const { return wanted() == found_ && wanted().filter == shown_filter_; }
  [[nodiscard]] double found_hu() const { return found_ ? found_->threshold_hu : 0.0; }
  std::optional<IslandSearch> found_;  // nothing: none were found yet
  IslandSearch searched_;              // of the islands that are being found
  ScanFilter shown_filter_;            // of the scan that the planes show
  std::optional<PlaneDrag> drag_;
  QElapsedTimer work_;  // since the last edit
  ImagingSteps steps_;
  QString wanted_source_;       // to open when the step at work has ended
  bool wants_islands_ = false;  // the same
  bool sends_made_ = false;     // the case that is being made
  struct MadeCase {
    ImagingEdits edits;
    std::filesystem::path bone;  // empty: it is being made
  };
  std::optional<MadeCase> made_;  // the last one of this scan
  bool filling_ = false;          // the list changes by itself
  std::vector<ListedSeries> series_;
  QStackedWidget* stack_;
  QWidget* work_area_;
  QListWidget *series_list_, *island_list_;
  QLabel *words_, *readout_;
  QProgressBar* progress_;
  QPushButton *cancel_, *back_, *find_, *keep_, *undo_, *redo_, *open_boxes_, *make_, *send_;
  QComboBox *preset_, *filter_;
  QCheckBox *edges_, *report_;
  QSpinBox* threshold_;
  QDoubleSpinBox* gaussian_;
  ImagingTools* tools_ = nullptr;
  ImagingBoneChoice* choice_;
  ImagingLandmarks* landmarks_;
  ImagingHistogram* histogram_;
  std::array<ImagingPlane*, 3> planes_{};
  ImagingSolid* solid_ = nullptr;
  ImagingBoxes* boxes_ = nullptr;
  QTimer threshold_timer_;  // the user has stopped to change the threshold
};

}  // namespace osteon
