// A room with a real bone, burred for some seconds of frames of 33 cuts each. Measures the time of the cuts and of the
// blocks that they made stale, and the memory. Counts the triangles of the whole bone, uncut, that VTK's flying edges
// has more or fewer.
// Takes the case's folder, the number of frames, and a file for the final vertices, from which a picture can be made:
// x, y, z, the normal, and 1 on cuts, as floats. Prints JSON.
#include <malloc.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <vector>

#include "common/core/check.hpp"
#include "server/room/room.hpp"
#include "tests/perf/baselines/flying_edges.hpp"
#include "tests/support/scenes/known_cuts.hpp"

namespace osteon::test {
namespace {

constexpr std::size_t kCutsPerFrame = 33;

double ms_since(std::chrono::steady_clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double quantile(std::vector<double> values, double part) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

double heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

struct SurfacePoint {
  Vec3 place_mm, out;
};

Mesh mesh_of(const Room& room, const BlockKey& key) {
  auto mesh = decode_block(key, make_block(room.gather_block(key)), level_pitch_mm(room.bone().pitch_mm(), key.level));
  OSTEON_CHECK(mesh.has_value());
  return std::move(*mesh);
}

// A random point on the bone, in proportion to the number of triangles.
SurfacePoint point_on(const Room& room, const std::vector<BlockKey>& blocks, Random& random) {
  while (true) {
    const Mesh mesh = mesh_of(room, blocks[random.index(blocks.size())]);
    if (mesh.positions_mm.size() < 100) continue;
    const std::size_t i = random.index(mesh.positions_mm.size());
    const auto& p = mesh.positions_mm[i];
    const auto& n = mesh.normals[i];
    return {{p[0], p[1], p[2]}, Vec3{n[0], n[1], n[2]}.normalized()};
  }
}

// Triangles of the whole bone by flying edges, in slabs of a few planes, because a dense image of all may not fit.
std::int64_t flying_edges_triangles(const Room& room, baselines::Inside inside) {
  constexpr std::int32_t kCells = 32;
  const CoordBox all = room.bone().bounds_samples().grown(1);
  std::int64_t triangles = 0;
  for (std::int32_t x = all.min.x; x < all.max.x; x += kCells) {
    vtkNew<vtkImageData> image;
    const std::int32_t last = std::min(x + kCells, all.max.x);
    baselines::fill_image(*image, room.field(), 0, {{x, all.min.y, all.min.z}, {last, all.max.y, all.max.z}}, inside);
    baselines::FlyingEdges flying_edges(image, inside);
    flying_edges.run();
    triangles += flying_edges.triangles();
  }
  return triangles;
}

bool write_vertices(const Room& room, const std::set<BlockKey>& blocks, const char* file) {
  std::FILE* out = std::fopen(file, "wb");
  if (!out) return false;
  bool written = true;
  for (const BlockKey& key : blocks) {
    const Mesh mesh = mesh_of(room, key);
    for (std::size_t i = 0; i < mesh.positions_mm.size(); ++i) {
      const auto &p = mesh.positions_mm[i], &n = mesh.normals[i];
      const float row[] = {p[0], p[1], p[2], n[0], n[1], n[2], static_cast<float>(mesh.cut_face[i])};
      written = written && std::fwrite(row, sizeof row, 1, out) == 1;
    }
  }
  return std::fclose(out) == 0 && written;
}

int run(const char* folder, int frames, const char* vertices) {
  const double empty = heap_bytes();
  auto loaded = Case::load(folder);
  if (!loaded) {
    std::fprintf(stderr, "osteon-real-case: %s\n", loaded.error().message.c_str());
    return 1;
  }
  const auto burr = nearest_tool(ToolKind::round_burr, 3.2);
  OSTEON_CHECK(burr.has_value());
  const double case_bytes = heap_bytes() - empty;
  Room room(*loaded, CutLimits{.beyond_bone_mm = 1000.0});
  const double h = room.bone().pitch_mm();
  const int level = std::min(burr->cut_level, finest_level(h));
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const std::vector<BlockKey> blocks = room.bone_blocks();

  // The whole bone's surface once, as a joining viewer gets it.
  auto start = std::chrono::steady_clock::now();
  std::size_t triangles = 0;
  for (const BlockKey& key : blocks) triangles += mesh_of(room, key).triangles.size();
  const double whole_ms = ms_since(start);
  const auto difference = [&](baselines::Inside inside) {
    return std::abs(static_cast<std::int64_t>(triangles) - flying_edges_triangles(room, inside));
  };
  const std::int64_t bone_apart = difference(baselines::Inside::above),
                     air_apart = difference(baselines::Inside::below);

  Random random(2);
  const double uncut = heap_bytes();
  std::vector<double> cut_us, frame_ms, stale;
  std::uint64_t seq = 0;
  std::set<BlockKey> drawn(blocks.begin(), blocks.end());
  for (int frame = 0; frame < frames; ++frame) {
    const SurfacePoint at = point_on(room, blocks, random);
    // A stroke along the surface, pressed in by a quarter of the bur's radius, at 15 mm/s: 0.12 mm a cut.
    const Vec3 along = at.out.unitOrthogonal(), deep = at.place_mm - 0.125 * burr->diameter_mm * at.out;
    start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < kCutsPerFrame; ++i) {
      const Vec3 from = deep + 0.12 * static_cast<double>(i) * along;
      Cut cut = straight_cut(*burr, from, from + 0.12 * along, -at.out, ++seq);
      cut.author = surgeon;
      cut.lease_epoch = room.lease_epoch(cut.author);
      cut.level = level;
      const auto before = std::chrono::steady_clock::now();
      const auto outcome = room.submit(cut);
      cut_us.push_back(1e3 * ms_since(before));
      OSTEON_CHECK(outcome.has_value() && outcome->committed());
    }
    const std::vector<BlockKey> changed = room.take_stale_blocks();
    for (const BlockKey& key : changed) (void)make_block(room.gather_block(key));
    frame_ms.push_back(ms_since(start));
    stale.push_back(static_cast<double>(changed.size()));
    drawn.insert(changed.begin(), changed.end());
  }
  const Coord samples = room.bone().bounds_samples().dims();
  std::printf(
      "{\"pitch_mm\": %.5f, \"cut_pitch_mm\": %.5f, \"samples\": [%d, %d, %d], \"bone_cm3\": %.2f, \"case_mb\": %.1f, "
      "\"whole_ms\": %.1f, \"triangles\": %zu, \"triangle_difference\": %lld, \"triangle_difference_air_apart\": %lld, "
      "\"frames\": %d, \"cut_us_p50\": %.1f, \"cut_us_p99\": %.1f, "
      "\"frame_ms_p50\": %.3f, \"frame_ms_min\": %.3f, \"frame_ms_max\": %.3f, \"stale_p50\": %.0f, "
      "\"removed_mm3\": %.2f, \"cut_mb\": %.2f}\n",
      h, level_pitch_mm(h, level), samples.x, samples.y, samples.z, room.bone().volume_mm3() / 1000.0, case_bytes / 1e6,
      whole_ms, triangles, static_cast<long long>(bone_apart), static_cast<long long>(air_apart), frames,
      quantile(cut_us, 0.5), quantile(cut_us, 0.99), quantile(frame_ms, 0.5), quantile(frame_ms, 0),
      quantile(frame_ms, 1), quantile(stale, 0.5), room.field().removed_mm3(), (heap_bytes() - uncut) / 1e6);
  if (vertices && !write_vertices(room, drawn, vertices)) {
    std::fprintf(stderr, "osteon-real-case: cannot write %s\n", vertices);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const int frames = argc > 2 ? std::atoi(argv[2]) : 0;
  if (frames < 1) {
    std::fprintf(stderr, "osteon-real-case: needs a case's folder and the number of frames\n");
    return 1;
  }
  return osteon::test::run(argv[1], frames, argc > 3 ? argv[3] : nullptr);
}
