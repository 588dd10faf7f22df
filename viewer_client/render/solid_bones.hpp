// Draws the surfaces of several bones, each with a colour and an opacity of its own, and answers which of them is at a
// pixel. All functions: [render], the thread that owns the window.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "common/surface/mesh_block.hpp"

class vtkRenderer;

namespace osteon {

// A point of the surface of a bone, bone frame.
struct SolidHit {
  int bone = 0;
  Vec3 point_mm = Vec3::Zero();
};

class SolidBones {
 public:
  // The renderer must outlive it.
  explicit SolidBones(vtkRenderer& renderer);
  ~SolidBones();

  // Of all bones.
  void clear();
  // Bone frame. Takes the place of the bone's surface.
  void show(int bone, const Mesh& mesh);
  // `opacity`: from 0, which nobody sees or hits, to 1. A bone without one is white. It stays after clear().
  void set_paint(int bone, const std::array<std::uint8_t, 3>& colour, double opacity);

  // The first one at a pixel. Columns from the left, rows from the bottom.
  [[nodiscard]] std::optional<SolidHit> at(int x_px, int y_px) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
