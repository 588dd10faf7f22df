#include "viewer_client/desktop/imaging_page.hpp"

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFileInfo>
#include <QFormLayout>
#include <QGridLayout>
#include <QIcon>
#include <QLabel>
#include <QListWidget>
#include <QLocale>
#include <QMessageBox>
#include <QProgressBar>
#include <QPushButton>
#include <QScrollArea>
#include <QSettings>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QStackedWidget>
#include <algorithm>
#include <utility>

#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/library.hpp"
#include "viewer_client/desktop/page_fields.hpp"

namespace osteon {

namespace {

constexpr double kLeastGaussian_mm = 0.05, kMostGaussian_mm = 10.0, kGaussianStep_mm = 0.1, kFirstGaussian_mm = 0.5;
constexpr int kThresholdPause_ms = 600, kThumbnail_px = 96, kListWidth_px = 250, kListSpacing_px = 4,
              kIslandIcon_px = 28;
constexpr std::array kImagingWindows{kBoneWindow, kSoftTissueWindow, kWideWindow};
constexpr const char* kLastFolderKey = "imaging/folder";
enum ImagingStackPage { kNothingOpen, kSeriesPage, kWorkPage };

// Planes and panels beside each other. A label with word wrap gives its layout a height that depends on the width. A
// QScrollArea gives such a layout its preferred height, and scrolls although the least height has room. This layout
// hides that dependence, so it gets its least height, or more where there is room.
class RowOfLeastHeight : public QHBoxLayout {
 public:
  [[nodiscard]] bool hasHeightForWidth() const override { return false; }
};

QString kind_text(const std::string& kind) {
  if (kind == "table") return QCoreApplication::translate("ImagingPage", "table or headrest");
  if (kind == "cast") return QCoreApplication::translate("ImagingPage", "cast");
  if (kind == "metal") return QCoreApplication::translate("ImagingPage", "metal");
  if (kind == "contrast") return QCoreApplication::translate("ImagingPage", "contrast medium");
  return QCoreApplication::translate("ImagingPage", "bone");
}

QString island_text(const ListedIsland& island) {
  return QCoreApplication::translate("ImagingPage", "%1: %2, %3 cm³")
      .arg(island.number)
      .arg(kind_text(island.kind), QLocale().toString(island.volume_cm3, 'f', 2));
}

// The island from the front, in the tint that it has on the planes.
QIcon icon_of(const IslandPicture& picture, const Tint& tint) {
  QImage image(picture.side_px, picture.side_px, QImage::Format_ARGB32);
  image.fill(Qt::transparent);
  for (int row = 0; row < picture.side_px; ++row)
    for (int column = 0; column < picture.side_px; ++column) {
      const int grey = picture.greys[static_cast<std::size_t>(row * picture.side_px + column)];
      if (grey == 0) continue;
      image.setPixel(column, row, qRgb(tint.red * grey / 255, tint.green * grey / 255, tint.blue * grey / 255));
    }
  return {QPixmap::fromImage(image)};
}

}  // namespace

ImagingPage::ImagingPage(Events events, QWidget* parent)
    : QWidget(parent), events_(std::move(events)), steps_(step_events()) {
  setObjectName("imaging");
  setFocusPolicy(Qt::StrongFocus);
  stack_ = new QStackedWidget;
  auto* hint = new QLabel(tr("Open the folder of a CT, a CD, or a file: zip, ISO, NIfTI, NRRD or MetaImage."));
  hint->setWordWrap(true);
  hint->setAlignment(Qt::AlignCenter);
  stack_->addWidget(hint);
  series_list_ = new QListWidget;
  series_list_->setObjectName("series");
  series_list_->setAccessibleName(tr("Series of the CT"));
  series_list_->setIconSize({kThumbnail_px, kThumbnail_px});
  series_list_->setWordWrap(true);
  series_list_->setSpacing(kListSpacing_px);  // some have no picture, and their lines would look like one text
  connect(series_list_, &QListWidget::itemClicked, this, [this](QListWidgetItem* item) { read_row(item); });
  connect(series_list_, &QListWidget::itemActivated, this, [this](QListWidgetItem* item) { read_row(item); });
  stack_->addWidget(series_list_);
  work_area_ = new QWidget;
  work_area_->setLayout(make_work());
  auto* scrolled = new QScrollArea;  // a small screen has no room for tools, planes and panels of the window
  scrolled->setWidgetResizable(true);
  scrolled->setFrameShape(QFrame::NoFrame);
  scrolled->setWidget(work_area_);
  stack_->addWidget(scrolled);

  auto* all = new QVBoxLayout(this);
  all->addLayout(make_head());
  all->addWidget(stack_, 1);
  threshold_timer_.setSingleShot(true);
  threshold_timer_.setInterval(kThresholdPause_ms);
  connect(&threshold_timer_, &QTimer::timeout, this, [this] { apply_threshold(); });
  leave_keys_and_wheel(*this);
  end_work({});
}

ImagingSteps::Events ImagingPage::step_events() {
  return {[this](int percent) {
            progress_->setRange(0, 100);
            progress_->setValue(percent);
            boxes_->show_progress(percent);
          },
          [this](const std::vector<ListedSeries>& series) { show_series(series); },
          [this](ShownScan scan, const HuHistogram& histogram) { show_scan(std::move(scan), histogram); },
          [this](ShownScan scan, const HuHistogram& histogram) { show_filtered(std::move(scan), histogram); },
          [this](std::vector<ListedIsland> list, IslandMap map) { show_islands(std::move(list), std::move(map)); },
          [this](VoxelFile<std::uint8_t> edges) { show_edges(std::move(edges)); },
          [this](const std::filesystem::path& folder) {
            end_work(tr("The root sub-volumes are in %1.").arg(text_of(folder)));
          },
          [this](const std::filesystem::path& bone) { use_made(bone); },
          [this](const QString& sentence) {
            events_.busy(false);
            sends_made_ = false;
            if (scene_.look.edges.values.empty()) show_edges({});
            if (scene_.waits()) forget_first();
            end_work(sentence.isEmpty() ? tr("Cancelled. Nothing was written.") : sentence);
            if (!wanted_source_.isEmpty()) return open_source(std::exchange(wanted_source_, {}));
            if (std::exchange(wants_islands_, false)) find_islands();
          }};
}

QPushButton* ImagingPage::add_button(QBoxLayout& to, const QString& words, const char* name, const QString& tip,
                                     std::function<void()> call) {
  auto* button = new QPushButton(words);
  button->setObjectName(name);
  button->setToolTip(tip);
  connect(button, &QPushButton::clicked, this, [call = std::move(call)] { call(); });
  to.addWidget(button);
  return button;
}

QBoxLayout* ImagingPage::make_head() {
  auto* row = new QHBoxLayout;
  add_button(*row, tr("Open a fol&der…"), "imaging_folder", tr("The folder of a CT, or a CD"),
             [this] { choose_folder(); });
  add_button(*row, tr("Open a f&ile…"), "imaging_file", tr("A zip or ISO image, a NIfTI, NRRD or MetaImage file"),
             [this] { choose_file(); });
  words_ = new QLabel;
  words_->setObjectName("imaging_words");
  words_->setWordWrap(true);
  words_->setTextFormat(Qt::PlainText);  // names of files are no HTML
  row->addWidget(words_, 1);
  progress_ = new QProgressBar;
  progress_->setAccessibleName(tr("Progress"));
  row->addWidget(progress_);
  cancel_ = add_button(*row, tr("Cancel"), "imaging_cancel", {}, [this] { steps_.cancel(); });
  back_ = add_button(*row, tr("&Back"), "imaging_back", tr("To the start page. The scan and your edits stay here."),
                     [this] { events_.leave(); });
  return row;
}

QBoxLayout* ImagingPage::make_work() {
  auto* row = new RowOfLeastHeight;
  row->setContentsMargins(0, 0, 0, 0);
  row->addLayout(make_planes(), 1);
  row->addLayout(make_side());
  return row;
}

QBoxLayout* ImagingPage::make_planes() {
  auto* all = new QVBoxLayout;
  tools_ = new ImagingTools([this] { follow_tools(); });
  all->addWidget(tools_);
  auto* grid = new QGridLayout;
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    planes_[i] = new ImagingPlane(
        kPlanes[i], scene_,
        {[this](const std::array<int, 3>& voxel) { look_at(voxel); },
         [this](const std::array<int, 3>& voxel) { point_at(voxel); },
         [this](const std::array<int, 3>& voxel) { keep_at(voxel); },
         [this](const HuWindow& window) { change_window(window); },
         [this](const PlaneAxes& axes, const std::array<int, 3>& voxel) { return begin_drag(axes, voxel); },
         [this](const std::array<int, 3>& voxel) { drag_to(voxel); }, [this](bool keep) { end_drag(keep); },
         [this](int notches) { tools_->turn_radius(notches); }});
    grid->addWidget(planes_[i], static_cast<int>(i) / 2, static_cast<int>(i) % 2);
  }
  solid_ = new ImagingSolid(scene_, {[this](const std::array<int, 3>& voxel) { look_at(voxel); },
                                     [this](int bone, const std::array<int, 3>& voxel) { choose_part(bone, voxel); }});
  grid->addWidget(solid_, 1, 1);
  for (int at = 0; at < 2; ++at) grid->setRowStretch(at, 1), grid->setColumnStretch(at, 1);
  all->addLayout(grid, 1);
  all->addLayout(make_foot());
  return all;
}

