#include "common/radiology/radiograph.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/radiology/attenuation.hpp"
#include "common/radiology/sampling.hpp"

namespace osteon::radiology {
namespace {

// The thread sanitizer does not see the library's own synchronisation.
#if defined(__SANITIZE_THREAD__)
constexpr bool kMayCastOnThreads = false;
#else
constexpr bool kMayCastOnThreads = true;
#endif

// Rays are cast in tiles, brick layer by brick layer, so that what a layer needs stays in the fastest cache.
constexpr int kTileColumns = 32, kTileRows = 16;
constexpr int kLayer = 8;  // planes of a layer of bricks
// Added to a range of positions in samples, for rounding.
constexpr float kMargin = 0.01f;

// Neighbouring rays of one row with one dominant axis. Lanes without a ray of their own repeat the nearest one, and
// meet no plane.
struct Rays {
  RayPacket packet;
  int axis = 0;
  int row = 0;
  std::array<int, kRays> column{};  // -1: no ray
  std::array<float, kRays> sums{};
  std::array<double, kRays> mm{};  // along the ray from plane to plane
};

// The beam in lattice coordinates.
struct LatticeBeam {
  Vec3 source, first, column, row;
  double pitch_mm;
};

int dominant_axis(const Vec3& d) {
  const Vec3 a = d.cwiseAbs();
  return a.x() >= a.y() && a.x() >= a.z() ? 0 : a.y() >= a.z() ? 1 : 2;
}

void set_ray(Rays& rays, std::size_t lane, const LatticeBeam& beam, const Vec3& direction) {
  const int axis = rays.axis, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  const double du = direction[u] / direction[axis], dv = direction[v] / direction[axis];
  const double from = beam.source[axis], to = from + direction[axis];
  rays.packet.u[lane] = static_cast<float>(beam.source[u] - from * du);
  rays.packet.v[lane] = static_cast<float>(beam.source[v] - from * dv);
  rays.packet.du[lane] = static_cast<float>(du);
  rays.packet.dv[lane] = static_cast<float>(dv);
  rays.packet.first[lane] = static_cast<float>(std::min(from, to));
  rays.packet.last[lane] = static_cast<float>(std::max(from, to));
  rays.mm[lane] = beam.pitch_mm * std::sqrt(1.0 + du * du + dv * dv);
}

void repeat_ray(RayPacket& packet, std::size_t from, std::size_t to) {
  packet.u[to] = packet.u[from];
  packet.v[to] = packet.v[from];
  packet.du[to] = packet.du[from];
  packet.dv[to] = packet.dv[from];
  packet.first[to] = 0.0f;
  packet.last[to] = -1.0f;
}

// Adds the rays to up to kRays pixels of a row, one packet for each dominant axis.
void add_rays(const LatticeBeam& beam, int row, int first_column, int count, std::vector<Rays>& out) {
  std::array<Vec3, kRays> directions;
  std::array<int, kRays> axes{};
  bool any[3] = {false, false, false};
  for (int i = 0; i < count; ++i) {
    const auto lane = static_cast<std::size_t>(i);
    directions[lane] = beam.first + (first_column + i) * beam.column + row * beam.row - beam.source;
    axes[lane] = dominant_axis(directions[lane]);
    any[axes[lane]] = true;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!any[axis]) continue;
    Rays& rays = out.emplace_back();
    rays.axis = axis;
    rays.row = row;
    rays.column.fill(-1);
    std::size_t nearest = 0;
    while (axes[nearest] != axis) ++nearest;
    set_ray(rays, nearest, beam, directions[nearest]);
    for (std::size_t lane = 0; lane < kRays; ++lane) {
      if (static_cast<int>(lane) < count && axes[lane] == axis) {
        nearest = lane;
        rays.column[lane] = first_column + static_cast<int>(lane);
        set_ray(rays, lane, beam, directions[lane]);
      } else {
        repeat_ray(rays.packet, nearest, lane);
      }
    }
  }
}

// Cells that positions may lie in, as bricks.
struct BrickRange {
  int first_u, last_u, first_v, last_v;
};

struct Range {
  float low = 1e30f, high = -1e30f;
  void include(float x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
  [[nodiscard]] int first() const { return cell(low - kMargin) / kLayer; }
  [[nodiscard]] int last(int bricks) const {
    return high + kMargin < 0.0f ? -1 : std::min(cell(high + kMargin) / kLayer, bricks - 1);
  }
  static int cell(float at) { return static_cast<int>(std::clamp(at, 0.0f, 1e6f)); }
};

// Whether any brick of a layer is occupied where some rays pass. The rays between the given ones pass between them,
// because the image of a plane is a projection of it.
class Bricks {
 public:
  Bricks(const HuLattice& lattice, int axis) : occupied_(lattice.occupied) {
    const int nz = lattice.bricks.z, plane = lattice.bricks.y * nz;
    stride_ = axis == 0 ? plane : axis == 1 ? nz : 1;
    u_ = axis == 0 ? nz : plane;
    v_ = axis == 2 ? nz : 1;
    bricks_u_ = axis == 0 ? lattice.bricks.y : lattice.bricks.x;
    bricks_v_ = axis == 2 ? lattice.bricks.y : lattice.bricks.z;
    layers_ = axis == 0 ? lattice.bricks.x : axis == 1 ? lattice.bricks.y : lattice.bricks.z;
  }
  [[nodiscard]] int layers() const { return layers_; }

