// Real scans, where available: the skull of Debian's invesalius-examples, and the scans in the shared data folder.
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "common/geometry/mesh_file.hpp"
#include "common/imaging/threshold.hpp"
#include "server/import/carving.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/grey_stack.hpp"
#include "server/import/inv3_reader.hpp"
#include "server/import/label_import.hpp"
#include "server/import/raw_volume.hpp"
#include "server/import/subvolume_report.hpp"
#include "tests/support/scenes/fitted_femur.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/trials.hpp"
#include "tests/unit/import/fixtures.hpp"
#include "tests/unit/import/subvolume_checks.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

TEST(Skull, LiesInThePatientFrame) {
  const auto file = test::find_skull();
  ASSERT_TRUE(file) << "Cranium.inv3 of the package invesalius-examples is not there; run deploy/install";
  auto scan = read_inv3(*file, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{256, 256, 108}));
  const auto bone =
      import_bone(std::move(*scan), {.pitch_mm = {}, .title = "Skull", .surface = SurfaceAt::threshold}, keep_going);
  ASSERT_TRUE(bone) << bone.error().message;

  // InVesalius' own mesh of everything above 226 HU encloses 657.7 cm³ (surface_0.plist), with headrest and loose
  // pieces. The largest island is most of it.
  EXPECT_LT(bone->volume_mm3(), 657.7e3);
  EXPECT_GT(bone->volume_mm3(), 0.88 * 657.7e3);

  // Enamel is the densest material in a head. Teeth are low and in front: -z and -y of the middle.
  const Vec3 middle = bone->bounds().centre_mm();
  Vec3 sum = Vec3::Zero();
  int enamel = 0;
  const CoordBox box = bone->bounds_samples();
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 p = position_mm({x, y, z}, bone->pitch_mm());
        if (bone->tissue({x, y, z}) != Tissue::enamel) continue;
        sum += p;
        ++enamel;
      }
  ASSERT_GT(enamel, 50);
  const Vec3 teeth = sum / enamel;
  EXPECT_LT(teeth.z(), middle.z() - 40.0);
  EXPECT_LT(teeth.y(), middle.y() - 40.0);
  EXPECT_NEAR(teeth.x(), middle.x(), 15.0);

  // A line from above meets the vault, and then the brain's cavity.
  double vault_z = 1e9;
  for (double z = bone->bounds().max_mm.z(); z > middle.z(); z -= 0.25)
    if (bone->surface_mm({middle.x(), middle.y(), z}) < 0.0) {
      vault_z = z;
      break;
    }
  EXPECT_LT(vault_z, 1e9);
  EXPECT_GT(vault_z, middle.z() + 50.0);
  EXPECT_GT(bone->surface_mm({middle.x(), middle.y(), vault_z - 30.0}), 0.0);
}

TEST(Skull, ImportsToOneHash) {
  const auto file = test::find_skull();
  ASSERT_TRUE(file) << "Cranium.inv3 of the package invesalius-examples is not there; run deploy/install";
  std::string hash;
  for (int i = 0; i < 2; ++i) {
    auto scan = read_inv3(*file, keep_going);
    ASSERT_TRUE(scan);
    const auto bone = import_bone(std::move(*scan), {.pitch_mm = 2.0}, keep_going);
    ASSERT_TRUE(bone);
    if (i > 0) {
      EXPECT_EQ(to_hex(bone->hash()), hash);
    }
    hash = to_hex(bone->hash());
  }
}

class SharedScans : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto shared = test::find_shared();
    if (!shared || !fs::is_directory(*shared / "data")) GTEST_SKIP() << "no shared/data beside the checkout";
    data_ = *shared / "data";
  }
  void expect_refused(const fs::path& folder, const std::string& why) const {
    const auto scan = read_dicom_series(folder, keep_going);
    ASSERT_FALSE(scan) << folder;
    expect_one_sentence(scan.error(), why);
  }
  fs::path data_;
};

