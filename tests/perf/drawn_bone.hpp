// A bone with its blocks, as a viewer receives them, for figures of the picture.
#pragma once
#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "common/surface/block_source.hpp"
#include "common/volume/cut_field.hpp"
#include "viewer_client/scene/surface_scene.hpp"

namespace osteon::test {

class DrawnBone {
 public:
  explicit DrawnBone(const Case& bone) : field_(bone, BodyId{}) {}

  void apply(const Cut& cut) {
    const CutReport report = field_.apply(cut);
    (void)blocks_.touch(report.level, report.changed_leaves);
  }
  void focus(std::span<const Focus> focuses) { (void)blocks_.focus(focuses, samples(), pitch_mm()); }
  [[nodiscard]] double pitch_mm() const { return field_.bone().pitch_mm(); }
  [[nodiscard]] CoordBox samples() const { return field_.bone().bounds_samples(); }

  // All blocks with triangles, encoded and decoded again, sorted.
  [[nodiscard]] std::vector<ReceivedBlock> received() const {
    std::vector<BlockKey> keys = blocks_.fine_blocks();
    for (const BlockKey& key : blocks_.coarse_blocks()) keys.push_back(key);
    const CoordBox b = samples();
    for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
      for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
        for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z) keys.push_back({{}, 0, {x, y, z}});
    std::vector<ReceivedBlock> all;
    BlockSamples gathered;
    for (const BlockKey& key : keys) {
      gather_block(field_, blocks_, key, pitch_mm(), gathered);
      const BlockPayload payload = encode_block(gathered);
      auto mesh = decode_block(key, payload, level_pitch_mm(pitch_mm(), key.level));
      OSTEON_CHECK(mesh.has_value());
      if (!mesh->triangles.empty()) all.push_back({key, 1, mesh_hash(payload), std::move(*mesh)});
    }
    std::ranges::sort(all, {}, &ReceivedBlock::key);
    return all;
  }

 private:
  CutField field_;
  SurfaceBlocks blocks_{BodyId{}};
};

}  // namespace osteon::test
