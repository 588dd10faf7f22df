#include "viewer_client/desktop/imaging_boxes.hpp"

#include <QDialogButtonBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHideEvent>
#include <QLabel>
#include <QListWidget>
#include <QLocale>
#include <QProgressBar>
#include <QPushButton>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QVBoxLayout>
#include <atomic>
#include <utility>

#include "common/subvolumes/quadtree.hpp"
#include "viewer_client/desktop/enabled.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {

namespace {

constexpr int kBoxesPause_ms = 150;  // a drag is many edits
constexpr QSize kFirstSize{440, 420};

QString count_text(std::int64_t count) { return QLocale().toString(static_cast<qlonglong>(count)); }

QString percent_text(std::int64_t voxels, const ScanGeometry& scan) {
  return QLocale().toString(100.0 * static_cast<double>(voxels) / static_cast<double>(scan.count()), 'f', 2);
}

QString boxes_text(const KeptBoxes& boxes, const ScanGeometry& scan) {
  if (boxes.sections.empty()) return QCoreApplication::translate("ImagingBoxes", "Nothing is kept. Keep a bone first.");
  const Coord dims = boxes.object.dims();
  const std::int64_t object = subvolumes::voxels_of(boxes.object), full = boxes.full_leaves();
  const auto leaves = static_cast<std::int64_t>(boxes.leaves.size());
  auto text = QCoreApplication::translate("ImagingBoxes", "Bounding box: %1 × %2 × %3, %4 voxels, %5 % of the scan")
                  .arg(dims.x)
                  .arg(dims.y)
                  .arg(dims.z)
                  .arg(count_text(object), percent_text(object, scan)) +
              '\n' +
              QCoreApplication::translate("ImagingBoxes", "Section boxes: %1, %2 voxels, %3 % of the scan")
                  .arg(boxes.sections.size())
                  .arg(count_text(boxes.section_voxels()), percent_text(boxes.section_voxels(), scan)) +
              '\n' +
              QCoreApplication::translate("ImagingBoxes", "Leaves: %1, of which %2 are full and %3 partly full")
                  .arg(count_text(leaves), count_text(full), count_text(leaves - full));
  if (boxes.leaves.size() > kMostDrawnLeaves)
    text += '\n' + QCoreApplication::translate("ImagingBoxes",
                                               "Never more than %1 are shown. Choose a section, or fewer subdivisions.")
                       .arg(count_text(static_cast<std::int64_t>(kMostDrawnLeaves)));
  return text;
}

}  // namespace

struct ImagingBoxes::Job {
  Wish wish;
  std::atomic<bool> cancelled{false};
  Result<KeptBoxes> boxes;
};

ImagingBoxes::ImagingBoxes(const ImagingScene& scene, Events events, QWidget* parent)
    : QDialog(parent), scene_(scene), events_(std::move(events)) {
  setObjectName("sub_volumes");
  setWindowTitle(tr("Sub-volumes"));
  subdivisions_ = new QSpinBox;
  subdivisions_->setObjectName("subdivisions");
  subdivisions_->setAccessibleName(tr("Subdivisions of each section"));
  subdivisions_->setToolTip(tr("How often each section is divided into quadrants"));
  subdivisions_->setRange(0, subvolumes::kMostSubdivisions);
  subdivisions_->setValue(kFirstSubdivisions);
  connect(subdivisions_, QOverload<int>::of(&QSpinBox::valueChanged), this, [this] { refresh(); });
  words_ = new QLabel;
  words_->setObjectName("sub_volumes_words");
  words_->setWordWrap(true);
  auto* lines = new QLabel(tr("Yellow, dashed: bounding box. Blue: section boxes. Orange, wide: the chosen one.") +
                           '\n' + tr("Green: full leaves. Pink, dashed: leaves that are partly full."));
  lines->setWordWrap(true);
  list_ = new QListWidget;
  list_->setObjectName("sections");
  list_->setAccessibleName(tr("Section boxes"));
  list_->setToolTip(tr("Moves the crosshair into the section. A click on a plane chooses the one there."));
  connect(list_, &QListWidget::currentRowChanged, this, [this](int row) { choose(row); });
  auto* form = new QFormLayout;
  form->addRow(tr("Subdivisions"), subdivisions_);
  auto* buttons = new QDialogButtonBox;
  close_ = buttons->addButton(tr("Close"), QDialogButtonBox::RejectRole);
  close_->setObjectName("close_sub_volumes");
  close_->setAutoDefault(false);
  connect(buttons, &QDialogButtonBox::rejected, this, [this] { reject(); });
  write_ = buttons->addButton(tr("&Write root sub-volumes…"), QDialogButtonBox::ActionRole);
  write_->setObjectName("write_sub_volumes");
  write_->setToolTip(tr("Makes a folder with Meta.dat, SBB1.dat and so on, the report, and a picture of the boxes"));
  write_->setAutoDefault(false);  // Enter in the list writes nothing
  connect(write_, &QPushButton::clicked, this, [this] { choose_folder(); });
  auto* all = new QVBoxLayout(this);
  all->addLayout(form);
  all->addWidget(words_);
  all->addWidget(list_, 1);
  all->addWidget(lines);
  all->addLayout(make_work());
  all->addWidget(buttons);
  resize(kFirstSize);
  pause_.setSingleShot(true);
  pause_.setInterval(kBoxesPause_ms);
  connect(&pause_, &QTimer::timeout, this, [this] { ask(); });
  enable_write();
}

