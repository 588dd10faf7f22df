#include "common/surface/weld.hpp"

#include <bit>
#include <unordered_map>

namespace osteon {
namespace {

struct PlaceHash {
  std::size_t operator()(const std::array<float, 3>& p) const noexcept {
    std::uint64_t h = 0;
    for (const float c : p) h = (h ^ std::bit_cast<std::uint32_t>(c)) * 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(h ^ h >> 32);
  }
};

}  // namespace

Mesh weld(std::span<const Mesh> blocks) {
  std::size_t vertices = 0, triangles = 0;
  for (const Mesh& block : blocks) {
    vertices += block.positions_mm.size();
    triangles += block.triangles.size();
  }
  Mesh whole;
  whole.triangles.reserve(triangles);
  std::unordered_map<std::array<float, 3>, std::uint32_t, PlaceHash> places;
  places.reserve(vertices);
  std::vector<std::uint32_t> joined;
  for (const Mesh& block : blocks) {
    joined.clear();
    for (std::size_t v = 0; v < block.positions_mm.size(); ++v) {
      const auto [place, fresh] =
          places.try_emplace(block.positions_mm[v], static_cast<std::uint32_t>(whole.positions_mm.size()));
      joined.push_back(place->second);
      if (!fresh) continue;
      whole.positions_mm.push_back(block.positions_mm[v]);
      whole.normals.push_back(block.normals[v]);
      whole.cut_face.push_back(block.cut_face[v]);
    }
    for (const auto& [a, b, c] : block.triangles)
      if (joined[a] != joined[b] && joined[b] != joined[c] && joined[c] != joined[a])
        whole.triangles.push_back({joined[a], joined[b], joined[c]});
  }
  return whole;
}

}  // namespace osteon
