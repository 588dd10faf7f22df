// Phantom bones through the importer: parameter files, the program's outputs, and a femur that comes back from a CT.
#include "common/phantoms/phantom_case.hpp"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/geometry/mesh_file.hpp"
#include "common/imaging/calibration.hpp"
#include "common/phantoms/joint.hpp"
#include "server/import/bone_recipe_file.hpp"
#include "server/import/dicom_reader.hpp"
#include "server/import/label_map.hpp"
#include "server/import/phantom_export.hpp"
#include "server/import/structure_names.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/scanned_phantoms.hpp"
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

// Names in truth.json are those of known structures, so that an import with the truth knows all its labels.
TEST(PhantomLabels, AreStructuresThatTheImportKnows) {
  for (const std::string_view kind : phantoms::kBoneKinds) {
    const auto bone = phantoms::make_bone({.kind = std::string(kind)});
    ASSERT_TRUE(bone) << bone.error().message;
    const auto made =
        phantoms::build_phantom_case(**bone, {.pitch_mm = 2.0, .calibration = imaging::kRho1995}, keep_going);
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_GT(made->bone.info().labels.size(), 2u);
    for (const CaseLabel& label : made->bone.info().labels) {
      const auto known = known_structure(label.name);
      ASSERT_TRUE(known) << label.name;
      EXPECT_EQ(known->kind, label.kind) << label.name;
    }
  }
}

TEST(PhantomLabels, HaveNoNamesWithoutAGoodFileBesideThem) {
  const test::TempDir folder;
  const fs::path labels = folder / "labels.nii.gz";
  const auto names = [&](const std::string& text) {
    std::ofstream(folder / "truth.json") << text;
    return names_beside(labels);
  };
  EXPECT_TRUE(names_beside(labels).empty());
  EXPECT_EQ(names(R"({"labels": {"cortical": 1, "marrow": 3}})"),
            (std::map<int, std::string>{{1, "cortical"}, {3, "marrow"}}));
  EXPECT_TRUE(names_beside(folder / "others.nii.gz").empty());
  for (const char* text : {"", "{", "[]", "{}", R"({"labels": ["cortical"]})", R"({"labels": {"cortical": "1"}})",
                           R"({"labels": {"a": 0, "b": 256, "c": 1.5, "d": -1, "e": 1e99}})"})
    EXPECT_TRUE(names(text).empty()) << text;
}

// A knee through the scanner, with a seed in each bone: its truth is compared bone by bone.
TEST(PhantomProgram, AKneeIsComparedWithItsTruthBoneByBone) {
  const test::TempDir folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  std::ofstream(folder / "short.yaml") << "parameters: {femur_cut_mm: 75, tibia_cut_mm: 75}\n";
  const auto made =
      test::run(OSTEON_IMPORT_PROGRAM,
                {"phantom", "knee", "--parameters", path("short.yaml"), "--pitch", "1.5", "--out", path("knee"),
                 "--dicom", path("ct"), "--pixel", "1.2", "--slice", "1.5", "--noise", "0", "--truth", path("truth")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto knee = phantoms::make_bone({.kind = "knee", .changes = {{"femur_cut_mm", 75.0}, {"tibia_cut_mm", 75.0}}});
  ASSERT_TRUE(knee) << knee.error().message;
  std::vector<std::string> arguments{"ct",           path("ct"),   "--separate",
                                     "--out",        path("back"), "--report",
                                     path("report"), "--truth",    path("truth/labels.nii.gz")};
  for (int bone = 1; bone <= 4; ++bone) {
    const Vec3 at = test::cortex_of(**knee, bone);
    arguments.insert(arguments.end(),
                     {"--seed", std::to_string(at.x()) + "," + std::to_string(at.y()) + "," + std::to_string(at.z())});
  }
  const auto back = test::run(OSTEON_IMPORT_PROGRAM, arguments);
  ASSERT_EQ(back.exit_code, 0) << back.err;
  std::printf("%s", back.out.c_str());
  std::ifstream file(folder / "report/report.json");
  const auto rows = nlohmann::json::parse(file)["comparison"]["labels"];
  ASSERT_EQ(rows.size(), 5u) << back.out;
  for (std::size_t bone = 0; bone < 4; ++bone) {
    EXPECT_EQ(rows[bone]["truth"], (*knee)->names()[bone]);
    EXPECT_EQ(rows[bone]["matched_by"], "number");
    EXPECT_GT(rows[bone]["dice"], 0.94) << rows[bone];
    EXPECT_NE(back.out.find("bone " + std::to_string(bone + 1) + ", with " + (*knee)->names()[bone] + ", by number"),
              std::string::npos)
        << back.out;
  }
  EXPECT_GT(rows[4]["dice"], 0.95) << "soft tissue is no bone of the truth";

  // The truth as labels: a case with names.
  const auto named = test::run(OSTEON_IMPORT_PROGRAM, {"ct", path("ct"), "--labels", path("truth/labels.nii.gz"),
                                                       "--out", path("named"), "--truth", path("truth/labels.nii.gz")});
  ASSERT_EQ(named.exit_code, 0) << named.err;
  EXPECT_NE(named.out.find("  tibia, cortical, by name\n"), std::string::npos) << named.out;
}

TEST(PhantomBoneCt, AFemurComesBackFromThickTiltedNoisySlices) {
  const auto femur = phantoms::make_bone({});
  ASSERT_TRUE(femur) << femur.error().message;
  const test::TempDir folder;
  // A femur has 60'000 samples 2 mm apart. A part of them is exact to a thousandth.
  const auto found = test::agreement_of_scan(**femur, {}, folder.path(), 2.0);
  ASSERT_TRUE(found) << found.error().message;
  std::printf("[          ] Dice %.4f, density of cortex %+.1f %%, of cancellous bone %+.1f %%\n", found->dice,
              found->cortical_percent, found->cancellous_percent);
  EXPECT_GE(found->dice, 0.97);
  EXPECT_NEAR(found->cortical_percent, 0.0, 3.0);
  EXPECT_NEAR(found->cancellous_percent, 0.0, 5.0);
}

}  // namespace
}  // namespace osteon::import
