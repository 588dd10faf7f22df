// osteon-import as its users see it: what it prints, what files it leaves, and its exit codes.
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/volume/case.hpp"
#include "server/import/dicom_writer.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/wait.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const fs::path kProgram = OSTEON_IMPORT_PROGRAM;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// Expects exit code 1, exactly one sentence on standard error, nothing on standard output, and no new file.
void expect_refused(const std::vector<std::string>& arguments, const std::string& named, const test::TempDir& folder) {
  const auto before = files_of(folder.path());
  const auto result = test::run(kProgram, arguments);
  EXPECT_FALSE(result.timed_out);
  EXPECT_NE(result.exit_code, 0);
  EXPECT_LT(result.exit_code, 128) << "ended by a signal";
  EXPECT_EQ(result.out, "");
  const auto lines = lines_of(result.err);
  ASSERT_EQ(lines.size(), 1u) << result.err;
  EXPECT_TRUE(lines[0].starts_with("osteon-import: ")) << lines[0];
  EXPECT_NE(lines[0].find(named), std::string::npos) << lines[0] << "\nshould name " << named;
  EXPECT_EQ(files_of(folder.path()), before);
}

class Program : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  // What the program prints while it makes a case of the folder "series".
  std::string import_series(const char* name, const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"ct", path("series"), "--out", path(name)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = test::run(kProgram, arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  }
  test::TempDir folder_;
};

TEST_F(Program, HelpNamesTheCommands) {
  const auto result = test::run(kProgram, {"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* command : {"ct", "phantom", "info", "series", "slices", "register"})
    EXPECT_NE(result.out.find(command), std::string::npos);
}

TEST_F(Program, WritesSlicesAsImages) {
  write_inv3(folder_ / "scan.inv3", {});
  const auto made = test::run(kProgram, {"slices", path("scan.inv3"), "--out", path("images"), "--edges", "canny"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("4x5x6"), std::string::npos) << made.out;
  EXPECT_EQ(files_of(folder_ / "images").size(), 6u);
  expect_refused({"slices", path("scan.inv3"), "--out", path("images")}, "already there", folder_);
}

TEST_F(Program, WrongOptionsOfSlicesAreOneSentence) {
  write_inv3(folder_ / "scan.inv3", {});
  const auto refused = [&](const char* option, const char* value) {
    expect_refused({"slices", path("scan.inv3"), "--out", path("images"), option, value}, option, folder_);
  };
  for (const char* window : {"400", "400,0.5", "nan,100", "400,inf", "400,100,3", "a,b"}) refused("--window", window);
  for (const char* limits : {"300,100", "0,100", "-1,2", "nan,300", "100", "1,2,3"}) refused("--limits", limits);
  for (const char* sigma : {"-1", "11", "nan"}) refused("--sigma", sigma);
  refused("--edges", "sobel");
  refused("--edges-in", "row");
}

TEST_F(Program, WrongOptionsOfDensityAreOneSentence) {
  write_inv3(folder_ / "scan.inv3", {});
  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    more.insert(more.begin(), {"ct", path("scan.inv3"), "--out", path("case")});
    expect_refused(more, why, folder_);
  };
  // In mg/cm3, in the wrong order, with a falling line, and no lines at all.
  for (const char* line : {"1.067,131", "0.131,0.001067", "-0.001,0.1", "0.001", "0.001,0.1,2", "nan,0.1", "0.001,inf"})
    refused({"--calibration", line}, std::string("--calibration ") + line);
  for (const char* rods : {"", "0,x", "0,-0.1", "0,0.1,", "0,100", "nan,1"}) refused({"--rods", rods}, "--rods");
  refused({"--rods", "0,0.1", "--calibration", "0.001,0.1"}, "--calibration");
  refused({"--rods", "0,0.1", "--rescale-hu"}, "--rescale-hu");
  refused({"--rods-of", "hydroxyapatite"}, "--rods");
  refused({"--rods", "0,0.1", "--rods-of", "water"}, "--rods-of");
  refused({"--contrast", "maybe"}, "--contrast");
  for (const char* metal : {"499", "40000", "nan"}) refused({"--metal-hu", metal}, "--metal-hu");
  // This is found out when the scan is there, after lines of progress.
  const auto late = test::run(kProgram, {"ct", path("scan.inv3"), "--out", path("case"), "--rods", "0,0.1"});
  EXPECT_EQ(late.exit_code, 1);
  EXPECT_NE(late.err.find("scan.inv3: the scan does not show 2 uniform rods"), std::string::npos) << late.err;
  EXPECT_FALSE(fs::exists(path("case")));
}

// A block of bone in air, as raw numbers.
TEST_F(Program, ImportsRawNumbers) {
  std::ofstream out(folder_ / "scan.raw", std::ios::binary);
  for (int k = 0; k < 16; ++k)
    for (int j = 0; j < 16; ++j)
      for (int i = 0; i < 16; ++i) {
        const bool bone = std::min({i, j, k}) >= 4 && std::max({i, j, k}) < 12;
        out << std::string(bone ? "\x0b\xb8" : "\x00\x18", 2);  // 3000 and 24, the higher byte first
      }
  out.close();
  const std::vector<std::string> raw{"ct",     path("scan.raw"), "--size",       "16,16,16", "--spacing",   "0.5",
                                     "--type", "uint16",         "--byte-order", "big",      "--intercept", "-1024"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), raw.begin(), raw.end());
    return more;
  };
  const auto made = test::run(kProgram, with({"--out", path("case")}));
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto bone = Case::load(path("case"));
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_NEAR(bone->volume_mm3(), 64.0, 4.0);  // 8 voxels of 0.5 mm along each axis
  EXPECT_NE(bone->info().source.find("raw CT, 16x16x16, 0.5x0.5x0.5 mm"), std::string::npos) << bone->info().source;
  expect_refused(with({"--out", path("b"), "--skip-bytes", "1"}), "scan.raw has 8192 bytes", folder_);
  expect_refused(with({"--out", path("b"), "--axes", "LLS"}), "--axes LLS", folder_);
  expect_refused(with({"--out", path("b"), "--slope", "0"}), "--slope", folder_);
  expect_refused(with({"--out", path("b"), "--grey-window", "400,1800"}), "--grey-window is for PNG", folder_);
  expect_refused(with({"--out", path("b"), "--series", "1"}), "--series is for DICOM", folder_);
}

