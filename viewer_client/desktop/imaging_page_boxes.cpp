// The sub-volumes of the page of image processing.
#include <QHideEvent>
#include <QPushButton>
#include <QShortcut>
#include <utility>

#include "viewer_client/desktop/imaging_page.hpp"

namespace osteon {

QPushButton* ImagingPage::make_boxes_button() {
  boxes_ = new ImagingBoxes(
      scene_,
      {[this](std::shared_ptr<const KeptBoxes> boxes) {
         scene_.boxes = std::move(boxes);
         refresh_planes();
       },
       [this](const std::array<int, 3>& voxel) { look_at(voxel); },
       [this](const std::filesystem::path& folder, int subdivisions) { write_boxes(folder, subdivisions); },
       [this] { steps_.cancel(); }},
      this);
  // The keys of the page's window do not reach the dialog.
  for (QPushButton* of : {undo_, redo_})
    connect(new QShortcut(of->shortcut(), boxes_), &QShortcut::activated, of, &QPushButton::click);
  auto* button = new QPushButton(tr("Sub-volumes…"));
  button->setObjectName("open_sub_volumes");
  button->setShortcut(QKeySequence("Ctrl+Alt+B"));
  button->setToolTip(
      QString("%1 (%2)").arg(tr("Shows bounding box, section boxes and quadtree of what is kept, and writes them"),
                             button->shortcut().toString(QKeySequence::NativeText)));
  connect(button, &QPushButton::clicked, this, [this] {
    boxes_->show();
    boxes_->raise();
    boxes_->activateWindow();
  });
  return button;
}

void ImagingPage::write_boxes(const std::filesystem::path& folder, int subdivisions) {
  if (steps_.busy() || !scene_.boxes) return;
  const QString what = tr("Writing the root sub-volumes");
  show_work(what);
  boxes_->begin_work(what);
  steps_.write_boxes(scene_.scan.geometry, scene_.islands, {scene_.look.kept, scene_.look.corrections, scene_.look.box},
                     found_hu(), subdivisions, folder);
  enable_parts();
}

void ImagingPage::hideEvent(QHideEvent* event) {
  QWidget::hideEvent(event);
  if (!event->spontaneous()) boxes_->hide();
}

void ImagingPage::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  check_made();
}

}  // namespace osteon
