// Which voxels of a scan are kept, slice by slice, as far as it is known before osteon-import makes the bone.
#pragma once
#include <array>
#include <bitset>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "viewer_client/imaging/corrected_plane.hpp"

namespace osteon {

// What decides whether a voxel is kept, besides the islands.
struct KeptParts {
  BonesOfIslands bones{};
  std::vector<SharedCorrection> corrections;  // in their order
  std::optional<MarkedBox> box;
  friend bool operator==(const KeptParts&, const KeptParts&) = default;
};

// The bones of the voxels that the planes show as kept (corrected_plane()), within the box. Holds one slice. Its
// arguments outlive it.
class KeptSlices {
 public:
  KeptSlices(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept);

  // Those that may have such a voxel, by shown_bone().
  [[nodiscard]] const std::bitset<256>& bones() const { return bones_; }
  // The box. Nothing beyond it is kept.
  [[nodiscard]] const VoxelRange& range() const { return range_; }
  // The bone of each voxel of a slice, 0 if it is not kept; columns fastest. Good until the next call.
  [[nodiscard]] std::span<const std::uint8_t> slice(int slice);

 private:
  const ScanGeometry& scan_;
  const IslandMap& islands_;
  const KeptParts& kept_;
  PlaneAxes axes_;
  VoxelRange range_;
  std::array<std::uint8_t, 256> of_island_{};
  std::bitset<256> bones_;
  std::vector<std::uint8_t> voxels_;
};

// Writes the kept voxels as an NRRD file, 1 for each and 0 for the others, for "osteon-import report --bone".
// `keep_going` is asked before each slice. Errors: internal (disk), cancelled. After an error there is no file.
[[nodiscard]] Result<void> write_kept(const std::filesystem::path& file, const ScanGeometry& scan,
                                      const IslandMap& islands, const KeptParts& kept, const KeepGoing& keep_going);

}  // namespace osteon
