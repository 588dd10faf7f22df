// Computes the signed distance to a triangle mesh on a lattice, for tools and bones from STL files.
#pragma once
#include <filesystem>
#include <memory>

#include "common/core/result.hpp"
#include "common/geometry/triangle_mesh.hpp"
#include "common/tools/tool_file.hpp"
#include "common/volume/case.hpp"

namespace osteon {

inline constexpr std::size_t kMostMeshTriangles = 2'000'000;
inline constexpr double kLargestMesh_mm = 500.0;
inline constexpr double kMostMeshSamples = 32e6;  // of the lattice, two bytes each
// Distances around and within the solid are correct up to this value, or up to four samples if that is more. Beyond it
// they are clipped.
inline constexpr double kMeshBand_mm = 3.0;

// The distance to the triangles at every sample of the band, rounded to kQuantum_mm. It is exact near the surface. At
// the end of the band it is exact to some hundredths of a pitch, because a triangle beside the nearest one may be used.
// The mesh may have either orientation, and its parts may overlap. The solid is everything that cannot be reached from
// outside. Error: invalid_input for a mesh that is not closed, is flat, or is too large for the pitch.
[[nodiscard]] Result<std::shared_ptr<const SampledDistance>> sampled_distance(const TriangleMesh& mesh,
                                                                              double pitch_mm);

inline constexpr std::size_t kMostBoneTriangles = 20'000'000;
// longest side; outside this range the file uses another unit
inline constexpr double kSmallestBone_mm = 5.0, kLargestBone_mm = 2000.0;

// A bone of one density from a closed mesh, with pitch info.pitch_mm, in the mesh's own frame. Shells oriented against
// the whole are cavities. Loose bone in a cavity is lost. Memory grows with the surface. Errors: invalid_input (not
// closed, a size that no bone has, too fine a pitch for the memory), cancelled.
[[nodiscard]] Result<Case> case_of_mesh(CaseInfo info, const TriangleMesh& mesh, double density_g_cm3,
                                        const KeepGoing& keep_going);

// Reads STL files beside a tool file, by their plain names, as load_tool() and parse_tool() need for a mesh.
[[nodiscard]] MeshLoader stl_beside(const std::filesystem::path& folder);
// A tool of any kind, with the STL file that it may name. Errors as load_tool().
[[nodiscard]] Result<Tool> load_tool_file(const std::filesystem::path& file);

}  // namespace osteon
