#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/geometry/mesh_file.hpp"
#include "common/imaging/threshold.hpp"
#include "common/runtime/number_option.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/mesh_distance.hpp"
#include "server/import/case_report.hpp"
#include "server/import/command.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/edit_file.hpp"
#include "server/import/found_files.hpp"
#include "server/import/import_report.hpp"
#include "server/import/label_export.hpp"
#include "server/import/label_import.hpp"
#include "server/import/label_map.hpp"
#include "server/import/scan_arguments.hpp"
#include "server/import/slice_images.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kMeshPitch_mm = 0.5;
constexpr const char* kSuggest = "suggest";

struct CaseArguments {
  ScanArguments scan;
  std::string input, out, title, legend, spacing, unit = "mm", threshold;
  std::string keep, grow_by = "volume", window = "400,1800", edges;
  std::string rods_of, surface = "half", between_slices = "auto", thin_cortex = "off", contrast = "apart";
  std::optional<std::string> calibration, rods;
  std::string labels, report, truth, edits;
  std::vector<std::string> bone_colours, seeds, label_names;
  std::optional<double> pitch_mm, similar_hu;
  FilterArguments filter;
  EdgeArguments edge;
  double margin_mm = CtOptions{}.margin_mm;
  double density_g_cm3 = 1.9, metal_hu = CtOptions{}.metal_hu;
  bool rescale_hu = false, json = false, separate = false, merge = false, hollow = false, list = false,
       adaptive = false, with_hu = false;
};

// "all", or numbers such as "1,3". Empty: the largest that is bone.
Result<void> parse_keep(const std::string& text, CtOptions& options) {
  options.keep_all = text == "all";
  if (text.empty() || options.keep_all) return {};
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    int number = 0;
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, number);
    if (error != std::errc{} || stop != text.data() + end || number < 1)
      return failure(ErrorCode::invalid_input,
                     "--keep " + text + " is not a list of islands; write numbers such as 1,3, or all");
    options.keep.push_back(number);
    begin = end + 1;
  }
  return {};
}

// A line that no scanner has is a mistake of units or of order.
Result<DensityCalibration> parse_calibration(const std::string& text) {
  constexpr double kLeastSlope = 1e-4, kMostSlope = 1e-2, kMostIntercept_g_cm3 = 2.0;
  const auto line = parse_pair(text);
  if (!line || !(line->first >= kLeastSlope && line->first <= kMostSlope) ||
      !(std::abs(line->second) <= kMostIntercept_g_cm3))
    return bad_input(
        "--calibration " + text +
        " is not a line from HU to density; write SLOPE,INTERCEPT with a slope of 0.0001 to 0.01 g/cm3 per "
        "HU and an intercept of -2 to 2 g/cm3, such as 0.001067,0.131");
  return DensityCalibration{line->first, line->second};
}

// "0,0.1,0.2"
Result<std::vector<double>> parse_rods(const std::string& text) {
  constexpr double kMostRod_g_cm3 = 3.0;
  std::vector<double> densities;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    double density = 0.0;
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, density);
    if (error != std::errc{} || stop != text.data() + end || !(density >= 0.0 && density <= kMostRod_g_cm3))
      return bad_input("--rods " + text +
                       " is not a list of densities; write those of two to eight rods in g/cm3, such as 0,0.1,0.2");
    densities.push_back(density);
    begin = end + 1;
  }
  return densities;
}

Result<CalibrationOptions> calibration_options(const CaseArguments& a) {
  CalibrationOptions options;
  options.rescale_hu = a.rescale_hu;
  if (a.rods_of == "hydroxyapatite") options.rods_of = RodMaterial::hydroxyapatite;
  if (a.calibration) {
    const auto line = parse_calibration(*a.calibration);
    if (!line) return tl::unexpected(line.error());
    options.line = *line;
  }
  if (a.rods) {
    auto rods = parse_rods(*a.rods);
    if (!rods) return tl::unexpected(rods.error());
    options.rods_g_cm3 = std::move(*rods);
  }
  return options;
}

// Adds the input's name to an error about its content.
Error about(const std::string& input, const Error& error) {
  return error.code == ErrorCode::cancelled ? error : Error{error.code, input + ": " + error.message};
}

