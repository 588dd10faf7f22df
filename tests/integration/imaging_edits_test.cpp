// The tools of image processing in the window, with the mouse and the keyboard: each edit shows at once, can be undone,
// and makes the case that osteon-import makes of the same edit list.
#include <gtest/gtest.h>

#include <QCheckBox>
#include <QComboBox>
#include <QDesktopServices>
#include <QDoubleSpinBox>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QSlider>
#include <QSpinBox>
#include <QTest>
#include <QTextBrowser>
#include <QToolButton>
#include <QWheelEvent>
#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "common/volume/case.hpp"
#include "tests/integration/imaging_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using test::two_balls;

class ImagingEditsTest : public test::ImagingBench {
 protected:
  void SetUp() override {
    ImagingBench::SetUp();
    window_->process_images(QString::fromStdString(folder().string()));
    auto& list = part<QListWidget>("series");
    ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
    QTest::mouseClick(list.viewport(), Qt::LeftButton, {}, list.visualItemRect(list.item(0)).center());
    ASSERT_TRUE(until([&] { return found(2); })) << words();
    part<QSlider>("slice_axial").setValue(12);
  }
  [[nodiscard]] static fs::path folder() { return series("brushed", two_balls()); }
  [[nodiscard]] bool found(int count) const {
    return !part<QPushButton>("imaging_cancel").isVisible() && part<QListWidget>("islands").isVisible() &&
           part<QListWidget>("islands").isEnabled() && part<QListWidget>("islands").count() == count;
  }
  void click(const char* button) {
    ASSERT_TRUE(part<QAbstractButton>(button).isEnabled()) << button;
    QTest::mouseClick(&part<QAbstractButton>(button), Qt::LeftButton);
  }
  [[nodiscard]] bool can_undo() const { return part<QPushButton>("undo_edit").isEnabled(); }
  static void drag(ImagingPlane& over, const std::array<int, 3>& from, const std::array<int, 3>& to) {
    const QPoint begin = over.pixel(from), end = over.pixel(to);
    QTest::mousePress(&over, Qt::LeftButton, {}, begin);
    for (int step = 1; step <= 4; ++step) {
      QMouseEvent move(QEvent::MouseMove, begin + (end - begin) * step / 4, Qt::NoButton, Qt::LeftButton, {});
      QApplication::sendEvent(&over, &move);
    }
    QTest::mouseRelease(&over, Qt::LeftButton, {}, end);
  }
  // Of a voxel, away from the crosshair.
  [[nodiscard]] static QColor colour(ImagingPlane& of, const std::array<int, 3>& voxel) {
    return {of.grab().toImage().pixel(of.pixel(voxel))};
  }
  // Makes the bone in the window, and again with the command that its edit list names. Returns it.
  [[nodiscard]] Result<Case> made_twice() {
    const auto before = test::names_in(cases_folder());
    click("make_bone");
    if (!until([&] { return view_->surface_shown(); })) return failure(ErrorCode::internal, words() + problem());
    std::string name;
    for (const std::string& there : test::names_in(cases_folder()))
      if (std::ranges::find(before, there) == before.end() && there.ends_with(".edits.yaml")) name = there;
    edits_ = cases_folder() / name;
    const std::string list = test::content(edits_);
    std::istringstream line(list.substr(std::string("# osteon-import ").size(), list.find('\n')));
    std::vector<std::string> arguments;
    for (std::string word; line >> word && word != "--edits";) arguments.push_back(word);
    const fs::path again = desk_->temp() / ("again-" + name);
    arguments.insert(arguments.begin() + 1, folder().string());
    arguments.insert(arguments.end(), {"--series", "1", "--edits", edits_.string(), "--out", again.string()});
    const auto run = test::run(test::program("osteon-import"), arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const auto repeated = Case::load(again);
    auto made = Case::load(cases_folder() / name.substr(0, name.find(".edits")));
    EXPECT_TRUE(repeated && made);
    if (repeated && made) {
      EXPECT_EQ(repeated->hash(), made->hash());
    }
    return made;
  }
  fs::path edits_;  // of the bone that was made last
};

// Half of a ball is left, with the name that a person has given it.
TEST_F(ImagingEditsTest, ACutAndNamedBoneIsThatOfTheSameList) {
  ImagingPlane& axial = plane("plane_axial");
  double_click(axial, axial.pixel(ball(1)));
  click("tool_cut");
  // Down the screen: what is to its right is the left of the screen.
  const auto [x, y, z] = ball(1);
  drag(axial, {x, y - 8, z}, {x, y + 14, z});
  const QColor gone = colour(axial, {x - 4, y - 3, z}), there = colour(axial, {x + 4, y - 3, z});
  // Red, and the colour of an island.
  EXPECT_GT(gone.red(), gone.green() + 50);
  EXPECT_NEAR(gone.green(), gone.blue(), 3);
  EXPECT_GT(std::abs(there.green() - there.blue()), 20);
  auto& choice = part<QComboBox>("bone_choice");
  ASSERT_EQ(choice.count(), 2);
  choice.setCurrentIndex(1);
  auto& name = part<QLineEdit>("bone_name");
  EXPECT_EQ(name.text(), "bone 1");
  name.selectAll();
  QTest::keyClicks(&name, "Humerus");
  QTest::keyClick(&name, Qt::Key_Return);
  EXPECT_EQ(choice.itemText(1), "1: Humerus");
  const auto made = made_twice();
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NEAR(made->volume_mm3(), 0.5 * test::kBall_mm3, 0.08 * test::kBall_mm3);
  ASSERT_EQ(made->info().labels.size(), 1u);
  EXPECT_EQ(made->info().labels[0].name, "Humerus");
  EXPECT_TRUE(made->info().labels[0].provenance.parameters.contains("minutes"));
  EXPECT_EQ(made->info().labels[0].provenance.edits.size(), 3u) << "seed, cut and label";
}

TEST_F(ImagingEditsTest, FilterBoxAndBrushMakeTheBoneOfTheSameList) {
  auto& filter = part<QComboBox>("filter");
  filter.setCurrentIndex(3);
  Q_EMIT filter.activated(3);
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  ImagingPlane& axial = plane("plane_axial");
  click("tool_box");
  drag(axial, {31, 4, 12}, {58, 55, 12});
  ASSERT_TRUE(until([&] { return found(1); })) << words();
  click("tool_look");
  const auto [x, y, z] = ball(1);
  double_click(axial, axial.pixel(ball(1)));
  click("tool_paint");
  part<QDoubleSpinBox>("brush_radius").setValue(2.0);
  drag(axial, {x, y, z}, {x, y - 14, z});
  click("tool_erase");
  part<QCheckBox>("brush_flat").setChecked(true);
  drag(axial, {x - 6, y + 4, z}, {x + 6, y + 4, z});
  const auto made = made_twice();
  ASSERT_TRUE(made) << made.error().message;
  const std::string list = test::content(edits_);
  EXPECT_NE(list.find("--gaussian 0.5 --edits"), std::string::npos) << list;
  for (const char* kind : {"kind: box", "kind: seed", "kind: scribble", "kind: erase"})
    EXPECT_NE(list.find(kind), std::string::npos) << list;
  // The painted rod sticks out of the ball. A sample of it, at a pitch of 0.9 mm: 14.4, -10.8 and 0.9 mm.
  EXPECT_EQ(made->bone_number({16, -12, 1}), 1);
}

// The pixel of a ball's middle, from the picture alone. Lines and letters over it do not move a median.
QPoint middle_of_ball(ImagingPlane& axial, int side) {
  const QImage seen = axial.grab().toImage();
  constexpr int kBeside_px = 10;  // a bright gap, and the frame of the focus
  const int width = axial.findChild<QSlider*>()->x() - kBeside_px;
  std::vector<int> columns, rows;
  for (int y = 0; y < seen.height(); ++y)
    for (int x = kBeside_px; x < width; ++x) {
      // The patient's left is to the right.
      const QColor colour(seen.pixel(x, y));
      if ((x > width / 2) != (side > 0) || colour.value() < 120) continue;
      columns.push_back(x);
      rows.push_back(y);
    }
  const auto middle = [](std::vector<int>& all) {
    std::ranges::sort(all);
    return all.at(all.size() / 2);
  };
  return {middle(columns), middle(rows)};
}

TEST_F(ImagingEditsTest, LandmarksAreInTheCaseWhereTheClicksWere) {
  ImagingPlane& axial = plane("plane_axial");
  const QPoint left = middle_of_ball(axial, 1), right = middle_of_ball(axial, -1);
  click("tool_landmark");
  auto& name = part<QComboBox>("landmark_name");
  auto& list = part<QListWidget>("landmarks");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, left);
  EXPECT_EQ(list.count(), 1);
  name.setEditText("Right apex");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, left);
  EXPECT_EQ(name.currentText(), "landmark 2");
  // The chosen one moves, and gets another name.
  list.setCurrentRow(1);
  EXPECT_EQ(name.currentText(), "landmark 2") << "the focus alone chooses none";
  QTest::keyClick(&list, Qt::Key_Return);
  EXPECT_EQ(name.currentText(), "Right apex");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, right);
  ASSERT_EQ(list.count(), 2);
  // A standard one is seen in German, and stored in English.
  speak("de");
  name.setEditText("Großer Rollhügel");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, right);
  ASSERT_EQ(list.count(), 3);
  EXPECT_EQ(list.item(2)->text(), "Großer Rollhügel");
  list.item(0)->setText("Innenknöchel");
  ASSERT_TRUE(until([&] { return list.item(0)->data(Qt::UserRole).toString() == "Medial malleolus"; }));
  speak("en");
  list.item(0)->setText("Left apex");
  // The page has the name, and not only the text of the list.
  ASSERT_TRUE(until([&] { return list.item(0)->data(Qt::UserRole).toString() == "Left apex"; }));
  EXPECT_EQ(axial.slice(), 12);
  list.setCurrentRow(0);
  QTest::mouseClick(&part<QPushButton>("landmark_remove"), Qt::LeftButton);
  EXPECT_EQ(list.count(), 2);
  QTest::mouseClick(&axial, Qt::LeftButton, {}, left);
  EXPECT_NE(words().find(" is at "), std::string::npos) << words();
  click("undo_edit");
  EXPECT_EQ(words(), "The last edit is taken back.");
  click("undo_edit");
  EXPECT_EQ(list.count(), 3);
  click("tool_look");
  double_click(axial, axial.pixel(ball(1)));
  part<QCheckBox>("with_report").click();
  QTextBrowser browser;
  QDesktopServices::setUrlHandler("file", &browser, "setSource");
  const auto made = made_twice();
  QDesktopServices::unsetUrlHandler("file");
  ASSERT_TRUE(made) << made.error().message;
  const std::string list_name = edits_.filename().string();
  const fs::path report = cases_folder() / (list_name.substr(0, list_name.find(".edits")) + ".report") / "report.html";
  EXPECT_EQ(browser.source().toLocalFile().toStdString(), report.string());
  EXPECT_NE(test::content(report).find("landmark Left apex"), std::string::npos);
  ASSERT_EQ(made->info().landmarks.size(), 3u);
  EXPECT_EQ(made->info().landmarks[0].name, "Left apex");
  EXPECT_EQ(made->info().landmarks[1].name, "Right apex");
  EXPECT_EQ(made->info().landmarks[2].name, "Greater trochanter");
  const Vec3 half = 0.5 * two_balls().spacing_mm + Vec3::Constant(0.2);  // and a pixel
  for (const int side : {1, -1}) {
    const Vec3 at = made->info().landmarks[side > 0 ? 0 : 1].point_mm;
    // Slice 12 lies half a step above the middles.
    const Vec3 middle(side * test::kApart_mm, 0.0, 0.5 * two_balls().spacing_mm.z());
    EXPECT_TRUE(((at - middle).cwiseAbs().array() <= half.array()).all()) << at.transpose();
  }
}