TEST_F(Program, OptionsOfRawNumbersAndPngSlicesThatDoNotFitAreOneSentence) {
  fs::create_directory(folder_ / "slices");
  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    more.insert(more.begin(), {"ct", path("slices"), "--out", path("case")});
    expect_refused(more, why, folder_);
  };
  refused({"--size", "16,16,16"}, "--size needs --spacing");
  refused({"--size", "16,16", "--spacing", "1"}, "--size 16,16 is not a number of voxels");
  refused({"--spacing", "0"}, "--spacing 0 is not a voxel size");
  refused({"--spacing", "1"}, "has no PNG files");
  refused({"--type", "uint8"}, "--type is for raw numbers and PNG slices; give --spacing");
  refused({"--type", "int8", "--size", "16,16,16", "--spacing", "1"}, "--type");
  refused({"--spacing", "1", "--type", "uint8"}, "--type is for raw numbers; give --size");
  refused({"--spacing", "1", "--skip-bytes", "-1"}, "--skip-bytes");
  refused({"--spacing", "1", "--grey-window", "400"}, "--grey-window 400 is not a window");
  refused({"--spacing", "1", "--grey-window", "400,1800", "--slope", "2"}, "give either");
}

TEST_F(Program, MakesAPhantomAndReportsIt) {
  const auto made = test::run(kProgram, {"phantom", "block", "--layers", "3:1.9,4:0.5", "--width", "8", "--pitch",
                                         "0.5", "--out", path("case"), "--title", "Plate"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto info = test::run(kProgram, {"info", path("case"), "--json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_EQ(info.err, "");
  const auto report = nlohmann::json::parse(info.out);
  EXPECT_EQ(report.at("title"), "Plate");
  EXPECT_EQ(report.at("pitch_mm"), 0.5);
  EXPECT_NEAR(report.at("bone_volume_mm3").get<double>(), 8.0 * 8.0 * 7.0, 0.02 * 448.0);  // edges are sampled
  const std::string hash = report.at("hash");
  EXPECT_EQ(hash.size(), 64u);
  EXPECT_NE(made.out.find(hash), std::string::npos);
  const auto loaded = Case::load(path("case"));
  ASSERT_TRUE(loaded);
  EXPECT_EQ(to_hex(loaded->hash()), hash);
  const auto text = test::run(kProgram, {"info", path("case")});
  EXPECT_EQ(text.out, made.out);
}

// The pipe of its output is full, so the program has done its work and cannot end.
TEST_F(Program, ASignalAfterTheWorkLeavesASuccess) {
  ASSERT_EQ(test::run(kProgram, {"phantom", "block", "--layers", "3:1.9", "--width", "8", "--pitch", "0.5", "--out",
                                 path("truth"), "--dicom", path("series")})
                .exit_code,
            0);
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  const std::string filling(4096, ' ');
  while (::write(ends[1], filling.data(), filling.size()) > 0) {
  }
  ASSERT_EQ(::fcntl(ends[1], F_SETFL, 0), 0);
  const std::string program = kProgram.string(), series = path("series"), out = path("report");
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::execl(program.c_str(), program.c_str(), "report", series.c_str(), "--out", out.c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  bool ended = false;
  const auto has_ended = [&] { return ended = ended || ::waitpid(child, &status, WNOHANG) == child; };
  EXPECT_TRUE(test::wait_until([&] { return fs::exists(out) || has_ended(); }, 60s));
  EXPECT_TRUE(test::wait_until(
      [&] {
        if (!ended) ::kill(child, SIGTERM);
        return has_ended();
      },
      60s));
  ::close(ends[0]), ::close(ends[1]);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_TRUE(fs::exists(folder_ / "report" / "report.json"));
}

TEST_F(Program, ImportsThePhantomsDicomSeries) {
  ASSERT_EQ(test::run(kProgram, {"phantom", "tube", "--layers", "3:1.9,2:1.5", "--width", "12", "--pitch", "0.5",
                                 "--out", path("truth"), "--dicom", path("series")})
                .exit_code,
            0);
  const auto imported = test::run(kProgram, {"ct", path("series"), "--out", path("case"), "--pitch", "0.4"});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  const auto truth = Case::load(path("truth"));
  const auto bone = Case::load(path("case"));
  ASSERT_TRUE(truth && bone);
  EXPECT_EQ(bone->pitch_mm(), 0.4);
  EXPECT_NEAR(bone->volume_mm3(), truth->volume_mm3(), 0.03 * truth->volume_mm3());  // no threshold was fitted
  EXPECT_EQ(files_of(folder_.path()).size(), 3u);
}

TEST_F(Program, WrongInputsAreOneSentence) {
  std::ofstream(folder_ / "letter.txt") << "Dear reader\n";
  expect_refused({"ct", path("letter.txt"), "--out", path("case")}, path("letter.txt"), folder_);
  expect_refused({"ct", path("letter.txt"), "--out", path("case")},
                 "--size, --spacing and --type if it holds raw numbers", folder_);
  expect_refused({"ct", path("absent"), "--out", path("case")}, path("absent"), folder_);
  fs::create_directory(folder_ / "empty");
  expect_refused({"ct", path("empty"), "--out", path("case")}, path("empty"), folder_);
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder_ / "cut.inv3", {.columns = 100, .rows = 100}));
  truncate_file(folder_ / "cut.inv3", 0.7);
  expect_refused({"ct", path("cut.inv3"), "--out", path("case")}, path("cut.inv3"), folder_);
}

TEST_F(Program, WrongSeriesAreOneSentence) {
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder_ / "series"));
  const auto files = files_of(folder_ / "series");
  for (const fs::path& file : files) remove_tag(file, 0x7fe0, 0x0010);
  expect_refused({"ct", path("series"), "--out", path("case")}, "no pixel data", folder_);
  for (const fs::path& file : files) set_tag(file, 0x0008, 0x0060, "MR");
  expect_refused({"ct", path("series"), "--out", path("case")}, "MR images", folder_);
}

// Two series and a text file on one disc.
void write_disc(const fs::path& folder) {
  fs::create_directories(folder);
  ASSERT_NO_FATAL_FAILURE(write_small_series(folder / "A"));
  const auto scan =
      scan_phantom({.kind = PhantomKind::block, .layers = {{9.0, 1.5}}, .width_mm = 6.0}, 1.0, keep_going);
  ASSERT_TRUE(scan);
  ASSERT_TRUE(write_dicom_series(*scan, folder / "B", keep_going));
  for (const fs::path& file : files_of(folder / "B")) {
    set_tag(file, 0x0008, 0x103e, "Block 1.0 H60s");
    set_tag(file, 0x0020, 0x0011, "2");
    set_tag(file, 0x0010, 0x0010, "Surname^Forename");
  }
  std::ofstream(folder / "README.txt") << "Insert the disc.\n";
}

TEST_F(Program, ImportsTheLargestSeriesOfADiscAndSaysSo) {
  ASSERT_NO_FATAL_FAILURE(write_disc(folder_ / "disc"));
  ASSERT_NO_FATAL_FAILURE(write_archive(folder_ / "disc", folder_ / "disc.zip", "zip"));
  fs::create_directory(folder_ / "tmp");
  const auto listed =
      test::run(kProgram, {"series", path("disc.zip")}, 60s, {.environment = {{"TMPDIR", path("tmp")}}});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_EQ(listed.err, "");
  EXPECT_NE(listed.out.find("2          \"Block 1.0 H60s\", "), std::string::npos) << listed.out;
  EXPECT_NE(listed.out.find("taken      2; ct --series N takes another\nskipped    1 file that is not DICOM\n"),
            std::string::npos)
      << listed.out;

  const auto made = test::run(kProgram, {"ct", path("disc.zip"), "--out", path("case")}, 60s,
                              {.environment = {{"TMPDIR", path("tmp")}}});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("series     2 of 2: \"Block 1.0 H60s\", "), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("also       1: no description, "), std::string::npos) << made.out;
  EXPECT_TRUE(files_of(folder_ / "tmp").empty());
  EXPECT_EQ(made.out.find("Surname"), std::string::npos);
  std::ifstream in(folder_ / "case" / "case.json");
  const std::string kept{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(kept.find("Block"), std::string::npos) << kept;

  const auto other = test::run(kProgram, {"ct", path("disc"), "--out", path("other"), "--series", "1"});
  ASSERT_EQ(other.exit_code, 0) << other.err;
  const auto first = Case::load(path("other"));
  const auto second = Case::load(path("case"));
  ASSERT_TRUE(first && second);
  EXPECT_LT(first->volume_mm3(), 0.5 * second->volume_mm3());
}

// Two separate hollow boxes of cortex with fat in them, 64 and 27 mm3 of fat.
void write_two_boxes(const fs::path& folder) {
  imaging::HuVolume volume;
  volume.dims = {30, 16, 16};
  volume.values.assign(volume.count(), -1000);
  const auto box = [&](int from, int edge) {
    for (int k = 3; k < 3 + edge; ++k)
      for (int j = 3; j < 3 + edge; ++j)
        for (int i = from; i < from + edge; ++i) {
          const auto inner = [&](int c, int low) { return c >= low + 2 && c < low + edge - 2; };
          volume.values[volume.index(i, j, k)] = inner(i, from) && inner(j, 3) && inner(k, 3) ? -90 : 1400;
        }
  };
  box(3, 8);
  box(17, 7);
  ASSERT_TRUE(write_dicom_series(volume, folder, keep_going));
}

TEST_F(Program, KeepsTheIslandsThatAreAskedForAndSaysWhatItLeavesOut) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  const auto listed = test::run(kProgram, {"ct", path("series"), "--list"});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_NE(listed.out.find("     1     0.51"), std::string::npos) << listed.out;
  EXPECT_NE(listed.out.find("     2     0.34"), std::string::npos) << listed.out;
  EXPECT_EQ(files_of(folder_.path()).size(), 1u) << "--list wrote something";

  EXPECT_NE(import_series("one", {}).find("1 island with 0.34 cm3 (40 %) left out"), std::string::npos);
  EXPECT_NE(import_series("second", {"--keep", "2"}).find("1 island with 0.51 cm3 (60 %) left out"), std::string::npos);
  EXPECT_NE(import_series("all", {"--keep", "all"}).find("2 in the case"), std::string::npos);
  EXPECT_NE(import_series("merged", {"--keep", "1,2", "--merge"}).find("1 in the case"), std::string::npos);
  const auto numbers = [&](const char* name) {
    const auto bone = Case::load(path(name));
    EXPECT_TRUE(bone);
    return std::pair{bone->bone_number({7, 7, 4}), bone->bone_number({20, 6, 4})};
  };
  EXPECT_EQ(numbers("one"), (std::pair{1, 0}));
  EXPECT_EQ(numbers("second"), (std::pair{0, 1}));
  EXPECT_EQ(numbers("all"), (std::pair{1, 2}));
  EXPECT_EQ(numbers("merged"), (std::pair{1, 1}));
}

