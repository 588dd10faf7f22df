#include "viewer_client/scene/surface_scene.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace osteon {

namespace {

Vec3 vertex(const Mesh& mesh, std::uint32_t index) {
  const auto& p = mesh.positions_mm[index];
  return {p[0], p[1], p[2]};
}

Box bounds_of(const Mesh& mesh) {
  Box box{Vec3::Constant(std::numeric_limits<double>::infinity()),
          Vec3::Constant(-std::numeric_limits<double>::infinity())};
  for (std::uint32_t i = 0; i < mesh.positions_mm.size(); ++i) {
    box.min_mm = box.min_mm.cwiseMin(vertex(mesh, i));
    box.max_mm = box.max_mm.cwiseMax(vertex(mesh, i));
  }
  return box;
}

// Whether a ray meets the box at a distance below `most_mm`.
bool meets(const Box& box, const Vec3& from_mm, const Vec3& inverse, double most_mm) {
  const Vec3 a = (box.min_mm - from_mm).cwiseProduct(inverse), b = (box.max_mm - from_mm).cwiseProduct(inverse);
  const double enters = std::max(0.0, a.cwiseMin(b).maxCoeff()), leaves = a.cwiseMax(b).minCoeff();
  return enters <= leaves && enters < most_mm;
}

// The distance along a ray to a triangle that it enters from the front. None: it does not.
std::optional<double> distance_to(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& from_mm,
                                  const Vec3& direction) {
  const Vec3 ab = b - a, ac = c - a, normal = ab.cross(ac);
  const double slope = normal.dot(direction);
  if (!(slope < 0.0)) return std::nullopt;
  const double distance = (a - from_mm).dot(normal) / slope;
  if (!(distance >= 0.0)) return std::nullopt;
  // A point on an edge belongs to both triangles, so that no ray slips between them.
  constexpr double kEdge = -1e-9;
  const Vec3 in = from_mm + distance * direction - a;
  const double size = normal.squaredNorm();
  const double v = in.cross(ac).dot(normal) / size, w = ab.cross(in).dot(normal) / size;
  if (v < kEdge || w < kEdge || v + w > 1.0 - kEdge) return std::nullopt;
  return distance;
}

}  // namespace

RegionKey region_of(const BlockKey& key) { return {key.body, key.level, shift_down(key.index, kRegionShift)}; }

void SurfaceScene::count(const Block& block, int sign) {
  if (block.mesh.triangles.empty()) return;
  const auto triangles = block.mesh.triangles.size();
  drawn_blocks_ += sign > 0 ? 1 : std::size_t(-1);
  triangles_ += sign > 0 ? triangles : std::size_t(0) - triangles;
}

bool SurfaceScene::replace(ReceivedBlock received) {
  const RegionKey region = region_of(received.key);
  auto [place, fresh] = regions_[region].try_emplace(received.key);
  Block& block = place->second;

  // Within a stream a higher version replaces a lower one. A snapshot replaces everything from an earlier stream.
  const bool from_earlier_stream = in_snapshot_ && block.snapshot != snapshot_;
  if (!fresh && !from_earlier_stream && received.version <= block.version) return false;
  block.version = received.version;
  block.snapshot = snapshot_;
  if (fresh && received.mesh.triangles.empty()) return false;
  if (!fresh && received.mesh_hash == block.mesh_hash) return false;

  count(block, -1);
  block.mesh_hash = received.mesh_hash;
  block.mesh = std::move(received.mesh);
  block.bounds = bounds_of(block.mesh);
  count(block, +1);
  dirty_.insert(region);
  return true;
}

void SurfaceScene::begin_snapshot() {
  ++snapshot_;
  in_snapshot_ = true;
}

void SurfaceScene::end_snapshot() {
  if (!in_snapshot_) return;
  in_snapshot_ = false;
  for (auto region = regions_.begin(); region != regions_.end();) {
    std::erase_if(region->second, [&](const auto& entry) {
      if (entry.second.snapshot == snapshot_) return false;
      if (!entry.second.mesh.triangles.empty()) dirty_.insert(region->first);
      count(entry.second, -1);
      return true;
    });
    region = region->second.empty() ? regions_.erase(region) : std::next(region);
  }
}

std::vector<RegionKey> SurfaceScene::take_dirty() {
  std::vector<RegionKey> keys(dirty_.begin(), dirty_.end());
  dirty_.clear();
  return keys;
}

void SurfaceScene::repaint_cuts() {
  for (const auto& [key, blocks] : regions_)
    if (std::ranges::any_of(blocks, [](const auto& entry) {
          return std::ranges::find(entry.second.mesh.cut_face, 1) != entry.second.mesh.cut_face.end();
        }))
      dirty_.insert(key);
}

