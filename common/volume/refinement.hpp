// The two ways of Niu 2008, §5.5, to raise the resolution where a tool is. Method 2, only where the tool is, is
// CutField itself. Method 1 is here, for comparison: the whole sub-volume that the tool touches, once.
#pragma once
#include <map>
#include <span>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

// A sub-volume is a cube of this many samples of level 0, about the 30000 voxels that Niu 2008, §5.3, found best.
inline constexpr std::int32_t kSubVolumeSamples = 32;

struct RefineReport {
  CutReport cut;
  std::size_t resampled = 0;  // sub-volumes that this cut touched first
};

// Cuts of one level, by method 1: at the first touch the surface S of a sub-volume is resampled to the level's lattice
// and kept, and every leaf of the level that it has is made, cut or not. From then on there is one sample set: f needs
// no interpolation. The bone is the same as by method 2, and so is its hash.
class SubVolumeField {
 public:
  SubVolumeField(Case bone, int level, std::shared_ptr<const ToolBox> tools = builtin_tool_box());

  RefineReport apply(const Cut& cut);  // of this level
  // f = max(S, −R) on samples of the level: read where a sub-volume was resampled, interpolated elsewhere.
  void gather_solid(const CoordBox& box, std::span<float> out) const;

  [[nodiscard]] const CutField& field() const { return field_; }
  [[nodiscard]] Digest hash() const { return field_.hash(); }
  [[nodiscard]] std::vector<Coord> sub_volumes() const;  // origins in samples of level 0; sorted
  [[nodiscard]] std::size_t memory_bytes() const;        // of what was resampled, and of R

 private:
  void resample(Coord origin);
  CutField field_;
  int level_;
  std::map<Coord, std::vector<float>> surface_;  // S of each resampled sub-volume, by origin
};

// Groups of cubes of `size` samples that share a face, edge or corner: areas that a renderer must treat by themselves.
[[nodiscard]] std::size_t unconnected_areas(std::span<const Coord> origins, std::int32_t size);

}  // namespace osteon
