// Sub-volumes on the page of image processing, with the mouse and the keyboard: they are those of a bone of known
// boxes, and the files are those of osteon-import.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <QCoreApplication>
#include <QDialog>
#include <QLabel>
#include <QListWidget>
#include <QLocale>
#include <QPushButton>
#include <QSlider>
#include <QSpinBox>
#include <QTest>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "common/runtime/files.hpp"
#include "tests/integration/full_disk.hpp"
#include "tests/integration/imaging_bench.hpp"
#include "tests/support/content.hpp"
#include "tests/support/process.hpp"
#include "tests/support/wait.hpp"
#include "viewer_client/desktop/imaging_solid.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr CoordBox kFootOfBone{{8, 6, 2}, {27, 25, 7}}, kNotchInFoot{{18, 16, 2}, {27, 25, 7}},
    kShaftOfBone{{8, 6, 8}, {13, 11, 21}}, kBlockBeside{{34, 30, 12}, {36, 32, 14}};

// A foot with a notch and a shaft on it, and a small block beside them, in muscle.
imaging::HuVolume foot_and_shaft() {
  imaging::HuVolume scan;
  scan.dims = {40, 36, 24};
  scan.spacing_mm = {0.9, 0.9, 1.5};
  for (int k = 0; k < scan.dims[2]; ++k)
    for (int j = 0; j < scan.dims[1]; ++j)
      for (int i = 0; i < scan.dims[0]; ++i) {
        const Coord at{i, j, k};
        const bool bone = (kFootOfBone.contains(at) && !kNotchInFoot.contains(at)) || kShaftOfBone.contains(at) ||
                          kBlockBeside.contains(at);
        scan.values.push_back(bone ? test::kBall_hu : test::kMuscle_hu);
      }
  return scan;
}

class ImagingBoxesTest : public test::ImagingBench {
 protected:
  // The foot with the shaft is kept, and the dialog is open.
  void SetUp() override {
    ImagingBench::SetUp();
    folder_ = series("foot", foot_and_shaft());
    window_->process_images(QString::fromStdString(folder_.string()));
    auto& list = part<QListWidget>("series");
    ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
    QTest::mouseClick(list.viewport(), Qt::LeftButton, {}, list.visualItemRect(list.item(0)).center());
    auto& islands = part<QListWidget>("islands");
    ASSERT_TRUE(until([&] { return islands.isVisible() && islands.isEnabled() && islands.count() == 2; })) << words();
    keep({10, 8, 4});
    QTest::keySequence(window_.get(), QKeySequence("Ctrl+Alt+B"));
    ASSERT_TRUE(until([&] { return says("Section boxes: 2,"); })) << said();
  }
  void keep(const std::array<int, 3>& voxel) {
    part<QSlider>("slice_axial").setValue(voxel[2]);
    ImagingPlane& axial = plane("plane_axial");
    double_click(axial, axial.pixel(voxel));
  }
  [[nodiscard]] std::string said() const { return label("sub_volumes_words").toStdString() + "; " + words(); }
  [[nodiscard]] bool says(const QString& text) const { return label("sub_volumes_words").contains(text); }
  [[nodiscard]] QListWidget& sections() const { return part<QListWidget>("sections"); }
  // The colour of the line between two neighbours in a plane; black, if there is no line of a section. Dashes of the
  // bounding box may lie on it.
  [[nodiscard]] QColor line_between(const std::array<int, 3>& a, const std::array<int, 3>& b,
                                    const char* name = "plane_axial") const {
    ImagingPlane& of = plane(name);
    const QImage image = of.grab().toImage();
    const QPoint from = of.pixel(a), to = of.pixel(b), middle = (from + to) / 2;
    const bool upright = std::abs(to.x() - from.x()) > std::abs(to.y() - from.y());
    for (int across = -2; across <= 2; ++across)
      for (int along = -4; along <= 4; ++along) {
        QColor colour = image.pixelColor(middle + (upright ? QPoint(across, along) : QPoint(along, across)));
        for (const auto& [red, green, blue] : {kSectionColour, kChosenColour})
          if (colour == QColor(red, green, blue)) return colour;
      }
    return Qt::black;
  }
  // The chosen section in three dimensions: how many pixels have its colour, and the highest of their rows.
  struct Orange {
    int pixels = 0, top = 0;
  };
  [[nodiscard]] Orange orange() const {
    auto& solid = dynamic_cast<ImagingSolid&>(part<QWidget>("solid"));
    const Image image = solid.view().scene().image();
    Orange seen;
    for (int y = 0; y < image.height_px; ++y)
      for (int x = 0; x < image.width_px; ++x) {
        const auto c = image.at(x, y);
        if (c[0] <= 210 || c[1] <= 140 || c[1] >= 180 || c[2] >= 30) continue;
        if (seen.pixels == 0) seen.top = y;
        ++seen.pixels;
      }
    return seen;
  }
  void write(const fs::path& to) {
    const test::FolderChooser chooser(QString::fromStdString(to.string()));
    QTest::mouseClick(&part<QPushButton>("write_sub_volumes"), Qt::LeftButton);
  }
  // The one that writes. 0: there is none in time.
  [[nodiscard]] static pid_t wait_for_importer() {
    std::vector<pid_t> importers;
    const bool in_time = test::wait_until(
        [&] {
          QCoreApplication::processEvents();
          importers = test::children("osteon-import");
          return !importers.empty();
        },
        30s);
    return in_time ? importers.front() : 0;
  }
  void keep_picture(const char* name) const {
    const char* folder = std::getenv("OSTEON_TEST_PICTURES");
    if (folder == nullptr) return;
    window_->grab().save(QString("%1/%2.png").arg(folder, name));
    part<QDialog>("sub_volumes").grab().save(QString("%1/%2_dialog.png").arg(folder, name));
  }
  fs::path folder_;
};

