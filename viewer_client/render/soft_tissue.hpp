// Draws the HU of a scan as translucent skin, muscle and bone. All functions: [render], the thread that opened the
// window.
#pragma once
#include <cstdint>
#include <memory>
#include <span>

#include "common/surface/label_surface.hpp"

class vtkRenderer;

namespace osteon {

class SoftTissue {
 public:
  // The renderer must outlive it.
  explicit SoftTissue(vtkRenderer& renderer);
  ~SoftTissue();

  // Copies the HU: columns fastest, then rows, then slices. Without shading, VTK needs little more.
  void show(const VoxelGrid& grid, std::span<const std::int16_t> hu);
  void hide();
  [[nodiscard]] bool shown() const;
  // How fine the next picture is. Fine: a ray for each pixel, or 200 000 rays if the picture has more. Coarse: a ninth
  // of these rays, and a third of the samples along each.
  void set_coarse(bool coarse);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
