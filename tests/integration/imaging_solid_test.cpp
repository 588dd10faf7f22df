// The three-dimensional picture of image processing, with the mouse and the keyboard: it shows what is kept, follows
// the edits, moves the crosshair, and shows soft tissue.
#include <gtest/gtest.h>

#include <QCheckBox>
#include <QColor>
#include <QComboBox>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QScrollArea>
#include <QSlider>
#include <QSpinBox>
#include <QTest>
#include <QToolButton>
#include <QWheelEvent>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tests/integration/imaging_bench.hpp"
#include "viewer_client/desktop/imaging_solid.hpp"

namespace osteon {
namespace {

using test::two_balls;

class ImagingSolidTest : public test::ImagingBench {
 protected:
  void SetUp() override {
    ImagingBench::SetUp();
    open_two_balls();
  }
  [[nodiscard]] ImagingSolid& solid() const {
    auto* found = dynamic_cast<ImagingSolid*>(window_->findChild<QWidget*>("solid"));
    EXPECT_NE(found, nullptr);
    return *found;
  }
  [[nodiscard]] SolidView& view() const { return solid().view(); }
  void keep(int side) {
    ImagingPlane& axial = plane("plane_axial");
    double_click(axial, axial.pixel(ball(side)));
  }
  [[nodiscard]] static Vec3 middle_of(int side) { return Vec3(side * test::kApart_mm, 0, 0); }
  // Where a point is in the picture.
  [[nodiscard]] QPoint pixel(const Vec3& point_mm) const {
    const CameraView from = view().camera();
    const Vec3 ahead = (from.target_mm - from.eye_mm).normalized(), right = ahead.cross(from.up).normalized();
    const Vec3 seen = point_mm - from.eye_mm;
    const double px = 0.5 * view().height() / std::tan(0.5 * from.view_angle_rad) / seen.dot(ahead);
    return {static_cast<int>(0.5 * view().width() + px * seen.dot(right)),
            static_cast<int>(0.5 * view().height() - px * seen.dot(right.cross(ahead)))};
  }
  // The part of the pixels about a point that have a colour. The crosshair takes some.
  template <class Has>
  [[nodiscard]] double share(const Vec3& point_mm, Has has) const {
    constexpr int kAbout_px = 8;
    const QPoint at = pixel(point_mm);
    const Image image = view().scene().image();
    int count = 0, all = 0;
    for (int y = at.y() - kAbout_px; y <= at.y() + kAbout_px; ++y)
      for (int x = at.x() - kAbout_px; x <= at.x() + kAbout_px; ++x, ++all)
        if (x >= 0 && y >= 0 && x < image.width_px && y < image.height_px && has(image.at(x, y))) ++count;
    return static_cast<double>(count) / all;
  }
  // Of a ball's tint on the axial plane, beside its seed. A grey voxel changes no hue.
  [[nodiscard]] int plane_hue(int side) const {
    ImagingPlane& axial = plane("plane_axial");
    const auto [x, y, z] = ball(side);
    return QColor(axial.grab().toImage().pixel(axial.pixel({x + 4, y + 3, z}))).hsvHue();
  }
  // A surface of this hue, in light or in shadow. The background has none.
  [[nodiscard]] bool shows_hue(const Vec3& point_mm, int hue) const {
    const auto near = [&](const auto& c) {
      const QColor seen(c[0], c[1], c[2]);
      const int apart = std::abs(seen.hsvHue() - hue);
      return seen.value() > 70 && std::min(apart, 360 - apart) <= 12;
    };
    return share(point_mm, near) > 0.6;
  }
  // Up and aside, away from the seed and the crosshair.
  [[nodiscard]] static Vec3 beside(const Vec3& point_mm) { return point_mm + Vec3(3.5, 0, 3.5); }
  [[nodiscard]] bool shows_bone(int side) const { return shows_hue(beside(middle_of(side)), plane_hue(side)); }
  [[nodiscard]] bool shows_bone_between() const {
    return shows_hue(middle_of(0), plane_hue(1)) || shows_hue(middle_of(0), plane_hue(-1));
  }
  [[nodiscard]] bool shows_muscle(const Vec3& point_mm) const {
    return share(point_mm, [](const auto& c) { return c[0] > c[1] + 15 && c[0] > c[2] + 15; }) > 0.6;
  }
  [[nodiscard]] bool shows(bool left, bool right) const {
    return view().frames() > 0 && view().isVisible() && solid().current() && shows_bone(1) == left &&
           shows_bone(-1) == right;
  }
  void drag(const QPoint& by) const {
    const QPoint begin = view().rect().center();
    QTest::mousePress(&view(), Qt::LeftButton, {}, begin);
    for (int step = 1; step <= 4; ++step) {
      QMouseEvent move(QEvent::MouseMove, begin + by * step / 4, Qt::NoButton, Qt::LeftButton, {});
      QApplication::sendEvent(&view(), &move);
    }
    QTest::mouseRelease(&view(), Qt::LeftButton, {}, begin + by);
  }
  [[nodiscard]] Vec3 crosshair_mm() const {
    const imaging::HuVolume scan = two_balls();
    return scan.position_mm(
        Vec3(plane("plane_sagittal").slice(), plane("plane_coronal").slice(), plane("plane_axial").slice()));
  }
  // Where the line of sight through a pixel meets a ball first.
  [[nodiscard]] Vec3 on_ball(int side, const QPoint& at) const {
    const SightRay ray = ray_through(view().camera(), view().width(), view().height(), at.x(), at.y());
    const Vec3 to = middle_of(side) - ray.from_mm;
    const double along = to.dot(ray.direction);
    const double beside2 = to.squaredNorm() - along * along;
    EXPECT_LT(beside2, test::kBall_mm * test::kBall_mm);
    return ray.from_mm + (along - std::sqrt(test::kBall_mm * test::kBall_mm - beside2)) * ray.direction;
  }
  // A picture of the window, for who wants to look at it.
  void keep_picture(const char* name) const {
    if (const char* folder = std::getenv("OSTEON_TEST_PICTURES"))
      window_->grab().save(QString("%1/%2.png").arg(folder, name));
  }
};

// A voxel of 0.9 x 0.9 x 1.5 mm, and half of one to its middle.
constexpr double kNear_mm = 2.2;

TEST_F(ImagingSolidTest, WhatIsKeptIsSeenAndChoosesTheCrosshair) {
  EXPECT_TRUE(part<QLabel>("solid_hint").isVisible());
  EXPECT_FALSE(view().isVisible()) << "an empty picture is drawn";
  keep(1);
  keep(-1);
  ASSERT_TRUE(until([&] { return shows(true, true); })) << words();
  keep_picture("solid_both");
  EXPECT_FALSE(shows_bone_between());

  // Space takes the tick of the part away.
  islands().setFocus();
  islands().setCurrentRow(0);
  QTest::keyClick(&islands(), Qt::Key_Space);
  ASSERT_TRUE(until([&] { return shows(true, false) || shows(false, true); })) << words();
  QTest::keySequence(window_.get(), QKeySequence::Undo);
  ASSERT_TRUE(until([&] { return shows(true, true); })) << words();
  QTest::keySequence(window_.get(), QKeySequence::Undo);
  ASSERT_TRUE(until([&] { return shows(true, false); })) << words();

  // The left ball alone fills the picture.
  EXPECT_GT((crosshair_mm() - middle_of(1)).norm(), 20.0);
  const QPoint at = pixel(middle_of(1)) + QPoint(6, -4);
  const Vec3 met_mm = on_ball(1, at);
  double_click(view(), at);
  EXPECT_LT((crosshair_mm() - met_mm).norm(), kNear_mm);
  const CameraView before = view().camera();
  drag({80, 30});
  const CameraView after = view().camera();
  EXPECT_LT((after.target_mm - before.target_mm).norm(), 1e-6);
  EXPECT_GT((after.eye_mm - before.eye_mm).norm(), 10.0);
  QWheelEvent wheel(QPointF(view().rect().center()), view().mapToGlobal(view().rect().center()), {}, {0, 120},
                    Qt::NoButton, {}, Qt::NoScrollPhase, false);
  QApplication::sendEvent(&view(), &wheel);
  EXPECT_LT((view().camera().eye_mm - before.target_mm).norm(), (after.eye_mm - after.target_mm).norm());
  // Enter picks before the next picture, too.
  const Vec3 ahead_mm = on_ball(1, view().rect().center());
  EXPECT_GT((ahead_mm - met_mm).norm(), 2.0 * kNear_mm) << "the view has hardly turned";
  QTest::keyClick(&view(), Qt::Key_Return);
  EXPECT_LT((crosshair_mm() - ahead_mm).norm(), kNear_mm);
  QTest::qWait(200);
  keep_picture("solid_turned");

  // Without any bone there is no picture.
  QTest::keySequence(window_.get(), QKeySequence::Undo);
  EXPECT_TRUE(until([&] { return !view().isVisible() && part<QLabel>("solid_hint").isVisible(); }));
}

TEST_F(ImagingSolidTest, SoftTissueIsCoarseWhileTheViewMoves) {
  keep(1);
  ASSERT_TRUE(until([&] { return shows(true, false); })) << words();
  const Vec3 beside_mm = middle_of(1) + Vec3(0, 0, 11);  // muscle above the ball
  EXPECT_FALSE(shows_muscle(beside_mm));
  EXPECT_FALSE(part<QCheckBox>("soft_tissue").isChecked());
  QTest::keySequence(window_.get(), QKeySequence("Ctrl+Alt+V"));
  ASSERT_TRUE(until([&] { return shows_muscle(beside_mm); })) << words();
  EXPECT_EQ(view().coarse_frames(), 0u);
  keep_picture("solid_soft");
  drag({30, 0});
  ASSERT_TRUE(until([&] { return view().coarse_frames() > 0; }));
  const std::uint64_t fine = view().frames() - view().coarse_frames();
  ASSERT_TRUE(until([&] { return view().frames() - view().coarse_frames() > fine; })) << "it stays coarse at rest";
  EXPECT_TRUE(shows_muscle(beside_mm));
  QTest::mouseClick(&part<QCheckBox>("soft_tissue"), Qt::LeftButton, {}, QPoint(8, 8));
  EXPECT_TRUE(until([&] { return !shows_muscle(beside_mm) && shows(true, false); }));

  // On a usual screen the button that makes the bone is seen without scrolling, and on a small one each part has the
  // room that it needs.
  window_->resize(1280, 800);
  const QWidget* page = view().parentWidget();
  while (page != nullptr && qobject_cast<const QScrollArea*>(page) == nullptr) page = page->parentWidget();
  ASSERT_NE(page, nullptr);
  const auto* scrolled = static_cast<const QScrollArea*>(page);
  EXPECT_TRUE(until([&] {
    return window_->height() == 800 && scrolled->widget()->height() == scrolled->viewport()->height();
  })) << "the page is "
      << scrolled->widget()->height() << " pixels high, and has " << scrolled->viewport()->height();
  keep_picture("solid_usual");
  window_->resize(1024, 768);
  EXPECT_TRUE(until([&] {
    return scrolled->viewport()->width() < 1024 && scrolled->widget()->width() == scrolled->viewport()->width();
  })) << "the page is "
      << scrolled->widget()->width() << " pixels wide, and has " << scrolled->viewport()->width();
  EXPECT_GE(view().width(), view().minimumSizeHint().width());
  EXPECT_GE(view().height(), view().minimumSizeHint().height());
  keep_picture("solid_small");
}

TEST_F(ImagingSolidTest, ABoneHasTheTintOfThePlanesAndChoosesItsRow) {
  keep(1);
  keep(-1);
  ASSERT_TRUE(until([&] { return shows(true, true); })) << words();
  EXPECT_GT(std::abs(plane_hue(1) - plane_hue(-1)), 30);
  // The row whose square has the colour of the ball that was clicked.
  const auto row_hue = [&] {
    const QListWidgetItem* row = islands().currentItem();
    return row == nullptr ? -1 : QColor(row->icon().pixmap(12, 12).toImage().pixel(6, 6)).hsvHue();
  };
  for (const int side : {1, -1, 1}) {
    const Vec3 crosshair = crosshair_mm();
    QTest::mouseClick(&view(), Qt::LeftButton, {}, pixel(beside(middle_of(side))));
    EXPECT_NEAR(row_hue(), plane_hue(side), 5) << words();
    EXPECT_EQ(crosshair_mm(), crosshair) << "a click moves it";
  }
  QTest::mouseClick(&view(), Qt::LeftButton, {}, QPoint(3, 3));
  EXPECT_NEAR(row_hue(), plane_hue(1), 5) << "there is no bone";

  // A click on a surface that is older than the edits chooses nothing, and the words stay.
  const int row = islands().currentRow();
  islands().item(row)->setCheckState(Qt::Unchecked);
  EXPECT_FALSE(solid().current());
  const std::string said = words();
  QTest::mouseClick(&view(), Qt::LeftButton, {}, pixel(beside(middle_of(1))));
  EXPECT_EQ(islands().currentRow(), row);
  EXPECT_EQ(words(), said);
  QTest::keySequence(window_.get(), QKeySequence::Undo);
  ASSERT_TRUE(until([&] { return shows(true, true); })) << words();

  // The bone of the ball on the patient's left fades in both pictures, and who does not see it cannot click it.
  auto& choice = part<QComboBox>("bone_choice");
  choice.setCurrentIndex(1);
  const auto lightness = [&] {
    const QPoint at = pixel(beside(middle_of(1)));
    const auto c = view().scene().image().at(at.x(), at.y());
    return c[0] + c[1] + c[2];
  };
  const int opaque = lightness(), right_hue = plane_hue(-1);
  part<QSpinBox>("bone_opacity").setValue(50);
  ASSERT_TRUE(until([&] { return lightness() < opaque - 30; })) << opaque;
  const int half = lightness();
  keep_picture("solid_faded");
  part<QSpinBox>("bone_opacity").setValue(0);
  ASSERT_TRUE(until([&] { return lightness() < half - 30; })) << half;
  EXPECT_TRUE(shows_hue(beside(middle_of(-1)), right_hue));
  islands().setCurrentRow(-1);
  QTest::mouseClick(&view(), Qt::LeftButton, {}, pixel(beside(middle_of(1))));
  EXPECT_EQ(islands().currentItem(), nullptr);
}

// The shape of each mark, as the part of the rectangle round it that it fills: a ball fills pi / 4, a triangle the
// half, and thin bars that cross leave half of it free at least.
TEST_F(ImagingSolidTest, MarksDifferInTheirShapes) {
  keep(1);
  ImagingPlane& axial = plane("plane_axial");
  const auto click = [&](const char* tool, const std::array<int, 3>& voxel) {
    QTest::mouseClick(&part<QToolButton>(tool), Qt::LeftButton);
    QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel(voxel));
  };
  const std::array<int, 3> seed = ball(1), outside{seed[0] + 5, seed[1], seed[2]}, painted{29, 29, seed[2]};
  click("tool_outside", outside);
  // On the plane, the red pixels of a triangle: a point above, and a side below.
  const QImage slice = axial.grab().toImage();
  const QPoint middle = axial.pixel(outside);
  std::vector<int> red_rows;
  for (int y = middle.y() - 10; y <= middle.y() + 10; ++y) {
    int red = 0;
    for (int x = middle.x() - 10; x <= middle.x() + 10; ++x)
      red += slice.valid(x, y) && QColor(slice.pixel(x, y)) == QColor(255, 60, 60) ? 1 : 0;
    if (red > 0) red_rows.push_back(red);
  }
  ASSERT_GE(red_rows.size(), 7u);
  EXPECT_LE(red_rows.front(), 3);
  EXPECT_GE(red_rows.back(), 7);
  click("tool_paint", painted);
  part<QSlider>("slice_axial").setValue(3);  // the crosshair leaves the marks
  part<QSlider>("slice_sagittal").setValue(3);
  struct Seen {
    int pixels = 0, left = 1 << 20, right = -1, top = 1 << 20, bottom = -1;
    [[nodiscard]] double fill() const {
      return pixels == 0 ? 0.0 : static_cast<double>(pixels) / ((right - left + 1) * (bottom - top + 1));
    }
  };
  const auto seen_at = [&](const std::array<int, 3>& voxel, bool red) {
    constexpr int kAbout_px = 16;
    const Image image = view().scene().image();
    const QPoint at = pixel(two_balls().position_mm(Vec3(voxel[0], voxel[1], voxel[2])));
    Seen seen;
    for (int y = std::max(0, at.y() - kAbout_px); y <= std::min(image.height_px - 1, at.y() + kAbout_px); ++y)
      for (int x = std::max(0, at.x() - kAbout_px); x <= std::min(image.width_px - 1, at.x() + kAbout_px); ++x) {
        const auto c = image.at(x, y);
        const bool is_red = c[0] > 110 && c[1] < 0.36 * c[0] && c[2] < 0.36 * c[0];
        const bool is_yellow = c[0] > 110 && c[1] > 0.75 * c[0] && c[2] < 0.62 * c[0];
        if (red ? !is_red : !is_yellow) continue;
        ++seen.pixels;
        seen.left = std::min(seen.left, x), seen.right = std::max(seen.right, x);
        seen.top = std::min(seen.top, y), seen.bottom = std::max(seen.bottom, y);
      }
    return seen;
  };
  ASSERT_TRUE(until([&] {
    return solid().current() && seen_at(seed, false).pixels > 20 && seen_at(outside, true).pixels > 20 &&
           seen_at(painted, false).pixels > 8;
  })) << seen_at(seed, false).pixels
      << " " << seen_at(outside, true).pixels << " " << seen_at(painted, false).pixels;
  keep_picture("solid_marks");
  EXPECT_NEAR(seen_at(seed, false).fill(), 0.785, 0.1);
  EXPECT_NEAR(seen_at(outside, true).fill(), 0.5, 0.12);
  EXPECT_LT(seen_at(painted, false).fill(), 0.55);
  // Undo takes the mark away.
  QTest::keySequence(window_.get(), QKeySequence::Undo);
  EXPECT_TRUE(until([&] { return seen_at(painted, false).pixels == 0; }));
  EXPECT_GT(seen_at(outside, true).pixels, 20);
}

// The picture without a window round it: what the page does between two events cannot be timed there.
class ImagingSolidTestAlone : public test::WindowBench {
 protected:
  // Two boxes of bone, of which the first one goes through all rows. The last row is at the patient's front, and is
  // the only one of its block.
  void SetUp() override {
    ASSERT_TRUE(desk_->stands()) << "Xvfb, of Debian's package xvfb, did not start";
    ScanGeometry geometry;
    geometry.dims = {200, 21, 41};
    geometry.axes_mm = Vec3(1, -1, 1).asDiagonal();
    scene_.scan = {geometry, std::vector<std::int16_t>(geometry.count(), test::kMuscle_hu)};
    VoxelFile<std::uint8_t> numbers{geometry, std::vector<std::uint8_t>(geometry.count())};
    for (int k = 6; k <= 34; ++k)
      for (int j = 0; j < 21; ++j)
        for (int i = 60; i <= 140; ++i) numbers.values[numbers.index({i, j, k})] = 1;
    for (int k = 6; k <= 34; ++k)
      for (int i = 160; i <= 180; ++i) numbers.values[numbers.index({i, 10, k})] = 2;
    scene_.islands = *IslandMap::make(geometry, std::move(numbers));
    scene_.look.kept[1].set(1);
    set_tints(scene_.look, {});
    solid_ = std::make_unique<ImagingSolid>(
        scene_, ImagingSolid::Events{[this](const std::array<int, 3>& voxel) { chosen_ = voxel; },
                                     [](int, const std::array<int, 3>&) {}});
    solid_->resize(400, 340);
    solid_->show();
    solid_->begin();
    ASSERT_TRUE(until([&] { return solid_->current() && solid_->view().frames() > 0; }));
  }

