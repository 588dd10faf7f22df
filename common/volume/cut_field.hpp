// The cut field R of one body: the only part of a bone that changes. R(x) = min over cuts of the distance to the swept
// tool.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "common/field/cut.hpp"
#include "common/field/field_hash.hpp"
#include "common/tools/tool_box.hpp"
#include "common/volume/case.hpp"

namespace osteon {

// Counts of samples as in Niu 2008, §5.4, but whole leaves may be skipped. Computed samples are those whose distance
// was evaluated. The middle of a leaf shows whether the leaf is outside the tool's band, wholly inside it, or has
// nothing left for this cut to lower. Then its samples are only visited. Leaves wholly inside are modified without
// being computed.
struct CutReport {
  std::int64_t visited = 0;  // of the leaves in the swept tool's world bounding block, grown by the band
  std::int64_t computed = 0;
  std::int64_t modified = 0;  // samples that changed
  int level = 0;
  std::vector<Coord> changed_leaves;  // origins, samples of the level
  std::vector<Coord> reached_leaves;  // leaves of bone that the cut can change in any field of the case: reach()
};

// Memory for gathering that the caller keeps, so that nothing is allocated once it has grown.
struct GatherScratch {
  std::vector<float> coarse, lines, cut;
};

// Not synchronised: either one thread writes, or several read.
class CutField {
 public:
  // `tools`: the tools that cuts of this field may name. Shared with whoever adds tools.
  CutField(Case bone, BodyId body, std::shared_ptr<const ToolBox> tools = builtin_tool_box());
  ~CutField();
  CutField(CutField&&) noexcept;
  CutField& operator=(CutField&&) noexcept;

  // The cut's tool must be in the tool box, and must cut. Large cuts use as many threads as oneTBB allows
  // (tbb::global_control). The field and the report are the same for any number of threads.
  CutReport apply(const Cut& cut);
  // Applies the cut only to these leaves of its level, as if it reached no others.
  CutReport apply_to(const Cut& cut, std::span<const Coord> leaves);
  void reset(int level, Coord origin);  // resets a leaf to its state before any cut
  void restore(const FieldLeaf& leaf);  // sets one leaf, as on joining
  bool merge(const FieldLeaf& mask);    // R = min(R, mask), as in a split; true if anything changed

  // The leaves of its level that the cut can change, whatever was cut before: within its reach, and with bone. Sorted.
  [[nodiscard]] std::vector<Coord> reach(const Cut& cut) const;
  [[nodiscard]] const Case& bone() const;
  [[nodiscard]] BodyId body() const;
  [[nodiscard]] const std::shared_ptr<const ToolBox>& tools() const;
  [[nodiscard]] std::vector<FieldLeaf> leaves() const;  // sorted by (level, origin)
  // The same in two steps, for a reader that copies while the field changes. First the leaves without values, then the
  // present values of one leaf: one value if it is wholly cut away. A leaf never moves in memory.
  [[nodiscard]] std::vector<FieldLeaf> leaf_places() const;
  void read(FieldLeaf& leaf) const;
  [[nodiscard]] Digest hash() const;  // field_hash() of leaves()
  // whether any R in the box of that level is below the band
  [[nodiscard]] bool has_cuts(int level, const CoordBox& box) const;

  // R of one level, in samples of that level, z fastest. The band where nothing was cut.
  void gather_cuts(int level, const CoordBox& box, std::span<float> out) const;
  // S of the case on the samples of a level, trilinear between samples of level 0.
  void gather_surface(int level, const CoordBox& box, std::span<float> out) const;
  void gather_surface(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const;
  // f = max(S, −R₀, −R₁, −R₂) on the samples of a level: negative where bone is left, mm. Where a level
  // has no cut within its band, its R is ignored and f has the depth of S.
  void gather_solid(int level, const CoordBox& box, std::span<float> out) const;
  void gather_solid(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const;
  // Gathers both for a mesh block of 19³ samples. Writes nothing if all samples are on one side of the surface and no
  // cut is stored. Writes only f if there is no cut, because S is the same.
  enum class Gathered { nothing, solid, both };
  Gathered gather_block(int level, const CoordBox& box, std::span<float> solid, std::span<float> surface) const;
  // f at a point. Each grid is trilinear.
  [[nodiscard]] double solid_mm(const Vec3& point_mm) const;
  [[nodiscard]] std::size_t memory_bytes() const;  // of R: leaves, constants and their trees
  // Bone removed so far, mm³. Integrates the solid fraction of cells at the finest level that was cut.
  [[nodiscard]] double removed_mm3() const;

  struct Grids;

 private:
  void take_cuts(int level, const CoordBox& box, std::span<float> solid, GatherScratch& scratch) const;
  std::unique_ptr<Grids> grids_;
};

}  // namespace osteon
