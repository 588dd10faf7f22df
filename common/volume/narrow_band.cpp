#include "common/volume/narrow_band.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bitset>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <exception>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "common/core/check.hpp"
#include "common/core/mutex.hpp"
#include "common/core/thread_annotations.hpp"
#include "common/geometry/triangle_distance.hpp"
#include "common/geometry/triangle_distances.hpp"

// The surface is meshed by dual contouring in its simplest form. Every cell with a crossing has one point, the mean of
// the crossings on its edges. Every crossed lattice edge has a quad between the points of the four cells around it
// (Gibson 1998). Only samples of the narrow band get a distance. Samples nearer than a voxel test every triangle beside
// them. The others get the nearest surface point from their neighbours, layer by layer outwards, and then test the
// triangles around it. Of two sheets they may choose the wrong one if a facet is nearer than its corners (2 samples of
// 1000 of a skull are more than 0.01 voxel off by that). OpenVDB's meshToVolume was tried first; it was up to 0.6 voxel
// wrong at the end of the band and slower. Every loop is bounded.
//
// All triangles of a quad lie within its four cells, and all of these have a point. So a sample that is n layers away
// from the corners of cells with a point is at least n voxels away from the surface, and kBand - 1 layers are enough.
namespace osteon {
namespace {

using Vec3f = Eigen::Vector3f;

constexpr int kBand = 4;         // voxels; the distance is clipped to this
constexpr int kMargin = 6;       // voxels around a slab that can contain the surface nearest to a sample of the slab
constexpr int kSlab = 40;        // voxels along x that one thread processes
constexpr int kMostThreads = 4;  // each has a slab in memory
constexpr int kMostSteps = 16;   // of a walk over the mesh, which usually takes one or two
constexpr std::size_t kMostTriangles = 700'000'000;  // of a slab, because three corners of each are counted in 32 bits
constexpr float kFarthest = (kBand + 2) * (kBand + 2);  // squared distance of a surface point that matters
constexpr std::int32_t kNone = -1;
constexpr std::int32_t kTile = kLeafSize, kTileSamples = kLeafVoxels;

// iso − field, so negative inside. Never zero, so that every sample has a side.
float depth(float value, float iso) {
  const float d = iso - value;
  return d == 0.0f ? -1e-3f : d;
}

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

// A sample of a slab is named by its tile, a leaf of the lattice, and its place within: kTileSamples · tile + place.
// Tiles around a tile are numbered from 0 to 26, x slowest; 13 is the tile itself.
struct Beside {
  std::int32_t tile;   // number of the tile around
  std::int32_t place;  // within that tile
};

constexpr Beside beside(int x, int y, int z) {
  const auto step = [](int c) { return c < 0 ? 0 : c < kTile ? 1 : 2; };
  const auto within = [](int c) { return (c + kTile) % kTile; };
  return {9 * step(x) + 3 * step(y) + step(z), (within(x) * kTile + within(y)) * kTile + within(z)};
}

// For every row of a tile along z, the 9 rows around it, x slowest: the first sample of each.
using RowsAround = std::array<std::array<Beside, 9>, kTile * kTile>;
constexpr RowsAround rows_around() {
  RowsAround rows{};
  for (int x = 0; x < kTile; ++x)
    for (int y = 0; y < kTile; ++y)
      for (int i = 0; i < 9; ++i)
        rows[static_cast<std::size_t>(x * kTile + y)][static_cast<std::size_t>(i)] =
            beside(x + i / 3 - 1, y + i % 3 - 1, 0);
  return rows;
}
constexpr RowsAround kRowsAround = rows_around();

CoordBox meeting(const CoordBox& a, const CoordBox& b) {
  return {{std::max(a.min.x, b.min.x), std::max(a.min.y, b.min.y), std::max(a.min.z, b.min.z)},
          {std::min(a.max.x, b.max.x), std::min(a.max.y, b.max.y), std::min(a.max.z, b.max.z)}};
}

CoordBox leaf_box(Coord origin) { return {origin, origin + Coord{kTile - 1, kTile - 1, kTile - 1}}; }

// One slab of samples with its margin. Positions are in voxels from the margin's corner.
class Slab {
 public:
  Slab(const SampledField& field, float iso, const std::atomic<bool>& stopped)
      : field_(field), iso_(iso), stopped_(stopped) {}

