// Planning in the window with the mouse: what is drawn on the slices and on the bone is seen, measured, moved, taken
// back and kept, and a simulated surgeon drills it.
#include <gtest/gtest.h>

#include <QAction>
#include <QComboBox>
#include <QDockWidget>
#include <QLabel>
#include <QLocale>
#include <QSettings>
#include <QStatusBar>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "common/radiology/attenuation.hpp"
#include "tests/integration/window_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "viewer_client/desktop/library.hpp"
#include "viewer_client/desktop/plan_bar.hpp"
#include "viewer_client/desktop/slices_panel.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

// The block's cortical layers, z from 0 to -5 and from -25 to -30, by density = 0.131 + 0.001067 HU.
constexpr double kCortex_hu = (1.9 - 0.131) / 0.001067, kAir_hu = -1000.0;
constexpr double kDegree = std::numbers::pi / 180.0;

class PlanTest : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    QSettings().remove("slices");
    WindowBench::SetUp();
    for (std::size_t i = 0; i < kSlices; ++i) slices_[i] = window_->findChild<SliceView*>(QString("slice_%1").arg(i));
    // They have no meta-object of their own to be found by.
    panel_ = static_cast<SlicesPanel*>(slices_[0]->parentWidget());
    bar_ = static_cast<PlanBar*>(window_->findChild<QComboBox*>("plan_choice")->parentWidget());
  }
  void TearDown() override {
    window_->findChild<QDockWidget*>("slices_panel")->hide();
    WindowBench::TearDown();
  }
  void open_slices() {
    open();
    trigger("slices");
    ASSERT_TRUE(until([&] { return shown(); })) << problem();
  }
  [[nodiscard]] bool shown() const {
    return std::ranges::all_of(slices_, [&](const SliceView* slice) {
      return slice->image() != nullptr && std::abs(depth_mm(slice->image()->plane, panel_->point_mm())) < 1e-6;
    });
  }
  [[nodiscard]] static QPoint pixel(const SliceView& slice, const Vec3& point_mm) {
    const QPointF place = slice.place_of(point_mm);
    return {static_cast<int>(place.x()), static_cast<int>(place.y())};
  }
  void click(const SliceView& slice, const Vec3& point_mm) {
    QTest::mouseClick(frame(), Qt::LeftButton, {}, slice.mapTo(window_.get(), pixel(slice, point_mm)));
  }
  void drag(const SliceView& slice, const Vec3& from_mm, const Vec3& to_mm) {
    const QPoint from = slice.mapTo(window_.get(), pixel(slice, from_mm)),
                 to = slice.mapTo(window_.get(), pixel(slice, to_mm));
    QTest::mousePress(frame(), Qt::LeftButton, {}, from);
    QTest::mouseMove(frame(), (from + to) / 2);
    QTest::mouseMove(frame(), to);
    QTest::mouseRelease(frame(), Qt::LeftButton, {}, to);
  }
  // Draws an axis in the coronal image through the middle of the bone.
  void draw_axis(const Vec3& entry_mm, const Vec3& target_mm) {
    trigger("draw_axis");
    click(*slices_[1], entry_mm);
    ASSERT_TRUE(until([&] { return shown(); }));
    click(*slices_[1], target_mm);
    ASSERT_TRUE(until([&] { return in_room(1) && shown(); })) << problem();
  }
  // The room has answered.
  [[nodiscard]] bool settled() const { return !bar_->plan().waits(); }
  [[nodiscard]] std::vector<Annotation> planned() const { return bar_->plan().planned(); }
  // The room has numbered so many of them.
  [[nodiscard]] bool in_room(std::size_t count) const {
    const auto all = planned();
    return all.size() == count && std::ranges::all_of(all, [](const Annotation& one) { return one.id != 0; });
  }
  // The window's user and everybody else sees what the room has.
  [[nodiscard]] int blue_pixels() const {
    const Image image = view_->scene().image();
    return static_cast<int>(
        std::ranges::count_if(image.rgb, [](const auto& c) { return c[2] > c[0] + 60 && c[1] > c[0] + 30; }));
  }
  [[nodiscard]] double gauge(const char* name) const {
    bool ok = false;
    const double value = QLocale().toDouble(label(name).remove("°").section(' ', 0, 0), &ok);
    return ok ? value : std::nan("");
  }
  [[nodiscard]] double hu_at(const SliceView& slice, const Vec3& point_mm) const {
    return slice.hu_at(point_mm).value_or(std::nan(""));
  }
  // The middle of what is gone of the cortex in the axial slice at this height, near a point.
  [[nodiscard]] std::optional<Vec3> hole_at(double z_mm, const Vec3& near_mm) {
    panel_->look_at({near_mm.x(), near_mm.y(), z_mm});
    if (!until([&] { return shown(); })) return {};
    const radiology::PixelGrid& plane = slices_[0]->image()->plane;
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (int row = 0; row < plane.rows; ++row)
      for (int column = 0; column < plane.columns; ++column) {
        const Vec3 at = plane.at(column, row);
        const auto hu = static_cast<double>(slices_[0]->image()->hu[plane.index(column, row)]);
        if ((at - near_mm).head<2>().norm() > 5.0 ||
            radiology::attenuation_per_mm(hu) > 0.5 * radiology::attenuation_per_mm(kCortex_hu))
          continue;
        sum += at;
        ++count;
      }
    if (count == 0) return {};
    return Vec3(sum / count);
  }
  // A picture of the window, for who wants to look at it.
  void keep_picture(const char* name) const {
    if (const char* folder = std::getenv("OSTEON_TEST_PICTURES"))
      window_->grab().save(QString("%1/%2.png").arg(folder, name));
  }
  // The newest session, which is the one under way.
  [[nodiscard]] static std::filesystem::path session() {
    std::filesystem::path newest;
    for (const auto& folder : std::filesystem::directory_iterator(data_folder() / "sessions"))
      newest = std::max(newest, folder.path());
    return newest;
  }
  // Runs the simulated surgeon in the window's room, while the window lives on. Its exit code.
  [[nodiscard]] int drill_plan(const std::filesystem::path& file) {
    const QString address = label("connection").section(' ', -1);
    test::Process surgeon(test::program("osteon-haptic"),
                          {"--server", address.toStdString(), "--plain", "--name", "surgeon", "--device", "simulated",
                           "--plan", file.string(), "--cache", (desk_->temp() / "cache").string()});
    std::optional<int> code;
    EXPECT_TRUE(until([&] { return (code = surgeon.wait(10ms)).has_value(); }, 180s));
    EXPECT_EQ(code, 0) << surgeon.err();
    return code.value_or(-1);
  }

  SlicesPanel* panel_ = nullptr;
  PlanBar* bar_ = nullptr;
  std::array<SliceView*, kSlices> slices_{};
};

