// Beams of C-arms that a test knows to be possible.
#pragma once
#include "common/core/check.hpp"
#include "common/radiology/c_arm.hpp"

namespace osteon::radiology {

[[nodiscard]] inline ConeBeam good_beam(const CArm& arm) {
  const Result<ConeBeam> beam = beam_of(arm);
  OSTEON_CHECK(beam.has_value());
  return *beam;
}

}  // namespace osteon::radiology