  // Measures the samples of `core`, all of the field's box between two planes normal to x. The memory of an earlier
  // slab is reused.
  void measure(const CoordBox& core) {
    core_ = core;
    region_ = core.grown(kMargin);
    size_ = region_.dims();
    OSTEON_CHECK(static_cast<double>(size_.x) * size_.y * size_.z < std::numeric_limits<std::int32_t>::max());
    first_ = floor_to(region_.min, kTile);
    const Coord last = floor_to(region_.max, kTile);
    tiles_ = shift_down(last - first_, 3) + Coord{1, 1, 1};
    find_points();
    if (stopped_) return;
    add_tiles_of_band();
    quads();
    seed();
    spread();
    triangles_around_points();
    refine_all();
  }

  // Calls `write` for every leaf that meets the core, with the distances of its samples there: mm, z fastest.
  template <class Write>
  void each_leaf(double pitch_mm, Write write) const {
    const auto band = static_cast<float>(kBand * pitch_mm);
    std::vector<float> values;
    for (std::int32_t n = 0; n < static_cast<std::int32_t>(slots_.size()); ++n) {
      const Coord origin = origin_of(n);
      const CoordBox part = meeting(core_, leaf_box(origin));
      if (part.empty()) continue;
      values.clear();
      const std::int32_t slot = slots_[at(n)];
      for (int x = part.min.x; x <= part.max.x; ++x)
        for (int y = part.min.y; y <= part.max.y; ++y)
          for (int z = part.min.z; z <= part.max.z; ++z) {
            if (slot == kNone) {
              values.push_back(inside_[at(n)] ? -band : band);
              continue;
            }
            const std::int32_t place = ((x - origin.x) * kTile + y - origin.y) * kTile + z - origin.z;
            const float mm = distance_mm(slot * kTileSamples + place, pitch_mm, band);
            values.push_back(signs_[at(slot)][at(place)] ? -mm : mm);
          }
      write(origin, part, values);
    }
  }

 private:
  struct Cell {
    std::int32_t order;  // of its lowest corner in memory, z fastest
    std::int32_t sample;
    std::uint8_t crossed;  // bit for each axis along which the edge from the lowest corner is crossed
    Vec3f point;
  };

  [[nodiscard]] std::int32_t tile_index(Coord tile) const { return (tile.x * tiles_.y + tile.y) * tiles_.z + tile.z; }
  [[nodiscard]] Coord origin_of(std::int32_t tile) const {
    return first_ + kTile * Coord{tile / (tiles_.y * tiles_.z), tile / tiles_.z % tiles_.y, tile % tiles_.z};
  }
  [[nodiscard]] Coord clamped(Coord c) const {
    const CoordBox& box = field_.box;
    return {std::clamp(c.x, box.min.x, box.max.x), std::clamp(c.y, box.min.y, box.max.y),
            std::clamp(c.z, box.min.z, box.max.z)};
  }

  // Gives a tile memory for its samples. Those beyond the region are never visited.
  std::int32_t add_slot(std::int32_t tile) {
    std::int32_t& slot = slots_[at(tile)];
    if (slot != kNone) return slot;
    slot = static_cast<std::int32_t>(tile_of_slot_.size());
    OSTEON_CHECK(slot < std::numeric_limits<std::int32_t>::max() / kTileSamples);
    tile_of_slot_.push_back(tile);
    signs_.emplace_back();
    if (inside_[at(tile)]) signs_.back().set();
    return slot;
  }

  // Finds the cells in which the field crosses the value, each named by its lowest corner, and gives each a point. Only
  // tiles that the surface may cross are read, with the first samples beyond them.
  void find_points() {
    cells_.clear();
    points_.clear();
    signs_.clear();
    tile_of_slot_.clear();
    const std::size_t count = at(tiles_.x) * at(tiles_.y) * at(tiles_.z);
    slots_.assign(count, kNone);
    inside_.assign(count, false);
    for (std::int32_t n = 0; n < static_cast<std::int32_t>(count); ++n) {
      if (stopped_) return;
      const Coord origin = origin_of(n);
      const CoordBox part = meeting(region_, {origin, origin + Coord{kTile, kTile, kTile}});
      const CoordBox read{clamped(part.min), clamped(part.max)};
      const Inside found = field_.inside(read);
      inside_[at(n)] = found == Inside::all;
      if (found == Inside::some) read_tile(n, origin, part, read);
    }
    // In memory order, so that the result does not depend on tiles.
    std::ranges::sort(cells_, {}, &Cell::order);
    for (const Cell& cell : cells_) points_.push_back(cell.point);
  }

