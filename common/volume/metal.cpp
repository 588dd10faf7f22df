#include "common/volume/metal.hpp"

#include <algorithm>
#include <array>

#include "common/field/kernel.hpp"
#include "common/volume/dense_volume.hpp"

namespace osteon {
namespace {

// The metal leaves that meet the box of a sweep.
std::vector<Coord> leaves_in(const std::vector<Coord>& metal, const SweptTool& swept, double pitch_mm) {
  Box box;
  for (const ToolSweep& sweep : swept.sweeps()) {
    box.include({sweep.min_mm[0], sweep.min_mm[1], sweep.min_mm[2]});
    box.include({sweep.max_mm[0], sweep.max_mm[1], sweep.max_mm[2]});
  }
  const CoordBox samples = covering_samples(box, pitch_mm);
  const Coord first = floor_to(samples.min, kLeafSize), last = samples.max;
  std::vector<Coord> found;
  for (auto at = std::ranges::lower_bound(metal, first.x, {}, &Coord::x); at != metal.end() && at->x <= last.x; ++at)
    if (at->y >= first.y && at->y <= last.y && at->z >= first.z && at->z <= last.z) found.push_back(*at);
  return found;
}

// Whether metal is left at or beside one of these samples of a leaf.
bool is_left(Coord leaf, const std::vector<Coord>& samples, std::span<const CutField* const> fields) {
  const Case& bone = fields.front()->bone();
  const CoordBox around = CoordBox{leaf, leaf + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1}}.grown(1);
  DenseVolume<float> solid_mm(around, 0.0f);
  for (const CutField* field : fields) {
    field->gather_solid(0, around, solid_mm.values);
    for (const Coord at : samples)
      for (int i = 0; i < 27; ++i) {
        const Coord beside = at + Coord{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1};
        if (solid_mm.at(beside) < 0.0f && bone.tissue(beside) == Tissue::metal) return true;
      }
  }
  return false;
}

}  // namespace

bool meets_metal(const Cut& cut, const CutBody& body, std::span<const CutField* const> fields) {
  if (fields.empty()) return false;
  const Case& bone = fields.front()->bone();
  if (bone.metal_leaves().empty()) return false;
  const double h = bone.pitch_mm();
  Cut coarse = cut;
  coarse.level = 0;
  const SweptTool swept(coarse, body, h);
  const std::vector<Coord> leaves = leaves_in(bone.metal_leaves(), swept, h);
  if (leaves.empty()) return false;

  const CutPlan plan = swept.plan(leaves);
  std::vector<Coord> deep;
  for (const CutPlan::Leaf& leaf : plan.leaves) {
    std::array<float, kLeafVoxels> distance_mm;
    distance_mm.fill(band_mm(h));
    swept.cut_leaf(plan, leaf, distance_mm);
    deep.clear();
    for (int i = 0; i < kLeafVoxels; ++i) {
      const Coord at = leaf.origin + Coord{i >> 6, i >> 3 & 7, i & 7};
      if (distance_mm[static_cast<std::size_t>(i)] < -static_cast<float>(h) && bone.tissue(at) == Tissue::metal)
        deep.push_back(at);
    }
    if (!deep.empty() && is_left(leaf.origin, deep, fields)) return true;
  }
  return false;
}

}  // namespace osteon
