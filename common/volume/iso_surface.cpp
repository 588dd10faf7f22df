#include "common/volume/iso_surface.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/core/check.hpp"
#include "common/core/mutex.hpp"
#include "common/geometry/triangle_distance.hpp"

// The surface is meshed by dual contouring in its simplest form. Every cell with a crossing has one point, the mean of
// the crossings on its edges. Every crossed lattice edge has a quad between the points of the four cells around it
// (Gibson 1998). Only samples of the narrow band get a distance. Samples nearer than a voxel test every triangle beside
// them. The others get the nearest surface point from their neighbours, layer by layer outwards, and then test the
// triangles around it. Of two sheets they may choose the wrong one if a facet is nearer than its corners (2 samples of
// 1000 of a skull are more than 0.01 voxel off by that). OpenVDB's meshToVolume was tried first; it was up to 0.6 voxel
// wrong at the end of the band and slower. Every loop is bounded.
namespace osteon {
namespace {

using Vec3f = Eigen::Vector3f;

constexpr int kBand = 4;        // voxels; the distance is clipped to this
constexpr int kMargin = 6;      // voxels around a slab that can contain the surface nearest to a sample of the slab
constexpr int kSlab = 48;       // voxels along x that one thread processes
constexpr int kMostSteps = 16;  // of a walk over the mesh, which usually takes one or two
constexpr std::size_t kMostTriangles = 700'000'000;  // of a slab, because three corners of each are counted in 32 bits
constexpr std::int32_t kNone = -1;

// iso − field, so negative inside. Never zero, so that every sample has a side.
float depth(float value, float iso) {
  const float d = iso - value;
  return d == 0.0f ? -1e-3f : d;
}

// One slab of samples with its margin, in voxel coordinates from the margin's corner.
class Slab {
 public:
  Slab(const DenseVolume<float>& field, float iso, const std::atomic<bool>& stopped)
      : field_(field), iso_(iso), stopped_(stopped) {}

  // Writes the magnitudes of the samples from `first_x` up to but excluding `last_x`, counted from the box's corner.
  // Their signs are already in `out`. The memory of an earlier slab is reused.
  void measure(int first_x, int last_x, double pitch_mm, DenseVolume<float>& out) {
    read(first_x, last_x);
    cell_points();
    if (stopped_ || points_.empty()) return;
    quads();
    seed();
    spread();
    triangles_around_points();
    write(pitch_mm, out);
  }

 private:
  void read(int first_x, int last_x) {
    const Coord d = field_.box.dims();
    first_x_ = first_x;
    nx_ = last_x - first_x + 2 * kMargin;
    ny_ = d.y + 2 * kMargin;
    nz_ = d.z + 2 * kMargin;
    const std::size_t count =
        static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_);
    OSTEON_CHECK(count < static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()));
    if (values_.size() < squared_.size()) values_.swap(squared_);
    values_.resize(count);
    // Beyond its box the field continues with its values at the box's edge.
    float* to = values_.data();
    for (int x = 0; x < nx_ && !stopped_; ++x)
      for (int y = 0; y < ny_; ++y, to += nz_) {
        const float* from = &field_.values[field_.index(field_.box.min + clamped(x, y, kMargin))];
        for (int z = 0; z < d.z; ++z) to[kMargin + z] = depth(from[z], iso_);
        std::fill(to, to + kMargin, to[kMargin]);
        std::fill(to + kMargin + d.z, to + nz_, to[kMargin + d.z - 1]);
      }
  }
  [[nodiscard]] Coord clamped(int x, int y, int z) const {
    const Coord d = field_.box.dims();
    return {std::clamp(first_x_ + x - kMargin, 0, d.x - 1), std::clamp(y - kMargin, 0, d.y - 1),
            std::clamp(z - kMargin, 0, d.z - 1)};
  }
  [[nodiscard]] std::int32_t index(int x, int y, int z) const { return (x * ny_ + y) * nz_ + z; }
  [[nodiscard]] Vec3f position(std::int32_t i) const {
    return {static_cast<float>(i / (ny_ * nz_)), static_cast<float>(i / nz_ % ny_), static_cast<float>(i % nz_)};
  }
  static std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

