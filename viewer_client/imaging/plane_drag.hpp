// From a drag over a plane of a scan to an edit: a stroke, a cutting plane, or a box.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "viewer_client/imaging/imaging_edits.hpp"
#include "viewer_client/imaging/plane_view.hpp"

namespace osteon {

// What the left button does on a plane.
enum class ImagingTool : std::uint8_t { look, paint, erase, cut, box, outside, landmark };

class PlaneDrag {
 public:
  // A drag with a tool begins at a voxel of the plane.
  PlaneDrag(ImagingTool tool, const PlaneAxes& axes, const std::array<int, 3>& voxel)
      : tool_(tool), axes_(axes), voxels_{voxel} {}
  // Goes on to another voxel of it. A stroke keeps corners only.
  void move(const std::array<int, 3>& voxel);

  [[nodiscard]] ImagingTool tool() const { return tool_; }
  [[nodiscard]] const std::array<int, 3>& first() const { return voxels_.front(); }
  [[nodiscard]] const std::array<int, 3>& last() const { return voxels_.back(); }

  // The stroke of a brush along the drag. `flat`: in this slice only. Its points are whole micrometres, so that a list
  // of them is short.
  [[nodiscard]] Correction stroke(const ScanGeometry& scan, int bone, double radius_mm, bool flat) const;
  // The plane through the ends of the drag and the direction of view. What is to the right of the drag goes. Nothing:
  // the ends are one voxel.
  [[nodiscard]] std::optional<Correction> cut(const ScanGeometry& scan, int bone) const;
  // The box with the drag's ends as corners. Through the plane it reaches as far as the box before. Nothing: it is the
  // whole scan, or the ends are one voxel.
  [[nodiscard]] std::optional<MarkedBox> box(const ScanGeometry& scan, const std::optional<MarkedBox>& before) const;

 private:
  ImagingTool tool_;
  PlaneAxes axes_;
  std::vector<std::array<int, 3>> voxels_;  // never empty
};

}  // namespace osteon
