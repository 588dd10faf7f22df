// What the page of image processing shows besides the edits: the edges of the scan, and the report of the bone.
#include <QCheckBox>
#include <QDesktopServices>
#include <QSignalBlocker>
#include <QUrl>
#include <utility>

#include "viewer_client/desktop/imaging_page.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {

QCheckBox* ImagingPage::make_report_choice() {
  auto* choice = new QCheckBox(tr("With a rep&ort"));
  choice->setObjectName("with_report");
  choice->setToolTip(tr("A page with pictures and numbers of the bone, beside the case; it opens at the end"));
  return choice;
}

QString ImagingPage::show_report(const std::filesystem::path& bone) const {
  const std::filesystem::path page = report_page(bone);
  if (!is_file(page)) return tr("The bone is made.");
  if (!QDesktopServices::openUrl(QUrl::fromLocalFile(text_of(page))))
    return tr("The bone is made. No program opens its report %1.").arg(text_of(page));
  return tr("The bone is made. Its report is in %1.").arg(text_of(page));
}

QCheckBox* ImagingPage::make_edge_choice() {
  auto* choice = new QCheckBox(tr("Ed&ges"));
  choice->setObjectName("edges");
  choice->setToolTip(tr("Lines where the HU change most, by Canny's method"));
  connect(choice, &QCheckBox::toggled, this, [this](bool on) { choose_edges(on); });
  return choice;
}

void ImagingPage::choose_edges(bool on) {
  if (!on) return show_edges({});
  if (!scene_.open() || steps_.busy()) return show_edges({});
  show_work(tr("Finding the edges"));
  steps_.find_edges(scene_.scan.geometry);
  enable_parts();
}

void ImagingPage::show_edges(VoxelFile<std::uint8_t> edges) {
  const bool found = !edges.values.empty();
  scene_.look.edges = std::move(edges);
  const QSignalBlocker quiet(edges_);
  edges_->setChecked(found);
  refresh_planes();
  if (found) end_work(tr("The edges of the scan are shown."));
}

}  // namespace osteon
