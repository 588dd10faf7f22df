// Which blocks a body's surface has and at which level, and which blocks a cut or a change of view makes outdated.
#pragma once
#include <array>
#include <span>
#include <unordered_set>
#include <vector>

#include "common/surface/mesh_block.hpp"

namespace osteon {

// A position where a person works or looks. Without any focus, everything is drawn in full. Otherwise, whatever no
// focus covers is drawn coarser.
struct Focus {
  Vec3 position_mm = Vec3::Zero();
  double full_mm = 0;  // drawn in full up to this distance, beyond it at 2 h
  double half_mm = 0;  // drawn at 2 h up to this distance, beyond it at 4 h; not below full_mm
};
// What was drawn finer stays so up to this many times the distance, so that a trembling hand changes nothing.
inline constexpr double kFocusHysteresis = 1.25;

// A block is drawn at a finer level if any of that level's samples in it, apron included, is cut. It is drawn at a
// coarser level if it is far from every focus. Blocks of different levels may be neighbours; the finer one has seams.
class SurfaceBlocks {
 public:
  explicit SurfaceBlocks(BodyId body) : body_(body) {}

  // Called after a cut changed these leaves (origins at `level`). Marks fine blocks as drawn. Returns every block whose
  // payload must be made again, each once.
  std::vector<BlockKey> touch(int level, const std::vector<Coord>& changed_leaves);
  // Draws the bone for these focuses; its samples of level 0 are in the box. Returns every block whose payload must be
  // made again, including blocks that are no longer drawn. Sorted, each once.
  std::vector<BlockKey> focus(std::span<const Focus> focuses, const CoordBox& bone_samples, double pitch_mm);

  [[nodiscard]] bool drawn(const BlockKey& key) const;             // completely or in part
  [[nodiscard]] CoveredGroups covered(const BlockKey& key) const;  // kWhollyCovered if it is not drawn
  [[nodiscard]] Seams seams(const BlockKey& key) const;
  // Blocks that cuts or focuses have drawn, except those of level 0. Sorted.
  [[nodiscard]] std::vector<BlockKey> fine_blocks() const;
  [[nodiscard]] std::vector<BlockKey> coarse_blocks() const;

 private:
  using Indices = std::unordered_set<Coord, CoordHash>;
  // The level at which a position is drawn. The position is named by the block of the finest level there.
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
