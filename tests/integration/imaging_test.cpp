// From a folder of DICOM files to a bone to drill, in the window: with the mouse, with nothing typed, and with the case
// that osteon-import makes of the same edit list.
#include <gtest/gtest.h>

#include <QAbstractButton>
#include <QApplication>
#include <QComboBox>
#include <QCoreApplication>
#include <QDockWidget>
#include <QFileDialog>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMessageBox>
#include <QPushButton>
#include <QSettings>
#include <QSlider>
#include <QSpinBox>
#include <QTest>
#include <QTimer>
#include <QWheelEvent>
#include <algorithm>
#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <utility>

#include "common/volume/case.hpp"
#include "tests/integration/imaging_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/size_limit.hpp"
#include "viewer_client/desktop/imaging_histogram.hpp"
#include "viewer_client/desktop/imaging_page.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using test::children;
using test::FolderChooser;
using test::kBall_hu;
using test::kMuscle_hu;
using test::two_balls;

class ImagingTest : public test::ImagingBench {
 protected:
  [[nodiscard]] bool idle() const { return !part<QPushButton>("imaging_cancel").isVisible(); }
  [[nodiscard]] bool found(int count) const { return idle() && islands().isVisible() && islands().count() == count; }
  void click(const char* button) {
    ASSERT_TRUE(part<QPushButton>(button).isEnabled()) << button;
    ++clicks_;
    QTest::mouseClick(&part<QPushButton>(button), Qt::LeftButton);
  }
  // Opens the folder as by the dialog, and its first series.
  void open_scan(const fs::path& folder, int parts) {
    window_->process_images(QString::fromStdString(folder.string()));
    auto& list = part<QListWidget>("series");
    ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
    choose_series(list);
    ASSERT_TRUE(until([&] { return found(parts); })) << words();
    part<QSlider>("slice_axial").setValue(12);
  }
  void choose_series(QListWidget& list) {
    ++clicks_;
    QTest::mouseClick(list.viewport(), Qt::LeftButton, {}, list.visualItemRect(list.item(0)).center());
  }
  [[nodiscard]] std::vector<bool> ticks() const {
    std::vector<bool> all;
    for (int i = 0; i < islands().count(); ++i) all.push_back(islands().item(i)->checkState() == Qt::Checked);
    return all;
  }
  [[nodiscard]] QStringList panels_shown() const {
    QStringList names;
    for (const QDockWidget* panel : window_->findChildren<QDockWidget*>())
      if (!panel->isHidden()) names << panel->objectName();
    return names;
  }
  // The step has ended with one sentence, and another scan can be opened.
  [[nodiscard]] std::string refused() {
    EXPECT_TRUE(until([&] { return idle() && !words().empty(); }));
    EXPECT_EQ(words().find('\n'), std::string::npos) << words();
    EXPECT_TRUE(part<QPushButton>("imaging_folder").isEnabled());
    return words();
  }
  int clicks_ = 0;
};

// The scratch folder of this program's page.
fs::path scratch() {
  return cases_folder() / (".partial-imaging-" + std::to_string(QCoreApplication::applicationPid()));
}

