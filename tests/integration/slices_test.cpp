// Slices of the bone in the window, while a person drills with the mouse: the hole that the slices show, what they say,
// and how they are led.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDockWidget>
#include <QLabel>
#include <QLocale>
#include <QSettings>
#include <QSlider>
#include <QTest>
#include <QWheelEvent>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "common/radiology/attenuation.hpp"
#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/slices_panel.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

// The block's layers, by density = 0.131 + 0.001067 HU.
constexpr double kCortex_hu = (1.9 - 0.131) / 0.001067, kMarrow_hu = (0.3 - 0.131) / 0.001067;
constexpr double kPitch_mm = 0.5;
// The scan, the read-out and half a step of attenuation.
constexpr double kRounded_hu = 0.5 + 0.5 + 0.33;

class SlicesTest : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    // What is no window of HU, as in a damaged file.
    QSettings().remove("slices");
    QSettings().setValue("slices/level", "nan");
    QSettings().setValue("slices/width", "inf");
    WindowBench::SetUp();
    axes_ = window_->findChild<QComboBox*>("slices_axes");
    presets_ = window_->findChild<QComboBox*>("slices_window");
    follow_ = window_->findChild<QCheckBox*>("slices_follow");
    for (std::size_t i = 0; i < kSlices; ++i) slices_[i] = window_->findChild<SliceView*>(QString("slice_%1").arg(i));
    // It has no meta-object of its own to be found by.
    panel_ = static_cast<SlicesPanel*>(slices_[0]->parentWidget());
  }
  void TearDown() override {
    // The next window opens as this one was left.
    window_->findChild<QDockWidget*>("slices_panel")->hide();
    WindowBench::TearDown();
  }
  // All images show planes through the cross.
  [[nodiscard]] bool shown() const {
    for (const SliceView* slice : slices_)
      if (slice->image() == nullptr || std::abs(depth_mm(slice->image()->plane, panel_->point_mm())) > 1e-6)
        return false;
    return true;
  }
  [[nodiscard]] QPoint in_frame(const SliceView& slice, const Vec3& point_mm) const {
    const QPointF place = slice.place_of(point_mm);
    return slice.mapTo(window_.get(), QPoint(static_cast<int>(place.x()), static_cast<int>(place.y())));
  }
  void point_to(const SliceView& slice, const Vec3& point_mm) const {
    const QPoint at = in_frame(slice, point_mm);
    QTest::mouseMove(frame(), at + QPoint(1, 0));
    QTest::mouseMove(frame(), at);
  }
  // The number before "HU". None: nothing is under the pointer.
  [[nodiscard]] double hu_read() const {
    const QString text = label("slice_hu");
    bool ok = false;
    const double hu = QLocale().toDouble(text.section(' ', 0, 0), &ok);
    return ok && text.section(' ', 1, 1) == "HU" ? hu : std::nan("");
  }
  [[nodiscard]] double hu_at(const SliceView& slice, const Vec3& point_mm) const {
    point_to(slice, point_mm);
    return hu_read();
  }
  // A picture of the window, for who wants to look at it.
  void keep_picture(const char* name) const {
    if (const char* folder = std::getenv("OSTEON_TEST_PICTURES"))
      window_->grab().save(QString("%1/%2.png").arg(folder, name));
  }
  [[nodiscard]] Vec3 tip() const {
    const auto states = view_->updater()->states();
    return states.empty() ? Vec3(Vec3::Zero()) : states.front().pose_bone_tool.position_mm;
  }
  // What is dark about a point in a slice, as a disc: more than half of the cortex is gone there.
  struct Disc {
    Vec3 centre_mm = Vec3::Zero();
    double diameter_mm = 0.0, farthest_mm = 0.0;  // of the disc with the same area; from the centre
  };
  [[nodiscard]] static Disc dark_disc(const SliceView& slice, const Vec3& about_mm, double within_mm) {
    const radiology::PixelGrid& plane = slice.image()->plane;
    const double half = 0.5 * radiology::attenuation_per_mm(kCortex_hu);
    std::vector<Vec3> dark;
    for (int row = 0; row < plane.rows; ++row)
      for (int column = 0; column < plane.columns; ++column) {
        const Vec3 at = plane.at(column, row);
        const auto hu = static_cast<double>(slice.image()->hu[plane.index(column, row)]);
        if ((at - about_mm).norm() < within_mm && radiology::attenuation_per_mm(hu) < half) dark.push_back(at);
      }
    Disc disc;
    for (const Vec3& at : dark) disc.centre_mm += at / static_cast<double>(dark.size());
    for (const Vec3& at : dark) disc.farthest_mm = std::max(disc.farthest_mm, (at - disc.centre_mm).norm());
    const double area = static_cast<double>(dark.size()) * plane.column_mm.squaredNorm();
    disc.diameter_mm = 2.0 * std::sqrt(area / std::numbers::pi);
    return disc;
  }

  void drill_along_the_tool() {
    // Along the tool, the cross goes with the tip.
    axes_->setCurrentIndex(1);
    hold_drill();
    ASSERT_TRUE(push_until([&] { return cut() && tip().z() < -7.0; })) << problem();
    EXPECT_TRUE(push_until([&] { return (panel_->point_mm() - tip()).norm() < 0.5; })) << problem();
    EXPECT_TRUE(until([&] { return !slices_[0]->outline().empty(); })) << "the drill is drawn";
    keep_picture("slices_drilling");
    follow_->click();
    release(middle());
    ASSERT_TRUE(until([&] { return view_->updater()->states().front().phase != CuttingPhase::cutting; }));
  }
  void expect_windows(const SliceView& across) {
    // A drag of the right button is a window by hand.
    EXPECT_EQ(panel_->window(), kBoneWindow);
    const QPoint at = across.mapTo(window_.get(), across.rect().center());
    QTest::mousePress(frame(), Qt::RightButton, {}, at);
    QTest::mouseMove(frame(), at + QPoint(10, 20));
    QTest::mouseRelease(frame(), Qt::RightButton, {}, at + QPoint(10, 20));
    // 10 HU for each pixel: a two hundredth of 2000.
    EXPECT_EQ(panel_->window(), (HuWindow{700.0, 2100.0}));
    EXPECT_EQ(presets_->currentIndex(), 3);
    const radiology::PixelGrid& plane = across.image()->plane;
    for (const int column : {0, plane.columns / 2})
      EXPECT_EQ(qGray(across.grey().pixel(column, plane.rows / 2)),
                panel_->window().grey(static_cast<double>(across.image()->hu[plane.index(column, plane.rows / 2)])));
    presets_->setFocus();
    for (int i = 0; i < 2; ++i) QTest::keyClick(presets_, Qt::Key_Up);
    EXPECT_EQ(panel_->window(), kSoftTissueWindow);
  }

  void expect_middle_button_moves(const SliceView& axial) {
    // The middle button moves the image and leaves the cross.
    const double pixel_mm = axial.image()->plane.column_mm.norm();
    const Vec3 cross_mm = panel_->point_mm();
    const Vec3 corner_mm = axial.image()->plane.first_mm;
    const QPoint at = axial.mapTo(window_.get(), axial.rect().center());
    QTest::mousePress(frame(), Qt::MiddleButton, {}, at);
    QTest::mouseMove(frame(), at + QPoint(20, 0));
    QTest::mouseRelease(frame(), Qt::MiddleButton, {}, at + QPoint(20, 0));
    EXPECT_EQ(panel_->point_mm(), cross_mm);
    EXPECT_TRUE(until([&] {
      return std::abs(axial.image()->plane.first_mm.x() - (corner_mm.x() - 20.0 * pixel_mm)) < 1e-6;
    })) << "what was under the pointer is there still";
  }

  SlicesPanel* panel_ = nullptr;
  QComboBox *axes_ = nullptr, *presets_ = nullptr;
  QCheckBox* follow_ = nullptr;
  std::array<SliceView*, kSlices> slices_{};
};