QBoxLayout* ImagingPage::make_foot() {
  auto* row = new QHBoxLayout;
  readout_ = new QLabel;
  readout_->setObjectName("readout");
  readout_->setWordWrap(true);
  readout_->setAlignment(Qt::AlignTop | Qt::AlignLeft);
  row->addWidget(readout_, 1);
  choice_ = new ImagingBoneChoice({[this](int bone, const QString& name) { name_bone(bone, name); },
                                   [this](int bone, int percent) { fade_bone(bone, percent); }});
  row->addWidget(choice_, 1);
  landmarks_ = make_landmarks();
  row->addWidget(landmarks_, 1);
  return row;
}

void ImagingPage::add_filter(QFormLayout& form) {
  filter_ = new QComboBox;
  filter_->setObjectName("filter");
  filter_->setAccessibleName(tr("Filter of the scan"));
  filter_->setToolTip(tr("A median takes out single wrong voxels, a Gaussian takes out noise"));
  filter_->addItems({tr("None"), tr("Median, slice"), tr("Median, volume"), tr("Gaussian")});
  connect(filter_, QOverload<int>::of(&QComboBox::activated), this, [this] { take_filter(); });
  gaussian_ = new QDoubleSpinBox;
  gaussian_->setObjectName("gaussian");
  gaussian_->setAccessibleName(tr("Sigma of the Gaussian"));
  gaussian_->setToolTip(tr("Sigma of the Gaussian. Half a voxel to one voxel is usual."));
  gaussian_->setRange(kLeastGaussian_mm, kMostGaussian_mm);
  gaussian_->setDecimals(2);
  gaussian_->setSingleStep(kGaussianStep_mm);
  gaussian_->setSuffix(tr(" mm"));
  gaussian_->setValue(kFirstGaussian_mm);
  gaussian_->setKeyboardTracking(false);
  connect(gaussian_, QOverload<double>::of(&QDoubleSpinBox::valueChanged), this, [this] { take_filter(); });
  auto* row = new QHBoxLayout;
  row->addWidget(filter_, 1);
  row->addWidget(gaussian_);
  form.addRow(tr("Smoothing"), row);
}