// A number field's line would take the keys, and the field the wheel that scrolls the page.
TEST_F(ImagingEditsTest, TheKeysAndTheWheelOfThePageAreNotThoseOfANumber) {
  ImagingPlane& axial = plane("plane_axial");
  double_click(axial, axial.pixel(ball(1)));
  ASSERT_TRUE(can_undo());
  auto& threshold = part<QSpinBox>("threshold");
  const int before = threshold.value();
  threshold.setFocus();
  QTest::keySequence(&threshold, QKeySequence::Undo);
  EXPECT_TRUE(until([&] { return !can_undo(); }));
  QTest::keySequence(&threshold, QKeySequence::Redo);
  EXPECT_TRUE(until([&] { return can_undo(); }));
  // A name takes its own letters back first.
  auto& name = part<QComboBox>("landmark_name");
  name.setFocus();
  name.lineEdit()->clear();
  QTest::keyClicks(&name, "x");
  QTest::keySequence(&name, QKeySequence::Undo);
  EXPECT_EQ(name.currentText(), "");
  EXPECT_TRUE(can_undo());

  const auto turn = [](QWidget& over) {
    const QPoint at = over.rect().center();
    QWheelEvent wheel(QPointF(at), over.mapToGlobal(at), {}, {0, 120}, Qt::NoButton, {}, Qt::NoScrollPhase, false);
    QApplication::sendEvent(&over, &wheel);
  };
  turn(threshold);
  EXPECT_EQ(threshold.value(), before);
  auto& window = part<QComboBox>("window_preset");
  window.setCurrentIndex(1);
  turn(window);
  EXPECT_EQ(window.currentIndex(), 1);
  EXPECT_EQ(window.focusPolicy(), Qt::StrongFocus) << "the wheel gives the focus";
  threshold.setFocus();
  turn(threshold);
  EXPECT_EQ(threshold.value(), before + threshold.singleStep());
}

