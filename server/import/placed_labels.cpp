#include "server/import/placed_labels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <new>
#include <set>

#include "common/core/bounded_text.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kMostLabelsOfCase = 255, kMostNamed = 5;  // names in an error
constexpr std::size_t kMostNameShown = 60;                      // bytes of each
constexpr double kMostGridError = 0.01;  // voxels: how far the voxels of two grids may be apart to count as the same
constexpr double kLeastBeyond = 0.005;   // of the labels' volume: less than that beyond the CT is rounding

double cm3_of(double voxels, const Vec3& spacing_mm) { return voxels * spacing_mm.prod() * 1e-3; }

std::string shown_label(const LabelSegment& segment) {
  return segment.name.empty() ? "label " + std::to_string(segment.number)
                              : "\"" + bounded_text(segment.name, kMostNameShown) + "\"";
}

// What names a segment in --label-names.
std::string key_of(const LabelSegment& segment) {
  return segment.name.empty() ? std::to_string(segment.number) : bounded_text(segment.name, kMostNameShown);
}

// What a segment is: as the person says, as its name in the file says, or as its coded type says.
std::optional<Structure> structure_of(const LabelSegment& segment, const LabelNames& names) {
  for (const std::string& key : {segment.name, std::to_string(segment.number)})
    if (const auto given = names.given.find(key); given != names.given.end()) return given->second;
  if (names.totalsegmentator && segment.name.empty()) return known_structure(totalsegmentator_name(segment.number));
  if (auto known = known_structure(segment.name)) return known;
  return known_structure(segment.type);
}

Result<std::vector<Structure>> structures_of(const LabelMap& map, const LabelNames& names) {
  std::vector<Structure> structures;
  std::string unknown, first;
  std::size_t count = 0;
  for (const LabelSegment& segment : map.segments) {
    const auto structure = structure_of(segment, names);
    structures.push_back(structure.value_or(Structure{}));
    if (structure || segment.runs.empty()) continue;
    if (count == 0) first = key_of(segment);
    if (++count <= kMostNamed) unknown += (count > 1 ? ", " : "") + shown_label(segment);
  }
  if (count == 0) return structures;
  if (count > kMostNamed) unknown += " and " + std::to_string(count - kMostNamed) + " more";
  return bad_input(map.file + ": Osteon does not know what " + unknown + (count == 1 ? " is" : " are") +
                   "; write --label-names " + first + "=NAME or " + first + "=NAME:KIND, with the kind " +
                   kind_choice_text() + (names.totalsegmentator ? "" : ", or --label-names totalsegmentator"));
}

// The description of each kept label, and the value of each segment's voxels; 0: left out.
struct Values {
  std::vector<CaseLabel> labels;
  std::vector<std::uint8_t> of_segment;
};

Result<Values> choose_values(const LabelMap& map, const std::vector<Structure>& structures) {
  Values values;
  values.of_segment.assign(map.segments.size(), 0);
  std::set<int> taken;
  std::set<std::string> taken_names;
  const auto add = [&](std::size_t i, int value) {
    taken.insert(value);
    CaseLabel label{.value = value, .name = structures[i].name, .kind = *structures[i].kind};
    for (int n = 2; !taken_names.insert(label.name).second; ++n)
      label.name = structures[i].name + " " + std::to_string(n);
    label.provenance.method = "label map, " + map.kind;
    if (map.numbered) label.provenance.parameters["number_in_file"] = map.segments[i].number;
    values.labels.push_back(std::move(label));
    values.of_segment[i] = static_cast<std::uint8_t>(value);
  };
  const auto kept = [&](std::size_t i) { return structures[i].kind && !map.segments[i].runs.empty(); };
  std::size_t count = 0;
  for (std::size_t i = 0; i < structures.size(); ++i) count += kept(i) ? 1 : 0;
  if (count > kMostLabelsOfCase)
    return bad_input(map.file + " has more than 255 labels of bone and structures at risk; leave some out by " +
                     "--label-names NUMBER=NAME:none");
  for (std::size_t i = 0; i < structures.size(); ++i)
    if (const int number = map.segments[i].number; kept(i) && number >= 1 && number <= 255 && !taken.contains(number))
      add(i, number);
  int next = 1;
  for (std::size_t i = 0; i < structures.size(); ++i) {
    if (!kept(i) || values.of_segment[i] != 0) continue;
    while (taken.contains(next)) ++next;
    add(i, next);
  }
  std::ranges::sort(values.labels, {}, &CaseLabel::value);
  return values;
}