TEST_F(ImagingTest, FromAFolderToADrillableBoneInTenClicks) {
  const fs::path folder = series("ct", two_balls());
  // The panels belong to a room, so image processing gets their place.
  part<QDockWidget>("c_arm_panel").show();
  click("import");
  EXPECT_EQ(panels_shown(), QStringList());
  {
    const FolderChooser chooser(QString::fromStdString(folder.string()));
    click("imaging_folder");
    clicks_ += 2;  // in the dialog
  }
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
  const QString text = list.item(0)->text();
  EXPECT_TRUE(text.contains("CT, 24 slices, 60 × 60 pixels, pitch 0.9 × 0.9 × 1.5 mm")) << text.toStdString();
  EXPECT_FALSE(list.item(0)->icon().isNull());
  EXPECT_FALSE(list.item(0)->icon().availableSizes().isEmpty());
  choose_series(list);
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  EXPECT_FALSE(part<QPushButton>("make_bone").isEnabled());
  const QImage ball_seen = islands().item(0)->icon().pixmap(28, 28).toImage();
  EXPECT_EQ(qAlpha(ball_seen.pixel(14, 14)), 255);
  EXPECT_EQ(qAlpha(ball_seen.pixel(1, 1)), 0) << "beside the ball";

  // The planes go through one of the balls.
  EXPECT_TRUE(label("readout").startsWith("1000 HU")) << label("readout").toStdString();
  // The ball on the patient's left is on the right of the axial plane.
  ImagingPlane& axial = plane("plane_axial");
  const QPoint at = axial.pixel(ball(1));
  EXPECT_GT(at.x(), axial.width() / 2);
  double_click(axial, at);
  clicks_ += 2;
  EXPECT_EQ(std::ranges::count(ticks(), true), 1);
  click("make_bone");
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << words() << problem();
  EXPECT_LE(clicks_, 10);
  EXPECT_TRUE(panels_shown().contains("c_arm_panel"));
  EXPECT_TRUE(panels_shown().contains("gauges_panel"));
  part<QDockWidget>("c_arm_panel").hide();

  // One ball and not the other, as large as the formula says. Voxels of 1 mm show its volume to within 5 %.
  const fs::path made = cases_folder() / "ct";
  const auto bone = Case::load(made);
  ASSERT_TRUE(bone) << bone.error().message;
  EXPECT_NEAR(bone->volume_mm3(), test::kBall_mm3, 0.05 * test::kBall_mm3);

  // The same edit list gives the same case.
  const fs::path edits = made.string() + ".edits.yaml", again = desk_->temp() / "again";
  const auto run = test::run(test::program("osteon-import"), {"ct", folder.string(), "--series", "1", "--threshold",
                                                              "226", "--edits", edits.string(), "--out", again});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto repeated = Case::load(again);
  ASSERT_TRUE(repeated) << repeated.error().message;
  EXPECT_EQ(repeated->hash(), bone->hash());
  drill();
}

// Answers the question for folder or file, and then chooses in the dialog. What it cannot answer it closes.
class SourceChooser : public QObject {
 public:
  SourceChooser(const char* kind, QString file) : kind_(kind), file_(std::move(file)) {
    connect(&timer_, &QTimer::timeout, this, [this] {
      QWidget* modal = QApplication::activeModalWidget();
      if (auto* box = qobject_cast<QMessageBox*>(modal)) {
        for (QAbstractButton* button : box->buttons())
          if (button->text().remove('&').contains(kind_)) return button->click();
        box->reject();
      } else if (auto* dialog = qobject_cast<QFileDialog*>(modal)) {
        if (file_.isEmpty()) return dialog->reject();
        dialog->findChild<QLineEdit*>("fileNameEdit")->setText(std::exchange(file_, {}));
        QMetaObject::invokeMethod(dialog, "accept", Qt::QueuedConnection);
      }
    });
    timer_.start(20);
  }

 private:
  QString kind_, file_;
  QTimer timer_;
};

TEST_F(ImagingTest, BesideABoneImportTakesAFileToo) {
  const fs::path slice = *fs::directory_iterator(series("ct", two_balls()));
  open();
  {
    const SourceChooser nothing("Cancel", {});
    trigger("import_scan");
  }
  EXPECT_TRUE(view_->isVisible()) << "nobody leaves a room before a scan is chosen";
  {
    const SourceChooser a_file("file", QString::fromStdString(slice.string()));
    trigger("import_scan");
  }
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
  EXPECT_FALSE(view_->isVisible());
}

