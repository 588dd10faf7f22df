#include "server/import/volume_file.hpp"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kAir_hu = -1024.0;

itk::ImageIOBase::Pointer reader_of(const fs::path& file, VolumeFormat format) {
  itk::ImageIOBase::Pointer io;
  if (format == VolumeFormat::nifti)
    io = itk::NiftiImageIO::New();
  else if (format == VolumeFormat::nrrd)
    io = itk::NrrdImageIO::New();
  else
    io = itk::MetaImageIO::New();
  io->SetFileName(file.string());
  io->ReadImageInformation();
  return io;
}

std::int16_t to_hu(double value) {
  constexpr double least = std::numeric_limits<std::int16_t>::min(), most = std::numeric_limits<std::int16_t>::max();
  return static_cast<std::int16_t>(std::lround(std::isnan(value) ? kAir_hu : std::clamp(value, least, most)));
}

template <class T>
void convert(const char* from, std::span<std::int16_t> to) {
  for (std::int16_t& hu : to) {
    T value;
    std::memcpy(&value, from, sizeof(T));
    hu = to_hu(static_cast<double>(value));
    from += sizeof(T);
  }
}

// Null for a type that is no number.
auto converter(itk::IOComponentEnum type) -> void (*)(const char*, std::span<std::int16_t>) {
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return convert<unsigned char>;
    case itk::IOComponentEnum::CHAR:
      return convert<signed char>;
    case itk::IOComponentEnum::USHORT:
      return convert<unsigned short>;
    case itk::IOComponentEnum::SHORT:
      return convert<short>;
    case itk::IOComponentEnum::UINT:
      return convert<unsigned>;
    case itk::IOComponentEnum::INT:
      return convert<int>;
    case itk::IOComponentEnum::ULONG:
      return convert<unsigned long>;
    case itk::IOComponentEnum::LONG:
      return convert<long>;
    case itk::IOComponentEnum::ULONGLONG:
      return convert<unsigned long long>;
    case itk::IOComponentEnum::LONGLONG:
      return convert<long long>;
    case itk::IOComponentEnum::FLOAT:
      return convert<float>;
    case itk::IOComponentEnum::DOUBLE:
      return convert<double>;
    default:
      return nullptr;
  }
}

tl::unexpected<Error> damaged(const fs::path& file) {
  return bad_input(file.string() + " is truncated or damaged; copy or export it again");
}

}  // namespace

Result<VolumeHeader> read_volume_header(const fs::path& file, VolumeFormat format) try {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  // A dimension of one step is no obstacle.
  for (unsigned d = 3; d < io->GetNumberOfDimensions(); ++d)
    if (io->GetDimensions(d) > 1)
      return failure(ErrorCode::unsupported, file.string() + " has " + std::to_string(io->GetDimensions(d)) +
                                                 " volumes; give a file with one of them");
  if (io->GetNumberOfDimensions() < 3) return bad_input(file.string() + " has one slice; give a scan with several");
  if (io->GetNumberOfComponents() != 1 || converter(io->GetComponentType()) == nullptr)
    return failure(ErrorCode::unsupported,
                   file.string() + " has colours or vectors; give a CT, with one number for each voxel");
  VolumeHeader header;
  header.voxel_bytes = io->GetComponentSize();
  for (unsigned d = 0; d < 3; ++d) {
    header.dims[d] = io->GetDimensions(d);
    header.spacing_mm[d] = io->GetSpacing(d);
    header.origin_mm[d] = io->GetOrigin(d);
    std::ranges::copy_n(io->GetDirection(d).begin(), 3, header.axes[d].begin());
  }
  return header;
} catch (const itk::ExceptionObject& error) {
  // ITK's own sentences name its source files. A person needs to know what is wrong with the file.
  if (std::string_view(error.GetDescription()).find("rtho") != std::string_view::npos)
    return bad_input(file.string() + ": its axes are not at right angles; export it again, or give the DICOM series");
  return damaged(file);
}

Result<void> read_volume_slices(const fs::path& file, VolumeFormat format,
                                const std::function<void(std::span<const std::int16_t>)>& on_slice) try {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  const auto to_slice = converter(io->GetComponentType());
  if (io->GetNumberOfDimensions() < 3 || to_slice == nullptr) return damaged(file);
  itk::ImageIORegion all(io->GetNumberOfDimensions());
  for (unsigned d = 0; d < io->GetNumberOfDimensions(); ++d) all.SetSize(d, io->GetDimensions(d));
  io->SetIORegion(all);
  std::vector<char> voxels(static_cast<std::size_t>(io->GetImageSizeInBytes()));
  io->Read(voxels.data());
  std::vector<std::int16_t> slice(io->GetDimensions(0) * io->GetDimensions(1));
  const std::size_t slice_bytes = slice.size() * io->GetComponentSize();
  for (std::size_t s = 0; s < io->GetDimensions(2); ++s) {
    to_slice(voxels.data() + s * slice_bytes, slice);
    on_slice(slice);
  }
  return {};
} catch (const itk::ExceptionObject&) {
  return damaged(file);
}

}  // namespace osteon::import
