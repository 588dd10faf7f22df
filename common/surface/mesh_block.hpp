// The surface in blocks of 16³ cells: what the server makes after a cut and a viewer shows.
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
#include "common/geometry/lattice.hpp"

namespace osteon {

inline constexpr int kBlockCells = 16;                  // cells along a block's edge: 2 leaves
inline constexpr int kBlockSamples = kBlockCells + 1;   // samples along it
inline constexpr int kBlockApron = kBlockCells + 3;     // with one more on every side, for normals

struct BlockKey {
  BodyId body;
  int level = 0;
  Coord index;  // the block's first sample is index · 16, at that level
  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

// Samples that the mesher needs for a block: its own and one more on every side; kBlockApron³.
[[nodiscard]] CoordBox block_samples(const BlockKey& key);

// Triangles with shared vertices, bone frame, normals out of the bone.
struct Mesh {
  std::vector<std::array<float, 3>> positions_mm;
  std::vector<std::array<float, 3>> normals;
  std::vector<std::uint8_t> cut_face;  // 1 where the vertex lies on a cut, 0 on the imported surface
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Cells of a coarse block that a finer level draws: one bit for each of 4³ groups of 4³ cells, (x·4 + y)·4 + z.
using CoveredGroups = std::uint64_t;

// The canonical bytes of one block. From them `decode` rebuilds the same mesh everywhere.
struct BlockPayload {
  std::vector<std::uint8_t> bytes;  // empty: the block has no surface
  friend bool operator==(const BlockPayload&, const BlockPayload&) = default;
};

// Marching cubes on `solid_mm` (kBlockApron³ samples, z fastest, negative inside), leaving out covered cells.
// `surface_mm` is S on the same samples: a vertex below the imported surface lies on a cut face. Vertex places are
// quantised along their edges, so neighbouring blocks of one level meet bit for bit.
[[nodiscard]] BlockPayload encode_block(std::span<const float> solid_mm, std::span<const float> surface_mm,
                                        CoveredGroups covered, double level_pitch_mm);
// Error invalid_input: bytes that no encoder wrote.
[[nodiscard]] Result<Mesh> decode_block(const BlockKey& key, const BlockPayload& payload, double level_pitch_mm);
// The payload's digest, by which viewers check what they hold.
[[nodiscard]] Digest mesh_hash(const BlockPayload& payload);
// One name for a whole surface: over the mesh hashes of its blocks that are not empty, in the order of their keys.
[[nodiscard]] Digest surface_hash(const std::map<BlockKey, Digest>& mesh_hashes);

}  // namespace osteon