TEST_F(ImagingTest, ThePlanesHangTogether) {
  open_scan(series("ct", two_balls()), 2);
  ImagingPlane &axial = plane("plane_axial"), &coronal = plane("plane_coronal"), &sagittal = plane("plane_sagittal");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel(ball(-1)));
  EXPECT_EQ(axial.slice(), 12);
  EXPECT_EQ(coronal.slice(), ball(-1)[1]);
  EXPECT_EQ(sagittal.slice(), ball(-1)[0]);
  EXPECT_TRUE(label("readout").startsWith("1000 HU at -1")) << label("readout").toStdString();
  EXPECT_TRUE(label("readout").contains("bone")) << label("readout").toStdString();
  // Between the balls.
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({29, 29, 12}));
  EXPECT_TRUE(label("readout").startsWith("40 HU")) << label("readout").toStdString();
  // Wheel, slider and keys go through the slices.
  QWheelEvent wheel(QPointF(40, 40), coronal.mapToGlobal(QPoint(40, 40)), {}, {0, 240}, Qt::NoButton, {},
                    Qt::NoScrollPhase, false);
  QApplication::sendEvent(&coronal, &wheel);
  EXPECT_EQ(coronal.slice(), 31);
  // A touchpad sends parts of a notch.
  QWheelEvent third(QPointF(40, 40), coronal.mapToGlobal(QPoint(40, 40)), {}, {0, 40}, Qt::NoButton, {},
                    Qt::NoScrollPhase, false);
  for (int i = 0; i < 3; ++i) QApplication::sendEvent(&coronal, &third);
  EXPECT_EQ(coronal.slice(), 32);
  part<QSlider>("slice_axial").setValue(3);
  EXPECT_EQ(axial.slice(), 3);
  QTest::keyClick(&axial, Qt::Key_PageUp);
  EXPECT_EQ(axial.slice(), 4);
  QTest::keyClick(&axial, Qt::Key_Left);
  EXPECT_EQ(sagittal.slice(), 28);
}

TEST_F(ImagingTest, TheRightButtonDragsTheWindowAndPresetsBringItBack) {
  open_scan(series("ct", two_balls()), 2);
  ImagingPlane& axial = plane("plane_axial");
  auto& preset = part<QComboBox>("window_preset");
  EXPECT_EQ(preset.currentIndex(), 0);
  // Between two balls and away from crosshair and letters.
  const QPoint muscle = axial.pixel({29, 20, 12}) + QPoint(-3, 0);
  const auto grey = [&] { return qGray(axial.grab().toImage().pixel(muscle)); };
  // 40 HU in the window 500 +- 1000.
  EXPECT_NEAR(grey(), 255.0 * ((40.0 - 500.0) / 2000.0 + 0.5), 1.5);
  QTest::mousePress(&axial, Qt::RightButton, {}, muscle);
  QMouseEvent drag(QEvent::MouseMove, muscle + QPoint(0, 40), Qt::NoButton, Qt::RightButton, {});
  QApplication::sendEvent(&axial, &drag);
  QTest::mouseRelease(&axial, Qt::RightButton, {}, muscle + QPoint(0, 40));
  EXPECT_EQ(preset.currentIndex(), -1);
  // Each of 40 pixels raises the level by a two hundredth of the width: 400 HU.
  EXPECT_NEAR(grey(), 255.0 * ((40.0 - 900.0) / 2000.0 + 0.5), 1.5);
  preset.setCurrentIndex(1);
  Q_EMIT preset.activated(1);
  // Of soft tissue, 40 +- 200, it is the centre.
  EXPECT_NEAR(grey(), 127.5, 1.5);
}