Mesh SurfaceScene::region_mesh(const RegionKey& region) const {
  Mesh whole;
  const auto found = regions_.find(region);
  if (found == regions_.end()) return whole;

  std::size_t vertices = 0, triangles = 0;
  for (const auto& [key, block] : found->second) {
    vertices += block.mesh.positions_mm.size();
    triangles += block.mesh.triangles.size();
  }
  whole.positions_mm.reserve(vertices);
  whole.normals.reserve(vertices);
  whole.cut_face.reserve(vertices);
  whole.triangles.reserve(triangles);

  for (const auto& [key, block] : found->second) {
    const Mesh& part = block.mesh;
    const auto first = static_cast<std::uint32_t>(whole.positions_mm.size());
    whole.positions_mm.insert(whole.positions_mm.end(), part.positions_mm.begin(), part.positions_mm.end());
    whole.normals.insert(whole.normals.end(), part.normals.begin(), part.normals.end());
    whole.cut_face.insert(whole.cut_face.end(), part.cut_face.begin(), part.cut_face.end());
    if (!part.tissue.empty()) {
      whole.tissue.resize(first);
      whole.tissue.insert(whole.tissue.end(), part.tissue.begin(), part.tissue.end());
    }
    for (const auto& [a, b, c] : part.triangles) whole.triangles.push_back({a + first, b + first, c + first});
  }
  if (!whole.tissue.empty()) whole.tissue.resize(vertices);
  return whole;
}

std::optional<SurfaceHit> SurfaceScene::first_hit(const Vec3& from_mm, const Vec3& direction) const {
  const Vec3 inverse = direction.cwiseInverse();
  double nearest_mm = std::numeric_limits<double>::infinity();
  std::optional<SurfaceHit> hit;
  for (const auto& [region, blocks] : regions_)
    for (const auto& [key, block] : blocks) {
      if (block.mesh.triangles.empty() || !meets(block.bounds, from_mm, inverse, nearest_mm)) continue;
      for (const auto& [i, j, k] : block.mesh.triangles) {
        const Vec3 a = vertex(block.mesh, i), b = vertex(block.mesh, j), c = vertex(block.mesh, k);
        const std::optional<double> distance = distance_to(a, b, c, from_mm, direction);
        if (!distance || *distance >= nearest_mm) continue;
        nearest_mm = *distance;
        hit = SurfaceHit{from_mm + nearest_mm * direction, (b - a).cross(c - a).normalized(), key.body};
      }
    }
  return hit;
}

std::optional<Vec3> SurfaceScene::mean_normal(const Vec3& point_mm, double radius_mm) const {
  Vec3 sum = Vec3::Zero();
  for (const auto& [region, blocks] : regions_)
    for (const auto& [key, block] : blocks) {
      if (block.mesh.triangles.empty() || (point_mm - block.bounds.min_mm).minCoeff() < -radius_mm ||
          (block.bounds.max_mm - point_mm).minCoeff() < -radius_mm)
        continue;
      for (const auto& [i, j, k] : block.mesh.triangles) {
        const Vec3 a = vertex(block.mesh, i), b = vertex(block.mesh, j), c = vertex(block.mesh, k);
        if (((a + b + c) / 3.0 - point_mm).norm() <= radius_mm) sum += (b - a).cross(c - a);
      }
    }
  return sum.norm() > 0.0 ? std::optional(Vec3(sum.normalized())) : std::nullopt;
}

bool SurfaceScene::any_cut_face() const {
  return std::ranges::any_of(regions_, [](const auto& region) {
    return std::ranges::any_of(region.second, [](const auto& entry) {
      return std::ranges::find(entry.second.mesh.cut_face, 1) != entry.second.mesh.cut_face.end();
    });
  });
}

std::size_t SurfaceScene::regions() const {
  return static_cast<std::size_t>(std::count_if(regions_.begin(), regions_.end(), [](const auto& region) {
    return std::any_of(region.second.begin(), region.second.end(),
                       [](const auto& entry) { return !entry.second.mesh.triangles.empty(); });
  }));
}

Digest SurfaceScene::hash() const {
  // Not in the order of regions: these are a grouping of this program only.
  std::map<BlockKey, Digest> hashes;
  for (const auto& [region, blocks] : regions_)
    for (const auto& [key, block] : blocks)
      if (!block.mesh.triangles.empty()) hashes[key] = block.mesh_hash;
  return surface_hash(hashes);
}

}  // namespace osteon