  // A cell is named by its lowest corner. Cells in which the field crosses the value get a point, in memory order.
  void cell_points() {
    points_.clear();
    cells_.clear();
    nearest_point_.assign(values_.size(), kNone);
    std::vector<std::uint8_t> inside(at(nz_));  // of the four corners at each z
    for (int x = 0; x + 1 < nx_ && !stopped_; ++x)
      for (int y = 0; y + 1 < ny_; ++y) {
        const float* line[4];
        for (int c = 0; c < 4; ++c) line[c] = values_.data() + index(x + (c & 1), y + (c >> 1), 0);
        for (int z = 0; z < nz_; ++z)
          inside[at(z)] =
              static_cast<std::uint8_t>((line[0][z] < 0) + (line[1][z] < 0) + (line[2][z] < 0) + (line[3][z] < 0));
        for (int z = 0; z + 1 < nz_; ++z)
          if (const int corners = inside[at(z)] + inside[at(z + 1)]; corners != 0 && corners != 8)
            add_point(x, y, z, line);
      }
  }

  void add_point(int x, int y, int z, const float* const* line) {
    float corner[8];
    for (int c = 0; c < 8; ++c) corner[c] = line[c & 3][z + (c >> 2)];
    Vec3f sum = Vec3f::Zero();
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int c = 0; c < 8; ++c) {
        const int end = c | 1 << axis;
        if (end == c || (corner[c] < 0) == (corner[end] < 0)) continue;
        Vec3f crossing(static_cast<float>(c & 1), static_cast<float>(c >> 1 & 1), static_cast<float>(c >> 2));
        crossing[axis] = corner[c] / (corner[c] - corner[end]);
        sum += crossing;
        ++crossings;
      }
    const std::int32_t cell = index(x, y, z);
    nearest_point_[at(cell)] = static_cast<std::int32_t>(points_.size());
    cells_.push_back(cell);
    points_.push_back(Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)) +
                      sum / static_cast<float>(crossings));
  }

  // A crossed lattice edge starts at the lowest corner of a cell with a point, so only those cells are checked.
  void quads() {
    triangles_.clear();
    const std::array<int, 3> step{ny_ * nz_, nz_, 1};
    const auto point = [&](std::int32_t cell) { return nearest_point_[at(cell)]; };
    for (const std::int32_t i : cells_) {
      if (triangles_.size() > kMostTriangles)
        throw std::length_error("it has too many triangles; choose a larger --pitch");
      const int x = i / (ny_ * nz_), y = i / nz_ % ny_, z = i % nz_;
      if (x == 0 || y == 0 || z == 0) continue;  // the cells around the edge are beyond the margin
      const bool inside = values_[at(i)] < 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if ((values_[at(i + step[axis])] < 0) == inside) continue;
        const int u = step[(axis + 1) % 3], v = step[(axis + 2) % 3];
        const std::int32_t a = point(i - u - v), b = point(i - v), c = point(i), d = point(i - u);
        triangles_.push_back({a, b, c});
        triangles_.push_back({a, c, d});
      }
    }
  }

  [[nodiscard]] TriangleDistance<float> distance(std::int32_t triangle, const Vec3f& p) const {
    const auto& t = triangles_[at(triangle)];
    return distance_to_triangle<float>(p, points_[at(t[0])], points_[at(t[1])], points_[at(t[2])]);
  }

  // Offers a triangle to a sample, which stores the nearest one.
  void offer(std::int32_t triangle, std::int32_t sample, const Vec3f& p) {
    const float squared = distance(triangle, p).squared;
    float& best = squared_[at(sample)];
    std::int32_t& nearest = nearest_[at(sample)];
    if (nearest != kNone && !(squared < best)) return;
    best = squared;
    nearest = triangle;
  }

  // Offers every triangle to the samples directly around it. Samples nearer than a voxel need no more.
  void seed() {
    nearest_.assign(values_.size(), kNone);
    squared_.swap(values_);  // whose values are not read any more
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      if ((t & 0xffff) == 0 && stopped_) return;
      const Vec3f &a = points_[at(triangles_[t][0])], &b = points_[at(triangles_[t][1])],
                  &c = points_[at(triangles_[t][2])];
      const Vec3f low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
      const int x_end = std::min(nx_ - 1, static_cast<int>(high.x()) + 1),
                y_end = std::min(ny_ - 1, static_cast<int>(high.y()) + 1),
                z_end = std::min(nz_ - 1, static_cast<int>(high.z()) + 1);
      for (int x = static_cast<int>(low.x()); x <= x_end; ++x)
        for (int y = static_cast<int>(low.y()); y <= y_end; ++y)
          for (int z = static_cast<int>(low.z()); z <= z_end; ++z)
            offer(static_cast<std::int32_t>(t), index(x, y, z),
                  Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)));
    }
  }

  // Calls `visit` for each of the up to 26 neighbours of a sample.
  template <class Visit>
  void each_neighbour(std::int32_t i, Visit visit) const {
    const int x = i / (ny_ * nz_), y = i / nz_ % ny_, z = i % nz_;
    for (int u = std::max(0, x - 1); u <= std::min(nx_ - 1, x + 1); ++u)
      for (int v = std::max(0, y - 1); v <= std::min(ny_ - 1, y + 1); ++v)
        for (int w = std::max(0, z - 1); w <= std::min(nz_ - 1, z + 1); ++w)
          if (const std::int32_t j = index(u, v, w); j != i) visit(j);
  }

  // Offers a surface point to a sample, which stores the nearest one within the band.
  void offer_point(std::int32_t point, std::int32_t sample, const Vec3f& p) {
    const float squared = (points_[at(point)] - p).squaredNorm();
    std::int32_t& nearest = nearest_point_[at(sample)];
    const float limit =
        nearest == kNone ? static_cast<float>((kBand + 2) * (kBand + 2)) : (points_[at(nearest)] - p).squaredNorm();
    if (squared < limit) nearest = point;
  }

  // Finds the nearest surface point for every sample of the band. It starts at the corners of the points' cells. Then
  // it adds one layer of samples after the other, one more than the band is wide. Each sample tests once the points of
  // its neighbours.
  void spread() {
    nearest_point_.assign(nearest_.size(), kNone);
    waiting_.assign(nearest_.size(), 0);
    layer_.clear();
    for (std::size_t n = 0; n < cells_.size(); ++n)
      for (int c = 0; c < 8; ++c) {
        const std::int32_t corner = cells_[n] + (c & 1) * ny_ * nz_ + (c >> 1 & 1) * nz_ + (c >> 2);
        offer_point(static_cast<std::int32_t>(n), corner, position(corner));
        if (waiting_[at(corner)] != 0) continue;
        waiting_[at(corner)] = 1;
        layer_.push_back(corner);
      }
    for (const std::int32_t i : layer_) look_around(i);
    for (int layers = 0; layers <= kBand && !stopped_; ++layers) {
      next_layer_.clear();
      for (const std::int32_t i : layer_)
        each_neighbour(i, [&](std::int32_t j) {
          if (waiting_[at(j)] != 0) return;
          waiting_[at(j)] = 1;
          next_layer_.push_back(j);
        });
      for (const std::int32_t j : next_layer_) look_around(j);
      std::swap(layer_, next_layer_);
      std::erase_if(layer_, [&](std::int32_t j) { return nearest_point_[at(j)] == kNone; });
    }
  }

  void look_around(std::int32_t sample) {
    const Vec3f p = position(sample);
    each_neighbour(sample, [&](std::int32_t j) {
      const std::int32_t point = nearest_point_[at(j)];
      if (point != kNone && point != nearest_point_[at(sample)]) offer_point(point, sample, p);
    });
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
    for (std::int32_t n = around_begin_[at(point)]; n < around_begin_[at(point) + 1]; ++n)
      offer(around_[at(n)], sample, p);
  }

  // From the nearest point to the nearest triangle. It tests the triangles around the point. Then it walks over the
  // mesh, around the corners of the nearest part of the triangle, while that finds a nearer one.
  void refine(std::int32_t sample) {
    const Vec3f p = position(sample);
    std::int32_t known = nearest_point_[at(sample)];
    offer_around(known, sample, p);
    for (int steps = 0; steps < kMostSteps; ++steps) {
      const std::int32_t triangle = nearest_[at(sample)];
      if (triangle == kNone) return;
      const unsigned corners = steps == 0 ? 7u : distance(triangle, p).corners;
      for (std::size_t c = 0; c < 3; ++c)
        if (const std::int32_t point = triangles_[at(triangle)][c]; (corners >> c & 1u) != 0 && point != known)
          offer_around(point, sample, p);
      if (nearest_[at(sample)] == triangle) return;
      known = kNone;
    }
  }

  void write(double pitch_mm, DenseVolume<float>& out) {
    const auto band = static_cast<float>(kBand * pitch_mm);
    for (int x = kMargin; x < nx_ - kMargin && !stopped_; ++x)
      for (int y = kMargin; y < ny_ - kMargin; ++y)
        for (int z = kMargin; z < nz_ - kMargin; ++z) {
          const std::int32_t i = index(x, y, z);
          if (nearest_point_[at(i)] == kNone) continue;
          if (nearest_[at(i)] == kNone || squared_[at(i)] >= 1.0f) refine(i);
          if (nearest_[at(i)] == kNone) continue;
          const auto mm = static_cast<float>(std::sqrt(static_cast<double>(squared_[at(i)])) * pitch_mm);
          float& sample = out.at(field_.box.min + Coord{first_x_ + x - kMargin, y - kMargin, z - kMargin});
          sample = std::copysign(std::min(mm, band), sample);
        }
  }

  const DenseVolume<float>& field_;
  float iso_;
  const std::atomic<bool>& stopped_;
  int first_x_ = 0, nx_ = 0, ny_ = 0, nz_ = 0;
  std::vector<float> values_;
  std::vector<std::int32_t> cells_;  // cells with a point, in the order of the points
  std::vector<Vec3f> points_;
  std::vector<std::array<std::int32_t, 3>> triangles_;
  // The nearest point of each sample. Earlier, while the surface is meshed, the point of each cell.
  std::vector<std::int32_t> nearest_point_;
  std::vector<std::int32_t> nearest_;  // nearest triangle of each sample
  std::vector<float> squared_;         // the distance to it, voxels²; undefined without a triangle
  std::vector<std::int32_t> layer_, next_layer_;
  std::vector<std::uint8_t> waiting_;  // 1: the sample was already in a layer
  std::vector<std::int32_t> around_begin_, around_;
};

}  // namespace

