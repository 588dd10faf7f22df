// The bone around the tool as the haptic loop feels it. Fine bricks, at the pitch of the tool's cuts, surround its
// cutting part. Coarse bricks, at h, surround the whole tool. PatchBuilder builds it on another thread; afterwards it
// is read-only.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon::haptic {

// Samples of 8³ cells with an apron of one sample on the upper sides. So every point in the cells can be interpolated.
inline constexpr int kBrickCells = 8;
inline constexpr int kBrickSamples = kBrickCells + 1;
struct Brick {
  std::array<float, kBrickSamples * kBrickSamples * kBrickSamples> values;  // z fastest
};

// A box of bricks of one level; positions without a brick are unknown.
class BrickGrid {
 public:
  // Covers bricks `first` to `last`, both included, counted in bricks of this pitch; all unknown. Its memory is reused.
  void reset(double pitch_mm, Coord first, Coord last);
  // A brick is owned by the patches that hold it and by the builder's store; the haptic thread owns none.
  void set(Coord brick, std::shared_ptr<const Brick> values);
  [[nodiscard]] double pitch_mm() const { return pitch_mm_; }
  [[nodiscard]] Coord first() const { return first_; }
  [[nodiscard]] Coord dims() const { return dims_; }
  // Samples of each brick or null, z fastest: dims().x * dims().y * dims().z of them.
  [[nodiscard]] const float* const* tables() const { return tables_.data(); }
  // Trilinear; false where no brick covers the point.
  [[nodiscard]] bool sample(const Vec3& point_mm, double& value) const noexcept;

 private:
  double pitch_mm_ = 0;
  Coord first_, dims_;
  std::vector<std::shared_ptr<const Brick>> bricks_;  // that were set
  std::vector<const float*> tables_;
};

// Lower bound of the distance to bone, for every point of cells as wide as a brick at h. It comes from the case; cuts
// only remove its bone. It reaches farther than the bricks do.
struct Clearance {
  Digest bone;  // hash of the case
  CoordBox cells;
  double cell_mm = 0;
  std::vector<float> mm;  // z fastest; zero: unknown
};

struct Patch {
  BrickGrid fine;          // f, mm: negative in bone
  BrickGrid coarse;        // f
  BrickGrid density;       // g/cm³, at h, of the same bricks as `coarse`
  BrickGrid metal;         // at h, where metal is near: 1 at its samples and in the air beside them, else 0
  bool has_metal = false;  // any metal brick is present
  Clearance clearance;
  std::uint64_t own_cuts = 0;  // own cuts up to this number are included
  RoomSeq room_seq;            // committed events up to this one are included
  std::uint64_t version = 0;   // 0: never filled

  // f at a point, from a fine brick where there is one. Returns false where the patch does not reach.
  [[nodiscard]] bool solid(const Vec3& point_mm, double& solid_mm) const noexcept {
    return fine.sample(point_mm, solid_mm) || coarse.sample(point_mm, solid_mm);
  }
  [[nodiscard]] double density_at(const Vec3& point_mm) const noexcept {
    double value = 0.0;
    return density.sample(point_mm, value) ? value : 0.0;
  }
  // Of a point in the bone.
  [[nodiscard]] bool is_metal(const Vec3& point_mm) const noexcept {
    double value = 0.0;
    return has_metal && metal.sample(point_mm, value) && value >= 0.5;
  }
};

}  // namespace osteon::haptic
