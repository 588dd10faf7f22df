// Copies the data for a block out of a field. The field may be anything that gathers its solid distance and S as
// CutField does.
#pragma once
#include <vector>

#include "common/surface/surface_blocks.hpp"

namespace osteon {

// Levels coarser than the case's own use every 2nd or 4th sample of it, one plane at a time.
template <class Gather>
void gather_level(const Gather& gather, int level, const CoordBox& box, std::vector<float>& out) {
  const Coord n = box.dims();
  out.resize(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  if (level >= 0) return gather(level, box, std::span<float>(out));
  const std::int32_t every = 1 << -level;
  std::vector<float> plane;
  std::size_t i = 0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x) {
    const CoordBox at{{every * x, every * box.min.y, every * box.min.z},
                      {every * x, every * box.max.y, every * box.max.z}};
    const Coord d = at.dims();
    plane.resize(static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z));
    gather(0, at, std::span<float>(plane));
    for (std::int32_t y = 0; y < d.y; y += every)
      for (std::int32_t z = 0; z < d.z; z += every)
        out[i++] = plane[static_cast<std::size_t>(y) * static_cast<std::size_t>(d.z) + static_cast<std::size_t>(z)];
  }
}

// Fills `out` and reuses its memory. Sets kWhollyCovered if there is no surface.
template <class Field>
void gather_block(const Field& field, const SurfaceBlocks& blocks, const BlockKey& key, double pitch_mm,
                  BlockSamples& out) {
  out.key = key;
  out.level_pitch_mm = level_pitch_mm(pitch_mm, key.level);
  out.covered = blocks.covered(key);
  out.seams = {};
  out.uncut = false;
  out.tissue.clear();
  if (out.covered == kWhollyCovered) return;
  out.seams = blocks.seams(key);
  const auto solid = [&](int level, const CoordBox& box, std::span<float> to) { field.gather_solid(level, box, to); };
  const auto surface = [&](int level, const CoordBox& box, std::span<float> to) {
    field.gather_surface(level, box, to);
  };
  const CoordBox box = block_samples(key);
  if (key.level >= 0) {
    constexpr std::size_t kSamples = static_cast<std::size_t>(kBlockApron) * kBlockApron * kBlockApron;
    out.solid_mm.resize(kSamples);
    out.surface_mm.resize(kSamples);
    const auto gathered = field.gather_block(key.level, box, out.solid_mm, out.surface_mm);
    if (gathered == Field::Gathered::nothing) {
      out.covered = kWhollyCovered;
      return;
    }
    out.uncut = gathered == Field::Gathered::solid;
  } else {
    gather_level(solid, key.level, box, out.solid_mm);
    gather_level(surface, key.level, box, out.surface_mm);
  }
  // The samples of level 0 that are nearest to samples of this level.
  const int level = key.level;
  const Coord beyond{1, 1, 1};
  const CoordBox at_h = level >= 0 ? CoordBox{shift_down(box.min, level), shift_down(box.max, level) + beyond}
                                   : CoordBox{(1 << -level) * box.min, (1 << -level) * box.max};
  if (field.bone().has_hard(at_h)) {
    out.tissue.resize(out.solid_mm.size());
    field.bone().gather_hard(level, box, out.tissue);
  }
  std::array<bool, kSeamSteps + 1> meets{};
  for (const std::uint8_t steps : out.seams.coarser) meets[steps] = true;
  for (int steps = 1; steps <= kSeamSteps; ++steps)
    if (meets[static_cast<std::size_t>(steps)])
      gather_level(solid, key.level - steps, coarse_samples(key, steps),
                   out.coarse_mm[static_cast<std::size_t>(steps - 1)]);
}

}  // namespace osteon
