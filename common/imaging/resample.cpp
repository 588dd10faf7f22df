#include "common/imaging/resample.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::imaging {
namespace {

// The two neighbours along one axis and how far the point lies from the first to the second.
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

}  // namespace

Result<DenseVolume<float>> resample(const HuVolume& volume, const CoordBox& box, double pitch_mm,
                                    const KeepGoing& keep_going) {
  DenseVolume<float> out;
  out.box = box;
  const Coord dims = box.dims();
  out.values.resize(static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z));
  const std::int16_t* hu = volume.values.data();
  const std::ptrdiff_t row_step = volume.dims[0];
  const std::ptrdiff_t slice_step = row_step * volume.dims[1];

  float* value = out.values.data();
  for (int x = box.min.x; x <= box.max.x; ++x) {
    if (!keep_going(static_cast<double>(x - box.min.x) / dims.x))
      return failure(ErrorCode::cancelled, "stopped while resampling the scan");
    for (int y = box.min.y; y <= box.max.y; ++y) {
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = volume.voxel(position_mm({x, y, z}, pitch_mm));
        const Bracket i = bracket(at.x(), volume.dims[0]);
        const Bracket j = bracket(at.y(), volume.dims[1]);
        const Bracket k = bracket(at.z(), volume.dims[2]);
        const auto along_columns = [&](std::ptrdiff_t row, std::ptrdiff_t slice) {
          const std::int16_t* line = hu + row * row_step + slice * slice_step;
          return mix(line[i.low], line[i.high], i.part);
        };
        *value++ = static_cast<float>(mix(mix(along_columns(j.low, k.low), along_columns(j.high, k.low), j.part),
                                          mix(along_columns(j.low, k.high), along_columns(j.high, k.high), j.part), k.part));
      }
    }
  }
  return out;
}

}  // namespace osteon::imaging
