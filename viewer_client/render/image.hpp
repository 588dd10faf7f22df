// Pictures as pixels, and as PNG files.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/core/result.hpp"

class vtkRenderWindow;

namespace osteon {

// Pixels as they are seen; rows from the top.
struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::array<std::uint8_t, 3>> rgb;
  [[nodiscard]] const std::array<std::uint8_t, 3>& at(int x, int y) const {
    return rgb[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x)];
  }
};

// What the window shows. Thread: [render], the one that opened the window.
[[nodiscard]] Image image_of(vtkRenderWindow& window);

// Error internal: the picture cannot become a PNG. Other errors are those of write_file().
[[nodiscard]] Result<void> write_png(const Image& image, const std::filesystem::path& file);

}  // namespace osteon
