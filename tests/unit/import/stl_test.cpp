// A case from a triangle mesh: closed forms of a sphere and a box, both orientations of triangles, and meshes that are
// not bones.
#include <cmath>
#include <fstream>
#include <numbers>

#include "common/geometry/mesh_file.hpp"
#include "common/volume/mesh_distance.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/import/fixtures.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kPi = std::numbers::pi;
const Vec3 kCentre(3.3, -17.1, 40.7);

// A ball with corners on meridians and parallels. The radius is chosen so that the triangles enclose the ball's volume
// to second order.
TriangleMesh ball(double radius_mm, int parallels = 90) {
  TriangleMesh mesh;
  const int meridians = 2 * parallels;
  const auto corner = [&](double polar, double around) {
    const Vec3 p = kCentre + radius_mm * Vec3(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                              std::cos(polar));
    mesh.positions_mm.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  };
  corner(0, 0);
  for (int i = 1; i < parallels; ++i)
    for (int j = 0; j < meridians; ++j) corner(kPi * i / parallels, 2 * kPi * j / meridians);
  corner(kPi, 0);
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(1 + (i - 1) * meridians + j % meridians); };
  const auto south = static_cast<std::uint32_t>(mesh.positions_mm.size() - 1);
  for (int j = 0; j < meridians; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    for (int i = 1; i + 1 < parallels; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    mesh.triangles.push_back({at(parallels - 1, j), south, at(parallels - 1, j + 1)});
  }
  return mesh;
}

Result<Case> made(const TriangleMesh& mesh, double pitch_mm, double density = 1.4) {
  CaseInfo info;
  info.title = "Ball";
  info.source = "test";
  info.pitch_mm = pitch_mm;
  return case_of_mesh(info, mesh, density, keep_going);
}

TEST(MeshCase, ABallHasItsDistancesVolumeAndDensity) {
  const double r = 12.0, pitch = 0.5;
  const auto bone = made(ball(r), pitch);
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_NEAR(bone->volume_mm3(), 4.0 / 3.0 * kPi * r * r * r, 0.003 * 7238.0);
  // The middles of the quads lie up to 2 r (1 - cos(pi / 180)) = 0.0037 mm within the ball. Between samples, a distance
  // that bends by 1 / r is wrong by h² / 4r. Cells at the end of the band, 2 mm away, have clipped corners.
  for (double at = -1.1; at < 1.1; at += 0.13)
    for (const Vec3& way :
         {Vec3(1, 0, 0), Vec3(0.6, 0, 0.8), Vec3(-1, 2, 3).normalized(), Vec3(1, -1, -1).normalized()})
      EXPECT_NEAR(bone->surface_mm(kCentre + (r + at) * way), at, 0.004 + pitch * pitch / (4 * (r - 2)))
          << way.transpose();
  EXPECT_EQ(bone->surface_mm(kCentre), -4 * pitch);
  EXPECT_EQ(bone->surface_mm(kCentre + Vec3(0, 0, r + 6)), 4 * pitch);
  EXPECT_NEAR(bone->density_g_cm3(kCentre), 1.4, 0.01);
  EXPECT_NEAR(bone->density_g_cm3(kCentre + Vec3(0, r - 0.1, 0)), 1.4, 0.01);
}

TEST(MeshCase, ItDoesNotMatterWhichWayTheTrianglesTurn) {
  TriangleMesh mesh = ball(8.0, 40);
  const auto outwards = made(mesh, 0.5);
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  const auto inwards = made(mesh, 0.5);
  ASSERT_TRUE(outwards && inwards);
  EXPECT_NEAR(outwards->volume_mm3(), inwards->volume_mm3(), 1e-6 * outwards->volume_mm3());
}

TEST(MeshCase, AShellThatTurnsInwardsIsACavity) {
  TriangleMesh mesh = ball(12.0, 60);
  const TriangleMesh inner = ball(9.0, 60);
  const auto first = static_cast<std::uint32_t>(mesh.positions_mm.size());
  mesh.positions_mm.insert(mesh.positions_mm.end(), inner.positions_mm.begin(), inner.positions_mm.end());
  for (const auto& t : inner.triangles) mesh.triangles.push_back({first + t[1], first + t[0], first + t[2]});
  const auto bone = made(mesh, 0.5);
  ASSERT_TRUE(bone);
  EXPECT_GT(bone->surface_mm(kCentre), 0.0);
  EXPECT_NEAR(bone->volume_mm3(), 4.0 / 3.0 * kPi * (1728.0 - 729.0), 0.01 * 4184.0);
}

TEST(MeshCase, MeshesThatAreNoBoneAreOneSentence) {
  const auto refused = [](const TriangleMesh& mesh, double pitch_mm, const std::string& named) {
    const auto bone = made(mesh, pitch_mm);
    ASSERT_FALSE(bone) << named;
    EXPECT_EQ(bone.error().code, ErrorCode::invalid_input);
    EXPECT_NE(bone.error().message.find(named), std::string::npos) << bone.error().message;
    EXPECT_EQ(bone.error().message.find('\n'), std::string::npos);
  };
  refused({}, 0.5, "no triangles");
  refused(ball(0.012, 20), 0.5, "unit");
  refused(ball(12000.0, 20), 0.5, "unit");
  refused(ball(900.0, 20), 0.02, "memory");
  TriangleMesh open = ball(12.0, 20);
  open.triangles.pop_back();
  refused(open, 0.5, "not the closed surface");
}

TEST(MeshCase, StopsWhenAsked) {
  CaseInfo info;
  info.pitch_mm = 0.5;
  const auto bone = case_of_mesh(info, ball(12.0, 20), 1.9, [](double) { return false; });
  ASSERT_FALSE(bone);
  EXPECT_EQ(bone.error().code, ErrorCode::cancelled);
}

TEST(MeshCase, TheProgramScalesAndRefuses) {
  const test::TempDir folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  ASSERT_TRUE(write_stl(ball(1.2, 60), folder / "cm.stl"));
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), "stl");
    return test::run(OSTEON_IMPORT_PROGRAM, more);
  };
  const auto result =
      run({path("cm.stl"), "--unit", "cm", "--pitch", "0.6", "--density", "0.8", "--out", path("case")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto bone = Case::load(folder / "case");
  ASSERT_TRUE(bone);
  EXPECT_NEAR(bone->volume_mm3(), 4.0 / 3.0 * kPi * 1728.0, 0.01 * 7238.0);
  EXPECT_NEAR(bone->density_g_cm3(10.0 * kCentre), 0.8, 0.01);

  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& named) {
    const auto wrong = run(arguments);
    EXPECT_EQ(wrong.exit_code, 1);
    EXPECT_EQ(wrong.out, "");
    EXPECT_NE(wrong.err.find(named), std::string::npos) << wrong.err;
    EXPECT_EQ(std::ranges::count(wrong.err, '\n'), 1) << wrong.err;
    EXPECT_FALSE(fs::exists(folder / "other"));
  };
  refused({path("cm.stl"), "--out", path("other")}, "unit");
  refused({path("cm.stl"), "--unit", "cm", "--out", path("case")}, "already there");
  refused({path("absent.stl"), "--out", path("other")}, path("absent.stl"));
  std::ofstream(folder / "letter.stl") << "Dear reader\n";
  refused({path("letter.stl"), "--out", path("other")}, "not an STL");
  refused({folder.path().string(), "--out", path("other")}, folder.path().string());
}

}  // namespace
}  // namespace osteon::import
