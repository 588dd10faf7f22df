// A sparse grid of floats in leaves of 8³ samples. It wraps an OpenVDB FloatGrid without its headers.
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

// Several threads may read at once. A writing thread must be alone.
class SparseVolume {
 public:
  explicit SparseVolume(float background);
  ~SparseVolume();
  SparseVolume(SparseVolume&&) noexcept;
  SparseVolume& operator=(SparseVolume&&) noexcept;

  [[nodiscard]] float background() const;
  [[nodiscard]] float value(Coord sample) const;
  void gather(const CoordBox& box, std::span<float> out) const;  // z fastest
  // Only every `stride`th sample: the samples at stride · box. `stride` is a power of two up to kLeafSize.
  void gather_every(std::int32_t stride, const CoordBox& box, std::span<float> out) const;
  // The leaves that meet the box, x slowest. True if any of them differs from the background.
  bool view(const CoordBox& box, std::span<LeafView> leaves) const;
  // Whether any leaf, or any constant other than the background, meets the box.
  [[nodiscard]] bool any_stored(const CoordBox& box) const;
  [[nodiscard]] double trilinear(const Vec3& index) const;  // at a point in samples

  // A leaf is named by its first sample, a multiple of kLeafSize. Without a leaf, value() gives the value of all its
  // samples.
  [[nodiscard]] const float* leaf(Coord origin) const;  // kLeafVoxels, z fastest, or null
  [[nodiscard]] float* edit_leaf(Coord origin);         // a new leaf gets the previous value
  void set_constant(Coord origin, float value);         // a leaf of one value, stored without samples
  [[nodiscard]] std::vector<Coord> leaves() const;      // sorted
  // origins of set_constant() with values other than the background; sorted
  [[nodiscard]] std::vector<Coord> constants() const;

  // Finds many leaves at once: the samples of each, or null and the value of all samples.
  struct Place {
    float* samples;
    float constant;
  };
  void find(std::span<const Coord> origins, std::span<Place> places);
  // A leaf made outside the volume by any thread. The writing thread puts it in.
  struct LeafDeleter {
    void operator()(void* leaf) const;
  };
  using NewLeaf = std::unique_ptr<void, LeafDeleter>;
  [[nodiscard]] static NewLeaf make_leaf(Coord origin, std::span<const float, kLeafVoxels> samples);
  void put(NewLeaf leaf);  // replaces what was there

  [[nodiscard]] std::size_t memory_bytes() const;  // of the whole tree

  struct Impl;

 private:
  friend Result<void> save_volumes(const std::filesystem::path&, double,
                                   const std::vector<std::pair<std::string, const SparseVolume*>>&);
  friend Result<std::vector<SparseVolume>> load_volumes(const std::filesystem::path&, const std::vector<std::string>&,
                                                        const VdbLimits&);
  std::unique_ptr<Impl> impl_;
};

// Writes a .vdb file with the named grids, each with the transform of the lattice. Errors name the file.
[[nodiscard]] Result<void> save_volumes(const std::filesystem::path& file, double pitch_mm,
                                        const std::vector<std::pair<std::string, const SparseVolume*>>& volumes);
// The grids in the order of `names`. Allocates nothing for a file beyond the limits. Errors: not_found, invalid_input
// (no such grid, wrong kind, damaged file), exhausted (beyond the limits).
[[nodiscard]] Result<std::vector<SparseVolume>> load_volumes(const std::filesystem::path& file,
                                                             const std::vector<std::string>& names,
                                                             const VdbLimits& limits);

}  // namespace osteon