// One session for all, because each window starts a server and two clients.
TEST_F(SlicesTest, ShowTheHoleThatThePersonDrills) {
  open();
  EXPECT_EQ(slices_[0]->image(), nullptr);
  trigger("slices");
  ASSERT_TRUE(until([&] { return shown(); })) << problem();

  // The cross is in the middle of the marrow. The upper layer is cortex.
  const Vec3 middle_mm = panel_->point_mm();
  EXPECT_NEAR(hu_at(*slices_[0], middle_mm), kMarrow_hu, kRounded_hu);
  EXPECT_NEAR(hu_at(*slices_[1], {middle_mm.x(), middle_mm.y(), -2.5}), kCortex_hu, kRounded_hu);
  keep_picture("slices_whole");

  drill_along_the_tool();
  if (HasFatalFailure()) return;

  // By keys back into the cortex, and nearer.
  SliceView& across = *slices_[2];
  across.setFocus();
  for (int i = 0; i < 60 && panel_->point_mm().z() < -2.7; ++i) QTest::keyClick(&across, Qt::Key_PageDown);
  EXPECT_NEAR(panel_->point_mm().z(), -2.5, 0.31) << "the last step went above -2.7 mm";
  for (int i = 0; i < 5; ++i) QTest::keyClick(&across, Qt::Key_Plus);
  ASSERT_TRUE(until([&] { return shown(); }));
  // Closed form: a drill of 3.2 mm leaves a disc of 3.2 mm. Half a pitch is the resolution.
  const Vec3 axis_mm = panel_->point_mm();
  Disc disc;
  EXPECT_TRUE(until([&] {
    disc = dark_disc(across, axis_mm, 5.0);
    return std::abs(disc.diameter_mm - 3.2) < 0.5 * kPitch_mm;
  })) << disc.diameter_mm;
  EXPECT_LT((disc.centre_mm - axis_mm).norm(), 0.5 * kPitch_mm) << "the planes go through the drill's axis";
  EXPECT_LT(disc.farthest_mm, 1.6 + kPitch_mm) << "it is round";
  EXPECT_EQ(hu_at(across, disc.centre_mm), -1000.0) << "air, where the bone is gone";
  EXPECT_NEAR(hu_at(across, disc.centre_mm + 3.0 * across.image()->plane.column_mm.normalized()), kCortex_hu,
              kRounded_hu);
  keep_picture("slices_across");

  expect_windows(across);

  // What is undone is in the slices again.
  trigger("put_down");
  undo_pushes();
  EXPECT_TRUE(until([&] { return std::abs(hu_at(across, disc.centre_mm) - kCortex_hu) < kRounded_hu; }))
      << hu_read() << " " << problem();

  // A room that is left takes its slices along. They come again in the next one.
  trigger("start_page");
  EXPECT_EQ(slices_[0]->image(), nullptr);
  open();
  EXPECT_TRUE(until([&] { return shown(); })) << problem();
}