  void read_tile(std::int32_t tile, Coord origin, const CoordBox& part, const CoordBox& read) {
    // Beyond its box the field continues with its values at the box's edge.
    const Coord d = part.dims(), from = read.dims();
    read_.resize(at(from.x) * at(from.y) * at(from.z));
    field_.read(read, read_);
    values_.resize(at(d.x) * at(d.y) * at(d.z));
    std::size_t to = 0;
    for (int x = part.min.x; x <= part.max.x; ++x)
      for (int y = part.min.y; y <= part.max.y; ++y) {
        const Coord start = clamped({x, y, part.min.z}) - read.min;
        const float* row = &read_[at((start.x * from.y + start.y) * from.z)];
        for (int z = part.min.z; z <= part.max.z; ++z)
          values_[to++] = depth(row[std::clamp(z, read.min.z, read.max.z) - read.min.z], iso_);
      }
    const auto inside = [](float v) { return v < 0; };
    if (std::ranges::none_of(values_, inside)) return;
    if (std::ranges::all_of(values_, inside)) {
      inside_[at(tile)] = true;
      return;
    }
    const std::int32_t slot = add_slot(tile);
    for (int x = 0; x < std::min(d.x, kTile - (part.min.x - origin.x)); ++x)
      for (int y = 0; y < std::min(d.y, kTile - (part.min.y - origin.y)); ++y) {
        const Coord in = part.min + Coord{x, y, 0} - origin;
        const std::int32_t place = (in.x * kTile + in.y) * kTile + in.z;
        const float* line[4];
        for (int c = 0; c < 4; ++c)
          line[c] = &values_[at((std::min(x + (c & 1), d.x - 1) * d.y + std::min(y + (c >> 1), d.y - 1)) * d.z)];
        const bool cells = x + 1 < d.x && y + 1 < d.y;
        for (int z = 0; z < std::min(d.z, kTile - in.z); ++z) {
          if (line[0][z] < 0) signs_[at(slot)].set(at(place + z));
          if (cells && z + 1 < d.z)
            add_point(part.min + Coord{x, y, z} - region_.min, slot * kTileSamples + place + z, line, z);
        }
      }
  }

  void add_point(Coord place, std::int32_t sample, const float* const* line, int z) {
    float corner[8];
    int inside = 0;
    for (int c = 0; c < 8; ++c) {
      corner[c] = line[c & 3][z + (c >> 2)];
      inside += corner[c] < 0 ? 1 : 0;
    }
    if (inside == 0 || inside == 8) return;
    Vec3f sum = Vec3f::Zero();
    int crossings = 0;
    std::uint8_t crossed = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int c = 0; c < 8; ++c) {
        const int end = c | 1 << axis;
        if (end == c || (corner[c] < 0) == (corner[end] < 0)) continue;
        if (c == 0) crossed = static_cast<std::uint8_t>(crossed | 1 << axis);
        Vec3f crossing(static_cast<float>(c & 1), static_cast<float>(c >> 1 & 1), static_cast<float>(c >> 2));
        crossing[axis] = corner[c] / (corner[c] - corner[end]);
        sum += crossing;
        ++crossings;
      }
    const Vec3f point = Vec3f(static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z)) +
                        sum / static_cast<float>(crossings);
    cells_.push_back({(place.x * size_.y + place.y) * size_.z + place.z, sample, crossed, point});
  }

