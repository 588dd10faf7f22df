// Which blocks a body's surface has, at which level, and which of them a cut or a change of view makes stale.
#pragma once
#include <array>
#include <span>
#include <unordered_set>
#include <vector>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// Somebody works or looks here. What no focus asks for is drawn coarser; without any focus everything is drawn in full.
struct Focus {
  Vec3 position_mm = Vec3::Zero();
  double full_mm = 0;  // drawn in full up to here, at 2 h from here
  double half_mm = 0;  // drawn at 2 h up to here, at 4 h from here; not below full_mm
};
// What was drawn finer stays so up to this many times the distance, so that a trembling hand changes nothing.
inline constexpr double kFocusHysteresis = 1.25;

// A block is drawn at a finer level where any of that level's samples in it, apron included, is cut, and at a coarser
// one where it is far from every focus. Blocks of different levels may lie side by side: the finer one knows its seams.
class SurfaceBlocks {
 public:
  explicit SurfaceBlocks(BodyId body) : body_(body) {}

  // After a cut changed these leaves (origins at `level`): marks fine blocks as drawn and returns every block whose
  // payload must be made again, each once.
  std::vector<BlockKey> touch(int level, const std::vector<Coord>& changed_leaves);
  // Draws the bone, whose samples of level 0 lie in the box, for these focuses. Returns every block whose payload must
  // be made again, those included that are no longer drawn; sorted, each once.
  std::vector<BlockKey> focus(std::span<const Focus> focuses, const CoordBox& bone_samples, double pitch_mm);

  [[nodiscard]] bool drawn(const BlockKey& key) const;             // as a whole or in part
  [[nodiscard]] CoveredGroups covered(const BlockKey& key) const;  // kWhollyCovered where it is not drawn
  [[nodiscard]] Seams seams(const BlockKey& key) const;
  // Blocks other than those of level 0 that cuts or focuses have drawn; sorted.
  [[nodiscard]] std::vector<BlockKey> fine_blocks() const;
  [[nodiscard]] std::vector<BlockKey> coarse_blocks() const;

 private:
  using Indices = std::unordered_set<Coord, CoordHash>;
  // At which level a place is drawn, named by the block of the finest level there.
  [[nodiscard]] int level_at(Coord finest) const;
  [[nodiscard]] bool meets(const BlockKey& key, int steps) const;
  [[nodiscard]] int base_level(Coord block) const;  // of a block of level 0: 0 or below
  [[nodiscard]] bool cut_at(int level, Coord index) const {
    return fine_[static_cast<std::size_t>(level - 1)].contains(index);
  }
  [[nodiscard]] bool coarse_at(int level, Coord index) const {
    return coarse_[static_cast<std::size_t>(-1 - level)].contains(index);
  }

  BodyId body_;
  std::array<Indices, kLevels - 1> fine_;        // blocks of level 1 and 2 that are cut
  std::array<Indices, -kCoarsestLevel> coarse_;  // blocks of level -1 and -2 that are drawn
};

}  // namespace osteon