// All kept segments on the map's own voxels. Error: invalid_input (two in one voxel).
Result<imaging::VoxelMask> draw(const LabelMap& map, const Values& values, const KeepGoing& keep_going) {
  imaging::VoxelMask mask(map.grid.dims);
  for (std::size_t i = 0; i < map.segments.size(); ++i) {
    if (!keep_going(static_cast<double>(i) / static_cast<double>(map.segments.size())))
      return stopped_while("placing the labels");
    if (values.of_segment[i] == 0) continue;
    std::int64_t shared = 0;
    std::uint8_t other = 0;
    for (const imaging::VoxelRun& run : map.segments[i].runs) {
      const std::uint8_t* row = mask.values.data() + mask.index(0, run.row, run.slice);
      for (int column = run.first; column <= run.last; ++column)
        if (row[column] != 0) {
          ++shared;
          if (other == 0) other = row[column];
        }
      imaging::fill_run(mask, run, values.of_segment[i]);
    }
    if (shared == 0) continue;
    const auto which = std::ranges::find(values.of_segment, other) - values.of_segment.begin();
    return bad_input(
        map.file + ": " + shown_label(map.segments[static_cast<std::size_t>(which)]) + " and " +
        shown_label(map.segments[i]) + " are both in " + std::to_string(shared) + (shared == 1 ? " voxel" : " voxels") +
        "; let each voxel have one label, or leave one out by --label-names " + key_of(map.segments[i]) + "=NAME:none");
  }
  return mask;
}

// Where a voxel of the CT lies among the voxels of the map: start + steps * (column, row, slice).
struct GridSteps {
  Eigen::Matrix3d steps;
  Vec3 start;
  // Whether both have their voxels at the same places.
  [[nodiscard]] bool same_voxels(const std::array<int, 3>& dims) const {
    if ((start - start.array().round().matrix()).cwiseAbs().maxCoeff() > kMostGridError) return false;
    // Far from the first voxel, too.
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = steps.col(axis), whole = step.array().round();
      if ((step - whole).cwiseAbs().maxCoeff() * dims[static_cast<std::size_t>(axis)] > kMostGridError) return false;
      if (whole.cwiseAbs().sum() != 1.0) return false;
    }
    return true;
  }
};

GridSteps steps_between(const imaging::HuVolume& ct, const imaging::HuVolume& map) {
  const Vec3 start = map.voxel(ct.position_mm(Vec3::Zero()));
  GridSteps between{Eigen::Matrix3d::Zero(), start};
  for (int axis = 0; axis < 3; ++axis) between.steps.col(axis) = map.voxel(ct.position_mm(Vec3::Unit(axis))) - start;
  return between;
}

Result<imaging::VoxelMask> resampled(const imaging::VoxelMask& from, const GridSteps& between,
                                     const std::array<int, 3>& dims, const KeepGoing& keep_going) {
  imaging::VoxelMask to(dims);
  const Vec3 step = between.steps.col(0);
  const Vec3 most(from.dims[0] - 0.5, from.dims[1] - 0.5, from.dims[2] - 0.5);
  for (int slice = 0; slice < dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / dims[2])) return stopped_while("placing the labels");
    for (int row = 0; row < dims[1]; ++row) {
      const Vec3 first = between.start + between.steps * Vec3(0, row, slice);
      std::uint8_t* value = to.values.data() + to.index(0, row, slice);
      for (int column = 0; column < dims[0]; ++column) {
        const Vec3 at = first + column * step;
        if (!(at.array() >= -0.5).all() || !(at.array() < most.array()).all()) continue;
        // Truncation rounds: no coordinate is below zero.
        value[column] =
            from.at(static_cast<int>(at.x() + 0.5), static_cast<int>(at.y() + 0.5), static_cast<int>(at.z() + 0.5));
      }
    }
  }
  return to;
}

std::string box_text(const imaging::HuVolume& grid) {
  const Box box =
      imaging::enclosing_box(grid, Vec3::Zero(), Vec3(grid.dims[0] - 1, grid.dims[1] - 1, grid.dims[2] - 1));
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "x %.0f..%.0f, y %.0f..%.0f, z %.0f..%.0f mm", box.min_mm.x(), box.max_mm.x(),
                box.min_mm.y(), box.max_mm.y(), box.min_mm.z(), box.max_mm.z());
  return text.data();
}

std::array<std::int64_t, 256> counts_of(const imaging::VoxelMask& mask) {
  std::array<std::int64_t, 256> counts{};
  for (const std::uint8_t value : mask.values) ++counts[value];
  return counts;
}

std::int64_t labelled(const std::array<std::int64_t, 256>& counts, const imaging::VoxelMask& mask) {
  return static_cast<std::int64_t>(mask.values.size()) - counts[0];
}

