// Dice and distances of shapes whose agreement has a closed form, and the labels that are compared with one another.
#include "server/import/label_comparison.hpp"

#include <cmath>
#include <numbers>

#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/label_files.hpp"

namespace osteon::import {
namespace {

template <class Inside>
imaging::VoxelMask mask_where(std::array<int, 3> dims, Inside inside) {
  imaging::VoxelMask mask(dims);
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x) mask.at(x, y, z) = inside(x, y, z) ? 1 : 0;
  return mask;
}

imaging::VoxelMask box_mask(int first_x, const std::array<int, 3>& size) {
  return mask_where({24, 20, 20}, [&](int x, int y, int z) {
    return x >= first_x && x < first_x + size[0] && y >= 4 && y < 4 + size[1] && z >= 4 && z < 4 + size[2];
  });
}

// Two boxes, one a voxel further along x. Of a box, the first layer has no voxel of the other, and the last layer lies
// within the other, but for its rim on the other's sides. All their other surface voxels coincide.
TEST(Agreement, OfShiftedBoxesHasAClosedForm) {
  const std::array<int, 3> size{9, 6, 5};
  const Vec3 spacing(0.4, 0.7, 2.0);
  const auto found = agreement_of(box_mask(5, size), box_mask(6, size), spacing, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_DOUBLE_EQ(found->dice, (size[0] - 1.0) / size[0]);
  const double surface = size[0] * size[1] * size[2] - (size[0] - 2) * (size[1] - 2) * (size[2] - 2);
  const double apart = size[1] * size[2] + (size[1] - 2) * (size[2] - 2);
  EXPECT_NEAR(found->mean_mm.value(), 0.4 * apart / surface, 1e-6);
  EXPECT_NEAR(found->percentile95_mm.value(), 0.4, 1e-6);
}

// One ball within another: every point of a surface is as far from the other one as the radii differ.
TEST(Agreement, OfBallsWithOneCentreIsTheDifferenceOfTheirRadii) {
  const auto ball = [](double radius) {
    return mask_where({44, 44, 44},
                      [&](int x, int y, int z) { return (Vec3(x, y, z) - Vec3::Constant(21.5)).norm() <= radius; });
  };
  const double small = 15.0, large = 19.0, spacing = 0.5;
  const auto found = agreement_of(ball(small), ball(large), Vec3::Constant(spacing), keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->dice, 2.0 * std::pow(small, 3) / (std::pow(small, 3) + std::pow(large, 3)), 0.008);
  // Centres of surface voxels lie up to a voxel within the ball, and the nearest one is taken.
  EXPECT_NEAR(found->mean_mm.value(), spacing * (large - small), 0.3 * spacing);
  EXPECT_NEAR(found->percentile95_mm.value(), spacing * (large - small), 0.6 * spacing);
}

// Two balls of radius r whose centres are d apart. Their lens has π (4r + d)(2r - d)²/12. A point at the angle with
// the cosine u is |√(r² + d² - 2 r d u) - r| from the other surface.
TEST(Agreement, OfShiftedBallsIsThatOfTheirLens) {
  const double r = 17.0, d = 6.0;
  const auto ball = [&](double x0) {
    return mask_where({50, 44, 44},
                      [&](int x, int y, int z) { return (Vec3(x, y, z) - Vec3(x0, 21.5, 21.5)).norm() <= r; });
  };
  const auto found = agreement_of(ball(20.5), ball(20.5 + d), Vec3::Ones(), keep_going);
  ASSERT_TRUE(found) << found.error().message;
  const double lens = std::numbers::pi * (4.0 * r + d) * std::pow(2.0 * r - d, 2) / 12.0;
  EXPECT_NEAR(found->dice, lens / (4.0 / 3.0 * std::numbers::pi * r * r * r), 0.003);
  double mean = 0.0;
  std::vector<double> all;
  for (int i = 0; i < 20000; ++i) {
    const double u = -1.0 + (i + 0.5) / 10000.0;  // equal areas
    all.push_back(std::abs(std::sqrt(r * r + d * d - 2.0 * r * d * u) - r));
    mean += all.back() / 20000.0;
  }
  std::ranges::sort(all);
  EXPECT_NEAR(found->mean_mm.value(), mean, 0.15);
  EXPECT_NEAR(found->percentile95_mm.value(), all[19000], 0.4);
  std::printf("[          ] mean %.3f of %.3f, 95 %% %.3f of %.3f voxels\n", *found->mean_mm, mean,
              *found->percentile95_mm, all[19000]);
}

TEST(Agreement, IsPerfectWithItselfAndNoneWithNothing) {
  const imaging::VoxelMask box = box_mask(5, {9, 6, 5}), nothing({24, 20, 20});
  const auto same = agreement_of(box, box, Vec3::Ones(), keep_going);
  ASSERT_TRUE(same);
  EXPECT_EQ(same->dice, 1.0);
  EXPECT_EQ(same->mean_mm, 0.0);
  EXPECT_EQ(same->percentile95_mm, 0.0);
  const auto none = agreement_of(box, nothing, Vec3::Ones(), keep_going);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->dice, 0.0);
  EXPECT_FALSE(none->mean_mm);
}

// Two slabs that fill the scan across, one thicker than the other. Only their free faces are surfaces.
TEST(Agreement, TheEndOfTheScanIsNoSurface) {
  const auto slab = [](int high) { return mask_where({8, 8, 20}, [&](int, int, int z) { return z < high; }); };
  const auto found = agreement_of(slab(9), slab(12), Vec3(1.0, 1.0, 0.5), keep_going);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->mean_mm.value(), 1.5, 1e-6);
  EXPECT_NEAR(found->percentile95_mm.value(), 1.5, 1e-6);
}

