// A feed rig drills across the shaft of a phantom femur, and across that of the import of its scan.
#pragma once
#include <filesystem>
#include <map>

#include "common/core/result.hpp"

namespace osteon::haptic::test {

inline constexpr double kPhantomFeed_mm_per_s = 2.0, kPhantomSpindle_rpm = 1000.0;

// Mean thrusts, N, at each half millimetre of the way of the tip.
using Thrusts = std::map<int, double>;

struct DrilledPhantom {
  Thrusts direct, scanned;          // of the phantom, and of what was imported
  int middle = 0;                   // where the middle of the canal is
  double difference_percent = 0.0;  // mean of the differences, of the mean thrust of the phantom
};

// A femur of the preset "male", at the middle of its shaft; the scan is that of test::scanned_and_imported(), in the
// folder. Errors: those of scan and import, and internal if a drill does not end.
[[nodiscard]] Result<DrilledPhantom> drill_phantom_and_scan(const std::filesystem::path& folder);

}  // namespace osteon::haptic::test
