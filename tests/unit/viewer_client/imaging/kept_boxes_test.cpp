// The sub-volumes of what is kept, of boxes of known place and size.
#include "viewer_client/imaging/kept_boxes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

const KeepGoing kOn = [](double) { return true; };

// A foot with a notch and a shaft on it are island 1. A small block beside them is island 2.
constexpr CoordBox kFoot{{8, 6, 2}, {27, 25, 7}}, kNotch{{18, 16, 2}, {27, 25, 7}}, kShaft{{8, 6, 8}, {13, 11, 21}},
    kBlock{{34, 30, 12}, {36, 32, 14}};

class KeptBoxesTest : public testing::Test {
 protected:
  KeptBoxesTest() {
    scan_.dims = {40, 36, 24};
    scan_.origin_mm = {-30.1, 12.7, 5.3};
    scan_.axes_mm =
        Eigen::AngleAxisd(0.5, Vec3(2, 1, 3).normalized()).toRotationMatrix() * Vec3(0.5, 0.5, 1.2).asDiagonal();
    VoxelFile<std::uint8_t> numbers{scan_, {}};
    for (int k = 0; k < scan_.dims[2]; ++k)
      for (int j = 0; j < scan_.dims[1]; ++j)
        for (int i = 0; i < scan_.dims[0]; ++i) {
          const Coord at{i, j, k};
          const bool bone = (kFoot.contains(at) && !kNotch.contains(at)) || kShaft.contains(at);
          numbers.values.push_back(bone ? 1 : kBlock.contains(at) ? 2 : 0);
        }
    numbers_ = numbers.values;
    islands_ = *IslandMap::make(scan_, std::move(numbers));
    kept_.bones[1].set(1);
  }
  [[nodiscard]] KeptBoxes boxes(int subdivisions) const {
    auto found = kept_boxes(scan_, islands_, kept_, subdivisions, kOn);
    EXPECT_TRUE(found) << found.error().message;
    return found ? std::move(*found) : KeptBoxes();
  }

  ScanGeometry scan_;
  std::vector<std::uint8_t> numbers_;
  IslandMap islands_;
  KeptParts kept_;
};

TEST_F(KeptBoxesTest, AreThoseOfAFootWithAShaft) {
  const KeptBoxes whole = boxes(0);
  EXPECT_EQ(whole.object, (CoordBox{{8, 6, 2}, {27, 25, 21}}));
  EXPECT_EQ(whole.sections, (std::vector{kFoot, kShaft}));
  EXPECT_EQ(whole.leaves, (std::vector<KeptLeaf>{{kFoot, false}, {kShaft, true}}));
  EXPECT_EQ(whole.section_voxels(), 20 * 20 * 6 + 6 * 6 * 14);
  EXPECT_EQ(whole.full_leaves(), 1);

  // The quadrant with the notch is empty. The others are full, so nothing is divided again.
  for (const int subdivisions : {1, 3, 8}) {
    const KeptBoxes divided = boxes(subdivisions);
    EXPECT_EQ(divided.sections, whole.sections);
    EXPECT_EQ(divided.leaves, (std::vector<KeptLeaf>{{{{8, 6, 2}, {17, 15, 7}}, true},
                                                     {{{18, 6, 2}, {27, 15, 7}}, true},
                                                     {{{8, 16, 2}, {17, 25, 7}}, true},
                                                     {kShaft, true}}));
  }
  EXPECT_EQ(whole.section_at({27, 25, 7}), 0);
  EXPECT_EQ(whole.section_at({8, 6, 8}), 1);
  EXPECT_EQ(whole.section_at({14, 6, 8}), -1);
  EXPECT_EQ(whole.section_at({8, 6, 22}), -1);
}

TEST_F(KeptBoxesTest, FollowWhatIsKept) {
  kept_.bones[2].set(2);
  EXPECT_EQ(boxes(0).sections,
            (std::vector<CoordBox>{
                kFoot, {{8, 6, 8}, {13, 11, 11}}, {{8, 6, 12}, {36, 32, 14}}, {{8, 6, 15}, {13, 11, 21}}}));
  kept_.bones[1].reset();
  EXPECT_EQ(boxes(0).sections, std::vector{kBlock});
  // The half of the block beyond the first row.
  kept_.box = MarkedBox{centre_of(scan_, {0, 31, 0}), centre_of(scan_, {39, 35, 23})};
  EXPECT_EQ(boxes(0).object, (CoordBox{{34, 31, 12}, {36, 32, 14}}));
  // One painted voxel.
  kept_ = {};
  kept_.corrections = {
      std::make_shared<const Correction>(Correction{CorrectionKind::paint, 1, {centre_of(scan_, {3, 4, 5})}, 0.1})};
  EXPECT_EQ(boxes(3).sections, (std::vector<CoordBox>{{{3, 4, 5}, {3, 4, 5}}}));
  EXPECT_EQ(boxes(3).full_leaves(), 1);
  kept_.corrections.clear();
  EXPECT_TRUE(boxes(3).object.empty());
  EXPECT_TRUE(boxes(3).sections.empty());
}

