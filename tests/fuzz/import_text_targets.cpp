// Targets for text that a person writes for the import: a tool, a list of cuts, a legend, a list of edits, a list
// of landmarks. And for the text of sub-volumes.
#include <cmath>
#include <set>
#include <string>
#include <string_view>

#include "common/core/check.hpp"
#include "common/subvolumes/subvolume_file.hpp"
#include "common/tools/tool_file.hpp"
#include "server/import/carve_script.hpp"
#include "server/import/edit_file.hpp"
#include "server/import/label_stack.hpp"
#include "server/import/landmark_file.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/import_targets.hpp"

namespace osteon::fuzz {
namespace {

// An accepted tool must have the same hash when it is written and read again.
void read_tool(std::span<const std::uint8_t> data) {
  const auto tool = parse_tool({reinterpret_cast<const char*>(data.data()), data.size()}, "tool.yaml");
  if (!tool) return expect_bounded(tool.error());
  const auto again = parse_tool(to_yaml(*tool), "again.yaml");
  OSTEON_CHECK(again && again->hash() == tool->hash());
}

void read_script(std::span<const std::uint8_t> data) {
  static const InputFile file("script.yaml");
  const auto steps = import::read_carve_script(file.write(data));
  if (!steps) return expect_bounded(steps.error());
  for (const import::CarveStep& step : *steps) {
    OSTEON_CHECK(!step.path.empty());
    for (const Pose& pose : step.path) OSTEON_CHECK(pose.position_mm.allFinite());
  }
}

void read_legend(std::span<const std::uint8_t> data) {
  static const InputFile file("legend.yaml");
  const auto legend = import::read_legend(file.write(data));
  if (!legend) return expect_bounded(legend.error());
  OSTEON_CHECK(!legend->bones.empty());
  for (const import::BoneColour& bone : legend->bones)
    OSTEON_CHECK(bone.density_g_cm3 > 0.0 && bone.density_g_cm3 <= 3.0);
}

// Accepted edits are replayed on a few voxels: none may leave them.
void read_and_replay_edits(std::span<const std::uint8_t> data) {
  const auto edits = import::parse_edits({reinterpret_cast<const char*>(data.data()), data.size()}, "edits.yaml");
  if (!edits) return expect_bounded(edits.error());
  imaging::HuVolume grid;
  grid.dims = {7, 5, 3};
  grid.spacing_mm = {0.5, 1.0, 20.0};
  imaging::VoxelMask labels(grid.dims);
  labels.values[20] = 1;
  for (const import::LabelEdit& edit : *edits) {
    OSTEON_CHECK(edit.bone >= 0 && edit.bone < 255 && edit.to_bone >= 0 && edit.to_bone < 255);
    for (const Vec3& point : edit.points_mm) OSTEON_CHECK(point.allFinite());
    OSTEON_CHECK(import::edit_text(edit).size() <= 200 && edit.name.size() <= 60);
  }
  if (const auto box = import::boxed_voxels(grid, *edits); !box)
    expect_bounded(box.error());
  else if (*box)
    OSTEON_CHECK((*box)->count() >= 1 && (*box)->count() <= grid.count());
  const auto effects = import::apply_edits(grid, *edits, labels, [](double) { return true; });
  if (!effects) return expect_bounded(effects.error());
}

// Accepted landmarks are fitted: a fit is rigid, and has a residual for each.
void read_and_fit_landmarks(std::span<const std::uint8_t> data) {
  const auto landmarks =
      import::parse_landmarks({reinterpret_cast<const char*>(data.data()), data.size()}, "points.yaml");
  if (!landmarks) return expect_bounded(landmarks.error());
  std::vector<imaging::LandmarkPair> pairs;
  for (const import::NamedLandmark& landmark : *landmarks) {
    OSTEON_CHECK(!landmark.name.empty() && landmark.name.size() <= 60);
    OSTEON_CHECK(landmark.at.fixed_mm.allFinite() && landmark.at.moving_mm.allFinite());
    pairs.push_back(landmark.at);
  }
  const auto fit = imaging::fit_landmarks(pairs);
  if (!fit) return expect_bounded(fit.error());
  OSTEON_CHECK(fit->residuals_mm.size() == pairs.size() && std::isfinite(fit->rms_mm));
  OSTEON_CHECK(std::abs(fit->pose_fixed_moving.rotation.norm() - 1.0) < 1e-9);
}

// An accepted file is written back to the same bytes.
void read_sub_volume(std::span<const std::uint8_t> data) {
  const std::string_view text(reinterpret_cast<const char*>(data.data()), data.size());
  const auto read = subvolumes::parse_sub_volume(text, "SBB1.dat");
  if (!read) return expect_bounded(read.error());
  OSTEON_CHECK(subvolumes::to_text(*read) == text);
}

void read_meta(std::span<const std::uint8_t> data) {
  const std::string_view text(reinterpret_cast<const char*>(data.data()), data.size());
  const auto read = subvolumes::parse_meta(text, "Meta.dat");
  if (!read) return expect_bounded(read.error());
  OSTEON_CHECK(subvolumes::to_text(*read) == text);
}

Target text_target(std::string name, void (*read)(std::span<const std::uint8_t>), std::vector<Bytes> seeds) {
  Target target{std::move(name), read, std::move(seeds)};
  target.change = change_number;
  target.mutations = 200;
  return target;
}

}  // namespace

Target tool_file_target() {
  std::vector<Bytes> seeds;
  std::set<ToolKind> kinds;  // one of each kind
  for (const Tool& tool : builtin_tools())
    if (kinds.insert(tool.kind).second) seeds.push_back(bytes_of_text(to_yaml(tool)));
  return text_target("tool_file", read_tool, std::move(seeds));
}

Target carve_script_target() {
  return text_target(
      "carve_script", read_script,
      {bytes_of_text("steps:\n"
                     "  - {tool: burr-round-5, from: [10, 0, 5], to: [20, 0, 5], axis: [0, 0, -1], level: 1}\n"
                     "  - tool: saw-oscillating-1\n"
                     "    path:\n"
                     "      - {at: [0, 0, 0], axis: [0, 0, -1], across: [1, 0, 0]}\n"
                     "      - {at: [0, 8, -6], axis: [0, 0, -1], across: [1, 0, 0]}\n"),
       bytes_of_text("steps: [{tool: drill-3.2, at: [1, 2, 3], axis: [0, 1, -1]}]\n")});
}

Target legend_target() {
  return text_target(
      "legend", read_legend,
      {bytes_of_text("tolerance: 4\nbones:\n  - {name: cortical, colour: [255, 249, 219], density_g_cm3: 1.9}\n"
                     "  - {name: cancellous, colour: [200, 1, 0]}\n")});
}

Target edits_target() {
  return text_target(
      "edits", read_and_replay_edits,
      {bytes_of_text("edits:\n"
                     "  - {kind: paint, bone: 1, centre_mm: [1, 2, 20], radius_mm: 1.5}\n"
                     "  - {kind: scribble, bone: 2, points_mm: [[0, 0, 0], [3, 4, 40]], radius_mm: 0.6}\n"
                     "  - {kind: cut, bone: 1, point_mm: [1, 2, 20], normal: [0, 0.5, 1], to_bone: 3}\n"
                     "  - {kind: erase, bone: 2, centre_mm: [0, 0, 0], radius_mm: 2}\n"
                     "  - {kind: seed, point_mm: [1, 2, 20], bone: 4}\n"),
       bytes_of_text("edits:\n"
                     "  - {kind: box, corner_mm: [0, 1, 0], opposite_mm: [3, 4, 40]}\n"
                     "  - {kind: outside, point_mm: [1, 2, 20]}\n"
                     "  - {kind: erase, points_mm: [[0, 0, 0], [3, 4, 40]], radius_mm: 0.6, normal: [0, 0, 1]}\n"
                     "  - {kind: label, bone: 1, name: femur, opacity: 0.5, minutes: 2.5}\n")});
}

Target landmarks_target() {
  return text_target("landmarks", read_and_fit_landmarks,
                     {bytes_of_text("landmarks:\n"
                                    "  - {name: apex, fixed_mm: [1, 2, 20], moving_mm: [11, -2, 25]}\n"
                                    "  - {fixed_mm: [31, 2, 20], moving_mm: [41, -2, 25]}\n"
                                    "  - {name: base, fixed_mm: [1, 42, 20], moving_mm: [11, 38, 25]}\n"
                                    "  - {fixed_mm: [1, 2, 60], moving_mm: [11, -2, 64.5]}\n")});
}

Target sub_volume_target() {
  return text_target(
      "sub_volume", read_sub_volume,
      {bytes_of_text("DATASET SUB-VOLUME DATA\nDIMENSIONS 2 3 1\nSPACING 0.489 0.489 1.5\nORIGIN -12.5 0 100\n"
                     "DATA NUMBER 6\nBOUNDARY POSITION\n0 0 0 1 0\n1 -1 1 -1 1\n2 1 2 1 2\n"
                     "MEDICAL DATA\n700 1200\n-1000 40\n0 226\n")});
}

Target sub_volume_meta_target() {
  return text_target("sub_volume_meta", read_meta,
                     {bytes_of_text("DATASET SUB-VOLUME META\nDIRECTORY .\nNUMBER 2\n"
                                    "FILE START SLICES SUBDIVISIONS\nSBB1.dat 0 22 3\nSBB2.dat 25 1 0\n")});
}

}  // namespace osteon::fuzz
