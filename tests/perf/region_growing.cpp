// CPU time of a fixed region in a large scan, beside ITK's. Takes an InVesalius project and a folder. It resamples the
// scan to 512 x 512 x 302 voxels and grows its largest bone from one seed, 5 times each in turn. Writes the voxels and
// the region into the folder, for others to do the same with. Prints JSON.
#include <algorithm>
#include <bitset>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/core/check.hpp"
#include "common/imaging/region_growing.hpp"
#include "server/import/inv3_reader.hpp"
#include "tests/perf/baselines/itk_flood.hpp"

namespace osteon::test {
namespace {

constexpr std::array<int, 3> kDims{512, 512, 302};
constexpr int kTurns = 5;

bool always(double) { return true; }

// Trilinear samples of the whole scan.
imaging::HuVolume enlarged(const imaging::HuVolume& scan) {
  struct Between {
    int low = 0, high = 0;
    float part = 0.0f;
  };
  std::array<std::vector<Between>, 3> at;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int i = 0; i < kDims[axis]; ++i) {
      const float x = static_cast<float>(i * (scan.dims[axis] - 1)) / static_cast<float>(kDims[axis] - 1);
      const int low = static_cast<int>(x);
      at[axis].push_back({low, std::min(low + 1, scan.dims[axis] - 1), x - static_cast<float>(low)});
    }
  imaging::HuVolume out;
  out.dims = kDims;
  out.values.reserve(out.count());
  const auto mix = [](float a, float b, float part) { return a + part * (b - a); };
  for (const Between& z : at[2])
    for (const Between& y : at[1])
      for (const Between& x : at[0]) {
        const auto row = [&](int j, int k) {
          return mix(static_cast<float>(scan.at(x.low, j, k)), static_cast<float>(scan.at(x.high, j, k)), x.part);
        };
        const float hu = mix(mix(row(y.low, z.low), row(y.high, z.low), y.part),
                             mix(row(y.low, z.high), row(y.high, z.high), y.part), z.part);
        out.values.push_back(static_cast<std::int16_t>(hu));
      }
  return out;
}

// The first voxel of the largest bone.
std::array<int, 3> seed_of(const imaging::HuVolume& volume) {
  imaging::VoxelMask bone(volume.dims);
  for (std::size_t i = 0; i < bone.values.size(); ++i)
    bone.values[i] = volume.values[i] >= imaging::kBoneThreshold_hu ? 1 : 0;
  const auto found = imaging::find_components(bone, std::bitset<256>(2), imaging::Connectivity::faces, always);
  OSTEON_CHECK(found && found->count > 0);
  const auto voxels = found->voxels();
  const auto largest = static_cast<std::uint32_t>(std::ranges::max_element(voxels) - voxels.begin());
  const auto run = std::ranges::find(found->runs, largest, &imaging::VoxelRun::component);
  return {run->first, run->row, run->slice};
}

template <class T>
void write(const std::filesystem::path& file, const std::vector<T>& values) {
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
  OSTEON_CHECK(out.good());
}

void print_ms(const char* name, const std::vector<double>& ms) {
  std::printf("\"%s\": [", name);
  for (std::size_t i = 0; i < ms.size(); ++i) std::printf("%s%.1f", i == 0 ? "" : ", ", ms[i]);
  std::printf("]");
}

int run(const std::string& project, const std::filesystem::path& folder) {
  const auto scan = import::read_inv3(project, always);
  OSTEON_CHECK(scan.has_value());
  const imaging::HuVolume volume = enlarged(scan->volume);
  const std::vector seeds{seed_of(volume)};
  const imaging::GrowingParams params;
  std::vector<double> ours_ms, itk_ms;
  imaging::VoxelMask region;
  bool same = true;
  for (int turn = 0; turn < kTurns; ++turn) {
    region = {};
    const std::clock_t start = std::clock();
    auto grown = imaging::grow_from_seeds(volume, seeds, params, always);
    ours_ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    OSTEON_CHECK(grown.has_value());
    region = std::move(grown->labels);
    const ItkFlood flood = itk_flood(volume.dims, volume.values, seeds[0], static_cast<std::int16_t>(params.low_hu),
                                     static_cast<std::int16_t>(params.high_hu));
    itk_ms.push_back(flood.ms);
    same = same && flood.mask == region.values;
  }
  write(folder / "scan.raw", volume.values);
  write(folder / "region.raw", region.values);
  std::printf("{\"dims\": [%d, %d, %d], \"seed\": [%d, %d, %d], \"low_hu\": %g, \"voxels\": %lld, \"same\": %s, ",
              kDims[0], kDims[1], kDims[2], seeds[0][0], seeds[0][1], seeds[0][2], params.low_hu,
              static_cast<long long>(std::ranges::count(region.values, std::uint8_t{1})), same ? "true" : "false");
  print_ms("ours_ms", ours_ms);
  std::printf(", ");
  print_ms("itk_ms", itk_ms);
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: osteon-region-growing PROJECT.inv3 FOLDER\n");
    return 2;
  }
  return osteon::test::run(argv[1], argv[2]);
}
