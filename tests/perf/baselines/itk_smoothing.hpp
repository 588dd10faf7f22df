// Baselines of the filters that take noise out of a scan: those of ITK, with one thread. RankImageFilter, which also
// gives a median, takes twice as long as MedianImageFilter.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/imaging/hu_volume.hpp"

namespace osteon::baselines {

enum class ItkFilter {
  gaussian,            // by its discrete weights, which differ from samples of a Gaussian
  recursive_gaussian,  // approximated: its cost does not depend on sigma
  median,              // of 3 x 3 x 3 voxels
};
inline constexpr std::array<std::string_view, 3> kItkFilters{"gaussian", "recursive_gaussian", "median"};

struct ItkResult {
  std::vector<std::int16_t> values;  // of the filtered volume, in its order
  double seconds = 0.0;              // CPU time of the filter alone
};

// `sigma_voxels`: of the Gaussians, along each axis.
[[nodiscard]] ItkResult itk_filtered(const imaging::HuVolume& volume, ItkFilter filter, double sigma_voxels = 1.0);

}  // namespace osteon::baselines
