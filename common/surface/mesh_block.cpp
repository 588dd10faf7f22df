#include "common/surface/mesh_block.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "common/core/check.hpp"
#include "common/surface/contour.hpp"

namespace osteon {
namespace {

// Payload: flags; covered groups and seams if there are any; solid bits as described below. Then for each vertex in the
// order of the contour: its position along the edge, its normal, one cut bit if vertices differ in it, and two bits of
// tissue if any is metal or enamel.
constexpr int kN = kBlockSamples;
constexpr std::uint8_t kHasCovered = 1, kHasSeams = 2, kAllCut = 4, kSomeCut = 8, kHasTissue = 16, kFlags = 31;
// Two bits of a vertex are an index in kTissues.
constexpr std::array kTissues{Tissue::none, Tissue::metal, Tissue::enamel};
constexpr std::size_t kGathered = static_cast<std::size_t>(kBlockApron) * kBlockApron * kBlockApron;

// Solid bits are coded row by row of samples, x slowest, as the difference from a prediction by the three previous
// rows, which continues a plane. One byte is a run of rows without difference, or one run of differing bits by length
// and start. Other rows take four bytes.
constexpr unsigned kSameRows = 64, kDifferenceLengths = 11, kRawRow = 255;

std::uint32_t expected_row(const SolidRows& rows, std::size_t x, std::size_t y) {
  const std::uint32_t a = y > 0 ? rows[x][y - 1] : 0, b = x > 0 ? rows[x - 1][y] : 0,
                      c = x > 0 && y > 0 ? rows[x - 1][y - 1] : 0;
  return (a & b) | (~c & (a ^ b));
}

void write_rows(const SolidRows& rows, std::vector<std::uint8_t>& out) {
  unsigned same = 0;
  const auto flush = [&] {
    if (same > 0) out.push_back(static_cast<std::uint8_t>(same - 1));
    same = 0;
  };
  for (std::size_t x = 0; x < kN; ++x)
    for (std::size_t y = 0; y < kN; ++y) {
      const std::uint32_t difference = rows[x][y] ^ expected_row(rows, x, y);
      if (difference == 0) {
        if (++same == kSameRows) flush();
        continue;
      }
      flush();
      const auto start = static_cast<unsigned>(std::countr_zero(difference));
      const std::uint32_t run = difference >> start;
      if ((run & (run + 1)) == 0 && std::bit_width(run) <= static_cast<int>(kDifferenceLengths)) {
        out.push_back(
            static_cast<std::uint8_t>(kSameRows + (static_cast<unsigned>(std::bit_width(run)) - 1) * kN + start));
      } else {
        for (const std::uint32_t byte : {kRawRow, difference & 255u, difference >> 8 & 255u, difference >> 16})
          out.push_back(static_cast<std::uint8_t>(byte));
      }
    }
  flush();
}

// Takes bytes from the front. False if write_rows() did not write them.
bool read_rows(std::span<const std::uint8_t>& bytes, SolidRows& rows) {
  constexpr std::uint32_t kRow = (1u << kN) - 1;
  unsigned same = 0;
  const auto take = [&]() -> unsigned {
    const unsigned byte = bytes.front();
    bytes = bytes.subspan(1);
    return byte;
  };
  for (std::size_t x = 0; x < kN; ++x)
    for (std::size_t y = 0; y < kN; ++y) {
      std::uint32_t difference = 0;
      if (same > 0) {
        --same;
      } else {
        if (bytes.empty()) return false;
        const unsigned byte = take();
        if (byte < kSameRows) {
          same = byte;
        } else if (byte < kSameRows + kDifferenceLengths * kN) {
          const unsigned length = (byte - kSameRows) / kN + 1, start = (byte - kSameRows) % kN;
          difference = ((1u << length) - 1) << start;
        } else {
          if (byte != kRawRow || bytes.size() < 3) return false;
          difference = take();
          difference |= take() << 8;
          difference |= take() << 16;
        }
        if (difference > kRow) return false;
      }
      rows[x][y] = (difference ^ expected_row(rows, x, y)) & kRow;
    }
  return same == 0;
}

void write_seams(const Seams& seams, std::vector<std::uint8_t>& out) {
  std::uint64_t where = 0;
  for (std::size_t i = 0; i < seams.coarser.size(); ++i)
    if (seams.coarser[i] != 0) where |= std::uint64_t{1} << i;
  for (int i = 0; i < 8; ++i) out.push_back(static_cast<std::uint8_t>(where >> (8 * i)));
  bool half = false;
  for (const std::uint8_t steps : seams.coarser) {
    if (steps == 0) continue;
    if (half)
      out.back() = static_cast<std::uint8_t>(out.back() | steps << 4);
    else
      out.push_back(steps);
    half = !half;
  }
}

// A coarse face as large as the block has one neighbour. Otherwise its quarters would not agree.
bool whole_faces(const Seams& seams) {
  const SeamRule rule(seams);
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, 4}) {
      int largest = 0;
      for (int i = 0; i < 4; ++i) {
        std::array<int, 3> place{};
        place[static_cast<std::size_t>(axis)] = side;
        place[static_cast<std::size_t>((axis + 1) % 3)] = 1 + 2 * (i / 2);
        place[static_cast<std::size_t>((axis + 2) % 3)] = 1 + 2 * (i % 2);
        largest += rule.steps(place[0], place[1], place[2]) == kSeamSteps;
      }
      if (largest != 0 && largest != 4) return false;
    }
  return true;
}