// The cross, the slider, the wheel and the middle button.
TEST_F(SlicesTest, AreLedByMouseWheelAndSliderAndStayLinked) {
  open();
  trigger("slices");
  ASSERT_TRUE(until([&] { return shown(); })) << problem();
  const Vec3 before_mm = panel_->point_mm();
  SliceView &axial = *slices_[0], &coronal = *slices_[1];

  // A click in the axial image goes to another place of the same slice.
  const Vec3 wanted_mm = before_mm + Vec3(6, -4, 0);
  const double pixel_mm = axial.image()->plane.column_mm.norm();
  QTest::mouseClick(frame(), Qt::LeftButton, {}, in_frame(axial, wanted_mm));
  EXPECT_NEAR((panel_->point_mm() - wanted_mm).norm(), 0.0, pixel_mm);
  EXPECT_EQ(panel_->point_mm().z(), before_mm.z());
  ASSERT_TRUE(until([&] { return shown(); }));
  EXPECT_NEAR(coronal.image()->plane.first_mm.y(), panel_->point_mm().y(), 1e-9) << "the coronal plane went along";
  // In the coronal image, the cross is at the same point.
  EXPECT_NEAR((coronal.point_at(coronal.place_of(panel_->point_mm())) - panel_->point_mm()).norm(), 0.0, 1e-9);

  // A notch of the wheel is one pitch, into the image: away from who looks.
  const Vec3 clicked_mm = panel_->point_mm();
  QWheelEvent notch(axial.rect().center(), axial.mapToGlobal(axial.rect().center()), {}, {0, 120}, Qt::NoButton, {},
                    Qt::NoScrollPhase, false);
  QApplication::sendEvent(&axial, &notch);
  EXPECT_NEAR((panel_->point_mm() - clicked_mm - Vec3(0, 0, kPitch_mm)).norm(), 0.0, 1e-9)
      << "radiologists look from the feet";
  // The slider stands where the slice is, and moves it.
  auto* slider = window_->findChild<QSlider*>("slice_slider_0");
  const int place = slider->value();
  slider->setFocus();
  QTest::keyClick(slider, Qt::Key_Up);
  EXPECT_EQ(slider->value(), place + 1);
  EXPECT_NEAR(panel_->point_mm().z() - clicked_mm.z(), 2.0 * kPitch_mm, 0.5 * kPitch_mm + 1e-9);
  EXPECT_EQ(panel_->point_mm().x(), clicked_mm.x());

  // Nearer and farther: all three images have one scale.
  axial.setFocus();
  QTest::keyClick(&axial, Qt::Key_Plus);
  ASSERT_TRUE(until([&] { return axial.image()->plane.column_mm.norm() < 0.9 * pixel_mm && shown(); }));
  for (const SliceView* slice : slices_) EXPECT_NEAR(slice->image()->plane.column_mm.norm(), 0.85 * pixel_mm, 1e-9);

  expect_middle_button_moves(axial);

  // The window may have any size, and the whole bone comes back.
  window_->resize(1000, 700);
  QTest::mouseClick(window_->findChild<QWidget*>("slices_whole"), Qt::LeftButton);
  EXPECT_TRUE(until([&] {
    return shown() && axial.grey().width() == axial.size_px().columns && axial.grey().height() == axial.size_px().rows;
  }));
  EXPECT_NEAR((panel_->point_mm() - before_mm).norm(), 0.0, 1e-9);
  const ImageSize size = axial.size_px();
  EXPECT_GE(size.columns * axial.image()->plane.column_mm.norm(), 40.0) << "the block is 40 mm wide";
  EXPECT_GE(size.rows * axial.image()->plane.row_mm.norm(), 40.0);
  keep_picture("slices_small");

  // Beyond the bone is no way.
  for (int i = 0; i < 5; ++i) {
    QWheelEvent far(axial.rect().center(), axial.mapToGlobal(axial.rect().center()), {}, {0, 120 * 1000}, Qt::NoButton,
                    {}, Qt::NoScrollPhase, false);
    QApplication::sendEvent(&axial, &far);
  }
  EXPECT_LT(panel_->point_mm().z(), 30.0);
}