QBoxLayout* ImagingPage::make_side() {
  auto* column = new QVBoxLayout;
  auto* form = new QFormLayout;
  preset_ = new QComboBox;
  preset_->setObjectName("window_preset");
  preset_->setAccessibleName(tr("Window of the grey values"));
  preset_->addItems({tr("For bone"), tr("For soft tissue"), tr("All values")});
  connect(preset_, QOverload<int>::of(&QComboBox::activated), this,
          [this](int index) { change_window(kImagingWindows[static_cast<std::size_t>(index)]); });
  form->addRow(tr("Window"), preset_);
  threshold_ = new QSpinBox;
  threshold_->setObjectName("threshold");
  threshold_->setAccessibleName(tr("Threshold of bone"));
  threshold_->setRange(-1000, 4000);
  threshold_->setSingleStep(10);
  threshold_->setSuffix(tr(" HU"));
  threshold_->setValue(static_cast<int>(history_.now().threshold_hu));
  connect(threshold_, QOverload<int>::of(&QSpinBox::valueChanged), this, [this](int hu) { preview_threshold(hu); });
  form->addRow(tr("Threshold"), threshold_);
  add_filter(*form);
  edges_ = make_edge_choice();
  form->addRow(edges_);
  column->addLayout(form);
  histogram_ = new ImagingHistogram(
      {[this](int hu) { threshold_->setValue(hu); }, [this](const HuWindow& window) { change_window(window); }});
  column->addWidget(histogram_);
  auto* heading = new QLabel(tr("Parts of bone. The ticked ones are kept:"));
  heading->setWordWrap(true);
  column->addWidget(heading);
  island_list_ = new QListWidget;
  island_list_->setObjectName("islands");
  island_list_->setAccessibleName(tr("Parts of bone"));
  island_list_->setMinimumWidth(kListWidth_px);
  island_list_->setIconSize({kIslandIcon_px, kIslandIcon_px});
  connect(island_list_, &QListWidget::itemChanged, this, [this](QListWidgetItem* item) { change_island(item); });
  column->addWidget(island_list_, 1);
  find_ = add_button(*column, tr("Find the parts"), "find_parts", tr("Finds the parts that reach the threshold"),
                     [this] { find_islands(); });
  keep_ = add_button(*column, tr("&Keep the bone at the crosshair"), "keep_bone",
                     tr("Puts a seed there, from which the bone grows. Two seeds in one part separate it."),
                     [this] { keep_at(scene_.crosshair); });
  undo_ = add_button(*column, tr("&Undo the edit"), "undo_edit", tr("Takes the last edit back"), [this] {
    take_threshold();
    history_.undo();
    if (!steps_.busy()) words_->setText(tr("The last edit is taken back."));  // no longer what it did
    follow_edits();
  });
  undo_->setShortcut(QKeySequence::Undo);
  redo_ = add_button(*column, tr("&Redo the edit"), "redo_edit", tr("Does it again"), [this] {
    history_.redo();
    if (!steps_.busy()) words_->setText(tr("The edit is done again."));
    follow_edits();
  });
  redo_->setShortcut(QKeySequence::Redo);
  open_boxes_ = make_boxes_button();
  column->addWidget(open_boxes_);
  report_ = make_report_choice();
  column->addWidget(report_);
  make_ = add_button(*column, tr("&Make the bone"), "make_bone",
                     tr("Makes a case of the kept bones, and opens it to practise"), [this] { make_bone(false); });
  send_ =
      add_button(*column, tr("Send to a server…"), "send_bone",
                 tr("Makes a case of the kept bones, and opens the dialog that sends it"), [this] { make_and_send(); });
  send_->setShortcut(QKeySequence("Ctrl+Alt+U"));
  send_->setToolTip(QString("%1 (%2)").arg(send_->toolTip(), send_->shortcut().toString(QKeySequence::NativeText)));
  return column;
}