TEST_F(SharedScans, TibiaWithoutDicomPreamble) {
  auto scan = read_dicom_series(data_ / "tibia-dicom", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{512, 512, 46}));
  EXPECT_NEAR(scan->volume.spacing_mm.z(), 3.0, 1e-6);
  const auto [least, most] = std::ranges::minmax(scan->volume.values);
  EXPECT_EQ(least, -1000);
  EXPECT_EQ(most, 3173);
  // README: 0.41 % of the voxels lie above 300 HU.
  const auto bright = std::ranges::count_if(scan->volume.values, [](int hu) { return hu > 300; });
  EXPECT_NEAR(static_cast<double>(bright) / static_cast<double>(scan->volume.count()), 0.0041, 0.00005);

  const imaging::HuVolume grid = scan->volume;
  const auto bone = import_bone(std::move(*scan), {}, keep_going);
  ASSERT_TRUE(bone);
  // One of the two tibiae at the positions that README gives. It is a closed tube with a canal of 20 to 80 HU.
  const Vec3 middle = grid.voxel(bone->bounds().centre_mm());
  const bool first = middle.x() > 85 && middle.x() < 127 && middle.y() > 290 && middle.y() < 337;
  const bool second = middle.x() > 342 && middle.x() < 388 && middle.y() > 297 && middle.y() < 342;
  EXPECT_TRUE(first || second) << middle.transpose();
}

// Within a tibia's outline there are no voids: in each slice of the shaft every sample that bone surrounds is bone.
TEST_F(SharedScans, ATibiaHasItsMarrow) {
  auto scan = read_dicom_series(data_ / "tibia-dicom", keep_going);
  ASSERT_TRUE(scan);
  const auto bone = import_bone(std::move(*scan), {}, keep_going);
  ASSERT_TRUE(bone);
  const CoordBox box = bone->bounds_samples();
  std::int64_t within = 0, voids = 0;
  for (int z = box.min.z + 8; z <= box.max.z - 8; z += 4)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      int first = box.max.x + 1, last = box.min.x - 1;
      const auto inside = [&](int x) { return bone->surface_mm(position_mm({x, y, z}, bone->pitch_mm())) < 0.0; };
      for (int x = box.min.x; x <= box.max.x; ++x)
        if (inside(x)) first = std::min(first, x), last = x;
      for (int x = first; x <= last; ++x, ++within) voids += inside(x) ? 0 : 1;
    }
  ASSERT_GT(within, 1000);
  EXPECT_LT(static_cast<double>(voids), 0.01 * static_cast<double>(within)) << "it was 28 % with a threshold alone";
}

// All slices every night, otherwise those in the middle.
TEST_F(SharedScans, TheTemporalBoneKeepsItsVolumeAtItsOwnPitch) {
  constexpr int kAll = 505;
  constexpr double kPitch_mm = 0.096;
  const int slices = static_cast<int>(test::trials(kAll, 100)), first = (kAll - slices) / 2;
  const test::TempDir folder;
  for (int k = first; k < first + slices; ++k) {
    const std::string name = "plane00" + std::to_string(k) + ".png";
    fs::create_symlink(data_ / "temporal-bone-labels" / name, folder / name);
  }
  auto stack = read_label_stack(folder.path(), {}, Vec3::Constant(kPitch_mm), keep_going);
  ASSERT_TRUE(stack) << stack.error().message;
  EXPECT_EQ(stack->volume.dims, (std::array<int, 3>{512, 512, slices}));
  const auto bone = std::ranges::count_if(stack->volume.labels.values, [](int label) { return label != 0; });
  const auto made = import_labels(std::move(*stack), {}, {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NEAR(made->labelled_mm3, static_cast<double>(bone) * std::pow(kPitch_mm, 3), 1.0);
  // The data's own README: 16.8 % of its voxels, 19.7 cm³.
  if (slices == kAll) {
    EXPECT_NEAR(made->labelled_mm3, 19.7e3, 0.1e3);
  }
  EXPECT_NEAR(made->bone.volume_mm3(), made->labelled_mm3, 0.01 * made->labelled_mm3);
}

TEST_F(SharedScans, TheFemursMeshIsClosedAndHasAFemursVolume) {
  const auto femur = read_stl(data_ / "bone-meshes" / "femur.stl");
  ASSERT_TRUE(femur) << femur.error().message;
  EXPECT_EQ(femur->triangles.size(), 20308u);
  EXPECT_EQ(open_edges(*femur), 0u);
  // Euler: V − E + F = 2 for one closed surface without handles, E = 3 F / 2.
  EXPECT_EQ(femur->positions_mm.size(), femur->triangles.size() / 2 + 2);
  EXPECT_NEAR(enclosed_mm3(*femur), 399e3, 1e3);
}

TEST_F(SharedScans, Jpeg2000InAnyFileOrder) {
  const auto scan = read_dicom_series(data_ / "body-j2k-dicom", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{512, 512, 20}));
  EXPECT_NEAR(scan->volume.spacing_mm.z(), 2.0, 1e-6);  // by position; SliceThickness says 3
  const auto [least, most] = std::ranges::minmax(scan->volume.values);
  EXPECT_EQ(least, -1024);
  EXPECT_EQ(most, 1839);
}

// README: the table moves by 2.5 mm, 2.37 mm along the slices' normal. They shift by 0.79 mm, or 1.64 of their rows.
TEST_F(SharedScans, TiltedGantryBesideAScout) {
  const auto scan = read_dicom_series(data_ / "dicom-tricky" / "tilt-and-localizer", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{512, 512 + 4, 3}));
  EXPECT_NEAR(scan->volume.spacing_mm.z(), 2.5 * std::cos(18.5 / 180.0 * std::numbers::pi), 0.002);
  EXPECT_EQ(scan->report.series[0].irregularity, "tilted by 18.5 degrees");
}

