// One run of a filter on a volume in a file, one thread: Osteon's or ITK's. Takes the filter, the dims of the volume,
// its file, and the file for the result; both files have int16 values only. The Gaussians have a sigma of one voxel.
// Prints the CPU seconds of the filter alone.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <utility>

#include "common/core/check.hpp"
#include "common/imaging/smoothing.hpp"
#include "tests/perf/baselines/itk_smoothing.hpp"

namespace osteon::test {
namespace {

using imaging::HuVolume;

bool always(double) { return true; }

// Into a volume of its own as the other filters do: the time includes the copy.
baselines::ItkResult ours(const HuVolume& volume, bool gaussian) {
  const std::clock_t start = std::clock();
  HuVolume out = volume;
  OSTEON_CHECK(gaussian ? imaging::smooth_gaussian(out, 1.0, always)
                        : imaging::smooth_median(out, imaging::MedianBox::volume, always));
  return {std::move(out.values), static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC};
}

int run(const std::string& name, const HuVolume& volume, const char* to) {
  baselines::ItkResult result;
  if (name == "ours_gaussian" || name == "ours_median") {
    result = ours(volume, name == "ours_gaussian");
  } else {
    const auto found = std::ranges::find(baselines::kItkFilters, name);
    OSTEON_CHECK(found != baselines::kItkFilters.end());
    const auto filter = static_cast<baselines::ItkFilter>(found - baselines::kItkFilters.begin());
    result = baselines::itk_filtered(volume, filter);
  }
  const auto bytes = static_cast<std::streamsize>(result.values.size() * sizeof(std::int16_t));
  std::ofstream(to, std::ios::binary).write(reinterpret_cast<const char*>(result.values.data()), bytes);
  std::printf("%.6f\n", result.seconds);
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr, "usage: osteon-smoothing-bench FILTER COLUMNS ROWS SLICES FROM TO\n");
    return 1;
  }
  osteon::imaging::HuVolume volume;
  for (std::size_t axis = 0; axis < 3; ++axis) volume.dims[axis] = std::atoi(argv[2 + axis]);
  volume.values.resize(volume.count());
  const auto bytes = static_cast<std::streamsize>(volume.count() * sizeof(std::int16_t));
  if (!std::ifstream(argv[5], std::ios::binary).read(reinterpret_cast<char*>(volume.values.data()), bytes)) {
    std::fprintf(stderr, "osteon-smoothing-bench: %s has fewer voxels than the dims say\n", argv[5]);
    return 1;
  }
  return osteon::test::run(argv[1], volume, argv[6]);
}
