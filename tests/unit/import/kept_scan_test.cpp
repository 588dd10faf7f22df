// What a case keeps of its scan: HU and labels around the bones, and nothing of the patient.
#include "server/import/kept_scan.hpp"

#include <openvdb/openvdb.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/volume/openvdb_start.hpp"
#include "server/import/case_report.hpp"
#include "server/import/dicom_writer.hpp"
#include "server/import/label_import.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/described_case.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// Two boxes of bone in a scan that is turned and mirrored, with a HU of its own in every voxel. The first is cortical
// and holds a screw, the second is cancellous.
constexpr std::array<int, 3> kScanDims{60, 40, 30};
constexpr std::array<int, 3> kBoneFirst{20, 15, 12}, kBoneLast{39, 24, 17};

CtScan turned_boxes() {
  CtScan scan;
  scan.source = "test";
  imaging::HuVolume& volume = scan.volume;
  volume.dims = kScanDims;
  volume.spacing_mm = {1.0, 1.25, 2.0};
  volume.origin_mm = {30.0, -12.5, 100.0};
  volume.directions << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0;
  for (int k = 0; k < 30; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 60; ++i) {
        const int own = (i + 7 * j + 11 * k) % 50;
        const bool in = j >= 15 && j <= 24 && k >= 12 && k <= 17;
        const bool first = in && i >= 20 && i <= 29, second = in && i >= 33 && i <= 39;
        const bool screw = first && j >= 19 && j <= 20 && i >= 24 && i <= 25;
        volume.values.push_back(static_cast<std::int16_t>(screw    ? 3071
                                                          : first  ? 1200 + own
                                                          : second ? 400 + own
                                                                   : -600 + own));
      }
  return scan;
}

