#include "common/surface/mesh_block.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"
#include "common/surface/marching_cubes.hpp"

namespace osteon {
namespace {

// Payload: solid bit of each of 17³ samples, the covered groups, then for each vertex in the order of its edge its
// place along the edge, its normal, and at last one cut bit each.
constexpr int kN = kBlockSamples;
constexpr std::size_t kSamples = static_cast<std::size_t>(kN) * kN * kN;
constexpr std::size_t kSignBytes = (kSamples + 7) / 8;
constexpr std::size_t kCoveredBytes = sizeof(CoveredGroups);
constexpr std::size_t kEdges = 3 * kSamples;
constexpr std::size_t kStride[3] = {static_cast<std::size_t>(kN) * kN, static_cast<std::size_t>(kN), 1};
constexpr float kEdgeSteps = 255.0f;

using Signs = std::array<std::uint8_t, kSamples>;

std::size_t sample_index(int x, int y, int z) {
  return static_cast<std::size_t>(x) * kStride[0] + static_cast<std::size_t>(y) * kStride[1] + static_cast<std::size_t>(z);
}

bool is_covered(CoveredGroups covered, int x, int y, int z) {
  return (covered >> ((x / 4 * 4 + y / 4) * 4 + z / 4) & 1) != 0;
}

std::size_t edge_of(std::size_t sample, CellEdge edge) {
  const std::size_t corner = sample + ((edge.corner & 4) ? kStride[0] : 0) + ((edge.corner & 2) ? kStride[1] : 0) +
                             ((edge.corner & 1) ? kStride[2] : 0);
  return 3 * corner + edge.axis;
}

// Calls visit(first sample, case) for every cell that is drawn and crossed, in the order of samples.
template <class Visit>
void for_crossed_cells(const Signs& solid, CoveredGroups covered, Visit visit) {
  for (int x = 0; x < kBlockCells; ++x)
    for (int y = 0; y < kBlockCells; ++y)
      for (int z = 0; z < kBlockCells; ++z) {
        const std::size_t s = sample_index(x, y, z);
        int cell = 0;
        for (int i = 0; i < 8; ++i)
          cell |= solid[s + ((i & 4) ? kStride[0] : 0) + ((i & 2) ? kStride[1] : 0) + ((i & 1) ? kStride[2] : 0)] << i;
        if (cell == 0 || cell == 255 || is_covered(covered, x, y, z)) continue;
        visit(s, cell);
      }
}

// Edges that carry a vertex, ascending: this order names the vertices on both sides of the wire.
std::vector<std::uint32_t> vertex_edges(const Signs& solid, CoveredGroups covered) {
  const MarchingCubesTable& table = marching_cubes_table();
  std::vector<bool> used(kEdges, false);
  for_crossed_cells(solid, covered, [&](std::size_t s, int cell) {
    for (const auto& triangle : table.triangles[static_cast<std::size_t>(cell)])
      for (const std::uint8_t e : triangle) used[edge_of(s, table.edges[e])] = true;
  });
  std::vector<std::uint32_t> edges;
  for (std::size_t e = 0; e < kEdges; ++e)
    if (used[e]) edges.push_back(static_cast<std::uint32_t>(e));
  return edges;
}

// Unit vectors on the octahedron unfolded into a square (Meyer et al., On floating-point normal vectors, 2010).
std::array<std::uint8_t, 2> encode_normal(std::array<float, 3> n) {
  const float sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  if (!(sum > 0.0f)) return {128, 128};
  float u = n[0] / sum, v = n[1] / sum;
  if (n[2] < 0.0f) {
    const float folded = (1.0f - std::abs(v)) * (u < 0.0f ? -1.0f : 1.0f);
    v = (1.0f - std::abs(u)) * (v < 0.0f ? -1.0f : 1.0f);
    u = folded;
  }
  const auto byte = [](float t) { return static_cast<std::uint8_t>(std::lround((t * 0.5f + 0.5f) * 255.0f)); };
  return {byte(u), byte(v)};
}

std::array<float, 3> decode_normal(std::uint8_t a, std::uint8_t b) {
  float u = static_cast<float>(a) / 255.0f * 2.0f - 1.0f, v = static_cast<float>(b) / 255.0f * 2.0f - 1.0f;
  const float w = 1.0f - std::abs(u) - std::abs(v);
  if (w < 0.0f) {
    const float folded = (1.0f - std::abs(v)) * (u < 0.0f ? -1.0f : 1.0f);
    v = (1.0f - std::abs(u)) * (v < 0.0f ? -1.0f : 1.0f);
    u = folded;
  }
  const float length = std::sqrt(u * u + v * v + w * w);
  return {u / length, v / length, w / length};
}

// The block's own samples within the gathered ones, which have one more on every side.
struct Apron {
  std::span<const float> values;
  static constexpr std::size_t kRow = kBlockApron, kSlab = static_cast<std::size_t>(kBlockApron) * kBlockApron;
  static std::size_t at(std::size_t sample) {
    const std::size_t x = sample / kStride[0], y = sample / kStride[1] % kN, z = sample % kN;
    return (x + 1) * kSlab + (y + 1) * kRow + z + 1;
  }
  [[nodiscard]] std::array<float, 3> gradient(std::size_t i) const {
    return {values[i + kSlab] - values[i - kSlab], values[i + kRow] - values[i - kRow], values[i + 1] - values[i - 1]};
  }
};

Signs unpack_signs(std::span<const std::uint8_t> bytes) {
  Signs solid;
  for (std::size_t i = 0; i < kSamples; ++i) solid[i] = bytes[i / 8] >> (i % 8) & 1;
  return solid;
}

}  // namespace

CoordBox block_samples(const BlockKey& key) {
  const Coord first = kBlockCells * key.index;
  return {first - Coord{1, 1, 1}, first + Coord{kBlockCells + 1, kBlockCells + 1, kBlockCells + 1}};
}

BlockPayload encode_block(std::span<const float> solid_mm, std::span<const float> surface_mm, CoveredGroups covered,
                          double level_pitch_mm) {
  constexpr std::size_t kGathered = Apron::kSlab * kBlockApron;
  OSTEON_CHECK(solid_mm.size() == kGathered && surface_mm.size() == kGathered);
  const Apron f{solid_mm};
  Signs solid;
  bool any = false, all = true;
  for (std::size_t i = 0; i < kSamples; ++i) {
    solid[i] = solid_mm[Apron::at(i)] < 0.0f;
    any |= solid[i] != 0;
    all &= solid[i] != 0;
  }
  if (!any || all) return {};
  const std::vector<std::uint32_t> edges = vertex_edges(solid, covered);
  if (edges.empty()) return {};

  const std::size_t count = edges.size();
  BlockPayload payload;
  payload.bytes.assign(kSignBytes + kCoveredBytes + 3 * count + (count + 7) / 8, 0);
  std::uint8_t* out = payload.bytes.data();
  for (std::size_t i = 0; i < kSamples; ++i) out[i / 8] = static_cast<std::uint8_t>(out[i / 8] | solid[i] << (i % 8));
  out += kSignBytes;
  for (std::size_t i = 0; i < kCoveredBytes; ++i) out[i] = static_cast<std::uint8_t>(covered >> (8 * i));
  std::uint8_t* places = out + kCoveredBytes;
  std::uint8_t* normals = places + count;
  std::uint8_t* cuts = normals + 2 * count;

  constexpr std::size_t kNeighbour[3] = {Apron::kSlab, Apron::kRow, 1};
  // On the imported surface S is zero up to the rounding of the vertex's place.
  const float below_surface = -static_cast<float>(level_pitch_mm) / 32.0f;
  for (std::size_t v = 0; v < count; ++v) {
    const std::size_t a = Apron::at(edges[v] / 3), b = a + kNeighbour[edges[v] % 3];
    const float t = solid_mm[a] / (solid_mm[a] - solid_mm[b]);
    places[v] = static_cast<std::uint8_t>(std::lround(t * kEdgeSteps));
    const auto ga = f.gradient(a), gb = f.gradient(b);
    const auto normal = encode_normal({ga[0] + t * (gb[0] - ga[0]), ga[1] + t * (gb[1] - ga[1]), ga[2] + t * (gb[2] - ga[2])});
    normals[2 * v] = normal[0];
    normals[2 * v + 1] = normal[1];
    const float s = surface_mm[a] + t * (surface_mm[b] - surface_mm[a]);
    if (s < below_surface) cuts[v / 8] = static_cast<std::uint8_t>(cuts[v / 8] | 1 << (v % 8));
  }
  return payload;
}

Result<Mesh> decode_block(const BlockKey& key, const BlockPayload& payload, double level_pitch_mm) {
  Mesh mesh;
  if (payload.bytes.empty()) return mesh;
  const std::span bytes(payload.bytes);
  if (bytes.size() < kSignBytes + kCoveredBytes)
    return failure(ErrorCode::invalid_input, "a mesh block of " + std::to_string(bytes.size()) + " bytes is too short");
  const Signs solid = unpack_signs(bytes);
  CoveredGroups covered = 0;
  for (std::size_t i = 0; i < kCoveredBytes; ++i) covered |= CoveredGroups{bytes[kSignBytes + i]} << (8 * i);
  const std::vector<std::uint32_t> edges = vertex_edges(solid, covered);
  const std::size_t count = edges.size();
  if (bytes.size() != kSignBytes + kCoveredBytes + 3 * count + (count + 7) / 8)
    return failure(ErrorCode::invalid_input, "a mesh block of " + std::to_string(bytes.size()) + " bytes does not fit its " +
                       std::to_string(count) + " vertices");
  const auto places = bytes.subspan(kSignBytes + kCoveredBytes, count);
  const auto normals = bytes.subspan(kSignBytes + kCoveredBytes + count, 2 * count);
  const auto cuts = bytes.subspan(kSignBytes + kCoveredBytes + 3 * count);

  std::vector<std::uint32_t> vertex(kEdges);
  mesh.positions_mm.resize(count);
  mesh.normals.resize(count);
  mesh.cut_face.resize(count);
  const Coord first = kBlockCells * key.index;
  for (std::size_t v = 0; v < count; ++v) {
    vertex[edges[v]] = static_cast<std::uint32_t>(v);
    const std::size_t sample = edges[v] / 3;
    // From global integers, so that two blocks place a vertex that they share on the same bits.
    double place[3] = {static_cast<double>(first.x + static_cast<std::int32_t>(sample / kStride[0])),
                       static_cast<double>(first.y + static_cast<std::int32_t>(sample / kStride[1] % kN)),
                       static_cast<double>(first.z + static_cast<std::int32_t>(sample % kN))};
    place[edges[v] % 3] += static_cast<double>(places[v]) / static_cast<double>(kEdgeSteps);
    for (std::size_t k = 0; k < 3; ++k) mesh.positions_mm[v][k] = static_cast<float>(place[k] * level_pitch_mm);
    mesh.normals[v] = decode_normal(normals[2 * v], normals[2 * v + 1]);
    mesh.cut_face[v] = cuts[v / 8] >> (v % 8) & 1;
  }
  const MarchingCubesTable& table = marching_cubes_table();
  for_crossed_cells(solid, covered, [&](std::size_t s, int cell) {
    for (const auto& t : table.triangles[static_cast<std::size_t>(cell)])
      mesh.triangles.push_back({vertex[edge_of(s, table.edges[t[0]])], vertex[edge_of(s, table.edges[t[1]])],
                                vertex[edge_of(s, table.edges[t[2]])]});
  });
  return mesh;
}

Digest mesh_hash(const BlockPayload& payload) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(payload.bytes)));
  return hasher.finish();
}

Digest surface_hash(const std::map<BlockKey, Digest>& mesh_hashes) {
  Hasher hasher;
  for (const auto& [key, digest] : mesh_hashes) {
    hasher.integer(key.body.value);
    hasher.integer(static_cast<std::uint64_t>(key.level));
    for (const std::int32_t i : {key.index.x, key.index.y, key.index.z}) hasher.integer(static_cast<std::uint32_t>(i));
    hasher.bytes(std::as_bytes(std::span(digest.bytes)));
  }
  return hasher.finish();
}

}  // namespace osteon
