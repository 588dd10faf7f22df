#include "common/volume/iso_surface.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "common/core/check.hpp"

namespace osteon {
namespace {

constexpr int kBand = 4;         // voxels to which the distance is clipped
constexpr int kBlock = 8;        // a leaf of the sparse grid
constexpr int kApron = kBlock + 2;
constexpr int kSlab = 8 * kBlock;

// iso − field, so negative inside; never zero, so that every sample has a side and no quad collapses on a sample.
float depth(float value, float iso) {
  const float d = iso - value;
  return d == 0.0f ? -1e-3f : d;
}

// One block of the field with one sample around it, continued beyond the box by its edge.
class Apron {
 public:
  Apron(const DenseVolume<float>& field, float iso) : field_(field), iso_(iso), dims_(field.box.dims()) {}

  // Returns whether the samples lie on both sides.
  bool gather(openvdb::Coord origin) {
    bool any_inside = false;
    bool any_outside = false;
    std::size_t n = 0;
    for (int x = origin.x() - 1; x <= origin.x() + kBlock; ++x) {
      const std::size_t row_x = static_cast<std::size_t>(std::clamp(x, 0, dims_.x - 1)) * static_cast<std::size_t>(dims_.y);
      for (int y = origin.y() - 1; y <= origin.y() + kBlock; ++y) {
        const std::size_t row = (row_x + static_cast<std::size_t>(std::clamp(y, 0, dims_.y - 1))) * static_cast<std::size_t>(dims_.z);
        for (int z = origin.z() - 1; z <= origin.z() + kBlock; ++z) {
          const float d = depth(field_.values[row + static_cast<std::size_t>(std::clamp(z, 0, dims_.z - 1))], iso_);
          values_[n++] = d;
          (d < 0 ? any_inside : any_outside) = true;
        }
      }
    }
    return any_inside && any_outside;
  }
  [[nodiscard]] float at(int x, int y, int z) const {
    return values_[static_cast<std::size_t>(((x + 1) * kApron + y + 1) * kApron + z + 1)];
  }

 private:
  const DenseVolume<float>& field_;
  float iso_;
  Coord dims_;
  std::array<float, kApron * kApron * kApron> values_{};
};

// The sparse grid holds the blocks that a crossing touches; the others are tiles of their sign, so that no false
// crossing appears between a stored block and its neighbour.
openvdb::FloatGrid::Ptr crossing_blocks(const DenseVolume<float>& field, float iso, int first_x, int last_x) {
  const Coord dims = field.box.dims();
  auto grid = openvdb::FloatGrid::create(1.0f);
  auto access = grid->getAccessor();
  Apron apron(field, iso);
  // One block beyond the slab and the box: a false crossing at their end then lies outside the band.
  for (int x = first_x - kBlock; x < last_x + kBlock; x += kBlock) {
    for (int y = -kBlock; y < dims.y + kBlock; y += kBlock) {
      for (int z = -kBlock; z < dims.z + kBlock; z += kBlock) {
        const openvdb::Coord origin(x, y, z);
        if (!apron.gather(origin)) {
          if (apron.at(0, 0, 0) < 0) access.addTile(1, origin, -1.0f, false);
          continue;
        }
        auto* leaf = access.touchLeaf(origin);
        leaf->setValuesOn();
        float* out = leaf->buffer().data();
        for (int i = 0; i < kBlock; ++i)
          for (int j = 0; j < kBlock; ++j)
            for (int k = 0; k < kBlock; ++k) *out++ = apron.at(i, j, k);
      }
    }
  }
  return grid;
}

// Distances of the samples first_x <= x < last_x (counted from the box's corner), whose signs are in `out` already.
void measure_slab(const DenseVolume<float>& field, float iso, int first_x, int last_x, double pitch_mm,
                  DenseVolume<float>& out) {
  const auto grid = crossing_blocks(field, iso, first_x, last_x);
  if (grid->tree().leafCount() == 0) return;

  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*grid, points, quads, 0.0);
  if (quads.empty()) return;

  // Unsigned: the sides come from the samples, so enclosed cavities and open ends need no flood fill.
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec4I> mesh(points, quads);
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  const auto distance = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      mesh, *transform, kBand + 1.0f, kBand + 1.0f, openvdb::tools::UNSIGNED_DISTANCE_FIELD);

  const Coord dims = field.box.dims();
  const float band = static_cast<float>(kBand * pitch_mm);
  for (auto leaf = distance->tree().cbeginLeaf(); leaf; ++leaf) {
    for (auto value = leaf->cbeginValueOn(); value; ++value) {
      const openvdb::Coord c = value.getCoord();
      if (c.x() < first_x || c.x() >= last_x || c.y() < 0 || c.y() >= dims.y || c.z() < 0 || c.z() >= dims.z) continue;
      float& sample = out.at(field.box.min + Coord{c.x(), c.y(), c.z()});
      sample = std::copysign(std::min(static_cast<float>(*value * pitch_mm), band), sample);
    }
  }
}

}  // namespace

Result<DenseVolume<float>> signed_distance_mm(const DenseVolume<float>& field, float iso, double pitch_mm,
                                              const KeepGoing& keep_going) {
  OSTEON_CHECK(!field.box.empty() && pitch_mm > 0);
  openvdb::initialize();

  DenseVolume<float> out;
  out.box = field.box;
  out.values.resize(field.values.size());
  const float band = static_cast<float>(kBand * pitch_mm);
  std::transform(field.values.begin(), field.values.end(), out.values.begin(),
                 [&](float v) { return std::copysign(band, depth(v, iso)); });

  // Slabs are independent. Within one, work is serial: among equally near quads the library takes the first one that
  // a thread happens to offer, and a case's hash must not depend on that.
  const int width = field.box.dims().x;
  const int slabs = (width + kSlab - 1) / kSlab;
  std::atomic<int> next{0};
  std::atomic<int> finished{0};
  std::atomic<bool> stopped{false};
  std::mutex failure_mutex;
  std::string failed;
  const auto work = [&] {
    tbb::task_arena serial(1);
    for (int slab = next++; slab < slabs && !stopped; slab = next++) {
      try {
        serial.execute([&] {
          measure_slab(field, iso, slab * kSlab, std::min((slab + 1) * kSlab, width), pitch_mm, out);
        });
      } catch (const std::exception& error) {
        const std::lock_guard lock(failure_mutex);
        failed = error.what();
        stopped = true;
      }
      ++finished;
    }
  };
  std::vector<std::thread> helpers;
  const int threads = std::min(slabs, static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  for (int i = 0; i < threads; ++i) helpers.emplace_back(work);
  // The caller's thread watches, so that keep_going is called from one thread only.
  bool cancelled = false;
  while (finished < slabs && !stopped) {
    if (!keep_going(static_cast<double>(finished) / slabs)) cancelled = stopped = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  for (std::thread& helper : helpers) helper.join();

  if (!failed.empty()) return failure(ErrorCode::internal, "the bone surface could not be measured: " + failed);
  if (cancelled) return failure(ErrorCode::cancelled, "stopped while measuring the bone surface");
  return out;
}

}  // namespace osteon
