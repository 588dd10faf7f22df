// What a case says beside its bone, as programs show it: planned axes, planes and regions, and the structures at risk
// with their surfaces.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "common/geometry/triangle_mesh.hpp"

namespace osteon {

enum class StructureKind : std::uint8_t {
  nerve = 1,
  vessel,
  dura,
  cartilage,
  soft_tissue,
  region,  // planned, not at risk
};

// Bone frame, mm. Directions and normals are unit vectors.
struct SurgicalPlan {
  struct Axis {
    std::string name;
    Vec3 point_mm = Vec3::Zero(), direction = Vec3::UnitZ();
  };
  struct Plane {
    std::string name;
    Vec3 point_mm = Vec3::Zero(), normal = Vec3::UnitZ();
  };
  struct Region {
    std::string name;
    Vec3 min_mm = Vec3::Zero(), max_mm = Vec3::Zero();
  };
  struct Structure {
    std::string name;
    StructureKind kind = StructureKind::nerve;
    double voxel_mm = 0.0;  // longest edge of a voxel of its label
    TriangleMesh surface;   // closed, without normals
    [[nodiscard]] bool at_risk() const { return kind != StructureKind::region; }
  };
  std::vector<Axis> axes = {};
  std::vector<Plane> planes = {};
  std::vector<Region> boxes = {};
  std::vector<Structure> structures = {};

  // The box of the bone, which the room tells everybody who joins. Not part of the plan's messages.
  Box bone_mm = {};

  [[nodiscard]] bool empty() const { return axes.empty() && planes.empty() && boxes.empty() && structures.empty(); }
};

// Of all structures together. More takes a viewer too much memory and time.
inline constexpr std::size_t kMostPlanTriangles = 4'000'000;

}  // namespace osteon