constexpr QColor kOrange{kChosenColour[0], kChosenColour[1], kChosenColour[2]},
    kBlue{kSectionColour[0], kSectionColour[1], kSectionColour[2]};

TEST_F(ImagingBoxesTest, AreThoseOfAKnownBoneAndFollowIt) {
  const auto count = [](int voxels) { return QLocale().toString(voxels); };
  EXPECT_TRUE(says("20 × 20 × 20, " + count(8000) + " voxels, 23.15 %")) << said();
  EXPECT_TRUE(says("Section boxes: 2, " + count(20 * 20 * 6 + 6 * 6 * 14) + " voxels, 8.40 %")) << said();
  // The quadrant of the foot with the notch is empty.
  EXPECT_TRUE(says("Leaves: 4, of which 4 are full and 0 partly full")) << said();
  auto& subdivisions = part<QSpinBox>("subdivisions");
  EXPECT_EQ(subdivisions.value(), 3);
  subdivisions.setFocus();
  for (int i = 0; i < 3; ++i) QTest::keyClick(&subdivisions, Qt::Key_Down);
  ASSERT_TRUE(until([&] { return says("Leaves: 2, of which 1 are full and 1 partly full"); })) << said();

  // The crosshair is in the foot, which is chosen. Another section is chosen in the list.
  ImagingPlane &axial = plane("plane_axial"), &coronal = plane("plane_coronal"), &sagittal = plane("plane_sagittal");
  ASSERT_EQ(sections().count(), 2);
  EXPECT_EQ(sections().currentRow(), 0);
  EXPECT_EQ(line_between({27, 20, 4}, {28, 20, 4}), kOrange);
  EXPECT_EQ(line_between({10, 20, 7}, {10, 20, 8}, "plane_sagittal"), kOrange);
  EXPECT_EQ(line_between({27, 8, 4}, {28, 8, 4}, "plane_coronal"), kOrange);
  ASSERT_TRUE(until([&] { return orange().pixels > 40; }));
  const int top_of_foot = orange().top;
  QTest::mouseClick(sections().viewport(), Qt::LeftButton, {}, sections().visualItemRect(sections().item(1)).center());
  EXPECT_EQ(sections().currentRow(), 1);
  EXPECT_TRUE(kShaftOfBone.contains({sagittal.slice(), coronal.slice(), axial.slice()}));
  EXPECT_EQ(line_between({13, 10, 14}, {14, 10, 14}), kOrange);
  EXPECT_EQ(line_between({27, 20, 14}, {28, 20, 14}), QColor(Qt::black)) << "a box of other slices";
  // The shaft is above the foot.
  EXPECT_TRUE(until([&] { return orange().pixels > 40 && orange().top < top_of_foot - 40; })) << orange().top;
  keep_picture("boxes_shaft");
  sections().setFocus();
  QTest::keyClick(&sections(), Qt::Key_Up);
  EXPECT_TRUE(kFootOfBone.contains({sagittal.slice(), coronal.slice(), axial.slice()}));
  // Beside all sections, none is chosen.
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({35, 31, axial.slice()}));
  EXPECT_EQ(sections().currentRow(), -1);
  EXPECT_EQ(line_between({27, 20, 4}, {28, 20, 4}), kBlue);
  EXPECT_TRUE(until([&] { return orange().pixels == 0; })) << orange().pixels;
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({10, 20, axial.slice()}));
  EXPECT_EQ(sections().currentRow(), 0);

  // With the block, slices 12 to 14 get a section of their own, and those below and above it too.
  keep({35, 31, 13});
  EXPECT_FALSE(says("Section boxes: 2,")) << "of what was kept before";
  ASSERT_TRUE(until([&] { return says("Section boxes: 4,"); })) << said();
  EXPECT_EQ(sections().count(), 4);
  QTest::keySequence(&sections(), QKeySequence::Undo);
  ASSERT_TRUE(until([&] { return says("Section boxes: 2,"); })) << said();
  // A spin box has keys of its own for these.
  QTest::keySequence(&subdivisions, QKeySequence::Redo);
  ASSERT_TRUE(until([&] { return says("Section boxes: 4,"); })) << said();
  QTest::keySequence(&subdivisions, QKeySequence::Undo);
  ASSERT_TRUE(until([&] { return says("Section boxes: 2,"); })) << said();

  // With another threshold, the old boxes go at once.
  part<QSpinBox>("threshold").setValue(300);
  EXPECT_TRUE(says("The parts of bone are not known yet.")) << said();
  EXPECT_EQ(sections().count(), 0);
  ASSERT_TRUE(until([&] { return says("Section boxes: 2,"); })) << said();

  // Closed, it shows nothing.
  part<QSlider>("slice_axial").setValue(4);
  part<QDialog>("sub_volumes").close();
  EXPECT_EQ(line_between({27, 20, 4}, {28, 20, 4}), QColor(Qt::black));
  EXPECT_TRUE(until([&] { return orange().pixels == 0; })) << orange().pixels;
}

