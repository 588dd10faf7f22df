#include "common/volume/sparse_volume.hpp"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "common/core/check.hpp"
#include "common/volume/openvdb_start.hpp"
#include "common/volume/vdb_writer.hpp"

namespace osteon {

using Grid = openvdb::FloatGrid;
using Tree = Grid::TreeType;
using Leaf = Tree::LeafNodeType;
static_assert(Leaf::SIZE == kLeafVoxels);

struct SparseVolume::Impl {
  Grid::Ptr grid;
};

namespace {

openvdb::Coord vdb(Coord c) { return {c.x, c.y, c.z}; }
Coord ours(const openvdb::Coord& c) { return {c.x(), c.y(), c.z()}; }

}  // namespace

SparseVolume::SparseVolume(float background) : impl_(std::make_unique<Impl>()) {
  start_openvdb();
  impl_->grid = Grid::create(background);
}
SparseVolume::~SparseVolume() = default;
SparseVolume::SparseVolume(SparseVolume&&) noexcept = default;
SparseVolume& SparseVolume::operator=(SparseVolume&&) noexcept = default;

float SparseVolume::background() const { return impl_->grid->background(); }

float SparseVolume::value(Coord sample) const { return impl_->grid->tree().getValue(vdb(sample)); }

void SparseVolume::gather(const CoordBox& box, std::span<float> out) const {
  if (box.empty()) return;
  const Coord dims = box.dims();
  OSTEON_CHECK(out.size() ==
               static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z));
  const Grid::ConstUnsafeAccessor accessor = impl_->grid->getConstUnsafeAccessor();
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t lx = first.x; lx <= box.max.x; lx += kLeafSize)
    for (std::int32_t ly = first.y; ly <= box.max.y; ly += kLeafSize)
      for (std::int32_t lz = first.z; lz <= box.max.z; lz += kLeafSize) {
        const Leaf* leaf = accessor.probeConstLeaf(openvdb::Coord(lx, ly, lz));
        const float* data = leaf ? leaf->buffer().data() : nullptr;
        const float constant = leaf ? 0.0f : accessor.getValue(openvdb::Coord(lx, ly, lz));
        const std::int32_t x0 = std::max(lx, box.min.x), x1 = std::min(lx + kLeafSize - 1, box.max.x);
        const std::int32_t y0 = std::max(ly, box.min.y), y1 = std::min(ly + kLeafSize - 1, box.max.y);
        const std::int32_t z0 = std::max(lz, box.min.z), z1 = std::min(lz + kLeafSize - 1, box.max.z);
        for (std::int32_t x = x0; x <= x1; ++x)
          for (std::int32_t y = y0; y <= y1; ++y) {
            float* row = out.data() +
                         (static_cast<std::size_t>(x - box.min.x) * static_cast<std::size_t>(dims.y) +
                          static_cast<std::size_t>(y - box.min.y)) *
                             static_cast<std::size_t>(dims.z) +
                         (z0 - box.min.z);
            if (data) {
              // A whole row of samples of a leaf is two registers. A few samples at the end of a box are not worth a
              // call.
              const float* from = data + (x - lx) * 64 + (y - ly) * 8 + (z0 - lz);
              if (z1 - z0 + 1 == kLeafSize)
                std::memcpy(row, from, sizeof(float) * kLeafSize);
              else
                for (std::int32_t z = 0; z <= z1 - z0; ++z) row[z] = from[z];
            } else {
              std::fill_n(row, z1 - z0 + 1, constant);
            }
          }
      }
}

