#include "common/volume/iso_surface.hpp"

#include <algorithm>
#include <span>

#include "common/core/check.hpp"
#include "common/volume/narrow_band.hpp"

namespace osteon {

Result<DenseVolume<float>> signed_distance_mm(const DenseVolume<float>& field, float iso, double pitch_mm,
                                              const KeepGoing& keep_going) {
  OSTEON_CHECK(!field.box.empty() && pitch_mm > 0);
  const auto each_row = [&](const CoordBox& part, auto visit) {
    const auto row = static_cast<std::size_t>(part.dims().z);
    for (int x = part.min.x; x <= part.max.x; ++x)
      for (int y = part.min.y; y <= part.max.y; ++y)
        if (!visit(std::span(&field.values[field.index({x, y, part.min.z})], row))) return;
  };
  SampledField parts{.box = field.box, .inside = {}, .read = {}};
  parts.inside = [&](const CoordBox& part) {
    bool any = false, all = true;
    each_row(part, [&](std::span<const float> row) {
      for (const float value : row) {
        any = any || value >= iso;
        all = all && value >= iso;
      }
      return !any || all;
    });
    return all ? Inside::all : any ? Inside::some : Inside::none;
  };
  parts.read = [&](const CoordBox& part, std::span<float> values) {
    float* to = values.data();
    each_row(part, [&](std::span<const float> row) {
      to = std::ranges::copy(row, to).out;
      return true;
    });
  };
  const auto band = narrow_band_mm(parts, iso, pitch_mm, keep_going);
  if (!band) return tl::unexpected(band.error());
  DenseVolume<float> out;
  out.box = field.box;
  out.values.resize(field.values.size());
  band->gather(out.box, out.values);
  return out;
}

}  // namespace osteon