TEST(Agreement, StopsWhenAsked) {
  const imaging::VoxelMask box = box_mask(5, {9, 6, 5});
  const auto stopped = agreement_of(box, box, Vec3::Ones(), [](double) { return false; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
}

// A scan of 20 x 20 x 10 voxels, of which the case keeps a part.
struct TwoLabellings {
  std::vector<std::uint8_t> labels = std::vector<std::uint8_t>(8 * 8 * 6, 0);  // of the case's scan
  TruthLabels truth{.scan = {{20, 20, 10}, Vec3::Zero(), Eigen::Matrix3d::Identity()},
                    .box = {{0, 0, 0}, {19, 19, 9}},
                    .values = std::vector<std::uint8_t>(20 * 20 * 10, 0),
                    .labels = {}};
  [[nodiscard]] CaseScan scan() const {
    return {.geometry = {{8, 8, 6}, Vec3(6.0, 6.0, 2.0), Eigen::Matrix3d::Identity()}, .labels = SparseBytes(labels)};
  }
  // Voxels of the whole scan.
  void draw(int x0, int x1, std::uint8_t ours, std::uint8_t theirs) {
    for (int z = 3; z < 7; ++z)
      for (int y = 7; y < 12; ++y)
        for (int x = x0; x <= x1; ++x) {
          if (ours != 0) labels[static_cast<std::size_t>(((z - 2) * 8 + y - 6) * 8 + x - 6)] = ours;
          if (theirs != 0) truth.values[static_cast<std::size_t>((z * 20 + y) * 20 + x)] = theirs;
        }
  }
};

TEST(CompareLabels, FindsThemByNameAndThenByNumber) {
  TwoLabellings l;
  l.draw(7, 8, 1, 9);
  l.draw(9, 10, 2, 2);
  l.draw(11, 12, 3, 0);
  l.truth.labels = {{2, "label 2"}, {9, "Femur"}, {5, "patella"}};
  const std::vector<CaseLabel> labels{{1, "femur"}, {2, "tibia"}, {3, "fibula"}};
  const auto found = compare_labels(l.scan(), labels, l.truth, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->labels.size(), 4u);
  EXPECT_EQ(found->labels[0].truth, "Femur");
  EXPECT_EQ(found->labels[0].agreement.dice, 1.0);
  EXPECT_EQ(found->labels[0].matched, MatchedBy::name);
  EXPECT_EQ(found->labels[1].truth, "label 2");
  EXPECT_EQ(found->labels[1].matched, MatchedBy::number);
  EXPECT_EQ(found->labels[1].agreement.dice, 1.0);
  EXPECT_EQ(found->labels[2].truth, "");
  EXPECT_EQ(found->labels[2].matched, MatchedBy::nothing);
  EXPECT_EQ(found->labels[3].name, "all bone");
  EXPECT_NEAR(found->labels[3].agreement.dice, 2.0 * 4.0 / (6.0 + 4.0), 1e-12);
  EXPECT_EQ(found->missing, std::vector<std::string>{"patella"});
  const std::string text = comparison_text(*found);
  EXPECT_NE(text.find("fibula: the truth has no such label"), std::string::npos) << text;
  EXPECT_NE(text.find("the case has no patella"), std::string::npos) << text;
  EXPECT_NE(text.find("  femur, with Femur, by name\n"), std::string::npos) << text;
  EXPECT_NE(text.find("  tibia, with label 2, by number\n"), std::string::npos) << text;
}

TEST(CompareLabels, NamesDecideWhereBothHaveOne) {
  TwoLabellings l;
  l.draw(7, 8, 1, 2);
  l.draw(9, 10, 2, 1);
  l.draw(11, 12, 3, 3);
  l.truth.labels = {{1, "tibia_left"}, {2, "Femur, left"}, {3, "patella"}};
  const auto found =
      compare_labels(l.scan(), {{1, "left femur"}, {2, "left tibia"}, {3, "fibula"}}, l.truth, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  for (const auto& [row, name] : {std::pair{0, "Femur, left"}, std::pair{1, "tibia_left"}}) {
    const ComparedLabel& label = found->labels[static_cast<std::size_t>(row)];
    EXPECT_EQ(label.truth, name);
    EXPECT_EQ(label.matched, MatchedBy::name);
    EXPECT_EQ(label.agreement.dice, 1.0) << name;
  }
  EXPECT_EQ(found->labels[2].truth, "") << "number 3 is another bone by its name";
  EXPECT_EQ(found->missing, std::vector<std::string>{"patella"});
}

// What one label found by its name is not found again by the number of another.
TEST(CompareLabels, ANumberDoesNotTakeWhatANameHas) {
  TwoLabellings l;
  l.draw(7, 8, 1, 2);
  l.draw(9, 10, 2, 0);
  l.truth.labels = {{2, "femur"}};
  const auto found = compare_labels(l.scan(), {{1, "femur"}, {2, "bone 2"}}, l.truth, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->labels[0].truth, "femur");
  EXPECT_EQ(found->labels[1].truth, "");
}

// A knee's truth has a label for each tissue. Its bones are those of the case, by name or by their place.
TEST(CompareLabels, TissuesOfABoneCountTogether) {
  TwoLabellings l;
  l.draw(7, 7, 1, 1);
  l.draw(8, 8, 1, 2);
  l.draw(9, 9, 2, 4);
  l.draw(10, 10, 2, 5);
  l.draw(11, 11, 2, 6);
  l.draw(12, 12, 0, 8);
  l.truth.labels = {{1, "femur, cortical", LabelKind::cortical}, {2, "femur, cancellous", LabelKind::cancellous},
                    {4, "tibia, cortical", LabelKind::cortical}, {5, "tibia, cancellous", LabelKind::cancellous},
                    {6, "tibia, marrow", LabelKind::cancellous}, {8, "tibial cartilage", LabelKind::cartilage}};
  const std::vector<CaseLabel> numbered{{1, "bone 1"}, {2, "bone 2"}}, named{{1, "femur"}, {2, "Tibia"}};
  for (const bool by_name : {true, false}) {
    const auto found = compare_labels(l.scan(), by_name ? named : numbered, l.truth, keep_going);
    ASSERT_TRUE(found) << found.error().message;
    ASSERT_EQ(found->labels.size(), 3u);
    for (const std::size_t row : {0u, 1u}) {
      EXPECT_EQ(found->labels[row].truth, row == 0 ? "femur" : "tibia");
      EXPECT_EQ(found->labels[row].matched, by_name ? MatchedBy::name : MatchedBy::number);
      EXPECT_EQ(found->labels[row].agreement.dice, 1.0);
    }
    EXPECT_EQ(found->missing, std::vector<std::string>{"tibial cartilage"});
  }
}

// The other way round: the case tells tissues apart, and the truth does not.
TEST(CompareLabels, TissuesOfTheCaseCountTogetherToo) {
  TwoLabellings l;
  l.draw(7, 7, 1, 3);
  l.draw(8, 9, 2, 3);
  l.draw(10, 10, 0, 3);
  l.truth.labels = {{3, "femur"}};
  const auto found = compare_labels(
      l.scan(), {{1, "femur, cortical", LabelKind::cortical}, {2, "femur, cancellous", LabelKind::cancellous}}, l.truth,
      keep_going);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->labels.size(), 4u);
  EXPECT_EQ(found->labels[0].truth, "");
  EXPECT_EQ(found->labels[1].truth, "");
  EXPECT_EQ(found->labels[2].name, "femur");
  EXPECT_EQ(found->labels[2].truth, "femur");
  EXPECT_NEAR(found->labels[2].agreement.dice, 2.0 * 3.0 / (3.0 + 4.0), 1e-12);
  EXPECT_TRUE(found->missing.empty());
}

// Labels of one bone without its name, as a phantom of one bone has them.
TEST(CompareLabels, TissuesWithoutANameAreOneBone) {
  TwoLabellings l;
  l.draw(7, 8, 1, 1);
  l.draw(9, 10, 1, 2);
  l.truth.labels = {{1, "cortical", LabelKind::cortical}, {2, "marrow", LabelKind::cancellous}};
  const auto found = compare_labels(l.scan(), {{1, "bone 1"}}, l.truth, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->labels[0].truth, "bone");
  EXPECT_EQ(found->labels[0].agreement.dice, 1.0);
  EXPECT_TRUE(found->missing.empty());
}

// Bone that the case left out together with its part of the scan is missing all the same.
TEST(CompareLabels, CountsBoneBeyondTheScanThatTheCaseKeeps) {
  TwoLabellings l;
  l.draw(7, 12, 1, 1);
  l.draw(14, 19, 0, 1);
  l.truth.labels = {{1, "femur"}};
  const auto found = compare_labels(l.scan(), {{1, "femur"}}, l.truth, keep_going);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->labels[0].agreement.dice, 2.0 * 6.0 / (6.0 + 12.0), 1e-12);
  EXPECT_NEAR(found->labels[0].truth_cm3, 2.0 * found->labels[0].volume_cm3, 1e-12);
}

// The program, with numbers that nobody named: the case's bone is a block, the truth is half of it.
TEST(CompareLabels, TheProgramPrintsIt) {
  const test::TempDir folder;
  const TestGrid grid{.dims = {30, 26, 22}, .origin_mm = {-15.0, -13.0, 40.0}, .axes_mm = Eigen::Matrix3d::Identity()};
  const auto block = [](const Vec3& p, double from_x) {
    return p.x() > from_x && p.x() < 8.0 && std::abs(p.y()) < 6.0 && p.z() > 45.0 && p.z() < 57.0;
  };
  NiftiVoxels ct{.code = 4, .bits = 16, .bytes = {}};
  std::vector<int> hu;
  for (const int bone : labels_of(grid, [&](const Vec3& p) { return block(p, -8.5) ? 1 : 0; }))
    hu.push_back(bone != 0 ? 900 : 0);
  ct.bytes = bytes_of<std::int16_t>(hu);
  write_bytes(folder / "ct.nii", nifti_file(grid, ct));
  write_bytes(folder / "truth.nii", nifti_file(grid, [&](const Vec3& p) { return block(p, -0.5) ? 1 : 0; }));
  const auto made =
      test::run(OSTEON_IMPORT_PROGRAM, {"ct", (folder / "ct.nii").string(), "--out", (folder / "case").string(),
                                        "--truth", (folder / "truth.nii").string()});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  // 16 columns, of which the truth has 8.
  EXPECT_NE(made.out.find("truth        Dice"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("           0.6667  "), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("bone 1, with label 1, by number"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("all bone"), std::string::npos) << made.out;
}

}  // namespace
}  // namespace osteon::import