void SparseVolume::gather_every(std::int32_t stride, const CoordBox& box, std::span<float> out) const {
  if (box.empty()) return;
  const Coord dims = box.dims();
  OSTEON_CHECK(stride > 0 && kLeafSize % stride == 0);
  OSTEON_CHECK(out.size() ==
               static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z));
  const Grid::ConstUnsafeAccessor accessor = impl_->grid->getConstUnsafeAccessor();
  const std::int32_t in_leaf = kLeafSize / stride;  // gathered samples along a leaf
  const Coord first = floor_to(box.min, in_leaf);
  for (std::int32_t lx = first.x; lx <= box.max.x; lx += in_leaf)
    for (std::int32_t ly = first.y; ly <= box.max.y; ly += in_leaf)
      for (std::int32_t lz = first.z; lz <= box.max.z; lz += in_leaf) {
        const openvdb::Coord origin(lx * stride, ly * stride, lz * stride);
        const Leaf* leaf = accessor.probeConstLeaf(origin);
        const float* data = leaf ? leaf->buffer().data() : nullptr;
        const float constant = leaf ? 0.0f : accessor.getValue(origin);
        for (std::int32_t x = std::max(lx, box.min.x); x <= std::min(lx + in_leaf - 1, box.max.x); ++x)
          for (std::int32_t y = std::max(ly, box.min.y); y <= std::min(ly + in_leaf - 1, box.max.y); ++y) {
            float* row = out.data() + (static_cast<std::size_t>(x - box.min.x) * static_cast<std::size_t>(dims.y) +
                                       static_cast<std::size_t>(y - box.min.y)) *
                                          static_cast<std::size_t>(dims.z);
            for (std::int32_t z = std::max(lz, box.min.z); z <= std::min(lz + in_leaf - 1, box.max.z); ++z)
              row[z - box.min.z] = data ? data[((x - lx) * 64 + (y - ly) * 8 + (z - lz)) * stride] : constant;
          }
      }
}

bool SparseVolume::view(const CoordBox& box, std::span<LeafView> leaves) const {
  const Tree& tree = impl_->grid->tree();
  const float uncut = background();
  if (tree.root().getTableSize() == 0) {
    std::ranges::fill(leaves, LeafView{nullptr, uncut});
    return false;
  }
  const Grid::ConstUnsafeAccessor accessor(tree);
  const Coord first = floor_to(box.min, kLeafSize);
  bool any = false;
  std::size_t i = 0;
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize) {
        const openvdb::Coord origin(x, y, z);
        const Leaf* leaf = accessor.probeConstLeaf(origin);
        leaves[i] = leaf ? LeafView{leaf->buffer().data(), 0.0f} : LeafView{nullptr, accessor.getValue(origin)};
        any |= leaf != nullptr || leaves[i].constant != uncut;
        ++i;
      }
  OSTEON_CHECK(i == leaves.size());
  return any;
}

bool SparseVolume::any_stored(const CoordBox& box) const {
  if (impl_->grid->tree().root().getTableSize() == 0) return false;
  const Grid::ConstUnsafeAccessor accessor = impl_->grid->getConstUnsafeAccessor();
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize) {
        const openvdb::Coord origin(x, y, z);
        if (accessor.probeConstLeaf(origin) || accessor.getValue(origin) != background()) return true;
      }
  return false;
}

double SparseVolume::trilinear(const Vec3& index) const {
  const Grid::ConstUnsafeAccessor accessor = impl_->grid->getConstUnsafeAccessor();
  const double fx = std::floor(index.x()), fy = std::floor(index.y()), fz = std::floor(index.z());
  const openvdb::Coord base(static_cast<int>(fx), static_cast<int>(fy), static_cast<int>(fz));
  const double wx = index.x() - fx, wy = index.y() - fy, wz = index.z() - fz;
  double sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    const int x = i >> 2, y = (i >> 1) & 1, z = i & 1;
    const double weight = (x ? wx : 1.0 - wx) * (y ? wy : 1.0 - wy) * (z ? wz : 1.0 - wz);
    sum += weight * static_cast<double>(accessor.getValue(base.offsetBy(x, y, z)));
  }
  return sum;
}

const float* SparseVolume::leaf(Coord origin) const {
  const Leaf* leaf = impl_->grid->tree().probeConstLeaf(vdb(origin));
  return leaf ? leaf->buffer().data() : nullptr;
}

float* SparseVolume::edit_leaf(Coord origin) {
  Leaf* leaf = impl_->grid->tree().touchLeaf(vdb(origin));
  leaf->setValuesOn();
  return leaf->buffer().data();
}

void SparseVolume::set_constant(Coord origin, float value) {
  impl_->grid->tree().addTile(1, vdb(origin), value, value != background());
}

std::vector<Coord> SparseVolume::leaves() const {
  std::vector<Coord> origins;
  for (auto it = impl_->grid->tree().cbeginLeaf(); it; ++it) origins.push_back(ours(it->origin()));
  std::ranges::sort(origins);
  return origins;
}

