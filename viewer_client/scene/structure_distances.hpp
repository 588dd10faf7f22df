// How far a point is from the structures at risk.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/surface/surgical_plan.hpp"

namespace osteon {

struct NearestStructure {
  std::size_t structure = 0;  // number in the plan
  double distance_mm = 0.0;   // to its surface; 0 inside it
  bool inside = false;
  Vec3 point_mm = Vec3::Zero();  // the nearest point of its surface, bone frame
};

// For one thread at a time. Points are in the bone's frame, mm. Distances to the triangles of the surfaces are exact.
// The surfaces are at most half a voxel from those of the labels (common/surface/label_surface.hpp).
class StructureDistances {
 public:
  explicit StructureDistances(std::shared_ptr<const SurgicalPlan> plan);  // shared with the picture

  [[nodiscard]] const SurgicalPlan& plan() const { return *plan_; }
  // Among those at risk. None: the plan has none.
  [[nodiscard]] std::optional<NearestStructure> nearest(const Vec3& point_mm) const;

 private:
  // Some neighbouring triangles of a structure, and the box around them.
  struct Group {
    std::size_t first, last;  // triangles, without `last`
    Box box;
  };
  // A structure at risk, its groups, and the box around it.
  struct AtRisk {
    std::size_t structure;
    std::vector<Group> groups;
    Box box;
  };
  [[nodiscard]] bool is_inside(const Vec3& point_mm, const AtRisk& at_risk) const;

  std::shared_ptr<const SurgicalPlan> plan_;
  std::vector<AtRisk> at_risk_;
};

}  // namespace osteon
