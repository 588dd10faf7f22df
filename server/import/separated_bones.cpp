#include "server/import/separated_bones.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numeric>

#include "common/imaging/separation.hpp"
#include "server/import/kept_scan.hpp"

namespace osteon::import {
namespace {

using Counts = std::array<std::int64_t, 256>;

Counts voxels_of_each(const imaging::VoxelMask& bones) {
  Counts counts{};
  for (const std::uint8_t number : bones.values) ++counts[number];
  return counts;
}

// What an edit did, as a line for a person.
std::string effect_text(const LabelEdit& edit, const EditEffect& effect, double voxel_cm3) {
  const auto bone_cm3 = [&](const Counts& counts) {
    return static_cast<double>(std::accumulate(counts.begin() + 1, counts.end(), std::int64_t{0})) * voxel_cm3;
  };
  if (edit.kind == EditKind::seed || edit.kind == EditKind::outside || edit.kind == EditKind::box ||
      edit.kind == EditKind::label || edit.kind == EditKind::landmark)
    return edit_text(edit);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ": %.3f cm3 added, %.3f cm3 taken", bone_cm3(effect.gained),
                bone_cm3(effect.lost));
  return edit_text(edit) + text.data();
}

std::vector<std::string> effect_texts(const CtOptions& options, const std::vector<EditEffect>& effects,
                                      double voxel_cm3) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < effects.size(); ++i)
    texts.push_back(effect_text(options.edits[i], effects[i], voxel_cm3));
  return texts;
}

// The edits that name a label or changed it.
std::vector<std::string> edits_of(const CtOptions& options, const std::vector<EditEffect>& effects,
                                  std::size_t number) {
  const auto bone = static_cast<int>(number);
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const LabelEdit& edit = options.edits[i];
    if (edit.bone == bone || edit.to_bone == bone || effects[i].gained[number] > 0 || effects[i].lost[number] > 0)
      texts.push_back(edit_text(edit));
  }
  return texts;
}

Result<std::vector<EditEffect>> replay(const imaging::HuVolume& grid, const CtOptions& options,
                                       imaging::VoxelMask& labels, const KeepGoing& keep_going) {
  auto effects = apply_edits(grid, options.edits, labels, keep_going);
  if (effects || effects.error().code != ErrorCode::invalid_input) return effects;
  return bad_input(options.edits_file + ", " + effects.error().message);
}

tl::unexpected<Error> nothing_left(const CtOptions& options) {
  return bad_input(options.edits_file + " leaves no bone; remove some of its edits");
}

// Replays the edits, and lists the bones in `found`. Errors: invalid_input, cancelled.
Result<void> edit_bones(const imaging::HuVolume& volume, const CtOptions& options, imaging::VoxelMask& bones,
                        CtSegmentation& found, const KeepGoing& keep_going) {
  const Counts before = voxels_of_each(bones);
  const auto effects = replay(volume, options, bones, keep_going);
  if (!effects) return tl::unexpected(effects.error());
  const Counts after = voxels_of_each(bones);
  const double voxel_cm3 = volume.spacing_mm.prod() * 1e-3;
  found.edits = effect_texts(options, *effects, voxel_cm3);
  for (std::size_t number = 1; number < after.size(); ++number) {
    if (after[number] == 0) continue;
    FoundBone bone{.number = static_cast<int>(number),
                   .volume_cm3 = static_cast<double>(after[number]) * voxel_cm3,
                   .segmented = before[number] > 0,
                   .edits = edits_of(options, *effects, number)};
    found.bones.push_back(std::move(bone));
  }
  if (found.bones.empty()) return nothing_left(options);
  return {};
}

}  // namespace

Result<imaging::SurfaceLevel> finish_bones(const imaging::HuVolume& volume, const CtOptions& options,
                                           std::span<const imaging::BoneSeed> seeds, imaging::VoxelMask& bones,
                                           CtSegmentation& found, const KeepGoing& keep_going) {
  const double separated_at = options.separate ? 0.7 : 0.0;
  if (options.separate) {
    auto separated =
        imaging::separate_bones(volume, bones, options.threshold_hu, seeds, part(keep_going, 0.0, separated_at));
    if (!separated) return tl::unexpected(separated.error());
    bones = std::move(*separated);
    if (options.grow.outside != 0) {
      std::ranges::replace(bones.values, static_cast<std::uint8_t>(options.grow.outside), std::uint8_t{0});
      if (std::ranges::all_of(bones.values, [](std::uint8_t b) { return b == 0; })) return nothing_left(options);
    }
  }
  imaging::SurfaceLevel level{options.threshold_hu};
  const auto bone_voxels = [&] { return std::ranges::count_if(bones.values, [](std::uint8_t b) { return b != 0; }); };
  if (options.surface == SurfaceAt::half_maximum) {
    const auto before = bone_voxels();
    auto moved =
        imaging::move_to_half_maximum(volume, options.threshold_hu, bones, part(keep_going, separated_at, 0.95));
    if (!moved) return moved;
    level = std::move(*moved);
    found.blur_cm3 = static_cast<double>(before - bone_voxels()) * volume.spacing_mm.prod() * 1e-3;
  }
  if (options.separate || !options.edits.empty())
    if (auto edited = edit_bones(volume, options, bones, found, part(keep_going, 0.95, 1.0)); !edited)
      return tl::unexpected(edited.error());
  return level;
}

Result<std::vector<std::string>> edit_labels(const imaging::HuVolume& grid, const CtOptions& options,
                                             PlacedLabels& placed, const KeepGoing& keep_going) {
  if (options.edits.empty()) return std::vector<std::string>();
  const auto effects = replay(grid, options, placed.values, keep_going);
  if (!effects) return tl::unexpected(effects.error());
  const Counts after = voxels_of_each(placed.values);
  const double voxel_cm3 = grid.spacing_mm.prod() * 1e-3;
  std::vector<CaseLabel> labels;
  placed.cm3.clear();
  for (std::size_t number = 1; number < after.size(); ++number) {
    if (after[number] == 0) continue;
    const auto value = static_cast<int>(number);
    const auto known = std::ranges::find(placed.labels, value, &CaseLabel::value);
    labels.push_back(known != placed.labels.end()
                         ? *known
                         : CaseLabel{value, "bone " + std::to_string(value), LabelKind::bone, {"edits", {}, {}}});
    labels.back().provenance.edits = edits_of(options, *effects, number);
    name_label(options.edits, labels.back());
    placed.cm3.push_back(static_cast<double>(after[number]) * voxel_cm3);
  }
  for (std::size_t i = 0; i < labels.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (labels[i].name == labels[j].name)
        return bad_input(options.edits_file + " names two labels " + labels[i].name + "; write another name");
  placed.labels = std::move(labels);
  if (std::ranges::none_of(placed.labels, is_carved, &CaseLabel::kind)) return nothing_left(options);
  return effect_texts(options, *effects, voxel_cm3);
}

imaging::VoxelBox voxels_of(const imaging::VoxelMask& bones) {
  imaging::VoxelBox box{bones.dims, {-1, -1, -1}};
  for (int slice = 0; slice < bones.dims[2]; ++slice)
    for (int row = 0; row < bones.dims[1]; ++row)
      for (int column = 0; column < bones.dims[0]; ++column) {
        if (bones.at(column, row, slice) == 0) continue;
        const std::array<int, 3> at{column, row, slice};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          box.first[axis] = std::min(box.first[axis], at[axis]);
          box.last[axis] = std::max(box.last[axis], at[axis]);
        }
      }
  return box;
}

}  // namespace osteon::import
