// The files of sub-volumes: the printed form, the same bytes after reading, and one sentence for what is not valid.
#include "common/subvolumes/subvolume_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/runtime/files.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/subvolumes/scenes.hpp"

namespace osteon::subvolumes {
namespace {

using ::testing::HasSubstr;

// Niu 2008, §5.2.1, with two columns, three rows and one slice.
constexpr const char* kPrinted =
    "DATASET SUB-VOLUME DATA\n"
    "DIMENSIONS 2 3 1\n"
    "SPACING 0.489 0.489 1.5\n"
    "ORIGIN -12.5 0 100\n"
    "DATA NUMBER 6\n"
    "BOUNDARY POSITION\n"
    "0 0 0 1 0\n"
    "1 -1 1 -1 1\n"
    "2 1 2 1 2\n"
    "MEDICAL DATA\n"
    "700 1200\n"
    "-1000 40\n"
    "0 226\n";

constexpr const char* kMeta =
    "DATASET SUB-VOLUME META\n"
    "DIRECTORY .\n"
    "NUMBER 2\n"
    "FILE START SLICES SUBDIVISIONS\n"
    "SBB1.dat 0 22 3\n"
    "SBB2.dat 25 1 0\n";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

// One sentence about the file.
void expect_sentence(const Error& error, const std::string& name) {
  EXPECT_EQ(error.code, ErrorCode::invalid_input);
  EXPECT_TRUE(error.message.starts_with(name)) << error.message;
  EXPECT_THAT(error.message, HasSubstr("line "));
  EXPECT_EQ(error.message.find('\n'), std::string::npos) << error.message;
  EXPECT_LT(error.message.size(), 400u);
}

TEST(SubVolumeFile, IsWrittenAsPrinted) {
  const SubVolumeData data{.dims = {2, 3, 1},
                           .spacing_mm = {0.489, 0.489, 1.5},
                           .origin_mm = {-12.5, 0.0, 100.0},
                           .boundary = {{0, 1}, {-1, -1}, {1, 1}},
                           .hu = {700, 1200, -1000, 40, 0, 226}};
  EXPECT_EQ(to_text(data), kPrinted);
  const auto read = parse_sub_volume(kPrinted, "SBB1.dat");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, data);
}

TEST(SubVolumeFile, OfEachSectionIsReadBackToTheSameBytes) {
  for (std::uint32_t seed = 0; seed < test::trials(160); ++seed) {
    const Scene scene = random_scene(seed);
    const BoneVoxels voxels = scene.voxels();
    for (const CoordBox& section : scene.sections()) {
      const SubVolumeData data = data_of(voxels, section);
      const std::string text = to_text(data);
      EXPECT_EQ(text_bytes(voxels, section), static_cast<std::int64_t>(text.size())) << seed;
      const auto read = parse_sub_volume(text, "SBB1.dat");
      ASSERT_TRUE(read) << read.error().message;
      EXPECT_EQ(*read, data);
      EXPECT_EQ(to_text(*read), text);
      // It says where the section is, and where its bone begins and ends.
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(data.origin_mm[to_index(axis)],
                    scene.geometry.position_mm(Vec3(section.min.x, section.min.y, section.min.z))[axis], 1e-9);
      for (int row = 0; row < data.dims[1]; ++row)
        for (int column = 0; column < data.dims[0]; ++column) {
          bool bone = false;
          for (int z = section.min.z; z <= section.max.z; ++z)
            bone = bone || scene.bone[voxels.index({section.min.x + column, section.min.y + row, z})] != 0;
          const RowBoundary ends = data.boundary[to_index(row)];
          const bool is_end = column == ends.first || column == ends.last;
          EXPECT_TRUE(bone || !is_end);
          EXPECT_TRUE(!bone || (column >= ends.first && column <= ends.last));
        }
    }
  }
}

TEST(SubVolumeFile, OfATurnedScanLiesAlongItsAxes) {
  Scene scene = random_scene(7);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const auto straight = data_of(scene.voxels(), scene.sections().front());
  scene.geometry.axes_mm = turn * scene.geometry.axes_mm;
  scene.geometry.origin_mm = turn * scene.geometry.origin_mm;
  const auto turned = data_of(scene.voxels(), scene.sections().front());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(turned.spacing_mm[axis], straight.spacing_mm[axis], 1e-12);
    EXPECT_NEAR(turned.origin_mm[axis], straight.origin_mm[axis], 1e-9);
  }
}