// The labels of --labels on the voxels of the scan. Nothing without that option.
Result<std::optional<PlacedLabels>> read_labels(const CaseArguments& a, const LabelNames& names, const CtScan& scan,
                                                const KeepGoing& reading) {
  if (a.labels.empty()) return std::optional<PlacedLabels>();
  auto map = read_label_map(a.labels, part(reading, 0.0, 0.5));
  if (!map) return tl::unexpected(map.error());
  auto placed = place_labels(std::move(*map), names, scan.volume, scan.frame_of_reference, part(reading, 0.5, 1.0));
  if (!placed) return tl::unexpected(placed.error());
  return std::optional(std::move(*placed));
}

// Both folders are new, and neither is in the other.
Result<void> check_folders(const CaseArguments& a) {
  for (const std::string& folder : {a.out, a.report})
    if (!folder.empty())
      if (auto is_free = check_free(folder); !is_free) return is_free;
  if (a.out.empty() || a.report.empty()) return {};
  std::error_code error;
  const std::string out = fs::weakly_canonical(fs::path(a.out) / "", error).string();
  const std::string report = fs::weakly_canonical(fs::path(a.report) / "", error).string();
  if (out.starts_with(report) || report.starts_with(out))
    return bad_input("--report " + a.report + " and --out " + a.out + " are in one another; give another folder");
  return {};
}

// What a report and a comparison need of a scan, before the import takes its voxels.
struct ReadScan {
  ScanGeometry geometry;
  std::string source;
  SeriesReport series;
  std::vector<std::int64_t> histogram;
  std::optional<TruthLabels> truth;
};

Result<ReadScan> look_at(const CtScan& scan, const CaseArguments& a, const LabelNames& names,
                         const KeepGoing& keep_going) {
  const imaging::HuVolume& v = scan.volume;
  ReadScan read{.geometry = {v.dims, v.origin_mm, v.directions * v.spacing_mm.asDiagonal()},
                .source = scan.source,
                .series = scan.report,
                .histogram = {},
                .truth = {}};
  if (!a.truth.empty()) {
    auto truth = read_truth(a.truth, names, v, scan.frame_of_reference, part(keep_going, 0.0, 0.8));
    if (!truth) return tl::unexpected(truth.error());
    read.truth = std::move(*truth);
  }
  if (a.report.empty()) return read;
  auto histogram = imaging::hu_histogram(v, part(keep_going, 0.8, 1.0));
  if (!histogram) return tl::unexpected(histogram.error());
  read.histogram = std::move(*histogram);
  return read;
}

// Compares, writes the report, and then saves the case. A case that cannot be saved has no report.
Result<std::string> finish_ct(const CtImport& made, ReadScan read, const CtOptions& options, bool labelled,
                              const CaseArguments& a, Bar& bar, const StopSignal& stop) {
  std::string text;
  std::optional<LabelComparison> comparison;
  if (read.truth) {
    auto compared = compare_labels(made.scan, made.bone->info().labels, *read.truth, bar.stage(0.85, 0.9));
    if (!compared) return tl::unexpected(compared.error());
    text = comparison_text(*compared);
    comparison = std::move(*compared);
  }
  if (!a.report.empty()) {
    const ImportReport report{.bone = made.bone ? &*made.bone : nullptr,
                              .scan = &made.scan,
                              .islands = &made.found,
                              .labels = labelled ? &made.labels : nullptr,
                              .series = &read.series,
                              .options = &options,
                              .read = read.geometry,
                              .title = options.title,
                              .source = read.source,
                              .histogram = std::move(read.histogram),
                              .comparison = comparison ? &*comparison : nullptr};
    if (auto written = write_report(report, a.report, bar.stage(0.9, 0.95)); !written)
      return tl::unexpected(written.error());
    text += "report     " + a.report + "/report.html\n";
  }
  if (a.list) return text;
  if (auto saved = save(*made.bone, made.scan, a.out, stop); !saved) {
    std::error_code error;
    if (!a.report.empty()) fs::remove_all(a.report, error);
    return tl::unexpected(saved.error());
  }
  return text;
}

// Seeds of what is no bone grow as a bone whose number nothing else has.
Result<void> take_outside_seeds(const CaseArguments& a, CtOptions& options) {
  if (std::ranges::find(options.edits, EditKind::outside, &LabelEdit::kind) == options.edits.end()) return {};
  if (options.grow.seeds_mm.empty())
    return bad_input(a.edits + " has a seed outside and none of a bone; write a seed, or give --seed");
  int outside = imaging::kMostMarkers;
  while (outside > 0 && std::ranges::find(options.grow.bones, outside) != options.grow.bones.end()) --outside;
  if (outside == 0) return bad_input(a.edits + " has seeds of too many bones for one outside; remove some");
  options.grow.outside = outside;
  options.separate = true;
  for (const LabelEdit& edit : options.edits) {
    if (edit.kind != EditKind::outside) continue;
    options.grow.seeds_mm.push_back(edit.points_mm.front());
    options.grow.bones.push_back(outside);
  }
  return {};
}

