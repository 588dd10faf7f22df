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
  const std::filesystem::path page = report_folder(bone) / "report.html";
  if (!is_file(page)) return tr("The bone is made.");
  QDesktopServices::openUrl(QUrl::fromLocalFile(text_of(page)));
  return tr("The bone is made. Its report is in %1.").arg(text_of(page));
}

QCheckBox* ImagingPage::make_edge_choice() {
  auto* choice = new QCheckBox(tr("Ed&ges"));
  choice->setObjectName("edges");
  choice->setToolTip(tr("Lines where the HU change most, after Canny"));
  connect(choice, &QCheckBox::toggled, this, [this](bool on) { choose_edges(on); });
  return choice;
}

void ImagingPage::choose_edges(bool on) {
  if (!on) return show_edges({});
  if (!scene_.open() || steps_.busy()) return show_edges({});
  show_work(tr("Finding the edges"));
  steps_.find_edges();
  enable_parts();
}

void ImagingPage::show_edges(VoxelFile<std::uint8_t> edges) {
  const bool found = !edges.values.empty();
  const bool fits = found && scene_.open() && edges.geometry.dims == scene_.scan.geometry.dims;
  scene_.look.edges = fits ? std::move(edges) : VoxelFile<std::uint8_t>();
  const QSignalBlocker quiet(edges_);
  edges_->setChecked(fits);
  refresh_planes();
  if (fits) end_work(tr("The edges of the scan are shown."));
}

}  // namespace osteon