  // Gives memory to all tiles that the band may reach.
  void add_tiles_of_band() {
    const auto crossed = static_cast<std::int32_t>(tile_of_slot_.size());
    std::vector<CoordBox> reach(at(crossed), CoordBox{{kTile, kTile, kTile}, {-1, -1, -1}});
    for (const Cell& cell : cells_) {
      CoordBox& box = reach[at(cell.sample / kTileSamples)];
      const std::int32_t place = cell.sample % kTileSamples;
      const Coord c{place / 64, place / 8 % 8, place % 8};
      box.min = {std::min(box.min.x, c.x), std::min(box.min.y, c.y), std::min(box.min.z, c.z)};
      box.max = {std::max(box.max.x, c.x), std::max(box.max.y, c.y), std::max(box.max.z, c.z)};
    }
    for (std::int32_t slot = 0; slot < crossed; ++slot) {
      const CoordBox& cells = reach[at(slot)];
      if (cells.empty()) continue;
      const Coord origin = origin_of(tile_of_slot_[at(slot)]) - first_;
      // One more than a cell's far corner, because rounding may put a point onto it.
      const Coord low = shift_down(origin + cells.min - Coord{kBand, kBand, kBand}, 3),
                  high = shift_down(origin + cells.max + Coord{kBand + 1, kBand + 1, kBand + 1}, 3);
      for (int x = std::max(0, low.x); x <= std::min(tiles_.x - 1, high.x); ++x)
        for (int y = std::max(0, low.y); y <= std::min(tiles_.y - 1, high.y); ++y)
          for (int z = std::max(0, low.z); z <= std::min(tiles_.z - 1, high.z); ++z) add_slot(tile_index({x, y, z}));
    }
    const auto slots = tile_of_slot_.size();
    corners_.resize(slots);
    around_tile_.resize(slots);
    waiting_.assign(slots * kTileSamples, 0);
    for (std::size_t slot = 0; slot < slots; ++slot) {
      const std::int32_t tile = tile_of_slot_[slot];
      const Coord origin = origin_of(tile), place = shift_down(origin - first_, 3);
      corners_[slot] = origin - region_.min;
      for (int i = 0; i < 27; ++i) {
        const Coord c = place + Coord{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1};
        const bool there = c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x < tiles_.x && c.y < tiles_.y && c.z < tiles_.z;
        around_tile_[slot][at(i)] = there ? slots_[at(tile_index(c))] : kNone;
      }
      const CoordBox whole = leaf_box(origin);
      if (meeting(region_, whole) == whole) continue;
      for (std::int32_t i = 0; i < kTileSamples; ++i)
        if (!region_.contains(origin + Coord{i / 64, i / 8 % 8, i % 8})) waiting_[slot * kTileSamples + at(i)] = 1;
    }
  }

  [[nodiscard]] Vec3f position(std::int32_t sample) const {
    const Coord& corner = corners_[at(sample / kTileSamples)];
    const std::int32_t place = sample % kTileSamples;
    return {static_cast<float>(corner.x + place / 64), static_cast<float>(corner.y + place / 8 % 8),
            static_cast<float>(corner.z + place % 8)};
  }
  // The sample one or no step away along each axis; kNone without memory.
  [[nodiscard]] std::int32_t step(std::int32_t sample, int x, int y, int z) const {
    const std::int32_t place = sample % kTileSamples;
    const Beside to = beside(place / 64 + x, place / 8 % 8 + y, place % 8 + z);
    const std::int32_t slot = around_tile_[at(sample / kTileSamples)][to.tile];
    return slot == kNone ? kNone : slot * kTileSamples + to.place;
  }

