#include "server/import/label_edits.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/core/check.hpp"
#include "common/core/digest.hpp"
#include "common/geometry/segment.hpp"

namespace osteon::import {
namespace {

constexpr std::size_t kHashShown = 16;  // hexadecimal digits

std::string number_text(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 7).ptr};
}
// Four decimals, so that small numbers are short too. That of -0 is 0.
std::string point_text(const Vec3& at) {
  const auto rounded = [](double value) { return number_text(std::round(1e4 * value) / 1e4 + 0.0); };
  return rounded(at.x()) + "," + rounded(at.y()) + "," + rounded(at.z());
}

// The error of the edit with this index.
tl::unexpected<Error> bad_edit(std::size_t index, const LabelEdit& edit, const std::string& what) {
  return bad_input("edit " + std::to_string(index + 1) + " (" + std::string(name_of(edit.kind)) + "): " + what);
}

// Half the extent of a voxel along a direction.
double half_voxel_mm(const imaging::HuVolume& grid, const Vec3& along) {
  return 0.5 * (grid.directions.transpose() * along).cwiseAbs().dot(grid.spacing_mm);
}

// Whether apply_edits() takes an edit.
bool changes_labels(EditKind kind) {
  return kind == EditKind::paint || kind == EditKind::scribble || kind == EditKind::erase || kind == EditKind::cut;
}

// Voxels within `radius_mm` of the box around two points, as far as they are in the grid. Empty: last < first.
imaging::VoxelBox voxels_around(const imaging::HuVolume& grid, const Vec3& a_mm, const Vec3& b_mm, double radius_mm) {
  const Vec3 a = grid.voxel(a_mm), b = grid.voxel(b_mm);
  imaging::VoxelBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    const double reach = radius_mm / grid.spacing_mm[i] + 1e-9;  // a centre on the surface belongs to the ball
    const double last = grid.dims[axis] - 1.0;
    box.first[axis] = static_cast<int>(std::clamp(std::ceil(std::min(a[i], b[i]) - reach), 0.0, last + 1.0));
    box.last[axis] = static_cast<int>(std::clamp(std::floor(std::max(a[i], b[i]) + reach), -1.0, last));
  }
  return box;
}

bool holds_no_voxel(const imaging::VoxelBox& box) {
  return box.first[0] > box.last[0] || box.first[1] > box.last[1] || box.first[2] > box.last[2];
}

// The segments of a polyline. A single point is a segment without length.
template <class Visit>
void each_segment(const LabelEdit& edit, Visit visit) {
  if (edit.points_mm.size() == 1) visit(edit.points_mm[0], edit.points_mm[0]);
  for (std::size_t i = 1; i < edit.points_mm.size(); ++i) visit(edit.points_mm[i - 1], edit.points_mm[i]);
}

// Replays one edit after the other.
class Replay {
 public:
  Replay(const imaging::HuVolume& grid, imaging::VoxelMask& labels, const KeepGoing& keep_going)
      : grid_(grid), labels_(labels), keep_going_(keep_going) {
    for (const std::uint8_t label : labels.values) ++count_[label];
  }

  [[nodiscard]] bool has(int bone) const { return count_[static_cast<std::size_t>(bone)] > 0; }
  [[nodiscard]] std::string bones_text() const {
    std::string text;
    for (int bone = 1; bone < 256; ++bone)
      if (has(bone)) text += (text.empty() ? "" : ", ") + std::to_string(bone);
    return text.empty() ? "none" : text;
  }

