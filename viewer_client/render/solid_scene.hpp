// The picture of a scan in three dimensions: the bones that are kept, marks, the crosshair, and soft tissue. Its owner
// gives the window and decides when to draw. All functions: [render], the thread that owns the window.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "common/surface/label_surface.hpp"
#include "viewer_client/render/image.hpp"
#include "viewer_client/render/solid_bones.hpp"
#include "viewer_client/render/solid_marks.hpp"
#include "viewer_client/scene/camera_view.hpp"

class vtkRenderWindow;

namespace osteon {

// The edges of a box of voxels, both ends included.
struct WireBox {
  std::array<int, 3> first{}, last{};
  std::array<std::uint8_t, 3> colour{};
  bool wide = false, dashed = false;
  friend bool operator==(const WireBox&, const WireBox&) = default;
};

class SolidScene {
 public:
  // Adds its renderers to the window, which must outlive it.
  explicit SolidScene(vtkRenderWindow& window);
  ~SolidScene();

  [[nodiscard]] SolidBones& bones();
  [[nodiscard]] SolidMarks& marks();
  // Copies the HU, see SoftTissue. Empty: none.
  void show_soft_tissue(const VoxelGrid& grid, std::span<const std::int16_t> hu);
  [[nodiscard]] bool has_soft_tissue() const;
  // Three lines through the voxel of the crosshair, to the ends of the grid. They are faint behind the bones.
  void show_cross(const VoxelGrid& grid, const std::array<int, 3>& voxel);
  // Faint behind the bones, as the crosshair is. Empty: none.
  void show_boxes(const VoxelGrid& grid, std::span<const WireBox> boxes);
  // UTF-8; empty: nothing.
  void show_notice(const std::string& notice);

  // The bone at a pixel. Columns from the left, rows from the top.
  [[nodiscard]] std::optional<SolidHit> bone_at(int x_px, int y_px) const;

  void look(const CameraView& view);
  [[nodiscard]] CameraView camera() const;
  // `coarse`: soft tissue in a low resolution, for a view that moves.
  void draw(bool coarse);
  // The picture of the last draw().
  [[nodiscard]] Image image() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
