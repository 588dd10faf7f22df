#include "server/import/import_report.hpp"

#include <cstdint>
#include <new>
#include <vector>

#include "common/runtime/files.hpp"
#include "common/runtime/new_folder.hpp"
#include "server/import/ct_case.hpp"
#include "server/import/report_html.hpp"
#include "server/import/report_pictures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// Draws the labels of a case one by one, where the import did not do it.
Result<void> draw_parts(const LabelledVoxels& voxels, ReportFacts& facts, const KeepGoing& keep_going) {
  std::size_t drawn = 0;
  for (ReportPart& part : facts.parts) {
    if (!part.kept || part.picture.width() > 0 || ++drawn > kMostIslandsDrawn) continue;
    auto picture = label_picture(voxels, part.number, part.colour.value_or(kGreyInk), keep_going);
    if (!picture) return tl::unexpected(picture.error());
    part.picture = std::move(*picture);
  }
  return {};
}

Result<std::string> written_png(const Picture& picture, const fs::path& file) {
  auto png = picture.png();
  if (!png) return png;
  if (auto written = write_file(file, *png); !written) return tl::unexpected(written.error());
  return png;
}

Result<void> write_files(const ImportReport& report, const fs::path& folder, const KeepGoing& keep_going) try {
  auto facts = report_facts(report, part(keep_going, 0.0, 0.2));
  if (!facts) return tl::unexpected(facts.error());
  ReportImages images;
  if (report.bone) {
    const std::vector<std::uint8_t> labels = report.scan->labels.dense();
    const LabelledVoxels voxels{report.scan->geometry, report.scan->hu, labels};
    const auto picture = montage(voxels, report.bone->info().labels, *facts, part(keep_going, 0.2, 0.8));
    if (!picture) return tl::unexpected(picture.error());
    auto png = written_png(*picture, folder / "montage.png");
    if (!png) return tl::unexpected(png.error());
    images.montage = std::move(*png);
    if (!report.islands || report.labels)
      if (auto drawn = draw_parts(voxels, *facts, part(keep_going, 0.8, 1.0)); !drawn) return drawn;
  }
  if (report.islands && report.islands->views.overview.width() > 0) {
    auto png = written_png(report.islands->views.overview, folder / "islands.png");
    if (!png) return tl::unexpected(png.error());
    images.islands = std::move(*png);
  }
  if (facts->has_hu) {
    auto png = written_png(histogram_picture(*facts), folder / "histogram.png");
    if (!png) return tl::unexpected(png.error());
    images.histogram = std::move(*png);
  }
  const auto html = to_html(*facts, images);
  if (!html) return tl::unexpected(html.error());
  if (auto written = write_file(folder / "report.html", *html); !written) return written;
  if (auto written = write_file(folder / "report.json", to_json(*facts)); !written) return written;
  if (!keep_going(1.0)) return stopped_while("writing the report");
  return {};
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, kNoMemory);
}

}  // namespace

Result<void> write_report(const ImportReport& report, const fs::path& folder, const KeepGoing& keep_going) {
  return write_new_folder(folder, [&](const fs::path& partial) { return write_files(report, partial, keep_going); });
}

}  // namespace osteon::import