  // Voxels that the edit covers, or -1: stopped.
  std::int64_t play(const LabelEdit& edit, EditEffect& effect) {
    std::int64_t covered = 0;
    const bool whole = edit.kind == EditKind::cut;
    const bool flat = !whole && edit.normal != Vec3::Zero();
    const double half_mm = flat ? half_voxel_mm(grid_, edit.normal) : 0.0;
    bool going = true;
    each_segment(edit, [&](const Vec3& from, const Vec3& to) {
      const imaging::VoxelBox box =
          whole ? imaging::VoxelBox{{0, 0, 0}, {grid_.dims[0] - 1, grid_.dims[1] - 1, grid_.dims[2] - 1}}
                : voxels_around(grid_, from, to, edit.radius_mm);
      const auto in = [&](const Vec3& at) {
        if (flat && std::abs(edit.normal.dot(at - edit.points_mm.front())) >= half_mm - 1e-9) return false;
        return whole ? edit.normal.dot(at - from) >= -1e-9 : segment_distance_mm(at, from, to) <= edit.radius_mm + 1e-9;
      };
      for (int slice = box.first[2]; slice <= box.last[2] && going; ++slice) {
        going = keep_going_(0.0);
        for (int row = box.first[1]; row <= box.last[1]; ++row)
          for (int column = box.first[0]; column <= box.last[0]; ++column)
            if (in(grid_.position_mm(Vec3(column, row, slice)))) {
              ++covered;
              change(edit, labels_.at(column, row, slice), effect);
            }
      }
    });
    return going ? covered : -1;
  }

 private:
  void change(const LabelEdit& edit, std::uint8_t& label, EditEffect& effect) {
    const bool paints = edit.kind == EditKind::paint || edit.kind == EditKind::scribble;
    if (!paints && (label == 0 || (edit.bone != 0 && label != edit.bone))) return;
    const auto to = static_cast<std::uint8_t>(paints ? edit.bone : edit.to_bone);
    if (label == to) return;
    ++effect.lost[label], --count_[label];
    ++effect.gained[to], ++count_[to];
    label = to;
  }

  const imaging::HuVolume& grid_;
  imaging::VoxelMask& labels_;
  const KeepGoing& keep_going_;
  std::array<std::int64_t, 256> count_{};
};

}  // namespace

std::string_view name_of(EditKind kind) {
  constexpr std::array<std::string_view, 9> kNames{"paint",   "scribble", "erase", "cut",     "seed",
                                                   "outside", "box",      "label", "landmark"};
  return kNames.at(static_cast<std::size_t>(kind));
}

std::string edit_text(const LabelEdit& edit) {
  std::string text(name_of(edit.kind));
  if (edit.kind == EditKind::label)
    return text + " bone " + std::to_string(edit.bone) + " " + edit.name + ", opacity " + number_text(edit.opacity) +
           ", " + number_text(edit.minutes) + " min";
  if (edit.kind == EditKind::box)
    return text + " from " + point_text(edit.points_mm.front()) + " to " + point_text(edit.points_mm.back()) + " mm";
  if (edit.kind == EditKind::landmark)
    return text + " " + edit.name + " at " + point_text(edit.points_mm.front()) + " mm";
  if (edit.bone != 0) text += " bone " + std::to_string(edit.bone);
  if (edit.kind == EditKind::cut)
    text += edit.to_bone != 0 ? ", to bone " + std::to_string(edit.to_bone) : std::string(", removed");
  text += ", at " + point_text(edit.points_mm.front());
  if (edit.points_mm.size() > 1) {
    Hasher hasher;
    for (const Vec3& point : edit.points_mm)
      for (const double c : point) hasher.number(c);
    text += " to " + point_text(edit.points_mm.back()) + " mm over " + std::to_string(edit.points_mm.size()) +
            " points with the hash " + to_hex(hasher.finish()).substr(0, kHashShown);
  } else {
    text += " mm";
  }
  if (edit.normal != Vec3::Zero()) text += ", normal " + point_text(edit.normal);
  if (edit.radius_mm > 0.0) text += ", radius " + number_text(edit.radius_mm) + " mm";
  return text;
}