TEST_F(Program, MarrowIsBoneUnlessHollowIsAskedFor) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  ASSERT_EQ(test::run(kProgram, {"ct", path("series"), "--out", path("whole")}).exit_code, 0);
  ASSERT_EQ(test::run(kProgram, {"ct", path("series"), "--out", path("hollow"), "--hollow"}).exit_code, 0);
  const auto whole = Case::load(path("whole")), hollow = Case::load(path("hollow"));
  ASSERT_TRUE(whole && hollow);
  EXPECT_LT(whole->surface_mm({6.5, 6.5, 6.5}), 0.0);
  EXPECT_GT(hollow->surface_mm({6.5, 6.5, 6.5}), 0.0);
}

TEST_F(Program, WrongIslandsAreOneSentence) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  for (const char* wrong : {"0", "-1", "1,", ",1", "1;2", "some", "1.5", "99999999999", "ALL"})
    expect_refused({"ct", path("series"), "--out", path("case"), std::string("--keep=") + wrong}, "--keep", folder_);
  for (const char* option : {"--pitch", "--threshold"})
    for (const char* wrong : {"nan", "inf", "-inf", "1e400", "x"})
      expect_refused({"ct", path("series"), "--out", path("case"), std::string(option) + "=" + wrong}, option, folder_);
  const auto absent = test::run(kProgram, {"ct", path("series"), "--out", path("case"), "--keep", "1,3"});
  EXPECT_EQ(absent.exit_code, 1);
  EXPECT_NE(absent.err.find("--keep names island 3, but at this threshold there are islands 1 to 2"), std::string::npos)
      << absent.err;
  expect_refused({"ct", path("series")}, "--out", folder_);
}

