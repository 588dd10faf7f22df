// Label volumes as a folder of PNG slices whose colours name structures.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/imaging/label_volume.hpp"

namespace osteon::import {

struct BoneColour {
  std::string name;  // shown to people
  std::array<std::uint8_t, 3> rgb{};
  double density_g_cm3 = 1.9;
};

// The colours of bone. Every other colour, known or noise, is not bone.
struct LabelLegend {
  std::vector<BoneColour> bones{{"bone", {255, 249, 219}, 1.9}};
  int tolerance = 8;  // largest difference of red, green and blue, each
};

// "R,G,B" or "R,G,B:DENSITY_G_CM3".
[[nodiscard]] Result<BoneColour> parse_bone_colour(std::string_view text);
// A YAML file: `bones: [{name, colour: [r, g, b], density_g_cm3}]`, `tolerance` if wanted. Errors name the file.
[[nodiscard]] Result<LabelLegend> read_legend(const std::filesystem::path& file);

struct ColourCount {
  std::array<std::uint8_t, 4> rgba{};
  std::int64_t voxels = 0;
  int label = 0;  // as in LabelVolume: 0 is not bone
};

struct LabelStack {
  imaging::LabelVolume volume;       // labels in the order of the legend, from 1
  std::vector<ColourCount> colours;  // most frequent first
};

// Slices are ordered by the number at the end of their names. Columns go along x, rows along y, slices along z.
// Errors: not_found (no such folder), invalid_input (no PNG files; a slice that is missing, of another size or not a
// PNG; no bone colour at all), cancelled.
[[nodiscard]] Result<LabelStack> read_label_stack(const std::filesystem::path& folder, const LabelLegend& legend,
                                                  const Vec3& spacing_mm, const KeepGoing& keep_going);

}  // namespace osteon::import