// What a server without a word shows: the slices as they were, and why.
TEST_F(SlicesTest, SayThatTheConnectionIsLost) {
  open();
  trigger("slices");
  ASSERT_TRUE(until([&] { return shown(); })) << problem();
  // Slices that nobody sees do not follow the bone, so they are new when somebody looks again.
  trigger("slices");
  EXPECT_EQ(slices_[0]->image(), nullptr);
  trigger("slices");
  ASSERT_TRUE(until([&] { return shown(); })) << problem();
  const auto servers = test::children("osteon-server");
  ASSERT_EQ(servers.size(), 1u);
  ::kill(servers.front(), SIGKILL);
  EXPECT_TRUE(until([&] { return label("slices_status").startsWith("Connection lost"); })) << problem();
  EXPECT_TRUE(shown());
  // The window starts the server again, with the session as it was.
  EXPECT_TRUE(until([&] { return label("slices_status").isEmpty(); })) << problem();
}

// A slice without a window round it.
class SlicesTestAlone : public test::WindowBench {
 protected:
  void SetUp() override { ASSERT_TRUE(desk_->stands()) << "Xvfb, of Debian's package xvfb, did not start"; }
  struct Columns {
    int first = 1 << 20, last = -1;
  };
  // Of the words of an axis from the right to a target in this column.
  [[nodiscard]] static Columns columns_of_words(std::int32_t target) {
    constexpr std::int32_t kRow = 110, kStepsOfPixel = 1024;  // a pixel is 1 mm
    SliceView::Events events;
    events.resized = [] {};
    SliceView view(events);
    view.resize(260, 220);
    SliceImage image;
    image.plane.columns = view.width(), image.plane.rows = view.height();
    image.hu.assign(image.plane.count(), 0.0F);
    view.show_image(std::make_shared<const SliceImage>(std::move(image)), kBoneWindow);
    Annotation axis;
    axis.id = 1;
    axis.kind = AnnotationKind::axis;
    axis.points = {{240 * kStepsOfPixel, kRow * kStepsOfPixel, 0}, {target * kStepsOfPixel, kRow * kStepsOfPixel, 0}};
    axis.words = "Nail 10";
    axis.colour = 0x00ff00;
    SliceOverlay overlay;
    overlay.drawn = {axis};
    view.show_overlay(overlay);
    const QImage seen = view.grab().toImage();
    Columns columns;
    // Above the line and the bar across its end.
    for (int y = kRow - 18; y < kRow - 8; ++y)
      for (int x = 0; x < seen.width(); ++x) {
        const QColor colour(seen.pixel(x, y));
        if (colour.green() < std::max(colour.red(), colour.blue()) + 80) continue;
        columns.first = std::min(columns.first, x), columns.last = std::max(columns.last, x);
      }
    return columns;
  }
};

TEST_F(SlicesTestAlone, WordsOfAnAxisAreWholeAtTheEdge) {
  const Columns free = columns_of_words(150), at_edge = columns_of_words(12);
  ASSERT_GT(free.last, free.first);
  EXPECT_LT(free.last, 150) << "they cover the axis";
  EXPECT_GT(at_edge.first, 12);
  EXPECT_NEAR(at_edge.last - at_edge.first, free.last - free.first, 2);
}

}  // namespace
}  // namespace osteon