// Reads the edits of --edits. Seeds among them come after those of the command line, and separate the bones.
Result<void> take_edits(const CaseArguments& a, CtOptions& options) {
  if (a.edits.empty()) return {};
  auto edits = read_edits(a.edits);
  if (!edits) return tl::unexpected(edits.error());
  options.edits = std::move(*edits);
  options.edits_file = a.edits;
  int next = static_cast<int>(options.grow.seeds_mm.size()) + 1;
  for (int bone = 1; bone < next; ++bone) options.grow.bones.push_back(bone);
  for (LabelEdit& edit : options.edits) {
    if (edit.kind == EditKind::box && !a.labels.empty())
      return bad_input(a.edits + " has a box, which --labels excludes; remove one of them");
    if (edit.kind != EditKind::seed) continue;
    if (!a.keep.empty() || !a.labels.empty())
      return bad_input(a.edits + " has a seed, which --keep and --labels exclude; remove it, or leave them out");
    if (edit.bone == 0) edit.bone = next;
    next = std::max(next, edit.bone + 1);
    options.grow.seeds_mm.push_back(edit.points_mm.front());
    options.grow.bones.push_back(edit.bone);
    options.separate = true;
  }
  return take_outside_seeds(a, options);
}

Result<std::string> run_ct(const CaseArguments& a, const StopSignal& stop) {
  if (a.out.empty() && !a.list)
    return failure(ErrorCode::invalid_input,
                   "--out is missing; name the folder of the case, or give --list to see the islands alone");
  if (auto good = check_folders(a); !good) return tl::unexpected(good.error());
  CtOptions options;
  if (auto parsed = parse_keep(a.keep, options); !parsed) return tl::unexpected(parsed.error());
  options.merge = a.merge;
  options.hollow = a.hollow;
  options.list_only = a.list;
  options.draw_islands = !a.report.empty();
  options.median = median_box(a.filter);
  options.gaussian_mm = a.filter.gaussian_mm;
  for (const std::string& seed : a.seeds) {
    const auto position_mm = parse_seed(seed);
    if (!position_mm) return tl::unexpected(position_mm.error());
    options.grow.seeds_mm.push_back(*position_mm);
  }
  options.grow.similar_hu = a.similar_hu;
  options.grow.adaptive = a.adaptive;
  options.grow.by = a.grow_by == "slice" ? imaging::GrowBy::slice : imaging::GrowBy::volume;
  options.margin_mm = a.margin_mm;
  options.metal_hu = a.metal_hu;
  options.thin_cortex = a.thin_cortex == "on";
  options.contrast_is_bone = a.contrast == "bone";
  options.surface = a.surface == "half" ? SurfaceAt::half_maximum : SurfaceAt::threshold;
  options.between_slices = a.between_slices == "hu"       ? BetweenSlices::hu
                           : a.between_slices == "shapes" ? BetweenSlices::shapes
                                                          : BetweenSlices::automatic;
  auto calibration = calibration_options(a);
  if (!calibration) return tl::unexpected(calibration.error());
  options.calibration = std::move(*calibration);
  if (!a.label_names.empty() && a.labels.empty() && a.truth.empty())
    return bad_input("--label-names needs a label map; give --labels or --truth too");
  options.separate = a.separate;
  if (auto taken = take_edits(a, options); !taken) return tl::unexpected(taken.error());
  const auto names = parse_label_names(a.label_names);
  if (!names) return tl::unexpected(names.error());
  Bar bar(stop);
  auto scan = read_scan(a.scan, bar.stage(0.0, 0.2));
  if (!scan) return tl::unexpected(scan.error());
  const std::string series = report_lines(scan->report);

  options.pitch_mm = a.pitch_mm;
  options.suggest_threshold = a.threshold == kSuggest;
  if (!a.threshold.empty() && !options.suggest_threshold) options.threshold_hu = std::stod(a.threshold);
  if (!a.title.empty()) options.title = a.title;
  if (std::ranges::any_of(options.title, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    return failure(ErrorCode::invalid_input, "--title has control characters; write it in one line of plain text");
  auto placed = read_labels(a, *names, *scan, bar.stage(0.2, 0.3));
  if (!placed) return tl::unexpected(placed.error());
  auto read = look_at(*scan, a, *names, bar.stage(*placed ? 0.3 : 0.2, *placed ? 0.35 : 0.25));
  if (!read) return tl::unexpected(read.error());
  const KeepGoing making = bar.stage(*placed ? 0.35 : 0.25, 0.85);
  const bool labelled = placed->has_value();
  const auto made = labelled ? import_ct(std::move(*scan), std::move(**placed), options, making)
                             : import_ct(std::move(*scan), options, making);
  if (!made) return tl::unexpected(about(a.scan.input, made.error()));
  const auto finished = finish_ct(*made, std::move(*read), options, labelled, a, bar, stop);
  if (!finished) return finished;
  bar.stage(1.0, 1.0)(1.0);
  return (a.list ? "" : report_text(*made->bone)) + series + made->calibration_text +
         (labelled ? labels_text(made->labels, made->found.case_cm3) + edits_text(made->found)
                   : segmentation_text(made->found)) +
         *finished;
}

Result<std::string> run_series(const CaseArguments& a, const StopSignal& stop) {
  Bar bar(stop, "searching");
  const auto searching = bar.stage(0.0, 1.0);
  if (Result<void> scan = check_no_case_file(a.input); !scan) return tl::unexpected(scan.error());
  if (const std::string_view one = name_of_one_scan(a.input, searching); !one.empty())
    return bad_input(a.input + " is " + std::string(one) + " with one scan; give it to osteon-import ct");
  if (!a.out.empty())
    if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  const auto report =
      a.out.empty() ? list_dicom_series(a.input, searching) : draw_dicom_series(a.input, a.out, a.with_hu, searching);
  if (!report) return tl::unexpected(report.error());
  return a.json ? list_json(*report) : list_text(*report);
}

Result<SliceOptions> slice_options(const CaseArguments& a) {
  SliceOptions options;
  const auto window = parse_pair(a.window);
  if (!window || window->second < 1.0)
    return bad_input("--window " + a.window +
                     " is not a window; write its centre and its width of at least 1 HU, such "
                     "as 400,1800");
  options.window = {window->first, window->second};
  const auto edges = canny_params(a.edge);
  if (!edges) return tl::unexpected(edges.error());
  options.edges = *edges;
  options.content = a.edges == "canny"      ? SliceContent::canny
                    : a.edges == "gradient" ? SliceContent::gradient
                                            : SliceContent::grey;
  options.median = median_box(a.filter);
  options.gaussian_mm = a.filter.gaussian_mm;
  return options;
}

Result<std::string> run_slices(const CaseArguments& a, const StopSignal& stop) {
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  const auto options = slice_options(a);
  if (!options) return tl::unexpected(options.error());
  Bar bar(stop);
  auto scan = read_scan(a.scan, bar.stage(0.0, 0.4));
  if (!scan) return tl::unexpected(scan.error());
  const std::string text = "slices     " + imaging::describe(scan->volume) + ", as PNG in " + a.out + "\n";
  const std::string series = report_lines(scan->report);
  if (auto written = write_slice_images(std::move(scan->volume), a.out, *options, bar.stage(0.4, 1.0)); !written)
    return tl::unexpected(written.error());
  bar.stage(1.0, 1.0)(1.0);
  return text + series;
}

Result<std::string> run_labels(const CaseArguments& a, const StopSignal& stop) {
  if (auto good = check_folders(a); !good) return tl::unexpected(good.error());
  const auto spacing = parse_spacing(a.spacing);
  if (!spacing) return tl::unexpected(spacing.error());
  LabelLegend legend;
  if (!a.legend.empty()) {
    auto read = read_legend(a.legend);
    if (!read) return tl::unexpected(read.error());
    legend = std::move(*read);
  }
  if (!a.bone_colours.empty()) legend.bones.clear();
  for (const std::string& text : a.bone_colours) {
    auto colour = parse_bone_colour(text);
    if (!colour) return tl::unexpected(colour.error());
    legend.bones.push_back(std::move(*colour));
  }

  Bar bar(stop);
  auto stack = read_label_stack(a.input, legend, *spacing, bar.stage(0.0, 0.1));
  if (!stack) return tl::unexpected(stack.error());
  const std::vector<ColourCount> colours = stack->colours;
  LabelOptions options;
  options.pitch_mm = a.pitch_mm;
  if (!a.title.empty()) options.title = a.title;
  const auto made = import_labels(std::move(*stack), legend, options, bar.stage(0.1, 0.85));
  if (!made) return tl::unexpected(about(a.input, made.error()));
  if (!a.report.empty())
    if (auto written = write_report({.bone = &made->bone, .scan = &made->scan}, a.report, bar.stage(0.85, 0.95));
        !written)
      return tl::unexpected(written.error());
  if (auto saved = save(made->bone, made->scan, a.out, stop); !saved) {
    std::error_code error;
    if (!a.report.empty()) fs::remove_all(a.report, error);
    return tl::unexpected(saved.error());
  }
  bar.stage(1.0, 1.0)(1.0);

  std::string text = report_text(made->bone);
  char line[200];
  const double labelled = made->labelled_mm3, kept = made->bone.volume_mm3();
  std::snprintf(line, sizeof line, "labelled   %.2f cm3; the smoothed bone has %+.2f %% of that more\n",
                labelled * 1e-3, 100.0 * (kept - labelled) / labelled);
  text += line;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const ColourCount& c = colours[i];
    if (c.label == 0 && i >= 12) continue;  // noise
    const std::string name = c.label == 0 ? "other" : legend.bones[static_cast<std::size_t>(c.label) - 1].name;
    std::snprintf(line, sizeof line, "colour     %3d,%3d,%3d  %12lld voxels  %s\n", c.rgba[0], c.rgba[1], c.rgba[2],
                  static_cast<long long>(c.voxels), name.c_str());
    text += line;
  }
  return text;
}

// The word "suggest", or a number within these limits.
CLI::Validator suggest_or_number_in(double low, double high) {
  const auto check = [number = number_in(low, high)](std::string value) {
    if (value == kSuggest) return std::string();
    const std::string wrong = number(value);
    return wrong.empty() ? wrong : wrong + ", nor the word " + kSuggest;
  };
  return {check, "NUMBER or suggest", "suggest or number in"};
}

double millimetres_of(const std::string& unit) {
  return unit == "m" ? 1000.0 : unit == "inch" ? 25.4 : unit == "cm" ? 10.0 : 1.0;
}

Result<std::string> run_stl(const CaseArguments& a, const StopSignal& stop) {
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  auto mesh = read_stl(a.input);
  if (!mesh) return tl::unexpected(mesh.error());
  const auto scale = static_cast<float>(millimetres_of(a.unit));
  for (auto& corner : mesh->positions_mm)
    for (float& value : corner) value *= scale;
  const double enclosed = std::abs(enclosed_mm3(*mesh));

  CaseInfo info;
  info.title = a.title.empty() ? "Mesh" : a.title;
  info.source = "STL mesh, " + std::to_string(mesh->triangles.size()) + " triangles";
  info.pitch_mm = a.pitch_mm.value_or(kMeshPitch_mm);
  Bar bar(stop);
  const auto bone = case_of_mesh(std::move(info), *mesh, a.density_g_cm3, bar.stage(0.05, 0.95));
  if (!bone) return tl::unexpected(about(a.input, bone.error()));
  if (auto saved = save(*bone, a.out, stop); !saved) return tl::unexpected(saved.error());
  bar.stage(1.0, 1.0)(1.0);
  char line[160];
  std::snprintf(line, sizeof line,
                "mesh       %.2f cm3 within its triangles; the sampled bone has %+.2f %% of that more\n",
                enclosed * 1e-3, 100.0 * (bone->volume_mm3() - enclosed) / enclosed);
  return report_text(*bone) + line;
}

Result<std::string> run_export_labels(const CaseArguments& a, const StopSignal& stop) {
  if (auto known = check_label_file(a.out); !known) return tl::unexpected(known.error());
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  const auto bone = Case::load(a.input);
  if (!bone) return tl::unexpected(bone.error());
  Bar bar(stop, "exporting");
  const auto scan = load_scan(a.input, *bone, bar.stage(0.0, 0.7));
  if (!scan) return tl::unexpected(scan.error());
  const std::vector<CaseLabel>& labels = bone->info().labels;
  if (auto written = write_labels(*scan, labels, a.out, bar.stage(0.7, 1.0)); !written) {
    const Error& error = written.error();
    return tl::unexpected(error.code == ErrorCode::invalid_input ? about(a.input, error) : error);
  }
  bar.stage(1.0, 1.0)(1.0);
  std::string text = "labels     " + std::to_string(labels.size()) + " in " + a.out + "\n";
  for (const CaseLabel& label : labels)
    text +=
        "           " + std::to_string(label.value) + "=" + label.name + ":" + std::string(name_of(label.kind)) + "\n";
  return text;
}

Result<std::string> run_info(const CaseArguments& a) {
  const auto bone = Case::load(a.input);
  if (!bone) return tl::unexpected(bone.error());
  // A case that a client received has no scan. One that is there must be whole.
  if (bone->info().scan && fs::exists(fs::path(a.input) / kScanFile))
    if (const auto scan = load_scan(a.input, *bone); !scan) return tl::unexpected(scan.error());
  return a.json ? report_json(*bone) : report_text(*bone);
}

}  // namespace

