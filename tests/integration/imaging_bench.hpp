// The page of image processing on the bench of a window, with a scan of two balls.
#pragma once
#include <QApplication>
#include <QFileDialog>
#include <QListWidget>
#include <QSettings>
#include <QSlider>
#include <QTimer>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>

#include "server/import/dicom_writer.hpp"
#include "tests/integration/two_balls.hpp"
#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/imaging_plane.hpp"
#include "viewer_client/desktop/language.hpp"

namespace osteon::test {

// Chooses a folder in the next dialog, as two clicks do.
class FolderChooser : public QObject {
 public:
  explicit FolderChooser(QString folder) : folder_(std::move(folder)) {
    connect(&timer_, &QTimer::timeout, this, [this] {
      auto* dialog = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
      if (dialog == nullptr) return;
      timer_.stop();
      dialog->setDirectory(folder_);  // selectFile() does nothing while the line of the name has the focus
      QMetaObject::invokeMethod(dialog, "accept", Qt::QueuedConnection);
    });
    timer_.start(20);
  }

 private:
  QString folder_;
  QTimer timer_;
};

class ImagingBench : public WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    speak("en");
    WindowBench::SetUp();
  }
  // A folder of DICOM files, written once for each name.
  [[nodiscard]] static std::filesystem::path series(const std::string& name, const imaging::HuVolume& scan) {
    std::filesystem::path folder = desk_->temp() / name;
    if (!std::filesystem::exists(folder)) {
      const auto written = import::write_dicom_series(scan, folder, [](double) { return true; });
      EXPECT_TRUE(written) << written.error().message;
    }
    return folder;
  }
  [[nodiscard]] QListWidget& islands() const { return part<QListWidget>("islands"); }
  // Opens the two balls, and waits for their parts. The axial plane goes through both.
  void open_two_balls() {
    window_->process_images(QString::fromStdString(series("balls", two_balls()).string()));
    auto& list = part<QListWidget>("series");
    ASSERT_TRUE(until([&] { return list.isVisible() && list.count() == 1; })) << words();
    QTest::mouseClick(list.viewport(), Qt::LeftButton, {}, list.visualItemRect(list.item(0)).center());
    ASSERT_TRUE(until([&] { return islands().isVisible() && islands().isEnabled() && islands().count() == 2; }))
        << words();
    part<QSlider>("slice_axial").setValue(12);
  }
  [[nodiscard]] ImagingPlane& plane(const char* name) const {
    auto* found = dynamic_cast<ImagingPlane*>(window_->findChild<QWidget*>(name));
    if (found == nullptr) ADD_FAILURE() << name;
    return *found;
  }
  [[nodiscard]] std::string words() const { return label("imaging_words").toStdString(); }
  // The middle voxel of the ball on the patient's left (1) or right (-1).
  [[nodiscard]] static std::array<int, 3> ball(int side) {
    const Vec3 voxel = two_balls().voxel(Vec3(side * kApart_mm, 0, 0));
    return {static_cast<int>(std::lround(voxel.x())), static_cast<int>(std::lround(voxel.y())), 12};
  }
};

}  // namespace osteon::test