bool read_seams(std::span<const std::uint8_t>& bytes, Seams& seams) {
  if (bytes.size() < 8) return false;
  std::uint64_t where = 0;
  for (std::size_t i = 0; i < 8; ++i) where |= std::uint64_t{bytes[i]} << (8 * i);
  bytes = bytes.subspan(8);
  const auto count = static_cast<std::size_t>(std::popcount(where));
  if (bytes.size() < (count + 1) / 2) return false;
  std::size_t n = 0;
  for (std::size_t i = 0; i < seams.coarser.size(); ++i) {
    if ((where >> i & 1) == 0) continue;
    const unsigned steps = bytes[n / 2] >> (n % 2 * 4) & 15u;
    ++n;
    const std::size_t x = i / 16, y = i / 4 % 4, z = i % 4;
    const bool inner = (x == 1 || x == 2) && (y == 1 || y == 2) && (z == 1 || z == 2);
    if (inner || steps == 0 || steps > kSeamSteps) return false;
    seams.coarser[i] = static_cast<std::uint8_t>(steps);
  }
  bytes = bytes.subspan((count + 1) / 2);
  return whole_faces(seams);
}

// Unit vectors on the octahedron unfolded to a square (Meyer 2010).
std::array<std::uint8_t, 2> encode_normal(std::array<float, 3> n) {
  const float sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  if (!(sum > 0.0f)) return {128, 128};
  float u = n[0] / sum, v = n[1] / sum;
  if (n[2] < 0.0f) {
    const float folded = (1.0f - std::abs(v)) * (u < 0.0f ? -1.0f : 1.0f);
    v = (1.0f - std::abs(u)) * (v < 0.0f ? -1.0f : 1.0f);
    u = folded;
  }
  const auto byte = [](float t) { return static_cast<std::uint8_t>((t * 0.5f + 0.5f) * 255.0f + 0.5f); };
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

// Which of the 17 samples of a row are solid. Reads nothing after them.
std::uint32_t solid_bits(const float* row) {
  std::uint32_t bits = row[16] < 0.0f ? 1u << 16 : 0u;
#if defined(__SSE2__)
  const __m128 zero = _mm_setzero_ps();
  for (int i = 0; i < 4; ++i)
    bits |= static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmplt_ps(_mm_loadu_ps(row + 4 * i), zero))) << (4 * i);
#else
  for (int i = 0; i < 16; ++i) bits |= (row[i] < 0.0f ? 1u : 0u) << i;
#endif
  return bits;
}

constexpr std::size_t kSlab = static_cast<std::size_t>(kBlockApron) * kBlockApron, kRow = kBlockApron;
constexpr std::array<std::size_t, 3> kNeighbour{kSlab, kRow, 1};

std::size_t gathered(std::size_t x, std::size_t y, std::size_t z) { return (x + 1) * kSlab + (y + 1) * kRow + z + 1; }

