// Phantom bones through the importer: parameter files, the program's outputs, and a femur that comes back from a CT.
#include "common/phantoms/phantom_case.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/geometry/mesh_file.hpp"
#include "common/imaging/calibration.hpp"
#include "server/import/bone_recipe_file.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/label_map.hpp"
#include "server/import/phantom_export.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

TEST(BoneRecipeFile, ReadsWordsAndParameters) {
  const auto recipe = parse_bone_recipe(
      "preset: female\ncondition: young\nside: right\nparameters: {length_mm: 402.5, texture: 0}\n", "f.yaml", {});
  ASSERT_TRUE(recipe) << recipe.error().message;
  EXPECT_EQ(recipe->preset, "female");
  EXPECT_EQ(recipe->condition, "young");
  EXPECT_EQ(recipe->side, phantoms::Side::right);
  EXPECT_EQ(recipe->changes, (std::map<std::string, double>{{"length_mm", 402.5}, {"texture", 0.0}}));
}

TEST(BoneRecipeFile, KeepsWhatTheFileDoesNotName) {
  const auto recipe = parse_bone_recipe("parameters: {}\n", "f.yaml", {.kind = "tibia", .preset = "large"});
  ASSERT_TRUE(recipe) << recipe.error().message;
  EXPECT_EQ(recipe->kind, "tibia");
  EXPECT_EQ(recipe->preset, "large");
}

TEST(BoneRecipeFile, ReadsParametersOfTheBonesOfAJoint) {
  const auto recipe =
      parse_bone_recipe("parameters: {joint_gap_mm: 4, femur.length_mm: 402.5}\n", "f.yaml", {.kind = "knee"});
  ASSERT_TRUE(recipe) << recipe.error().message;
  EXPECT_EQ(recipe->changes, (std::map<std::string, double>{{"femur.length_mm", 402.5}, {"joint_gap_mm", 4.0}}));
  EXPECT_TRUE(phantoms::make_bone(*recipe));
}

TEST(BoneRecipeFile, FaultsNameTheFileTheFieldAndTheRemedy) {
  const auto refused = [](const char* text, const char* named) {
    const auto recipe = parse_bone_recipe(text, "f.yaml", {});
    ASSERT_FALSE(recipe) << text;
    EXPECT_EQ(recipe.error().code, ErrorCode::invalid_input);
    EXPECT_EQ(recipe.error().message.find("f.yaml"), 0u);
    expect_one_sentence(recipe.error(), named);
  };
  refused("", "no fields");
  refused("- 1\n", "no fields");
  refused("preset: giant\n", "preset is \"giant\"");
  refused("side: [left]\n", "side is not a word");
  refused("length_mm: 400\n", "length_mm");
  refused("parameters: 400\n", "not a map");
  refused("parameters: {length_mm: long}\n", "length_mm is \"long\"");
  refused("parameters: {length_mm: .nan}\n", "length_mm is \".nan\"; write a number, such as");
  refused("parameters: {length_mm: 400, length_mm: 410}\n", "length_mm is there twice");
  refused("preset: {female\n", "not YAML");
}

