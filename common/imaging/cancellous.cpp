#include "common/imaging/cancellous.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/imaging/components.hpp"

namespace osteon::imaging {
namespace {

constexpr double kLeastBetween = 0.5;
constexpr int kCorner = 8;  // voxels of a solid around one at its corner: 2³

// The first whole number at or above a value.
int whole_hu(double hu) { return static_cast<int>(std::ceil(hu)); }

// Number of voxels at or above a value in a 3 x 3 square within the slice. Voxels beyond the volume do not count.
void count_in_slice(const HuVolume& volume, double least_hu, int slice, std::vector<std::uint8_t>& row,
                    std::vector<std::uint8_t>& out) {
  const int columns = volume.dims[0], rows = volume.dims[1];
  const int least = whole_hu(least_hu);
  row.resize(out.size());
  std::ranges::fill(out, std::uint8_t{0});
  std::vector<std::uint8_t> line(static_cast<std::size_t>(columns) + 2, 0);  // with a voxel beyond each end
  for (int y = 0; y < rows; ++y) {
    const std::int16_t* hu = volume.values.data() + volume.index(0, y, slice);
    std::uint8_t *to = row.data() + static_cast<std::ptrdiff_t>(y) * columns, *counts = line.data();
    for (int x = 0; x < columns; ++x) counts[x + 1] = hu[x] >= least ? 1 : 0;
    for (int x = 0; x < columns; ++x) to[x] = static_cast<std::uint8_t>(counts[x] + counts[x + 1] + counts[x + 2]);
  }
  for (int y = 0; y < rows; ++y)
    for (int from = std::max(0, y - 1); from <= std::min(rows - 1, y + 1); ++from) {
      const std::uint8_t* add = row.data() + static_cast<std::ptrdiff_t>(from) * columns;
      std::uint8_t* to = out.data() + static_cast<std::ptrdiff_t>(y) * columns;
      for (int x = 0; x < columns; ++x) to[x] = static_cast<std::uint8_t>(to[x] + add[x]);
    }
}

// For each voxel of a slice, the number of voxels at or above a value among the 27 around it. Slices must be requested
// in order.
class CountAround {
 public:
  CountAround(const HuVolume& volume, double least_hu) : volume_(volume), least_hu_(least_hu) {
    for (auto& count : counts_)
      count.assign(static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]), 0);
    count_in_slice(volume_, least_hu_, 0, row_, at(0));
  }
  void go_to(int slice) {
    if (slice + 1 < volume_.dims[2])
      count_in_slice(volume_, least_hu_, slice + 1, row_, at(slice + 1));
    else
      std::ranges::fill(at(slice + 1), std::uint8_t{0});
  }
  [[nodiscard]] int around(std::size_t i) const { return counts_[0][i] + counts_[1][i] + counts_[2][i]; }

 private:
  std::vector<std::uint8_t>& at(int slice) { return counts_[static_cast<std::size_t>(slice % 3)]; }
  const HuVolume& volume_;
  double least_hu_;
  std::array<std::vector<std::uint8_t>, 3> counts_;
  std::vector<std::uint8_t> row_;
};

// Voxels that may be cancellous bone. Most of their 27 voxels must be bright enough, which removes noise. Air voxels
// are not counted, so a solid in air keeps its edges. In other surroundings a voxel at an edge or corner, where fewer
// voxels belong to the solid, must be bright itself.
Result<VoxelMask> candidates(const HuVolume& volume, const VoxelMask& dense, const SegmentationParams& params,
                             const KeepGoing& keep_going) {
  VoxelMask out(volume.dims);
  const std::size_t area = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  CountAround bright(volume, params.cancellous_hu), no_air(volume, params.air_hu);
  const int cancellous_hu = whole_hu(params.cancellous_hu), air_hu = whole_hu(params.air_hu);
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("looking for cancellous bone");
    bright.go_to(slice);
    no_air.go_to(slice);
    const std::size_t begin = volume.index(0, 0, slice);
    for (std::size_t i = 0; i < area; ++i) {
      const int hu = volume.values[begin + i];
      if (dense.values[begin + i] != 0 || hu < air_hu) continue;
      const int count = bright.around(i);
      out.values[begin + i] = 2 * count > no_air.around(i) || (count >= kCorner && hu >= cancellous_hu) ? 1 : 0;
    }
  }
  return out;
}