std::array<float, 3> gradient_between(const float* a, const float* b, float t, std::size_t slab, std::size_t row) {
  const auto axis = [&](std::size_t n) {
    const float at_a = a[n] - *(a - n), at_b = b[n] - *(b - n);
    return at_a + t * (at_b - at_a);
  };
  return {axis(slab), axis(row), axis(1)};
}

struct Vertex {
  int place = 0;  // position along its edge, 252ths
  std::array<float, 3> gradient{};
  bool cut = false;
  Tissue tissue = Tissue::none;
};

// The field around one block, its contour, and the vertices on it.
class Mesher {
 public:
  // False if the block has no surface.
  bool begin(const BlockSamples& samples) {
    const std::vector<float>& surface = samples.uncut ? samples.solid_mm : samples.surface_mm;
    return begin(samples, samples.solid_mm, surface, samples.covered, samples.seams);
  }

  bool begin(const BlockSamples& samples, std::span<const float> solid, std::span<const float> surface,
             CoveredGroups covered, const Seams& seams) {
    if (covered == kWhollyCovered) return false;
    OSTEON_CHECK(solid.size() == kGathered && surface.size() == kGathered);
    samples_ = &samples;
    raw_ = field_ = solid.data();
    surface_ = surface.data();
    OSTEON_CHECK(samples.tissue.empty() || samples.tissue.size() == kGathered);
    tissue_ = samples.tissue.empty() ? nullptr : samples.tissue.data();
    rule_ = SeamRule(seams);
    if (rule_.any()) {
      std::ranges::copy(solid, ruled_.begin());
      take_coarse_contour(rule_, ruled_);
      field_ = ruled_.data();
    }
    std::uint32_t any = 0, all = ~0u;
    for (std::size_t x = 0; x < kN; ++x)
      for (std::size_t y = 0; y < kN; ++y) {
        const std::uint32_t row = solid_bits(field_ + gathered(x, y, 0));
        rows_[x][y] = row;
        any |= row;
        all &= row;
      }
    if (any == 0 || all == (1u << kN) - 1) return false;
    contour_.build(rows_, covered, rule_);
    return !contour_.vertex_edges().empty();
  }

  [[nodiscard]] const SolidRows& rows() const { return rows_; }
  [[nodiscard]] const Contour& contour() const { return contour_; }