TEST_F(KeptBoxesTest, AreFoundUntilSomebodyStops) {
  // There are 24 questions for the slices. The section of the foot has one for each of 6 slices, one for itself and one
  // for each quadrant. That of the shaft has 14 and one.
  for (const int stop : {1, 12, 25, 33, 50}) {
    int asked = 0;
    const auto found = kept_boxes(scan_, islands_, kept_, 3, [&](double fraction) {
      EXPECT_GE(fraction, 0.0);
      EXPECT_LE(fraction, 1.0);
      return ++asked < stop;
    });
    ASSERT_FALSE(found) << stop;
    EXPECT_EQ(found.error().code, ErrorCode::cancelled);
    EXPECT_EQ(asked, stop);
  }
}

TEST_F(KeptBoxesTest, AreDrawnWithTheChosenOneOverAll) {
  const KeptBoxes found = boxes(0);
  const std::vector<DrawnBox> drawn = drawn_boxes(found, 1);
  ASSERT_EQ(drawn.size(), 6u);  // two leaves, the bounding box, two sections, and the chosen one
  EXPECT_TRUE(drawn[0].dashed);
  EXPECT_FALSE(drawn[1].dashed);
  EXPECT_EQ(drawn[4].colour, kObjectColour) << "hidden by the sections";
  EXPECT_TRUE(drawn.back().wide);
  EXPECT_EQ(drawn.back().first, (std::array{8, 6, 8}));
  EXPECT_EQ(drawn.back().last, (std::array{13, 11, 21}));
  EXPECT_EQ(drawn_boxes(found, -1).size(), 5u);
  EXPECT_TRUE(drawn_boxes(KeptBoxes(), 0).empty());
}

TEST_F(KeptBoxesTest, AreNotDrawnWithMoreLeavesThanAPersonCanSee) {
  KeptBoxes many;
  many.sections = {{{0, 0, 0}, {2000, 0, 3}}, {{0, 0, 4}, {2000, 0, 9}}, {{0, 0, 12}, {2000, 0, 12}}};
  many.object = {{0, 0, 0}, {2000, 0, 12}};
  const auto add = [&](std::size_t section, int count) {
    const auto& [first, last] = many.sections[section];
    for (int column = 0; column < count; ++column)
      many.leaves.push_back({{{column, 0, first.z}, {column, 0, last.z}}, true});
  };
  constexpr int kMost = static_cast<int>(kMostDrawnLeaves);
  add(0, 7);
  add(1, kMost - 7);
  const std::size_t boxes = 4;  // that of the object, and three sections
  EXPECT_EQ(drawn_boxes(many, -1).size(), boxes + kMostDrawnLeaves);
  add(2, kMost + 1);
  EXPECT_EQ(drawn_boxes(many, -1).size(), boxes);
  EXPECT_EQ(drawn_boxes(many, 0).size(), 7 + boxes + 1);
  EXPECT_EQ(drawn_boxes(many, 1).size(), kMostDrawnLeaves - 7 + boxes + 1);
  EXPECT_EQ(drawn_boxes(many, 1).front().first, (std::array{0, 0, 4}));
  EXPECT_EQ(drawn_boxes(many, 2).size(), boxes + 1) << "the section itself has too many";
}

TEST_F(KeptBoxesTest, TheFileHasEachKeptVoxel) {
  const test::TempDir folder;
  kept_.bones[2].set(7);
  ASSERT_TRUE(write_kept(folder / "kept.nrrd", scan_, islands_, kept_, kOn));
  const auto read = read_number_file(folder / "kept.nrrd");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->geometry, scan_);  // bit for bit
  std::vector<std::uint8_t> expected = numbers_;
  std::ranges::replace(expected, std::uint8_t{2}, std::uint8_t{1});
  EXPECT_EQ(read->values, expected);
  EXPECT_EQ(write_kept(folder / "none" / "kept.nrrd", scan_, islands_, kept_, kOn).error().code, ErrorCode::internal);
  EXPECT_EQ(write_kept(folder / "kept.nrrd", scan_, islands_, kept_, [](double) { return false; }).error().code,
            ErrorCode::cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder / "kept.nrrd")) << "a part of it fills the disk";
}

}  // namespace
}  // namespace osteon
