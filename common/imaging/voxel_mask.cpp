#include "common/imaging/voxel_mask.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/freed_memory.hpp"

namespace osteon::imaging {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

// Squared distance along the row of voxels to the nearest voxel of the mask, mm², or kFar beyond `reach` voxels.
// False: the row has none.
bool along_row(const std::uint8_t* mask, int columns, float spacing_mm, int reach, float* squared) {
  const auto step = spacing_mm * spacing_mm;
  std::fill(squared, squared + columns, kFar);
  bool any = false;
  int last = -reach - 1;
  for (int x = 0; x < columns; ++x) {
    if (mask[x] != 0) last = x;
    if (x - last <= reach && last >= 0) squared[x] = step * static_cast<float>((x - last) * (x - last));
    any = any || mask[x] != 0;
  }
  if (!any) return false;
  last = columns + reach;
  for (int x = columns - 1; x >= 0; --x) {
    if (mask[x] != 0) last = x;
    if (last - x <= reach && last < columns)
      squared[x] = std::min(squared[x], step * static_cast<float>((last - x) * (last - x)));
  }
  return true;
}

// Squared distances of one slice within its plane.
struct Slice {
  std::vector<float> squared_mm2;
  bool any = false;
};

// The lower envelope over rows of voxels. A distance in the plane is the minimum over rows of the row's distance plus
// the step across.
void across_rows(const std::vector<float>& rows, const std::vector<std::uint8_t>& filled, int columns, int count,
                 float spacing_mm, int reach, Slice& out) {
  out.squared_mm2.assign(rows.size(), kFar);
  for (int y = 0; y < count; ++y) {
    float* to = out.squared_mm2.data() + static_cast<std::ptrdiff_t>(y) * columns;
    for (int from = std::max(0, y - reach); from <= std::min(count - 1, y + reach); ++from) {
      if (filled[static_cast<std::size_t>(from)] == 0) continue;
      const float across = spacing_mm * spacing_mm * static_cast<float>((from - y) * (from - y));
      const float* row = rows.data() + static_cast<std::ptrdiff_t>(from) * columns;
      for (int x = 0; x < columns; ++x) to[x] = std::min(to[x], row[x] + across);
    }
  }
}

}  // namespace

Result<VoxelMask> cropped(VoxelMask mask, const std::array<int, 3>& first, const std::array<int, 3>& last,
                          const KeepGoing& keep_going) {
  // Rows of voxels only move towards the beginning, so the memory can be reused.
  std::uint8_t* to = mask.values.data();
  for (int slice = first[2]; slice <= last[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice - first[2]) / (last[2] - first[2] + 1)))
      return stopped_while("cropping the labels");
    for (int row = first[1]; row <= last[1]; ++row) {
      const std::uint8_t* from = mask.values.data() + mask.index(first[0], row, slice);
      to = std::copy(from, from + (last[0] - first[0] + 1), to);
    }
  }
  mask.values.resize(static_cast<std::size_t>(to - mask.values.data()));
  give_back_unused(mask.values);
  for (std::size_t axis = 0; axis < 3; ++axis) mask.dims[axis] = last[axis] - first[axis] + 1;
  return mask;
}

Result<VoxelMask> within_mm(const VoxelMask& mask, const Vec3& spacing_mm, double radius_mm,
                            const KeepGoing& keep_going) {
  const auto [columns, rows, slices] = mask.dims;
  VoxelMask out(mask.dims);
  const auto reach = [&](int axis) { return static_cast<int>(std::floor(radius_mm / spacing_mm[axis] + 1e-9)); };
  const int reach_z = reach(2);
  const std::size_t area = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const auto limit = static_cast<float>(radius_mm * radius_mm * (1.0 + 1e-6));

  // Only slices near the current one are in memory.
  std::vector<Slice> ring(static_cast<std::size_t>(2 * reach_z + 1));
  const auto held = [&](int slice) -> Slice& { return ring[static_cast<std::size_t>(slice % (2 * reach_z + 1))]; };
  std::vector<float> row_distances(area);
  std::vector<std::uint8_t> filled(static_cast<std::size_t>(rows));
  std::vector<float> best(area);
  const auto measure = [&, columns = columns, rows = rows](int slice) {
    Slice& made = held(slice);
    made.any = false;
    for (int y = 0; y < rows; ++y) {
      const bool has =
          along_row(mask.values.data() + mask.index(0, y, slice), columns, static_cast<float>(spacing_mm.x()), reach(0),
                    row_distances.data() + static_cast<std::ptrdiff_t>(y) * columns);
      filled[static_cast<std::size_t>(y)] = has ? 1 : 0;
      made.any = made.any || has;
    }
    if (made.any) across_rows(row_distances, filled, columns, rows, static_cast<float>(spacing_mm.y()), reach(1), made);
  };

  for (int slice = 0; slice < std::min(reach_z, slices); ++slice) measure(slice);
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(static_cast<double>(slice) / slices)) return stopped_while("measuring distances in the scan");
    if (slice + reach_z < slices) measure(slice + reach_z);
    bool any = false;
    for (int from = std::max(0, slice - reach_z); from <= std::min(slices - 1, slice + reach_z); ++from) {
      const Slice& near = held(from);
      if (!near.any) continue;
      const auto across = static_cast<float>(spacing_mm.z() * spacing_mm.z() * (from - slice) * (from - slice));
      if (!any) std::ranges::fill(best, kFar);
      any = true;
      for (std::size_t i = 0; i < area; ++i) best[i] = std::min(best[i], near.squared_mm2[i] + across);
    }
    if (!any) continue;
    std::uint8_t* to = out.values.data() + out.index(0, 0, slice);
    for (std::size_t i = 0; i < area; ++i) to[i] = best[i] <= limit ? 1 : 0;
  }
  return out;
}

}  // namespace osteon::imaging