  struct Corner {
    float u, du, v, dv;
  };
  [[nodiscard]] bool any(int layer, std::span<const Corner> corners) const {
    Range u, v;
    for (const Corner& c : corners)
      for (const int plane : {layer * kLayer, layer * kLayer + kLayer - 1}) {
        const auto at = static_cast<float>(plane);
        u.include(c.u + at * c.du);
        v.include(c.v + at * c.dv);
      }
    const std::uint8_t* of_layer = occupied_ + layer * stride_;
    for (int i = u.first(); i <= u.last(bricks_u_); ++i)
      for (int j = v.first(); j <= v.last(bricks_v_); ++j)
        if (of_layer[i * u_ + j * v_] != 0) return true;
    return false;
  }

 private:
  const std::uint8_t* occupied_;
  int stride_, u_, v_, bricks_u_, bricks_v_, layers_;
};

Bricks::Corner corner_of(const RayPacket& p, std::size_t lane) {
  return {p.u[lane], p.du[lane], p.v[lane], p.dv[lane]};
}

void cast_rays(const HuLattice& lattice, std::span<Rays> rays, bool one_axis, int packets_a_row,
               Projection projection) {
  const auto add = projection == Projection::most ? most_of_planes : add_planes;
  const int planes[3] = {lattice.dims.x, lattice.dims.y, lattice.dims.z};
  for (int axis = 0; axis < 3; ++axis) {
    if (std::ranges::none_of(rays, [&](const Rays& r) { return r.axis == axis; })) continue;
    const Bricks bricks(lattice, axis);
    const auto in_row = static_cast<std::size_t>(packets_a_row), count = rays.size();
    // The corners of the tile.
    std::array<Bricks::Corner, 4> corners{};
    if (one_axis)
      corners = {corner_of(rays.front().packet, 0), corner_of(rays[in_row - 1].packet, kRays - 1),
                 corner_of(rays[count - in_row].packet, 0), corner_of(rays.back().packet, kRays - 1)};
    for (int layer = 0; layer < bricks.layers(); ++layer) {
      if (one_axis && !bricks.any(layer, corners)) continue;
      const int first = layer * kLayer, last = std::min(first + kLayer, planes[axis]) - 1;
      for (Rays& r : rays) {
        if (r.axis != axis) continue;
        const std::array<Bricks::Corner, 2> ends{corner_of(r.packet, 0), corner_of(r.packet, kRays - 1)};
        if (bricks.any(layer, ends)) add(lattice, axis, first, last, r.packet, r.sums);
      }
    }
  }
}

bool merge_once(std::vector<PixelBox>& boxes) {
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size(); ++j) {
      if (!boxes[i].meets(boxes[j])) continue;
      boxes[i] = {std::min(boxes[i].first_column, boxes[j].first_column),
                  std::min(boxes[i].first_row, boxes[j].first_row),
                  std::max(boxes[i].last_column, boxes[j].last_column), std::max(boxes[i].last_row, boxes[j].last_row)};
      boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(j));
      return true;
    }
  return false;
}

}  // namespace

