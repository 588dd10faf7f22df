#include "viewer_client/imaging/plane_picture.hpp"

#include <cmath>

namespace osteon {

namespace {

constexpr std::array<Tint, 8> kIslandColours{{{70, 160, 255, 0},
                                              {255, 120, 60, 0},
                                              {90, 210, 90, 0},
                                              {220, 90, 220, 0},
                                              {60, 210, 210, 0},
                                              {240, 210, 60, 0},
                                              {160, 120, 255, 0},
                                              {255, 120, 160, 0}}};
constexpr std::uint8_t kKept = 130, kLeftOut = 35;

std::uint32_t mixed_channel(std::uint8_t grey, std::uint8_t colour, std::uint8_t strength) {
  constexpr std::uint32_t kAll = 255;
  return (grey * (kAll - strength) + std::uint32_t{colour} * strength + kAll / 2) / kAll;
}

std::uint32_t tinted(std::uint8_t grey, const Tint& tint) {
  return 0xff000000u | mixed_channel(grey, tint.red, tint.strength) << 16 |
         mixed_channel(grey, tint.green, tint.strength) << 8 | mixed_channel(grey, tint.blue, tint.strength);
}

}  // namespace

Tint tint_of(int island, bool kept) {
  Tint tint = kIslandColours[static_cast<std::size_t>(island - 1) % kIslandColours.size()];
  tint.strength = kept ? kKept : kLeftOut;
  return tint;
}

void set_tints(PlaneLook& look, std::span<const BoneLabel> labels) {
  for (std::size_t bone = 1; bone < look.bones.size(); ++bone) look.bones[bone] = tint_of(static_cast<int>(bone), true);
  std::bitset<256> coloured;
  for (std::size_t island = 1; island < look.islands.size(); ++island) {
    const auto bone = static_cast<std::size_t>(shown_bone(look.kept[island]));
    if (bone == 0 || coloured.test(bone)) continue;
    coloured.set(bone);
    look.bones[bone] = tint_of(static_cast<int>(island), true);
  }
  for (const BoneLabel& label : labels) {
    Tint& tint = look.bones[static_cast<std::size_t>(label.bone)];
    tint.strength = static_cast<std::uint8_t>(std::lround(tint.strength * label.opacity_percent / 100.0));
  }
  for (std::size_t island = 1; island < look.islands.size(); ++island) {
    const auto bone = static_cast<std::size_t>(shown_bone(look.kept[island]));
    look.islands[island] = bone != 0 ? look.bones[bone] : tint_of(static_cast<int>(island), false);
  }
}

double opacity_of(const Tint& tint) { return static_cast<double>(tint.strength) / kKept; }

std::vector<std::uint32_t> draw_plane(const ShownScan& scan, const IslandMap& islands, const PlaneAxes& axes, int slice,
                                      const PlaneLook& look, const GreyTable& greys) {
  std::vector<std::uint32_t> pixels;
  pixels.reserve(static_cast<std::size_t>(axes.columns) * static_cast<std::size_t>(axes.rows));
  const VoxelRange range = range_of(scan.geometry, look.box);
  const std::vector<std::uint8_t> corrected =
      corrected_plane(scan.geometry, islands, look.kept, axes, slice, look.corrections);
  for (int row = 0; row < axes.rows; ++row)
    for (int column = 0; column < axes.columns; ++column) {
      const std::array<int, 3> voxel = voxel_at(axes, column, row, slice);
      const std::int16_t hu = scan.at(voxel);
      const std::uint8_t island = islands.number(voxel);
      const std::uint8_t mark = corrected.empty() ? std::uint8_t{0} : corrected[pixels.size()];
      const bool above = look.threshold_hu && hu >= *look.threshold_hu && range.contains(voxel);
      const bool edge = !look.edges.values.empty() && look.edges.at(voxel) != 0;
      pixels.push_back(tinted(greys[hu], edge                                ? kEdgeTint
                                         : mark == kErased                   ? kErasedTint
                                         : mark != 0                         ? look.bones[mark]
                                         : island != 0 && !look.threshold_hu ? look.islands[island]
                                         : above                             ? kThresholdTint
                                                                             : Tint{}));
    }
  return pixels;
}

}  // namespace osteon