  ImagingScene scene_;
  std::optional<std::array<int, 3>> chosen_;
  std::unique_ptr<ImagingSolid> solid_;
};

TEST_F(ImagingSolidTestAlone, ACutEndOfABoneChoosesItsLastVoxel) {
  QTest::keyClick(&solid_->view(), Qt::Key_Return);
  ASSERT_TRUE(chosen_);
  EXPECT_EQ((*chosen_)[1], 20);
}

// A colour over another one is a * front + (1 - a) * back, whichever was added first.
TEST_F(ImagingSolidTestAlone, TheNearerOfTwoTranslucentBonesCoversTheOther) {
  using Colour = std::array<std::uint8_t, 3>;
  constexpr double kOpacity = 0.6;
  // Across the line of sight from the patient's front, which is -y.
  const auto sheet = [](float y) {
    constexpr float kFar = 200;
    Mesh mesh;
    mesh.positions_mm = {{-kFar, y, -kFar}, {kFar, y, -kFar}, {kFar, y, kFar}, {-kFar, y, kFar}};
    mesh.normals.assign(4, {0, -1, 0});
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
  };
  SolidScene& scene = solid_->view().scene();
  const auto seen = [&](std::vector<std::pair<int, float>> sheets) {
    scene.bones().clear();
    for (const auto& [bone, y] : sheets) scene.bones().show(bone, sheet(y));
    scene.bones().set_paint(1, {220, 40, 40}, kOpacity);
    scene.bones().set_paint(2, {40, 60, 220}, kOpacity);
    solid_->view().makeCurrent();
    scene.draw(false);
    const Image image = scene.image();
    return image.at(image.width_px / 2 + 37, image.height_px / 2 - 43);  // beside the crosshair
  };
  constexpr float kNear = -15, kFarther = -5;
  const Colour nothing = seen({});
  for (const auto& [near, far] : {std::pair(1, 2), std::pair(2, 1)}) {
    const Colour near_alone = seen({{near, kNear}}), far_alone = seen({{far, kFarther}});
    ASSERT_NE(near_alone, nothing);
    for (const Colour& both : {seen({{near, kNear}, {far, kFarther}}), seen({{far, kFarther}, {near, kNear}})})
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(both[c], near_alone[c] + (1.0 - kOpacity) * (far_alone[c] - nothing[c]), 4.0)
            << near << " before " << far << ", channel " << c;
  }
}

TEST_F(ImagingSolidTestAlone, AnEditBeforeAnotherThresholdIsNotLost) {
  scene_.look.kept[2].set(1);
  solid_->refresh();
  scene_.look.threshold_hu = 500.0;
  solid_->refresh();
  QTest::qWait(400);  // longer than the pause after an edit
  EXPECT_FALSE(solid_->current());
  scene_.look.threshold_hu.reset();
  solid_->refresh();
  EXPECT_TRUE(until([&] { return solid_->current(); }));
}

TEST_F(ImagingSolidTestAlone, SoftTissueComesAfterAnotherFilter) {
  scene_.look.threshold_hu = 500.0;
  solid_->refresh();
  solid_->findChild<QCheckBox*>("soft_tissue")->setChecked(true);
  solid_->release();
  EXPECT_FALSE(solid_->view().scene().has_soft_tissue());
  solid_->refresh();
  EXPECT_TRUE(until([&] { return solid_->view().scene().has_soft_tissue(); }));
}

}  // namespace
}  // namespace osteon