Radiograph::Radiograph(const ConeBeam& beam, Projection projection) : beam_(beam), projection_(projection) {
  OSTEON_CHECK(beam.detector.columns > 0 && beam.detector.rows > 0);
  values_.resize(beam.detector.count());
}

std::span<const float> Radiograph::attenuation() const {
  OSTEON_CHECK(projection_ == Projection::attenuation);
  return values_;
}

void Radiograph::cast(const BoneHu& bone) { cast_box(bone, beam_.detector.whole()); }

std::vector<PixelBox> Radiograph::recast(const BoneHu& bone, std::span<const CoordBox> changed) {
  std::vector<PixelBox> boxes;
  for (const CoordBox& box : changed) {
    // A sample counts up to the samples beside it.
    const CoordBox reached = box.grown(1);
    const PixelBox shadow =
        shadow_of({position_mm(reached.min, bone.pitch_mm()), position_mm(reached.max, bone.pitch_mm())}, beam_);
    if (!shadow.empty()) boxes.push_back(shadow);
  }
  while (merge_once(boxes)) {
  }
  for (const PixelBox& box : boxes) cast_box(bone, box);
  return boxes;
}

void Radiograph::cast_box(const BoneHu& bone, const PixelBox& box) {
  if (box.empty()) return;
  const HuLattice lattice = bone.lattice();
  const double pitch = bone.pitch_mm();
  const LatticeBeam beam{bone.in_lattice(beam_.source_mm), bone.in_lattice(beam_.detector.first_mm),
                         beam_.detector.column_mm / pitch, beam_.detector.row_mm / pitch, pitch};
  const auto cast_tile = [&](int tile_row, int tile_column) {
    static thread_local std::vector<Rays> rays;
    rays.clear();
    const int last_row = std::min(tile_row + kTileRows - 1, box.last_row);
    const int last_column = std::min(tile_column + kTileColumns - 1, box.last_column);
    const int packets = (last_column - tile_column) / kRays + 1;
    for (int row = tile_row; row <= last_row; ++row)
      for (int column = tile_column; column <= last_column; column += kRays)
        add_rays(beam, row, column, std::min(kRays, last_column - column + 1), rays);
    const bool one_axis = std::ranges::all_of(rays, [&](const Rays& r) { return r.axis == rays.front().axis; });
    cast_rays(lattice, rays, one_axis, packets, projection_);
    for (const Rays& r : rays)
      for (std::size_t lane = 0; lane < kRays; ++lane)
        if (r.column[lane] >= 0)
          values_[beam_.detector.index(r.column[lane], r.row)] =
              projection_ == Projection::most
                  ? hu_of_steps(r.sums[lane])
                  : static_cast<float>(static_cast<double>(r.sums[lane]) * r.mm[lane] * kStep_per_mm);
  };
  const int tile_rows = (box.last_row - box.first_row) / kTileRows + 1;
  const auto cast_rows = [&](int first, int last) {
    for (int i = first; i < last; ++i)
      for (int column = box.first_column; column <= box.last_column; column += kTileColumns)
        cast_tile(box.first_row + i * kTileRows, column);
  };
  if (tile_rows > 1 && kMayCastOnThreads)
    // Isolated, because a thread that waits here must not take other work, which may be long.
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(tbb::blocked_range<int>(0, tile_rows),
                        [&](const tbb::blocked_range<int>& part) { cast_rows(part.begin(), part.end()); });
    });
  else
    cast_rows(0, tile_rows);
}

}  // namespace osteon::radiology