TEST_F(Program, GrowsBonesFromSeeds) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  import_series("second", {"--keep", "2"});
  EXPECT_NE(import_series("grown", {"--seed", "17,3.2,3"}).find("that grew from the seeds"), std::string::npos);
  import_series("both", {"--seed", "17,3,3", "--seed", "3,3,3"});
  import_series("similar", {"--seed=17,3,3", "--similar", "200", "--adaptive", "--by", "slice"});
  const auto second = Case::load(path("second")), grown = Case::load(path("grown")), both = Case::load(path("both")),
             similar = Case::load(path("similar"));
  ASSERT_TRUE(second && grown && both && similar);
  EXPECT_EQ(grown->volume_mm3(), second->volume_mm3()) << "the second island grows from its seed";
  EXPECT_NE(grown->info().source.find(", voxels of 226 HU and more grown in the volume from 17,3.2,3 mm"),
            std::string::npos)
      << grown->info().source;
  EXPECT_NE(similar->info().source.find("within 200 HU of the region's mean grown slice by slice from 17,3,3 mm"),
            std::string::npos)
      << similar->info().source;
  EXPECT_EQ(both->bone_number({20, 6, 4}), 1) << "in the order of the seeds";
  EXPECT_EQ(both->bone_number({7, 7, 4}), 2);
}

