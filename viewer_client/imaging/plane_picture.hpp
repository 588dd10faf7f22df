// The picture of a plane of a scan: grey values, with islands and everything above a threshold tinted.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "viewer_client/imaging/corrected_plane.hpp"
#include "viewer_client/imaging/hu_window.hpp"
#include "viewer_client/imaging/island_map.hpp"
#include "viewer_client/imaging/plane_view.hpp"

namespace osteon {

struct Tint {
  std::uint8_t red = 0, green = 0, blue = 0, strength = 0;  // 0: none; 255: the colour alone
  friend bool operator==(const Tint&, const Tint&) = default;
};
// A colour for an island. Neighbours in the list differ. One that is left out is pale.
[[nodiscard]] Tint tint_of(int island, bool kept);
inline constexpr Tint kThresholdTint{255, 200, 40, 110}, kErasedTint{235, 40, 40, 120}, kEdgeTint{60, 255, 255, 200};

struct PlaneLook {
  HuWindow window;
  std::optional<double> threshold_hu;  // voxels at or above it are tinted
  std::array<Tint, 256> islands{};     // by number; that of 0 is not used
  std::array<Tint, 256> bones{};       // the same of what is painted
  BonesOfIslands kept{};
  std::vector<SharedCorrection> corrections;
  std::optional<MarkedBox> box;  // the threshold tints nothing beside it
  // 1: a voxel of an edge, tinted over all else. Of the same grid as the scan; empty: none are shown.
  VoxelFile<std::uint8_t> edges = {};
};

// Gives bones and islands their tints. A bone has the colour of the first island in which it is the shown one, or else
// one by its number, and the opacity of its label. A kept island has the tint of its shown bone.
void set_tints(PlaneLook& look, std::span<const BoneLabel> labels);
// Of the surface of a bone with this tint: 1 is opaque, as its tint is at its strongest.
[[nodiscard]] double opacity_of(const Tint& tint);

// One pixel for each voxel, 0xffRRGGBB, rows from the top. With a threshold the islands, which are of another one, are
// not tinted. Corrections are tinted over all else.
[[nodiscard]] std::vector<std::uint32_t> draw_plane(const ShownScan& scan, const IslandMap& islands,
                                                    const PlaneAxes& axes, int slice, const PlaneLook& look,
                                                    const GreyTable& greys);

}  // namespace osteon
