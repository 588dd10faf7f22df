#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/import/command.hpp"
#include "server/import/registration_files.hpp"
#include "server/import/scan_arguments.hpp"

namespace osteon::import {
namespace {

struct RegistrationArguments {
  ScanArguments fixed, moving;
  std::string out, landmarks, labels;
};

Result<std::string> run_register(const RegistrationArguments& a, const StopSignal& stop) {
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  std::vector<NamedLandmark> landmarks;
  if (!a.landmarks.empty()) {
    auto read = read_landmarks(a.landmarks);
    if (!read) return tl::unexpected(read.error());
    landmarks = std::move(*read);
  }
  Bar bar(stop, "registering");
  const auto fixed = read_scan(a.fixed, bar.stage(0.0, 0.15));
  if (!fixed) return tl::unexpected(fixed.error());
  const auto moving = read_scan(a.moving, bar.stage(0.15, 0.3));
  if (!moving) return tl::unexpected(moving.error());
  std::optional<DrawnLabels> labels;
  if (!a.labels.empty()) {
    const auto map = read_label_map(a.labels, bar.stage(0.3, 0.35));
    if (!map) return tl::unexpected(map.error());
    auto drawn = draw_labels(*map, moving->volume);
    if (!drawn) return tl::unexpected(drawn.error());
    labels = std::move(*drawn);
  }
  auto found =
      register_scans(fixed->volume, moving->volume, landmarks, a.landmarks, bar.stage(labels ? 0.35 : 0.3, 0.9));
  if (!found) return tl::unexpected(found.error());
  for (const auto& [name, scan] : {std::pair{"fixed", &*fixed}, std::pair{"moving", &*moving}})
    if (scan->report.without_number > 0)
      found->warnings.push_back(std::string("in the ") + name + " scan, " + without_number_text(scan->report));
  if (auto written = write_registration(a.out, *found, fixed->volume, moving->volume, labels, bar.stage(0.9, 1.0));
      !written)
    return tl::unexpected(written.error());
  bar.stage(1.0, 1.0)(1.0);
  std::string text = registration_text(*found);
  if (labels)
    for (const auto& [number, name] : labels->names)
      text += "label      " + std::to_string(number) + "  " + name + "\n";
  return text + "written    " + a.out + "\n";
}

}  // namespace

void add_registration_command(CLI::App& app, std::vector<Command>& commands) {
  const auto shared = std::make_shared<RegistrationArguments>();
  RegistrationArguments& a = *shared;
  CLI::App* command =
      app.add_subcommand("register", "Find how a scan lies in another of the same patient, and move it there");
  a.fixed.prefix = "fixed-";
  a.moving.prefix = "moving-";
  add_scan_options(*command, a.fixed, "FIXED");
  add_scan_options(*command, a.moving, "MOVING");
  command
      ->add_option("--out", a.out,
                   "Folder, made by this command: the transform (registration.json), and the moving scan on the voxels "
                   "of the fixed one (moving.nii.gz)")
      ->required();
  command->add_option("--landmarks", a.landmarks,
                      "YAML file with at least three points of both scans, from which the search begins (default: it "
                      "begins where the scans lie, or with their centres on each other)");
  command->add_option(
      "--labels", a.labels,
      "A label map of the moving scan: is moved too, each voxel with the nearest label (labels.nii.gz)");
  commands.push_back({command, [shared](const StopSignal& stop) { return run_register(*shared, stop); }});
}

}  // namespace osteon::import
