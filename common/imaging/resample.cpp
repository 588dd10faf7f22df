#include "common/imaging/resample.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/core/check.hpp"

namespace osteon::imaging {
namespace {

// The two neighbours along one axis, and the position of the point from the first to the second.
struct Bracket {
  std::ptrdiff_t low;
  std::ptrdiff_t high;
  double part;
};

Bracket bracket(double voxel, int count) {
  const double inside = std::clamp(voxel, 0.0, static_cast<double>(count - 1));
  const int low = std::min(static_cast<int>(inside), std::max(0, count - 2));
  return {low, std::min(low + 1, count - 1), inside - low};
}

double mix(double a, double b, double part) { return a + (b - a) * part; }

// HU of a part of the volume.
struct Part {
  const std::int16_t* values;
  std::ptrdiff_t row_step, slice_step, first;  // the first voxel's index, if the volume's first voxel had index 0

  Part(const VoxelBox& box, std::span<const std::int16_t> voxels)
      : values(voxels.data()),
        row_step(box.dim(0)),
        slice_step(row_step * box.dim(1)),
        first(box.first[0] + box.first[1] * row_step + box.first[2] * slice_step) {}
};

// Trilinear between the eight voxels of three brackets.
double interpolate(const Part& part, const Bracket& i, const Bracket& j, const Bracket& k) {
  const auto along_columns = [&](std::ptrdiff_t row, std::ptrdiff_t slice) {
    const std::ptrdiff_t line = row * part.row_step + slice * part.slice_step - part.first;
    return mix(part.values[line + i.low], part.values[line + i.high], i.part);
  };
  return mix(mix(along_columns(j.low, k.low), along_columns(j.high, k.low), j.part),
             mix(along_columns(j.low, k.high), along_columns(j.high, k.high), j.part), k.part);
}

// For columns, rows and slices along x, y and z. Then each bracket depends on one coordinate only.
void resample_aligned(const HuVolume& volume, const Part& part, const CoordBox& box, double pitch_mm, float* out) {
  const auto brackets = [&](int axis, std::int32_t from, std::int32_t to) {
    std::vector<Bracket> made;
    for (std::int32_t c = from; c <= to; ++c) {
      const double voxel =
          volume.directions(axis, axis) * (c * pitch_mm - volume.origin_mm[axis]) / volume.spacing_mm[axis];
      made.push_back(bracket(voxel, volume.dims[static_cast<std::size_t>(axis)]));
    }
    return made;
  };
  const auto x = brackets(0, box.min.x, box.max.x), y = brackets(1, box.min.y, box.max.y),
             z = brackets(2, box.min.z, box.max.z);
  for (const Bracket& i : x)
    for (const Bracket& j : y)
      for (const Bracket& k : z) *out++ = static_cast<float>(interpolate(part, i, j, k));
}

}  // namespace

void resample(const HuVolume& volume, const VoxelBox& part_box, std::span<const std::int16_t> voxels,
              const CoordBox& box, double pitch_mm, std::span<float> out) {
  const Coord dims = box.dims();
  OSTEON_CHECK(out.size() ==
               static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z));
  OSTEON_CHECK(voxels.size() == part_box.count());
  const Part part(part_box, voxels);
  if (volume.directions.isDiagonal(1e-12)) return resample_aligned(volume, part, box, pitch_mm, out.data());
  float* value = out.data();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = volume.voxel(position_mm({x, y, z}, pitch_mm));
        *value++ = static_cast<float>(interpolate(part, bracket(at.x(), volume.dims[0]),
                                                  bracket(at.y(), volume.dims[1]), bracket(at.z(), volume.dims[2])));
      }
}

Result<DenseVolume<float>> resample(const HuVolume& volume, const CoordBox& box, double pitch_mm,
                                    const KeepGoing& keep_going) {
  DenseVolume<float> out;
  out.box = box;
  const Coord dims = box.dims();
  const std::size_t plane = static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
  out.values.resize(static_cast<std::size_t>(dims.x) * plane);
  const VoxelBox whole{{0, 0, 0}, {volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1}};
  for (int x = box.min.x; x <= box.max.x; ++x) {
    const int done = x - box.min.x;
    if (!keep_going(static_cast<double>(done) / dims.x)) return stopped_while("resampling the scan");
    const CoordBox slice{{x, box.min.y, box.min.z}, {x, box.max.y, box.max.z}};
    resample(volume, whole, volume.values, slice, pitch_mm,
             std::span(out.values).subspan(static_cast<std::size_t>(done) * plane, plane));
  }
  return out;
}

double hu_at(const HuVolume& volume, const Vec3& voxel) {
  const Part whole({{0, 0, 0}, {volume.dims[0] - 1, volume.dims[1] - 1, volume.dims[2] - 1}}, volume.values);
  return interpolate(whole, bracket(voxel.x(), volume.dims[0]), bracket(voxel.y(), volume.dims[1]),
                     bracket(voxel.z(), volume.dims[2]));
}

VoxelBox voxels_for(const HuVolume& volume, const CoordBox& box, double pitch_mm) {
  constexpr double kRounding = 1e-6;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Coord c{(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                  (corner & 4) != 0 ? box.max.z : box.min.z};
    const Vec3 at = volume.voxel(position_mm(c, pitch_mm));
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  VoxelBox voxels;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int i = static_cast<int>(axis), count = volume.dims[axis];
    const auto inside = [&](double voxel) { return std::clamp(voxel, 0.0, static_cast<double>(count - 1)); };
    voxels.first[axis] = std::clamp(static_cast<int>(inside(low[i] - kRounding)), 0, std::max(0, count - 2));
    voxels.last[axis] = std::min(static_cast<int>(inside(high[i] + kRounding)) + 1, count - 1);
  }
  return voxels;
}

}  // namespace osteon::imaging
