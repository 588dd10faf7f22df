#include "server/import/volume_file.hpp"

#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <nifti1_io.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/imaging/hu_volume.hpp"
#include "server/import/series_report.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr double kMostLabel = 65535.0;

itk::ImageIOBase::Pointer format_of(VolumeFormat format) {
  itk::ImageIOBase::Pointer io;
  if (format == VolumeFormat::nifti)
    io = itk::NiftiImageIO::New();
  else if (format == VolumeFormat::nrrd)
    io = itk::NrrdImageIO::New();
  else
    io = itk::MetaImageIO::New();
  return io;
}

itk::ImageIOBase::Pointer reader_of(const fs::path& file, VolumeFormat format) {
  itk::ImageIOBase::Pointer io = format_of(format);
  io->SetFileName(file.string());
  io->ReadImageInformation();
  return io;
}

// Null for a number that is not finite.
std::optional<std::int16_t> to_hu(double value) {
  if (!std::isfinite(value)) return std::nullopt;
  return imaging::nearest_hu(value);
}

template <class T>
T number_at(const char* bytes, std::size_t i) {
  T value;
  std::memcpy(&value, bytes + i * sizeof(T), sizeof(T));
  return value;
}

// Of voxels of one type.
struct Converter {
  // Gives how many numbers are not finite; these become kPadding_hu.
  std::uint32_t (*to_hu)(const char* from, std::span<std::int16_t> to);
  // The first number that is no label, if there is one.
  std::optional<double> (*to_labels)(const char* from, std::span<std::uint16_t> to);
};

template <class T>
constexpr Converter kConverter{[](const char* from, std::span<std::int16_t> to) {
                                 std::uint32_t without_number = 0;
                                 for (std::size_t i = 0; i < to.size(); ++i) {
                                   const auto hu = to_hu(static_cast<double>(number_at<T>(from, i)));
                                   without_number += hu ? 0 : 1;
                                   to[i] = hu.value_or(kPadding_hu);
                                 }
                                 return without_number;
                               },
                               [](const char* from, std::span<std::uint16_t> to) -> std::optional<double> {
                                 for (std::size_t i = 0; i < to.size(); ++i) {
                                   const auto value = static_cast<double>(number_at<T>(from, i));
                                   if (!(value >= 0.0 && value <= kMostLabel) || value != std::floor(value))
                                     return value;
                                   to[i] = static_cast<std::uint16_t>(value);
                                 }
                                 return std::nullopt;
                               }};

// Null for a type that is no number.
const Converter* converter(itk::IOComponentEnum type) {
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return &kConverter<unsigned char>;
    case itk::IOComponentEnum::CHAR:
      return &kConverter<signed char>;
    case itk::IOComponentEnum::USHORT:
      return &kConverter<unsigned short>;
    case itk::IOComponentEnum::SHORT:
      return &kConverter<short>;
    case itk::IOComponentEnum::UINT:
      return &kConverter<unsigned>;
    case itk::IOComponentEnum::INT:
      return &kConverter<int>;
    case itk::IOComponentEnum::ULONG:
      return &kConverter<unsigned long>;
    case itk::IOComponentEnum::LONG:
      return &kConverter<long>;
    case itk::IOComponentEnum::ULONGLONG:
      return &kConverter<unsigned long long>;
    case itk::IOComponentEnum::LONGLONG:
      return &kConverter<long long>;
    case itk::IOComponentEnum::FLOAT:
      return &kConverter<float>;
    case itk::IOComponentEnum::DOUBLE:
      return &kConverter<double>;
    default:
      return nullptr;
  }
}

template <class T>
std::vector<bool> not_finite(const nifti_image& image) {
  std::vector<bool> found(image.nvox);
  for (std::size_t i = 0; i < found.size(); ++i)
    found[i] = !std::isfinite(number_at<T>(static_cast<const char*>(image.data), i));
  return found;
}