QBoxLayout* ImagingBoxes::make_work() {
  work_ = new QLabel;
  work_->setObjectName("sub_volumes_work");
  work_->setWordWrap(true);
  work_->setTextFormat(Qt::PlainText);  // names of files are no HTML
  progress_ = new QProgressBar;
  progress_->setAccessibleName(tr("Progress"));
  cancel_ = new QPushButton(tr("Cancel"));
  cancel_->setObjectName("cancel_sub_volumes");
  cancel_->setAutoDefault(false);
  connect(cancel_, &QPushButton::clicked, this, [this] { events_.cancel(); });
  auto* row = new QHBoxLayout;
  row->addWidget(work_, 1);
  row->addWidget(progress_);
  row->addWidget(cancel_);
  progress_->hide();
  cancel_->hide();
  return row;
}

ImagingBoxes::~ImagingBoxes() { release(); }

void ImagingBoxes::begin_work(const QString& what) {
  writing_ = true;
  work_->setText(what);
  progress_->setRange(0, 0);
  progress_->show();
  cancel_->show();
  cancel_->setFocus();
  set_enabled(*close_, false, tr("The files are being written. Wait for them, or cancel."));
}

void ImagingBoxes::show_progress(int percent) {
  if (!writing_) return;
  progress_->setRange(0, 100);
  progress_->setValue(percent);
}

void ImagingBoxes::end_work(const QString& sentence) {
  if (!std::exchange(writing_, false)) return;
  if (cancel_->hasFocus()) list_->setFocus();
  work_->setText(sentence);
  progress_->hide();
  cancel_->hide();
  set_enabled(*close_, true, {});
}

// Escape, or the window's own button. What is being written would go on unseen.
void ImagingBoxes::reject() { writing_ ? events_.cancel() : hide(); }

void ImagingBoxes::release() {
  pause_.stop();
  wanted_.reset();
  if (!finder_) return;
  job_->cancelled = true;
  finder_->wait();
  finder_.release()->deleteLater();
  job_.reset();
}

void ImagingBoxes::refresh() {
  if (!isVisible()) return;
  if (!scene_.open() || scene_.look.threshold_hu) {
    wanted_.reset();
    return drop(tr("The parts of bone are not known yet."));
  }
  Wish now{{scene_.look.kept, scene_.look.corrections, scene_.look.box}, subdivisions_->value()};
  if (now == wanted_) return follow_crosshair();
  wanted_ = std::move(now);
  drop(tr("Finding the boxes …"));
  pause_.start();
}