TEST_F(ImagingTest, EverythingCanBeUndoneAndDoneAgain) {
  open_scan(series("ct", two_balls()), 2);
  const std::vector<bool> none{false, false}, first{true, false}, both{true, true};
  EXPECT_EQ(ticks(), none);
  islands().item(0)->setCheckState(Qt::Checked);
  islands().item(1)->setCheckState(Qt::Checked);
  EXPECT_EQ(ticks(), both);
  click("undo_edit");
  EXPECT_EQ(ticks(), first);
  // A key presses the button for a moment.
  QTest::keySequence(window_.get(), QKeySequence::Undo);
  EXPECT_TRUE(until([&] { return ticks() == none; }));
  EXPECT_FALSE(part<QPushButton>("undo_edit").isEnabled());
  EXPECT_FALSE(part<QPushButton>("make_bone").isEnabled());
  click("redo_edit");
  click("redo_edit");
  EXPECT_EQ(ticks(), both);
  islands().item(0)->setCheckState(Qt::Unchecked);
  EXPECT_EQ(ticks(), (std::vector<bool>{false, true}));
  EXPECT_FALSE(part<QPushButton>("redo_edit").isEnabled());
  // A threshold above both, and back: the seeds are still there.
  part<QSpinBox>("threshold").setValue(1500);
  ASSERT_TRUE(until([&] { return idle() && words().find("1500") != std::string::npos; })) << words();
  click("undo_edit");
  EXPECT_TRUE(until([&] { return found(2) && ticks() == std::vector<bool>({false, true}); })) << words();
  EXPECT_TRUE(part<QPushButton>("make_bone").isEnabled());
  // No bone is made of a threshold that the page shows no more.
  part<QSpinBox>("threshold").setValue(300);
  EXPECT_FALSE(part<QPushButton>("make_bone").isEnabled());
  click("undo_edit");
  EXPECT_EQ(part<QSpinBox>("threshold").value(), 226);
  EXPECT_EQ(ticks(), (std::vector<bool>{false, true}));
  EXPECT_TRUE(part<QPushButton>("make_bone").isEnabled());
  EXPECT_TRUE(part<QPushButton>("redo_edit").isEnabled());
  // Nothing of it stays when another scan is opened.
  part<QSpinBox>("threshold").setValue(300);
  window_->process_images("/nowhere");
  EXPECT_EQ(part<QSpinBox>("threshold").value(), 226);
  EXPECT_EQ(islands().count(), 0);
}

// One ball is softer than the threshold that is taken back, so that one has another number of parts.
TEST_F(ImagingTest, AThresholdThatIsUndoneWhileItsPartsAreFoundHasNone) {
  imaging::HuVolume softer = two_balls();
  for (std::size_t i = 0; i < softer.values.size(); ++i)
    if (softer.values[i] == test::kBall_hu && i % 60 < 30) softer.values[i] = 600;
  open_scan(series("softer", softer), 2);
  part<QSpinBox>("threshold").setValue(700);
  ASSERT_TRUE(until([&] { return !idle(); }));
  click("undo_edit");
  EXPECT_TRUE(until([&] { return found(2) && islands().isEnabled(); })) << words();
  EXPECT_EQ(part<QSpinBox>("threshold").value(), 226);
}

TEST_F(ImagingTest, TheLimitsOfTheHistogramAreDragged) {
  open_scan(series("ct", two_balls()), 2);
  auto& histogram = part<ImagingHistogram>("histogram");
  const auto drag = [&](double from_hu, double to_hu) {
    const QPoint from(histogram.pixel(from_hu), 20), to(histogram.pixel(to_hu), 20);
    QTest::mousePress(&histogram, Qt::LeftButton, {}, from);
    QMouseEvent move(QEvent::MouseMove, to, Qt::NoButton, Qt::LeftButton, {});
    QApplication::sendEvent(&histogram, &move);
    QTest::mouseRelease(&histogram, Qt::LeftButton, {}, to);
  };
  const double pixel_hu = 4096.0 / histogram.width();
  ImagingPlane& axial = plane("plane_axial");
  const QPoint muscle = axial.pixel({29, 20, 12}) + QPoint(-3, 0);
  const auto colour = [&] { return QColor(axial.grab().toImage().pixel(muscle)); };
  EXPECT_EQ(colour().red(), colour().blue());
  drag(226.0, 0.0);
  EXPECT_NEAR(part<QSpinBox>("threshold").value(), 0, pixel_hu);
  // Muscle of 40 HU reaches it: the tint is there at once.
  EXPECT_GT(colour().red(), colour().blue() + 20);
  ASSERT_TRUE(until([&] { return found(1); })) << words();
  click("undo_edit");
  ASSERT_TRUE(until([&] { return found(2) && islands().isEnabled(); })) << words();
  EXPECT_EQ(part<QSpinBox>("threshold").value(), 226);
  // The lower end of the window, -500 HU, comes to -2 pixels of muscle: it gets nearly black.
  drag(-500.0, 40.0 - 2.0 * pixel_hu);
  EXPECT_LT(colour().red(), 255.0 * 3.0 * pixel_hu / 1000.0);
  EXPECT_EQ(part<QComboBox>("window_preset").currentIndex(), -1);
}

