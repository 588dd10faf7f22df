// Label volumes: stacks of PNG slices that the tests draw.
#include <png.h>

#include <csignal>
#include <fstream>
#include <functional>
#include <numbers>

#include "server/import/label_import.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

using Rgba = std::array<std::uint8_t, 4>;
constexpr Rgba kBone{255, 249, 219, 255}, kEmpty{0, 0, 0, 0}, kNoise{109, 178, 173, 254};

void write_slice(const fs::path& file, int width, int height, const std::function<Rgba(int, int)>& colour) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const std::uint8_t part : colour(x, y)) pixels.push_back(part);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGBA;
  ASSERT_NE(png_image_write_to_file(&image, file.c_str(), 0, pixels.data(), 0, nullptr), 0) << image.message;
}

// plane000.png, plane001.png, … plane0010.png: numbered without padding, as in the temporal bone's data.
void write_stack(const fs::path& folder, int width, int height, int slices,
                 const std::function<Rgba(int, int, int)>& colour) {
  fs::create_directories(folder);
  for (int z = 0; z < slices; ++z)
    write_slice(folder / ("plane00" + std::to_string(z) + ".png"), width, height,
                [&](int x, int y) { return colour(x, y, z); });
}

constexpr double kRadius = 11.0;  // voxels
Rgba coloured_ball(int x, int y, int z) {
  if ((x == 3 && y == 4) || (x == 14 && y == 4 && z == 14)) return kNoise;
  return (Vec3(x, y, z) - Vec3(14.2, 15.4, 13.8)).norm() < kRadius ? kBone : kEmpty;
}

class Labels : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const char* name) const { return (folder_ / name).string(); }
  void expect_refused(const std::string& name, const std::string& names, ErrorCode code = ErrorCode::invalid_input) {
    const auto stack = read_label_stack(folder_ / name, {}, Vec3::Ones(), keep_going);
    ASSERT_FALSE(stack);
    EXPECT_EQ(stack.error().code, code);
    expect_one_sentence(stack.error(), names);
  }
  test::TempDir folder_;
};

TEST_F(Labels, SlicesLieByTheirNumbers) {
  // The column of the colour gives the slice's number. With eleven slices, an order by text would put 10 right after 1.
  write_stack(folder_ / "s", 12, 3, 11, [](int x, int y, int z) { return x == z && y == 1 ? kBone : kEmpty; });
  const auto stack = read_label_stack(folder_ / "s", {}, Vec3(0.1, 0.2, 0.3), keep_going);
  ASSERT_TRUE(stack) << stack.error().message;
  EXPECT_EQ(stack->volume.dims, (std::array<int, 3>{12, 3, 11}));
  for (int x = 0; x < 12; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 11; ++z) EXPECT_EQ(stack->volume.labels.at({x, y, z}), x == z && y == 1 ? 1 : 0);
  ASSERT_EQ(stack->colours.size(), 2u);
  EXPECT_EQ(stack->colours[1].voxels, 11);
  EXPECT_EQ(stack->colours[1].label, 1);
}

TEST_F(Labels, ABallBecomesABall) {
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "s", 29, 30, 28, coloured_ball));
  const double h = 0.25;
  auto stack = read_label_stack(folder_ / "s", {}, Vec3::Constant(h), keep_going);
  ASSERT_TRUE(stack) << stack.error().message;
  const auto made = import_labels(std::move(*stack), {}, {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->bone.pitch_mm(), h);
  const double truth = 4.0 / 3.0 * std::numbers::pi * std::pow(kRadius * h, 3);
  EXPECT_NEAR(made->labelled_mm3, truth, 0.01 * truth);  // error of counting voxels for a ball of this size
  EXPECT_NEAR(made->bone.volume_mm3(), made->labelled_mm3, 0.002 * made->labelled_mm3);
  const Vec3 centre = Vec3(14.2, 15.4, 13.8) * h;
  EXPECT_NEAR(made->bone.density_g_cm3(centre), 1.9, 1e-6);
  EXPECT_EQ(made->bone.tissue({14, 15, 14}), Tissue::cortical);
  // On the true surface, in all directions, S is within 0.3 voxel of zero, a label's own error, and the density does
  // not fall.
  for (int i = 0; i < 200; ++i) {
    const Vec3 way = Vec3(std::cos(2.4 * i) * std::sqrt(1 - std::pow(i / 100.0 - 1, 2)),
                          std::sin(2.4 * i) * std::sqrt(1 - std::pow(i / 100.0 - 1, 2)), i / 100.0 - 1);
    const Vec3 at = centre + kRadius * h * way;
    if ((at - Vec3(14, 4, 14) * h).norm() < 2.5 * h) continue;  // a voxel of noise makes a pit there
    EXPECT_NEAR(made->bone.surface_mm(at), 0.0, 0.3 * h) << way.transpose();
    EXPECT_NEAR(made->bone.density_g_cm3(at), 1.9, 1e-5);
  }
}

