#include <CLI/CLI.hpp>
#include <cctype>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "common/geometry/mesh_file.hpp"
#include "common/imaging/calibration.hpp"
#include "common/phantoms/phantom_case.hpp"
#include "common/runtime/number_option.hpp"
#include "common/volume/cut_field.hpp"
#include "server/import/bone_recipe_file.hpp"
#include "server/import/bone_surface.hpp"
#include "server/import/case_report.hpp"
#include "server/import/command.hpp"
#include "server/import/dicom_writer.hpp"
#include "server/import/phantom.hpp"
#include "server/import/phantom_export.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kLayersPitch_mm = 0.4, kBonePitch_mm = 0.7;

struct PhantomArguments {
  std::string kind, layers, out, dicom, title;
  std::string side, preset, condition, parameters, stl, truth;
  std::optional<double> pitch_mm;
  double width_mm = 20.0, slice_mm = 1.0;
  ScannerSettings scanner;
  std::vector<const CLI::Option*> bone_options;  // which a block or a tube does not have
  const CLI::Option* width = nullptr;            // which a bone does not have
};

// Removes what a command wrote before it failed.
void remove_outputs(std::initializer_list<std::string> paths) {
  std::error_code error;
  for (const std::string& path : paths)
    if (!path.empty()) fs::remove_all(path, error);
}

// Every output is free, and none lies in the folder of another.
Result<void> check_outputs(const PhantomArguments& a) {
  const std::pair<const char*, const std::string&> outputs[] = {
      {"--out", a.out}, {"--dicom", a.dicom}, {"--stl", a.stl}, {"--truth", a.truth}};
  if (a.out.empty()) return bad_input("--out needs the name of a folder");
  const auto whole = [](const std::string& path) { return fs::absolute(path).lexically_normal(); };
  for (const auto& [option, path] : outputs) {
    if (path.empty()) continue;
    if (auto is_free = check_free(path); !is_free) return is_free;
    for (const auto& [folder_option, folder] : outputs) {
      if (folder.empty() || option == folder_option) continue;
      const fs::path within = whole(path).lexically_relative(whole(folder));
      if (!within.empty() && *within.begin() != "..")
        return bad_input(std::string(option) + " " + path + " lies in the folder of " + folder_option +
                         "; name another place");
    }
  }
  return {};
}

Result<std::string> run_layers(const PhantomArguments& a, const StopSignal& stop) {
  auto layers = parse_layers(a.layers);
  if (!layers) return tl::unexpected(layers.error());
  Phantom phantom;
  phantom.kind = a.kind == "tube" ? PhantomKind::tube : PhantomKind::block;
  phantom.layers = std::move(*layers);
  phantom.width_mm = a.width_mm;
  const double pitch_mm = a.pitch_mm.value_or(kLayersPitch_mm);

  Bar bar(stop);
  const auto bone = build_phantom_case(phantom, pitch_mm, a.title.empty() ? "Phantom" : a.title, bar.stage(0.0, 0.4));
  if (!bone) return tl::unexpected(bone.error());
  if (!a.dicom.empty()) {
    const auto scan = scan_phantom(phantom, pitch_mm, bar.stage(0.4, 0.6));
    if (!scan) return tl::unexpected(scan.error());
    if (auto written = write_dicom_series(*scan, a.dicom, bar.stage(0.6, 0.95)); !written)
      return tl::unexpected(written.error());
  }
  if (auto saved = save(*bone, a.out, stop); !saved) {
    remove_outputs({a.dicom});
    return tl::unexpected(saved.error());
  }
  bar.stage(1.0, 1.0)(1.0);
  return report_text(*bone);
}

// The command line wins over the file.
Result<phantoms::BoneRecipe> recipe_of(const PhantomArguments& a) {
  phantoms::BoneRecipe recipe;
  recipe.kind = a.kind;
  if (!a.parameters.empty()) {
    auto read = read_bone_recipe(a.parameters, std::move(recipe));
    if (!read) return tl::unexpected(read.error());
    recipe = std::move(*read);
  }
  if (!a.preset.empty()) recipe.preset = a.preset;
  if (!a.condition.empty()) recipe.condition = a.condition;
  if (!a.side.empty()) recipe.side = a.side == "left" ? phantoms::Side::left : phantoms::Side::right;
  return recipe;
}