  // A crossed lattice edge starts at the lowest corner of a cell with a point, so only those cells are checked.
  void quads() {
    triangles_.clear();
    nearest_point_.assign(waiting_.size(), kNone);
    for (std::size_t n = 0; n < cells_.size(); ++n) nearest_point_[at(cells_[n].sample)] = static_cast<std::int32_t>(n);
    for (const Cell& cell : cells_) {
      if (triangles_.size() > kMostTriangles)
        throw std::length_error("it has too many triangles; choose a larger --pitch");
      const std::int32_t row = cell.order / size_.z;
      const int x = row / size_.y, y = row % size_.y, z = cell.order % size_.z;
      if (x == 0 || y == 0 || z == 0) continue;  // the cells around the edge are beyond the margin
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if ((cell.crossed >> axis & 1) == 0) continue;
        const auto point = [&](int back_u, int back_v) {
          std::array<int, 3> back{};
          back[(axis + 1) % 3] = -back_u;
          back[(axis + 2) % 3] = -back_v;
          return nearest_point_[at(step(cell.sample, back[0], back[1], back[2]))];
        };
        const std::int32_t a = point(1, 1), b = point(0, 1), c = point(0, 0), d = point(1, 0);
        triangles_.push_back({a, b, c});
        triangles_.push_back({a, c, d});
      }
    }
  }

  [[nodiscard]] TriangleDistance<float> distance(std::int32_t triangle, const Vec3f& p) const {
    const auto& t = triangles_[at(triangle)];
    return distance_to_triangle<float>(p, points_[at(t[0])], points_[at(t[1])], points_[at(t[2])]);
  }

  // Up to eight triangles, each offered to a sample.
  struct Offers {
    std::size_t count = 0;
    std::array<std::int32_t, Points8::kCount> triangles{}, samples{};
    Points8 positions;  // of the samples
  };

  // Offers a triangle to a sample, which stores the nearest one. Eight offers are worked out at once.
  void offer(std::int32_t triangle, std::int32_t sample, const Vec3f& p) {
    const std::size_t n = offers_.count++;
    offers_.triangles[n] = triangle;
    offers_.samples[n] = sample;
    offers_.positions.set(n, p);
    if (offers_.count == offers_.triangles.size()) take_offers();
  }

  void take_offers() {
    const std::size_t count = offers_.count;
    if (count == 0) return;
    offers_.count = 0;
    std::array<Points8, 3> corners;  // lanes without an offer keep what they had
    for (std::size_t n = 0; n < count; ++n)
      for (std::size_t c = 0; c < 3; ++c) corners[c].set(n, points_[at(triangles_[at(offers_.triangles[n])][c])]);
    const auto squared = squared_distances_to_triangles(offers_.positions, corners[0], corners[1], corners[2]);
    for (std::size_t n = 0; n < count; ++n) {
      float& best = squared_[at(offers_.samples[n])];
      std::int32_t& nearest = nearest_[at(offers_.samples[n])];
      if (nearest != kNone && !(squared[n] < best)) continue;
      best = squared[n];
      nearest = offers_.triangles[n];
    }
  }

  // Offers every triangle to the samples directly around it. Samples nearer than a voxel need no more.
  void seed() {
    nearest_.assign(waiting_.size(), kNone);
    squared_.resize(waiting_.size());
    const Coord shift = region_.min - first_;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if ((t & 0xffff) == 0 && stopped_) return;
      const Vec3f &a = points_[at(triangles_[t][0])], &b = points_[at(triangles_[t][1])],
                  &c = points_[at(triangles_[t][2])];
      const Vec3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
      // Only samples of the core get a distance.
      const auto begin = [](float least) { return std::max(kMargin, static_cast<int>(least)); };
      const auto end = [](float most, int size) { return std::min(size - kMargin - 1, static_cast<int>(most) + 1); };
      const int x_end = end(high.x(), size_.x), y_end = end(high.y(), size_.y), z_end = end(high.z(), size_.z);
      for (int x = begin(low.x()); x <= x_end; ++x)
        for (int y = begin(low.y()); y <= y_end; ++y)
          for (int z = begin(low.z()); z <= z_end; ++z) {
            const Coord c_in = Coord{x, y, z} + shift;
            const std::int32_t slot = slots_[at(tile_index(shift_down(c_in, 3)))];
            const std::int32_t place = ((c_in.x & 7) * kTile + (c_in.y & 7)) * kTile + (c_in.z & 7);
            offer(static_cast<std::int32_t>(t), slot * kTileSamples + place,
                  Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)));
          }
    }
    take_offers();
  }

  // Calls `visit` for a sample and each of its up to 26 neighbours that have memory.
  template <class Visit>
  void each_neighbour(std::int32_t sample, Visit visit) const {
    const std::array<std::int32_t, 27>& tiles = around_tile_[at(sample / kTileSamples)];
    const std::int32_t z = sample % kTile;
    for (const Beside& row : kRowsAround[at(sample % kTileSamples / kTile)]) {
      const std::int32_t* tile = &tiles[at(row.tile)];
      if (z > 0 && z + 1 < kTile) {
        if (*tile == kNone) continue;
        const std::int32_t middle = *tile * kTileSamples + row.place + z;
        visit(middle - 1);
        visit(middle);
        visit(middle + 1);
        continue;
      }
      const std::int32_t below = z > 0 ? tile[0] : tile[-1], above = z + 1 < kTile ? tile[0] : tile[1];
      if (below != kNone) visit(below * kTileSamples + row.place + (z + kTile - 1) % kTile);
      if (*tile != kNone) visit(*tile * kTileSamples + row.place + z);
      if (above != kNone) visit(above * kTileSamples + row.place + (z + 1) % kTile);
    }
  }

  // Offers a surface point to a sample, which stores the nearest one within the band.
  void offer_point(std::int32_t point, std::int32_t sample, const Vec3f& p) {
    const float squared = (points_[at(point)] - p).squaredNorm();
    std::int32_t& nearest = nearest_point_[at(sample)];
    const float limit = nearest == kNone ? kFarthest : (points_[at(nearest)] - p).squaredNorm();
    if (squared < limit) nearest = point;
  }

  // Finds the nearest surface point for every sample of the band. It starts at the corners of the points' cells. Then
  // it adds one layer of samples after the other. Each sample tests once the points of its neighbours.
  void spread() {
    nearest_point_.assign(waiting_.size(), kNone);
    layer_.clear();
    for (std::size_t n = 0; n < cells_.size(); ++n)
      for (int c = 0; c < 8; ++c) {
        const std::int32_t corner = step(cells_[n].sample, c & 1, c >> 1 & 1, c >> 2);
        offer_point(static_cast<std::int32_t>(n), corner, position(corner));
        if (waiting_[at(corner)] != 0) continue;
        waiting_[at(corner)] = 1;
        layer_.push_back(corner);
      }
    for (const std::int32_t i : layer_) look_around(i);
    for (int layers = 1; layers < kBand && !stopped_; ++layers) {
      next_layer_.clear();
      for (const std::int32_t i : layer_) add_neighbours(i);
      for (const std::int32_t j : next_layer_) look_around(j);
      std::swap(layer_, next_layer_);
      std::erase_if(layer_, [&](std::int32_t j) { return nearest_point_[at(j)] == kNone; });
    }
  }

  // Adds the neighbours that are in no layer yet to the next one.
  void add_neighbours(std::int32_t sample) {
    std::array<std::int32_t, 28> added;
    std::size_t count = 0;
    each_neighbour(sample, [&](std::int32_t j) {
      added[count] = j;
      count += waiting_[at(j)] == 0 ? 1 : 0;
      waiting_[at(j)] = 1;
    });
    next_layer_.insert(next_layer_.end(), added.begin(), added.begin() + count);
  }

  void look_around(std::int32_t sample) {
    // Few branches, because a processor would often guess them wrongly.
    std::array<std::int32_t, 28> points;
    std::size_t count = 0;
    std::int32_t& nearest = nearest_point_[at(sample)];
    std::int32_t last = nearest, earlier = nearest;
    each_neighbour(sample, [&](std::int32_t j) {
      const std::int32_t point = nearest_point_[at(j)];
      const bool is_new = (point != kNone) & (point != last) & (point != earlier);
      points[count] = point;
      count += is_new ? 1 : 0;
      earlier = is_new ? last : earlier;
      last = is_new ? point : last;
    });
    const Vec3f p = position(sample);
    float limit = nearest == kNone ? kFarthest : (points_[at(nearest)] - p).squaredNorm();
    for (std::size_t n = 0; n < count; ++n) {
      const float squared = (points_[at(points[n])] - p).squaredNorm();
      const bool is_nearer = squared < limit;
      nearest = is_nearer ? points[n] : nearest;
      limit = is_nearer ? squared : limit;
    }
  }

  // For each point, the triangles that contain it, one list after the other.
  void triangles_around_points() {
    around_begin_.assign(points_.size() + 1, 0);
    for (const auto& t : triangles_)
      for (const std::int32_t p : t) ++around_begin_[at(p) + 1];
    for (std::size_t p = 0; p < points_.size(); ++p) around_begin_[p + 1] += around_begin_[p];
    around_.resize(3 * triangles_.size());
    std::vector<std::int32_t> fill(around_begin_.begin(), around_begin_.end() - 1);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (const std::int32_t p : triangles_[t]) around_[at(fill[at(p)]++)] = static_cast<std::int32_t>(t);
  }

  // Offers the triangles around a surface point to a sample.
  void offer_around(std::int32_t point, std::int32_t sample, const Vec3f& p) {
    for (std::int32_t n = around_begin_[at(point)]; n < around_begin_[at(point) + 1]; ++n) {
      std::int32_t& offered = offered_to_[at(around_[at(n)])];
      if (offered == sample) continue;
      offered = sample;
      offer(around_[at(n)], sample, p);
    }
  }

  // From the nearest point to the nearest triangle. It tests the triangles around the point. Then it walks over the
  // mesh, around the corners of the nearest part of the triangle, while that finds a nearer one.
  void refine(std::int32_t sample) {
    const Vec3f p = position(sample);
    std::int32_t known = nearest_point_[at(sample)];
    offer_around(known, sample, p);
    take_offers();
    for (int steps = 0; steps < kMostSteps; ++steps) {
      const std::int32_t triangle = nearest_[at(sample)];
      if (triangle == kNone) return;
      const unsigned corners = steps == 0 ? 7u : distance(triangle, p).corners;
      for (std::size_t c = 0; c < 3; ++c)
        if (const std::int32_t point = triangles_[at(triangle)][c]; (corners >> c & 1u) != 0 && point != known)
          offer_around(point, sample, p);
      take_offers();
      if (nearest_[at(sample)] == triangle) return;
      known = kNone;
    }
  }

  // Magnitude, at most the band.
  [[nodiscard]] float distance_mm(std::int32_t sample, double pitch_mm, float band) const {
    if (nearest_point_[at(sample)] == kNone || nearest_[at(sample)] == kNone) return band;
    return std::min(band, static_cast<float>(std::sqrt(static_cast<double>(squared_[at(sample)])) * pitch_mm));
  }

  void refine_all() {
    offered_to_.assign(triangles_.size(), kNone);
    for (std::size_t slot = 0; slot < tile_of_slot_.size() && !stopped_; ++slot) {
      const Coord origin = origin_of(tile_of_slot_[slot]);
      for (std::int32_t place = 0; place < kTileSamples; ++place) {
        const std::int32_t i = static_cast<std::int32_t>(slot) * kTileSamples + place;
        if (nearest_point_[at(i)] == kNone || (nearest_[at(i)] != kNone && squared_[at(i)] < 1.0f)) continue;
        if (core_.contains(origin + Coord{place / 64, place / 8 % 8, place % 8})) refine(i);
      }
    }
  }

  const SampledField& field_;
  float iso_;
  const std::atomic<bool>& stopped_;
  CoordBox core_, region_;           // in samples of the field
  Coord size_, first_;               // of the region; first sample of its first tile
  Coord tiles_;                      // number of tiles along each axis
  std::vector<bool> inside_;         // of tiles without memory: the side of all their samples
  std::vector<std::int32_t> slots_;  // memory of each tile, or kNone
  std::vector<std::int32_t> tile_of_slot_;
  std::vector<std::bitset<kTileSamples>> signs_;           // of each slot: 1 inside
  std::vector<Coord> corners_;                             // of each slot, from the region's corner
  std::vector<std::array<std::int32_t, 27>> around_tile_;  // slots around each slot
  std::vector<float> read_, values_;                       // of one tile
  std::vector<Cell> cells_;                                // cells with a point, in memory order
  std::vector<Vec3f> points_;                              // of the cells
  std::vector<std::array<std::int32_t, 3>> triangles_;
  Offers offers_;
  // The nearest point of each sample. Earlier, while the surface is meshed, the point of each cell.
  std::vector<std::int32_t> nearest_point_;
  std::vector<std::int32_t> nearest_;  // nearest triangle of each sample
  std::vector<float> squared_;         // the distance to it, voxels²; undefined without a triangle
  std::vector<std::int32_t> layer_, next_layer_;
  std::vector<std::uint8_t> waiting_;  // 1: the sample was already in a layer, or is beyond the region
  std::vector<std::int32_t> around_begin_, around_;
  std::vector<std::int32_t> offered_to_;  // the last sample to which each triangle was offered by refine()
};

