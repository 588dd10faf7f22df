// The bone as a CT scanner would see it now: Hounsfield units of the case's scan, or from its density, without what was
// cut away. Slices and radiographs read it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"
#include "common/radiology/attenuation.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/replica.hpp"

namespace osteon::radiology {

// [A] Density without a line of its own, as of a mesh, becomes HU by this one. It is an extrapolation in cortex: bone
// of 1.92 g/cm³ has 1677 HU by it, and 1593.5 by its coefficients (attenuation.hpp). So cortex weakens
// rays 4 % too much.
inline constexpr DensityCalibration kDefaultLine = kRho1995;

// What sampling reads: attenuation in steps (attenuation.hpp), z fastest. All outer samples are air, and one more value
// follows the last. A brick is a cube of 8 cells, so its samples are 9³; bricks share the samples of their faces.
struct HuLattice {
  const std::uint16_t* steps = nullptr;
  Coord dims;
  const std::uint8_t* occupied = nullptr;  // one for each brick, z fastest: whether any sample is not air
  Coord bricks;
};

// Memory: 4 bytes for each sample in the box of bone and scan. Not synchronised: either one thread writes, or several
// read.
class BoneHu {
 public:
  // The bone before any cut. With a scan: its HU, trilinear, air beyond it. Otherwise from the density, and air is
  // where no bone is; a sample within half a pitch of the surface is partly bone. What the case has as metal is metal
  // in both (kMetal_per_mm). One thread. Errors: invalid_input (a scan without HU), exhausted (more samples than
  // kMostHuSamples), cancelled.
  [[nodiscard]] static Result<BoneHu> make(const Case& bone, const CaseScan* scan = nullptr,
                                           const KeepGoing& keep_going = {});

  // Brings all samples up to date. `bodies`: every body of the room, of this case; at least one. A sample keeps the
  // part of its bone that is still in a body: the mean of the solid fraction over its voxel, from the finest level of
  // the case. So a cut changes nothing where no bone was.
  // One thread; seconds for the largest bones. Error: cancelled; some samples are then as before, so renew again.
  [[nodiscard]] Result<void> renew(std::span<const CutField* const> bodies, const KeepGoing& keep_going = {});
  // The same for leaves that changed since. Returns boxes that hold every sample with another value than before.
  // Afterwards all is as after renew(). When a body is gone, it looks at every sample, as renew() does.
  std::vector<CoordBox> update(std::span<const CutField* const> bodies, std::span<const ChangedLeaves> changes);

  [[nodiscard]] double pitch_mm() const { return bone_.pitch_mm(); }
  [[nodiscard]] const CoordBox& box() const { return box_; }  // samples of level 0; beyond it is air
  [[nodiscard]] float hu(Coord sample) const;
  [[nodiscard]] double attenuation_per_mm(Coord sample) const;
  [[nodiscard]] HuLattice lattice() const;
  // A position in lattice coordinates, which count samples from the first one of the lattice.
  [[nodiscard]] Vec3 in_lattice(const Vec3& point_mm) const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  BoneHu(Case bone, const CoordBox& box);
  [[nodiscard]] bool fill_from_density(const KeepGoing& keep_going);
  [[nodiscard]] bool fill_from_scan(const CaseScan& scan, const KeepGoing& keep_going);
  void fill_metal();
  void restore(const CoordBox& box);
  void cut(std::span<const CutField* const> bodies, const CoordBox& box);
  CoordBox renew_box(std::span<const CutField* const> bodies, const CoordBox& box);
  bool note_bodies(std::span<const CutField* const> bodies);
  void note_occupied(const CoordBox& box);
  [[nodiscard]] bool any_cut(std::span<const CutField* const> bodies, const CoordBox& box) const;
  [[nodiscard]] std::size_t index(Coord sample) const;

  Case bone_;
  CoordBox box_;  // of the samples that may differ from air
  Coord dims_;    // of the lattice, with one layer of air around the box
  Coord bricks_;
  int level_ = 0;  // the finest of the case's cuts
  bool from_scan_ = false;
  std::vector<BodyId> seen_;  // the bodies of the last renew() or update()
  std::vector<std::uint16_t> uncut_, steps_;
  std::vector<std::uint8_t> occupied_;
};

inline constexpr std::int64_t kMostHuSamples = std::int64_t{1} << 29;

}  // namespace osteon::radiology
