// The surfaces of the bones that are kept of a scan, as far as they are known before osteon-import makes the bone.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/surface/mesh_block.hpp"
#include "viewer_client/imaging/kept_slices.hpp"

namespace osteon {

struct KeptSurface {
  int bone = 0;
  Mesh mesh;
};

// The surfaces of the voxels that the planes show as kept (corrected_plane()), within the box, at the resolution of
// reduced_scan(), by the bone whose tint they have there (shown_bone()), lowest first. A block is solid if a quarter of
// it is kept, so that thin bone is not lost; it is of the bone that has most of it. Each surface is closed, bone frame,
// mm, with normals. It holds a byte for each block, and 4 bytes for each bone and block of one slice of blocks.
// `keep_going` is asked before each slice of the scan and each surface. Errors: cancelled, exhausted (too many
// triangles).
[[nodiscard]] Result<std::vector<KeptSurface>> kept_surfaces(const ScanGeometry& scan, const IslandMap& islands,
                                                             const KeptParts& kept, const KeepGoing& keep_going);

// The island of a bone (shown_bone()) that is nearest to a voxel within a block and a voxel, or else the first one of
// that bone. 0: it has none, so it is painted.
[[nodiscard]] int island_near(const ScanGeometry& scan, const IslandMap& islands, const BonesOfIslands& bones, int bone,
                              const std::array<int, 3>& voxel);

// The voxel that kept_surfaces() has of this bone and that is nearest to another voxel, within a block and a voxel.
// None: the edits have changed since then. Errors: none. It makes as many slices as it looks at.
[[nodiscard]] std::optional<std::array<int, 3>> bone_voxel_near(const ScanGeometry& scan, const IslandMap& islands,
                                                                const KeptParts& kept, int bone,
                                                                const std::array<int, 3>& voxel);

// Points of the strokes that paint, for marks: the first one of each, and then one for each `least_mm` at most.
[[nodiscard]] std::vector<Vec3> painted_points(std::span<const SharedCorrection> corrections, double least_mm);

// The voxel of the scan that is nearest to a point of its surface. Where the bone reaches the scan's end, the surface
// lies beyond it, by less than a block.
[[nodiscard]] std::array<int, 3> voxel_near(const ScanGeometry& scan, const Vec3& at_mm);

}  // namespace osteon