TEST_F(PlanTest, AnAxisOnTheSlicesIsSeenMeasuredMovedTakenBackAndKept) {
  open_slices();
  if (HasFatalFailure()) return;
  const int blue_before = blue_pixels();
  EXPECT_EQ(label("plan_angle"), "–");
  const double pixel_mm = slices_[1]->image()->plane.column_mm.norm();
  const Vec3 entry(-4, panel_->point_mm().y(), 0), target(6, entry.y(), -20), moved(9, entry.y(), -14);
  draw_axis(entry, target);
  if (HasFatalFailure()) return;
  const Annotation drawn = planned()[0];
  EXPECT_NEAR((from_steps(drawn.points[0]) - entry).norm(), 0.0, pixel_mm);
  EXPECT_NEAR((from_steps(drawn.points[1]) - target).norm(), 0.0, pixel_mm);
  EXPECT_EQ(drawn.words, "Axis 1");

  // It is seen: on the bone, and on the image, half way between its ends.
  EXPECT_TRUE(until([&] { return blue_pixels() > blue_before + 60; })) << blue_pixels();
  const QColor seen = slices_[1]->grab().toImage().pixelColor(pixel(*slices_[1], 0.5 * (entry + target)));
  EXPECT_GT(seen.blue(), seen.red() + 40) << seen.name().toStdString();

  keep_picture("plan_drawn");

  // The gauges compare the tool with it. Closed form, from the tool's pose.
  click_tool("drill");
  EXPECT_TRUE(until([&] {
    hover(middle() + QPoint(40, 10));
    return view_->pointer().on_bone() && !std::isnan(gauge("plan_depth"));
  })) << problem();
  const auto as_computed = [&] {
    const Pose tool = view_->updater()->states().front().pose_bone_tool;
    const Vec3 from = from_steps(drawn.points[0]), way = from_steps(drawn.points[1]) - from,
               axis = tool.rotation.toRotationMatrix().col(2);
    const double along = (tool.position_mm - from).dot(way) / way.squaredNorm();
    constexpr double kRounded = 0.05 + 1e-6;
    return std::abs(gauge("plan_angle") - std::acos(axis.dot(way) / way.norm()) / kDegree) < kRounded &&
           std::abs(gauge("plan_beside") - (tool.position_mm - from - along * way).norm()) < kRounded &&
           std::abs(gauge("plan_depth") - (1.0 - along) * way.norm()) < kRounded;
  };
  EXPECT_TRUE(until(as_computed)) << label("plan_angle").toStdString() << " " << label("plan_beside").toStdString()
                                  << " " << label("plan_depth").toStdString();
  trigger("put_down");

  // An end moves by a drag, and undo takes that back.
  drag(*slices_[1], from_steps(drawn.points[1]), moved);
  ASSERT_TRUE(until([&] { return settled() && in_room(1) && planned()[0].points[1] != drawn.points[1]; }));
  EXPECT_NEAR((from_steps(planned()[0].points[1]) - moved).norm(), 0.0, 2.0 * pixel_mm);
  EXPECT_EQ(planned()[0].points[0], drawn.points[0]);
  trigger("plan_undo");
  EXPECT_TRUE(until([&] { return settled() && in_room(1) && planned()[0].points == drawn.points; })) << problem();
  trigger("plan_wipe");
  EXPECT_TRUE(until([&] { return settled() && planned().empty() && blue_pixels() < blue_before + 5; })) << problem();
  trigger("plan_undo");
  EXPECT_TRUE(until([&] { return settled() && in_room(1) && planned()[0].points == drawn.points; })) << problem();

  // The session keeps it, and the next one may change it.
  const std::filesystem::path kept = session();
  trigger("start_page");
  EXPECT_TRUE(planned().empty());
  open(kept);
  ASSERT_TRUE(until([&] { return in_room(1) && shown(); })) << problem();
  EXPECT_EQ(planned()[0].points, drawn.points);
  const std::uint32_t kept_id = planned()[0].id;
  panel_->look_at(from_steps(drawn.points[1]));
  ASSERT_TRUE(until([&] { return shown(); }));
  drag(*slices_[1], from_steps(drawn.points[1]), moved);
  EXPECT_TRUE(until([&] {
    return in_room(1) && planned()[0].points[1] != drawn.points[1] && planned()[0].id != kept_id;
  })) << "another author's is replaced; "
      << problem();
}