// Two copies of one slice, the second 2 mm higher: a series in that file's encoding.
Result<CtScan> read_pair(const fs::path& file) {
  const test::TempDir folder;
  fs::copy(file, folder / "a.dcm");
  fs::copy(file, folder / "b.dcm");
  fs::permissions(folder / "b.dcm", fs::perms::owner_write, fs::perm_options::add);
  set_tag(folder / "b.dcm", 0x0020, 0x0032, "-161.399994\\-148.800003\\6.7");
  return read_dicom_series(folder.path(), keep_going);
}

TEST_F(SharedScans, EveryTransferSyntaxGivesTheReferencesValuesOrIsRefused) {
  const auto reference = read_pair(data_ / "dicom-tricky" / "transfer-syntaxes" / "CTImage.dcm");
  ASSERT_TRUE(reference) << reference.error().message;
  // README: stored values -2000..2402 with intercept -1024.
  const auto [least, most] = std::ranges::minmax(reference->volume.values);
  EXPECT_EQ(least, -3024);
  EXPECT_EQ(most, 1378);
  int compared = 0;
  for (const auto& entry : fs::directory_iterator(data_ / "dicom-tricky" / "transfer-syntaxes")) {
    const std::string name = entry.path().filename().string();
    const auto ends = [&](const char* syntax) { return name.ends_with(std::string(syntax) + ".dcm"); };
    const auto scan = read_pair(entry.path());
    if (ends("4.53") || ends("4.55")) {
      ASSERT_FALSE(scan) << name;
      expect_one_sentence(scan.error(), "retired");
      continue;
    }
    ASSERT_TRUE(scan) << name << ": " << scan.error().message;
    // Largest differences by README: lossy JPEG-LS 1, lossy JPEG 2000 5, 12-bit JPEG 36, 8-bit JPEG by its slope.
    const int allowed = ends("4.81") ? 1 : ends("4.91") ? 5 : ends("4.51") ? 36 : ends("4.50") ? 400 : 0;
    int worst = 0;
    // Values below -1024 are outside of the scanned circle. Lossy encodings clip them.
    for (std::size_t i = 0; i < scan->volume.values.size(); ++i)
      if (reference->volume.values[i] >= -1024)
        worst = std::max(worst, std::abs(scan->volume.values[i] - reference->volume.values[i]));
    EXPECT_LE(worst, allowed) << name;
    ++compared;
  }
  EXPECT_GE(compared, 12);
}

// The library decodes what is there and leaves the rest undefined.
TEST_F(SharedScans, ACutOffSliceOfAnyTransferSyntaxIsRefused) {
  for (const auto& entry : fs::directory_iterator(data_ / "dicom-tricky" / "transfer-syntaxes")) {
    const test::TempDir folder;
    for (const char* name : {"a.dcm", "b.dcm"}) {
      fs::copy(entry.path(), folder / name);
      fs::permissions(folder / name, fs::perms::owner_write, fs::perm_options::add);
    }
    set_tag(folder / "b.dcm", 0x0020, 0x0032, "-161.399994\\-148.800003\\6.7");
    truncate_file(folder / "a.dcm", 0.9);
    const auto scan = read_dicom_series(folder.path(), keep_going);
    ASSERT_FALSE(scan) << entry.path();
    expect_one_sentence(scan.error(), folder.path().string());
  }
}