// What a slab found in a leaf: the distances of the leaf's samples in `part`, mm, z fastest.
struct LeafPart {
  Coord origin;
  CoordBox part;
  std::vector<float> values;
};

bool all_are(std::span<const float> values, float value) {
  return std::ranges::all_of(values, [value](float v) { return v == value; });
}

// The leaves of a slab that are not wholly outside the band. `box`: of the field.
std::vector<LeafPart> leaves_of(const Slab& slab, const CoordBox& box, double pitch_mm, float band) {
  std::vector<LeafPart> leaves;
  slab.each_leaf(pitch_mm, [&](Coord origin, const CoordBox& part, std::span<const float> values) {
    if (part == meeting(box, leaf_box(origin)) && all_are(values, band)) return;
    leaves.push_back({origin, part, {values.begin(), values.end()}});
  });
  return leaves;
}

// Puts a slab's part of a leaf into the result. A leaf that two slabs share stays a leaf here.
void put(const LeafPart& found, const CoordBox& box, SparseVolume& band) {
  const auto& [origin, part, values] = found;
  if (part == meeting(box, leaf_box(origin)) && all_are(values, -band.background())) {
    band.set_constant(origin, -band.background());
    return;
  }
  float* leaf = band.edit_leaf(origin);
  std::size_t n = 0;
  for (int x = part.min.x; x <= part.max.x; ++x)
    for (int y = part.min.y; y <= part.max.y; ++y)
      for (int z = part.min.z; z <= part.max.z; ++z)
        leaf[((x - origin.x) * kTile + y - origin.y) * kTile + z - origin.z] = values[n++];
}