Result<DenseVolume<float>> signed_distance_mm(const DenseVolume<float>& field, float iso, double pitch_mm,
                                              const KeepGoing& keep_going) {
  OSTEON_CHECK(!field.box.empty() && pitch_mm > 0);
  const auto stopped_by_caller = [] { return stopped_while("measuring the bone surface"); };
  // Called once before any work, because the threads below may finish before they are first checked.
  if (!keep_going(0.0)) return stopped_by_caller();
  DenseVolume<float> out;
  out.box = field.box;
  out.values.resize(field.values.size());
  const float band = static_cast<float>(kBand * pitch_mm);
  std::transform(field.values.begin(), field.values.end(), out.values.begin(),
                 [&](float v) { return std::copysign(band, depth(v, iso)); });

  // Slabs are independent, and one thread processes each in a fixed order, so the result does not depend on the
  // threads.
  const int width = field.box.dims().x;
  const int slabs = (width + kSlab - 1) / kSlab;
  std::atomic<int> next{0};
  std::atomic<int> finished{0};
  std::atomic<bool> stopped{false};
  Mutex mutex{LockRank::leaf};  // of `failed` and of the wait for `finished`; clang checks no locals
  CondVar progressed;
  std::string failed;
  const auto work = [&] {
    Slab part(field, iso, stopped);
    for (int slab = next++; slab < slabs && !stopped; slab = next++) {
      try {
        part.measure(slab * kSlab, std::min((slab + 1) * kSlab, width), pitch_mm, out);
      } catch (const std::exception& error) {
        const MutexLock lock(mutex);
        failed = error.what();
        stopped = true;
      }
      {
        const MutexLock lock(mutex);
        ++finished;
      }
      progressed.notify_one();
    }
  };
  std::vector<std::thread> helpers;
  const int threads = std::min(slabs, static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  for (int i = 0; i < threads; ++i) helpers.emplace_back(work);
  // The caller's thread waits, so that keep_going is called from one thread only.
  bool cancelled = false;
  while (finished < slabs && !stopped) {
    if (!keep_going(static_cast<double>(finished) / slabs)) cancelled = stopped = true;
    MutexLock lock(mutex);
    progressed.wait_for(lock, std::chrono::milliseconds(10), [&] { return finished >= slabs || stopped; });
  }
  for (std::thread& helper : helpers) helper.join();

  if (!failed.empty()) return failure(ErrorCode::internal, "the bone surface could not be measured: " + failed);
  if (cancelled) return stopped_by_caller();
  return out;
}

}  // namespace osteon
