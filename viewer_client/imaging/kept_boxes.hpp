// The sub-volumes of Niu 2008, §5, of what is kept of a scan: as `osteon-import report` finds them, by the same
// library.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "viewer_client/imaging/kept_slices.hpp"

namespace osteon {

inline constexpr int kFirstSubdivisions = 3;  // the same default as that of osteon-import

struct KeptLeaf {
  CoordBox box;
  bool full = true;  // otherwise partly full
  friend bool operator==(const KeptLeaf&, const KeptLeaf&) = default;
};

// Boxes of the scan's voxels: columns as x, rows as y, slices as z, from 0.
struct KeptBoxes {
  CoordBox object;                 // around all that is kept; empty: nothing is
  std::vector<CoordBox> sections;  // from the first slice to the last
  std::vector<KeptLeaf> leaves;    // what the quadtree of each section keeps, in the order of the sections

  // The voxels of the sections.
  [[nodiscard]] std::int64_t section_voxels() const;
  [[nodiscard]] std::int64_t full_leaves() const;
  // The section with a voxel; -1: none has it.
  [[nodiscard]] int section_at(const std::array<int, 3>& voxel) const;
  // Empty, if there is no such section.
  [[nodiscard]] std::span<const KeptLeaf> leaves_of(int section) const;
};

// `keep_going` is asked before each slice and each quadrant. Holds a byte for each voxel of one section. Errors:
// cancelled, exhausted (memory).
[[nodiscard]] Result<KeptBoxes> kept_boxes(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept,
                                           int subdivisions, const KeepGoing& keep_going);

// A box as a picture shows it. Its colours are those of Okabe and Ito, which colour-blind people tell apart. Line and
// dashes tell the same without colour.
struct DrawnBox {
  std::array<int, 3> first{}, last{};  // voxels
  std::array<std::uint8_t, 3> colour{};
  bool wide = false, dashed = false;
};
inline constexpr std::array<std::uint8_t, 3> kObjectColour{240, 228, 66}, kSectionColour{86, 180, 233},
    kChosenColour{230, 159, 0}, kFullColour{0, 158, 115}, kPartlyFullColour{204, 121, 167};
// Leaves that are drawn at most. Each has up to 144 lines in three dimensions.
inline constexpr std::size_t kMostDrawnLeaves = 1000;
// In the order in which they are drawn: `chosen`, the section of this number, lies over all. If there are more leaves
// than kMostDrawnLeaves, those of the chosen section are drawn, and none if that has more, too.
[[nodiscard]] std::vector<DrawnBox> drawn_boxes(const KeptBoxes& boxes, int chosen);

}  // namespace osteon