TEST(KeptScan, HasTheHuOfTheScanAtTheSamePlaces) {
  const CtScan scan = turned_boxes();
  const auto made = import_ct(scan, {.keep_all = true}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  const ScanGeometry& geometry = made->scan.geometry;
  EXPECT_EQ(made->bone->info().scan->geometry, geometry);
  ASSERT_EQ(made->scan.hu.size(), geometry.count());
  std::size_t n = 0;
  for (int k = 0; k < geometry.dims[2]; ++k)
    for (int j = 0; j < geometry.dims[1]; ++j)
      for (int i = 0; i < geometry.dims[0]; ++i, ++n) {
        const Vec3 voxel = scan.volume.voxel(geometry.position_mm({1.0 * i, 1.0 * j, 1.0 * k}));
        const auto at = [&](int axis) { return static_cast<int>(std::lround(voxel[axis])); };
        ASSERT_LT((voxel - voxel.array().round().matrix()).norm(), 1e-9) << "between the voxels of the scan";
        ASSERT_EQ(made->scan.hu[n], scan.volume.at(at(0), at(1), at(2)));
      }
}

// 10 mm are 10 columns, 8 rows and 5 slices. The margin ends where the scan does.
TEST(KeptScan, ReachesTheMarginAroundTheBonesAndEndsWithTheScan) {
  const auto reach = [](double margin_mm) {
    const CtScan scan = turned_boxes();
    const auto made = import_ct(scan, {.keep_all = true, .margin_mm = margin_mm}, keep_going);
    EXPECT_TRUE(made);
    const Vec3 first = scan.volume.voxel(made->scan.geometry.origin_mm);
    std::array<int, 6> box{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box[axis] = static_cast<int>(std::lround(first[static_cast<int>(axis)]));
      box[axis + 3] = box[axis] + made->scan.geometry.dims[axis] - 1;
    }
    return box;
  };
  EXPECT_EQ(reach(10.0), (std::array<int, 6>{10, 7, 7, 49, 32, 22}));
  EXPECT_EQ(reach(0.0), (std::array<int, 6>{20, 15, 12, 39, 24, 17}));
  EXPECT_EQ(reach(25.0), (std::array<int, 6>{0, 0, 0, 59, 39, 29}));
}

TEST(KeptScan, TheMarginDoesNotChangeTheBone) {
  const auto bone = [](double margin_mm) {
    const auto made = import_ct(turned_boxes(), {.keep_all = true, .margin_mm = margin_mm}, keep_going);
    EXPECT_TRUE(made);
    const CoordBox box = made->bone->bounds_samples();
    std::vector<float> samples(static_cast<std::size_t>(box.dims().x) * static_cast<std::size_t>(box.dims().y) *
                               static_cast<std::size_t>(box.dims().z));
    made->bone->gather_surface(box, samples);
    return samples;
  };
  EXPECT_EQ(bone(0.0), bone(30.0));
}

TEST(KeptScan, LabelsAreTheBonesAndTissuesWhatTheyAreMadeOf) {
  const CtScan scan = turned_boxes();
  const auto made = import_ct(scan, {.keep_all = true, .margin_mm = 6.0}, keep_going);
  ASSERT_TRUE(made);
  const ScanGeometry& geometry = made->scan.geometry;
  std::array<int, 3> labels{};
  std::array<int, 5> tissues{};
  std::size_t n = 0;
  for (int k = 0; k < geometry.dims[2]; ++k)
    for (int j = 0; j < geometry.dims[1]; ++j)
      for (int i = 0; i < geometry.dims[0]; ++i, ++n) {
        const int label = made->scan.labels[n], tissue = made->scan.tissue[n], hu = made->scan.hu[n];
        ASSERT_LE(label, 2);
        ASSERT_LE(tissue, 4);
        ++labels[static_cast<std::size_t>(label)];
        ++tissues[static_cast<std::size_t>(tissue)];
        // What the scan was drawn as. 2.1 g/cm³ is at 1845 HU and 1 g/cm³ at 814 HU.
        EXPECT_EQ(label, hu < 0 ? 0 : hu >= 1200 ? 1 : 2);
        EXPECT_EQ(tissue, hu < 0 ? 0 : hu == 3071 ? 3 : hu >= 1200 ? 1 : 2);
      }
  EXPECT_EQ(labels[1], 10 * 10 * 6);
  EXPECT_EQ(labels[2], 7 * 10 * 6);
  EXPECT_EQ(tissues[3], 2 * 2 * 6);

  const CaseInfo& info = made->bone->info();
  ASSERT_EQ(info.labels.size(), 2u);
  EXPECT_EQ(info.labels[1].value, 2);
  EXPECT_EQ(info.labels[1].name, "bone 2");
  EXPECT_EQ(info.labels[1].kind, LabelKind::bone);
  EXPECT_EQ(info.labels[1].provenance.parameters.at("threshold_hu"), 226.0);
  EXPECT_EQ(info.labels[1].provenance.parameters.at("island"), 2.0);
  ASSERT_EQ(info.tissues.size(), 3u) << "there is no enamel";
  EXPECT_EQ(info.tissues[0].kind, LabelKind::cortical);
  EXPECT_EQ(info.tissues[1].kind, LabelKind::cancellous);
  EXPECT_EQ(info.tissues[2].kind, LabelKind::metal);
}

TEST(KeptScan, MergedIslandsAreOneLabel) {
  const auto made = import_ct(turned_boxes(), {.keep_all = true, .merge = true}, keep_going);
  ASSERT_TRUE(made);
  ASSERT_EQ(made->bone->info().labels.size(), 1u);
  EXPECT_FALSE(made->bone->info().labels[0].provenance.parameters.contains("island"));
  EXPECT_EQ(std::ranges::count(made->scan.labels.values(), 1), (10 + 7) * 10 * 6);
}

TEST(KeptScan, FiltersAreParametersAndTheHuAreTheFilteredOnes) {
  const auto made = import_ct(turned_boxes(),
                              {.keep_all = true, .median = imaging::MedianBox::slice, .gaussian_mm = 0.5}, keep_going);
  ASSERT_TRUE(made);
  const auto& parameters = made->bone->info().labels.at(0).provenance.parameters;
  EXPECT_EQ(parameters.at("median_voxels"), 9.0);
  EXPECT_EQ(parameters.at("gaussian_mm"), 0.5);
  EXPECT_LT(*std::ranges::max_element(made->scan.hu), 3071);
}

TEST(KeptScan, SeedsAreParametersOfTheBonesThatGrewFromThem) {
  const CtScan scan = turned_boxes();
  const Vec3 seed_mm = scan.volume.position_mm({22.0, 17.0, 14.0});
  CtOptions options{.margin_mm = 25.0};
  options.grow = {.seeds_mm = {seed_mm}, .similar_hu = 300.0, .by = imaging::GrowBy::slice};
  const auto made = import_ct(scan, options, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->scan.geometry.dims, (std::array<int, 3>{55, 40, 30}))
      << "25 columns beyond the bone; elsewhere the scan ends";
  const CaseInfo& info = made->bone->info();
  ASSERT_EQ(info.labels.size(), 1u);
  const LabelProvenance& provenance = info.labels[0].provenance;
  EXPECT_EQ(provenance.method,
            "region growing by slice, similar to the seed, enclosed marrow, islands, surface at half maximum");
  EXPECT_EQ(provenance.parameters.at("similar_hu"), 300.0);
  EXPECT_EQ(provenance.parameters.at("seed_1_x_mm"), seed_mm.x());
  EXPECT_EQ(provenance.parameters.at("seed_1_y_mm"), seed_mm.y());
  EXPECT_EQ(provenance.parameters.at("seed_1_z_mm"), seed_mm.z());
}

// HU of 30 slices, and then labels and tissues of each.
TEST(KeptScan, CanBeStoppedBeforeEachSlice) {
  const CtScan scan = turned_boxes();
  const imaging::VoxelBox box{{0, 0, 0}, {59, 39, 29}};
  const imaging::SparseMask none{imaging::VoxelMask(kScanDims)};
  const auto keep = [&](const KeepGoing& going) {
    return kept_scan(scan.volume, {none, imaging::VoxelMask(kScanDims), {}}, box, imaging::kRho1995, going);
  };
  std::vector<double> asked;
  ASSERT_TRUE(keep([&](double done) { return asked.push_back(done), true; }));
  EXPECT_EQ(asked.size(), 2u * 30u);
  EXPECT_TRUE(std::ranges::is_sorted(asked));
  for (std::size_t stop = 1; stop <= asked.size(); ++stop) {
    std::size_t questions = 0;
    const auto stopped = keep([&](double) { return ++questions < stop; });
    ASSERT_FALSE(stopped) << stop;
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  }
}

// From the first look at the scan to the last file of the case, at about 60 moments.
TEST(KeptScan, AnImportThatIsStoppedAtAnyMomentLeavesNothing) {
  const CtScan scan = turned_boxes();
  const auto import_to = [&](const fs::path& folder, const KeepGoing& going) -> Result<void> {
    auto made = import_ct(scan, {.pitch_mm = 2.0, .keep_all = true}, going);
    if (!made) return tl::unexpected(made.error());
    return made->bone->save(folder, made->scan, going);
  };
  const test::TempDir folder;
  std::vector<double> asked;
  ASSERT_TRUE(import_to(folder / "whole", [&](double done) { return asked.push_back(done), true; }));
  const std::size_t step = std::max<std::size_t>(1, asked.size() / 60);
  for (std::size_t stop = 1; stop <= asked.size(); stop += step) {
    std::size_t questions = 0;
    const auto stopped = import_to(folder / "stopped", [&](double) { return ++questions < stop; });
    ASSERT_FALSE(stopped) << stop << " of " << asked.size();
    EXPECT_EQ(stopped.error().code, ErrorCode::cancelled) << stopped.error().message;
    ASSERT_EQ(files_of(folder.path()), (std::vector<fs::path>{folder / "whole"})) << stop << " of " << asked.size();
  }
}

TEST(KeptScan, AWrongMarginIsRefused) {
  for (const double margin_mm : {-1.0, 201.0, std::nan("")}) {
    const auto made = import_ct(turned_boxes(), {.margin_mm = margin_mm}, keep_going);
    ASSERT_FALSE(made) << margin_mm;
    expect_one_sentence(made.error(), "margin");
  }
}

TEST(KeptScan, ALabelVolumeKeepsItsLabelsWithTheNamesOfItsLegend) {
  LabelStack stack;
  stack.volume.dims = {20, 14, 12};
  stack.volume.spacing_mm = {0.5, 0.5, 1.0};
  stack.volume.labels = DenseVolume<std::uint8_t>({{0, 0, 0}, {19, 13, 11}}, 0);
  for (int x = 7; x < 15; ++x)
    for (int y = 6; y < 9; ++y)
      for (int z = 4; z < 9; ++z) stack.volume.labels.at({x, y, z}) = x < 10 ? 1 : x < 12 ? 2 : 3;
  stack.colours = {{{0, 0, 0, 0}, 1, 0}};
  const DenseVolume<std::uint8_t> drawn = stack.volume.labels;
  LabelLegend legend;
  legend.bones = {{"incus", {1, 2, 3}, 1.9}, {"incus", {4, 5, 6}, 1.8}, {"", {7, 8, 9}, 1.7}};
  const auto made = import_labels(std::move(stack), legend, {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  const CaseInfo& info = made->bone.info();
  ASSERT_EQ(info.labels.size(), 3u);
  EXPECT_EQ(info.labels[0].name, "incus");
  EXPECT_EQ(info.labels[1].name, "incus 2");
  EXPECT_EQ(info.labels[2].name, "bone");
  EXPECT_EQ(info.labels[1].provenance.parameters.at("density_g_cm3"), 1.8);
  EXPECT_TRUE(made->scan.hu.empty() && made->scan.tissue.empty());
  std::array<int, 4> counts{};
  std::size_t n = 0;
  const ScanGeometry& geometry = made->scan.geometry;
  for (int k = 0; k < geometry.dims[2]; ++k)
    for (int j = 0; j < geometry.dims[1]; ++j)
      for (int i = 0; i < geometry.dims[0]; ++i, ++n) {
        const Vec3 at = geometry.position_mm({1.0 * i, 1.0 * j, 1.0 * k});
        ASSERT_EQ(made->scan.labels[n],
                  drawn.at({static_cast<int>(std::lround(at.x() / 0.5)), static_cast<int>(std::lround(at.y() / 0.5)),
                            static_cast<int>(std::lround(at.z()))}));
        ++counts[made->scan.labels[n]];
      }
  EXPECT_EQ(counts[1] + counts[2] + counts[3], 8 * 3 * 5) << "all voxels of bone are there";
  const test::TempDir folder;
  ASSERT_TRUE(made->bone.save(folder / "case", made->scan));
  EXPECT_TRUE(load_scan(folder / "case", made->bone));
}

TEST(CaseReport, SaysWhatTheCaseKnows) {
  const CaseScan scan = test::turned_scan();
  const auto bone = test::described_ball(test::full_description(scan));
  ASSERT_TRUE(bone);
  const std::string text = report_text(*bone);
  for (const char* line :
       {"scan       19x11x7, 0.5x0.75x2 mm\n", "label      1  bone 1 (bone): threshold; island 1; ",
        "label      7  Nervus ischiadicus (nerve): painted; edits 2\n",
        "tissue     2  cancellous (cancellous): density; below_g_cm3 1\n", "landmark   head centre  1 2 3\n",
        "axis       neck  1 2 3 along  0 0.6 0.8\n", "plane      osteotomy  4 5 6 normal  0 0 -1\n",
        "region     near the nerve  label 7\n", "region     window  -1 -2 -3 to  1 2 3\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "is not in\n" << text;
  const auto report = nlohmann::json::parse(report_json(*bone));
  EXPECT_EQ(report.at("schema_version"), 2);
  EXPECT_EQ(report.at("labels")[1].at("name"), "Nervus ischiadicus");
  EXPECT_EQ(report.at("scan").at("dims"), (nlohmann::json{19, 11, 7}));
  EXPECT_EQ(report.at("regions")[1].at("max_mm"), (nlohmann::json{1.0, 2.0, 3.0}));
}

// Everything of a file that OpenVDB knows, without compression: names, metadata and samples.
std::string unpacked(const fs::path& file, const fs::path& plain) {
  start_openvdb();
  openvdb::io::File in(file.string());
  in.open(false);
  openvdb::io::File out(plain.string());
  out.setCompression(openvdb::io::COMPRESS_NONE);
  out.write(*in.getGrids(), *in.getMetadata());
  out.close();
  return test::content(plain);
}

struct Attribute {
  std::uint16_t group, element;
  std::string value;
};

TEST(KeptScan, NothingInACaseNamesThePatientOrTheStudy) {
  const test::TempDir folder;
  // The folder's name is the patient's too, as on many discs.
  const fs::path series = folder / "DOE_JANE" / "series";
  fs::create_directory(folder / "DOE_JANE");
  ASSERT_NO_FATAL_FAILURE(write_small_series(series));
  const std::vector<Attribute> attributes{
      {0x0008, 0x0012, "19991231"},            // instance creation date
      {0x0008, 0x0018, "1.2.826.0.1.4711.1"},  // SOP instance
      {0x0008, 0x0020, "20200229"},            // study date
      {0x0008, 0x0050, "ACC0815"},             // accession number
      {0x0008, 0x0080, "StElsewhere"},         // institution
      {0x0008, 0x0090, "Ward^Quinn"},          // referring physician
      {0x0008, 0x1030, "HipLeftStudy"},        // study description
      {0x0008, 0x103e, "BoneKernelH60"},       // series description
      {0x0010, 0x0010, "DOE^JANE"},            // patient's name
      {0x0010, 0x0020, "PID-123456"},          // patient's id
      {0x0010, 0x0030, "19570314"},            // birth date
      {0x0010, 0x4000, "allergic"},            // comments
      {0x0020, 0x000d, "1.2.826.0.1.4711.2"},  // study
      {0x0020, 0x000e, "1.2.826.0.1.4711.3"},  // series
      {0x0020, 0x0052, "1.2.826.0.1.4711.4"},  // frame of reference
  };
  for (const fs::path& file : files_of(series))
    for (const Attribute& a : attributes) set_tag(file, a.group, a.element, a.value);
  std::vector<std::string> secrets{"DOE", "JANE", "DOE_JANE", "4711"};
  for (const Attribute& a : attributes) secrets.push_back(a.value);
  const std::string slice = test::content(files_of(series).front());
  for (const Attribute& a : attributes) ASSERT_NE(slice.find(a.value), std::string::npos) << a.value;

  const auto made = test::run(OSTEON_IMPORT_PROGRAM, {"ct", series.string(), "--out", (folder / "case").string()});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  ASSERT_EQ(files_of(folder / "case").size(), 3u);
  std::string all = test::content(folder / "case" / "case.json");
  for (const char* vdb : {"bone.vdb", "scan.vdb"}) {
    all += test::content(folder / "case" / vdb);
    const std::string plain = unpacked(folder / "case" / vdb, folder / vdb);
    ASSERT_GT(plain.size(), fs::file_size(folder / "case" / vdb)) << "it was not compressed";
    all += plain;
  }
  ASSERT_NE(all.find("DICOM CT"), std::string::npos) << "what is there is found";
  for (const std::string& secret : secrets) EXPECT_EQ(all.find(secret), std::string::npos) << secret;
}

}  // namespace
}  // namespace osteon::import