Result<PlacedLabels> place(LabelMap map, const LabelNames& names, const imaging::HuVolume& ct,
                           const std::string& frame_of_reference, const KeepGoing& keep_going) {
  if (!map.frame_of_reference.empty() && !frame_of_reference.empty() && map.frame_of_reference != frame_of_reference)
    return bad_input(map.file + " has another frame of reference than the CT; give the labels of this scan");
  const auto structures = structures_of(map, names);
  if (!structures) return tl::unexpected(structures.error());
  auto values = choose_values(map, *structures);
  if (!values) return tl::unexpected(values.error());
  PlacedLabels placed;
  for (std::size_t i = 0; i < map.segments.size(); ++i)
    if (!(*structures)[i].kind && !map.segments[i].runs.empty())
      placed.left_out.push_back({(*structures)[i].name.empty() ? key_of(map.segments[i]) : (*structures)[i].name,
                                 cm3_of(static_cast<double>(map.segments[i].voxels()), map.grid.spacing_mm)});
  auto drawn = draw(map, *values, part(keep_going, 0.0, 0.3));
  if (!drawn) return tl::unexpected(drawn.error());
  for (LabelSegment& segment : map.segments) segment.runs = {};
  const auto before = counts_of(*drawn);
  const GridSteps between = steps_between(ct, map.grid);
  placed.same_grid = between.same_voxels(ct.dims);
  placed.oriented = map.oriented;
  auto on_ct = resampled(*drawn, between, ct.dims, part(keep_going, 0.3, 1.0));
  if (!on_ct) return tl::unexpected(on_ct.error());
  placed.values = std::move(*on_ct);
  const auto after = counts_of(placed.values);
  if (labelled(before, *drawn) > 0 && labelled(after, placed.values) == 0)
    return bad_input(map.file + " has no label within the CT: its voxels lie at " + box_text(map.grid) +
                     ", those of the CT at " + box_text(ct) + "; give the labels of this scan");
  bool any_bone = false;
  for (CaseLabel& label : values->labels) {
    if (after[static_cast<std::size_t>(label.value)] == 0) continue;
    any_bone = any_bone || is_carved(label.kind);
    if (!placed.same_grid) label.provenance.method += ", nearest voxel";
    placed.cm3.push_back(cm3_of(static_cast<double>(after[static_cast<std::size_t>(label.value)]), ct.spacing_mm));
    placed.labels.push_back(std::move(label));
  }
  if (!any_bone)
    return bad_input(map.file + " has no bone within the CT; give labels with a bone, or name one by --label-names " +
                     "NUMBER=NAME:bone");
  const double volume_cm3 = cm3_of(static_cast<double>(labelled(before, *drawn)), map.grid.spacing_mm);
  const double lost_cm3 = volume_cm3 - cm3_of(static_cast<double>(labelled(after, placed.values)), ct.spacing_mm);
  placed.beyond_cm3 = lost_cm3 > kLeastBeyond * volume_cm3 ? lost_cm3 : 0.0;
  return placed;
}

}  // namespace

Result<PlacedLabels> place_labels(LabelMap map, const LabelNames& names, const imaging::HuVolume& ct,
                                  const std::string& frame_of_reference, const KeepGoing& keep_going) try {
  return place(std::move(map), names, ct, frame_of_reference, keep_going);
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory for the labels; export a smaller region");
}

std::string labels_text(const PlacedLabels& placed, double bone_cm3) {
  std::string text = "labels     number     cm3  structure\n";
  std::array<char, 320> line{};
  double carved_cm3 = 0.0;
  for (std::size_t i = 0; i < placed.labels.size(); ++i) {
    const CaseLabel& label = placed.labels[i];
    if (is_carved(label.kind)) carved_cm3 += placed.cm3[i];
    std::snprintf(line.data(), line.size(), "           %6d  %6.2f  %s (%s), %s\n", label.value, placed.cm3[i],
                  label.name.c_str(), std::string(name_of(label.kind)).c_str(),
                  is_carved(label.kind) ? "in the bone" : "at risk");
    text += line.data();
  }
  std::snprintf(line.data(), line.size(),
                "carved     %.2f cm3 in the labels; the smoothed bone has %+.2f %% of that more\n", carved_cm3,
                carved_cm3 > 0.0 ? 100.0 * (bone_cm3 - carved_cm3) / carved_cm3 : 0.0);
  text += line.data();
  text += placed.same_grid ? "grid       that of the CT, voxel for voxel\n"
                           : "grid       another than the CT's; each voxel has the nearest label\n";
  if (!placed.oriented)
    text += "           the file does not say how it lies in the patient: left and right may be swapped\n";
  if (placed.beyond_cm3 > 0.0) {
    std::snprintf(line.data(), line.size(), "beyond     %.2f cm3 of labels lie where the CT has ended\n",
                  placed.beyond_cm3);
    text += line.data();
  }
  for (std::size_t i = 0; i < placed.left_out.size(); ++i) {
    std::snprintf(line.data(), line.size(), "%s%s, %.2f cm3\n", i == 0 ? "left out   " : "           ",
                  placed.left_out[i].name.c_str(), placed.left_out[i].volume_cm3);
    text += line.data();
  }
  return text;
}

}  // namespace osteon::import
