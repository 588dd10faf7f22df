// osteon-import: makes cases from CT scans and phantoms, and says what a case is.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "common/runtime/command_line.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/progress.hpp"
#include "common/runtime/stop_signal.hpp"
#include "server/import/case_report.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/dicom_writer.hpp"
#include "server/import/inv3_reader.hpp"
#include "server/import/phantom.hpp"

namespace {

namespace fs = std::filesystem;
using namespace osteon;

constexpr double kPhantomPitch_mm = 0.4;

struct Arguments {
  std::string input, out, title, layers, kind, dicom;
  std::optional<double> pitch_mm, threshold_hu;
  double width_mm = 20.0;
  bool json = false;
};

// One bar over all stages, shown when the first work is done: a refused input leaves only its sentence.
class Bar {
 public:
  explicit Bar(const StopSignal& stop) : stop_(stop) {}
  [[nodiscard]] KeepGoing stage(double begin, double end) {
    return [this, begin, end](double fraction) {
      const double done = begin + (end - begin) * fraction;
      if (done > 0.0 && !bar_) bar_.emplace("importing");
      if (bar_) bar_->update(done);
      return !stop_.requested();
    };
  }
  void close() { bar_.reset(); }

 private:
  const StopSignal& stop_;
  std::optional<Progress> bar_;
};

Error stopped() { return {ErrorCode::cancelled, "stopped; nothing was written"}; }

// Checked before the work, not after minutes of it.
Result<void> check_free(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) return failure(ErrorCode::exists, folder + " is already there; choose another name or remove it first");
  return {};
}

Result<void> save(const Case& bone, const std::string& out, const StopSignal& stop) {
  if (stop.requested()) return tl::unexpected(stopped());
  return bone.save(out);
}

Result<Case> run_ct(const Arguments& a, const StopSignal& stop) {
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  std::error_code error;
  if (!fs::exists(a.input, error)) return failure(ErrorCode::not_found, "there is no file or folder " + a.input + "; give a DICOM folder or an .inv3 file");
  Bar bar(stop);
  const auto reading = bar.stage(0.0, 0.2);
  auto scan = fs::is_directory(a.input, error) ? import::read_dicom_series(a.input, reading) : import::read_inv3(a.input, reading);
  if (!scan) return tl::unexpected(scan.error());

  import::CtOptions options;
  options.pitch_mm = a.pitch_mm;
  if (a.threshold_hu) options.threshold_hu = *a.threshold_hu;
  if (!a.title.empty()) options.title = a.title;
  auto bone = import::import_ct(std::move(*scan), options, bar.stage(0.2, 0.95));
  if (!bone) return failure(bone.error().code, bone.error().code == ErrorCode::cancelled ? bone.error().message : a.input + ": " + bone.error().message);
  if (auto saved = save(*bone, a.out, stop); !saved) return tl::unexpected(saved.error());
  bar.stage(1.0, 1.0)(1.0);
  return bone;
}

Result<Case> run_phantom(const Arguments& a, const StopSignal& stop) {
  if (auto is_free = check_free(a.out); !is_free) return tl::unexpected(is_free.error());
  if (!a.dicom.empty())
    if (auto is_free = check_free(a.dicom); !is_free) return tl::unexpected(is_free.error());
  auto layers = import::parse_layers(a.layers);
  if (!layers) return tl::unexpected(layers.error());
  import::Phantom phantom;
  phantom.kind = a.kind == "tube" ? import::PhantomKind::tube : import::PhantomKind::block;
  phantom.layers = std::move(*layers);
  phantom.width_mm = a.width_mm;
  const double pitch_mm = a.pitch_mm.value_or(kPhantomPitch_mm);

  Bar bar(stop);
  auto bone = import::build_phantom_case(phantom, pitch_mm, a.title.empty() ? "Phantom" : a.title, bar.stage(0.0, 0.4));
  if (!bone) return bone;
  if (!a.dicom.empty()) {
    const auto scan = import::scan_phantom(phantom, pitch_mm, bar.stage(0.4, 0.6));
    if (!scan) return tl::unexpected(scan.error());
    if (auto written = import::write_dicom_series(*scan, a.dicom, bar.stage(0.6, 0.95)); !written) return tl::unexpected(written.error());
  }
  if (auto saved = save(*bone, a.out, stop); !saved) {
    std::error_code error;
    if (!a.dicom.empty()) fs::remove_all(a.dicom, error);
    return tl::unexpected(saved.error());
  }
  bar.stage(1.0, 1.0)(1.0);
  return bone;
}

void describe_options(CLI::App& app, Arguments& a) {
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all", "Help for all commands");

  CLI::App* ct = app.add_subcommand("ct", "Make a case from a CT scan");
  ct->add_option("INPUT", a.input, "Folder with one DICOM CT series, or an InVesalius project (.inv3)")->required();
  ct->add_option("--out", a.out, "Folder of the case, made by this command")->required();
  ct->add_option("--pitch", a.pitch_mm, "Voxel edge of the case, mm (default: the scan's smallest spacing)")->check(CLI::Range(0.02, 10.0));
  ct->add_option("--threshold", a.threshold_hu, "Bone is at or above it, HU (default: 226)")->check(CLI::Range(-1000.0, 4000.0));
  ct->add_option("--title", a.title, "Name shown to people; do not use a patient's");

  CLI::App* phantom = app.add_subcommand("phantom", "Make a case whose true shape and density are known");
  phantom->add_option("KIND", a.kind, "block (layers from the top down) or tube (layers from the outside in)")->required()->check(CLI::IsMember({"block", "tube"}));
  phantom->add_option("--layers", a.layers, "THICKNESS_MM:DENSITY_G_CM3,... such as 5:1.9,20:0.3,5:1.9")->required();
  phantom->add_option("--width", a.width_mm, "Edge of the block, or length of the tube, mm")->check(CLI::Range(1.0, 1000.0))->capture_default_str();
  phantom->add_option("--pitch", a.pitch_mm, "Voxel edge, mm (default: 0.4)")->check(CLI::Range(0.02, 10.0));
  phantom->add_option("--out", a.out, "Folder of the case, made by this command")->required();
  phantom->add_option("--dicom", a.dicom, "Also write what a CT scanner would see of it, as a DICOM series, to this folder");
  phantom->add_option("--title", a.title, "Name shown to people");

  CLI::App* info = app.add_subcommand("info", "Say what a case is");
  info->add_option("CASE_DIR", a.input, "Folder of the case")->required();
  info->add_flag("--json", a.json, "For programs");
}

}  // namespace

int main(int argc, char** argv) {
  static constexpr const char* kProgram = "osteon-import";
  Arguments arguments;
  CLI::App app("Makes a case, the bone that osteon-server loads, from a CT scan or a phantom.", kProgram);
  describe_options(app, arguments);
  if (const auto code = parse_arguments(app, argc, argv)) return *code;

  const StopSignal stop;
  if (app.got_subcommand("info")) {
    const auto bone = Case::load(arguments.input);
    if (!bone) return log::exit_with(kProgram, bone.error());
    std::fputs((arguments.json ? import::report_json(*bone) : import::report_text(*bone)).c_str(), stdout);
    return 0;
  }
  const auto bone = app.got_subcommand("ct") ? run_ct(arguments, stop) : run_phantom(arguments, stop);
  if (!bone) return log::exit_with(kProgram, bone.error().code == ErrorCode::cancelled ? stopped() : bone.error());
  std::fputs(import::report_text(*bone).c_str(), stdout);
  return 0;
}