// A landmark begins no search that the user has cancelled, and loses no threshold that was just typed.
TEST_F(ImagingEditsTest, ALandmarkLeavesTheSearchAndTheThreshold) {
  ImagingPlane& axial = plane("plane_axial");
  click("tool_landmark");
  auto& threshold = part<QSpinBox>("threshold");
  const int before = threshold.value();
  threshold.setValue(before + 10);
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel(ball(1)));
  EXPECT_EQ(threshold.value(), before + 10);
  EXPECT_EQ(part<QListWidget>("landmarks").count(), 1);
  click("imaging_cancel");
  auto& find = part<QPushButton>("find_parts");
  ASSERT_TRUE(until([&] { return find.isVisible(); })) << words();
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel(ball(-1)));
  EXPECT_EQ(part<QListWidget>("landmarks").count(), 2);
  EXPECT_TRUE(find.isVisible()) << "no search has begun";
  click("find_parts");
  EXPECT_TRUE(until([&] { return found(2); })) << words();
}

TEST_F(ImagingEditsTest, EdgesAreDrawnAndGoWithTheScan) {
  ImagingPlane& axial = plane("plane_axial");
  const std::array<int, 3> middle = ball(1);
  const auto is_edge = [&](int beside) {
    const QColor seen = colour(axial, {middle[0] + beside, middle[1] + 1, middle[2]});
    return seen.blue() > 180 && seen.green() > 180 && seen.red() < 130;
  };
  // The surface is 8.9 voxels from the middle.
  const auto on_surface = [&] { return is_edge(8) || is_edge(9); };
  EXPECT_FALSE(on_surface());
  auto& edges = part<QCheckBox>("edges");
  edges.click();
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  EXPECT_TRUE(edges.isChecked()) << words();
  EXPECT_TRUE(on_surface());
  EXPECT_FALSE(is_edge(5));
  EXPECT_FALSE(is_edge(13));
  edges.click();
  EXPECT_FALSE(on_surface());
  edges.click();
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  auto& filter = part<QComboBox>("filter");
  filter.setCurrentIndex(1);
  Q_EMIT filter.activated(1);
  ASSERT_TRUE(until([&] { return found(2) && !edges.isChecked(); })) << words();
  EXPECT_FALSE(on_surface()) << "they were of the scan before";
}