// Removes components in which the fraction of voxels in a core is below `share`, or zero. `in_core` gets the index of a
// voxel. False: none is left.
template <class InCore>
Result<bool> keep_with_core(VoxelMask& mask, InCore in_core, double share, const KeepGoing& keep_going) {
  std::bitset<256> one;
  one.set(1);
  const auto found = find_components(mask, one, Connectivity::corners, keep_going);
  if (!found) return tl::unexpected(found.error());
  const std::vector<std::int64_t> all = found->voxels();
  std::vector<std::int64_t> of_core(found->count, 0);
  for (const VoxelRun& run : found->runs) {
    const std::size_t begin = mask.index(0, run.row, run.slice);
    for (int x = run.first; x <= run.last; ++x)
      of_core[run.component] += in_core(begin + static_cast<std::size_t>(x)) ? 1 : 0;
  }
  std::vector<bool> kept(found->count, false);
  for (std::size_t i = 0; i < kept.size(); ++i)
    kept[i] = of_core[i] > 0 && static_cast<double>(of_core[i]) >= share * static_cast<double>(all[i]);
  for (const VoxelRun& run : found->runs)
    if (!kept[run.component]) fill_run(mask, run, 0);
  return std::ranges::any_of(kept, [](bool k) { return k; });
}

struct Place {
  std::int32_t column, row, slice;
};

std::vector<Place> places_of(const VoxelMask& mask) {
  std::vector<Place> places;
  for (int slice = 0; slice < mask.dims[2]; ++slice)
    for (int row = 0; row < mask.dims[1]; ++row)
      for (int column = 0; column < mask.dims[0]; ++column)
        if (mask.at(column, row, slice) != 0) places.push_back({column, row, slice});
  return places;
}

// Of the candidates, those from which a straight line through candidates leads to dense bone in both directions, along
// one of the 13 directions of neighbours.
Result<VoxelMask> between_dense(const VoxelMask& candidate, const VoxelMask& dense, const KeepGoing& keep_going) {
  constexpr std::uint8_t kBack = 1, kFore = 2, kBetween = 4;
  const std::vector<Place> places = places_of(candidate);
  VoxelMask found(candidate.dims);
  const auto [columns, rows, slices] = candidate.dims;
  int direction = 0;
  for (int neighbour = 14; neighbour < 27; ++neighbour, ++direction) {  // later in memory than the voxel itself
    const std::array<int, 3> d{neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1};
    // Along a line, every candidate is visited before it is asked, so bits of an earlier direction do not matter.
    const auto lead = [&, columns = columns, rows = rows, slices = slices](const Place& p, int sign, std::uint8_t bit) {
      std::uint8_t& to = found.at(p.column, p.row, p.slice);
      to = static_cast<std::uint8_t>(to & ~bit);
      const int x = p.column + sign * d[0], y = p.row + sign * d[1], z = p.slice + sign * d[2];
      if (x < 0 || y < 0 || z < 0 || x >= columns || y >= rows || z >= slices) return;
      const std::size_t i = candidate.index(x, y, z);
      if (dense.values[i] == mask_value(BoneVoxel::dense) || (candidate.values[i] != 0 && (found.values[i] & bit) != 0))
        to = static_cast<std::uint8_t>(to | bit);
    };
    std::size_t asked = 0;
    const auto stop = [&] { return (asked++ & 0xfffff) == 0 && !keep_going(direction / 13.0); };
    for (const Place& p : places) {
      if (stop()) return stopped_while("looking for cancellous bone");
      lead(p, -1, kBack);
    }
    for (auto p = places.rbegin(); p != places.rend(); ++p) {
      if (stop()) return stopped_while("looking for cancellous bone");
      lead(*p, 1, kFore);
      std::uint8_t& bits = found.at(p->column, p->row, p->slice);
      if ((bits & kFore) != 0 && (bits & kBack) != 0) bits = static_cast<std::uint8_t>(bits | kBetween);
    }
  }
  for (const Place& p : places) {
    std::uint8_t& bits = found.at(p.column, p.row, p.slice);
    bits = (bits & kBetween) != 0 ? 1 : 0;
  }
  return found;
}

