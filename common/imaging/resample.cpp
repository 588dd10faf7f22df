#include "common/imaging/resample.hpp"

#include <algorithm>
#include <cmath>
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

// Trilinear between the eight voxels of three brackets.
double interpolate(const HuVolume& volume, const Bracket& i, const Bracket& j, const Bracket& k) {
  const std::ptrdiff_t row_step = volume.dims[0], slice_step = row_step * volume.dims[1];
  const auto along_columns = [&](std::ptrdiff_t row, std::ptrdiff_t slice) {
    const std::int16_t* line = volume.values.data() + row * row_step + slice * slice_step;
    return mix(line[i.low], line[i.high], i.part);
  };
  return mix(mix(along_columns(j.low, k.low), along_columns(j.high, k.low), j.part),
             mix(along_columns(j.low, k.high), along_columns(j.high, k.high), j.part), k.part);
}

// For columns, rows and slices along x, y and z. Then each bracket depends on one coordinate only.
void resample_aligned(const HuVolume& volume, const CoordBox& box, double pitch_mm, float* out) {
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
      for (const Bracket& k : z) *out++ = static_cast<float>(interpolate(volume, i, j, k));
}

}  // namespace

void resample(const HuVolume& volume, const CoordBox& box, double pitch_mm, std::span<float> out) {
  const Coord dims = box.dims();
  OSTEON_CHECK(out.size() ==
               static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z));
  if (volume.directions.isDiagonal(1e-12)) return resample_aligned(volume, box, pitch_mm, out.data());
  float* value = out.data();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = volume.voxel(position_mm({x, y, z}, pitch_mm));
        *value++ = static_cast<float>(interpolate(volume, bracket(at.x(), volume.dims[0]),
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
  for (int x = box.min.x; x <= box.max.x; ++x) {
    const int done = x - box.min.x;
    if (!keep_going(static_cast<double>(done) / dims.x)) return stopped_while("resampling the scan");
    const CoordBox slice{{x, box.min.y, box.min.z}, {x, box.max.y, box.max.z}};
    resample(volume, slice, pitch_mm, std::span(out.values).subspan(static_cast<std::size_t>(done) * plane, plane));
  }
  return out;
}

}  // namespace osteon::imaging
