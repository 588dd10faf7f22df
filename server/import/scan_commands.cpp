// The commands that show what is in a scan before a case is made of it. The window osteon draws with them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "common/imaging/island_kinds.hpp"
#include "common/runtime/number_option.hpp"
#include "server/import/command.hpp"
#include "server/import/ct_case.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/edit_file.hpp"
#include "server/import/raw_nrrd.hpp"
#include "server/import/scan_arguments.hpp"

namespace osteon::import {
namespace {

// A number is a byte. Islands from the 255th on share it.
constexpr std::size_t kMostNumbered = 254;

struct ShownScan {
  ScanArguments scan;
  FilterArguments filter;
  EdgeArguments edge;
  std::string out, edits;
  double threshold_hu = CtOptions{}.threshold_hu;
};

Result<void> check_raw_file(const std::string& file) {
  if (!std::string_view(file).ends_with(".nrrd")) return bad_input(file + " does not end in .nrrd");
  return check_free(file);
}

Result<std::string> run_export_scan(const ShownScan& a, const StopSignal& stop) {
  if (auto good = check_raw_file(a.out); !good) return tl::unexpected(good.error());
  Bar bar(stop, "reading");
  auto scan = read_scan(a.scan, bar.stage(0.0, 0.7));
  if (!scan) return tl::unexpected(scan.error());
  CtOptions options;
  options.median = median_box(a.filter);
  options.gaussian_mm = a.filter.gaussian_mm;
  if (auto smoothed = smooth_scan(scan->volume, options, bar.stage(0.7, 0.9)); !smoothed)
    return tl::unexpected(smoothed.error());
  if (auto written = write_raw_nrrd(scan->volume, scan->volume.values, a.out, bar.stage(0.9, 1.0)); !written)
    return tl::unexpected(written.error());
  bar.stage(1.0, 1.0)(1.0);
  return "scan       " + imaging::describe(scan->volume) + ", in " + a.out + "\n" + report_lines(scan->report);
}

Result<std::string> run_edges(const ShownScan& a, const StopSignal& stop) {
  if (auto good = check_raw_file(a.out); !good) return tl::unexpected(good.error());
  const auto params = canny_params(a.edge);
  if (!params) return tl::unexpected(params.error());
  Bar bar(stop, "finding");
  auto scan = read_scan(a.scan, bar.stage(0.0, 0.3));
  if (!scan) return tl::unexpected(scan.error());
  const imaging::HuVolume grid = without_values(scan->volume);
  const auto edges = imaging::canny_edges(std::move(scan->volume), *params, bar.stage(0.3, 0.9));
  if (!edges) return tl::unexpected(edges.error());
  if (auto written = write_raw_nrrd(grid, edges->values, a.out, bar.stage(0.9, 1.0)); !written)
    return tl::unexpected(written.error());
  bar.stage(1.0, 1.0)(1.0);
  return "edges      " + std::to_string(std::ranges::count(edges->values, 1)) + " voxels, in " + a.out + "\n";
}

std::string islands_json(const CtSegmentation& found) {
  nlohmann::json islands = nlohmann::json::array();
  for (std::size_t i = 0; i < std::min(kMostNumbered, found.islands.size()); ++i) {
    const imaging::Island& island = found.islands[i];
    const Vec3& at = island.centre_mm;
    islands.push_back({{"number", i + 1},
                       {"kind", imaging::name_of(found.natures[i].kind)},
                       {"volume_cm3", island.volume_cm3},
                       {"density_g_cm3", island.density_g_cm3},
                       {"centre_mm", {at.x(), at.y(), at.z()}}});
  }
  return nlohmann::json{{"threshold_hu", found.threshold_hu}, {"count", found.islands.size()}, {"islands", islands}}
             .dump(2) +
         "\n";
}

Result<std::string> run_islands(const ShownScan& a, const StopSignal& stop) {
  if (auto good = check_raw_file(a.out); !good) return tl::unexpected(good.error());
  CtOptions options;
  if (!a.edits.empty()) {
    auto edits = read_edits(a.edits);
    if (!edits) return tl::unexpected(edits.error());
    options.edits = std::move(*edits);  // only a box among them changes the islands
    options.edits_file = a.edits;
  }
  Bar bar(stop, "finding");
  auto scan = read_scan(a.scan, bar.stage(0.0, 0.3));
  if (!scan) return tl::unexpected(scan.error());
  options.threshold_hu = a.threshold_hu;
  options.list_only = true;
  options.number_islands = true;
  const auto found = import_ct(std::move(*scan), options, bar.stage(0.3, 2.0));  // the stages after a list do not come
  if (!found)
    return tl::unexpected(found.error().code == ErrorCode::cancelled
                              ? found.error()
                              : Error{found.error().code, a.scan.input + ": " + found.error().message});
  imaging::HuVolume grid;
  const ScanGeometry& geometry = found->scan.geometry;
  grid.dims = geometry.dims;
  grid.origin_mm = geometry.origin_mm;
  grid.spacing_mm = geometry.axes_mm.colwise().norm();
  grid.directions = geometry.axes_mm.colwise().normalized();
  if (auto written = write_raw_nrrd(grid, found->scan.labels.dense(), a.out, bar.stage(0.9, 1.0)); !written)
    return tl::unexpected(written.error());
  bar.stage(1.0, 1.0)(1.0);
  return islands_json(found->found);
}

}  // namespace

void add_scan_commands(CLI::App& app, std::vector<Command>& commands) {
  const auto shared = std::make_shared<ShownScan>();
  CLI::App* scan = app.add_subcommand("export-scan", "Write the HU of a scan as one file for other programs");
  add_scan_options(*scan, shared->scan);
  scan->add_option("FILE", shared->out, "File to write: .nrrd, not compressed")->required();
  add_filter_options(*scan, shared->filter);
  commands.push_back({scan, [shared](const StopSignal& stop) { return run_export_scan(*shared, stop); }});

  const auto found = std::make_shared<ShownScan>();
  CLI::App* islands = app.add_subcommand(
      "islands", "Find the separate parts of bone in a scan, list them as JSON, and write where they lie");
  add_scan_options(*islands, found->scan);
  islands->add_option("FILE", found->out, "File to write: .nrrd, with the number of an island for each of its voxels")
      ->required();
  islands->add_option("--threshold", found->threshold_hu, "Voxels at or above it are bone, HU")
      ->check(number_in(-1000.0, 4000.0))
      ->capture_default_str();
  islands->add_option("--edits", found->edits, "YAML file of corrections, whose box limits the search");
  commands.push_back({islands, [found](const StopSignal& stop) { return run_islands(*found, stop); }});

  const auto lines = std::make_shared<ShownScan>();
  CLI::App* edges = app.add_subcommand("edges", "Find the edges of a scan by Canny's method, and write where they lie");
  add_scan_options(*edges, lines->scan);
  edges->add_option("FILE", lines->out, "File to write: .nrrd, with 1 for each voxel of an edge, and 0 elsewhere")
      ->required();
  add_edge_options(*edges, lines->edge);
  commands.push_back({edges, [lines](const StopSignal& stop) { return run_edges(*lines, stop); }});
}

}  // namespace osteon::import
