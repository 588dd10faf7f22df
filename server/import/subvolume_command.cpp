#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/imaging/calibration.hpp"
#include "common/runtime/number_option.hpp"
#include "server/import/command.hpp"
#include "server/import/scan_arguments.hpp"
#include "server/import/subvolume_report.hpp"

namespace osteon::import {
namespace {

struct SubVolumeArguments {
  ScanArguments scan;
  std::string source, bone, out, script;
  std::optional<double> threshold_hu;
  int subdivisions = MeasureOptions{}.subdivisions;
  double cut_mm = MeasureOptions{}.cut_mm;
};

// Whether an option is given that only a scan takes.
bool has_scan_options(const ScanArguments& a) {
  return a.series || a.skip_bytes || a.slope || a.intercept ||
         !(a.size + a.spacing + a.type + a.byte_order + a.axes + a.grey_window).empty();
}

Result<SubVolumeInput> read_input(const SubVolumeArguments& a, const KeepGoing& reading) {
  const bool of_source = is_case(a.scan.input) && !a.source.empty();
  if (!a.source.empty() && !of_source && std::filesystem::exists(a.scan.input))
    return bad_input("--source is for a case; leave it out, because " + a.scan.input + " is none");
  if ((is_case(a.scan.input) || is_meta_file(a.scan.input)) && has_scan_options(a.scan) && !of_source)
    return bad_input(a.scan.input + " says itself how it is to be read; leave out the options for scans");
  if (!a.bone.empty() && (is_case(a.scan.input) || is_meta_file(a.scan.input)))
    return bad_input("--bone is for a scan; leave it out, because " + a.scan.input + " says itself what is bone");
  if (is_case(a.scan.input)) {
    if (a.threshold_hu)
      return bad_input("--threshold is for a scan; leave it out, because the case " + a.scan.input +
                       " says what is bone");
    if (!of_source) return input_of_case(a.scan.input, reading);
    auto of_case = input_of_case(a.scan.input, part(reading, 0.0, 0.3));
    if (!of_case) return of_case;
    ScanArguments from = a.scan;
    from.input = a.source;
    auto source = read_scan(from, part(reading, 0.3, 1.0));
    if (!source) return tl::unexpected(source.error());
    return input_in_source(*of_case, std::move(*source), a.source);
  }
  const double threshold_hu = a.threshold_hu.value_or(imaging::kBoneThreshold_hu);
  if (is_meta_file(a.scan.input)) return input_of_files(a.scan.input, threshold_hu, reading);
  if (!a.bone.empty()) {
    const auto marks = read_label_map(a.bone, part(reading, 0.0, 0.4));
    if (!marks) return tl::unexpected(marks.error());
    auto marked = read_scan(a.scan, part(reading, 0.4, 0.9));
    if (!marked) return tl::unexpected(marked.error());
    return input_of_marked(std::move(*marked), *marks, threshold_hu, part(reading, 0.9, 1.0));
  }
  auto scan = read_scan(a.scan, part(reading, 0.0, 0.5));
  if (!scan) return tl::unexpected(scan.error());
  auto input = input_of_scan(std::move(*scan), threshold_hu, part(reading, 0.5, 1.0));
  if (!input && input.error().code == ErrorCode::invalid_input)
    return bad_input(a.scan.input + ": " + input.error().message);
  return input;
}

Result<std::string> run_subvolumes(const SubVolumeArguments& a, const StopSignal& stop) {
  if (!a.out.empty())
    if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  MeasureOptions options;
  options.subdivisions = a.subdivisions;
  options.cut_mm = a.cut_mm;
  if (!a.script.empty()) {
    auto steps = read_carve_script(a.script);
    if (!steps) return tl::unexpected(steps.error());
    options.steps = std::move(*steps);
  }
  Bar bar(stop, "dividing");
  const KeepGoing reading = bar.stage(0.0, 0.3), measuring = bar.stage(0.3, 0.9), writing = bar.stage(0.9, 1.0);
  const auto input = read_input(a, reading);
  if (!input) return tl::unexpected(input.error());
  const auto measures = measure_sub_volumes(*input, options, measuring);
  if (!measures) return tl::unexpected(measures.error());
  std::string text = to_text(*measures);
  if (!a.out.empty()) {
    if (auto written = write_sub_volumes(*input, *measures, a.out, writing); !written)
      return tl::unexpected(written.error());
    text += "\nwritten    " + a.out + ": report, picture, and " + std::to_string(measures->sections.size()) +
            " sub-volume files, which were read again to the same bytes\n";
  }
  writing(1.0);
  return text;
}

}  // namespace

void add_subvolume_command(CLI::App& app, std::vector<Command>& commands) {
  const auto shared = std::make_shared<SubVolumeArguments>();
  SubVolumeArguments& a = *shared;
  CLI::App* command = app.add_subcommand(
      "report",
      "Divide the bone of a case, a scan or a Meta.dat into sub-volumes, and compare them with OpenVDB's tree");
  add_scan_options(*command, a.scan, "CASE_DIR|INPUT");
  command->add_option("--source", a.source,
                      "Of a case: the scan from which it was imported. Then the original data are the whole scan");
  command->add_option("--bone", a.bone,
                      "Of a scan: a label map on its voxels. What has a number there is bone, instead of the largest "
                      "island at or above the threshold");
  command->add_option("--out", a.out,
                      "Folder, made by this command: tables (report.txt, report.json), the boxes on the bone "
                      "(boxes.png), and the files of the sub-volumes (Meta.dat, SBB1.dat ...)");
  command->add_option("--subdivisions", a.subdivisions, "How often each section is divided into quadrants")
      ->check(CLI::Range(0, subvolumes::kMostSubdivisions))
      ->capture_default_str();
  command->add_option("--carve", a.script, "Script as of osteon-import carve: also cut, and report the active ones");
  command->add_option("--cut", a.cut_mm, "Longest way between two poses of a tool, mm")
      ->check(number_in(0.01, 25.0))
      ->capture_default_str();
  command
      ->add_option("--threshold", a.threshold_hu, "Of a scan or a Meta.dat: bone is at or above it, HU (default: 226)")
      ->check(number_in(-1000.0, 4000.0));
  commands.push_back({command, [shared](const StopSignal& stop) { return run_subvolumes(*shared, stop); }});
}

}  // namespace osteon::import