// Two slabs may have filled a leaf in which no sample is in the band.
void make_constants(const CoordBox& box, SparseVolume& band) {
  const float outside = band.background();
  std::vector<float> values;
  for (const Coord origin : band.leaves()) {
    const CoordBox part = meeting(box, leaf_box(origin));
    const Coord d = part.dims();
    values.resize(at(d.x) * at(d.y) * at(d.z));
    band.gather(part, values);
    if (std::abs(values[0]) == outside && all_are(values, values[0])) band.set_constant(origin, values[0]);
  }
}

// Slabs of the field's box. They are independent, and one thread processes each in a fixed order, so the result does
// not depend on the threads.
class Slabs {
 public:
  Slabs(const SampledField& field, float iso, double pitch_mm)
      : field_(field), iso_(iso), pitch_mm_(pitch_mm), count_((field.box.dims().x + kSlab - 1) / kSlab) {}

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool over() const { return finished_ >= count_ || stopped_; }
  [[nodiscard]] double done() const { return static_cast<double>(finished_) / count_; }
  // Empty if nothing failed.
  [[nodiscard]] std::string failed() {
    const MutexLock lock(mutex_);
    return failed_;
  }
  void stop() { stopped_ = true; }

  // Processes slabs until none is left. Several threads at once.
  void work() {
    Slab slab(field_, iso_, stopped_);
    for (int n = next_++; n < count_ && !stopped_; n = next_++) {
      try {
        CoordBox core = field_.box;
        core.min.x += n * kSlab;
        core.max.x = std::min(core.min.x + kSlab - 1, core.max.x);
        slab.measure(core);
        std::vector<LeafPart> leaves;
        if (!stopped_) leaves = leaves_of(slab, field_.box, pitch_mm_, static_cast<float>(kBand * pitch_mm_));
        const MutexLock lock(mutex_);
        std::ranges::move(leaves, std::back_inserter(found_));
        ++finished_;
      } catch (const std::exception& error) {
        const MutexLock lock(mutex_);
        failed_ = error.what();
        stopped_ = true;
      }
      progressed_.notify_one();
    }
  }