TEST_F(PlanTest, ASimulatedSurgeonDrillsTheDrawnAxis) {
  open_slices();
  if (HasFatalFailure()) return;
  draw_axis({-3, panel_->point_mm().y(), 0.2}, {0, panel_->point_mm().y(), -28});
  if (HasFatalFailure()) return;
  const Vec3 entry = from_steps(planned()[0].points[0]), target = from_steps(planned()[0].points[1]),
             way = (target - entry).normalized();
  const std::filesystem::path file = desk_->temp() / "drawn.json";
  bar_->save(QString::fromStdString(file.string()));
  ASSERT_EQ(drill_plan(file), 0);

  // It ends at the target.
  panel_->look_at(target);
  const double half_hu = 0.5 * (kCortex_hu + kAir_hu);
  EXPECT_TRUE(until([&] { return shown() && hu_at(*slices_[1], target - 1.0 * way) < half_hu; })) << problem();
  EXPECT_GT(hu_at(*slices_[1], target + 1.0 * way), half_hu);
  keep_picture("plan_drilled");

  // In both cortical layers, the middle of the hole is on the drawn axis.
  const auto on_axis = [&](double z_mm) { return Vec3(entry + (z_mm - entry.z()) / way.z() * way); };
  const auto upper = hole_at(-2.5, on_axis(-2.5)), lower = hole_at(-26.5, on_axis(-26.5));
  ASSERT_TRUE(upper && lower) << problem();
  EXPECT_LT((*upper - on_axis(-2.5)).norm(), 0.3) << upper->transpose();
  EXPECT_LT((*lower - on_axis(-26.5)).norm(), 0.3) << lower->transpose();
  EXPECT_LT(std::acos(std::min(1.0, (*lower - *upper).normalized().dot(way))) / kDegree, 1.0);
}

TEST_F(PlanTest, ClicksOnTheBoneAndKeysDrawToo) {
  open_slices();
  if (HasFatalFailure()) return;
  trigger("draw_axis");
  EXPECT_TRUE(view_->placing());
  press(middle()), release(middle());
  const QPoint second = middle() + QPoint(60, 0);
  press(second), release(second);
  ASSERT_TRUE(until([&] { return in_room(1); })) << problem();
  EXPECT_FALSE(view_->placing());
  const std::vector<Vec3> ends = points_mm(planned()[0]);
  for (const Vec3& end : ends) EXPECT_NEAR(end.z(), 0.0, 0.1) << "on the surface";
  EXPECT_GT((ends[1] - ends[0]).norm(), 5.0);

  // A plane by keys: the cross, and arrows between.
  slices_[0]->setFocus();
  trigger("draw_plane");
  slices_[0]->setFocus();
  trigger("plan_point");
  for (int i = 0; i < 10; ++i) QTest::keyClick(slices_[0], Qt::Key_Right);
  trigger("plan_point");
  ASSERT_TRUE(until([&] { return in_room(2); })) << problem();
  const Annotation plane = planned()[1];
  ASSERT_EQ(plane.kind, AnnotationKind::plane);
  EXPECT_NEAR(std::abs(planned_direction(plane).y()), 1.0, 1e-3) << "along x, and into the axial image";
  const QString file = QString::fromStdString((desk_->temp() / "axis.json").string());
  bar_->save(file);
  EXPECT_EQ(window_->statusBar()->currentMessage(), "Saved " + file + ".");
  EXPECT_NE(test::content(file.toStdString()).find(plane.words), std::string::npos) << "the plane is in it";

  // Escape ends drawing, and clicks set the cross again.
  trigger("draw_axis");
  trigger("put_down");
  EXPECT_FALSE(view_->placing());
  const Vec3 before = panel_->point_mm();
  click(*slices_[0], before + Vec3(5, 0, 0));
  EXPECT_GT((panel_->point_mm() - before).norm(), 4.0);
  EXPECT_TRUE(in_room(2));
}

}  // namespace
}  // namespace osteon