  // Calls visit(number, x, y, z, axis, vertex) for every vertex in order.
  template <class Visit>
  void for_vertices(double level_pitch_mm, Visit visit) const {
    // On the imported surface S is zero, up to the rounding of the vertex's position.
    const float below_surface = -static_cast<float>(level_pitch_mm) / 32.0f;
    const bool ruled = rule_.any();
    const float *const field = field_, *const raw = raw_, *const surface = surface_;
    contour_.for_vertices([&](std::size_t v, unsigned x, unsigned y, unsigned z, unsigned axis) {
      Vertex vertex;
      const std::array at{static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
      if (!ruled || !on_coarse_edge(at, axis, below_surface, vertex)) {
        const std::size_t a = gathered(x, y, z), b = a + kNeighbour[axis];
        const float t = field[a] / (field[a] - field[b]);
        vertex.place = edge_place(field[a], field[b]);
        vertex.gradient = gradient_between(raw + a, raw + b, t, kSlab, kRow);
        vertex.cut = surface[a] + t * (surface[b] - surface[a]) < below_surface;
        // Beside a seam the vertex follows the coarser contour. On a curved surface that contour lies inside uncut
        // bone. So its depth does not show a cut, only a changed sample does.
        if (ruled && vertex.cut) vertex.cut = raw[a] != surface[a] || raw[b] != surface[b];
        if (tissue_) vertex.tissue = tissue_[field[a] < 0.0f ? a : b];
      }
      visit(v, x, y, z, axis, vertex);
    });
  }

 private:
  // The vertex of the determining level on the coarse edge that contains this edge.
  bool on_coarse_edge(const std::array<int, 3>& at, unsigned axis, float below_surface, Vertex& vertex) const {
    std::array<int, 3> place;
    for (unsigned k = 0; k < 3; ++k) place[k] = k == axis ? SeamRule::of_cell(at[k]) : SeamRule::of_sample(at[k]);
    const int steps = rule_.steps(place[0], place[1], place[2]);
    if (steps == 0) return false;
    const int cells = 1 << steps;
    std::array<int, 3> from = at;
    from[axis] = at[axis] / cells * cells;
    for (const int c : from)
      if (c % cells != 0) return false;
    const std::size_t a = gathered(static_cast<std::size_t>(from[0]), static_cast<std::size_t>(from[1]),
                                   static_cast<std::size_t>(from[2]));
    const std::size_t b = a + static_cast<std::size_t>(cells) * kNeighbour[axis];
    const float fa = field_[a], fb = field_[b];
    if ((fa < 0.0f) == (fb < 0.0f)) return false;
    const float t = fa / (fa - fb);
    vertex.place = std::clamp(cells * edge_place(fa, fb) - kEdgePlaces * (at[axis] - from[axis]), 0, kEdgePlaces);
    vertex.cut = surface_[a] + t * (surface_[b] - surface_[a]) < static_cast<float>(cells) * below_surface;
    if (tissue_) vertex.tissue = tissue_[fa < 0.0f ? a : b];
    // The gradient of the coarse level, as its block computes it.
    const std::vector<float>& coarse = samples_->coarse_mm[static_cast<std::size_t>(steps - 1)];
    const auto side = static_cast<std::size_t>(kBlockCells / cells + 3);
    OSTEON_CHECK(coarse.size() == side * side * side);
    const std::array<std::size_t, 3> stride{side * side, side, 1};
    std::size_t c = 0;
    for (unsigned k = 0; k < 3; ++k) c += static_cast<std::size_t>(from[k] / cells + 1) * stride[k];
    vertex.gradient = gradient_between(coarse.data() + c, coarse.data() + c + stride[axis], t, stride[0], stride[1]);
    return true;
  }

  const BlockSamples* samples_ = nullptr;
  const float* raw_ = nullptr;    // as gathered
  const float* field_ = nullptr;  // with the seams' contour
  const float* surface_ = nullptr;
  const Tissue* tissue_ = nullptr;  // null: no tissue
  SeamRule rule_{Seams{}};
  SolidRows rows_{};
  std::array<float, kGathered> ruled_;
  Contour contour_;
};

// One for each thread, so that making a block allocates only its result.
Mesher& mesher() {
  static thread_local Mesher one;
  return one;
}

BlockPayload encode(Mesher& at, CoveredGroups covered, const Seams& seams, double level_pitch_mm) {
  BlockPayload payload;
  std::vector<std::uint8_t>& bytes = payload.bytes;
  const std::size_t count = at.contour().vertex_edges().size();
  bytes.reserve(512 + 4 * count);
  const bool has_seams = seams.most() > 0;
  bytes.push_back(static_cast<std::uint8_t>((covered != 0 ? kHasCovered : 0) | (has_seams ? kHasSeams : 0)));
  if (covered != 0)
    for (std::size_t i = 0; i < sizeof covered; ++i) bytes.push_back(static_cast<std::uint8_t>(covered >> (8 * i)));
  if (has_seams) write_seams(seams, bytes);
  write_rows(at.rows(), bytes);

  const std::size_t first = bytes.size(), cut_bytes = (count + 7) / 8;
  bytes.resize(first + 3 * count + cut_bytes);
  std::uint8_t* places = bytes.data() + first;
  std::uint8_t* normals = places + count;
  std::uint8_t* cuts = normals + 2 * count;
  std::size_t cut = 0;
  bool hard = false;
  at.for_vertices(level_pitch_mm, [&](std::size_t v, unsigned, unsigned, unsigned, unsigned, const Vertex& vertex) {
    places[v] = static_cast<std::uint8_t>(vertex.place);
    const auto normal = encode_normal(vertex.gradient);
    normals[2 * v] = normal[0];
    normals[2 * v + 1] = normal[1];
    if (vertex.cut) cuts[v / 8] = static_cast<std::uint8_t>(cuts[v / 8] | 1 << (v % 8));
    cut += vertex.cut;
    hard |= vertex.tissue != Tissue::none;
  });
  if (cut == 0 || cut == count) bytes.resize(bytes.size() - cut_bytes);
  if (hard) {
    const std::size_t begin = bytes.size();
    bytes.resize(begin + (count + 3) / 4);
    at.for_vertices(level_pitch_mm, [&](std::size_t v, unsigned, unsigned, unsigned, unsigned, const Vertex& vertex) {
      const auto bits = static_cast<unsigned>(std::ranges::find(kTissues, vertex.tissue) - kTissues.begin());
      std::uint8_t& four = bytes[begin + v / 4];
      four = static_cast<std::uint8_t>(four | bits << (v % 4 * 2));
    });
    bytes[0] |= kHasTissue;
  }
  bytes[0] = static_cast<std::uint8_t>(bytes[0] | (cut == 0 ? 0 : cut == count ? kAllCut : kSomeCut));
  return payload;
}

// Positions of vertices, computed from global integers. So blocks of all levels give a shared vertex the same bits.
class Places {
 public:
  Places(const BlockKey& key, double level_pitch_mm) : unit_mm_(level_pitch_mm / kEdgePlaces) {
    const std::array<std::int32_t, 3> index{key.index.x, key.index.y, key.index.z};
    for (std::size_t k = 0; k < 3; ++k) {
      first_[k] = std::int64_t{index[k]} * kBlockCells * kEdgePlaces;
      for (unsigned i = 0; i < kN; ++i) on_sample_[k][i] = along(k, i * kEdgePlaces);
    }
  }
  void put(unsigned x, unsigned y, unsigned z, unsigned axis, int place, std::array<float, 3>& position_mm) const {
    position_mm = {on_sample_[0][x], on_sample_[1][y], on_sample_[2][z]};
    position_mm[axis] = along(axis, (axis == 0 ? x : axis == 1 ? y : z) * kEdgePlaces + static_cast<unsigned>(place));
  }