// Which voxels are NaN or infinite. The library of NIfTI, and so ITK, replaces them by 0, but only in numbers with a
// fraction: as whole numbers of the same size they keep their bits. Empty: none is, or ITK will say what is wrong.
std::vector<bool> not_finite_in_nifti(const fs::path& file) {
  const std::unique_ptr<nifti_image, decltype(&nifti_image_free)> image(nifti_image_read(file.c_str(), 0),
                                                                        nifti_image_free);
  if (!image || (image->datatype != DT_FLOAT32 && image->datatype != DT_FLOAT64)) return {};
  const bool single = image->datatype == DT_FLOAT32;
  image->datatype = single ? DT_UINT32 : DT_UINT64;
  if (nifti_image_load(image.get()) != 0) return {};
  return single ? not_finite<float>(*image) : not_finite<double>(*image);
}

tl::unexpected<Error> damaged(const fs::path& file) {
  return bad_input(file.string() + " is truncated or damaged; copy or export it again");
}

// Calls `on_slice` with the bytes of each slice, until it fails.
Result<void> read_slices(const fs::path& file, VolumeFormat format,
                         const std::function<Result<void>(const Converter&, const char* bytes)>& on_slice) {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  const Converter* convert = converter(io->GetComponentType());
  if (io->GetNumberOfDimensions() < 3 || convert == nullptr) return damaged(file);
  itk::ImageIORegion all(io->GetNumberOfDimensions());
  for (unsigned d = 0; d < io->GetNumberOfDimensions(); ++d) all.SetSize(d, io->GetDimensions(d));
  io->SetIORegion(all);
  std::vector<char> voxels(static_cast<std::size_t>(io->GetImageSizeInBytes()));
  io->Read(voxels.data());
  const std::size_t slice_bytes =
      io->GetDimensions(0) * io->GetDimensions(1) * io->GetNumberOfComponents() * io->GetComponentSize();
  for (std::size_t s = 0; s < io->GetDimensions(2); ++s)
    if (auto taken = on_slice(*convert, voxels.data() + s * slice_bytes); !taken) return taken;
  return {};
}

// Numbers of a slice.
std::size_t slice_numbers(const fs::path& file, VolumeFormat format) {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  return io->GetDimensions(0) * io->GetDimensions(1) * io->GetNumberOfComponents();
}

// Writes voxels of one type, columns fastest.
Result<void> write_voxels(const fs::path& file, VolumeFormat format, const VolumeHeader& header,
                          itk::IOComponentEnum type, const void* voxels, const HeaderFields& fields) try {
  const itk::ImageIOBase::Pointer io = format_of(format);
  io->SetFileName(file.string());
  io->SetNumberOfDimensions(3);
  itk::ImageIORegion all(3);
  for (unsigned d = 0; d < 3; ++d) {
    io->SetDimensions(d, header.dims[d]);
    io->SetSpacing(d, header.spacing_mm[d]);
    io->SetOrigin(d, header.origin_mm[d]);
    io->SetDirection(d, std::vector<double>(header.axes[d].begin(), header.axes[d].end()));
    all.SetSize(d, header.dims[d]);
  }
  io->SetPixelType(itk::IOPixelEnum::SCALAR);
  io->SetComponentType(type);
  io->SetNumberOfComponents(1);
  for (const auto& [key, value] : fields)
    itk::EncapsulateMetaData<std::string>(io->GetMetaDataDictionary(), key, value);
  io->SetIORegion(all);
  io->SetUseCompression(true);  // of NIfTI, the ending decides
  io->WriteImageInformation();
  io->Write(voxels);
  return {};
} catch (const itk::ExceptionObject&) {
  return failure(ErrorCode::internal, "cannot write " + file.string());
}

}  // namespace

