// Pieces that a cut separates from a bone: connected components of what is solid, kept up to date over the blocks that
// change.
#pragma once
#include <memory>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

// Pieces smaller than this are debris: they vanish.
inline constexpr double kDebris_mm3 = 1.0;

// The masks are the two sides of one function on one lattice, so where both apply no point is solid in both bodies.
struct Fragment {
  double volume_mm3 = 0;
  Box bounds;                    // of its solid samples, mm
  std::vector<FieldLeaf> taken;  // mask for the parent: its field R becomes min(R, mask), and the piece is gone
  std::vector<FieldLeaf> left;   // mask for the piece's own field, a copy of the parent's: all but the piece is gone
  [[nodiscard]] bool debris() const { return volume_mm3 < kDebris_mm3; }
};

// What touch() did, for those who watch the cost.
struct TouchCost {
  std::size_t cells = 0;    // of 8³ voxels of level 0, labelled again
  std::size_t samples = 0;  // in them, at the resolution at which each was cut
  bool links = false;       // whether the graph of components changed, so that pieces are looked for
};

// Parts that are apart in the case already, as two bones of one scan, are no fragments of each other: each of them can
// lose pieces. The largest remaining part of what was one stays the parent.
//
// A cell is a leaf of level 0, labelled at the finest level that a cut reached it with, and components of neighbouring
// cells are linked where solid samples face each other. Cells of two levels are linked at the samples of the coarser:
// a cut is at least a voxel of the coarser away from there, so what lies between them is uncut bone.
//
// The pieces follow from the case and the field alone: a finder made anew says the same as one kept up to date.
class FragmentFinder {
 public:
  explicit FragmentFinder(const CutField& field);  // labels the whole bone: fractions of a second
  ~FragmentFinder();
  FragmentFinder(FragmentFinder&&) noexcept;
  FragmentFinder& operator=(FragmentFinder&&) noexcept;

  // After leaves of one level changed: brings the components up to date, at the cost of what changed.
  TouchCost touch(const CutField& field, int level, const std::vector<Coord>& changed_leaves);
  // What has come apart and was not taken away; the smaller parts, largest first. The caller applies the masks and
  // touches their leaves; what it leaves is found again the next time. Cheap when nothing changed since the last call.
  [[nodiscard]] std::vector<Fragment> take_fragments(const CutField& field);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteon
