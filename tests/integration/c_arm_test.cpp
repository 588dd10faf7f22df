// The C-arm as a person uses it in a practice room, with the real programs as children of the window.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <QAction>
#include <QApplication>
#include <QComboBox>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QImage>
#include <QLocale>
#include <QPushButton>
#include <QSettings>
#include <QStatusBar>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

#include "common/radiology/attenuation.hpp"
#include "tests/integration/window_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/size_limit.hpp"
#include "viewer_client/desktop/c_arm_panel.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// The block of the bench: 5 mm of 1.9 g/cm³, 20 mm of 0.3, and 5 mm of 1.9, below z = 0. The line is that of Rho 1995.
double per_mm(double density_g_cm3) { return radiology::attenuation_per_mm((density_g_cm3 - 0.131) / 0.001067); }
constexpr double kCortex_mm = 5.0, kMarrow_mm = 20.0;
// 1 µGy at 1 m, in 1 mm², of which 65 % count (intensifier_test.cpp). A tenth of the light spreads as glare.
constexpr double kPhotons_per_ugy_mm2 = 30460.0 * 0.65, kNoGlare = 0.9;

class CArmTest : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    WindowBench::SetUp();
  }
  [[nodiscard]] CArmPanel& panel() const { return *dynamic_cast<CArmPanel*>(window_->findChild<QWidget*>("c_arm")); }
  [[nodiscard]] QDockWidget* dock() const { return window_->findChild<QDockWidget*>("c_arm_panel"); }
  [[nodiscard]] QPushButton* button(const char* name) const { return window_->findChild<QPushButton*>(name); }
  [[nodiscard]] double set_to(const char* name) const { return window_->findChild<QDoubleSpinBox*>(name)->value(); }
  [[nodiscard]] std::string bar() const { return window_->statusBar()->toolTip().toStdString(); }
  void show_panel() {
    if (!dock()->isVisible()) dock()->toggleViewAction()->trigger();
    ASSERT_TRUE(until([&] { return button("c_arm_shot")->isEnabled(); }))
        << problem() << label("c_arm_words").toStdString();
  }
  void click(const char* name) { QTest::mouseClick(button(name), Qt::LeftButton); }
  [[nodiscard]] std::uint64_t shots() const { return panel().console().totals().shots; }
  // Waits for the whole picture of a shot.
  std::shared_ptr<const CArmPicture> shoot() {
    const std::uint64_t before = shots();
    click("c_arm_shot");
    EXPECT_TRUE(until([&] { return shots() == before + 1 && !panel().picture()->coarse; })) << problem();
    return panel().picture();
  }
  // Mean photons for each µGy and mm² of the detector, on the shadow of a circle about a point.
  static double photons_at(const CArmPicture& picture, const Vec3& point_mm, double radius_mm) {
    auto arm = c_arm_at(picture.shot.position);
    arm.columns = picture.columns;
    arm.rows = picture.rows;
    const auto beam = radiology::beam_of(arm);
    const double black = std::log(static_cast<double>(picture.contrast.black));
    const double range = std::log(static_cast<double>(picture.contrast.white)) - black;
    double sum = 0.0, count = 0.0;
    for (int row = 0; row < picture.rows; ++row)
      for (int column = 0; column < picture.columns; ++column) {
        const Vec3 ray = (beam->detector.at(column, row) - beam->source_mm).normalized(),
                   to = point_mm - beam->source_mm;
        if ((to - ray.dot(to) * ray).norm() > radius_mm) continue;
        sum += std::exp(black + range * picture.grey[beam->detector.index(column, row)] / 255.0);
        count += 1.0;
      }
    EXPECT_GT(count, 2.0);
    return sum / count / picture.shot.air_kerma_at_metre_ugy / beam->detector.column_mm.squaredNorm();
  }
  // Drills through the upper cortex, and puts the drill away.
  void bore() {
    hold_drill();
    view_->pointer().set_push(30.0);
    // Whether the hand is empty. Notes the deepest place of the drill on the way.
    const auto empty = [&] {
      for (const CuttingState& state : view_->updater()->states()) {
        if (state.tool_name.empty()) continue;
        if (state.pose_bone_tool.position_mm.z() < deepest_.position_mm.z()) deepest_ = state.pose_bone_tool;
        return false;
      }
      return true;
    };
    EXPECT_TRUE(push_until([&] { return !empty() && deepest_.position_mm.z() < -9.0; })) << problem();
    release(middle());
    // The hand comes to rest.
    for (int i = 0; i < 40; ++i, QTest::qWait(50)) (void)empty();
    trigger("put_down");
    EXPECT_TRUE(until(empty)) << problem();
  }
  // Shoots until a place has so many photons more than before. On a busy machine the last cut is in the picture later.
  std::shared_ptr<const CArmPicture> shoot_until_more(const CArmPicture& before, const Vec3& at, double expected) {
    std::shared_ptr<const CArmPicture> after;
    double more = 0.0;
    const bool there = until([&] {
      after = shoot();
      more = photons_at(*after, at, 1.0) - photons_at(before, at, 1.0);
      return std::abs(more - expected) < 0.25 * expected;
    });
    EXPECT_TRUE(there) << more << " of " << expected;
    return after;
  }
  // A maximum intensity that comes when X-rays are chosen again is there later. The window sees nothing meanwhile.
  // `file`: the one of before.
  void choose_x_rays_before_a_maximum_comes(const fs::path& file) {
    auto* kind = window_->findChild<QComboBox*>("c_arm_kind");
    click("c_arm_axial");
    std::this_thread::sleep_for(std::chrono::seconds(2));
    kind->setCurrentIndex(0);
    QTest::qWait(200);
    kind->setCurrentIndex(1);
    const std::string before = test::content(file);
    EXPECT_TRUE(until([&] {
      return panel().save(file, true) && QImage(QString::fromStdString(file.string())).width() == 800 &&
             test::content(file) != before;
    }));
  }
  // On the drill's axis, in the middle of the cortex.
  [[nodiscard]] Vec3 in_hole() const {
    const Vec3 axis = deepest_.direction(Vec3::UnitZ());
    return deepest_.position_mm + (-0.5 * kCortex_mm - deepest_.position_mm.z()) / axis.z() * axis;
  }
  [[nodiscard]] std::vector<CArmShot> in_file(const fs::path& session) const {
    std::vector<CArmShot> found;
    std::ifstream file(session / kShotFileName);
    for (std::string line; std::getline(file, line);) {
      const auto shot = shot_of(line);
      EXPECT_TRUE(shot) << line;
      if (shot) found.push_back(*shot);
    }
    return found;
  }
  void expect_kept(const fs::path& session) {
    const std::vector<CArmShot> kept = in_file(session);
    ASSERT_EQ(kept.size(), shots());
    double seconds = 0.0, dose = 0.0;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      EXPECT_EQ(kept[i].number, i + 1);
      EXPECT_EQ(kept[i], panel().console().shots()[i]);
      seconds += kept[i].exposure_s;
      dose += kept[i].dose_area_gy_cm2;
    }
    EXPECT_EQ(label("c_arm_shots"), QString::number(kept.size()));
    EXPECT_NEAR(QLocale().toDouble(label("c_arm_seconds").section(' ', 0, 0)), seconds, 0.0051);
    EXPECT_NEAR(QLocale().toDouble(label("c_arm_dose").section(' ', 0, 0)), dose, 0.0000051);
  }

  Pose deepest_;
};

