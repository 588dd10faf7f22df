// The least energy that a cut takes, estimated before the cut is evaluated. A room rejects a cut that needs more energy
// than a motor can give.
#pragma once
#include <map>
#include <span>
#include <vector>

#include "common/field/cut.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon {

// Not synchronised.
class CutEnergy {
 public:
  // A lower bound of the energy of a cut, J. After the cut no bone is left inside the cutting body, at any pose of the
  // path. So the energy to remove the bone inside it at one pose is a lower bound; the pose with the most counts.
  // The energy is ∫ u(ρ) dV with u the ultimate stress [A]. It is summed over samples of the body, so it is exact
  // only over many cuts: see resolution_j(). `fields`: those of all bodies that the room has.
  [[nodiscard]] double least_j(const Cut& cut, const ToolBox::Entry& tool, std::span<const CutField* const> fields);
  // Energy that one sample stands for in cortical bone, J.
  [[nodiscard]] double resolution_j(const ToolBox::Entry& tool);

 private:
  // Points of the cutting body in the tool's frame. Each stands for an equal part of the body's volume.
  struct Samples {
    std::vector<Vec3> at_mm;
    double volume_mm3 = 0;  // of each point
  };
  const Samples& samples(const ToolBox::Entry& tool);
  std::map<Digest, Samples> samples_;
};

}  // namespace osteon
