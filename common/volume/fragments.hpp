// Finds pieces that a cut separates from a bone: connected components of solid samples, updated over the blocks that
// change.
#pragma once
#include <memory>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

// Smaller pieces are debris, which vanishes.
inline constexpr double kDebris_mm3 = 1.0;

// Both masks come from one function on one lattice. So where both apply, no point is solid in both bodies.
struct Fragment {
  double volume_mm3 = 0;
  Box bounds;                    // of its solid samples, mm
  std::vector<FieldLeaf> taken;  // mask for the parent: its field R becomes min(R, mask), which removes the piece
  // mask for the piece's own field, a copy of the parent's: it removes everything but the piece
  std::vector<FieldLeaf> left;
  [[nodiscard]] bool debris() const { return volume_mm3 < kDebris_mm3; }
};

// Cost of touch(), for measurements.
struct TouchCost {
  std::size_t cells = 0;    // cells of 8³ voxels of level 0 that were labelled again
  std::size_t samples = 0;  // samples in them, at the resolution at which each was cut
  bool links = false;       // whether the graph of components changed, so that pieces must be searched
};

// Parts that are already separate in the case, such as two bones of one scan, are not fragments of each other. Each of
// them can lose pieces. The largest remaining part of what was connected stays the parent.
//
// A cell is a leaf of level 0, labelled at the finest level of the cuts that reached it. Components of neighbouring
// cells are linked where solid samples face each other. Cells of two levels are linked at the samples of the coarser
// level. This is correct because a cut is at least one coarser voxel away, so only uncut bone lies between them.
//
// The pieces follow from the case and the field alone: a new finder gives the same result as one that was updated.
class FragmentFinder {
 public:
  explicit FragmentFinder(const CutField& field);  // labels the whole bone; takes fractions of a second
  ~FragmentFinder();
  FragmentFinder(FragmentFinder&&) noexcept;
  FragmentFinder& operator=(FragmentFinder&&) noexcept;

  // Called after leaves of one level changed. Updates the components; the cost depends on what changed.
  TouchCost touch(const CutField& field, int level, const std::vector<Coord>& changed_leaves);
  // The separated pieces that were not removed yet: the smaller parts, largest first. The caller applies the masks and
  // touches their leaves. A piece that the caller leaves is found again next time. Cheap if nothing changed since the
  // last call.
  [[nodiscard]] std::vector<Fragment> take_fragments(const CutField& field);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteon
