// Niu 2008, §5.5, has two methods to raise the resolution near the tool. Method 2 refines only where the tool is;
// CutField implements it. Method 1 is here for comparison: it refines the whole sub-volume that the tool touches, once.
#pragma once
#include <map>
#include <span>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

// A sub-volume is a cube with this many samples of level 0 along each side, about the 30000 voxels that Niu 2008,
// §5.3, found best.
inline constexpr std::int32_t kSubVolumeSamples = 32;

struct RefineReport {
  CutReport cut;
  std::size_t resampled = 0;  // sub-volumes that this cut touched for the first time
};

// Cuts of one level, by method 1. At the first touch, a sub-volume's surface distance S is resampled to the level's
// lattice and stored, and all its leaves of the level are made, cut or not. Then S and the removed volume's distance R
// share one set of samples: f = max(S, −R) needs no interpolation. Bone and hash are the same as by method 2.
class SubVolumeField {
 public:
  SubVolumeField(Case bone, int level, std::shared_ptr<const ToolBox> tools = builtin_tool_box());

  RefineReport apply(const Cut& cut);  // of this level
  // f = max(S, −R) on samples of the level. Read where a sub-volume was resampled, otherwise interpolated.
  void gather_solid(const CoordBox& box, std::span<float> out) const;

  [[nodiscard]] const CutField& field() const { return field_; }
  [[nodiscard]] Digest hash() const { return field_.hash(); }
  [[nodiscard]] std::vector<Coord> sub_volumes() const;  // origins in samples of level 0; sorted
  [[nodiscard]] std::size_t memory_bytes() const;        // of the resampled surface and of R

 private:
  void resample(Coord origin);
  CutField field_;
  int level_;
  std::map<Coord, std::vector<float>> surface_;  // S of each resampled sub-volume, by origin
};

// Number of groups of cubes of `size` samples that share a face, edge or corner. A renderer must treat each group
// separately.
[[nodiscard]] std::size_t unconnected_areas(std::span<const Coord> origins, std::int32_t size);

}  // namespace osteon
