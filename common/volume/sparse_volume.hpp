// A sparse grid of floats in leaves of 8³ samples: our view of an OpenVDB FloatGrid, without its headers.
#pragma once
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/block_gather.hpp"
#include "common/volume/vdb_size.hpp"

namespace osteon {

// Several threads may read at once; one that writes must be alone.
class SparseVolume {
 public:
  explicit SparseVolume(float background);
  ~SparseVolume();
  SparseVolume(SparseVolume&&) noexcept;
  SparseVolume& operator=(SparseVolume&&) noexcept;

  [[nodiscard]] float background() const;
  [[nodiscard]] float value(Coord sample) const;
  void gather(const CoordBox& box, std::span<float> out) const;  // z fastest
  // Only every `stride`th sample, a power of two up to kLeafSize: those at stride · box.
  void gather_every(std::int32_t stride, const CoordBox& box, std::span<float> out) const;
  // The leaves that meet the box, x slowest, and whether any of them is other than one of the background.
  bool view(const CoordBox& box, std::span<LeafView> leaves) const;
  // Whether any leaf, or constant other than the background, meets the box.
  [[nodiscard]] bool any_stored(const CoordBox& box) const;
  [[nodiscard]] double trilinear(const Vec3& index) const;  // at a point in samples

  // Leaves are named by their first sample, a multiple of kLeafSize. Without a leaf, all its samples have value().
  [[nodiscard]] const float* leaf(Coord origin) const;  // kLeafVoxels, z fastest, or null
  [[nodiscard]] float* edit_leaf(Coord origin);         // made with the value that was there
  void set_constant(Coord origin, float value);         // a leaf's worth of one value, stored without samples
  [[nodiscard]] std::vector<Coord> leaves() const;      // sorted
  [[nodiscard]] std::vector<Coord> constants() const;   // places of set_constant() other than the background; sorted

  // Many leaves at once: where each one's samples are, or null and the value that all of them have.
  struct Place {
    float* samples;
    float constant;
  };
  void find(std::span<const Coord> origins, std::span<Place> places);
  // A leaf made outside the volume, by any thread, and put in by the one that writes.
  struct LeafDeleter {
    void operator()(void* leaf) const;
  };
  using NewLeaf = std::unique_ptr<void, LeafDeleter>;
  [[nodiscard]] static NewLeaf make_leaf(Coord origin, std::span<const float, kLeafVoxels> samples);
  void put(NewLeaf leaf);  // in place of what was there

  [[nodiscard]] std::size_t memory_bytes() const;  // of the whole tree

  struct Impl;

 private:
  friend Result<void> save_volumes(const std::filesystem::path&, double,
                                   const std::vector<std::pair<std::string, const SparseVolume*>>&);
  friend Result<std::vector<SparseVolume>> load_volumes(const std::filesystem::path&, const std::vector<std::string>&,
                                                        const VdbLimits&);
  std::unique_ptr<Impl> impl_;
};

// A .vdb file with the named grids, each with the lattice's transform. Errors name the file.
[[nodiscard]] Result<void> save_volumes(const std::filesystem::path& file, double pitch_mm,
                                        const std::vector<std::pair<std::string, const SparseVolume*>>& volumes);
// The grids in the order of `names`. Nothing is allocated for a file beyond the limits. Errors: not_found,
// invalid_input (no such grid, wrong kind, damaged file), exhausted (beyond the limits).
[[nodiscard]] Result<std::vector<SparseVolume>> load_volumes(const std::filesystem::path& file,
                                                             const std::vector<std::string>& names,
                                                             const VdbLimits& limits);

}  // namespace osteon
