// Which blocks a body's surface has, at which level, and which of them a cut makes stale.
#pragma once
#include <set>
#include <vector>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// A block is drawn at a finer level where any of that level's samples in it, apron included, is cut.
// Keeps the set of fine blocks; the coarse cells they cover are left out of the coarse blocks.
class SurfaceBlocks {
 public:
  explicit SurfaceBlocks(BodyId body) : body_(body) {}

  // After a cut changed these leaves (origins at `level`): marks fine blocks as drawn and returns every block whose
  // payload must be made again, each once.
  std::vector<BlockKey> touch(int level, const std::vector<Coord>& changed_leaves);
  [[nodiscard]] CoveredGroups covered(const BlockKey& key) const;
  [[nodiscard]] const std::set<BlockKey>& fine_blocks() const { return fine_; }

 private:
  BodyId body_;
  std::set<BlockKey> fine_;  // blocks of level 1 and 2 that are drawn
};

}  // namespace osteon