QString ImagingPage::ask_for_folder(QWidget* parent) {
  QSettings settings;
  const QString beside = settings.value(kLastFolderKey).toString();
  QString folder = QFileDialog::getExistingDirectory(parent, tr("The folder of a CT"), beside);
  if (!folder.isEmpty()) settings.setValue(kLastFolderKey, QFileInfo(folder).path());
  return folder;
}

void ImagingPage::choose_folder() {
  const QString folder = ask_for_folder(this);
  if (!folder.isEmpty()) open_source(folder);
}

QString ImagingPage::ask_for_file(QWidget* parent) {
  QSettings settings;
  const QString file =
      QFileDialog::getOpenFileName(parent, tr("The file of a CT"), settings.value(kLastFolderKey).toString());
  if (!file.isEmpty()) settings.setValue(kLastFolderKey, QFileInfo(file).path());
  return file;
}

void ImagingPage::choose_file() {
  const QString file = ask_for_file(this);
  if (!file.isEmpty()) open_source(file);
}

QString ImagingPage::ask_for_source(QWidget* parent) {
  QMessageBox box(QMessageBox::Question, tr("Import a CT"), tr("Is the CT a folder or a file?"), QMessageBox::Cancel,
                  parent);
  box.setInformativeText(tr("A file is a zip or ISO image, NIfTI, NRRD or MetaImage."));
  const auto* folder = box.addButton(tr("Open a fol&der…"), QMessageBox::AcceptRole);
  const auto* file = box.addButton(tr("Open a f&ile…"), QMessageBox::AcceptRole);
  box.exec();
  if (box.clickedButton() == folder) return ask_for_folder(parent);
  return box.clickedButton() == file ? ask_for_file(parent) : QString();
}