TEST_F(ImagingEditsTest, AFilterShowsInThePlanesAndIsUndone) {
  ImagingPlane& axial = plane("plane_axial");
  // Beside the ball's edge.
  const auto [x, y, z] = ball(1);
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({x + 10, y, z}));
  EXPECT_TRUE(label("readout").startsWith("40 HU")) << label("readout").toStdString();
  auto& filter = part<QComboBox>("filter");
  filter.setCurrentIndex(3);
  Q_EMIT filter.activated(3);
  part<QDoubleSpinBox>("gaussian").setValue(2.0);
  ASSERT_TRUE(until([&] { return found(2) && !label("readout").startsWith("40 HU"); })) << words();
  click("undo_edit");
  click("undo_edit");
  ASSERT_TRUE(until([&] { return found(2) && label("readout").startsWith("40 HU"); })) << words();
  EXPECT_EQ(filter.currentIndex(), 0);
  EXPECT_FALSE(can_undo());
  click("redo_edit");
  EXPECT_TRUE(until([&] { return found(2) && filter.currentIndex() == 3; })) << words();
  // Another scan begins without a filter.
  window_->process_images(QString::fromStdString(folder().string()));
  auto& list = part<QListWidget>("series");
  EXPECT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
  EXPECT_EQ(filter.currentIndex(), 0);
}

