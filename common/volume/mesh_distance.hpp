// The signed distance to a triangle mesh on a lattice: how a tool from an STL file cuts, and a bone from one.
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
// Around the solid and within it distances are true up to here, or up to four samples if that is more; beyond it they
// are clipped.
inline constexpr double kMeshBand_mm = 3.0;

// The distance to the triangles at every sample of the band, rounded to kQuantum_mm: exact near the surface, and within
// some hundredths of a pitch at the end of the band, where a triangle beside the nearest may stand for it. The mesh may
// turn either way, and its parts may overlap; the solid is what cannot be reached from outside. Error: invalid_input,
// for one that is not closed, flat, or too large for the pitch.
[[nodiscard]] Result<std::shared_ptr<const SampledDistance>> sampled_distance(const TriangleMesh& mesh,
                                                                              double pitch_mm);

inline constexpr std::size_t kMostBoneTriangles = 20'000'000;
inline constexpr double kSmallestBone_mm = 5.0, kLargestBone_mm = 2000.0;  // longest side; else the unit is another

// Bone of one density from a closed mesh, of info.pitch_mm, in the mesh's own frame. Shells that turn the other way
// than the whole are cavities; bone loose in a cavity is lost. Memory goes with the surface. Errors: invalid_input (not
// closed, a size no bone has, too fine a pitch for the memory), cancelled.
[[nodiscard]] Result<Case> case_of_mesh(CaseInfo info, const TriangleMesh& mesh, double density_g_cm3,
                                        const KeepGoing& keep_going);

// Reads STL files that lie beside a tool file, by their plain names: what load_tool() and parse_tool() need for a mesh.
[[nodiscard]] MeshLoader stl_beside(const std::filesystem::path& folder);
// A tool of any kind, with the STL that it may name. Errors as load_tool().
[[nodiscard]] Result<Tool> load_tool_file(const std::filesystem::path& file);

}  // namespace osteon