void ImagingPage::open_source(const QString& source) {
  if (steps_.making()) return;
  if (steps_.busy()) {
    wanted_source_ = source;
    return steps_.cancel();
  }
  threshold_timer_.stop();
  wants_islands_ = false;
  release_scene();
  scene_.scan = {};
  scene_.first = {};
  scene_.islands = {};
  made_.reset();
  islands_.clear();
  series_.clear();
  series_list_->clear();
  history_ = {};
  found_.reset();
  shown_filter_ = {};
  show_filter({});
  drag_.reset();
  show_edges({});
  scene_.look = {};
  scene_.seeds.clear();
  scene_.landmarks.clear();
  boxes_->hide();
  tools_->reset();
  choice_->follow({});
  landmarks_->follow({});
  island_list_->clear();
  readout_->clear();
  const QSignalBlocker quiet(threshold_);
  threshold_->setValue(static_cast<int>(history_.now().threshold_hu));
  stack_->setCurrentIndex(kNothingOpen);
  show_work(tr("Searching %1").arg(source));
  steps_.open(source);
}

void ImagingPage::show_work(const QString& what) {
  words_->setText(what);
  progress_->setRange(0, 0);
  progress_->show();
  cancel_->show();
  enable_parts();
}

void ImagingPage::end_work(const QString& sentence) {
  words_->setText(sentence);
  boxes_->end_work(sentence);
  progress_->hide();
  cancel_->hide();
  enable_parts();
}

void ImagingPage::show_series(const std::vector<ListedSeries>& series) {
  series_ = series;
  for (const ListedSeries& of : series_) {
    auto* item = new QListWidgetItem(QIcon(of.picture), of.text, series_list_);
    if (!of.problem.isEmpty()) item->setFlags(item->flags() & ~Qt::ItemIsEnabled);
    if (of.largest) series_list_->setCurrentItem(item);
  }
  stack_->setCurrentIndex(kSeriesPage);
  series_list_->setFocus();
  end_work(tr("Choose a series."));
}

void ImagingPage::read_row(const QListWidgetItem* item) {
  const auto row = static_cast<std::size_t>(series_list_->row(item));
  if (steps_.busy() || !series_list_->isVisible() || row >= series_.size()) return;
  show_work(tr("Reading the series"));
  steps_.read(series_[row].number);
  if (steps_.busy()) show_first(series_[row]);
}

void ImagingPage::show_first(const ListedSeries& of) {
  Result<ShownScan> first = read_scan_file(of.hu.toStdString());
  if (!first || first->geometry.dims[2] != 1) return;
  const int middle = of.slices / 2;
  scene_.scan.geometry = first->geometry;
  scene_.scan.geometry.dims[2] = of.slices;
  scene_.scan.geometry.origin_mm -= middle * first->geometry.axes_mm.col(2);
  scene_.first = std::move(*first);
  histogram_->set_histogram({});
  begin_planes();
  show_work(tr("Reading the series. You see its middle slice; the tools wait for the others."));
  // What is disabled cannot keep the keyboard's focus.
  cancel_->setFocus();
}

void ImagingPage::forget_first() {
  scene_.first = {};
  scene_.scan = {};
  stack_->setCurrentIndex(kSeriesPage);
  series_list_->setFocus();
}