Result<void> save(const Case& bone, const std::string& out, const StopSignal& stop) {
  if (stop.requested()) return tl::unexpected(stopped());
  return bone.save(out, [&](double) { return !stop.requested(); });
}
Result<void> save(const Case& bone, const CaseScan& scan, const std::string& out, const StopSignal& stop) {
  if (stop.requested()) return tl::unexpected(stopped());
  return bone.save(out, scan, [&](double) { return !stop.requested(); });
}

Result<void> check_free(const std::string& path) {
  std::error_code error;
  if (fs::exists(path, error))
    return failure(ErrorCode::exists, path + " is already there; choose another name or remove it first");
  return {};
}

namespace {

void add_density_options(CLI::App& command, CaseArguments& a) {
  CLI::Option* line = command.add_option("--calibration", a.calibration,
                                         "SLOPE,INTERCEPT of the line from HU to density, g/cm3 per HU and g/cm3 "
                                         "(default: 0.001067,0.131, of Rho 1995 for the proximal femur)");
  CLI::Option* rods = command
                          .add_option("--rods", a.rods,
                                      "Find rods of these densities, g/cm3, such as 0,0.1,0.2, along the slices of the "
                                      "scan, and take the line through their HU")
                          ->excludes(line);
  command
      .add_option("--rods-of", a.rods_of,
                  "What --rods gives the density of: apparent (wet bone that looks like the rod; default) or "
                  "hydroxyapatite (mineral; bone has 1/0.6 of it)")
      ->check(CLI::IsMember({"apparent", "hydroxyapatite"}))
      ->needs(rods);
  command
      .add_flag("--rescale-hu", a.rescale_hu,
                "First correct the scale of HU, so that air has -1000 and soft tissue 45 HU")
      ->excludes(line)
      ->excludes(rods);
  command
      .add_option("--thin-cortex", a.thin_cortex,
                  "on: give cortex that the scan blurs its thickness and density back, by a fit along the surface's "
                  "normals")
      ->check(CLI::IsMember({"on", "off"}))
      ->capture_default_str();
  command.add_option("--metal-hu", a.metal_hu, "Metal is at or above it, HU")
      ->check(number_in(500.0, 32767.0))
      ->capture_default_str();
}

void add_report_option(CLI::App& command, CaseArguments& a) {
  command.add_option("--report", a.report,
                     "Folder, made by this command, of a report with pictures: report.html for people, report.json for "
                     "programs; without a patient's name, date or path");
}

void add_slices_command(CLI::App& app, const std::shared_ptr<CaseArguments>& shared, std::vector<Command>& commands) {
  CaseArguments& a = *shared;
  CLI::App* slices = app.add_subcommand("slices", "Write the slices of a CT scan, or their edges, as PNG images");
  add_scan_options(*slices, a.scan);
  slices->add_option("--out", a.out, "Folder of the images, made by this command")->required();
  add_filter_options(*slices, a.filter);
  slices->add_option("--window", a.window, "CENTRE,WIDTH: the HU that become grey; without --edges")
      ->capture_default_str();
  slices
      ->add_option("--edges", a.edges,
                   "Show edges instead: gradient (how much the HU change, white from the higher limit on) or canny "
                   "(white lines where they change most)")
      ->check(CLI::IsMember({"gradient", "canny"}));
  add_edge_options(*slices, a.edge);
  commands.push_back({slices, [shared](const StopSignal& stop) { return run_slices(*shared, stop); }});
}

}  // namespace