// The filter succeeds, and the search for the parts does not: its file cannot be written.
TEST_F(ImagingEditsTest, UndoShowsThePlainScanAfterASearchThatFailed) {
  ImagingPlane& axial = plane("plane_axial");
  const auto [x, y, z] = ball(1);
  const QPoint beside = axial.pixel({x + 10, y, z});
  QTest::mouseClick(&axial, Qt::LeftButton, {}, beside);
  EXPECT_TRUE(label("readout").startsWith("40 HU")) << label("readout").toStdString();
  click("tool_paint");
  part<QDoubleSpinBox>("gaussian").setValue(2.0);
  EXPECT_FALSE(can_undo());
  const fs::path islands =
      cases_folder() / (".partial-imaging-" + std::to_string(QCoreApplication::applicationPid())) / "islands.nrrd";
  fs::remove(islands);
  fs::create_directories(islands / "taken");
  auto& filter = part<QComboBox>("filter");
  filter.setCurrentIndex(3);
  Q_EMIT filter.activated(3);
  ASSERT_TRUE(until([&] { return part<QPushButton>("find_parts").isVisible(); })) << words();
  EXPECT_FALSE(label("readout").startsWith("40 HU")) << label("readout").toStdString();
  // The left button still moves the crosshair, and the page says why it does not paint.
  const int before = plane("plane_coronal").slice();
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({x, y - 16, z}));
  EXPECT_NE(plane("plane_coronal").slice(), before);
  EXPECT_NE(words().find("Find the parts"), std::string::npos) << words();
  EXPECT_FALSE(part<QToolButton>("tool_paint").isEnabled());
  EXPECT_TRUE(part<QToolButton>("tool_box").isEnabled());
  click("tool_look");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, beside);
  fs::remove_all(islands);
  click("undo_edit");
  EXPECT_TRUE(until([&] { return found(2) && label("readout").startsWith("40 HU"); })) << words();
}

