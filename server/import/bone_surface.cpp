#include "server/import/bone_surface.hpp"

#include <algorithm>
#include <map>

#include "common/surface/block_source.hpp"
#include "common/surface/weld.hpp"

namespace osteon::import {

Result<TriangleMesh> bone_surface(const CutField& field, const KeepGoing& keep_going) {
  const Case& bone = field.bone();
  std::map<int, std::vector<Coord>> cut;
  for (const FieldLeaf& leaf : field.leaf_places()) cut[leaf.level].push_back(leaf.origin);
  SurfaceBlocks blocks(field.body());
  for (const auto& [level, leaves] : cut) blocks.touch(level, leaves);

  // Cells reach one sample beyond a block, so a surface may lie in the block before the first sample.
  std::vector<BlockKey> keys = blocks.fine_blocks();
  const CoordBox samples = bone.bounds_samples();
  const Coord first = shift_down(samples.min - Coord{1, 1, 1}, 4), last = shift_down(samples.max, 4);
  static_assert(kBlockCells == 1 << 4);
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z)
        if (const BlockKey key{field.body(), 0, {x, y, z}}; bone.has_bone(block_samples(key))) keys.push_back(key);

  std::vector<Mesh> meshes;
  BlockSamples gathered;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!keep_going(0.8 * static_cast<double>(i) / static_cast<double>(keys.size())))
      return stopped_while("meshing the bone");
    gather_block(field, blocks, keys[i], bone.pitch_mm(), gathered);
    if (gathered.covered == kWhollyCovered) continue;
    Mesh mesh;
    mesh_block(gathered, mesh);
    if (!mesh.triangles.empty()) meshes.push_back(std::move(mesh));
  }
  if (meshes.empty()) return failure(ErrorCode::invalid_input, "nothing is left of this bone");
  Mesh whole = weld(meshes);
  return TriangleMesh{std::move(whole.positions_mm), std::move(whole.triangles), std::move(whole.normals)};
}

}  // namespace osteon::import