TEST_F(SharedScans, ATroubledFolderIsListedAndCounted) {
  const auto report = list_dicom_series(data_ / "dicom-tricky", keep_going);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(report->taken, 5);  // of the few slices that make a volume
  EXPECT_EQ(report->series.size(), 5u);
  EXPECT_EQ(report->skipped.text(),
            "1 localizer, 1 structured report, 2 segmentations, 4 MR images, 1 US image, 7 copies of other files, 1 "
            "file that is "
            "not DICOM");
  EXPECT_NE(
      list_text(*report).find("\"STEREOTAXIS\", 3 slices, 512x512, 0.482x0.482x2.37 mm, oblique, kernel UB, tilted by "
                              "18.5 degrees\n"),
      std::string::npos)
      << list_text(*report);
}

// README: 64 x 64 unsigned numbers of 16 bits in each file, the top of the head first; 7.0 % of the voxels lie above
// 300 HU, and 3.9 % above 700 HU.
TEST_F(SharedScans, RawSlicesOfAHead) {
  RawFormat format;
  format.size = {64, 64, 93};
  format.type = RawType::uint16;
  format.given.spacing_mm = {3.2, 3.2, 1.5};
  format.given.intercept = -1024.0;
  format.given.directions = *parse_axes("LPI");
  const auto scan = read_raw_volume(data_ / "headsq-raw", format, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  const auto [least, most] = std::ranges::minmax(scan->volume.values);
  EXPECT_EQ(least, -1024);
  EXPECT_EQ(most, 3926 - 1024);
  const auto above = [&](int hu) {
    return 100.0 * static_cast<double>(std::ranges::count_if(scan->volume.values, [&](int v) { return v > hu; })) /
           static_cast<double>(scan->volume.count());
  };
  EXPECT_NEAR(above(300), 7.0, 0.05);
  EXPECT_NEAR(above(700), 3.9, 0.05);
}

// README: 512 x 512 x 640 grey values of 8 bits, HU = 16 value - 1024; 0.77 % lie above 300 HU. Every eighth slice is
// enough to see it.
TEST_F(SharedScans, GreySlicesOfAHand) {
  GreyFormat format;
  format.given.spacing_mm = Vec3::Constant(0.33);
  format.given.slope = 16.0;
  format.given.intercept = -1024.0;
  const test::TempDir folder;
  for (int k = 0; k < 640; k += 8) {
    char name[32];
    std::snprintf(name, sizeof name, "hand%04d.png", k);
    fs::create_symlink(data_ / "hand-png" / name, folder / ("slice" + std::to_string(k / 8) + ".png"));
  }
  const auto scan = read_grey_stack(folder.path(), format, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  EXPECT_EQ(scan->volume.dims, (std::array<int, 3>{512, 512, 80}));
  EXPECT_LE(std::ranges::max(scan->volume.values), 16 * 237 - 1024);
  const auto bright = std::ranges::count_if(scan->volume.values, [](int hu) { return hu > 300; });
  EXPECT_NEAR(100.0 * static_cast<double>(bright) / static_cast<double>(scan->volume.count()), 0.77, 0.02);
}

TEST_F(SharedScans, RawSlicesAreNoDicom) {
  expect_refused(data_ / "headsq-raw",
                 "holds no DICOM files: 94 files that are not DICOM; give the folder with the CT series, --spacing");
}

// Two hospitals' series on one disc: neither hides the other.
TEST_F(SharedScans, TwoRealSeriesInSubfolders) {
  const test::TempDir folder;
  fs::create_directory_symlink(data_ / "nowhere", folder / "link");
  fs::copy(data_ / "tibia-dicom", folder / "A");
  fs::copy(data_ / "body-j2k-dicom", folder / "B");
  const auto legs = read_dicom_series(folder.path(), keep_going);
  ASSERT_TRUE(legs) << legs.error().message;
  EXPECT_EQ(legs->volume.dims, (std::array<int, 3>{512, 512, 46}));
  const auto plain = read_dicom_series(data_ / "tibia-dicom", keep_going);
  ASSERT_TRUE(plain);
  EXPECT_EQ(legs->volume.values, plain->volume.values);
  ASSERT_EQ(legs->report.series.size(), 2u);
  const auto trunk = read_dicom_series(folder.path(), {.series = 3 - legs->report.taken}, keep_going);
  ASSERT_TRUE(trunk) << trunk.error().message;
  EXPECT_EQ(trunk->volume.dims, (std::array<int, 3>{512, 512, 20}));
}

TEST_F(SharedScans, EachOddFileAloneIsOneSentence) {
  const std::map<std::string, std::string> words = {
      {"CT0012.fragmented_no_bot_jpeg_baseline.51.dcm", "not Hounsfield units"},
      {"bad_sequence.dcm", "single slice"},
      {"eCT_Supplemental.dcm", "not Hounsfield units"},
      {"emri_small_RLE.dcm", "1 MR image"},
      {"emri_small_big_endian.dcm", "1 MR image"},
      {"emri_small_jpeg_2k_lossless_too_short.dcm", "1 MR image"},
      {"emri_small_jpeg_ls_lossless.dcm", "1 MR image"},
      {"explicit_VR-UN.dcm", "single slice"},
      {"liver_deflate.dcm", "1 segmentation"},
      {"liver_rle.dcm", "1 segmentation"},
      {"no-pixel-data.dcm", "1 structured report"},
      {"no-pixel-spacing.dcm", "1 US image"}};
  int refused = 0;
  for (const auto& entry : fs::directory_iterator(data_ / "dicom-tricky" / "structure")) {
    const test::TempDir folder;
    fs::copy(entry.path(), folder / entry.path().filename());
    const auto scan = read_dicom_series(folder.path(), keep_going);
    ASSERT_FALSE(scan) << entry.path();
    expect_one_sentence(scan.error(), folder.path().string());
    const auto word = words.find(entry.path().filename().string());
    if (word != words.end()) expect_one_sentence(scan.error(), word->second);
    ++refused;
  }
  EXPECT_GE(refused, 12);
}

// Soft tissue ends at 300 HU and bone begins at 500 HU (Niu 2008, table 3.1). Air would take Otsu's threshold of the
// whole scan to -397 HU.
void expect_between_soft_tissue_and_bone(const imaging::HuVolume& volume) {
  const auto histogram = imaging::hu_histogram(volume, keep_going);
  ASSERT_TRUE(histogram);
  const auto found = imaging::suggest_threshold(*histogram);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(found->threshold_hu, 110.0) << found->reason;
  EXPECT_LT(found->threshold_hu, 500.0) << found->reason;
}

TEST(Skull, HasASuggestedThreshold) {
  const auto file = test::find_skull();
  ASSERT_TRUE(file) << "Cranium.inv3 of the package invesalius-examples is not there; run deploy/install";
  const auto scan = read_inv3(*file, keep_going);
  ASSERT_TRUE(scan);
  expect_between_soft_tissue_and_bone(scan->volume);
}

TEST_F(SharedScans, HaveASuggestedThreshold) {
  for (const char* name : {"tibia-dicom", "body-j2k-dicom"}) {
    const auto scan = read_dicom_series(data_ / name, keep_going);
    ASSERT_TRUE(scan);
    expect_between_soft_tissue_and_bone(scan->volume);
  }
}

// README: a support lies beside the legs, and a blob like metal before them.
TEST_F(SharedScans, TheSupportOfTheLegsIsATableAndTheBlobIsMetal) {
  auto scan = read_dicom_series(data_ / "tibia-dicom", keep_going);
  ASSERT_TRUE(scan);
  const auto list = import_ct(std::move(*scan), {.list_only = true}, keep_going);
  ASSERT_TRUE(list);
  ASSERT_GT(list->found.natures.size(), 6u);
  using enum imaging::IslandKind;
  const std::array expected{bone, bone, bone, bone, table, metal};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(list->found.natures[i].kind, expected[i]) << i + 1;
}

// The tibiae touch no other bone: what grows from a voxel of theirs is their island.
TEST_F(SharedScans, ATibiaGrowsFromItsCortex) {
  const auto scan = read_dicom_series(data_ / "tibia-dicom", keep_going);
  ASSERT_TRUE(scan);
  const auto island = import_ct(*scan, {.pitch_mm = 2.0, .keep = {2}}, keep_going);
  ASSERT_TRUE(island);
  // README: the tibiae lie at columns 90 to 122 and 347 to 383. The second is the smaller one.
  Vec3 seed = Vec3::Constant(std::nan(""));
  for (int column = 347; column <= 383; ++column)
    if (scan->volume.at(column, 320, 23) >= 1000) seed = scan->volume.position_mm(Vec3(column, 320, 23));
  CtOptions options{.pitch_mm = 2.0};
  options.grow.seeds_mm = {seed};
  const auto grown = import_ct(*scan, options, keep_going);
  ASSERT_TRUE(grown) << grown.error().message;
  EXPECT_EQ(grown->found.islands[0].voxels, island->found.islands[1].voxels);
  EXPECT_EQ(grown->bone->volume_mm3(), island->bone->volume_mm3());
}

// The tables of a real bone, with a tool through the middle of its box.
void expect_tables(CtScan scan) {
  const auto input = input_of_scan(std::move(scan), imaging::kBoneThreshold_hu, keep_going);
  ASSERT_TRUE(input) << input.error().message;
  const Box box = coloured_box(LabelledVoxels{input->geometry, {}, input->bone}, bone_colours());
  const Vec3 middle = box.centre_mm();
  MeasureOptions options;
  options.steps = {{*find_tool("burr-round-5"),
                    {pose_along({box.min_mm.x(), middle.y(), middle.z()}, {0, 0, -1}),
                     pose_along({box.max_mm.x(), middle.y(), middle.z()}, {0, 0, -1})},
                    {}}};
  const auto m = measure_sub_volumes(*input, options, keep_going);
  ASSERT_TRUE(m) << m.error().message;
  expect_consistent(*m);
  EXPECT_GT(m->steps[0].walk.removed, 0);
  std::printf("%s", to_text(*m).c_str());
}

TEST_F(SharedScans, SubVolumesOfTheTibia) {
  auto scan = read_dicom_series(data_ / "tibia-dicom", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_tables(std::move(*scan));
}

TEST_F(SharedScans, SubVolumesOfTheHead) {
  RawFormat format;
  format.size = {64, 64, 93};
  format.given.spacing_mm = Vec3(3.2, 3.2, 1.5);
  format.given.intercept = -1024.0;
  format.type = RawType::uint16;
  auto scan = read_raw_volume(data_ / "headsq-raw", format, keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  expect_tables(std::move(*scan));
}

// The parameters of a phantom are fitted to the surface of a real femur.
TEST_F(SharedScans, APhantomComesWithinThreeMillimetresOfAFemur) {
  const auto mesh = read_stl(data_ / "bone-meshes/femur.stl");
  ASSERT_TRUE(mesh) << mesh.error().message;
  const test::FittedFemur femur = test::fit_femur(test::spread_points(*mesh, 3000));
  for (const phantoms::NamedValue& value : femur.bone.parameters())
    std::printf("[          ] %-26s %9.3f\n", std::string(value.name).c_str(), value.value);
  const auto good = phantoms::check_femur(femur.parameters);
  EXPECT_TRUE(good) << good.error().message;

  // Both ways: from the mesh to the phantom, and from the phantom to the mesh.
  const double to_phantom = test::distances_mm(femur, test::spread_points(*mesh, 20000)).cwiseAbs().mean();
  double to_mesh = 0.0;
  for (const Vec3& p : test::points_on(femur.bone, 1000))
    to_mesh += test::distance_to_mesh_mm(*mesh, femur.pose_mesh_bone.point(p)) / 1000.0;
  std::printf("[          ] mean distance to the phantom %.2f mm, to the mesh %.2f mm\n", to_phantom, to_mesh);
  EXPECT_LE(to_phantom, 3.0);
  EXPECT_LE(to_mesh, 3.0);

  for (double part = 0.2; part < 0.76; part += 0.05) {
    const test::ShaftPlane plane = test::shaft_plane(femur.parameters, part);
    const test::SectionMoments real = test::section_of(*mesh, femur.pose_mesh_bone.inverse(), plane);
    const test::SectionMoments ours = test::section_of(femur.bone, plane);
    std::printf("[          ] at %.2f: area %.0f and %.0f mm2, second moments %.0f and %.0f, %.0f and %.0f mm4\n", part,
                real.area, ours.area, real.xx, ours.xx, real.yy, ours.yy);
    EXPECT_NEAR(ours.area, real.area, 0.15 * real.area) << part;
    EXPECT_NEAR(ours.xx, real.xx, 0.15 * real.xx) << part;
    EXPECT_NEAR(ours.yy, real.yy, 0.15 * real.yy) << part;
  }
}

}  // namespace
}  // namespace osteon::import