std::optional<imaging::VoxelBox> reached_voxels(const imaging::HuVolume& grid, std::span<const LabelEdit> edits) {
  std::optional<imaging::VoxelBox> all;
  for (const LabelEdit& edit : edits) {
    if (!changes_labels(edit.kind) || edit.kind == EditKind::cut) continue;
    each_segment(edit, [&](const Vec3& from, const Vec3& to) {
      const imaging::VoxelBox box = voxels_around(grid, from, to, edit.radius_mm);
      if (holds_no_voxel(box)) return;
      if (!all) all = box;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        all->first[axis] = std::min(all->first[axis], box.first[axis]);
        all->last[axis] = std::max(all->last[axis], box.last[axis]);
      }
    });
  }
  return all;
}

Result<std::optional<imaging::VoxelBox>> boxed_voxels(const imaging::HuVolume& grid, std::span<const LabelEdit> edits) {
  constexpr double kSameVoxel = 1e-6;  // of a step: corners at centres of voxels belong to the box
  const auto found = std::ranges::find(edits, EditKind::box, &LabelEdit::kind);
  if (found == edits.end()) return std::optional<imaging::VoxelBox>();
  const Vec3 a = grid.voxel(found->points_mm.front()), b = grid.voxel(found->points_mm.back());
  imaging::VoxelBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis);
    const double last = grid.dims[axis] - 1.0;
    box.first[axis] = static_cast<int>(std::clamp(std::ceil(std::min(a[i], b[i]) - kSameVoxel), 0.0, last + 1.0));
    box.last[axis] = static_cast<int>(std::clamp(std::floor(std::max(a[i], b[i]) + kSameVoxel), -1.0, last));
  }
  if (holds_no_voxel(box))
    return bad_edit(static_cast<std::size_t>(found - edits.begin()), *found,
                    "it holds no voxel of the scan; write two corners with voxels of the scan between them");
  return std::optional(box);
}

Result<void> check_landmarks(const imaging::HuVolume& grid, std::span<const LabelEdit> edits) {
  constexpr double kAtMost = 0.5 + 1e-6;  // of a voxel from its centre
  for (std::size_t i = 0; i < edits.size(); ++i) {
    if (edits[i].kind != EditKind::landmark) continue;
    const Vec3 at = grid.voxel(edits[i].points_mm.front());
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (const double c = at[static_cast<int>(axis)]; !(c >= -kAtMost && c <= grid.dims[axis] - 1.0 + kAtMost))
        return bad_edit(i, edits[i], edits[i].name + " lies beside the scan; write a position in it");
  }
  return {};
}

Result<std::vector<EditEffect>> apply_edits(const imaging::HuVolume& grid, std::span<const LabelEdit> edits,
                                            imaging::VoxelMask& labels, const KeepGoing& keep_going) {
  OSTEON_CHECK(grid.dims == labels.dims);
  std::vector<EditEffect> effects(edits.size());
  const auto count = static_cast<double>(edits.size());
  std::size_t index = 0;
  const KeepGoing within = [&](double) { return keep_going(static_cast<double>(index) / count); };
  Replay replay(grid, labels, within);
  for (; index < edits.size(); ++index) {
    const LabelEdit& edit = edits[index];
    if (!changes_labels(edit.kind)) continue;
    const bool changes_bone = edit.kind == EditKind::cut || (edit.kind == EditKind::erase && edit.bone != 0);
    if (changes_bone && !replay.has(edit.bone))
      return bad_edit(index, edit,
                      "bone: there is no bone " + std::to_string(edit.bone) + " when this edit comes, only " +
                          replay.bones_text() + "; write the number of one that is there");
    const std::int64_t covered = replay.play(edit, effects[index]);
    if (covered < 0) return stopped_while("replaying the edits");
    if (covered == 0 && edit.kind != EditKind::cut)
      return bad_edit(
          index, edit,
          "it covers no voxel of the scan and its box; write a position within both, or a larger radius_mm");
  }
  return effects;
}

}  // namespace osteon::import