TEST_F(Program, WrongSeedsAreOneSentence) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  expect_refused({"ct", path("series"), "--out", path("case"), "--seed", "1,2"}, "write X,Y,Z in mm", folder_);
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{"ct", path("series"), "--out", path("case")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  expect_refused(with({"--similar", "50"}), "--seed", folder_);
  expect_refused(with({"--by", "slice"}), "--seed", folder_);
  expect_refused(with({"--seed", "3,3,3", "--adaptive"}), "--similar", folder_);
  expect_refused(with({"--seed", "3,3,3", "--by", "row"}), "--by", folder_);
  expect_refused(with({"--seed", "3,3,3", "--keep", "1"}), "--keep", folder_);
  expect_refused(with({"--seed", "3,3,3", "--similar", "50", "--threshold", "300"}), "--threshold", folder_);
  for (const char* wrong : {"0", "nan"})
    expect_refused(with({"--seed", "3,3,3", "--similar", wrong}), "--similar", folder_);
  expect_refused(with({"--threshold", "Suggest"}), "nor the word suggest", folder_);
}

TEST_F(Program, EditsAndSeedsOfAFileMakeTheSameCaseAgain) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  std::ofstream(path("edits.yaml")) << "edits:\n"
                                       "  - {kind: seed, point_mm: [17, 3, 3], bone: 6}\n"
                                       "  - {kind: seed, point_mm: [3, 3, 3]}\n"
                                       "  - {kind: erase, bone: 6, centre_mm: [20, 6, 6], radius_mm: 1}\n";
  const std::string told = import_series("first", {"--edits", path("edits.yaml")});
  EXPECT_NE(told.find("2 in the case, separated"), std::string::npos) << told;
  EXPECT_NE(told.find("3  erase bone 6, at 20,6,6 mm, radius 1 mm: 0.000 cm3 added, 0.007 cm3 taken"),
            std::string::npos)
      << told;
  import_series("again", {"--edits", path("edits.yaml")});
  const auto first = Case::load(path("first")), again = Case::load(path("again"));
  ASSERT_TRUE(first && again);
  EXPECT_EQ(first->hash(), again->hash());
  EXPECT_EQ(first->bone_number({20, 6, 4}), 6);
  EXPECT_EQ(first->bone_number({7, 7, 4}), 7) << "the next number";
  ASSERT_EQ(first->info().labels.size(), 2u);
  EXPECT_EQ(first->info().labels[0].provenance.edits.size(), 2u);
  EXPECT_EQ(first->info().labels[1].provenance.edits.size(), 1u);
}

