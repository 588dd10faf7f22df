// Marks of places in a picture in three dimensions. Each kind has a shape of its own, so that nobody needs its colour.
// They are drawn over the bone, because most lie in it. All functions: [render], the thread that owns the window.
#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "common/geometry/lattice.hpp"

namespace osteon {

class LayerAbove;

// Seed: a ball. Paint: a star of three bars. Outside: a pyramid with three sides, which points to the head.
enum class SolidMark : std::uint8_t { seed, paint, outside };

class SolidMarks {
 public:
  // The layer must outlive it.
  explicit SolidMarks(LayerAbove& layer);
  ~SolidMarks();

  // All of a kind, bone frame. `radius_mm`: of a ball; the other shapes follow it.
  void show(SolidMark kind, std::span<const Vec3> points_mm, double radius_mm);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