TEST_F(ImagingTest, WhatIsNoCtIsRefusedWithOneSentence) {
  const fs::path empty = desk_->temp() / "empty";
  fs::create_directories(empty);
  window_->process_images(QString::fromStdString(empty.string()));
  EXPECT_NE(refused().find(empty.string()), std::string::npos) << words();
  window_->process_images(QString::fromStdString((desk_->temp() / "nowhere").string()));
  EXPECT_NE(refused().find("nowhere"), std::string::npos) << words();

  // One slice is listed with what is wrong, and cannot be chosen.
  const fs::path one = series("one", two_balls());
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(one)) files.push_back(entry.path());
  for (std::size_t i = 1; i < files.size(); ++i) fs::remove(files[i]);
  window_->process_images(QString::fromStdString(one.string()));
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  EXPECT_FALSE(list.item(0)->flags() & Qt::ItemIsEnabled) << list.item(0)->text().toStdString();

  // Air is seen, and has no bone.
  imaging::HuVolume air = two_balls();
  air.values.assign(air.count(), -1000);
  window_->process_images(QString::fromStdString(series("air", air).string()));
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  choose_series(list);
  ASSERT_TRUE(until([&] { return idle() && islands().isVisible(); })) << words();
  EXPECT_NE(refused().find("threshold"), std::string::npos) << words();
  EXPECT_EQ(words().find("--"), std::string::npos) << "no option of a command: " << words();
  EXPECT_FALSE(part<QPushButton>("make_bone").isEnabled());
  // A good one afterwards.
  open_scan(series("ct", two_balls()), 2);
}

TEST_F(ImagingTest, AFullDiskLosesNoEdits) {
  const auto cases = [] { return test::names_in(cases_folder()); };
  open_scan(series("ct", two_balls()), 2);
  islands().item(0)->setCheckState(Qt::Checked);
  const auto before = cases();
  {
    const test::SizeLimit full(2000);
    click("make_bone");
    EXPECT_NE(refused().find("disk"), std::string::npos) << words();
  }
  EXPECT_EQ(cases(), before);
  EXPECT_EQ(ticks(), (std::vector<bool>{true, false}));
  EXPECT_TRUE(part<QPushButton>("make_bone").isEnabled());
  {
    const test::SizeLimit full(50000);
    window_->process_images(QString::fromStdString(series("ct", two_balls()).string()));
    auto& list = part<QListWidget>("series");
    ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
    choose_series(list);
    EXPECT_NE(refused().find("disk"), std::string::npos) << words();
    EXPECT_TRUE(list.isVisible());
  }
}

TEST_F(ImagingTest, AFolderIsAskedForBesideTheLastOne) {
  const fs::path folder = series("ct", two_balls());
  click("import");
  {
    const FolderChooser chooser(QString::fromStdString(folder.string()));
    click("imaging_folder");
  }
  ASSERT_TRUE(until([&] { return idle() && part<QListWidget>("series").isVisible(); })) << words();
  QString beside;
  QTimer looks;
  QObject::connect(&looks, &QTimer::timeout, [&] {
    auto* dialog = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
    if (dialog == nullptr) return;
    looks.stop();
    beside = dialog->directory().path();
    dialog->reject();
  });
  looks.start(20);
  click("imaging_folder");
  EXPECT_EQ(beside.toStdString(), folder.parent_path().string());
  EXPECT_TRUE(part<QListWidget>("series").isVisible()) << "nothing was chosen";
}

