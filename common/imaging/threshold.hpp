// Suggests a threshold between soft tissue and bone for a scan.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/imaging/hu_volume.hpp"

namespace osteon::imaging {

// Number of voxels of each HU from kLeastHu on.
inline constexpr int kLeastHu = -32768;
inline constexpr int kHuValues = 65536;

// Error: cancelled.
[[nodiscard]] Result<std::vector<std::int64_t>> hu_histogram(const HuVolume& volume, const KeepGoing& keep_going);

struct TissueClass {
  double mean_hu = 0.0, deviation_hu = 0.0;
  double part = 0.0;  // of the voxels that count
};

struct ThresholdSuggestion {
  double threshold_hu = 0.0;
  TissueClass soft, bone;
  std::string reason;  // one sentence for a person
};

// The threshold with the fewest errors if soft tissue and bone have normal distributions of their own width and size
// (Kittler 1986). Otsu's threshold (Otsu 1979) assumes equal widths, and so lies too high: bone is the wider class.
// Only voxels from fat to compact bone count, so that neither air around the patient nor metal moves the threshold.
// Contrast medium counts as bone. `histogram`: of hu_histogram(). Error: invalid_input (no bone beside soft tissue).
[[nodiscard]] Result<ThresholdSuggestion> suggest_threshold(std::span<const std::int64_t> histogram);

}  // namespace osteon::imaging