TEST(SubVolumeFile, RefusesOtherForms) {
  struct Case {
    const char *what, *by, *why;
  };
  for (const auto& [what, by, why] : std::initializer_list<Case>{
           {"DATASET SUB-VOLUME DATA", "DATASET VOLUME DATA", "line 1 must be \"DATASET SUB-VOLUME DATA\""},
           {"DIMENSIONS 2 3 1", "DIMENSIONS 2 3", "line 2"},
           {"DIMENSIONS 2 3 1", "DIMENSIONS 2 3 0", "line 2"},
           {"DIMENSIONS 2 3 1", "DIMENSIONS 2 3 16385", "line 2"},
           {"DIMENSIONS 2 3 1", "DIMENSIONS 02 3 1", "line 2 must be written as \"DIMENSIONS 2 3 1\""},
           {"DIMENSIONS 2 3 1", "DIMENSIONS  2 3 1", "line 2"},
           {"SPACING 0.489", "SPACING 0", "line 3"},
           {"SPACING 0.489", "SPACING -1", "line 3"},
           {"SPACING 0.489", "SPACING nan", "line 3"},
           {"SPACING 0.489", "SPACING 0.4890", "line 3 must be written as \"SPACING 0.489 0.489 1.5\""},
           {"ORIGIN -12.5", "ORIGIN inf", "line 4"},
           {"ORIGIN -12.5 0", "ORIGIN -12.5 0.0", "line 4 must be written as \"ORIGIN -12.5 0 100\""},
           {"DATA NUMBER 6", "DATA NUMBER 5", "line 5"},
           {"0 0 0 1 0", "0 0 0 2 0", "line 7"},
           {"0 0 0 1 0", "0 1 0 0 0", "line 7"},
           {"0 0 0 1 0", "0 -1 0 1 0", "line 7"},
           {"0 0 0 1 0", "1 0 0 1 0", "line 7 must be written as \"0 0 0 1 0\""},
           {"0 0 0 1 0", "0 0 1 1 0", "line 7 must be written as"},
           {"MEDICAL DATA", "MEDICAL DATA ", "line 10"},
           {"700 1200", "700 32768", "line 11"},
           {"700 1200", "700 1.5", "line 11"},
           {"700 1200", "700 1200 1", "line 11"},
           {"700 1200", "700", "line 11"},
           {"700 1200", "+700 1200", "line 11"},
           {"700 1200", "700\t1200", "line 11"},
           {"-1000 40", "-1000 -0", "line 12 must be written as \"-1000 0\""},
           {"700 1200\n", "700 1200\r\n", "line 11"},
           {"0 226\n", "0 226", "line 13"},
           {"0 226\n", "0 226\n\n", "line 14 must be the end of the file"},
       }) {
    const auto read = parse_sub_volume(replaced(kPrinted, what, by), "SBB7.dat");
    ASSERT_FALSE(read) << by;
    expect_sentence(read.error(), "SBB7.dat");
    EXPECT_THAT(read.error().message, HasSubstr(why)) << by;
  }
}

TEST(SubVolumeFile, DoesNotTrustItsDimensions) {
  // 16384³ numbers, and none of them there.
  std::string text = "DATASET SUB-VOLUME DATA\nDIMENSIONS 16384 16384 16384\nSPACING 1 1 1\nORIGIN 0 0 0\n";
  text += "DATA NUMBER " + std::to_string(std::int64_t{1} << 42) + "\nBOUNDARY POSITION\n";
  const auto read = parse_sub_volume(text, "SBB1.dat");
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("line 5"));
}

// Every byte of a text, replaced, removed or doubled: what is accepted is written back to the same bytes.
template <class Parse>
void expect_one_form(const std::string& text, Parse parse) {
  int accepted = 0;
  const auto look_at = [&](const std::string& changed) {
    const auto read = parse(changed, "file.dat");
    if (read) {
      ++accepted;
      EXPECT_EQ(to_text(*read), changed);
    } else {
      expect_sentence(read.error(), "file.dat");
    }
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    for (const char by : {'0', '1', '9', '-', '.', ' ', '\n', '\0', 'e', '\x80'}) {
      std::string changed = text;
      changed[i] = by;
      look_at(changed);
    }
    std::string without = text;
    look_at(without.erase(i, 1));
    std::string with = text;
    look_at(with.insert(i, 1, text[i]));
    look_at(text.substr(0, i));
  }
  EXPECT_GT(accepted, 20);  // another number is valid, too
}

TEST(SubVolumeFile, HasOneForm) { expect_one_form(kPrinted, parse_sub_volume); }
TEST(MetaFile, HasOneForm) { expect_one_form(kMeta, parse_meta); }