TEST_F(ImagingTest, EachStepCanBeCancelled) {
  const auto cancel = [&] {
    EXPECT_TRUE(until([&] { return part<QPushButton>("imaging_cancel").isVisible(); }));
    click("imaging_cancel");
    EXPECT_EQ(refused(), "Cancelled. Nothing was written.");
    EXPECT_TRUE(children("osteon-import").empty());
  };
  const QString folder = QString::fromStdString(series("ct", two_balls()).string());
  window_->process_images(folder);
  cancel();
  window_->process_images(folder);
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  choose_series(list);
  cancel();
  EXPECT_TRUE(list.isVisible());
  choose_series(list);
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  part<QSpinBox>("threshold").setValue(300);
  ASSERT_TRUE(until([&] { return !idle(); }));
  cancel();
  click("find_parts");
  ASSERT_TRUE(until([&] { return found(2) && islands().isEnabled(); })) << words();
  EXPECT_FALSE(part<QPushButton>("find_parts").isVisible());
  click("undo_edit");
  ASSERT_TRUE(until([&] { return found(2) && islands().isEnabled(); })) << words();
  islands().item(1)->setCheckState(Qt::Checked);
  // A filter that is cancelled changes no voxel, and can be taken back.
  ImagingPlane& axial = plane("plane_axial");
  const QImage sharp = axial.grab().toImage();
  part<QComboBox>("filter").setCurrentIndex(3);
  Q_EMIT part<QComboBox>("filter").activated(3);
  cancel();
  EXPECT_FALSE(fs::exists(scratch() / "filtered-1.nrrd"));
  EXPECT_FALSE(part<QPushButton>("make_bone").isEnabled()) << "the parts are of another filter";
  click("undo_edit");
  EXPECT_EQ(part<QComboBox>("filter").currentIndex(), 0);
  EXPECT_EQ(axial.grab().toImage(), sharp);
  EXPECT_EQ(ticks(), (std::vector<bool>{false, true}));
  const auto before = test::names_in(cases_folder());
  click("make_bone");
  EXPECT_FALSE(part<QPushButton>("imaging_back").isEnabled());
  cancel();
  EXPECT_EQ(test::names_in(cases_folder()), before);
  EXPECT_EQ(ticks(), (std::vector<bool>{false, true}));
}

// Nothing lets the event loop turn after the click, so the child has only begun, and there is no scan to read yet.
TEST_F(ImagingTest, TheFirstSliceIsSeenBeforeTheOthersAreRead) {
  window_->process_images(QString::fromStdString(series("ct", two_balls()).string()));
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  choose_series(list);
  EXPECT_FALSE(idle());
  EXPECT_FALSE(fs::exists(scratch() / "scan.nrrd"));
  ImagingPlane &axial = plane("plane_axial"), &coronal = plane("plane_coronal");
  ASSERT_TRUE(axial.isVisible());
  EXPECT_EQ(axial.slice(), 12);
  EXPECT_EQ(part<QSlider>("slice_axial").maximum(), 23);
  EXPECT_NE(words().find("middle slice"), std::string::npos) << words();
  EXPECT_TRUE(part<QPushButton>("imaging_cancel").hasFocus());
  // Bone and muscle in a window of 2000 HU about 500 HU, beside the lines of the crosshair.
  const auto [column, row, slice] = ball(1);
  const auto grey = [](ImagingPlane& of, const std::array<int, 3>& voxel) {
    return qGray(of.grab().toImage().pixel(of.pixel(voxel)));
  };
  EXPECT_NEAR(grey(axial, {column, row + 3, slice}), 255.0 * ((kBall_hu - 500.0) / 2000.0 + 0.5), 1.0);
  EXPECT_NEAR(grey(axial, {column, row + 14, slice}), 255.0 * ((kMuscle_hu - 500.0) / 2000.0 + 0.5), 1.0);
  EXPECT_EQ(grey(coronal, {column, row, slice + 4}), 0) << "it waits";
  // No tool works on a scan that is not there.
  for (const char* name : {"plane_axial", "slice_axial", "threshold", "window_preset", "tool_paint", "keep_bone"})
    EXPECT_FALSE(part<QWidget>(name).isEnabled()) << name;
  EXPECT_EQ(axial.toolTip(), "osteon-import is at work. Wait for it, or cancel it.");
  part<QSlider>("slice_axial").setValue(3);
  EXPECT_EQ(axial.slice(), 12);
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  for (const char* name : {"plane_axial", "plane_coronal", "threshold", "window_preset", "tool_paint", "keep_bone"})
    EXPECT_TRUE(part<QWidget>(name).isEnabled()) << name;
  EXPECT_GT(grey(coronal, {column, row, slice + 4}), 0);
}

