// The cut field R of one body: the only mutable part of a bone. R(x) = min over cuts of the distance to the swept tool.
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

// Counts of samples as in Niu 2008, §5.4, where whole leaves are passed over. Computed ones are those whose distance
// was evaluated. That a leaf lies beyond the tool's band, wholly within it, or has nothing left that this cut could
// lower is seen at its middle, so its samples are visited only; those wholly within it are modified without being
// computed.
struct CutReport {
  std::int64_t visited = 0;  // of the leaves of the swept tool's world bounding block, grown by the band
  std::int64_t computed = 0;
  std::int64_t modified = 0;  // those that changed
  int level = 0;
  std::vector<Coord> changed_leaves;  // origins, samples of the level
  std::vector<Coord> reached_leaves;  // those of bone that the cut can change, on any field of the case: reach()
};

// Memory for gathering that a caller keeps, so that nothing is allocated once it has grown.
struct GatherScratch {
  std::vector<float> coarse, lines, cut;
};

// Not synchronised: one thread writes, or several read.
class CutField {
 public:
  // `tools`: those that cuts of this field may name; shared with whoever adds to them.
  CutField(Case bone, BodyId body, std::shared_ptr<const ToolBox> tools = builtin_tool_box());
  ~CutField();
  CutField(CutField&&) noexcept;
  CutField& operator=(CutField&&) noexcept;

  // Its tool must be in the box, and cut. Large cuts are shared out to as many threads as oneTBB may use
  // (tbb::global_control); the field and the report are the same for any number.
  CutReport apply(const Cut& cut);
  // To these leaves of its level only, as if it reached no others.
  CutReport apply_to(const Cut& cut, std::span<const Coord> leaves);
  void reset(int level, Coord origin);  // a leaf as it is before any cut
  void restore(const FieldLeaf& leaf);  // sets one leaf, as on joining
  bool merge(const FieldLeaf& mask);    // R = min(R, mask), as a split does; whether anything changed

  // The leaves of its level that a cut can change, whatever was cut before: within its reach, and of bone. Sorted.
  [[nodiscard]] std::vector<Coord> reach(const Cut& cut) const;
  [[nodiscard]] const Case& bone() const;
  [[nodiscard]] BodyId body() const;
  [[nodiscard]] const std::shared_ptr<const ToolBox>& tools() const;
  [[nodiscard]] std::vector<FieldLeaf> leaves() const;  // sorted by (level, origin)
  // The same in two steps, for a reader that cannot hold the field still while it copies: the leaves without values,
  // then the present values of one of them: one value where all are gone. A leaf stays in its place for ever.
  [[nodiscard]] std::vector<FieldLeaf> leaf_places() const;
  void read(FieldLeaf& leaf) const;
  [[nodiscard]] Digest hash() const;                                  // field_hash of leaves()
  [[nodiscard]] bool has_cuts(int level, const CoordBox& box) const;  // any R below the band in the box of that level

  // R of one level, samples of that level, z fastest; the band where nothing was cut.
  void gather_cuts(int level, const CoordBox& box, std::span<float> out) const;
  // S of the case on the samples of a level, trilinear between those of level 0.
  void gather_surface(int level, const CoordBox& box, std::span<float> out) const;
  void gather_surface(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const;
  // f = max(S, −R₀, −R₁, −R₂) on the samples of a level: negative where bone is left, mm. Where no cut is within the
  // band of a level, its R says nothing and f has the depth of S.
  void gather_solid(int level, const CoordBox& box, std::span<float> out) const;
  void gather_solid(int level, const CoordBox& box, std::span<float> out, GatherScratch& scratch) const;
  // Both at once for a mesh block of 19³ samples. Nothing is written where all samples are on one side of the surface
  // and no cut is stored, and f alone where there is no cut: S is the same.
  enum class Gathered { nothing, solid, both };
  Gathered gather_block(int level, const CoordBox& box, std::span<float> solid, std::span<float> surface) const;
  // f at a point, each grid trilinear.
  [[nodiscard]] double solid_mm(const Vec3& point_mm) const;
  [[nodiscard]] std::size_t memory_bytes() const;  // of R: leaves, constants and the trees over them
  // Bone removed so far, by integrating the solid fraction of cells at the finest level that was cut, mm³.
  [[nodiscard]] double removed_mm3() const;

  struct Grids;

 private:
  void take_cuts(int level, const CoordBox& box, std::span<float> solid, GatherScratch& scratch) const;
  std::unique_ptr<Grids> grids_;
};

}  // namespace osteon
