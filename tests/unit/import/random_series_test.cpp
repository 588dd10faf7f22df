// Small scans of all kinds at thresholds on and between whole numbers. Every import ends within a bounded number of
// steps, with one clear sentence or a closed surface. It stops wherever it is asked to.
#include <algorithm>
#include <cmath>
#include <random>

#include "common/geometry/triangle_mesh.hpp"
#include "common/imaging/bone_field.hpp"
#include "server/import/bone_surface.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

const int kScans = static_cast<int>(test::trials(2000, 200));
// Most progress calls of one import. Each stands for a slice of a stage, or a hundredth of a second of the distance's
// threads.
constexpr int kMostQuestions = 20'000;

struct Drawn {
  imaging::HuVolume volume;
  double threshold_hu = 0.0;
  std::string what;
};

// Noise of three values round the threshold, a single value, all bone, no bone, checkerboards, and two blocks with a
// bridge of one voxel.
Drawn draw(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto integer = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  const auto length = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Drawn d;
  imaging::HuVolume& v = d.volume;
  const bool is_long = seed % 50 == 0;  // several slabs of the distance's threads
  v.dims = {is_long ? integer(100, 130) : integer(2, 12), integer(2, 12),
            seed % 9 == 0    ? 2
            : seed % 23 == 0 ? 1
                             : integer(3, 12)};
  v.spacing_mm = {length(0.6, 1.2), length(0.6, 1.2), length(0.6, 2.0)};
  if (seed % 3 == 0) v.spacing_mm = Vec3::Ones();
  v.values.resize(v.count());
  const int base = integer(-200, 1200);
  d.threshold_hu = base + (seed % 2 == 0 ? 0.0 : 0.5);
  const int step = std::array{1, 7, 700, 3000}[seed / 2 % 4];
  const int kind = integer(0, 6);
  d.what = "seed " + std::to_string(seed) + " kind " + std::to_string(kind);
  for (int k = 0; k < v.dims[2]; ++k)
    for (int j = 0; j < v.dims[1]; ++j)
      for (int i = 0; i < v.dims[0]; ++i) {
        int hu = 0;
        switch (kind) {
          case 0:
            hu = base + step * integer(-1, 1);
            break;
          case 1:
            hu = base;
            break;
          case 2:
            hu = base + 1 + integer(0, 500);
            break;
          case 3:
            hu = base - 1 - integer(0, 500);
            break;
          case 4:
            hu = (i + j + k) % 2 == 0 ? base : base - step;
            break;
          case 5:
            hu = (i < 4 || i > 6 || (j == 2 && k == 2)) ? base + integer(0, 1) : -1000;
            break;
          default:
            hu = (i > 1 && j > 1 && k > 0 && i < 9 && j < 9) ? base + step * integer(-1, 1) : -1000;
            break;
        }
        v.values[v.index(i, j, k)] = static_cast<std::int16_t>(std::clamp(hu, -32768, 32767));
      }
  return d;
}

TEST(RandomSeries, EveryImportEndsWithAClosedSurfaceOrASentence) {
  const auto tools = builtin_tool_box();
  int imported = 0, refused = 0, thin = 0;
  for (std::uint32_t seed = 0; seed < kScans; ++seed) {
    const Drawn d = draw(seed);
    SCOPED_TRACE(d.what);
    int questions = 0;
    const auto count = [&](double) { return ++questions < kMostQuestions; };
    const auto made =
        import_ct({d.volume, "test"},
                  {.threshold_hu = d.threshold_hu, .keep_all = seed % 5 == 0, .hollow = seed % 7 == 0}, count);
    ASSERT_LT(questions, kMostQuestions) << "the import does not end";
    const bool any = std::ranges::any_of(d.volume.values, [&](std::int16_t hu) { return hu >= d.threshold_hu; });
    if (!any) {
      ASSERT_FALSE(made);
    }
    if (!made) {
      // Bone without a sample in it is so thin that none of its voxels has a neighbour on both sides.
      expect_one_sentence(made.error(), "--threshold");
      const bool metal = std::ranges::any_of(d.volume.values, [](std::int16_t hu) { return hu >= imaging::kMetal_hu; });
      const bool no_bone = metal && made.error().message.find("is metal") != std::string::npos;
      if (any && !no_bone)
        EXPECT_NE(made.error().message.find("thinner than a sample"), std::string::npos) << made.error().message;
      thin += any && !no_bone ? 1 : 0;
      ++refused;
      continue;
    }
    ++imported;
    EXPECT_TRUE(std::isfinite(made->bone->volume_mm3()));
    const CutField field(*made->bone, BodyId{0}, tools);
    const auto mesh = bone_surface(field, keep_going);
    ASSERT_TRUE(mesh) << mesh.error().message;
    EXPECT_EQ(open_edges(*mesh), 0u);
  }
  std::printf("[          ] %d imported, %d refused (%d of them too thin), 0 hangs\n", imported, refused, thin);
  EXPECT_GT(imported, kScans / 2);
  EXPECT_LT(thin, kScans / 20);
  EXPECT_GT(refused, kScans / 20);
}

// The scan for which the import once never ended: air with a cube of 226 plus noise of three values, 700 apart, at the
// default threshold.
TEST(RandomSeries, TheCubeOnTheThresholdEnds) {
  std::mt19937 random(1);
  CtScan scan;
  scan.volume.dims = {32, 32, 32};
  scan.volume.values.assign(scan.volume.count(), -1000);
  for (int k = 6; k < 26; ++k)
    for (int j = 6; j < 26; ++j)
      for (int i = 6; i < 26; ++i)
        scan.volume.values[scan.volume.index(i, j, k)] =
            static_cast<std::int16_t>(226 + 700 * std::uniform_int_distribution<int>(-1, 1)(random));
  int questions = 0;
  const auto made = import_ct(std::move(scan), {}, [&](double) { return ++questions < kMostQuestions; });
  ASSERT_LT(questions, kMostQuestions);
  ASSERT_TRUE(made) << made.error().message;
}

TEST(RandomSeries, StopsAtEveryQuestionOfEveryStage) {
  int imported = 0;
  for (const std::uint32_t seed : {0u, 6u, 18u, 25u}) {
    const Drawn d = draw(seed);
    std::vector<double> fractions;
    const auto whole = import_ct({d.volume, "test"}, {.threshold_hu = d.threshold_hu}, [&](double done) {
      fractions.push_back(done);
      return true;
    });
    EXPECT_TRUE(std::ranges::is_sorted(fractions)) << "progress goes back";
    if (!whole) continue;
    ++imported;
    // The distance's threads report progress while they work, as often as the work takes. So the stop depends on the
    // fraction and not on the count.
    for (const double until : fractions) {
      bool stopped = false;
      const auto made = import_ct({d.volume, "test"}, {.threshold_hu = d.threshold_hu}, [&](double done) {
        EXPECT_FALSE(stopped && done > until + 0.02) << "the import went on after it was stopped";
        stopped = stopped || done >= until;
        return !stopped;
      });
      ASSERT_FALSE(made) << until;
      EXPECT_EQ(made.error().code, ErrorCode::cancelled);
    }
  }
  EXPECT_GE(imported, 2);
}

}  // namespace
}  // namespace osteon::import