 private:
  [[nodiscard]] float along(std::size_t axis, unsigned places) const {
    return static_cast<float>(static_cast<double>(first_[axis] + places) * unit_mm_);
  }

  std::array<std::int64_t, 3> first_;
  std::array<std::array<float, kN>, 3> on_sample_;
  double unit_mm_;
};

}  // namespace

CoordBox block_samples(const BlockKey& key) {
  const Coord first = kBlockCells * key.index;
  return {first - Coord{1, 1, 1}, first + Coord{kBlockCells + 1, kBlockCells + 1, kBlockCells + 1}};
}

CoordBox coarse_samples(const BlockKey& key, int steps) {
  const Coord first = shift_down(kBlockCells * key.index, steps);
  const std::int32_t cells = kBlockCells >> steps;
  return {first - Coord{1, 1, 1}, first + Coord{cells + 1, cells + 1, cells + 1}};
}

BlockPayload encode_block(const BlockSamples& samples) {
  Mesher& at = mesher();
  return at.begin(samples) ? encode(at, samples.covered, samples.seams, samples.level_pitch_mm) : BlockPayload{};
}

BlockPayload encode_block(std::span<const float> solid_mm, std::span<const float> surface_mm, CoveredGroups covered,
                          double level_pitch_mm) {
  const BlockSamples no_seams;
  Mesher& at = mesher();
  return at.begin(no_seams, solid_mm, surface_mm, covered, {}) ? encode(at, covered, {}, level_pitch_mm)
                                                               : BlockPayload{};
}

