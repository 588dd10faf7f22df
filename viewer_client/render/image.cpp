#include "viewer_client/render/image.hpp"

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkRenderWindow.h>
#include <vtkUnsignedCharArray.h>

#include <cstring>
#include <string_view>

#include "common/runtime/files.hpp"

namespace osteon {

// VTK's rows run from the bottom.

Image image_of(vtkRenderWindow& window) {
  const int* size = window.GetActualSize();
  Image image;
  image.width_px = size[0];
  image.height_px = size[1];
  image.rgb.resize(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]));
  vtkNew<vtkUnsignedCharArray> rows;
  window.GetPixelData(0, 0, size[0] - 1, size[1] - 1, 0, rows);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(image.width_px);
  for (int y = 0; y < image.height_px; ++y) {
    std::memcpy(image.rgb[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px)].data(),
                rows->GetPointer(0) + static_cast<std::size_t>(image.height_px - 1 - y) * row_bytes, row_bytes);
  }
  return image;
}

Result<void> write_png(const Image& image, const std::filesystem::path& file) {
  vtkNew<vtkImageData> pixels;
  pixels->SetDimensions(image.width_px, image.height_px, 1);
  pixels->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < image.height_px; ++y) {
    std::memcpy(pixels->GetScalarPointer(0, image.height_px - 1 - y, 0), image.at(0, y).data(),
                3 * static_cast<std::size_t>(image.width_px));
  }
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(pixels);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* png = writer->GetResult();
  if (png == nullptr || png->GetNumberOfValues() == 0) {
    return failure(ErrorCode::internal, "the picture for " + file.string() + " could not be made into a PNG");
  }
  return write_file(file, std::string_view(reinterpret_cast<const char*>(png->GetPointer(0)),
                                           static_cast<std::size_t>(png->GetNumberOfValues())));
}

}  // namespace osteon
