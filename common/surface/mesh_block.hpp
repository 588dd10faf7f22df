// The surface in blocks of 16³ cells. The server makes them after a cut, and viewers show them.
#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/core/result.hpp"
#include "common/field/tissue.hpp"
#include "common/geometry/lattice.hpp"

namespace osteon {

inline constexpr int kBlockCells = 16;                           // cells along a block's edge: 2 leaves
inline constexpr int kBlockSamples = kBlockCells + 1;            // samples along it
inline constexpr int kBlockApron = kBlockCells + 3;              // with one more on every side, for normals
inline constexpr int kCoarsestLevel = -2;                        // pitch 4 h, for distant surfaces
inline constexpr int kSeamSteps = kLevels - 1 - kCoarsestLevel;  // levels between the finest and the coarsest

struct BlockKey {
  BodyId body;
  int level = 0;  // kCoarsestLevel to kLevels - 1
  Coord index;    // the block's first sample is index · 16, at that level
  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

// Samples that the mesher needs for a block: its own and one more on every side; kBlockApron³.
[[nodiscard]] CoordBox block_samples(const BlockKey& key);

// Triangles with shared vertices, bone frame, normals out of the bone.
struct Mesh {
  std::vector<std::array<float, 3>> positions_mm;
  std::vector<std::array<float, 3>> normals;
  std::vector<std::uint8_t> cut_face;  // 1 if the vertex lies on a cut, 0 on the imported surface
  std::vector<Tissue> tissue;          // of each vertex: metal, enamel, or none for all else; empty: none at all
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Cells of a coarse block that are drawn at a finer level: one bit for each of 4³ groups of 4³ cells, (x·4 + y)·4
// + z.
using CoveredGroups = std::uint64_t;
inline constexpr CoveredGroups kWhollyCovered = ~CoveredGroups{0};

// How many levels coarser the surroundings of a block are drawn, in half blocks: 4³ of them, (x·4 + y)·4 + z. The
// inner 2³ are the block itself and stay 0. Finer or equal surroundings are 0.
struct Seams {
  std::array<std::uint8_t, 64> coarser{};
  [[nodiscard]] int most() const;  // 0: no seam
  friend bool operator==(const Seams&, const Seams&) = default;
};

// The data for making a block. It is a copy, so the bone may change in the meantime.
struct BlockSamples {
  BlockKey key;
  double level_pitch_mm = 0;
  std::vector<float> solid_mm;    // f on block_samples(key), negative where bone is left
  std::vector<float> surface_mm;  // S on the same samples: a vertex below the imported surface is on a cut face
  bool uncut = false;             // solid_mm equals S, and surface_mm is not read
  std::vector<Tissue> tissue;     // metal, enamel or none on the same samples; empty: none at all
  CoveredGroups covered = 0;      // kWhollyCovered: the block is not drawn, and the other members are not read
  Seams seams;
  // For each number of levels in `seams`: f on coarse_samples(key, steps), for the normals on that seam.
  std::array<std::vector<float>, kSeamSteps> coarse_mm;
};
// The samples of a level `steps` coarser that lie on the block, and one more on every side.
[[nodiscard]] CoordBox coarse_samples(const BlockKey& key, int steps);

// The canonical bytes of one block. `decode_block` rebuilds the same mesh from them everywhere.
struct BlockPayload {
  std::vector<std::uint8_t> bytes;  // empty: the block has no surface
  friend bool operator==(const BlockPayload&, const BlockPayload&) = default;
};

// Marching cubes without covered cells. Vertex positions are quantised along their edges, so neighbouring blocks of one
// level match bit for bit. On a seam the finer block uses the contour of the coarser one, so they match there too.
[[nodiscard]] BlockPayload encode_block(const BlockSamples& samples);
// The same for a block without seams.
[[nodiscard]] BlockPayload encode_block(std::span<const float> solid_mm, std::span<const float> surface_mm,
                                        CoveredGroups covered, double level_pitch_mm);
// Error invalid_input: bytes that no encoder writes.
[[nodiscard]] Result<Mesh> decode_block(const BlockKey& key, const BlockPayload& payload, double level_pitch_mm);
// Makes the mesh without a payload. Equal to decode_block(encode_block()), except that normals are not quantised.
// Reuses the memory of `mesh`.
void mesh_block(const BlockSamples& samples, Mesh& mesh);

// The payload's digest, with which viewers check what they received.
[[nodiscard]] Digest mesh_hash(const BlockPayload& payload);
// Hash of a whole surface: over the mesh hashes of its non-empty blocks, in the order of their keys.
[[nodiscard]] Digest surface_hash(const std::map<BlockKey, Digest>& mesh_hashes);

}  // namespace osteon