TEST_F(Labels, BoneEndsWhereTheVolumeDoes) {
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "s", 8, 10, 12, [](int, int, int) { return kBone; }));
  auto stack = read_label_stack(folder_ / "s", {}, Vec3(0.4, 0.4, 0.8), keep_going);
  const auto made = import_labels(std::move(*stack), {}, {}, keep_going);
  ASSERT_TRUE(made) << made.error().message;
  const double whole = 8 * 0.4 * 10 * 0.4 * 12 * 0.8;
  EXPECT_NEAR(made->bone.volume_mm3(), whole, 0.02 * whole);  // its edges are sampled
  EXPECT_NEAR(made->bone.surface_mm(Vec3(-0.2, 2.0, 4.0)), 0.0, 1e-3);
  EXPECT_NEAR(made->bone.surface_mm(Vec3(1.4, 2.0, 12 * 0.8 - 0.4)), 0.0, 0.01);  // between samples
  EXPECT_GT(made->bone.surface_mm(Vec3(-0.6, 2.0, 4.0)), 0.3);
}

TEST_F(Labels, ColoursNearABonesAreBoneAndOthersNot) {
  const Rgba colours[] = {{255, 249, 219, 255}, {250, 244, 222, 255}, {255, 225, 214, 255}, {110, 184, 209, 255}};
  write_stack(folder_ / "s", 4, 2, 3, [&](int x, int, int) { return colours[x]; });
  const auto stack = read_label_stack(folder_ / "s", {}, Vec3::Ones(), keep_going);
  ASSERT_TRUE(stack);
  for (int x = 0; x < 4; ++x) EXPECT_EQ(stack->volume.labels.at({x, 0, 0}), x < 2 ? 1 : 0);
}

TEST_F(Labels, ALegendGivesDensities) {
  std::ofstream(folder_ / "legend.yaml")
      << "tolerance: 2\nbones:\n  - {name: cortical, colour: [200, 0, 0], density_g_cm3: 1.9}\n"
         "  - {name: trabecular, colour: [0, 200, 0], density_g_cm3: 0.6}\n";
  const auto legend = read_legend(folder_ / "legend.yaml");
  ASSERT_TRUE(legend) << legend.error().message;
  EXPECT_EQ(legend->bones[1].name, "trabecular");
  write_stack(folder_ / "s", 20, 10, 10, [](int x, int, int) {
    return x < 10 ? Rgba{200, 0, 0, 255} : Rgba{0, 201, 0, 255};
  });
  auto stack = read_label_stack(folder_ / "s", *legend, Vec3::Ones(), keep_going);
  ASSERT_TRUE(stack) << stack.error().message;
  const auto made = import_labels(std::move(*stack), *legend, {}, keep_going);
  ASSERT_TRUE(made);
  EXPECT_NEAR(made->bone.density_g_cm3(Vec3(4, 5, 5)), 1.9, 1e-6);
  EXPECT_NEAR(made->bone.density_g_cm3(Vec3(15, 5, 5)), 0.6, 1e-6);
  EXPECT_EQ(made->bone.tissue({4, 5, 5}), Tissue::cortical);
  EXPECT_EQ(made->bone.tissue({15, 5, 5}), Tissue::trabecular);
}

TEST_F(Labels, BadLegendsAreOneSentence) {
  const auto refused = [&](const std::string& text, const std::string& named) {
    std::ofstream(folder_ / "l.yaml", std::ios::trunc) << text;
    const auto legend = read_legend(folder_ / "l.yaml");
    ASSERT_FALSE(legend) << text;
    EXPECT_NE(legend.error().message.find(named), std::string::npos) << legend.error().message;
    EXPECT_EQ(legend.error().message.find('\n'), std::string::npos);
  };
  refused("[", "l.yaml");
  refused("bones: 3", "list");
  refused("bones: []", "list");
  refused("bones: [{colour: [1, 2]}]", "three numbers");
  refused("bones: [{colour: [1, 2, 300]}]", "255");
  refused("bones: [{colour: [1, 2, 3], density_g_cm3: -1}]", "density");
  refused("bonse: []", "bonse");
  EXPECT_EQ(read_legend(folder_ / "absent.yaml").error().code, ErrorCode::not_found);
}

TEST_F(Labels, ColoursOnTheCommandLine) {
  const auto bone = parse_bone_colour("1,20,255:0.75");
  ASSERT_TRUE(bone);
  EXPECT_EQ(bone->rgb, (std::array<std::uint8_t, 3>{1, 20, 255}));
  EXPECT_EQ(bone->density_g_cm3, 0.75);
  EXPECT_EQ(parse_bone_colour("1,2,3")->density_g_cm3, 1.9);
  for (const char* wrong :
       {"", "1,2", "1,2,3,4", "1,2,256", "-1,2,3", "1,2,3:", "1,2,3:x", "1,2,3:0", "1,2,3:9", "red"})
    EXPECT_FALSE(parse_bone_colour(wrong)) << wrong;
}

std::uint32_t png_checksum(std::string_view bytes) {
  std::uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
  }
  return ~crc;
}

