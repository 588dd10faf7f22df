// Draws blocks of all levels side by side and looks for cracks. Through a crack the bright background is visible, or
// the inside of the far wall in a strong colour.
#include <gtest/gtest.h>
#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <set>
#include <vector>

#include "common/surface/block_source.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/xvfb.hpp"

namespace osteon {
namespace {

constexpr double kPitch_mm = 0.8, kDeepest_mm = 1.2;
constexpr double kSmall_mm = 30.0;  // so close that the cracks between cuts fill pixels
constexpr double kLarge_mm = 75.0;  // room for five levels side by side
constexpr int kEdge_px = 900;
constexpr double kDistance = 5.0;  // of the eye, in radii
constexpr double kViewAngle_deg = 24.0;
constexpr int kEroded_px = 2;
// Beside a seam a sliver of less than a hundredth of a square millimetre may face the wrong way. In all pictures
// together that is only a few pixels. Cracks show by tens of pixels.
constexpr int kSlivers_px = 6;

// A ball with a groove on each level. All three cross at its north pole.
struct GroovedBall {
  double radius_mm;
  CutField field{test::make_bone(
                     {Vec3::Constant(-radius_mm - 4), Vec3::Constant(radius_mm + 4)}, kPitch_mm,
                     [r = radius_mm](const Vec3& p) { return p.norm() - r; }, [](const Vec3&) { return 1.9; }),
                 BodyId{}};
  SurfaceBlocks blocks{BodyId{}};

  explicit GroovedBall(double radius) : radius_mm(radius) {
    const double tip = radius_mm - 1.0;
    const std::array<std::pair<Vec3, Vec3>, 3> ends{
        {{{-5, 0, tip}, {5, 0.3, tip}}, {{0.2, -5, tip}, {0, 5, tip}}, {{-4, -4, tip}, {4, 3.5, tip}}}};
    for (int level = 0; level < kLevels; ++level) {
      const auto& [from, to] = ends[static_cast<std::size_t>(level)];
      Cut cut = test::straight_cut(*find_tool("burr-round-5"), from, to, {0, 0, -1});
      cut.level = level;
      const CutReport report = field.apply(cut);
      (void)blocks.touch(level, report.changed_leaves);
    }
  }
  void focus(const Focus& focus) { (void)blocks.focus({&focus, 1}, field.bone().bounds_samples(), kPitch_mm); }

  // The surface, encoded and decoded again. Without seams every block is made as if it were alone.
  vtkSmartPointer<vtkPolyData> surface(bool seams) const {
    std::vector<BlockKey> keys = blocks.fine_blocks();
    for (const BlockKey& key : blocks.coarse_blocks()) keys.push_back(key);
    const CoordBox b = field.bone().bounds_samples();
    for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
      for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
        for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z) keys.push_back({{}, 0, {x, y, z}});
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> triangles;
    levels_.clear();
    for (const BlockKey& key : keys) {
      BlockSamples samples;
      gather_block(field, blocks, key, kPitch_mm, samples);
      if (!seams) samples.seams = {};
      const auto mesh = decode_block(key, encode_block(samples), level_pitch_mm(kPitch_mm, key.level));
      EXPECT_TRUE(mesh);
      if (!mesh->triangles.empty()) levels_.insert(key.level);
      const vtkIdType first = points->GetNumberOfPoints();
      for (const auto& p : mesh->positions_mm) points->InsertNextPoint(p[0], p[1], p[2]);
      for (const auto& t : mesh->triangles) {
        const vtkIdType corners[] = {first + t[0], first + t[1], first + t[2]};
        triangles->InsertNextCell(3, corners);
      }
    }
    auto data = vtkSmartPointer<vtkPolyData>::New();
    data->SetPoints(points);
    data->SetPolys(triangles);
    return data;
  }
  [[nodiscard]] const std::set<int>& levels() const { return levels_; }  // that the last surface had

 private:
  mutable std::set<int> levels_;
};

struct Leaks {
  int background = 0, inside = 0, covered = 0;
};

class Silhouette : public testing::Test {
 protected:
  void SetUp() override {
    screen_ = test::Xvfb::start();
    ASSERT_TRUE(screen_) << "Xvfb, of Debian's package xvfb, did not start";
    ::setenv("DISPLAY", screen_->display().c_str(), 1);
    window_ = vtkSmartPointer<vtkRenderWindow>::New();
    window_->SetMultiSamples(0);
    window_->SetSize(kEdge_px, kEdge_px);
    window_->AddRenderer(renderer_);
    renderer_->SetBackground(0.0, 1.0, 0.0);
    renderer_->AddActor(actor_);
    vtkNew<vtkProperty> back;
    for (vtkProperty* side : {actor_->GetProperty(), back.GetPointer()}) side->SetLighting(false);
    actor_->GetProperty()->SetColor(0.0, 0.0, 1.0);
    back->SetColor(1.0, 0.0, 0.0);
    actor_->SetBackfaceProperty(back);
    actor_->SetMapper(mapper_);
  }
  void TearDown() override {
    if (window_) window_->Finalize();
    window_ = nullptr;
    screen_.reset();
  }

