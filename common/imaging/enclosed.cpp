#include "common/imaging/enclosed.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/imaging/components.hpp"

namespace osteon::imaging {
namespace {

constexpr double kCoarse_mm = 4.0;  // voxels for measuring the width of a large space

// One face of the volume as an image. It finds which free voxels are connected to the outside within the face.
class Face {
 public:
  // `fixed`: the axis that is normal to the face.
  Face(const VoxelMask& solid, int fixed, bool last, const ScanEnds& ends)
      : solid_(solid),
        fixed_(fixed),
        u_((fixed + 1) % 3),
        v_((fixed + 2) % 3),
        at_(last ? solid.dims[index(fixed)] - 1 : 0),
        width_(solid.dims[index(u_)]),
        height_(solid.dims[index(v_)]),
        reached_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0) {
    if (!ends[index(fixed)][last ? 1 : 0]) {
      for (int v = 0; v < height_; ++v)
        for (int u = 0; u < width_; ++u) reach(u, v);
      return;
    }
    edge(v_, ends, width_, [&](int i, bool far) { reach(i, far ? height_ - 1 : 0); });
    edge(u_, ends, height_, [&](int i, bool far) { reach(far ? width_ - 1 : 0, i); });
    flood();
  }

  // Calls `visit` with the coordinates of each reached voxel.
  template <class Visit>
  void each(Visit visit) const {
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u)
        if (reached_[cell(u, v)] != 0) visit(voxel(u, v));
  }

 private:
  static std::size_t index(int axis) { return static_cast<std::size_t>(axis); }
  [[nodiscard]] std::size_t cell(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }
  [[nodiscard]] std::array<int, 3> voxel(int u, int v) const {
    std::array<int, 3> c{};
    c[index(fixed_)] = at_;
    c[index(u_)] = u;
    c[index(v_)] = v;
    return c;
  }
  [[nodiscard]] bool free(int u, int v) const {
    const auto c = voxel(u, v);
    return solid_.at(c[0], c[1], c[2]) == 0;
  }
  // False for a solid voxel.
  bool reach(int u, int v) {
    if (!free(u, v)) return false;
    if (reached_[cell(u, v)] == 0) {
      reached_[cell(u, v)] = 1;
      waiting_.push_back({u, v});
    }
    return true;
  }
  // Both edges of the face where it meets the two faces across `axis`. An edge at the end of the scan is open from its
  // ends up to the first solid voxel. Any other edge is completely open.
  template <class Reach>
  void edge(int axis, const ScanEnds& ends, int length, Reach reach_at) {
    for (const bool far : {false, true}) {
      const bool scan_ends = ends[index(axis)][far ? 1 : 0];
      const auto is_free = [&](int i) {
        return axis == v_ ? free(i, far ? height_ - 1 : 0) : free(far ? width_ - 1 : 0, i);
      };
      for (int i = 0; i < length && (!scan_ends || is_free(i)); ++i) reach_at(i, far);
      for (int i = length - 1; scan_ends && i >= 0 && is_free(i); --i) reach_at(i, far);
    }
  }
  // Each voxel is queued once, so this ends.
  void flood() {
    while (!waiting_.empty()) {
      const auto [u, v] = waiting_.back();
      waiting_.pop_back();
      if (u > 0) reach(u - 1, v);
      if (u + 1 < width_) reach(u + 1, v);
      if (v > 0) reach(u, v - 1);
      if (v + 1 < height_) reach(u, v + 1);
    }
  }

  const VoxelMask& solid_;
  int fixed_, u_, v_, at_, width_, height_;
  std::vector<std::uint8_t> reached_;
  std::vector<std::array<int, 2>> waiting_;
};

// 1 for a voxel of the volume's faces that is connected to the outside.
VoxelMask open_faces(const VoxelMask& solid, const ScanEnds& ends) {
  VoxelMask open(solid.dims);
  for (int axis = 0; axis < 3; ++axis)
    for (const bool last : {false, true})
      Face(solid, axis, last, ends).each([&](const std::array<int, 3>& c) { open.at(c[0], c[1], c[2]) = 1; });
  return open;
}

// Whether a sphere of `radius_mm` fits into one component. The ends of the scan are not walls, because the space beyond
// may be as wide as it is here. Error: cancelled.
Result<bool> has_room(const Components& spaces, std::uint32_t component, const std::array<int, 3>& dims,
                      const Vec3& spacing_mm, double radius_mm, const KeepGoing& keep_going) {
  std::array<int, 3> step{}, coarse{};
  Vec3 coarse_mm;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    step[axis] = std::max(1, static_cast<int>(std::lround(kCoarse_mm / spacing_mm[static_cast<int>(axis)])));
    coarse[axis] = (dims[axis] + step[axis] - 1) / step[axis];
    coarse_mm[static_cast<int>(axis)] = spacing_mm[static_cast<int>(axis)] * step[axis];
  }
  // A coarse voxel is a wall unless all of it belongs to the space, because walls of bone are thinner than it.
  std::vector<std::int64_t> free(VoxelMask(coarse).values.size(), 0);
  VoxelMask wall(coarse);
  for (const VoxelRun& run : spaces.runs)
    if (run.component == component)
      for (int x = run.first; x <= run.last; ++x)
        ++free[wall.index(x / step[0], run.row / step[1], run.slice / step[2])];
  for (int z = 0; z < coarse[2]; ++z)
    for (int y = 0; y < coarse[1]; ++y)
      for (int x = 0; x < coarse[0]; ++x) {
        const auto size = [&](int c, std::size_t axis) { return std::min(step[axis], dims[axis] - c * step[axis]); };
        const std::int64_t all = static_cast<std::int64_t>(size(x, 0)) * size(y, 1) * size(z, 2);
        wall.at(x, y, z) = free[wall.index(x, y, z)] < all ? 1 : 0;
      }
  const auto near = within_mm(wall, coarse_mm, radius_mm - 0.5 * kCoarse_mm, keep_going);
  if (!near) return tl::unexpected(near.error());
  return std::ranges::any_of(near->values, [](std::uint8_t v) { return v == 0; });
}