// Against air, the edge of cancellous bone is half way to air, far below `cancellous_hu`. Adds the voxels that are more
// than half bone.
void add_edge_to_air(const HuVolume& volume, double air_hu, VoxelMask& found) {
  const auto [columns, rows, slices] = volume.dims;
  std::vector<std::size_t> added;
  for (const Place& p : places_of(found)) {
    const double half_hu = 0.5 * (volume.at(p.column, p.row, p.slice) + kAir_hu);
    for (int side = 0; side < 6; ++side) {
      const int step = side % 2 == 0 ? -1 : 1, axis = side / 2;
      const auto at = [&](int steps) {
        return std::array<int, 3>{p.column + (axis == 0 ? steps : 0), p.row + (axis == 1 ? steps : 0),
                                  p.slice + (axis == 2 ? steps : 0)};
      };
      const auto inside = [&, columns = columns, rows = rows, slices = slices](const std::array<int, 3>& c) {
        return c[0] >= 0 && c[1] >= 0 && c[2] >= 0 && c[0] < columns && c[1] < rows && c[2] < slices;
      };
      const auto next = at(step), beyond = at(2 * step);
      if (!inside(next) || !inside(beyond) || found.at(next[0], next[1], next[2]) != 0) continue;
      const int hu = volume.at(next[0], next[1], next[2]);
      if (hu >= half_hu && hu < volume.at(p.column, p.row, p.slice) &&
          volume.at(beyond[0], beyond[1], beyond[2]) < air_hu)
        added.push_back(found.index(next[0], next[1], next[2]));
    }
  }
  for (const std::size_t i : added) found.values[i] = 1;
}

}  // namespace

Result<VoxelMask> cancellous_between(const HuVolume& volume, const VoxelMask& dense, const SegmentationParams& params,
                                     const KeepGoing& keep_going) {
  auto candidate = candidates(volume, dense, params, part(keep_going, 0.0, 0.3));
  if (!candidate) return candidate;
  // A core is farther from dense bone than half the width of a joint.
  auto near = within_mm(dense, volume.spacing_mm, params.bridged_mm, part(keep_going, 0.3, 0.5));
  if (!near) return near;
  const auto in_core = [&](std::size_t i) { return near->values[i] == 0; };
  const auto any = keep_with_core(*candidate, in_core, 0.0, part(keep_going, 0.5, 0.6));
  if (!any) return tl::unexpected(any.error());
  if (!*any) return VoxelMask(volume.dims);

  auto found = between_dense(*candidate, dense, part(keep_going, 0.6, 0.85));
  if (!found) return found;
  // A vessel with contrast medium and calcified wall has a few such lines. Most cancellous bone is between dense bone.
  const auto is_between = [&](std::size_t i) { return found->values[i] != 0; };
  if (const auto left = keep_with_core(*candidate, is_between, kLeastBetween, part(keep_going, 0.85, 0.9)); !left)
    return tl::unexpected(left.error());
  VoxelMask core = std::move(*near);  // its memory
  for (std::size_t i = 0; i < found->values.size(); ++i) {
    if (candidate->values[i] == 0) found->values[i] = 0;
    core.values[i] = found->values[i] != 0 && core.values[i] == 0 ? 1 : 0;
  }
  *candidate = {};
  auto around = within_mm(core, volume.spacing_mm, 2.0 * params.bridged_mm, part(keep_going, 0.9, 1.0));
  if (!around) return around;
  for (std::size_t i = 0; i < found->values.size(); ++i)
    if (around->values[i] == 0) found->values[i] = 0;
  add_edge_to_air(volume, params.air_hu, *found);
  for (std::size_t i = 0; i < found->values.size(); ++i)
    if (dense.values[i] != 0) found->values[i] = 0;
  return found;
}

}  // namespace osteon::imaging