TEST(MetaFile, ListsTheSections) {
  const MetaFile meta = meta_of({{{0, 0, 0}, {3, 4, 21}}, {{0, 0, 25}, {9, 9, 25}}}, 3);
  ASSERT_EQ(meta.entries.size(), 2u);
  EXPECT_EQ(meta.entries[0], (MetaEntry{"SBB1.dat", 0, 22, 3}));
  EXPECT_EQ(meta.entries[1], (MetaEntry{"SBB2.dat", 25, 1, 3}));
  const auto read = parse_meta(kMeta, "Meta.dat");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(to_text(*read), kMeta);
  EXPECT_EQ(read->entries[1].subdivisions, 0);
}

TEST(MetaFile, RefusesOtherForms) {
  struct Case {
    const char *what, *by, *why;
  };
  for (const auto& [what, by, why] : std::initializer_list<Case>{
           {"META", "DATA", "line 1"},
           {"DIRECTORY .", "DIRECTORY ", "line 2"},
           {"DIRECTORY .", "DIRECTORY \x1b[31m", "line 2"},
           {"DIRECTORY .", "DIRECTORY  .", "line 2"},
           {"NUMBER 2", "NUMBER 3", "line 7"},
           {"NUMBER 2", "NUMBER 1", "line 6 must be the end of the file"},
           {"NUMBER 2", "NUMBER 0", "line 3"},
           {"SBB1.dat 0", "SBB2.dat 0", "line 5"},
           {"SBB1.dat 0 22", "SBB1.dat -1 22", "line 5"},
           {"SBB1.dat 0 22", "SBB1.dat 0 0", "line 5"},
           {"SBB1.dat 0 22 3", "SBB1.dat 0 22 9", "line 5"},
           {"SBB2.dat 25", "SBB2.dat 21", "line 6"},  // the first has slices up to 21
           {"SBB2.dat 25 1", "SBB2.dat 16384 1", "line 6"},
       }) {
    const auto read = parse_meta(replaced(kMeta, what, by), "Meta.dat");
    ASSERT_FALSE(read) << by;
    expect_sentence(read.error(), "Meta.dat");
    EXPECT_THAT(read.error().message, HasSubstr(why)) << by;
  }
}

class SubVolumeFiles : public ::testing::Test {
 protected:
  SubVolumeFiles() {
    write("Meta.dat", replaced(replaced(kMeta, "0 22 3", "0 1 3"), "DIRECTORY .", "DIRECTORY parts"));
    std::filesystem::create_directories(folder_ / "parts");
    for (const char* name : {"parts/SBB1.dat", "parts/SBB2.dat"}) write(name, kPrinted);
  }
  void write(const char* name, const std::string& text) const { ASSERT_TRUE(write_file(folder_ / name, text)); }
  [[nodiscard]] auto read() const { return read_sub_volumes(folder_ / "Meta.dat", always); }
  test::TempDir folder_;
};

TEST_F(SubVolumeFiles, AreReadTogether) {
  const auto all = read();
  ASSERT_TRUE(all) << all.error().message;
  ASSERT_EQ(all->size(), 2u);
  EXPECT_EQ(to_text(all->back()), kPrinted);
}

TEST_F(SubVolumeFiles, MustFitTheMetaFile) {
  write("Meta.dat", replaced(kMeta, "DIRECTORY .", "DIRECTORY parts"));  // 22 slices
  auto all = read();
  ASSERT_FALSE(all);
  EXPECT_THAT(all.error().message, HasSubstr("SBB1.dat has 1 slices, but "));
  write("Meta.dat", replaced(replaced(kMeta, "0 22 3", "0 1 3"), "DIRECTORY .", "DIRECTORY parts"));
  write("parts/SBB2.dat", replaced(kPrinted, "SPACING 0.489", "SPACING 0.5"));
  all = read();
  ASSERT_FALSE(all);
  EXPECT_THAT(all.error().message, HasSubstr("SBB2.dat has another SPACING"));
  std::filesystem::remove(folder_ / "parts/SBB2.dat");
  all = read();
  ASSERT_FALSE(all);
  EXPECT_EQ(all.error().code, ErrorCode::not_found);
  EXPECT_THAT(all.error().message, HasSubstr("SBB2.dat"));
}

TEST_F(SubVolumeFiles, StopWhenAsked) {
  const auto all = read_sub_volumes(folder_ / "Meta.dat", [](double) { return false; });
  ASSERT_FALSE(all);
  EXPECT_EQ(all.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace osteon::subvolumes
