// Size on the disk and load time of a case with its scan, beside the same bone in a case of schema 1. Takes the case's
// folder and prints JSON. Sizes are in bytes. Times are medians in milliseconds, of files that were read before.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "common/core/check.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

constexpr int kRounds = 9;

template <class Work>
double ms_of(Work work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

// The same bone with the description that schema 1 has.
Case in_schema_1(const Case& bone) {
  const CaseInfo& now = bone.info();
  CaseInfo info{.title = now.title,
                .source = now.source,
                .pitch_mm = now.pitch_mm,
                .calibration = now.calibration,
                .threshold_hu = now.threshold_hu};
  info.schema_version = 1;
  const FillPart fill = [&](const CoordBox& part, PartSamples& to) {
    bone.gather_surface(part, to.surface_mm);
    bone.gather_density(part, to.density_g_cm3);
    for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
      for (std::int32_t y = part.min.y; y <= part.max.y; ++y)
        for (std::int32_t z = part.min.z; z <= part.max.z; ++z) {
          to.bone.push_back(static_cast<std::uint8_t>(bone.bone_number({x, y, z})));
          to.tissue.push_back(bone.tissue({x, y, z}));
        }
    return PartKind::samples;
  };
  const auto built = Case::build(info, bone.bounds_samples(), fill);
  OSTEON_CHECK(built.has_value());
  return *built;
}

double bytes_of(const fs::path& folder) {
  double bytes = 0.0;
  for (const auto& entry : fs::directory_iterator(folder)) bytes += static_cast<double>(entry.file_size());
  return bytes;
}

int run(const fs::path& folder) {
  const auto bone = Case::load(folder);
  if (!bone) {
    std::fprintf(stderr, "osteon-case-load: %s\n", bone.error().message.c_str());
    return 1;
  }
  const test::TempDir temp;
  OSTEON_CHECK(in_schema_1(*bone).save(temp / "earlier"));
  std::vector<double> now_ms, earlier_ms, scan_ms;
  for (int round = 0; round < kRounds; ++round) {
    now_ms.push_back(ms_of([&] { OSTEON_CHECK(Case::load(folder)); }));
    earlier_ms.push_back(ms_of([&] { OSTEON_CHECK(Case::load(temp / "earlier")); }));
    scan_ms.push_back(ms_of([&] { OSTEON_CHECK(load_scan(folder, *bone)); }));
  }
  std::printf(
      "{\"bytes\": %.0f, \"scan_bytes\": %.0f, \"earlier_bytes\": %.0f, \"voxels\": %zu, \"load_ms\": %.3f, "
      "\"earlier_load_ms\": %.3f, \"scan_load_ms\": %.3f}\n",
      bytes_of(folder), static_cast<double>(fs::file_size(folder / kScanFile)), bytes_of(temp / "earlier"),
      bone->info().scan->geometry.count(), median(now_ms), median(earlier_ms), median(scan_ms));
  return 0;
}

}  // namespace
}  // namespace osteon

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "osteon-case-load: needs the folder of a case\n");
    return 1;
  }
  return osteon::run(argv[1]);
}
