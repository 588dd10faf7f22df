// Pieces that a cut separates from a bone: connected components of what is solid, kept up to date over the blocks that
// change.
#pragma once
#include <memory>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

// Pieces smaller than this are debris: they vanish.
inline constexpr double kDebris_mm3 = 1.0;

struct Fragment {
  double volume_mm3 = 0;
  Box bounds;                        // mm
  std::vector<FieldLeaf> taken;      // mask for the parent: its field R becomes min(R, mask), and the piece is gone
  std::vector<FieldLeaf> left;       // mask for the piece's own field, a copy of the parent's: all but the piece is gone
  [[nodiscard]] bool debris() const { return volume_mm3 < kDebris_mm3; }
};

// Parts that are apart in the case already, as two bones of one scan, are no fragments of each other: each of them can
// lose pieces. The largest remaining part of what was one stays the parent.
class FragmentFinder {
 public:
  explicit FragmentFinder(const CutField& field);  // labels the whole bone: fractions of a second
  ~FragmentFinder();
  FragmentFinder(FragmentFinder&&) noexcept;
  FragmentFinder& operator=(FragmentFinder&&) noexcept;

  // After leaves of one level changed: brings the components up to date, at the cost of what changed.
  void touch(const CutField& field, int level, const std::vector<Coord>& changed_leaves);
  // What has come apart since the last call; the smaller parts. The caller applies the masks and touches the leaves.
  [[nodiscard]] std::vector<Fragment> take_fragments(const CutField& field);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace osteon
