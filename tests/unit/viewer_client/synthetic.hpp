// Meshes with a known shape, for scene and picture tests.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

#include "viewer_client/scene/surface_scene.hpp"

namespace osteon::test {

// A closed sphere of rings and segments, triangles counter-clockwise from outside.
inline Mesh sphere_mesh(const Vec3& centre_mm, double radius_mm, std::uint8_t cut_face, int rings = 48) {
  Mesh mesh;
  const int segments = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    const double polar = std::numbers::pi * i / rings;
    for (int j = 0; j < segments; ++j) {
      const double angle = 2.0 * std::numbers::pi * j / segments;
      const Vec3 n(std::sin(polar) * std::cos(angle), std::sin(polar) * std::sin(angle), std::cos(polar));
      const Vec3 p = centre_mm + radius_mm * n;
      mesh.positions_mm.push_back({float(p.x()), float(p.y()), float(p.z())});
      mesh.normals.push_back({float(n.x()), float(n.y()), float(n.z())});
      mesh.cut_face.push_back(cut_face);
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < segments; ++j) {
      const auto at = [&](int ring, int segment) {
        return static_cast<std::uint32_t>(ring * segments + segment % segments);
      };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

// The server computes a block's hash. Here any text gives one.
inline Digest digest_of(std::string_view text) {
  Hasher hasher;
  hasher.text(text);
  return hasher.finish();
}

inline ReceivedBlock block(const BlockKey& key, std::uint64_t version, std::string_view content, Mesh mesh) {
  return {key, version, digest_of(content), std::move(mesh)};
}

}  // namespace osteon::test