void mesh_block(const BlockSamples& samples, Mesh& mesh) {
  Mesher& at = mesher();
  const bool any = at.begin(samples);
  const std::size_t count = any ? at.contour().vertex_edges().size() : 0;
  mesh.positions_mm.resize(count);
  mesh.normals.resize(count);
  mesh.cut_face.resize(count);
  mesh.tissue.resize(samples.tissue.empty() ? 0 : count);
  mesh.triangles.clear();
  if (!any) return;
  const Places places(samples.key, samples.level_pitch_mm);
  at.for_vertices(samples.level_pitch_mm,
                  [&](std::size_t v, unsigned x, unsigned y, unsigned z, unsigned axis, const Vertex& vertex) {
                    places.put(x, y, z, axis, vertex.place, mesh.positions_mm[v]);
                    mesh.normals[v] = vertex.gradient;
                    mesh.cut_face[v] = vertex.cut;
                    if (!mesh.tissue.empty()) mesh.tissue[v] = vertex.tissue;
                  });
  // Roots and quotients, several at a time.
  static thread_local std::array<float, 3 * kBlockSampleCount> scales;
  for (std::size_t v = 0; v < count; ++v) {
    const auto& g = mesh.normals[v];
    const float squared = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
    scales[v] = squared > 0.0f ? 1.0f / std::sqrt(squared) : 0.0f;
  }
  for (std::size_t v = 0; v < count; ++v) {
    auto& n = mesh.normals[v];
    n = {n[0] * scales[v], n[1] * scales[v], scales[v] > 0.0f ? n[2] * scales[v] : 1.0f};
  }
  // Written to memory that is large enough for any block, then copied at once.
  using Triangle = std::array<std::uint32_t, 3>;
  constexpr std::size_t kCells = static_cast<std::size_t>(kBlockCells) * kBlockCells * kBlockCells;
  static thread_local std::array<Triangle, kCaseTriangles * kCells> made;
  Triangle* next = made.data();
  at.contour().for_triangles([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { *next++ = {a, b, c}; });
  mesh.triangles.assign(made.data(), next);
}

Result<Mesh> decode_block(const BlockKey& key, const BlockPayload& payload, double level_pitch_mm) {
  Mesh mesh;
  if (payload.bytes.empty()) return mesh;
  std::span<const std::uint8_t> bytes(payload.bytes);
  const auto broken = [&](const std::string& why) {
    return failure(ErrorCode::invalid_input,
                   "a mesh block of " + std::to_string(payload.bytes.size()) + " bytes " + why);
  };
  const unsigned flags = bytes.front();
  bytes = bytes.subspan(1);
  if (flags > kFlags || (flags & (kAllCut | kSomeCut)) == (kAllCut | kSomeCut))
    return broken("has flags that mean nothing");
  CoveredGroups covered = 0;
  if (flags & kHasCovered) {
    if (bytes.size() < sizeof covered) return broken("ends before its covered groups");
    for (std::size_t i = 0; i < sizeof covered; ++i) covered |= CoveredGroups{bytes[i]} << (8 * i);
    bytes = bytes.subspan(sizeof covered);
  }
  Seams seams;
  if ((flags & kHasSeams) && !read_seams(bytes, seams)) return broken("has seams that cannot be");
  SolidRows rows;
  if (!read_rows(bytes, rows)) return broken("has broken solid bits");
  thread_local Contour contour;
  contour.build(rows, covered, SeamRule(seams));
  const auto edges = contour.vertex_edges();
  const std::size_t count = edges.size();
  const bool some_cut = (flags & kSomeCut) != 0;
  const bool has_tissue = (flags & kHasTissue) != 0;
  const std::size_t cut_bytes = some_cut ? (count + 7) / 8 : 0, tissue_bytes = has_tissue ? (count + 3) / 4 : 0;
  if (bytes.size() != 3 * count + cut_bytes + tissue_bytes)
    return broken("does not fit its " + std::to_string(count) + " vertices");
  const auto place_bytes = bytes.first(count), normals = bytes.subspan(count, 2 * count);
  const auto cuts = bytes.subspan(3 * count, cut_bytes), tissues = bytes.last(tissue_bytes);

  mesh.positions_mm.resize(count);
  mesh.normals.resize(count);
  mesh.cut_face.resize(count);
  mesh.tissue.resize(has_tissue ? count : 0);
  const Places places(key, level_pitch_mm);
  for (std::size_t v = 0; v < count; ++v) {
    if (place_bytes[v] > kEdgePlaces) return broken("has a vertex beyond its edge");
    const unsigned axis = edges[v] / kBlockSampleCount, sample = edges[v] % kBlockSampleCount;
    places.put(sample / (kN * kN), sample / kN % kN, sample % kN, axis, place_bytes[v], mesh.positions_mm[v]);
    mesh.normals[v] = decode_normal(normals[2 * v], normals[2 * v + 1]);
    mesh.cut_face[v] = some_cut ? cuts[v / 8] >> (v % 8) & 1 : (flags & kAllCut) != 0;
    if (!has_tissue) continue;
    const std::size_t bits = tissues[v / 4] >> (v % 4 * 2) & 3u;
    if (bits >= kTissues.size()) return broken("has a tissue that does not exist");
    mesh.tissue[v] = kTissues[bits];
  }
  mesh.triangles.reserve(2 * count);
  contour.for_triangles([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.push_back({a, b, c});
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