void add_case_commands(CLI::App& app, std::vector<Command>& commands) {
  // Shared by the options that write into it and the command that reads it, both for the life of the program.
  const auto shared = std::make_shared<CaseArguments>();
  CaseArguments& a = *shared;

  CLI::App* ct = app.add_subcommand("ct", "Make a case from a CT scan");
  add_scan_options(*ct, a.scan);
  ct->add_option("--out", a.out, "Folder of the case, made by this command");
  ct->add_option("--pitch", a.pitch_mm, "Voxel edge of the case, mm (default: the scan's smallest spacing)")
      ->check(number_in(0.02, 10.0));
  CLI::Option* labels_option = ct->add_option(
      "--labels", a.labels,
      "Take bones and structures at risk from this label map instead: NIfTI, NRRD (.seg.nrrd), MetaImage or DICOM SEG, "
      "or a folder with one such file for each structure");
  ct->add_option("--label-names", a.label_names,
                 "What the labels are: totalsegmentator, or NUMBER=NAME,... or NUMBER=NAME:KIND,... with a kind of " +
                     kind_choice_text() + " (left out); may be given again; also those of --truth")
      ->expected(1)
      ->take_all();
  CLI::Option* threshold =
      ct->add_option("--threshold", a.threshold,
                     "Bone is at or above it, HU (default: 226, usual for adult skulls in slices of 1.5 mm), or "
                     "suggest: find it in the scan, and say why")
          ->check(suggest_or_number_in(-1000.0, 4000.0))
          ->excludes(labels_option);
  CLI::Option* keep = ct->add_option(
      "--keep", a.keep,
      "Islands by their number in the printed list, such as 1,3, or all (default: the largest that is bone, and no "
      "table, cast, metal or contrast medium)");
  keep->excludes(labels_option);
  CLI::Option* seed =
      ct->add_option("--seed", a.seeds,
                     "X,Y,Z, mm (LPS): keep the bone that grows from there over voxels that reach the threshold and "
                     "share a face, instead of islands; may be given again")
          ->expected(1)
          ->take_all()
          ->excludes(keep)
          ->excludes(labels_option);
  CLI::Option* similar = ct->add_option("--similar", a.similar_hu,
                                        "Grow over voxels within this number of HU of the seed, instead of a threshold")
                             ->check(number_in(1.0, 4000.0))
                             ->needs(seed)
                             ->excludes(threshold);
  ct->add_flag("--adaptive", a.adaptive, "With --similar: of the mean of the region so far, instead of the seed")
      ->needs(similar);
  ct->add_option("--by", a.grow_by, "Grow in the whole volume, or slice by slice from that of the seed")
      ->check(CLI::IsMember({"slice", "volume"}))
      ->capture_default_str()
      ->needs(seed);
  CLI::Option* list = ct->add_flag("--list", a.list, "List the islands and make no case")->excludes(labels_option);
  CLI::Option* separate =
      ct->add_flag(
            "--separate", a.separate,
            "Separate bones that touch where the bone between them is thinnest: each --seed is a bone of its own, "
            "or without seeds each core of a kept island")
          ->excludes(list)
          ->excludes(labels_option);
  ct->add_option("--edits", a.edits,
                 "YAML file of corrections, made in its order: paint, scribble, erase, cut, further seeds, seeds "
                 "outside, a box, and labels")
      ->excludes(list);
  ct->add_option("--truth", a.truth,
                 "Say how well the case agrees with this label map: Dice, and distances of the surfaces, mm")
      ->excludes(list);
  add_report_option(*ct, a);
  ct->add_flag("--merge", a.merge, "Count the kept islands as one bone; otherwise each has a bone number of its own")
      ->excludes(separate)
      ->excludes(labels_option);
  ct->add_flag("--hollow", a.hollow, "Leave out marrow: only what reaches the threshold is bone")
      ->excludes(labels_option);
  ct->add_option("--surface", a.surface,
                 "The surface of bone lies where HU are half way between those of the bone there and of what is beside "
                 "it (half), or where HU cross the threshold (threshold)")
      ->check(CLI::IsMember({"half", "threshold"}))
      ->capture_default_str()
      ->excludes(labels_option);
  ct->add_option(
        "--between-slices", a.between_slices,
        "The surface goes on from slice to slice where HU cross its level (hu), or so that the shape of "
        "one slice turns into that of the next (shapes); auto: shapes if slices are more than two pixels apart")
      ->check(CLI::IsMember({"auto", "hu", "shapes"}))
      ->capture_default_str()
      ->excludes(labels_option);
  ct->add_option("--contrast", a.contrast,
                 "Blood with contrast medium that is as dense as bone is an island of its own and left out (apart), or "
                 "counts as bone (bone)")
      ->check(CLI::IsMember({"apart", "bone"}))
      ->capture_default_str()
      ->excludes(labels_option);
  add_filter_options(*ct, a.filter);
  ct->add_option("--margin", a.margin_mm, "The case keeps the scan this far around its bones, mm")
      ->check(number_in(0.0, 200.0))
      ->capture_default_str();
  add_density_options(*ct, a);
  ct->add_option("--title", a.title, "Name shown to people; do not use a patient's");
  commands.push_back({ct, [shared](const StopSignal& stop) { return run_ct(*shared, stop); }});

  add_slices_command(app, shared, commands);

  CLI::App* series = app.add_subcommand("series", "List the CT series of a folder, zip or ISO image");
  series->add_option("INPUT", a.input, "Folder (with all its subfolders), zip or ISO image")->required();
  series->add_flag("--json", a.json, "For programs");
  CLI::Option* pictures =
      series->add_option("--pictures", a.out, "Folder, made by this command: the middle slice of each series as PNG");
  series->add_flag("--with-hu", a.with_hu, "Of these slices write the HU too, as NRRD")->needs(pictures);
  commands.push_back({series, [shared](const StopSignal& stop) { return run_series(*shared, stop); }});

  CLI::App* labels =
      app.add_subcommand("labels", "Make a case from a segmented volume: PNG slices whose colours name structures");
  labels->add_option("DIR", a.input, "Folder with the slices, numbered at the end of their names")->required();
  labels->add_option("--out", a.out, "Folder of the case, made by this command")->required();
  labels->add_option("--spacing", a.spacing, "Size of a voxel, mm: X,Y,Z, or one number for all")->required();
  labels->add_option("--pitch", a.pitch_mm, "Voxel edge of the case, mm (default: the smallest spacing)")
      ->check(number_in(0.02, 10.0));
  labels->add_option(
      "--bone", a.bone_colours,
      "R,G,B or R,G,B:DENSITY_G_CM3 of a colour that is bone; may be repeated (default: 255,249,219:1.9)");
  labels->add_option("--legend", a.legend, "The same from a YAML file");
  add_report_option(*labels, a);
  labels->add_option("--title", a.title, "Name shown to people; do not use a patient's");
  commands.push_back({labels, [shared](const StopSignal& stop) { return run_labels(*shared, stop); }});

  CLI::App* stl = app.add_subcommand("stl", "Make a case of one density from a closed triangle mesh");
  stl->add_option("FILE", a.input, "STL file, binary or text")->required();
  stl->add_option("--out", a.out, "Folder of the case, made by this command")->required();
  stl->add_option("--pitch", a.pitch_mm, "Voxel edge of the case, mm (default: 0.5)")->check(number_in(0.02, 10.0));
  stl->add_option("--density", a.density_g_cm3, "Of all its bone, g/cm3")
      ->check(number_in(0.05, 3.0))
      ->capture_default_str();
  stl->add_option("--unit", a.unit, "Of the file's numbers: mm, cm, m or inch")
      ->check(CLI::IsMember({"mm", "cm", "m", "inch"}))
      ->capture_default_str();
  stl->add_option("--title", a.title, "Name shown to people; do not use a patient's");
  commands.push_back({stl, [shared](const StopSignal& stop) { return run_stl(*shared, stop); }});

  CLI::App* exported = app.add_subcommand("export-labels", "Write the labels of a case as a file for other programs");
  exported->add_option("CASE_DIR", a.input, "Folder of the case")->required();
  exported->add_option("FILE", a.out, "File to write: .nii.gz or .nii (NIfTI), .seg.nrrd (3D Slicer) or .nrrd")
      ->required();
  commands.push_back({exported, [shared](const StopSignal& stop) { return run_export_labels(*shared, stop); }});

  CLI::App* info = app.add_subcommand("info", "Say what a case is");
  info->add_option("CASE_DIR", a.input, "Folder of the case")->required();
  info->add_flag("--json", a.json, "For programs");
  commands.push_back({info, [shared](const StopSignal&) { return run_info(*shared); }});
}

}  // namespace osteon::import