  // Faults within the outline of a ball that is smaller by the grooves' depth. From distance d it is a circle of angle
  // asin(r / d).
  Leaks look(const Vec3& from, double radius_mm) {
    vtkCamera* camera = renderer_->GetActiveCamera();
    const Vec3 eye = kDistance * radius_mm * from.normalized();
    camera->SetPosition(eye.x(), eye.y(), eye.z());
    camera->SetFocalPoint(0, 0, 0);
    const Vec3 up = std::abs(from.normalized().z()) > 0.9 ? Vec3::UnitX() : Vec3::UnitZ();
    camera->SetViewUp(up.x(), up.y(), up.z());
    camera->SetViewAngle(kViewAngle_deg);
    renderer_->ResetCameraClippingRange();
    window_->Render();
    vtkNew<vtkUnsignedCharArray> pixels;
    window_->GetPixelData(0, 0, kEdge_px - 1, kEdge_px - 1, 1, pixels);
    const double focal_px = 0.5 * kEdge_px / std::tan(kViewAngle_deg * std::numbers::pi / 360.0);
    const double radius_px =
        focal_px * std::tan(std::asin((radius_mm - kDeepest_mm) / (kDistance * radius_mm))) - kEroded_px;
    Leaks leaks;
    for (int y = 0; y < kEdge_px; ++y)
      for (int x = 0; x < kEdge_px; ++x) {
        const double middle = 0.5 * (kEdge_px - 1);
        if (std::hypot(x - middle, y - middle) > radius_px) continue;
        const auto at = [&](int i) { return pixels->GetValue(3 * (y * kEdge_px + x) + i); };
        leaks.inside += at(0) > 100 ? 1 : 0;
        leaks.background += at(1) > 100 ? 1 : 0;
        leaks.covered += at(2) > 100 ? 1 : 0;
      }
    return leaks;
  }
  Leaks look_from_all_sides(const GroovedBall& ball, bool seams) {
    mapper_->SetInputData(ball.surface(seams));
    Leaks all;
    for (const Vec3& from : {Vec3(0, 0, 1), Vec3(0.3, 0.2, 1), Vec3(-0.7, 0.4, 0.6), Vec3(1, 0.1, 0.5),
                             Vec3(0.1, -1, 0.2), Vec3(-0.2, 0.3, -1)}) {
      const Leaks leaks = look(from, ball.radius_mm);
      EXPECT_GT(leaks.covered, kEdge_px * kEdge_px / 4) << "the ball fills the picture";
      all.background += leaks.background;
      all.inside += leaks.inside;
      all.covered += leaks.covered;
    }
    return all;
  }

  std::optional<test::Xvfb> screen_;
  vtkSmartPointer<vtkRenderWindow> window_;
  vtkNew<vtkRenderer> renderer_;
  vtkNew<vtkActor> actor_;
  vtkNew<vtkPolyDataMapper> mapper_;
};

TEST_F(Silhouette, HasNoCracksWhereLevelsMeet) {
  const GroovedBall small(kSmall_mm);
  const Leaks grooves = look_from_all_sides(small, true);
  EXPECT_EQ(grooves.background, 0);
  EXPECT_EQ(grooves.inside, 0);
  EXPECT_EQ(small.levels(), (std::set<int>{0, 1, 2}));

  // Far blocks are coarser: five levels side by side, the coarse ones beyond the grooves.
  GroovedBall large(kLarge_mm);
  for (const Focus& focus : {Focus{{0, 0, kLarge_mm}, 10, 20}, Focus{{0, 0, kLarge_mm}, 12, 16}}) {
    large.focus(focus);
    const Leaks leaks = look_from_all_sides(large, true);
    EXPECT_EQ(leaks.background, 0);
    EXPECT_LE(leaks.inside, kSlivers_px);
    EXPECT_EQ(large.levels(), (std::set<int>{-2, -1, 0, 1, 2}));
  }
}

// Shows that this test finds cracks where there are some.
TEST_F(Silhouette, ShowsTheCracksThatSeamsClose) {
  const Leaks cut = look_from_all_sides(GroovedBall(kSmall_mm), false);
  GroovedBall large(kLarge_mm);
  large.focus({{0, 0, kLarge_mm}, 8, 24});
  const Leaks far = look_from_all_sides(large, false);
  RecordProperty("pixels_through_cracks_of_cuts", cut.inside + cut.background);
  RecordProperty("pixels_through_cracks_of_far_blocks", far.inside + far.background);
  EXPECT_GT(cut.inside + cut.background, 0);
  EXPECT_GT(far.inside + far.background, 20);
}

}  // namespace
}  // namespace osteon