TEST_F(CArmTest, ShowsAHoleCountsItsShotsAndKeepsThem) {
  const fs::path session = desk_->temp() / "fluoroscopy";
  EXPECT_FALSE(dock()->isVisible()) << "X-rays are off unless asked for";
  open(session);
  EXPECT_FALSE(dock()->isVisible());
  show_panel();
  EXPECT_EQ(label("c_arm_shots"), "0");
  EXPECT_FALSE(button("c_arm_save")->isEnabled());
  EXPECT_EQ(button("c_arm_save")->toolTip(), "There is no picture yet.");

  // Presets and boxes move the arm, and shoot nothing.
  click("c_arm_lateral");
  EXPECT_EQ(set_to("c_arm_orbit"), 90.0);
  window_->findChild<QDoubleSpinBox*>("c_arm_x")->setValue(12.5);
  EXPECT_EQ(panel().console().position().translation_mm, Vec3(12.5, 0, 0));
  click("c_arm_ap");
  EXPECT_EQ(set_to("c_arm_orbit"), 0.0);
  EXPECT_EQ(set_to("c_arm_x"), 0.0);
  click("c_arm_tip");
  EXPECT_THAT(bar(), HasSubstr("Your hand holds no tool"));
  click("c_arm_axial");
  EXPECT_EQ(set_to("c_arm_tilt"), 90.0);
  QTest::qWait(300);
  EXPECT_EQ(shots(), 0u);
  EXPECT_FALSE(fs::exists(session / kShotFileName));

  // Along the hole ∫ μ dl falls by what was there. Glare is equal before and after, so the difference has none.
  const auto before = shoot();
  EXPECT_EQ(label("c_arm_shots"), "1");
  EXPECT_EQ(window_->findChild<QWidget*>("c_arm_last")->accessibleName(),
            "The last picture: left R, right L, top P, bottom A");
  bore();
  ASSERT_LT(deepest_.position_mm.z(), -9.0);
  const double deep_mm = -deepest_.position_mm.z() - kCortex_mm;  // of the hole in the marrow
  const double all = 2.0 * kCortex_mm * per_mm(1.9) + kMarrow_mm * per_mm(0.3);
  const double less = kCortex_mm * per_mm(1.9) + deep_mm * per_mm(0.3);
  const double expected = kNoGlare * kPhotons_per_ugy_mm2 * std::exp(-all) * (std::exp(less) - 1.0);
  const Vec3 hole = in_hole(), beside = hole + Vec3(8, 0, 0);
  const auto after = shoot_until_more(*before, hole, expected);
  EXPECT_NEAR(photons_at(*after, beside, 2.0) - photons_at(*before, beside, 2.0), 0.0, 0.1 * expected);

  // Live, an undo is seen while the pedal is held. The keyboard's focus is in the picture of the bone.
  view_->setFocus();
  QTest::keyPress(view_, Qt::Key_F9);
  EXPECT_EQ(panel().console().held(), ShotMode::live);
  EXPECT_TRUE(until([&] { return shots() > 3; })) << problem();
  const double drilled = photons_at(*panel().picture(), hole, 1.0);
  undo_pushes();
  EXPECT_TRUE(until([&] { return photons_at(*panel().picture(), hole, 1.0) < drilled - 0.5 * expected; })) << problem();
  QTest::keyRelease(view_, Qt::Key_F9, Qt::ShiftModifier);
  EXPECT_FALSE(panel().console().held()) << "also if Shift was pressed meanwhile";
  EXPECT_TRUE(until([&] { return panel().console().idle(); })) << problem();  // the last one comes
  const std::uint64_t counted = shots();
  QTest::qWait(500);
  EXPECT_EQ(shots(), counted) << "the pedal is up";
  EXPECT_EQ(panel().console().shots().back().mode, ShotMode::live);
  expect_kept(session);

  // The session goes on with its counts.
  trigger("start_page");
  EXPECT_EQ(label("c_arm_shots"), "0");
  EXPECT_FALSE(dock()->isEnabled());
  EXPECT_EQ(dock()->toolTip(), "Open a bone or join a room first.");
  open(session);
  EXPECT_EQ(label("c_arm_shots"), QString::number(counted));
  show_panel();
  (void)shoot();
  EXPECT_EQ(panel().console().shots().back().number, counted + 1);
  expect_kept(session);
}