// What a small case of the program says and writes.
TEST(PhantomProgram, WritesACaseADicomSeriesAMeshAndTheTruth) {
  const test::TempDir folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  std::ofstream(folder / "femur.yaml") << "preset: small\nparameters: {neck_shaft_degrees: 128}\n";
  const auto run =
      test::run(OSTEON_IMPORT_PROGRAM,
                {"phantom", "femur", "--side",     "right",           "--parameters", path("femur.yaml"), "--pitch",
                 "1.5",     "--out", path("case"), "--dicom",         path("ct"),     "--slice",          "3",
                 "--pixel", "1.5",   "--stl",      path("femur.stl"), "--truth",      path("truth")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto bone = Case::load(folder / "case");
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_EQ(bone->info().title, "Right femur");

  const auto mesh = read_stl(folder / "femur.stl");
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(open_edges(*mesh), 0u);
  EXPECT_NEAR(enclosed_mm3(*mesh), bone->volume_mm3(), 0.01 * bone->volume_mm3());

  std::ifstream file(folder / "truth/truth.json");
  const auto truth = nlohmann::json::parse(file);
  EXPECT_EQ(truth["kind"], "femur");
  EXPECT_EQ(truth["side"], "right");
  EXPECT_EQ(truth["parameters"]["neck_shaft_degrees"], 128.0);
  ASSERT_FALSE(bone->info().landmarks.empty());
  for (const Landmark& landmark : bone->info().landmarks)
    EXPECT_EQ(truth["landmarks"][landmark.name][2], landmark.point_mm.z()) << landmark.name;
  EXPECT_EQ(truth["labels"]["marrow"], 3);
  const auto labels = read_label_map(folder / "truth/labels.nii.gz", keep_going);
  ASSERT_TRUE(labels) << labels.error().message;
  EXPECT_EQ(labels->segments.size(), bone->info().labels.size());
  const auto series = read_dicom_series(folder / "ct", keep_going);
  ASSERT_TRUE(series) << series.error().message;
  EXPECT_NEAR(series->volume.spacing_mm.z(), 3.0, 1e-6);
}

TEST(PhantomProgram, WritesThePlaneAndBothSidesOfAPelvis) {
  const test::TempDir folder;
  const auto run =
      test::run(OSTEON_IMPORT_PROGRAM, {"phantom", "pelvis", "--pitch", "2", "--out", (folder / "case").string(),
                                        "--truth", (folder / "truth").string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto bone = Case::load(folder / "case");
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_EQ(bone->info().title, "Pelvis");
  ASSERT_EQ(bone->info().planes.size(), 1u);
  std::ifstream file(folder / "truth/truth.json");
  const auto truth = nlohmann::json::parse(file);
  EXPECT_EQ(truth["side"], "both");
  const auto& plane = truth["planes"]["anterior pelvic plane"];
  EXPECT_EQ(plane["normal"], (std::vector<double>{0.0, -1.0, 0.0}));
  for (const char* name : {"left pubic tubercle", "right anterior superior iliac spine"})
    EXPECT_NEAR(truth["landmarks"][name][1].get<double>(), plane["point_mm"][1].get<double>(), 1e-9) << name;
  EXPECT_EQ(truth["labels"]["sacrum, cortical"], 7);
}

TEST(PhantomProgram, RefusesInOneSentenceAndWritesNothing) {
  const test::TempDir folder;
  const std::string out = (folder / "case").string();
  std::ofstream(folder / "bad.yaml") << "parameters: {neck_shaft_degrees: 150}\n";
  std::ofstream(folder / "side.yaml") << "side: left\n";
  const auto refused = [&](std::vector<std::string> arguments, const std::string& named) {
    arguments.insert(arguments.begin(), "phantom");
    arguments.insert(arguments.end(), {"--out", out});
    const auto run = test::run(OSTEON_IMPORT_PROGRAM, arguments);
    EXPECT_NE(run.exit_code, 0) << named;
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find(named), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(out));
  };
  refused({"femur", "--parameters", (folder / "bad.yaml").string()}, "neck_shaft_degrees is 150");
  refused({"femur", "--parameters", (folder / "none.yaml").string()}, "none.yaml");
  refused({"femur", "--layers", "5:1.9"}, "has no --layers");
  refused({"femur", "--width", "20"}, "has no --width");
  refused({"femur", "--dicom", out + "/ct"}, "--dicom " + out + "/ct lies in the folder of --out");
  refused({"femur", "--truth", out + "/../case"}, "lies in the folder of");
  refused({"femur", "--noise", "10"}, "--noise requires --dicom");
  for (const char* option : {"--side", "--noise"})
    refused({"block", "--layers", "5:1.9", "--dicom", out + "-ct", option, option[2] == 's' ? "left" : "10"},
            std::string(option) + " is for a bone, such as a femur; leave it out for a block");
  refused({"pelvis", "--side", "left"}, "--side is for a bone of one side; leave it out for a pelvis");
  refused({"pelvis", "--parameters", (folder / "side.yaml").string()},
          "side.yaml: side is for a bone of one side; leave it out for a pelvis");
  refused({"block"}, "needs --layers");
  refused({"tube", "--layers", "5:1.9", "--side", "left"}, "--side");
  refused({"femur", "--pitch", "0.03"}, "--pitch");
  refused({"wing"}, "wing");

  // A file is where a folder must be.
  const std::string file = (folder / "bad.yaml").string();
  for (const char* option : {"--dicom", "--truth"})
    refused({"patella", option, file + "/ct"}, "cannot make the folder " + file + "/ct: Not a directory; choose");
  const auto run = test::run(OSTEON_IMPORT_PROGRAM, {"phantom", "patella", "--out", file + "/case"});
  EXPECT_NE(run.exit_code, 0);
  EXPECT_NE(run.err.find("cannot make the folder " + file + "/case: Not a directory; choose"), std::string::npos)
      << run.err;
}

struct Sums {
  double found = 0.0, truth = 0.0;
  [[nodiscard]] double percent() const { return 100.0 * (found - truth) / truth; }
};

// The interior of a tissue is this far from its faces: what is nearer, a scan of such slices blurs. Cortex lies along
// the slices' normal, cancellous bone also below faces along the slices.
constexpr double kCorticalInterior_mm = 1.0, kCancellousInterior_mm = 2.5;

struct CtAgreement {
  double dice = 0.0;
  Sums cortical, cancellous;
};

// Scans a bone, imports the scan by the ordinary path, saves the case, loads it again and asks the bone itself.
void scan_and_compare(const phantoms::PhantomBone& bone, const CtOptions& options, CtAgreement& agreement) {
  const test::TempDir folder;
  ScannerSettings settings{.pixel_mm = 0.8, .blur_mm = 0.5, .noise_hu = 30.0, .tilt_degrees = 12.0};
  settings = scanner_around(bone, settings, 3.0);
  const auto written = write_simulated_scan(settings, blurred_hu(bone, settings.blur_mm), folder / "ct", keep_going);
  ASSERT_TRUE(written) << written.error().message;
  auto scan = read_dicom_series(folder / "ct", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  const auto made = import_ct(std::move(*scan), options, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_TRUE(made->bone->save(folder / "case", made->scan));
  const auto found = Case::load(folder / "case");
  ASSERT_TRUE(found) << found.error().message;

  const double pitch = 1.0;
  const CoordBox box = covering_samples(bone.bounds().grown(4.0), pitch);
  double both = 0.0, sum = 0.0;
  Sums &cortical = agreement.cortical, &cancellous = agreement.cancellous;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = position_mm({x, y, z}, pitch);
        const phantoms::BoneDepths depths = bone.depths(at);
        if (depths.surface_mm > 6.0) {
          sum += found->surface_mm(at) < 0.0 ? 1.0 : 0.0;
          continue;
        }
        const bool real = depths.surface_mm < 0.0, there = found->surface_mm(at) < 0.0;
        both += real && there ? 1.0 : 0.0;
        sum += (real ? 1.0 : 0.0) + (there ? 1.0 : 0.0);
        if (std::max(depths.surface_mm, -depths.cortex_mm) < -kCorticalInterior_mm) {
          cortical.found += there ? found->density_g_cm3(at) : 0.0;
          cortical.truth += bone.cortical_g_cm3(depths.bone);
        }
        if (depths.cortex_mm < -kCancellousInterior_mm && depths.marrow_mm > kCancellousInterior_mm) {
          cancellous.found += there ? found->density_g_cm3(at) : 0.0;
          cancellous.truth += bone.cancellous_g_cm3(at);
        }
      }
  agreement.dice = 2.0 * both / sum;
  std::printf("[          ] Dice %.4f, density of cortex %+.1f %%, of cancellous bone %+.1f %%\n", agreement.dice,
              cortical.percent(), cancellous.percent());
}

TEST(PhantomBoneCt, AFemurComesBackFromThickTiltedNoisySlices) {
  const auto bone = phantoms::make_bone({});
  ASSERT_TRUE(bone) << bone.error().message;
  CtAgreement agreement;
  scan_and_compare(**bone, {}, agreement);
  EXPECT_GE(agreement.dice, 0.97);
  EXPECT_NEAR(agreement.cortical.percent(), 0.0, 3.0);
  EXPECT_NEAR(agreement.cancellous.percent(), 0.0, 5.0);
}

// The cortex of a fibula is as thin as a slice is thick, so its density is not asked for.
TEST(PhantomBoneCt, ATibiaAndItsFibulaComeBackAsTwoBones) {
  const auto bone = phantoms::make_bone({.kind = "tibia", .side = phantoms::Side::right});
  ASSERT_TRUE(bone) << bone.error().message;
  CtOptions options;
  options.keep = {1, 2};
  CtAgreement agreement;
  scan_and_compare(**bone, options, agreement);
  EXPECT_GE(agreement.dice, 0.97);
}

// A point deep in the cortex of a bone, far from the ends of a tilted scan.
Vec3 cortex_of(const phantoms::PhantomBone& bone, int number) {
  CoordBox box = covering_samples(bone.bounds(), 1.0);
  box.min.z += 45;
  box.max.z -= 45;
  Vec3 found = Vec3::Zero();
  double deepest = 0.0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const phantoms::BoneDepths at = bone.depths(position_mm({x, y, z}, 1.0));
        const double depth = std::min(-at.surface_mm, at.cortex_mm);
        if (at.bone != number || depth <= deepest) continue;
        deepest = depth;
        found = position_mm({x, y, z}, 1.0);
      }
  return found;
}

struct Seed {
  Vec3 at_mm;
  int bone = 0;
};

// Dice of each bone of a joint, if each grows from a seed in its cortex, and from those given. The scan ends in bones.
void expect_back_apart(const phantoms::PhantomBone& joint, double least_dice, const std::vector<Seed>& more = {}) {
  const std::vector<std::string> names = joint.names();
  const test::TempDir folder;
  ScannerSettings settings{.pixel_mm = 0.8, .blur_mm = 0.5, .noise_hu = 30.0, .tilt_degrees = 12.0};
  settings = scanner_around(joint, settings, 3.0);
  ASSERT_TRUE(write_simulated_scan(settings, blurred_hu(joint, settings.blur_mm), folder / "ct", keep_going));
  auto scan = read_dicom_series(folder / "ct", keep_going);
  ASSERT_TRUE(scan) << scan.error().message;
  CtOptions options;
  options.pitch_mm = 1.0;
  options.separate = true;
  const int bones = static_cast<int>(names.size());
  std::vector<Seed> seeds = more;
  for (int bone = 1; bone <= bones; ++bone) seeds.push_back({cortex_of(joint, bone), bone});
  for (const Seed& seed : seeds) {
    options.grow.seeds_mm.push_back(seed.at_mm);
    options.grow.bones.push_back(seed.bone);
  }
  const auto made = import_ct(std::move(*scan), options, keep_going);
  ASSERT_TRUE(made) << made.error().message;

  // Where every slice has the whole width of the leg.
  const Box field = joint.bounds().grown(-30.0), around = joint.bounds().grown(4.0);
  CoordBox box = covering_samples(around, 1.0);
  box.min.z = static_cast<int>(field.min_mm.z());
  box.max.z = static_cast<int>(field.max_mm.z());
  std::vector<double> both(names.size()), sum(names.size());
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 at = position_mm({x, y, z}, 1.0);
        const phantoms::BoneDepths depths = joint.depths(at);
        const int real = depths.surface_mm < 0.0 ? depths.bone : 0;
        const int there = made->bone->surface_mm(at) < 0.0 ? made->bone->bone_number({x, y, z}) : 0;
        if (real > 0) sum[static_cast<std::size_t>(real) - 1] += 1.0;
        EXPECT_LE(there, bones) << "a bone without a seed";
        if (there > 0 && there <= bones) sum[static_cast<std::size_t>(there) - 1] += 1.0;
        if (real > 0 && real == there) both[static_cast<std::size_t>(real) - 1] += 1.0;
      }
  for (std::size_t bone = 0; bone < names.size(); ++bone) {
    const double dice = 2.0 * both[bone] / sum[bone];
    std::printf("[          ] %s: Dice %.4f\n", names[bone].c_str(), dice);
    EXPECT_GE(dice, least_dice);
  }
}

TEST(PhantomBoneCt, AKneeComesBackAsFourBones) {
  const auto knee = phantoms::make_bone({.kind = "knee"});
  ASSERT_TRUE(knee) << knee.error().message;
  expect_back_apart(**knee, 0.95);
}

// In slices this thick, the import divides the femur at its neck and not at the joint, so the head needs its own seed.
TEST(PhantomBoneCt, AHipComesBackAsTwoBones) {
  const auto hip = phantoms::make_bone({.kind = "hip"});
  ASSERT_TRUE(hip) << hip.error().message;
  const phantoms::BoneAnatomy anatomy = (*hip)->anatomy();
  const auto head = std::ranges::find(anatomy.landmarks, "head centre", &Landmark::name);
  ASSERT_NE(head, anatomy.landmarks.end());
  expect_back_apart(**hip, 0.95, {{head->point_mm, 2}});
}

}  // namespace
}  // namespace osteon::import