TEST_F(Program, WrongEditsAreOneSentence) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  const auto refused = [&](const std::string& text, const std::vector<std::string>& more, const std::string& named) {
    std::ofstream(path("edits.yaml")) << text;
    std::vector<std::string> arguments{"ct", path("series"), "--out", path("case"), "--edits", path("edits.yaml")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_refused(arguments, named, folder_);
  };
  const std::string seed = "edits: [{kind: seed, point_mm: [3, 3, 3]}]";
  refused("edits: [{kind: erase, centre_mm: [3, 3, 3], radius_mm: NaN}]", {}, "line 1, edit 1: radius_mm is \"NaN\"");
  refused(seed, {"--keep", "1"}, "has a seed, which --keep and --labels exclude");
  refused(seed, {"--list"}, "--list");
  refused("edits: [{kind: outside, point_mm: [3, 3, 3]}]", {}, "has a seed outside and none of a bone");
  refused("edits: [{kind: box, corner_mm: [0, 0, 0], opposite_mm: [9, 9, 9]}]", {"--labels", path("series")},
          "has a box, which --labels excludes");
  refused(seed, {"--separate", "--merge"}, "--merge");
  expect_refused({"ct", path("series"), "--out", path("case"), "--edits", path("none.yaml")}, "none.yaml", folder_);
  // These are found out when the scan is there.
  for (const auto& [text, named] :
       {std::pair{"edits: [{kind: erase, centre_mm: [-99, 3, 3], radius_mm: 1}]", "edit 1 (erase): it covers no voxel"},
        std::pair{"edits: [{kind: box, corner_mm: [-99, 3, 3], opposite_mm: [-90, 9, 9]}]",
                  "edit 1 (box): it holds no voxel of the scan"},
        std::pair{"edits: [{kind: seed, point_mm: [-99, 3, 3]}]", "lies outside the scan"}}) {
    std::ofstream(path("edits.yaml")) << text;
    const auto late = test::run(kProgram, {"ct", path("series"), "--out", path("case"), "--edits", path("edits.yaml")});
    EXPECT_EQ(late.exit_code, 1);
    EXPECT_NE(late.err.find(named), std::string::npos) << late.err;
    EXPECT_FALSE(fs::exists(path("case")));
  }
}

TEST_F(Program, SuggestsAThresholdAndSaysWhy) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  const auto made = test::run(kProgram, {"ct", path("series"), "--out", path("case"), "--threshold", "suggest"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("parts soft tissue (-90 +- 0 HU) from bone (1400 +- 0 HU"), std::string::npos) << made.out;
  const auto bone = Case::load(path("case"));
  ASSERT_TRUE(bone);
  EXPECT_GT(bone->info().threshold_hu, -90.0);
  EXPECT_LT(bone->info().threshold_hu, 1400.0);
  EXPECT_NE(made.out.find("threshold  " + std::to_string(std::lround(bone->info().threshold_hu)) + " HU"),
            std::string::npos)
      << made.out;
}

TEST_F(Program, AStepThatRemovesNothingSaysWhy) {
  ASSERT_EQ(test::run(kProgram, {"phantom", "block", "--layers", "6:1.9", "--width", "10", "--pitch", "0.5", "--out",
                                 path("case")})
                .exit_code,
            0);
  std::ofstream(folder_ / "script.yaml")
      << "steps:\n"
         "  - {tool: burr-round-5, axis: [0, 0, -1], from: [0, 0, -2], to: [1, 0, -2]}\n"
         "  - {tool: burr-round-5, axis: [0, 0, -1], from: [0, 0, -2], to: [1, 0, -2]}\n"
         "  - {tool: burr-round-5, axis: [0, 0, -1], from: [0, 0, 80], to: [1, 0, 80]}\n"
         "  - {tool: burr-round-5, axis: [0, 0, -1], from: [0, 0, 5], to: [1, 0, 5]}\n";
  const auto carved = test::run(kProgram, {"carve", path("case"), path("script.yaml"), "--out", path("cut.vdb")});
  ASSERT_EQ(carved.exit_code, 0) << carved.err;
  EXPECT_EQ(carved.out.find("step 1 removed nothing"), std::string::npos) << carved.out;
  EXPECT_NE(carved.out.find("step 2 removed nothing: what its tip meets was removed before"), std::string::npos)
      << carved.out;
  EXPECT_NE(carved.out.find("step 3 removed nothing: its tip stays at least"), std::string::npos) << carved.out;
  EXPECT_NE(carved.out.find("step 4 removed nothing: its tip stays at least"), std::string::npos) << carved.out;
}

TEST_F(Program, ListsSeriesForPrograms) {
  ASSERT_NO_FATAL_FAILURE(write_disc(folder_ / "disc"));
  const auto listed = test::run(kProgram, {"series", path("disc"), "--json"});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  const auto report = nlohmann::json::parse(listed.out);
  EXPECT_EQ(report.at("taken"), 2);
  EXPECT_EQ(report.at("series").size(), 2u);
  EXPECT_EQ(report.at("series")[1].at("description"), "Block 1.0 H60s");
  EXPECT_EQ(report.at("skipped")[0].at("kind"), "file that is not DICOM");
}