std::vector<Coord> SparseVolume::constants() const {
  std::vector<Coord> origins;
  auto it = impl_->grid->tree().cbeginValueOn();
  it.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; it; ++it) {
    const openvdb::CoordBBox box = it.getBoundingBox();
    for (auto x = box.min().x(); x <= box.max().x(); x += kLeafSize)
      for (auto y = box.min().y(); y <= box.max().y(); y += kLeafSize)
        for (auto z = box.min().z(); z <= box.max().z(); z += kLeafSize) origins.push_back({x, y, z});
  }
  std::ranges::sort(origins);
  return origins;
}

void SparseVolume::find(std::span<const Coord> origins, std::span<Place> places) {
  OSTEON_CHECK(origins.size() == places.size());
  Grid::UnsafeAccessor accessor(impl_->grid->tree());
  for (std::size_t i = 0; i < origins.size(); ++i) {
    const openvdb::Coord origin = vdb(origins[i]);
    Leaf* leaf = accessor.probeLeaf(origin);
    places[i] = leaf ? Place{leaf->buffer().data(), 0.0f} : Place{nullptr, accessor.getValue(origin)};
  }
}

void SparseVolume::LeafDeleter::operator()(void* leaf) const { delete static_cast<Leaf*>(leaf); }

SparseVolume::NewLeaf SparseVolume::make_leaf(Coord origin, std::span<const float, kLeafVoxels> samples) {
  // Made without samples, so that they are not written twice.
  NewLeaf made(new Leaf(openvdb::PartialCreate(), vdb(origin), 0.0f, true));
  auto* leaf = static_cast<Leaf*>(made.get());
  leaf->allocate();
  std::memcpy(leaf->buffer().data(), samples.data(), sizeof(float) * kLeafVoxels);
  return made;
}

void SparseVolume::put(NewLeaf leaf) { impl_->grid->tree().addLeaf(static_cast<Leaf*>(leaf.release())); }

std::size_t SparseVolume::memory_bytes() const { return impl_->grid->tree().memUsage(); }

Result<void> save_volumes(const std::filesystem::path& file, double pitch_mm,
                          const std::vector<std::pair<std::string, const SparseVolume*>>& volumes) {
  try {
    start_openvdb();
    openvdb::GridCPtrVec grids;
    for (const auto& [name, volume] : volumes) {
      const Grid::Ptr grid = volume->impl_->grid->copy();  // shares the tree; has its own name and transform
      grid->setName(name);
      grid->setTransform(openvdb::math::Transform::createLinearTransform(pitch_mm));
      grids.push_back(grid);
    }
    write_vdb(file, grids, openvdb::MetaMap());
    return {};
  } catch (const std::exception& e) {
    return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + e.what());
  }
}

Result<std::vector<SparseVolume>> load_volumes(const std::filesystem::path& file, const std::vector<std::string>& names,
                                               const VdbLimits& limits) {
  if (const auto size = measure_vdb(file, limits); !size) {
    Error error = size.error();
    if (error.code == ErrorCode::invalid_input) error.message += "; import the case again";
    return tl::unexpected(error);
  }
  try {
    start_openvdb();
    openvdb::io::File in(file.string());
    in.open(false);  // no delayed loading, because the file may be replaced while the program runs
    std::vector<SparseVolume> volumes;
    for (const std::string& name : names) {
      if (!in.hasGrid(name))
        return failure(ErrorCode::invalid_input,
                       file.string() + " has no grid \"" + name + "\"; import the case again");
      const auto grid = openvdb::gridPtrCast<Grid>(in.readGrid(name));
      if (!grid)
        return failure(ErrorCode::invalid_input,
                       "grid \"" + name + "\" of " + file.string() + " is not a float grid; import the case again");
      SparseVolume volume(grid->background());
      volume.impl_->grid = grid;
      volumes.push_back(std::move(volume));
    }
    return volumes;
  } catch (const std::bad_alloc&) {
    return failure(ErrorCode::exhausted, file.string() + " takes more memory than there is");
  } catch (const std::exception& e) {
    return failure(ErrorCode::invalid_input, file.string() + " is damaged (" + e.what() + "); import the case again");
  }
}

}  // namespace osteon
