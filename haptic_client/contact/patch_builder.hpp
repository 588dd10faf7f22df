// Builds patches from the replica of the cut field. Bricks are reused between patches, and remade only where a cut
// changed them. So the cost of a patch depends on what the last cuts touched.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/geometry/coord_map.hpp"
#include "common/volume/cut_field.hpp"
#include "haptic_client/contact/patch.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic {

struct PatchParams {
  double fine_margin_mm = 1.5;        // of fine bricks around the cutting part
  double coarse_margin_mm = 4.0;      // of coarse bricks around the whole tool
  double clearance_margin_mm = 12.0;  // of the clearance around the whole tool
  int fine_samples = 160;             // along an axis, at most
};

class PatchBuilder {
 public:
  explicit PatchBuilder(const PatchParams& params = {}) : params_(params) {}

  // Discards bricks that contain samples of these leaves (origins at `level`) of a field with this h.
  void changed(double pitch_mm, int level, const std::vector<Coord>& leaf_origins);
  // Fills `patch` around the tool at this pose, from all bodies of the bone, at least one. Its solid distance is the
  // least of theirs. The caller sets own_cuts and room_seq of the patch.
  void build(std::span<const CutField* const> bodies, const ToolModel& model, const Pose& pose_bone_tool, Patch& patch);
  void build(const CutField& field, const ToolModel& model, const Pose& pose_bone_tool, Patch& patch) {
    const CutField* const one = &field;
    build(std::span(&one, 1), model, pose_bone_tool, patch);
  }
  [[nodiscard]] std::size_t bricks_made() const { return bricks_made_; }

 private:
  using Store = CoordMap<std::shared_ptr<const Brick>>;
  enum class Quantity { solid, density };
  // Fills near_ with the bricks whose centre is at most the margin and half their diagonal from the tool's surface, and
  // not deep inside the tool.
  void find_near(const ToolModel& model, const Pose& pose_tool_bone, const CoordBox& bricks, double pitch_mm,
                 double margin_mm);
  // Null where the brick holds no metal.
  std::shared_ptr<const Brick> metal_brick(const Case& bone, Coord index);
  std::shared_ptr<const Brick> brick(Store& store, std::span<const CutField* const> bodies, int level, Coord index,
                                     Quantity quantity);

  PatchParams params_;
  int fine_level_ = -1;
  Store fine_, coarse_, density_, metal_;
  std::vector<const CutField*> bodies_;  // of the last patch, to detect added or removed bodies
  std::vector<Coord> near_;              // bricks of the grid that is being filled
  std::shared_ptr<const Brick> air_;     // shared by every brick far from bone
  std::size_t bricks_made_ = 0;
};

}  // namespace osteon::haptic
