// The surface of what is kept of a scan, as far as it is known before osteon-import makes the bone.
#pragma once
#include <array>

#include "common/core/keep_going.hpp"
#include "common/surface/mesh_block.hpp"
#include "viewer_client/imaging/kept_slices.hpp"

namespace osteon {

// The surface of the voxels that the planes show as kept (corrected_plane()), within the box, at the resolution of
// reduced_scan(). A block is solid if a quarter of it is kept, so that thin bone is not lost. Closed, bone frame, mm,
// with normals. It holds two slices of blocks at a time, and no volume. `keep_going` is asked before each slice of the
// scan. Errors: cancelled, exhausted (too many triangles).
[[nodiscard]] Result<Mesh> kept_surface(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                                        const KeepGoing& keep_going);

// The voxel of the scan that is nearest to a point of its surface. Where the bone reaches the scan's end, the surface
// lies beyond it, by less than a block.
[[nodiscard]] std::array<int, 3> voxel_near(const ScanGeometry& scan, const Vec3& at_mm);

}  // namespace osteon