// An edit would cancel the files, and Escape does, as the button. The dialog stays, which says so.
TEST_F(ImagingBoxesTest, WhileItWritesNothingElseEndsIt) {
  const fs::path to = desk_->temp() / "ended";
  fs::create_directories(to);
  const fs::path scratch = cases_folder() / (".partial-imaging-" + std::to_string(QCoreApplication::applicationPid()));
  const auto enabled = [&] {
    int count = 0;
    for (const char* name : {"undo_edit", "threshold", "filter", "close_sub_volumes"})
      count += part<QWidget>(name).isEnabled() ? 1 : 0;
    return count;
  };
  auto& dialog = part<QDialog>("sub_volumes");
  auto& button = part<QPushButton>("cancel_sub_volumes");
  for (const bool by_key : {true, false}) {
    EXPECT_EQ(enabled(), 4);
    write(to);
    EXPECT_EQ(label("sub_volumes_work").toStdString(), "Writing the root sub-volumes");
    EXPECT_EQ(enabled(), 0);
    by_key ? QTest::keyClick(&dialog, Qt::Key_Escape) : QTest::mouseClick(&button, Qt::LeftButton);
    EXPECT_TRUE(dialog.isVisible());
    ASSERT_TRUE(until([&] { return words() == "Cancelled. Nothing was written."; })) << words();
    EXPECT_EQ(label("sub_volumes_work").toStdString(), words());
    EXPECT_TRUE(dialog.isVisible());
    EXPECT_FALSE(button.isVisible());
    EXPECT_FALSE(fs::exists(scratch / "kept.nrrd"));
    EXPECT_TRUE(fs::is_empty(to));
  }
  QTest::keyClick(&dialog, Qt::Key_Escape);
  EXPECT_FALSE(dialog.isVisible());
}