TEST_F(ImagingEditsTest, ACutWhereSeveralBonesGrowAsksForTheBone) {
  ImagingPlane& axial = plane("plane_axial");
  const auto [x, y, z] = ball(1);
  double_click(axial, axial.pixel({x - 5, y, z}));
  double_click(axial, axial.pixel({x + 5, y, z}));
  auto& choice = part<QComboBox>("bone_choice");
  ASSERT_EQ(choice.count(), 3);
  click("tool_cut");
  const std::array<int, 3> to_the_right{x - 4, y - 3, z};
  const auto is_cut = [&] {
    const QColor seen = colour(axial, to_the_right);
    return seen.red() > seen.green() + 50 && std::abs(seen.green() - seen.blue()) <= 3;
  };
  drag(axial, {x, y - 8, z}, {x, y + 14, z});
  EXPECT_NE(words().find("Choose the bone"), std::string::npos) << words();
  EXPECT_FALSE(is_cut());
  choice.setCurrentIndex(2);
  drag(axial, {x, y - 8, z}, {x, y + 14, z});
  EXPECT_TRUE(is_cut()) << words();
}

TEST_F(ImagingEditsTest, ABoxOnTwoPlanesLimitsTheSearchAndAClickTakesItAway) {
  ImagingPlane &axial = plane("plane_axial"), &coronal = plane("plane_coronal");
  click("tool_box");
  drag(axial, {31, 4, 12}, {58, 55, 12});
  ASSERT_TRUE(until([&] { return found(1); })) << words();
  // A stroke beside the box counts nowhere, and becomes no edit.
  click("tool_paint");
  drag(axial, {10, 30, 12}, {14, 30, 12});
  EXPECT_NE(words().find("touched nothing in the box"), std::string::npos) << words();
  click("tool_box");
  // Above the ball there is no bone.
  drag(coronal, {31, 30, 20}, {58, 30, 23});
  ASSERT_TRUE(until([&] { return words().find("draw a larger box") != std::string::npos; })) << words();
  EXPECT_FALSE(part<QPushButton>("make_bone").isEnabled());
  click("undo_edit");
  ASSERT_TRUE(until([&] { return found(1); })) << words();
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({40, 30, 12}));
  ASSERT_TRUE(until([&] { return found(2); })) << words();
  click("undo_edit");
  EXPECT_TRUE(until([&] { return found(1); })) << words();
}

