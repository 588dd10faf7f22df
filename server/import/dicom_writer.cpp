#include "server/import/dicom_writer.hpp"

#include <gdcmAnonymizer.h>
#include <gdcmImageWriter.h>
#include <gdcmTrace.h>
#include <gdcmUIDGenerator.h>

#include <cstdio>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "common/runtime/files.hpp"
#include "common/runtime/new_folder.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

// Stored values begin here, as scanners do it, so that rescaling is really used.
constexpr int kIntercept_hu = -1024;

struct Uids {
  std::string study, series, frame;
};

Result<void> write_slice(const imaging::HuVolume& volume, int slice, const Uids& uids, const fs::path& file) {
  const std::size_t pixels = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  std::vector<std::int16_t> stored(pixels);
  for (std::size_t i = 0; i < pixels; ++i)
    stored[i] = static_cast<std::int16_t>(volume.values[static_cast<std::size_t>(slice) * pixels + i] - kIntercept_hu);

  gdcm::ImageWriter writer;
  gdcm::Image& image = writer.GetImage();
  const unsigned int dims[2] = {static_cast<unsigned int>(volume.dims[0]), static_cast<unsigned int>(volume.dims[1])};
  image.SetNumberOfDimensions(2);
  image.SetDimensions(dims);
  image.SetPixelFormat(gdcm::PixelFormat(gdcm::PixelFormat::INT16));
  image.SetPhotometricInterpretation(gdcm::PhotometricInterpretation::MONOCHROME2);
  image.SetTransferSyntax(gdcm::TransferSyntax::ExplicitVRLittleEndian);
  image.SetSpacing(0, volume.spacing_mm.x());
  image.SetSpacing(1, volume.spacing_mm.y());
  const Vec3 origin = volume.position_mm(Vec3(0, 0, slice));
  for (unsigned int i = 0; i < 3; ++i) image.SetOrigin(i, origin[i]);
  image.SetDirectionCosines(volume.directions.data());  // by columns: along a row, then down the rows
  image.SetIntercept(kIntercept_hu);
  image.SetSlope(1.0);
  gdcm::DataElement data(gdcm::Tag(0x7fe0, 0x0010));
  data.SetByteValue(reinterpret_cast<const char*>(stored.data()),
                    static_cast<std::uint32_t>(stored.size() * sizeof stored[0]));
  image.SetDataElement(data);

  gdcm::Anonymizer tags;  // sets attributes by tag; there is nobody to anonymise
  tags.SetFile(writer.GetFile());
  const auto set = [&](std::uint16_t group, std::uint16_t element, const std::string& value) {
    tags.Replace(gdcm::Tag(group, element), value.c_str());
  };
  set(0x0008, 0x0008, "DERIVED\\SECONDARY\\AXIAL");
  set(0x0008, 0x0016, "1.2.840.10008.5.1.4.1.1.2");
  set(0x0008, 0x0060, "CT");
  set(0x0008, 0x0070, "Osteon");
  set(0x0010, 0x0010, "Phantom");
  set(0x0010, 0x0020, "");
  set(0x0018, 0x0050, std::to_string(volume.spacing_mm.z()));
  set(0x0020, 0x000d, uids.study);
  set(0x0020, 0x000e, uids.series);
  set(0x0020, 0x0052, uids.frame);
  set(0x0020, 0x0011, "1");
  set(0x0020, 0x0013, std::to_string(slice + 1));
  return write_dicom(writer, file);
}

Result<void> write_slices(const imaging::HuVolume& volume, const fs::path& folder, const KeepGoing& keep_going) try {
  gdcm::UIDGenerator generator;
  Uids uids;
  uids.study = generator.Generate();
  uids.series = generator.Generate();
  uids.frame = generator.Generate();
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("writing " + folder.string());
    char name[32];
    std::snprintf(name, sizeof name, "slice-%04d.dcm", slice + 1);
    if (auto written = write_slice(volume, slice, uids, folder / name); !written) return written;
  }
  return {};
} catch (const std::exception& error) {
  return failure(ErrorCode::internal, "cannot write " + folder.string() + ": " + error.what());
}

}  // namespace

Result<void> write_dicom(gdcm::Writer& writer, const fs::path& file) {
  std::ostringstream bytes;
  writer.SetStream(bytes);
  if (!writer.Write()) return failure(ErrorCode::internal, "cannot make the slice " + file.string());
  auto written = write_file(file, bytes.str());
  if (!written) written.error().message += "; make room on the disk or choose another place";
  return written;
}

Result<void> write_dicom_series(const imaging::HuVolume& volume, const fs::path& folder, const KeepGoing& keep_going) {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  return write_new_folder(folder, [&](const fs::path& partial) { return write_slices(volume, partial, keep_going); });
}

}  // namespace osteon::import
