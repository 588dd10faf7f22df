// A rectangle of pixels in space: a slice through the bone, or the detector of a C-arm.
#pragma once
#include <algorithm>
#include <cstddef>

#include "common/geometry/pose.hpp"

namespace osteon::radiology {

// Pixels of an image: columns and rows from the first to the last, both included.
struct PixelBox {
  int first_column = 0, first_row = 0;
  int last_column = -1, last_row = -1;
  [[nodiscard]] bool empty() const { return last_column < first_column || last_row < first_row; }
  [[nodiscard]] bool meets(const PixelBox& other) const {
    return first_column <= other.last_column && other.first_column <= last_column && first_row <= other.last_row &&
           other.first_row <= last_row;
  }
  // The pixels of both. May be empty.
  [[nodiscard]] PixelBox common(const PixelBox& other) const {
    return {std::max(first_column, other.first_column), std::max(first_row, other.first_row),
            std::min(last_column, other.last_column), std::min(last_row, other.last_row)};
  }
  friend bool operator==(const PixelBox&, const PixelBox&) = default;
};

// Columns count from the left of the image, rows from its top. Pixels are stored row by row. The two directions are
// perpendicular; shadow_of() and distances in the image rely on it.
struct PixelGrid {
  Vec3 first_mm = Vec3::Zero();                            // centre of the first pixel, in the bone's frame
  Vec3 column_mm = Vec3::UnitX(), row_mm = Vec3::UnitY();  // to the next column and to the next row
  int columns = 0, rows = 0;

  [[nodiscard]] Vec3 at(double column, double row) const { return first_mm + column * column_mm + row * row_mm; }
  [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  [[nodiscard]] PixelBox whole() const { return {0, 0, columns - 1, rows - 1}; }
  // Whether all pixels of a box are in the image; true for an empty box.
  [[nodiscard]] bool holds(const PixelBox& box) const {
    return box.empty() ||
           (box.first_column >= 0 && box.first_row >= 0 && box.last_column < columns && box.last_row < rows);
  }
};

// Square pixels about a centre. `right` and `down` are perpendicular unit vectors of the image.
[[nodiscard]] inline PixelGrid grid_about(const Vec3& centre_mm, const Vec3& right, const Vec3& down, double pixel_mm,
                                          int columns, int rows) {
  PixelGrid grid{centre_mm, pixel_mm * right, pixel_mm * down, columns, rows};
  grid.first_mm = grid.at(-0.5 * (columns - 1), -0.5 * (rows - 1));
  return grid;
}

}  // namespace osteon::radiology
