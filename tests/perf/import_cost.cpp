// What the import of a CT costs, beside ITK. `phantom SLICES FOLDER` writes the phantom of a trunk as a DICOM series of
// 512 x 512 voxels. `itk FOLDER` runs the baseline once and prints JSON. Others measure CPU time and memory.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

#include "common/imaging/calibration.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/perf/baselines/itk_chain.hpp"

namespace osteon::test {
namespace {

constexpr int kColumns = 512;
constexpr double kPixel_mm = 0.75, kSlice_mm = 1.0;
constexpr double kBodyX_mm = 175.0, kBodyY_mm = 125.0;  // half axes of the body
constexpr double kRibsX_mm = 150.0, kRibsY_mm = 100.0;  // of the ring of each pair of ribs
constexpr double kRib_mm = 6.0, kRibGap_mm = 25.0, kRibFall_mm = 30.0;
constexpr double kSpine_mm = 18.0, kSternum_mm = 10.0, kCortex_mm = 1.8;
constexpr double kAir_hu = -1000.0, kTissue_hu = 40.0, kCancellous_hu = 160.0, kCortical_hu = 1100.0;

bool always(double) { return true; }

// Noise with the spread of a scan: the sum of four bytes has a standard deviation of 148.
class Noise {
 public:
  double hu() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    state_ ^= state_ << 17;
    double sum = 0.0;
    for (int byte = 0; byte < 4; ++byte) sum += static_cast<double>(state_ >> (8 * byte) & 0xff);
    return (sum - 510.0) * (15.0 / 148.0);
  }

 private:
  std::uint64_t state_ = 88172645463325252u;
};

// What all slices have in common at one pixel.
struct Pixel {
  double body_mm, spine_mm, sternum_mm;  // distance beyond each
  double ribs_mm, rib_z_mm;              // distance from the ribs' ring, and its height
};

std::vector<Pixel> pixels() {
  std::vector<Pixel> made;
  for (int row = 0; row < kColumns; ++row)
    for (int column = 0; column < kColumns; ++column) {
      const double x = (column - 0.5 * (kColumns - 1)) * kPixel_mm, y = (row - 0.5 * (kColumns - 1)) * kPixel_mm;
      const auto beyond = [&](double a, double b) { return (std::hypot(x / a, y / b) - 1.0) * std::min(a, b); };
      const double angle = std::atan2(y / kRibsY_mm, x / kRibsX_mm);
      const double ring_mm = std::hypot(kRibsX_mm * std::cos(angle), kRibsY_mm * std::sin(angle));
      made.push_back({beyond(kBodyX_mm, kBodyY_mm), std::hypot(x, y - kRibsY_mm) - kSpine_mm,
                      std::hypot(x, y + kRibsY_mm) - kSternum_mm, std::hypot(x, y) - ring_mm,
                      0.5 * kRibFall_mm * std::sin(angle)});
    }
  return made;
}

// A bone has a cortex and cancellous bone within. Edges are as wide as a pixel.
double bone_hu(double beyond_mm) {
  const auto within = [](double distance_mm) { return std::clamp(0.5 - distance_mm / kPixel_mm, 0.0, 1.0); };
  const double inner = within(beyond_mm + kCortex_mm);
  return within(beyond_mm) * (kCortical_hu - kTissue_hu) - inner * (kCortical_hu - kCancellous_hu);
}

imaging::HuVolume trunk(int slices) {
  const std::vector<Pixel> common = pixels();
  imaging::HuVolume scan;
  scan.dims = {kColumns, kColumns, slices};
  scan.spacing_mm = {kPixel_mm, kPixel_mm, kSlice_mm};
  scan.values.reserve(scan.count());
  Noise noise;
  for (int slice = 0; slice < slices; ++slice)
    for (const Pixel& p : common) {
      double hu = p.body_mm < 0.0 ? kTissue_hu : kAir_hu;
      if (p.body_mm < 0.0) {
        const double z_mm = slice * kSlice_mm - p.rib_z_mm;
        const double rib_mm = std::hypot(p.ribs_mm, std::remainder(z_mm, kRibGap_mm)) - kRib_mm;
        hu += bone_hu(std::min({p.spine_mm, p.sternum_mm, rib_mm}));
      }
      scan.values.push_back(static_cast<std::int16_t>(std::lround(hu + noise.hu())));
    }
  return scan;
}

int write_phantom(int slices, const std::string& folder) {
  const auto written = import::write_dicom_series(trunk(slices), folder, always);
  if (!written) std::fprintf(stderr, "osteon-import-cost: %s\n", written.error().message.c_str());
  return written ? 0 : 1;
}

int run_itk(const std::string& folder) {
  const baselines::ItkBone bone = baselines::itk_chain(folder, imaging::kBoneThreshold_hu);
  std::printf("{\"dims\": [%d, %d, %d], \"pitch_mm\": %.6g, \"volume_mm3\": %.6g}\n", bone.dims[0], bone.dims[1],
              bone.dims[2], bone.pitch_mm, bone.volume_mm3);
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) try {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "phantom" && argc == 4) return osteon::test::write_phantom(std::atoi(argv[2]), argv[3]);
  if (what == "itk" && argc == 3) return osteon::test::run_itk(argv[2]);
  std::fprintf(stderr, "usage: osteon-import-cost phantom SLICES FOLDER | itk FOLDER\n");
  return 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "osteon-import-cost: %s\n", error.what());
  return 1;
}