void ImagingBoxes::ask() {
  if (!wanted_ || !isVisible()) return;
  if (finder_) {
    if (job_->wish != *wanted_) job_->cancelled = true;  // its end asks again
    return;
  }
  job_ = std::make_unique<Job>();
  job_->wish = *wanted_;
  // Neither the scan nor the islands change before release().
  finder_.reset(QThread::create([&scene = scene_, &of = *job_] {
    of.boxes = kept_boxes(scene.scan.geometry, scene.islands, of.wish.kept, of.wish.subdivisions,
                          [&of](double /*fraction*/) { return !of.cancelled; });
  }));
  connect(finder_.get(), &QThread::finished, this, [this, number = ++jobs_] {
    if (number != jobs_ || !finder_) return;  // it was released meanwhile
    finder_.release()->deleteLater();
    const std::unique_ptr<Job> done = std::move(job_);
    if (done->cancelled || wanted_ != done->wish) return ask();
    if (done->boxes) return take(*done);
    // Not before an edit, because the same would fail again.
    drop(tr("This machine has no memory for the sub-volumes. Keep less."));
  });
  finder_->start();
}

void ImagingBoxes::take(Job& done) {
  words_->setText(boxes_text(*done.boxes, scene_.scan.geometry));
  events_.show(std::make_shared<const KeptBoxes>(std::move(*done.boxes)));
  fill_list();
  enable_write();
}

void ImagingBoxes::drop(const QString& why) {
  words_->setText(why);
  if (!scene_.boxes) return;
  events_.show({});
  fill_list();
  enable_write();
}

void ImagingBoxes::fill_list() {
  filling_ = true;
  list_->clear();
  if (scene_.boxes)
    for (std::size_t i = 0; i < scene_.boxes->sections.size(); ++i) {
      const CoordBox& section = scene_.boxes->sections[i];
      const Coord dims = section.dims();
      list_->addItem(tr("%1: %2 × %3 × %4, %5 % of the scan")
                         .arg(i + 1)
                         .arg(dims.x)
                         .arg(dims.y)
                         .arg(dims.z)
                         .arg(percent_text(subvolumes::voxels_of(section), scene_.scan.geometry)));
    }
  filling_ = false;
  follow_crosshair();
}

void ImagingBoxes::follow_crosshair() {
  if (!scene_.boxes) return;
  filling_ = true;
  list_->setCurrentRow(scene_.boxes->section_at(scene_.crosshair));
  filling_ = false;
}

void ImagingBoxes::choose(int section) {
  if (filling_ || !scene_.boxes || section < 0 || section == scene_.boxes->section_at(scene_.crosshair)) return;
  const CoordBox& box = scene_.boxes->sections[to_index(section)];
  const auto middle = [](int low, int high) { return low + (high - low) / 2; };
  events_.look_at({middle(box.min.x, box.max.x), middle(box.min.y, box.max.y), middle(box.min.z, box.max.z)});
}

void ImagingBoxes::choose_folder() {
  const QString in = QFileDialog::getExistingDirectory(this, tr("Where the folder of the sub-volumes is to be"));
  if (in.isEmpty() || !write_->isEnabled()) return;
  const std::filesystem::path name = std::filesystem::path(in.toStdString()) / "sub-volumes";
  std::filesystem::path folder = name;
  std::error_code ignored;
  for (int n = 2; std::filesystem::exists(folder, ignored); ++n) folder = name.string() + "-" + std::to_string(n);
  events_.write(folder, subdivisions_->value());
}

void ImagingBoxes::allow(bool on, const QString& reason) {
  may_write_ = on;
  why_not_ = reason;
  enable_write();
}

void ImagingBoxes::enable_write() {
  const bool some = scene_.boxes && !scene_.boxes->sections.empty();
  set_enabled(*write_, may_write_ && some, may_write_ ? tr("There are no sub-volumes yet.") : why_not_);
}

void ImagingBoxes::showEvent(QShowEvent* event) {
  QDialog::showEvent(event);
  refresh();
}

void ImagingBoxes::hideEvent(QHideEvent* event) {
  QDialog::hideEvent(event);
  if (event->spontaneous()) return;
  release();
  drop({});
  if (!writing_) work_->clear();
}

}  // namespace osteon