// Writes everything but the case.
Result<void> write_bone(const PhantomArguments& a, const phantoms::PhantomBone& bone,
                        const phantoms::BoneRecipe& recipe, const phantoms::PhantomCase& made, Bar& bar) {
  if (!a.dicom.empty()) {
    const ScannerSettings settings = scanner_around(bone, a.scanner, a.slice_mm);
    if (auto written = write_simulated_scan(settings, blurred_hu(bone, settings.blur_mm), a.dicom, bar.stage(0.4, 0.8));
        !written)
      return written;
  }
  if (!a.stl.empty()) {
    const auto mesh = bone_surface(CutField(made.bone, BodyId{0}), bar.stage(0.8, 0.88));
    if (!mesh) return tl::unexpected(mesh.error());
    if (auto written = write_stl(*mesh, a.stl); !written) return written;
  }
  if (!a.truth.empty()) return write_truth(bone, recipe, made, a.truth, bar.stage(0.88, 0.95));
  return {};
}

std::string title_of(const phantoms::BoneRecipe& recipe) {
  std::string kind = recipe.kind;
  if (!phantoms::has_both_sides(kind)) return (recipe.side == phantoms::Side::left ? "Left " : "Right ") + kind;
  kind.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(kind.front())));
  return kind;
}

Result<std::string> run_bone(const PhantomArguments& a, const StopSignal& stop) {
  const auto recipe = recipe_of(a);
  if (!recipe) return tl::unexpected(recipe.error());
  const auto bone = phantoms::make_bone(*recipe);
  if (!bone)
    return a.parameters.empty() ? tl::unexpected(bone.error())
                                : tl::unexpected(Error{bone.error().code, a.parameters + ": " + bone.error().message});
  Bar bar(stop);
  phantoms::PhantomCaseOptions options;
  options.pitch_mm = a.pitch_mm.value_or(kBonePitch_mm);
  options.title = a.title.empty() ? title_of(*recipe) : a.title;
  options.calibration = imaging::kRho1995;
  options.hu = {imaging::kAir_hu, kAroundBone_hu};
  const auto made = phantoms::build_phantom_case(**bone, options, bar.stage(0.0, 0.4));
  if (!made) return tl::unexpected(made.error());
  auto written = write_bone(a, **bone, *recipe, *made, bar);
  if (written) written = save(made->bone, made->scan, a.out, stop);
  if (!written) {
    remove_outputs({a.dicom, a.stl, a.truth});
    return tl::unexpected(written.error());
  }
  bar.stage(1.0, 1.0)(1.0);
  return report_text(made->bone);
}

Result<std::string> run_phantom(const PhantomArguments& a, const StopSignal& stop) {
  if (auto good = check_outputs(a); !good) return tl::unexpected(good.error());
  const bool layered = a.kind == "block" || a.kind == "tube";
  if (layered && a.layers.empty())
    return bad_input("a " + a.kind +
                     " needs --layers; write THICKNESS_MM:DENSITY_G_CM3,... such as 5:1.9,20:0.3,5:1.9");
  if (!layered && !a.layers.empty()) return bad_input("a " + a.kind + " has no --layers; leave them out");
  if (!layered && a.width->count() > 0) return bad_input("a " + a.kind + " has no --width; leave it out");
  for (const CLI::Option* option : a.bone_options)
    if (layered && option->count() > 0)
      return bad_input(option->get_name() + " is for a bone, such as a femur; leave it out for a " + a.kind);
  if (!a.side.empty() && phantoms::has_both_sides(a.kind))
    return bad_input("--side is for a bone of one side; leave it out for a " + a.kind + ", which has both sides");
  return layered ? run_layers(a, stop) : run_bone(a, stop);
}

