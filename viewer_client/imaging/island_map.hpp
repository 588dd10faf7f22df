// The islands of a scan: which voxel belongs to which, and where a seed in one of them is.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "viewer_client/imaging/island_pictures.hpp"
#include "viewer_client/imaging/scan_file.hpp"

namespace osteon {

// As "osteon-import islands" lists it.
struct ListedIsland {
  int number = 0;    // from 1, largest first
  std::string kind;  // bone, table, cast, metal or contrast
  double volume_cm3 = 0.0, density_g_cm3 = 0.0;
  Vec3 centre_mm = Vec3::Zero();
  IslandPicture picture;  // the window makes it
};

// A part of a scan, with the island of each of its voxels.
class IslandMap {
 public:
  // None.
  IslandMap() = default;
  // `numbers` lie on voxels of the scan. Error: invalid_input (they do not).
  [[nodiscard]] static Result<IslandMap> make(const ScanGeometry& scan, VoxelFile<std::uint8_t> numbers);

  // Of a voxel of the scan; 0: it is in none.
  [[nodiscard]] std::uint8_t number(const std::array<int, 3>& voxel) const {
    const std::array<int, 3> in_part{voxel[0] - first_[0], voxel[1] - first_[1], voxel[2] - first_[2]};
    return numbers_.contains(in_part) ? numbers_.at(in_part) : std::uint8_t{0};
  }
  // The voxel of an island, at or above the threshold, that is nearest to another voxel of the scan. A bone grows from
  // such voxels only. Nothing: the island has none.
  [[nodiscard]] std::optional<std::array<int, 3>> seed_near(const ShownScan& scan, int island, double threshold_hu,
                                                            const std::array<int, 3>& voxel) const;
  // The same in the largest piece of the island that is connected across faces, because a seed grows across them. Other
  // pieces touch that one at corners and edges only.
  [[nodiscard]] std::optional<std::array<int, 3>> main_seed_near(const ShownScan& scan, int island, double threshold_hu,
                                                                 const std::array<int, 3>& voxel) const;
  // Seeds that were put at another threshold, as they are at this one: what lies below it moves within its island, and
  // what lies in no island goes.
  [[nodiscard]] std::vector<Vec3> moved_seeds(const ShownScan& scan, double threshold_hu,
                                              std::span<const Vec3> seeds_mm) const;

 private:
  // Whether a bone may grow through a voxel of the part.
  [[nodiscard]] std::vector<bool> growing(const ShownScan& scan, int island, double threshold_hu) const;
  [[nodiscard]] std::array<int, 3> in_scan(std::size_t index) const;

  std::array<int, 3> first_{};  // of the part, in the scan
  VoxelFile<std::uint8_t> numbers_;
};

// The voxel at a position; nothing beyond the scan.
[[nodiscard]] std::optional<std::array<int, 3>> voxel_of(const ScanGeometry& scan, const Vec3& at_mm);
[[nodiscard]] Vec3 centre_of(const ScanGeometry& scan, const std::array<int, 3>& voxel);

}  // namespace osteon
