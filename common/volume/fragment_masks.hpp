// Computes the volume of a separated piece, and its two masks: one removes it from the parent, the other keeps only the
// piece in its own field.
#pragma once
#include <span>
#include <vector>

#include "common/volume/fragments.hpp"

namespace osteon {

// Finds cells by the origin of their leaf of level 0.
class CellMap {
 public:
  CellMap() = default;
  CellMap(const CoordBox& bounds_samples, const std::vector<Coord>& origins);
  [[nodiscard]] std::int32_t find(Coord origin) const;  // index among `origins`, or -1
  // For each cell, whether the cell or one of its 26 neighbours is marked.
  [[nodiscard]] std::vector<std::uint8_t> dilated(std::span<const std::uint8_t> marked) const;
  [[nodiscard]] std::size_t size() const { return count_; }

 private:
  [[nodiscard]] std::size_t index(Coord cell) const;
  CoordBox box_;                     // of cells
  std::vector<std::int32_t> cells_;  // dense
  std::size_t count_ = 0;
};

// The samples of a level in a cell.
[[nodiscard]] CoordBox cell_box(Coord origin, int level);
// The finest level of the cuts that reached the cell.
[[nodiscard]] int cut_level(const CutField& field, Coord origin);

// What a cell contains of one piece and of the rest.
struct PieceCell {
  Coord origin;
  int level = 0;  // the level at which its components are labelled
  bool full = false;
  std::vector<bool> in_piece;  // for each component of label_solid() at that level, in order
  bool has_piece = false, has_rest = false;
};

// `cells`: all cells of the finder, in the order of the map.
[[nodiscard]] Fragment cut_out(const CutField& field, const CellMap& map, std::span<const PieceCell> cells);

}  // namespace osteon