std::vector<std::string> words(std::span<const std::string_view> known) { return {known.begin(), known.end()}; }

// `dicom`: the option --dicom.
void add_bone_options(CLI::App& phantom, CLI::Option* dicom, PhantomArguments& a) {
  const auto text = [&](const char* name, std::string& value, const char* help) {
    a.bone_options.push_back(phantom.add_option(name, value, help));
    return phantom.get_option(name);
  };
  text("--side", a.side, "Of a bone: left (default) or right; a pelvis has both")
      ->check(CLI::IsMember({"left", "right"}));
  text("--preset", a.preset, "Of a bone: female, male (default), small or large")
      ->check(CLI::IsMember(words(phantoms::kPresets)));
  text("--condition", a.condition, "Of a bone: young, adult (default) or osteoporotic")
      ->check(CLI::IsMember(words(phantoms::kConditions)));
  text("--parameters", a.parameters, "YAML file with these words and with parameters of the bone");
  text("--stl", a.stl, "Also write the bone's surface to this STL file");
  text("--truth", a.truth, "Also write parameters, landmarks, axes, planes and labels of the bone, to this folder");
  const auto scanner = [&](const char* name, double& value, double least, double most, const char* help) {
    a.bone_options.push_back(
        phantom.add_option(name, value, help)->check(number_in(least, most))->capture_default_str()->needs(dicom));
  };
  scanner("--pixel", a.scanner.pixel_mm, 0.1, 5.0, "Of --dicom of a bone: pixel of a slice, mm");
  scanner("--slice", a.slice_mm, 0.1, 10.0, "Of --dicom of a bone: thickness and distance of slices, mm");
  scanner("--blur", a.scanner.blur_mm, 0.0, 5.0, "Of --dicom of a bone: sigma of the scanner's blur, mm");
  scanner("--noise", a.scanner.noise_hu, 0.0, 500.0, "Of --dicom of a bone: standard deviation of the noise, HU");
  scanner("--tilt", a.scanner.tilt_degrees, -30.0, 30.0, "Of --dicom of a bone: tilt of the gantry, degrees");
}

}  // namespace

void add_phantom_command(CLI::App& app, std::vector<Command>& commands) {
  const auto shared = std::make_shared<PhantomArguments>();
  PhantomArguments& a = *shared;
  CLI::App* phantom = app.add_subcommand("phantom", "Make a case whose true shape and density are known");
  std::vector<std::string> kinds{"block", "tube"};
  kinds.insert(kinds.end(), std::begin(phantoms::kBoneKinds), std::end(phantoms::kBoneKinds));
  phantom
      ->add_option("KIND", a.kind,
                   "block (layers from the top down), tube (layers from the outside in), femur, tibia (with its "
                   "fibula), patella, knee (femur, tibia, fibula and patella), pelvis (both hip bones and the sacrum), "
                   "or hip (one hip bone and the end of a femur)")
      ->required()
      ->check(CLI::IsMember(kinds));
  phantom->add_option("--layers", a.layers,
                      "Of a block or tube: THICKNESS_MM:DENSITY_G_CM3,... such as 5:1.9,20:0.3,5:1.9");
  a.width = phantom->add_option("--width", a.width_mm, "Edge of the block, or length of the tube, mm")
                ->check(number_in(1.0, 1000.0))
                ->capture_default_str();
  phantom->add_option("--pitch", a.pitch_mm, "Voxel edge, mm (default: 0.4; of a bone 0.7)")
      ->check(number_in(0.02, 10.0));
  phantom->add_option("--out", a.out, "Folder of the case, made by this command")->required();
  CLI::Option* dicom = phantom->add_option(
      "--dicom", a.dicom, "Also write what a CT scanner would see of it, as a DICOM series, to this folder");
  phantom->add_option("--title", a.title, "Name shown to people");
  add_bone_options(*phantom, dicom, a);
  commands.push_back({phantom, [shared](const StopSignal& stop) { return run_phantom(*shared, stop); }});
}

}  // namespace osteon::import