// It stands still, so the window that closes kills it.
TEST_F(ImagingBoxesTest, AKilledImporterLeavesNoPartOfTheFiles) {
  const fs::path to = desk_->temp() / "killed";
  fs::create_directories(to);
  write(to);
  const pid_t importer = wait_for_importer();
  ASSERT_NE(importer, 0);
  ASSERT_EQ(::kill(importer, SIGSTOP), 0);
  fs::create_directories(to / ("sub-volumes.partial-" + std::to_string(importer)));
  fs::create_directories(to / ("sub-volumes.partial-" + std::to_string(::getpid())));
  window_.reset();
  EXPECT_EQ(test::names_in(to), (std::set<std::string>{"sub-volumes.partial-" + std::to_string(::getpid())}))
      << "that of another program that lives stays";
}

TEST_F(ImagingBoxesTest, TheFilesAreThoseOfTheImporter) {
  const fs::path to = desk_->temp() / "files";
  fs::create_directories(to);
  // Cancelled after osteon-import has ended, and before the window knows it.
  write(to);
  const pid_t importer = wait_for_importer();
  ASSERT_NE(importer, 0);
  const std::string program = "/proc/" + std::to_string(importer) + "/exe";  // goes when the process ends
  std::error_code ignored;
  ASSERT_TRUE(test::wait_until([&] { return !fs::exists(program, ignored); }, 60s));
  EXPECT_TRUE(fs::exists(to / "sub-volumes"));
  QTest::mouseClick(&part<QPushButton>("imaging_cancel"), Qt::LeftButton);
  ASSERT_TRUE(until([&] { return words() == "Cancelled. Nothing was written."; })) << words();
  EXPECT_TRUE(fs::is_empty(to));

  // A full disk is one sentence, and leaves nothing. There is room again at the next try.
  {
    const test::FullDisk disk(to.string(), desk_->temp() / "full");
    disk.fill();
    write(to);
    ASSERT_TRUE(until([&] { return words().find("No space left on device") != std::string::npos; })) << words();
    EXPECT_THAT(words(),
                testing::AllOf(testing::HasSubstr(to.string()), testing::HasSubstr("make room on the disk"),
                               testing::Not(testing::HasSubstr(".partial")), testing::Not(testing::HasSubstr("\n"))));
    EXPECT_EQ(label("sub_volumes_work").toStdString(), words());
    EXPECT_TRUE(fs::is_empty(to));
  }
  write(to);
  ASSERT_TRUE(until([&] { return words() == "The root sub-volumes are in " + (to / "sub-volumes").string() + "."; }))
      << words();
  EXPECT_EQ(label("sub_volumes_work").toStdString(), words());

  // Of the scan, that takes the largest bone. It is the one that is kept.
  const fs::path again = desk_->temp() / "files-again";
  const auto run = test::run(test::program("osteon-import"), {"report", folder_.string(), "--out", again.string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"Meta.dat", "SBB1.dat", "SBB2.dat"}) {
    const auto of_window = read_file(to / "sub-volumes" / name), of_importer = read_file(again / name);
    ASSERT_TRUE(of_window) << of_window.error().message;
    ASSERT_TRUE(of_importer) << of_importer.error().message;
    EXPECT_EQ(*of_window, *of_importer) << name;
  }
  EXPECT_NE(read_file(to / "sub-volumes" / "SBB1.dat")->find("DIMENSIONS 20 20 6\nSPACING 0.9 0.9 1.5\n"),
            std::string::npos);
  const std::string shaft = *read_file(to / "sub-volumes" / "SBB2.dat");
  EXPECT_NE(shaft.find("DIMENSIONS 6 6 14\n"), std::string::npos);
  EXPECT_NE(shaft.find("DATA NUMBER 504\n"), std::string::npos);
  for (const char* name : {"SBB3.dat", "report.txt", "report.json", "boxes.png"})
    EXPECT_EQ(fs::exists(to / "sub-volumes" / name), name != std::string("SBB3.dat")) << name;

  // With the block that osteon-import leaves out.
  keep({35, 31, 13});
  ASSERT_TRUE(until([&] { return says("Section boxes: 4,"); })) << said();
  write(to);
  ASSERT_TRUE(until([&] { return words().ends_with("sub-volumes-2."); })) << words();
  EXPECT_TRUE(fs::exists(to / "sub-volumes-2" / "SBB4.dat"));
  EXPECT_NE(read_file(to / "sub-volumes-2" / "SBB3.dat")->find("DIMENSIONS 29 27 3\n"), std::string::npos);
}

}  // namespace
}  // namespace osteon
