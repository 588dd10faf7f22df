// The 26 neighbours of a voxel of a volume.
#pragma once
#include <array>
#include <cstdint>

namespace osteon::imaging {

// Directions 0 to 26 count columns fastest, then rows, then slices, each from -1 to 1. 13 is the voxel itself.
inline constexpr int kDirections = 27, kNoDirection = 13;

[[nodiscard]] constexpr std::array<int, 3> step_of(int direction) {
  return {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
}

// Whether the neighbour shares a face, not only an edge or a corner.
[[nodiscard]] constexpr bool across_face(int direction) {
  const auto [x, y, z] = step_of(direction);
  return x * x + y * y + z * z == 1;
}

class Neighbours {
 public:
  explicit Neighbours(const std::array<int, 3>& dims) : dims_(dims) {
    for (int direction = 0; direction < kDirections; ++direction) {
      const auto [x, y, z] = step_of(direction);
      offset_[static_cast<std::size_t>(direction)] =
          x + static_cast<std::int64_t>(dims[0]) * (y + static_cast<std::int64_t>(dims[1]) * z);
    }
  }

  // Calls visit(neighbour, direction) for each that lies in the volume.
  template <class Visit>
  void each(std::uint32_t voxel, Visit visit) const {
    const auto columns = static_cast<std::uint32_t>(dims_[0]), rows = static_cast<std::uint32_t>(dims_[1]);
    const int column = static_cast<int>(voxel % columns), row = static_cast<int>(voxel / columns % rows),
              slice = static_cast<int>(voxel / columns / rows);
    for (int direction = 0; direction < kDirections; ++direction) {
      const auto [x, y, z] = step_of(direction);
      if (direction == kNoDirection || column + x < 0 || column + x >= dims_[0] || row + y < 0 || row + y >= dims_[1] ||
          slice + z < 0 || slice + z >= dims_[2])
        continue;
      visit(moved(voxel, direction), direction);
    }
  }
  // The neighbour in a direction, which must lie in the volume.
  [[nodiscard]] std::uint32_t moved(std::uint32_t voxel, int direction) const {
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(voxel) + offset_[static_cast<std::size_t>(direction)]);
  }

 private:
  std::array<int, 3> dims_;
  std::array<std::int64_t, kDirections> offset_{};
};

}  // namespace osteon::imaging
