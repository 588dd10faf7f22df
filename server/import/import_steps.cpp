#include "server/import/import_steps.hpp"

#include <cstdio>

namespace osteon::import {

Result<void> check_lattice(const CoordBox& box, double pitch_mm) {
  const Coord dims = box.dims();
  const double samples = static_cast<double>(dims.x) * dims.y * dims.z;
  if (samples <= kLargestLattice) return {};
  char text[160];
  std::snprintf(text, sizeof text,
                "a pitch of %.3g mm needs %.0f million samples, more than %.0f million; give a larger --pitch",
                pitch_mm, samples * 1e-6, kLargestLattice * 1e-6);
  return failure(ErrorCode::invalid_input, text);
}

}  // namespace osteon::import
