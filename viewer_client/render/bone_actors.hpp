// Draws the surface of the bone and its pieces, and answers where that surface is. All functions: [render], the thread
// that opened the window.
#pragma once
#include <memory>
#include <optional>

#include "common/surface/density_grid.hpp"
#include "viewer_client/scene/clipping.hpp"
#include "viewer_client/scene/surface_scene.hpp"

class vtkRenderer;

namespace osteon {

class BoneActors {
 public:
  // The renderer must outlive it.
  explicit BoneActors(vtkRenderer& renderer);
  ~BoneActors();

  // The region's whole mesh, bone frame. An empty mesh removes the region from the picture. Returns true if the region
  // is new; it is then drawn after the next add().
  [[nodiscard]] bool show(const RegionKey& region, const Mesh& mesh);

  // From the next show() on, cut faces are painted by density: cortex pale, cancellous bone dark between its struts.
  void set_density(std::shared_ptr<const DensityGrid> density);

  // Draws only this part of each region, also of those that come later.
  void clip(const Clipping& visible);

  // Adds the actors of all regions to the renderer, in the order of their keys.
  void add();
  void remove();

  // The point of the surface at a pixel, bone frame. Columns from the left, rows from the bottom.
  [[nodiscard]] std::optional<Vec3> surface_at(int x_px, int y_px) const;
  // The mean normal of the vertices near a point, bone frame. None if no vertex is near.
  [[nodiscard]] std::optional<Vec3> normal_at(const Vec3& point_mm) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
