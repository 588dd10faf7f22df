#include "server/import/series_report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace osteon::import {
namespace {

constexpr std::size_t kOthersShown = 12;

std::string problem_text(const SeriesEntry& entry) {
  return entry.problem.empty() ? "" : " (cannot be imported: " + entry.problem + ")";
}

// What the import does with the slices of the series that it takes, and what is doubtful about them.
std::string changes(const SeriesEntry& entry) {
  std::string text;
  char part[160];
  if (entry.resampled > 0) {
    std::snprintf(part, sizeof part, "resampled  %d slices, %s, to %d slices, %.3g mm apart\n", entry.slices,
                  entry.irregularity.c_str(), entry.resampled, entry.slice_mm);
    text += part;
  }
  if (entry.doubled > 0)
    text += "left out   " + std::to_string(entry.doubled) +
            (entry.doubled == 1 ? " slice at the position of another one\n" : " slices at positions of other ones\n");
  if (entry.lossy > 0)
    text += "warning    " + std::to_string(entry.lossy) + " of " + std::to_string(entry.slices) +
            " slices were compressed with loss: their HU differ from the scanner's\n";
  return text;
}

std::string skipped_line(const SeriesReport& report) {
  return report.skipped.empty() ? "" : "skipped    " + report.skipped.text() + "\n";
}

}  // namespace

std::string describe(const SeriesEntry& entry) {
  std::string text = entry.description.empty() ? "no description" : "\"" + entry.description + "\"";
  text += ", " + std::to_string(entry.slices) + (entry.slices == 1 ? " slice" : " slices");
  char part[96];
  std::snprintf(part, sizeof part, ", %dx%d", entry.columns, entry.rows);
  text += part;
  if (entry.column_mm > 0.0) {
    std::snprintf(part, sizeof part, ", %.3gx%.3g", entry.column_mm, entry.row_mm);
    text += part;
    if (entry.slice_mm > 0.0) {
      std::snprintf(part, sizeof part, "x%.3g", entry.slice_mm);
      text += part;
    }
    text += " mm";
  }
  if (!entry.plane.empty()) text += ", " + entry.plane;
  if (!entry.kernel.empty()) text += ", kernel " + entry.kernel;
  if (!entry.irregularity.empty()) text += ", " + entry.irregularity;
  return text;
}

std::string without_number_text(const SeriesReport& report) {
  return std::to_string(report.without_number) + (report.without_number == 1
                                                      ? " voxel has no finite number: it counts as air"
                                                      : " voxels have no finite number: they count as air");
}

std::string report_lines(const SeriesReport& report) {
  std::string text;
  for (const SeriesEntry& entry : report.series)
    if (entry.number == report.taken)
      text += "series     " + std::to_string(entry.number) + " of " + std::to_string(report.series.size()) + ": " +
              describe(entry) + "\n" + changes(entry);
  std::size_t others = 0;
  for (const SeriesEntry& entry : report.series) {
    if (entry.number == report.taken) continue;
    if (++others > kOthersShown) continue;
    text += (others == 1 ? "also       " : "           ") + std::to_string(entry.number) + ": " + describe(entry) +
            problem_text(entry) + "\n";
  }
  if (others > kOthersShown)
    text += "           and " + std::to_string(others - kOthersShown) + " more; osteon-import series lists them all\n";
  if (others > 0) text += "           --series N takes another\n";
  if (report.without_number > 0) text += "warning    " + without_number_text(report) + "\n";
  return text + skipped_line(report);
}

std::string list_text(const SeriesReport& report) {
  std::string text;
  for (const SeriesEntry& entry : report.series) {
    char number[32];
    std::snprintf(number, sizeof number, "%-10d ", entry.number);
    text += number + describe(entry) + problem_text(entry) + "\n";
  }
  text += "taken      " + (report.taken > 0 ? std::to_string(report.taken) : "none") +
          (report.series.size() > 1 && report.taken > 0 ? "; ct --series N takes another\n" : "\n");
  return text + skipped_line(report);
}

std::string list_json(const SeriesReport& report) {
  nlohmann::json series = nlohmann::json::array();
  for (const SeriesEntry& entry : report.series)
    series.push_back({{"number", entry.number},
                      {"description", entry.description},
                      {"slices", entry.slices},
                      {"rows", entry.rows},
                      {"columns", entry.columns},
                      {"spacing_mm", {entry.column_mm, entry.row_mm, entry.slice_mm}},
                      {"plane", entry.plane},
                      {"kernel", entry.kernel},
                      {"irregularity", entry.irregularity},
                      {"resampled", entry.resampled},
                      {"doubled", entry.doubled},
                      {"lossy", entry.lossy},
                      {"problem", entry.problem}});
  nlohmann::json skipped = nlohmann::json::array();
  for (const SkippedFiles::Count& c : report.skipped.counts())
    skipped.push_back({{"kind", count_text(c.kind, c.modality, 1).substr(2)}, {"count", c.count}, {"names", c.names}});
  return nlohmann::json{{"series", series}, {"taken", report.taken}, {"skipped", skipped}}.dump(2) + "\n";
}

}  // namespace osteon::import