void ImagingPage::show_scan(ShownScan scan, const HuHistogram& histogram) {
  release_scene();
  scene_.scan = std::move(scan);
  scene_.first = {};
  made_.reset();
  histogram_->set_histogram(histogram);
  begin_planes();
  enable_parts();
  planes_[0]->setFocus();
  work_.start();
  find_islands();
}

void ImagingPage::begin_planes() {
  const auto& dims = scene_.scan.geometry.dims;
  scene_.crosshair = {dims[0] / 2, dims[1] / 2, dims[2] / 2};
  stack_->setCurrentIndex(kWorkPage);
  change_window(kBoneWindow);
  for (ImagingPlane* plane : planes_) plane->begin();
  solid_->begin();
}

void ImagingPage::show_filtered(ShownScan scan, const HuHistogram& histogram) {
  release_scene();
  show_edges({});  // they were of the scan before
  scene_.scan = std::move(scan);
  shown_filter_ = searched_.filter;
  histogram_->set_histogram(histogram);
  refresh_planes();
  point_at(scene_.crosshair);
  // The same geometry, but perhaps the user wants another filter by now.
  find_islands();
}

void ImagingPage::find_islands() {
  if (!scene_.open() || steps_.making()) return;
  if (steps_.busy()) {
    wants_islands_ = true;
    return steps_.cancel();
  }
  searched_ = wanted();
  if (shown_filter_ != searched_.filter) {
    show_work(tr("Filtering the scan"));
    return steps_.filter(searched_.filter);
  }
  show_work(tr("Finding the parts of bone"));
  steps_.find(scene_.scan.geometry, history_.now());
}

void ImagingPage::show_islands(std::vector<ListedIsland> list, IslandMap map) {
  islands_ = std::move(list);
  release_scene();
  scene_.islands = std::move(map);
  const bool first = !found_;
  found_ = searched_;
  if (first) show_largest_bone();
  end_work(tr("Tick a bone in the list, or double-click it with Crosshair, and make it."));
  // A threshold that the user sets just now stays, and its parts are found next.
  threshold_timer_.isActive() ? refresh_list() : follow_edits();
}

void ImagingPage::show_largest_bone() {
  const auto bone = std::ranges::find(islands_, "bone", &ListedIsland::kind);
  if (bone == islands_.end()) return;
  const auto centre = voxel_of(scene_.scan.geometry, bone->centre_mm).value_or(scene_.crosshair);
  if (const auto seed = scene_.islands.seed_near(scene_.scan, bone->number, found_hu(), centre)) look_at(*seed);
}

void ImagingPage::look_at(const std::array<int, 3>& voxel) {
  if (!scene_.open()) return;
  scene_.crosshair = voxel;
  refresh_planes();
  point_at(voxel);
}

void ImagingPage::point_at(const std::array<int, 3>& voxel) {
  const Vec3 at = centre_of(scene_.scan.geometry, voxel);
  const QLocale locale;
  QString text =
      tr("%1 HU at %2, %3, %4 mm")
          .arg(scene_.scan.at(voxel))
          .arg(locale.toString(at.x(), 'f', 1), locale.toString(at.y(), 'f', 1), locale.toString(at.z(), 'f', 1));
  const std::size_t island = scene_.islands.number(voxel);
  if (island > 0 && island <= islands_.size()) text += '\n' + island_text(islands_[island - 1]);
  readout_->setText(text);
}

void ImagingPage::choose_part(int bone, const std::array<int, 3>& voxel) {
  // An older surface has the bones of other edits, and the words are those of the work.
  if (steps_.busy() || !solid_->current()) return;
  const int island = island_near(scene_.scan.geometry, scene_.islands, scene_.look.kept, bone, voxel);
  const auto part = std::ranges::find(islands_, island, &ListedIsland::number);
  if (part == islands_.end()) return words_->setText(tr("This bone is painted, so no part of the list is its own."));
  island_list_->setCurrentRow(static_cast<int>(part - islands_.begin()));
  words_->setText(tr("Part %1 is chosen in the list.").arg(island));
}

