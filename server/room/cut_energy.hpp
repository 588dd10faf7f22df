// The least energy that a cut takes, known before it is evaluated: what no motor can give is refused.
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
  // Bone that is inside the cutting body at one pose of the path is gone after the cut, so that the energy to take it,
  // of the pose where that is most, is a lower bound. ∫ u(ρ) dV with u the ultimate stress [A], by samples in the body,
  // so exact only over many cuts: see resolution_j(). `fields`: of all bodies that the room has. J.
  [[nodiscard]] double least_j(const Cut& cut, const ToolBox::Entry& tool, std::span<const CutField* const> fields);
  // What one sample stands for in cortical bone, J.
  [[nodiscard]] double resolution_j(const ToolBox::Entry& tool);

 private:
  // Points of the cutting body in the tool's frame; each stands for as much of its volume.
  struct Samples {
    std::vector<Vec3> at_mm;
    double volume_mm3 = 0;  // of each
  };
  const Samples& samples(const ToolBox::Entry& tool);
  std::map<Digest, Samples> samples_;
};

}  // namespace osteon
