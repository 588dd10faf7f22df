// Small pictures of the islands of a scan, by which a person knows them in a list.
#pragma once
#include <cstdint>
#include <vector>

#include "viewer_client/imaging/scan_file.hpp"

namespace osteon {

// A square of grey values, rows from the head to the feet and columns from the patient's right to the left. 0: the
// island is not there. The nearest of it is white, the farthest dark.
struct IslandPicture {
  int side_px = 0;
  std::vector<std::uint8_t> greys;
};

// Each island from the front, as large as the square allows, in the middle. At the number of the island; empty: it has
// no voxel. `numbers`: the island of each voxel, 0 for none. Reads them twice.
[[nodiscard]] std::vector<IslandPicture> island_pictures(const VoxelFile<std::uint8_t>& numbers, int side_px);

}  // namespace osteon