void ImagingPage::change_window(const HuWindow& window) {
  scene_.look.window = window;
  scene_.greys = GreyTable(window);
  const auto preset = std::ranges::find(kImagingWindows, window);
  histogram_->set_limits(threshold_->value(), window);
  preset_->setCurrentIndex(preset == kImagingWindows.end() ? -1 : static_cast<int>(preset - kImagingWindows.begin()));
  refresh_planes();
}

void ImagingPage::preview_threshold(int hu) {
  scene_.look.threshold_hu = hu;
  histogram_->set_limits(hu, scene_.look.window);
  threshold_timer_.start();
  refresh_planes();
  enable_parts();
}

void ImagingPage::refresh_list() {
  refresh_look();
  filling_ = true;
  if (island_list_->count() != static_cast<int>(islands_.size())) island_list_->clear();
  for (std::size_t i = 0; i < islands_.size(); ++i) {
    const bool keep = kept(islands_[i].number);
    const Tint tint = scene_.look.islands[static_cast<std::size_t>(islands_[i].number)];
    auto* item = island_list_->item(static_cast<int>(i));
    if (item == nullptr) item = new QListWidgetItem(island_list_);
    item->setText(island_text(islands_[i]));
    item->setIcon(icon_of(islands_[i].picture, tint));
    item->setCheckState(keep ? Qt::Checked : Qt::Unchecked);
  }
  filling_ = false;
}

void ImagingPage::refresh_planes() {
  for (ImagingPlane* plane : planes_)
    if (plane != nullptr) plane->refresh();
  if (solid_ != nullptr) solid_->refresh();
  if (boxes_ != nullptr) boxes_->refresh();
}

void ImagingPage::enable_parts() {
  // An edit would cancel the files that are being written.
  const bool free = !steps_.busy(), making = steps_.making() || boxes_->writing(), waits = scene_.waits();
  // Until the user has stopped to change the threshold, the parts are of another one than the page shows.
  const bool changing = threshold_timer_.isActive();
  const bool found = free && !changing && scene_.open() && !islands_.empty() && current();
  const QString wait = tr("osteon-import is at work. Wait for it, or cancel it.");
  const QString none = free ? tr("Find the parts. If there are none, choose another threshold or box.") : wait;
  set_enabled(*back_, !making, wait);
  set_enabled(*work_area_, !waits, wait);
  // A part with a tool tip of its own says the reason too.
  for (ImagingPlane* plane : planes_)
    if (plane != nullptr) set_enabled(*plane, !waits, wait);
  const bool changes = !making && !waits;
  set_enabled(*threshold_, changes, wait);
  set_enabled(*filter_, changes, wait);
  const bool gaussian = filter_->currentIndex() == kGaussianRow;
  set_enabled(*gaussian_, changes && gaussian, changes ? tr("Choose the Gaussian first.") : wait);
  set_enabled(*tools_, changes, wait);
  tools_->set_found(found, none);
  set_enabled(*choice_, found, none);
  set_enabled(*landmarks_, changes, wait);
  set_enabled(*report_, changes, wait);
  set_enabled(*edges_, free && scene_.open(), wait);
  // After a search that was cancelled or failed.
  find_->setVisible(free && !changing && scene_.open() && !current());
  set_enabled(*keep_, found, none);
  set_enabled(*open_boxes_, found, none);
  boxes_->allow(found, none);
  set_enabled(*island_list_, found, none);
  set_enabled(*undo_, !making && (changing || history_.can_undo()), making ? wait : tr("There is nothing to undo."));
  set_enabled(*redo_, !making && history_.can_redo(), making ? wait : tr("There is nothing to redo."));
  const bool some = std::ranges::any_of(history_.now().seeds, [&](const KeptSeed& seed) {
    const auto voxel = scene_.open() ? voxel_of(scene_.scan.geometry, seed.at_mm) : std::nullopt;
    return voxel && seed.bone != 0 && scene_.islands.number(*voxel) != 0;
  });
  for (QPushButton* makes : {make_, send_})
    set_enabled(*makes, found && some,
                found ? tr("Keep a bone first: tick it in the list, or double-click it with Crosshair.") : none);
}

}  // namespace osteon