TEST_F(Program, WrongSeriesNumbersAreOneSentence) {
  ASSERT_NO_FATAL_FAILURE(write_disc(folder_ / "disc"));
  expect_refused({"ct", path("disc"), "--series", "7", "--out", path("case")},
                 "has the series 1 to 2; osteon-import series lists them", folder_);
  expect_refused({"ct", path("disc"), "--series", "x", "--out", path("case")}, "--series", folder_);
  ASSERT_NO_FATAL_FAILURE(write_inv3(folder_ / "a.inv3", {}));
  expect_refused({"ct", path("a.inv3"), "--series", "1", "--out", path("case")}, "InVesalius", folder_);
  expect_refused({"series", path("a.inv3")}, "InVesalius", folder_);
  std::ofstream(folder_ / "a.nrrd") << "NRRD0004\n";
  expect_refused({"ct", path("a.nrrd"), "--series", "1", "--out", path("case")}, "leave it out", folder_);
  expect_refused({"series", path("a.nrrd")}, "osteon-import ct", folder_);
  expect_refused({"series", path("absent")}, path("absent"), folder_);
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  expect_refused({"ct", path("pipe"), "--out", path("case")}, "is a pipe or device", folder_);
  expect_refused({"series", path("pipe")}, path("pipe"), folder_);
}

TEST_F(Program, WrongUsageIsOneSentence) {
  expect_refused({}, "--help", folder_);
  expect_refused({"paint"}, "subcommand", folder_);
  expect_refused({"ct", path("x")}, "--out", folder_);
  expect_refused({"ct", path("x"), "--out", path("case"), "--pitch", "wide"}, "--pitch", folder_);
  expect_refused({"ct", path("x"), "--out", path("case"), "--pitch", "-1"}, "--pitch", folder_);
  expect_refused({"phantom", "cube", "--layers", "5:1", "--out", path("case")}, "cube", folder_);
  expect_refused({"phantom", "block", "--layers", "5=1", "--out", path("case")}, "--layers 5=1", folder_);
  expect_refused({"phantom", "block", "--layers", "5:1", "--pitch", "7", "--out", path("case")}, "--pitch", folder_);
}

// The user of the tool would otherwise learn it too late.
TEST_F(Program, AToolWithALawThatDoesNotFitIsRefused) {
  const auto write = [&](const std::string& law) {
    std::ofstream(folder_ / "my-drill.yaml")
        << "name: my-drill\ntitle: My drill\nkind: drill\ndiameter_mm: 4\ncutting_length_mm: 40\n"
           "point_angle_deg: 118\nshank_diameter_mm: 4\nshank_length_mm: 40\nspindle_rpm: 1000\n"
           "teeth: 2\nfeed_mm_per_rev: 0.05\ncut_level: 2\nlaw: "
        << law << "\n";
  };
  write("allotta");
  EXPECT_EQ(test::run(kProgram, {"tools", "--file", path("my-drill.yaml")}).exit_code, 0);
  write("hooke");
  expect_refused({"tools", "--file", path("my-drill.yaml")}, "there is no force law \"hooke\"", folder_);
  write("saw");
  expect_refused({"tools", "--file", path("my-drill.yaml")}, "is not for a drill", folder_);
}

TEST_F(Program, NothingIsOverwritten) {
  fs::create_directory(folder_ / "mine");
  std::ofstream(folder_ / "mine" / "letter.txt") << "keep me\n";
  expect_refused({"phantom", "block", "--layers", "5:1", "--out", path("mine")}, path("mine"), folder_);
  expect_refused({"phantom", "block", "--layers", "5:1", "--out", path("case"), "--dicom", path("mine")}, path("mine"),
                 folder_);
  expect_refused({"ct", path("mine"), "--out", path("mine")}, path("mine"), folder_);
  EXPECT_EQ(files_of(folder_ / "mine").size(), 1u);
}

TEST_F(Program, AFolderThatCannotBeMadeIsOneSentence) {
  std::ofstream(folder_ / "file") << "x";
  const auto result = test::run(kProgram, {"phantom", "block", "--layers", "5:1", "--out", path("file/case")});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find(path("file")), std::string::npos) << result.err;
}

