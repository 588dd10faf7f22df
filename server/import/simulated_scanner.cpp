#include "server/import/simulated_scanner.hpp"

#include <gdcmReader.h>
#include <gdcmWriter.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include "common/imaging/hu_volume.hpp"
#include "server/import/dicom_writer.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr int kPartsOfSlice = 5;  // at which the mean over its thickness is taken
constexpr double kScanningEnd = 0.7;

// DICOM has 16 characters for a number.
std::string decimal_text(double value) {
  char text[20];
  std::snprintf(text, sizeof text, "%.9f", value);
  text[16] = '\0';
  return text;
}

Result<void> move_slice(const fs::path& file, const Vec3& position_mm) {
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.Read()) return failure(ErrorCode::internal, "cannot read " + file.string() + " again");
  std::string value =
      decimal_text(position_mm.x()) + "\\" + decimal_text(position_mm.y()) + "\\" + decimal_text(position_mm.z());
  if (value.size() % 2 != 0) value += ' ';
  gdcm::DataElement element(gdcm::Tag(0x0020, 0x0032));
  element.SetVR(gdcm::VR::DS);
  element.SetByteValue(value.data(), static_cast<std::uint32_t>(value.size()));
  reader.GetFile().GetDataSet().Replace(element);
  gdcm::Writer writer;
  writer.SetFile(reader.GetFile());
  return write_dicom(writer, file);
}

// The first pixels of the slices. The table moves along z, also if the gantry is tilted.
std::vector<Vec3> positions_of(const ScannerSettings& settings, const imaging::HuVolume& grid) {
  const Vec3 normal = grid.directions.col(2);
  const Vec3 corner =
      settings.centre_mm -
      0.5 * grid.directions * Vec3((grid.dims[0] - 1) * settings.pixel_mm, (grid.dims[1] - 1) * settings.pixel_mm, 0.0);
  double length_mm = 0.0;
  for (const double gap_mm : settings.gaps_mm) length_mm += gap_mm;
  std::vector<Vec3> positions;
  double along_mm = -0.5 * length_mm;
  for (std::size_t i = 0; i <= settings.gaps_mm.size(); ++i) {
    positions.emplace_back(corner + Vec3::UnitZ() * along_mm / normal.z());
    if (i < settings.gaps_mm.size()) along_mm += settings.gaps_mm[i];
  }
  return positions;
}

}  // namespace

double blurred_step(double inside_mm, double sigma_mm) {
  if (sigma_mm <= 0.0) return inside_mm > 0.0 ? 1.0 : inside_mm < 0.0 ? 0.0 : 0.5;
  return 0.5 * std::erfc(-inside_mm / (sigma_mm * std::numbers::sqrt2));
}

Result<void> write_simulated_scan(const ScannerSettings& settings, const BlurredHu& hu, const fs::path& folder,
                                  const KeepGoing& keep_going) {
  imaging::HuVolume grid;
  const auto pixels = [&](double size_mm) { return static_cast<int>(std::ceil(size_mm / settings.pixel_mm)); };
  grid.dims = {pixels(settings.width_mm), pixels(settings.height_mm), static_cast<int>(settings.gaps_mm.size()) + 1};
  grid.spacing_mm = {settings.pixel_mm, settings.pixel_mm, 1.0};
  grid.directions =
      Eigen::AngleAxisd(-settings.tilt_degrees * std::numbers::pi / 180.0, Vec3::UnitX()).toRotationMatrix();
  const std::vector<Vec3> positions = positions_of(settings, grid);
  std::mt19937 random(settings.seed);
  std::normal_distribution<double> noise(0.0, settings.noise_hu);
  for (std::size_t slice = 0; slice < positions.size(); ++slice) {
    if (!keep_going(kScanningEnd * static_cast<double>(slice) / static_cast<double>(positions.size())))
      return stopped_while("scanning the phantom");
    for (int row = 0; row < grid.dims[1]; ++row)
      for (int column = 0; column < grid.dims[0]; ++column) {
        const Vec3 at = positions[slice] + settings.pixel_mm * grid.directions * Vec3(column, row, 0.0);
        double sum = 0.0;
        for (int i = 0; i < kPartsOfSlice; ++i)
          sum += hu(at + settings.thickness_mm * ((i + 0.5) / kPartsOfSlice - 0.5) * grid.directions.col(2));
        grid.values.push_back(static_cast<std::int16_t>(std::lround(sum / kPartsOfSlice + noise(random))));
      }
  }
  if (auto written = write_dicom_series(grid, folder, part(keep_going, kScanningEnd, 1.0)); !written) return written;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  for (std::size_t i = 0; i < files.size(); ++i)
    if (auto moved = move_slice(files[i], positions[i]); !moved) {
      std::error_code ignored;
      fs::remove_all(folder, ignored);
      return moved;
    }
  return {};
}

}  // namespace osteon::import