// Makes the header of a PNG claim a size that its pixels do not have.
void claim_size(const fs::path& file, std::uint32_t width, std::uint32_t height) {
  std::string header = "IHDR";
  const auto add = [&](std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) header += static_cast<char>(value >> shift & 0xff);
  };
  add(width), add(height);
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  std::string rest(5, '\0');
  stream.seekg(24).read(rest.data(), 5);
  header += rest;
  add(png_checksum(header));
  stream.seekp(12).write(header.data(), static_cast<std::streamsize>(header.size()));
}

TEST_F(Labels, ASliceThatClaimsMorePixelsThanASliceHasTakesNoMemory) {
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "huge", 6, 6, 1, [](int, int, int) { return kBone; }));
  claim_size(folder_ / "huge" / "plane000.png", 20000, 20000);
  expect_refused("huge", "plane000.png is 20000x20000, more than the 64 million pixels");
}

TEST_F(Labels, BadStacksAreOneSentence) {
  expect_refused("absent", "absent", ErrorCode::not_found);
  fs::create_directory(folder_ / "empty");
  expect_refused("empty", "no PNG");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "gap", 6, 6, 5, [](int, int, int) { return kBone; }));
  fs::remove(folder_ / "gap" / "plane003.png");
  expect_refused("gap", "slice 3 is missing");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "size", 6, 6, 5, [](int, int, int) { return kBone; }));
  write_slice(folder_ / "size" / "plane004.png", 7, 6, [](int, int) { return kBone; });
  expect_refused("size", "plane004.png is 7x6");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "text", 6, 6, 5, [](int, int, int) { return kBone; }));
  std::ofstream(folder_ / "text" / "plane002.png", std::ios::trunc) << "Dear reader\n";
  expect_refused("text", "plane002.png");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "cut", 60, 60, 5,
                                      [](int x, int y, int z) { return (x * y + z) % 3 != 0 ? kBone : kNoise; }));
  truncate_file(folder_ / "cut" / "plane002.png", 0.5);
  expect_refused("cut", "plane002.png");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "soft", 6, 6, 5, [](int, int, int) { return kNoise; }));
  expect_refused("soft", "109,178,173");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "two", 6, 6, 2, [](int, int, int) { return kBone; }));
  write_slice(folder_ / "two" / "mask2.png", 6, 6, [](int, int) { return kBone; });
  expect_refused("two", "more than one stack");
  fs::create_directory(folder_ / "unnumbered");
  write_slice(folder_ / "unnumbered" / "picture.png", 6, 6, [](int, int) { return kBone; });
  expect_refused("unnumbered", "picture.png");
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "twice", 6, 6, 2, [](int, int, int) { return kBone; }));
  write_slice(folder_ / "twice" / "plane1.png", 6, 6, [](int, int) { return kBone; });
  expect_refused("twice", "same slice number");
}

TEST_F(Labels, TheProgramImportsAndReports) {
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "s", 29, 30, 28, coloured_ball));
  const auto made = test::run(OSTEON_IMPORT_PROGRAM,
                              {"labels", path("s"), "--spacing", "0.25", "--out", path("case"), "--title", "Ball"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("title      Ball"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("109,178,173"), std::string::npos) << made.out;
  EXPECT_EQ(made.out.find("HU"), std::string::npos) << made.out;
  ASSERT_TRUE(Case::load(path("case")));
  const auto refused = [&](std::vector<std::string> arguments, const std::string& named) {
    const auto result = test::run(OSTEON_IMPORT_PROGRAM, arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_NE(result.err.find(named), std::string::npos) << result.err;
    EXPECT_EQ(std::ranges::count(result.err, '\n'), 1) << result.err;
  };
  refused({"labels", path("s"), "--spacing", "0.25", "--out", path("case")}, "already there");
  refused({"labels", path("s"), "--out", path("new")}, "--spacing");
  refused({"labels", path("s"), "--spacing", "0.25,1", "--out", path("new")}, "--spacing 0.25,1");
  refused({"labels", path("s"), "--spacing", "0", "--out", path("new")}, "--spacing 0");
  refused({"labels", path("s"), "--spacing", "0.25", "--bone", "red", "--out", path("new")}, "--bone red");
  refused({"labels", path("absent"), "--spacing", "0.25", "--out", path("new")}, path("absent"));
  EXPECT_FALSE(fs::exists(path("new")));
}

TEST_F(Labels, CtrlCLeavesNothing) {
  ASSERT_NO_FATAL_FAILURE(write_stack(folder_ / "s", 200, 200, 150, [](int x, int y, int z) {
    return (x / 9 + y / 7 + z / 8) % 2 == 0 ? kBone : kEmpty;
  }));
  for (const int percent : {10, 40}) {
    test::Process process(OSTEON_IMPORT_PROGRAM,
                          {"labels", path("s"), "--spacing", "0.2", "--pitch", "0.12", "--out", path("case")});
    ASSERT_TRUE(process.wait_for_percent(percent, 60s)) << "too quick to be stopped: " << process.err();
    process.signal(SIGINT);
    EXPECT_EQ(process.wait(60s), 130);
    EXPECT_NE(process.err().find("osteon-import: stopped"), std::string::npos) << process.err();
    EXPECT_EQ(files_of(folder_.path()).size(), 1u);
  }
}

}  // namespace
}  // namespace osteon::import