// A window of 1400 pixels has room for the panel beside the others, also where letters are a fifth wider than here.
TEST_F(CArmTest, ThePanelFitsIntoAUsualWindow) {
  open();
  show_panel();
  EXPECT_LE(window_->minimumSizeHint().width(), 1400.0 / 1.2);
}

TEST_F(CArmTest, ShootsOnlyWhileItIsWantedAndLosesNothing) {
  const fs::path session = desk_->temp() / "wrong-use";
  open(session);
  show_panel();
  (void)shoot();
  // A full disk is one sentence. The session goes on, and the shots come later.
  {
    const test::SizeLimit small(fs::file_size(session / kShotFileName) + 10);
    (void)shoot();
    EXPECT_THAT(bar(), HasSubstr("make room on the disk"));
    EXPECT_THAT(bar(), HasSubstr(kShotFileName));
    EXPECT_THAT(label("c_arm_words").toStdString(), HasSubstr("make room on the disk"));
    EXPECT_EQ(in_file(session).size(), 1u);
  }
  (void)shoot();
  EXPECT_TRUE(until([&] { return label("c_arm_words").isEmpty(); }));
  expect_kept(session);
  EXPECT_TRUE(view_->surface_shown());

  // A button of the pedal goes on while it is down, by mouse and by keyboard.
  QTest::mousePress(button("c_arm_pulse"), Qt::LeftButton);
  EXPECT_TRUE(until([&] { return shots() > 5; })) << problem();
  QTest::mouseRelease(button("c_arm_pulse"), Qt::LeftButton);
  EXPECT_EQ(panel().console().shots().back().mode, ShotMode::pulse);
  button("c_arm_live")->setFocus();
  QTest::keyPress(button("c_arm_live"), Qt::Key_Space);
  EXPECT_EQ(panel().console().held(), ShotMode::live);
  // A window that is not in front any more lets go.
  QEvent away(QEvent::WindowDeactivate);
  QApplication::sendEvent(window_.get(), &away);
  EXPECT_FALSE(panel().console().held());
  QTest::keyRelease(button("c_arm_live"), Qt::Key_Space);
  EXPECT_TRUE(until([&] { return panel().console().idle(); })) << problem();
  // So does a panel that is hidden.
  const std::uint64_t counted = shots();
  QTest::keyPress(view_, Qt::Key_F8);
  EXPECT_TRUE(until([&] { return shots() > counted; })) << problem();
  dock()->toggleViewAction()->trigger();
  EXPECT_FALSE(panel().console().held());
  const std::uint64_t hidden = shots();
  QTest::keyRelease(view_, Qt::Key_F8);
  QTest::keyClick(view_, Qt::Key_F7);
  QTest::qWait(500);
  EXPECT_EQ(shots(), hidden);
  show_panel();

  // Maximum intensity costs no dose.
  window_->findChild<QComboBox*>("c_arm_kind")->setCurrentIndex(1);
  EXPECT_FALSE(button("c_arm_shot")->isEnabled());
  EXPECT_THAT(button("c_arm_shot")->toolTip().toStdString(), HasSubstr("needs no X-rays"));
  const fs::path file = desk_->temp() / "maximum.png", shot_file = desk_->temp() / "shot.png";
  EXPECT_TRUE(
      until([&] { return panel().save(file, true) && QImage(QString::fromStdString(file.string())).width() == 800; }));
  EXPECT_EQ(shots(), hidden);
  choose_x_rays_before_a_maximum_comes(file);
  window_->findChild<QComboBox*>("c_arm_kind")->setCurrentIndex(0);
  EXPECT_TRUE(button("c_arm_shot")->isEnabled());
  (void)shoot();

  // A picture takes the place of no file unless somebody says so.
  ASSERT_TRUE(panel().save(shot_file, false));
  const QImage saved(QString::fromStdString(shot_file.string()));
  EXPECT_EQ(saved.size(), QSize(800, 600));
  EXPECT_EQ(saved.pixelColor(400, 300).red(), panel().picture()->grey[300 * 800 + 400]);
  const std::string bytes = test::content(shot_file);
  const Result<void> again = panel().save(shot_file, false);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::exists);
  EXPECT_EQ(test::content(shot_file), bytes);
  expect_kept(session);
}

}  // namespace
}  // namespace osteon