TEST_F(ImagingTest, CancelAfterTheFirstSliceLeavesTheListAlone) {
  window_->process_images(QString::fromStdString(series("ct", two_balls()).string()));
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  choose_series(list);
  ASSERT_TRUE(plane("plane_axial").isVisible());
  click("imaging_cancel");
  EXPECT_EQ(refused(), "Cancelled. Nothing was written.");
  EXPECT_TRUE(list.isVisible());
  EXPECT_TRUE(list.hasFocus());
  EXPECT_TRUE(children("osteon-import").empty());
  EXPECT_EQ(test::names_in(scratch()), std::set<std::string>{"pictures"});
  // Another source takes the place of a first slice too. A series without one is seen when it is read.
  choose_series(list);
  ASSERT_TRUE(plane("plane_axial").isVisible());
  window_->process_images(QString::fromStdString(series("other", two_balls()).string()));
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  EXPECT_FALSE(plane("plane_axial").isVisible());
  ASSERT_TRUE(fs::remove(scratch() / "pictures" / "series-1.nrrd"));
  choose_series(list);
  EXPECT_FALSE(plane("plane_axial").isVisible());
  ASSERT_TRUE(until([&] { return found(2); })) << words();
}

TEST_F(ImagingTest, ADamagedLastSliceIsRefusedAfterTheFirstWasSeen) {
  const fs::path folder = series("damaged", two_balls());
  const fs::path last = folder / "slice-0024.dcm";
  fs::resize_file(last, fs::file_size(last) - 100);
  window_->process_images(QString::fromStdString(folder.string()));
  auto& list = part<QListWidget>("series");
  ASSERT_TRUE(until([&] { return idle() && list.isVisible() && list.count() == 1; })) << words();
  choose_series(list);
  EXPECT_TRUE(plane("plane_axial").isVisible());
  EXPECT_NE(refused().find("slice-0024.dcm is cut off"), std::string::npos) << words();
  EXPECT_TRUE(list.isVisible());
  EXPECT_FALSE(plane("plane_axial").isVisible());
  EXPECT_EQ(test::names_in(scratch()), std::set<std::string>{"pictures"});
  open_scan(series("ct", two_balls()), 2);
}

TEST_F(ImagingTest, AWindowThatIsClosedLeavesNoScanBehind) {
  const QByteArray layout = window_->saveState();
  open_scan(series("ct", two_balls()), 2);
  const auto has_scratch = [] {
    for (const auto& entry : fs::directory_iterator(cases_folder()))
      if (entry.path().filename().string().find(".partial-imaging") != std::string::npos) return true;
    return false;
  };
  EXPECT_TRUE(has_scratch());
  EXPECT_TRUE(window_->close());
  EXPECT_EQ(QSettings().value("window/state").toByteArray(), layout) << "the next window has the room's panels again";
  window_.reset();
  EXPECT_FALSE(has_scratch());
}

TEST_F(ImagingTest, AWindowThatIsClosedWhileItMakesABoneLeavesNoEditList) {
  const auto lists = [] {
    auto names = test::names_in(cases_folder());
    std::erase_if(names, [](const std::string& name) { return !name.ends_with(".edits.yaml"); });
    return names;
  };
  open_scan(series("ct", two_balls()), 2);
  islands().item(0)->setCheckState(Qt::Checked);
  const auto before = lists();
  click("make_bone");
  EXPECT_EQ(lists().size(), before.size() + 1);
  window_.reset();
  EXPECT_EQ(lists(), before);
}

}  // namespace
}  // namespace osteon