TEST_F(ImagingEditsTest, TheKeyboardPaintsAndEscapeTakesAStrokeBack) {
  ImagingPlane& axial = plane("plane_axial");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({29, 20, 12}));
  click("tool_paint");
  auto& radius = part<QDoubleSpinBox>("brush_radius");
  radius.setValue(3.0);
  QWheelEvent wheel(QPointF(40, 40), axial.mapToGlobal(QPoint(40, 40)), {}, {0, 240}, Qt::NoButton, Qt::ControlModifier,
                    Qt::NoScrollPhase, false);
  QApplication::sendEvent(&axial, &wheel);
  EXPECT_EQ(radius.value(), 4.0);
  EXPECT_EQ(axial.slice(), 12) << "with Ctrl the wheel stays in the slice";
  click("tool_look");
  QApplication::sendEvent(&axial, &wheel);
  EXPECT_EQ(radius.value(), 4.0) << "no brush";
  click("tool_paint");
  // 2 voxels of 0.9 mm from the middle: within the brush.
  const std::array<int, 3> beside{27, 18, 12};
  const auto tinted = [&] {
    const QColor seen = colour(axial, beside);
    return std::abs(seen.red() - seen.blue()) > 30;
  };
  EXPECT_FALSE(tinted());
  axial.setFocus();
  QTest::keyClick(&axial, Qt::Key_Space);
  EXPECT_TRUE(tinted()) << "at once";
  QApplication::sendEvent(&axial, &wheel);
  EXPECT_EQ(radius.value(), 5.0);
  EXPECT_TRUE(tinted()) << "a larger brush takes no stroke back";
  radius.setValue(4.0);
  QTest::keyClick(&axial, Qt::Key_Escape);
  EXPECT_FALSE(tinted());
  EXPECT_FALSE(can_undo());
  QTest::keyClick(&axial, Qt::Key_Space);
  QTest::keyClick(&axial, Qt::Key_Down);
  QTest::keyClick(&axial, Qt::Key_Space);
  EXPECT_TRUE(tinted());
  EXPECT_TRUE(can_undo());
  click("undo_edit");
  EXPECT_FALSE(tinted());
  click("redo_edit");
  EXPECT_TRUE(tinted());
  // A ball reaches the next slice, 1.5 mm away, and a disc does not.
  part<QSlider>("slice_axial").setValue(13);
  EXPECT_TRUE(tinted());
  click("undo_edit");
  part<QCheckBox>("brush_flat").setChecked(true);
  part<QSlider>("slice_axial").setValue(12);
  QTest::keyClick(&axial, Qt::Key_Space);
  QTest::keyClick(&axial, Qt::Key_Space);
  EXPECT_TRUE(tinted());
  part<QSlider>("slice_axial").setValue(13);
  EXPECT_FALSE(tinted());
}

TEST_F(ImagingEditsTest, AStrokeOfTheKeyboardEndsWhenItsPlaneLosesTheFocus) {
  ImagingPlane& axial = plane("plane_axial");
  click("tool_paint");
  axial.setFocus();
  QTest::keyClick(&axial, Qt::Key_Space);
  QTest::keyClick(&axial, Qt::Key_Down);
  EXPECT_FALSE(can_undo());
  QFocusEvent leaves(QEvent::FocusOut, Qt::TabFocusReason);
  QApplication::sendEvent(&axial, &leaves);
  EXPECT_TRUE(can_undo());
}

TEST_F(ImagingEditsTest, ACutThatBeginsBesideEveryBoneSaysSo) {
  ImagingPlane& axial = plane("plane_axial");
  click("tool_cut");
  drag(axial, {29, 4, 12}, {29, 50, 12});
  EXPECT_NE(words().find("begins on no kept bone"), std::string::npos) << words();
  EXPECT_FALSE(can_undo());
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({29, 20, 12}));
  EXPECT_NE(words().find("Drag a line"), std::string::npos) << words();
}

// Seeds of one bone merge two islands, and the tint of a bone fades.
TEST_F(ImagingEditsTest, SeedsOfOneBoneMergeAndItsTintFades) {
  ImagingPlane& axial = plane("plane_axial");
  double_click(axial, axial.pixel(ball(1)));
  auto& choice = part<QComboBox>("bone_choice");
  choice.setCurrentIndex(1);
  double_click(axial, axial.pixel(ball(-1)));
  EXPECT_EQ(choice.count(), 2) << "no second bone";
  const auto [x, y, z] = ball(-1);
  const std::array<int, 3> inside{x + 4, y + 3, z};
  const auto strength = [&] {
    const QColor seen = colour(axial, inside);
    return std::max({seen.red(), seen.green(), seen.blue()}) - std::min({seen.red(), seen.green(), seen.blue()});
  };
  EXPECT_GT(strength(), 30);
  part<QSpinBox>("bone_opacity").setValue(0);
  EXPECT_LT(strength(), 3);
  click("undo_edit");
  EXPECT_GT(strength(), 30);
  const auto made = made_twice();
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_NEAR(made->volume_mm3(), 2.0 * test::kBall_mm3, 0.1 * test::kBall_mm3);
  EXPECT_EQ(made->info().labels.size(), 1u);
}

}  // namespace
}  // namespace osteon