// Marks the free components that contain no open voxel of the faces and are no wider than a marrow space. `marked` gets
// 1 there. Error: cancelled.
Result<void> mark_closed(const VoxelMask& solid, const Vec3& spacing_mm, const SegmentationParams& params,
                         const ScanEnds& ends, VoxelMask& marked, const KeepGoing& keep_going) {
  std::bitset<256> free;
  free.set(0);
  const auto spaces = find_components(solid, free, Connectivity::faces, keep_going);
  if (!spaces) return tl::unexpected(spaces.error());
  const VoxelMask open = open_faces(solid, ends);
  std::vector<bool> outside(spaces->count, false);
  for (const VoxelRun& run : spaces->runs) outside[run.component] = outside[run.component] || any_in_run(open, run);
  const std::vector<std::int64_t> voxels = spaces->voxels();
  const double widest_mm3 = 4.0 / 3.0 * std::numbers::pi * std::pow(params.widest_mm, 3);
  for (std::uint32_t i = 0; i < spaces->count; ++i)
    if (!outside[i] && static_cast<double>(voxels[i]) * spacing_mm.prod() > widest_mm3) {
      const auto wide =
          has_room(*spaces, i, solid.dims, spacing_mm, params.widest_mm, [&](double) { return keep_going(1.0); });
      if (!wide) return tl::unexpected(wide.error());
      outside[i] = *wide;
    }
  for (const VoxelRun& run : spaces->runs)
    if (!outside[run.component]) fill_run(marked, run, 1);
  return {};
}

// The space that belongs to each core: free, near the core, connected to it, and out of reach of the ball.
Result<VoxelMask> grow_cores(const VoxelMask& solid, const VoxelMask& cores, const VoxelMask& within_reach,
                             const Vec3& spacing_mm, double reach_mm, const KeepGoing& keep_going) {
  auto near = within_mm(cores, spacing_mm, reach_mm, part(keep_going, 0.0, 0.5));
  if (!near) return near;
  for (std::size_t i = 0; i < near->values.size(); ++i)
    if (solid.values[i] != 0 || (within_reach.values[i] != 0 && cores.values[i] == 0)) near->values[i] = 0;
  std::bitset<256> one;
  one.set(1);
  const auto pieces = find_components(*near, one, Connectivity::faces, part(keep_going, 0.5, 1.0));
  if (!pieces) return tl::unexpected(pieces.error());
  std::vector<bool> has_core(pieces->count, false);
  for (const VoxelRun& run : pieces->runs) has_core[run.component] = has_core[run.component] || any_in_run(cores, run);
  for (const VoxelRun& run : pieces->runs)
    if (!has_core[run.component]) fill_run(*near, run, 0);
  return near;
}

}  // namespace

Result<VoxelMask> enclosed_by(const VoxelMask& solid, const Vec3& spacing_mm, const SegmentationParams& params,
                              const ScanEnds& ends, const KeepGoing& keep_going) {
  // Positions where the ball's centre cannot be: in the bone, or nearer to it than the ball's radius.
  auto wall = within_mm(solid, spacing_mm, params.bridged_mm, part(keep_going, 0.0, 0.15));
  if (!wall) return wall;
  VoxelMask cores(solid.dims);
  if (auto marked = mark_closed(*wall, spacing_mm, params, ends, cores, part(keep_going, 0.15, 0.35)); !marked)
    return tl::unexpected(marked.error());

  // Masks go as soon as nobody reads them any more, because each is as large as half the scan.
  VoxelMask closed;
  if (std::ranges::any_of(cores.values, [](std::uint8_t v) { return v != 0; })) {
    VoxelMask centres = std::move(*wall);  // of the ball, outside
    for (std::size_t i = 0; i < centres.values.size(); ++i)
      centres.values[i] = centres.values[i] == 0 && cores.values[i] == 0 ? 1 : 0;
    auto reach = within_mm(centres, spacing_mm, params.bridged_mm, part(keep_going, 0.35, 0.5));
    if (!reach) return reach;
    centres = {};
    auto grown = grow_cores(solid, cores, *reach, spacing_mm, 2.0 * params.bridged_mm, part(keep_going, 0.5, 0.8));
    if (!grown) return grown;
    closed = std::move(*grown);
    for (std::size_t i = 0; i < closed.values.size(); ++i)
      if (solid.values[i] != 0) closed.values[i] = solid.values[i];
  } else {
    closed = solid;
  }
  *wall = {};
  cores = {};
  if (!keep_going(0.8)) return stopped_while("looking for marrow spaces");
  // The rest of narrow spaces behind them, and every other hole that no path of voxels leaves.
  VoxelMask enclosed(solid.dims);
  if (auto marked = mark_closed(closed, spacing_mm, params, ends, enclosed, part(keep_going, 0.8, 1.0)); !marked)
    return tl::unexpected(marked.error());
  for (std::size_t i = 0; i < enclosed.values.size(); ++i)
    if (closed.values[i] != 0 && solid.values[i] == 0) enclosed.values[i] = 1;
  return enclosed;
}

}  // namespace osteon::imaging
