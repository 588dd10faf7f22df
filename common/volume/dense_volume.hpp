// A box of samples in memory. Importers fill it, and cases are built from it.
#pragma once
#include <cstddef>
#include <vector>

#include "common/geometry/lattice.hpp"

namespace osteon {

template <class T>
struct DenseVolume {
  CoordBox box;           // samples of level 0, in the bone's lattice
  std::vector<T> values;  // z fastest, then y, then x

  DenseVolume() = default;
  DenseVolume(CoordBox extent, T fill)
      : box(extent),
        values(static_cast<std::size_t>(extent.dims().x) * static_cast<std::size_t>(extent.dims().y) *
                   static_cast<std::size_t>(extent.dims().z),
               fill) {}

  [[nodiscard]] std::size_t index(Coord c) const {
    const Coord d = box.dims();
    return (static_cast<std::size_t>(c.x - box.min.x) * static_cast<std::size_t>(d.y) +
            static_cast<std::size_t>(c.y - box.min.y)) *
               static_cast<std::size_t>(d.z) +
           static_cast<std::size_t>(c.z - box.min.z);
  }
  [[nodiscard]] T at(Coord c) const { return values[index(c)]; }
  [[nodiscard]] T& at(Coord c) { return values[index(c)]; }
};

}  // namespace osteon
