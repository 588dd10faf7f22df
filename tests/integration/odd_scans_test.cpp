// Scans of one slice, and of two thousand, on the page of image processing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <QListWidget>
#include <QPushButton>
#include <QSlider>
#include <QTest>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "tests/integration/imaging_bench.hpp"

namespace osteon {
namespace {

using testing::HasSubstr;

constexpr int kRodPixels = 16, kRodSlices = 2000;
constexpr double kSlice_mm = 0.5, kRod_mm = 5.0;  // radius

// A rod of bone in muscle, through all slices.
imaging::HuVolume long_rod() {
  imaging::HuVolume scan;
  scan.dims = {kRodPixels, kRodPixels, kRodSlices};
  scan.spacing_mm = {1.0, 1.0, kSlice_mm};
  for (int k = 0; k < kRodSlices; ++k)
    for (int j = 0; j < kRodPixels; ++j)
      for (int i = 0; i < kRodPixels; ++i) {
        const double from_axis_mm = std::hypot(i - 0.5 * (kRodPixels - 1), j - 0.5 * (kRodPixels - 1));
        scan.values.push_back(from_axis_mm <= kRod_mm ? test::kBall_hu : test::kMuscle_hu);
      }
  return scan;
}

class OddScans : public test::ImagingBench {
 protected:
  void open_source(const std::filesystem::path& source) {
    window_->process_images(QString::fromStdString(source.string()));
    ASSERT_TRUE(until([&] { return !part<QPushButton>("imaging_cancel").isVisible(); })) << words();
  }
};

TEST_F(OddScans, TwoThousandSlicesAreReadToTheLast) {
  open_source(series("long", long_rod()));
  auto& list = part<QListWidget>("series");
  ASSERT_EQ(list.count(), 1) << words();
  EXPECT_THAT(list.item(0)->text().toStdString(), HasSubstr("2000 slices"));
  QTest::mouseClick(list.viewport(), Qt::LeftButton, {}, list.visualItemRect(list.item(0)).center());
  auto& parts = part<QListWidget>("islands");
  ASSERT_TRUE(until([&] { return parts.isEnabled() && parts.count() == 1; })) << words();
  // Voxels whose middle is in the rod.
  const double area_mm2 = std::numbers::pi * kRod_mm * kRod_mm;
  const std::string volume = parts.item(0)->text().section(", ", 1, 1).section(' ', 0, 0).toStdString();
  EXPECT_NEAR(std::stod(volume), 1e-3 * area_mm2 * kRodSlices * kSlice_mm, 0.05 * area_mm2);
  auto& slider = part<QSlider>("slice_axial");
  EXPECT_EQ(slider.maximum(), kRodSlices - 1);
  slider.setValue(kRodSlices - 1);
  ImagingPlane& axial = plane("plane_axial");
  QTest::mouseClick(&axial, Qt::LeftButton, {}, axial.pixel({kRodPixels / 2, kRodPixels / 2, kRodSlices - 1}));
  EXPECT_TRUE(label("readout").startsWith("1000 HU")) << label("readout").toStdString();
}

TEST_F(OddScans, AFileOfOneSliceIsRefusedWithOneSentence) {
  const std::filesystem::path file = desk_->temp() / "one.nrrd";
  std::ofstream(file) << "NRRD0004\ntype: short\ndimension: 2\nsizes: 4 4\nencoding: ascii\n\n" << std::string(32, '0');
  open_source(file);
  EXPECT_THAT(words(), HasSubstr("one.nrrd has one slice; give a scan with several"));
  EXPECT_EQ(words().find('\n'), std::string::npos) << words();
}

}  // namespace
}  // namespace osteon
