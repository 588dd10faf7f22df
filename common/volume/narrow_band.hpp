// Computes the signed distance near a surface only: the narrow band of a field that is read part by part.
#pragma once
#include <functional>
#include <span>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon {

// How many samples of a part are inside the surface.
enum class Inside { none, some, all };

// A field over a box of samples. Several threads call its functions at once.
struct SampledField {
  CoordBox box;
  // Inside is where field >= iso. `some` may be the answer for any part; then the part is read.
  std::function<Inside(const CoordBox& part)> inside;
  std::function<void(const CoordBox& part, std::span<float> values)> read;  // z fastest
};

// The distance as signed_distance_mm() of a dense field gives it, with the same bytes. A leaf without a sample of the
// band is a constant: 4 pitches outside, which is the background, and -4 inside. Only samples of the box are defined.
// The memory grows with the surface, not with the box. Errors: cancelled, internal.
[[nodiscard]] Result<SparseVolume> narrow_band_mm(const SampledField& field, float iso, double pitch_mm,
                                                  const KeepGoing& keep_going);

}  // namespace osteon