TEST_F(Program, InfoFindsADamagedScanAndNeedsNone) {
  ASSERT_NO_FATAL_FAILURE(write_two_boxes(path("series")));
  import_series("case", {});
  const auto file = folder_ / "case" / "scan.vdb";
  ASSERT_EQ(test::run(kProgram, {"info", path("case")}).exit_code, 0);
  truncate_file(file, 0.9);
  expect_refused({"info", path("case")}, "scan.vdb", folder_);
  fs::remove(file);
  EXPECT_EQ(test::run(kProgram, {"info", path("case")}).exit_code, 0) << "as a client receives it";
}

TEST_F(Program, InfoOfABrokenCaseIsOneSentence) {
  ASSERT_EQ(test::run(kProgram, {"phantom", "block", "--layers", "3:1.9", "--width", "4", "--pitch", "0.5", "--out",
                                 path("case")})
                .exit_code,
            0);
  expect_refused({"info", path("absent")}, path("absent"), folder_);
  fs::create_directory(folder_ / "empty");
  expect_refused({"info", path("empty")}, path("empty"), folder_);

  nlohmann::json description;
  std::ifstream(folder_ / "case" / "case.json") >> description;
  const auto describe = [&](const nlohmann::json& j) {
    std::ofstream(folder_ / "case" / "case.json", std::ios::trunc) << j.dump(2);
  };
  auto newer = description;
  newer["schema_version"] = 99;
  describe(newer);
  expect_refused({"info", path("case")}, "99", folder_);
  auto incomplete = description;
  incomplete.erase("pitch_mm");
  describe(incomplete);
  expect_refused({"info", path("case")}, "pitch_mm", folder_);
  std::ofstream(folder_ / "case" / "case.json", std::ios::trunc) << "{";
  expect_refused({"info", path("case")}, "case.json", folder_);
  auto renamed = description;
  renamed["title"] = "Another";
  describe(renamed);
  expect_refused({"info", path("case")}, path("case"), folder_);
  describe(description);
  truncate_file(folder_ / "case" / "bone.vdb", 0.5);
  expect_refused({"info", path("case")}, path("case"), folder_);
}

// Starts a command, waits for the percentage and sends Ctrl-C. Expects exit code 130 and only the files from before.
void expect_stopped(const std::vector<std::string>& arguments, int percent, const test::TempDir& folder) {
  const auto before = files_of(folder.path());
  test::Process process(kProgram, arguments);
  ASSERT_TRUE(process.wait_for_percent(percent, 60s)) << "too quick to be stopped: " << process.err();
  process.signal(SIGINT);
  EXPECT_EQ(process.wait(60s), 130);
  EXPECT_NE(process.err().find("osteon-import: stopped"), std::string::npos) << process.err();
  EXPECT_EQ(process.out(), "");
  EXPECT_EQ(files_of(folder.path()), before);
}

// If it is stopped while a large archive is unpacked, no folder stays behind.
TEST_F(Program, CtrlCWhileUnpackingLeavesNothing) {
  const auto volume = numbered_volume(700, 700, 140);
  ASSERT_TRUE(write_dicom_series(volume, folder_ / "disc" / "series", keep_going));
  ASSERT_NO_FATAL_FAILURE(write_archive(folder_ / "disc", folder_ / "disc.iso", "iso9660"));
  fs::create_directory(folder_ / "tmp");
  for (const int number : {SIGINT, SIGTERM}) {
    test::Process process(kProgram, {"ct", path("disc.iso"), "--out", path("case"), "--pitch", "2"},
                          {.environment = {{"TMPDIR", path("tmp")}}});
    ASSERT_TRUE(process.wait_for_percent(1, 60s)) << "too quick to be stopped: " << process.err();
    process.signal(number);
    EXPECT_EQ(process.wait(60s), 130);
    EXPECT_EQ(process.out(), "");
    EXPECT_TRUE(files_of(folder_ / "tmp").empty());
    EXPECT_FALSE(fs::exists(folder_ / "case"));
  }
}

TEST_F(Program, CtrlCLeavesNothing) {
  ASSERT_EQ(test::run(kProgram, {"phantom", "tube", "--layers", "4:1.9,6:0.9", "--width", "30", "--pitch", "0.4",
                                 "--out", path("case"), "--dicom", path("series")})
                .exit_code,
            0);
  const std::vector<std::string> import{"ct", path("series"), "--out", path("imported"), "--threshold",
                                        "0",  "--pitch",      "0.12"};
  expect_stopped(import, 20, folder_);
  expect_stopped(import, 50, folder_);
  const std::vector<std::string> phantom{"phantom", "block", "--layers", "40:1.9",  "--width", "50",
                                         "--pitch", "0.25",  "--out",    path("p"), "--dicom", path("d")};
  expect_stopped(phantom, 10, folder_);
  expect_stopped(phantom, 60, folder_);  // while it writes the DICOM files
}

}  // namespace
}  // namespace osteon::import