  // What was found since the last call. Waits for it, but not long.
  std::vector<LeafPart> take() {
    std::vector<LeafPart> leaves;
    MutexLock lock(mutex_);
    progressed_.wait_for(lock, std::chrono::milliseconds(10),
                         [this]() OSTEON_REQUIRES(mutex_) { return over() || !found_.empty(); });
    leaves.swap(found_);
    return leaves;
  }

 private:
  const SampledField& field_;
  float iso_;
  double pitch_mm_;
  int count_;
  std::atomic<int> next_{0}, finished_{0};
  std::atomic<bool> stopped_{false};
  Mutex mutex_{LockRank::leaf};
  CondVar progressed_;
  std::string failed_ OSTEON_GUARDED_BY(mutex_);
  std::vector<LeafPart> found_ OSTEON_GUARDED_BY(mutex_);
};

}  // namespace

Result<SparseVolume> narrow_band_mm(const SampledField& field, float iso, double pitch_mm,
                                    const KeepGoing& keep_going) {
  OSTEON_CHECK(!field.box.empty() && pitch_mm > 0);
  const auto stopped_by_caller = [] { return stopped_while("measuring the bone surface"); };
  // Called once before any work, because the threads below may finish before they are first checked.
  if (!keep_going(0.0)) return stopped_by_caller();
  SparseVolume band(static_cast<float>(kBand * pitch_mm));
  const auto fill = [&](const std::vector<LeafPart>& leaves) {
    for (const LeafPart& leaf : leaves) put(leaf, field.box, band);
  };
  Slabs slabs(field, iso, pitch_mm);
  std::vector<std::thread> helpers;
  const int threads =
      std::min({slabs.count(), kMostThreads, static_cast<int>(std::max(1u, std::thread::hardware_concurrency()))});
  for (int i = 0; i < threads; ++i) helpers.emplace_back([&] { slabs.work(); });
  // The caller's thread waits, so that keep_going is called from one thread only. It also fills the result.
  bool cancelled = false;
  while (!slabs.over()) {
    if (!keep_going(slabs.done())) {
      cancelled = true;
      slabs.stop();
    }
    fill(slabs.take());
  }
  for (std::thread& helper : helpers) helper.join();
  if (const std::string failed = slabs.failed(); !failed.empty())
    return failure(ErrorCode::internal, "the bone surface could not be measured: " + failed);
  if (cancelled) return stopped_by_caller();
  fill(slabs.take());
  make_constants(field.box, band);
  return band;
}

}  // namespace osteon
