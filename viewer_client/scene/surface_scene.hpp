// The surface as received from the server: the newest version of each block, in regions that are rebuilt one by one.
#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/id.hpp"
#include "common/geometry/lattice.hpp"
#include "common/geometry/pose.hpp"
#include "common/surface/mesh_block.hpp"

namespace osteon {

// One block from the network thread, decoded and checked against its hash. No triangles: no surface is left.
struct ReceivedBlock {
  BlockKey key;
  std::uint64_t version = 0;
  Digest mesh_hash;
  Mesh mesh;
};

// 4³ blocks of one level, drawn as one object. Fine blocks have their own regions. A cut with a small tool therefore
// rebuilds a region of at most 64 h / 4 (h: pitch of the case), never the bone around it.
inline constexpr int kRegionShift = 2;

struct RegionKey {
  BodyId body;
  int level = 0;
  Coord index;  // block index divided by 4, rounded down
  friend auto operator<=>(const RegionKey&, const RegionKey&) = default;
};

[[nodiscard]] RegionKey region_of(const BlockKey& key);

struct SurfaceHit {
  Vec3 point_mm;  // bone frame
  Vec3 normal;    // unit, out of the bone
  BodyId body;
};

// [render]
class SurfaceScene {
 public:
  // Takes a block unless its version is not newer than the present one. True if the picture changes.
  bool replace(ReceivedBlock block);

  // A stream begins with the whole surface. After an interruption, versions may restart (another server) and blocks may
  // be gone. Between these two calls every block is taken as new. At the end, blocks that the snapshot did not contain
  // are dropped.
  void begin_snapshot();
  void end_snapshot();

  // Regions changed since the last call, each once, in order.
  [[nodiscard]] std::vector<RegionKey> take_dirty();
  // Every region with a cut face counts as changed.
  void repaint_cuts();
  // All triangles of a region as one mesh, blocks in the order of their keys. Empty if nothing is left.
  [[nodiscard]] Mesh region_mesh(const RegionKey& region) const;

  // The first point of the surface on a ray, from outside. `direction`: unit vector, bone frame. None: it meets no
  // bone.
  [[nodiscard]] std::optional<SurfaceHit> first_hit(const Vec3& from_mm, const Vec3& direction) const;
  // The mean outer normal of the triangles within `radius_mm` of a point, weighted by area. None: no triangle is near.
  [[nodiscard]] std::optional<Vec3> mean_normal(const Vec3& point_mm, double radius_mm) const;

  // Whether a vertex lies on a cut.
  [[nodiscard]] bool any_cut_face() const;
  [[nodiscard]] std::size_t blocks() const { return drawn_blocks_; }  // with triangles
  [[nodiscard]] std::size_t triangles() const { return triangles_; }
  [[nodiscard]] std::size_t regions() const;  // with triangles
  // SHA-256 over the sorted (key, mesh_hash) of all blocks with triangles. All viewers of one surface get the same
  // hash.
  [[nodiscard]] Digest hash() const;

 private:
  struct Block {
    std::uint64_t version = 0;
    std::uint64_t snapshot = 0;  // in which it was last received
    Digest mesh_hash;
    Mesh mesh;
    Box bounds;  // of the mesh
  };
  using Region = std::map<BlockKey, Block>;

  void count(const Block& block, int sign);

  std::map<RegionKey, Region> regions_;
  std::set<RegionKey> dirty_;
  std::uint64_t snapshot_ = 0;
  bool in_snapshot_ = false;
  std::size_t drawn_blocks_ = 0;
  std::size_t triangles_ = 0;
};

}  // namespace osteon