Result<VolumeHeader> read_volume_header(const fs::path& file, VolumeFormat format, VoxelContent content) try {
  const itk::ImageIOBase::Pointer io = reader_of(file, format);
  // A dimension of one step is no obstacle.
  for (unsigned d = 3; d < io->GetNumberOfDimensions(); ++d)
    if (io->GetDimensions(d) > 1)
      return failure(ErrorCode::unsupported, file.string() + " has " + std::to_string(io->GetDimensions(d)) +
                                                 " volumes; give a file with one of them");
  if (io->GetNumberOfDimensions() < 3) return bad_input(file.string() + " has one slice; give a scan with several");
  VolumeHeader header;
  header.layers = io->GetNumberOfComponents();
  const bool layered = content == VoxelContent::labels && format == VolumeFormat::nrrd;
  if ((header.layers != 1 && !layered) || header.layers == 0 || converter(io->GetComponentType()) == nullptr)
    return failure(ErrorCode::unsupported, file.string() + " has colours or vectors; give a " +
                                               (content == VoxelContent::hu ? "CT" : "label map") +
                                               ", with one number for each voxel");
  header.voxel_bytes = io->GetComponentSize() * header.layers;
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

Result<HeaderFields> read_segment_fields(const fs::path& file) try {
  const itk::ImageIOBase::Pointer io = reader_of(file, VolumeFormat::nrrd);
  HeaderFields fields;
  for (const std::string& key : io->GetMetaDataDictionary().GetKeys()) {
    std::string value;
    if (key.starts_with("Segment") && itk::ExposeMetaData<std::string>(io->GetMetaDataDictionary(), key, value))
      fields.emplace_back(key, value);
  }
  return fields;
} catch (const itk::ExceptionObject&) {
  return damaged(file);
}

Result<void> read_volume_slices(const fs::path& file, VolumeFormat format, const OnHuSlice& on_slice) try {
  const std::vector<bool> lost = format == VolumeFormat::nifti ? not_finite_in_nifti(file) : std::vector<bool>();
  std::vector<std::int16_t> slice(slice_numbers(file, format));
  std::size_t n = 0;
  return read_slices(file, format, [&](const Converter& convert, const char* bytes) -> Result<void> {
    std::uint32_t without_number = convert.to_hu(bytes, slice);
    for (std::size_t i = 0; i < slice.size() && n < lost.size(); ++i)
      if (lost[n++]) {
        slice[i] = kPadding_hu;
        ++without_number;
      }
    on_slice(slice, without_number);
    return {};
  });
} catch (const itk::ExceptionObject&) {
  return damaged(file);
}

Result<void> read_label_slices(const fs::path& file, VolumeFormat format,
                               const std::function<void(std::span<const std::uint16_t>)>& on_slice) try {
  std::vector<std::uint16_t> slice(slice_numbers(file, format));
  return read_slices(file, format, [&](const Converter& convert, const char* bytes) -> Result<void> {
    if (const std::optional<double> wrong = convert.to_labels(bytes, slice)) {
      std::array<char, 32> text{};
      std::snprintf(text.data(), text.size(), "%.6g", *wrong);
      return bad_input(file.string() + " has a voxel of " + text.data() +
                       ", and labels are whole numbers from 0 to 65535; export it as a label map");
    }
    on_slice(slice);
    return {};
  });
} catch (const itk::ExceptionObject&) {
  return damaged(file);
}

Result<void> write_label_volume(const fs::path& file, VolumeFormat format, const VolumeHeader& header,
                                std::span<const std::uint8_t> labels, const HeaderFields& fields) {
  return write_voxels(file, format, header, itk::IOComponentEnum::UCHAR, labels.data(), fields);
}

Result<void> write_label_volume(const fs::path& file, VolumeFormat format, const VolumeHeader& header,
                                std::span<const std::uint16_t> labels) {
  return write_voxels(file, format, header, itk::IOComponentEnum::USHORT, labels.data(), {});
}

Result<void> write_hu_volume(const fs::path& file, VolumeFormat format, const VolumeHeader& header,
                             std::span<const std::int16_t> hu) {
  return write_voxels(file, format, header, itk::IOComponentEnum::SHORT, hu.data(), {});
}

}  // namespace osteon::import
