// Cost to make and send the surface: blocks, whole bones, and what the cuts of a frame make stale, compared with VTK's
// flying edges in the same run, with warm and with cold caches. Benchmarks named "versus" time both in turn and give
// medians as counters. The ratio is that of flying edges over ours: above 1, ours is faster.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/core/check.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/surface/block_source.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/perf/baselines/flying_edges.hpp"
#include "tests/perf/cold_caches.hpp"
#include "tests/perf/vtk_threads.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

using baselines::fill_image;
using baselines::FlyingEdges;
using Clock = std::chrono::steady_clock;

constexpr double kBonePitch_mm = 0.5;
const Vec3 kHead(0, 0, 0);
constexpr double kHead_mm = 24.0, kFossa_mm = 6.0, kCanal_mm = 6.0;

// A femoral head with its fossa, on a hollow shaft.
double head_mm(const Vec3& p) {
  const double ball = (p - kHead).norm() - kHead_mm, fossa = kFossa_mm - (p - Vec3(10, 8, 21)).norm();
  const double around = std::hypot(p.x(), p.y());
  const double shaft = std::max({around - 13.0, p.z(), -28.0 - p.z()}),
               canal = std::max(kCanal_mm - around, p.z() + 8.0 - kHead_mm);
  return std::max({std::min(ball, shaft), fossa, canal > -0.5 && p.z() < 0 ? kCanal_mm - around : -10.0});
}

struct Scene {
  CutField field;
  SurfaceBlocks blocks{BodyId{}};

  std::vector<BlockKey> cut(const Cut& c) {
    const CutReport report = field.apply(c);
    return blocks.touch(report.level, report.changed_leaves);
  }
};

Scene head(double pitch_mm) {
  return {CutField(
      make_bone({Vec3(-28, -28, -31), Vec3(28, 28, 27)}, pitch_mm, head_mm, [](const Vec3&) { return 1.9; }), {})};
}

Cut burr_cut(const Vec3& from, const Vec3& to) {
  Cut cut = straight_cut(*find_tool("burr-round-3.2"), from, to, {0, 0, -1});
  cut.level = 2;
  return cut;
}

// On the head, 1 mm deep, at an angle along a meridian.
Vec3 on_head(double angle) { return (kHead_mm - 1.0) * Vec3(std::sin(angle), -0.2, std::cos(angle)).normalized(); }

// 33 cuts are one frame of a burr that moves at 10 mm/s.
constexpr int kFrameCuts = 33;
constexpr double kFrameAngle = 0.33 / kHead_mm;

std::vector<Cut> frame_of_cuts(int frame) {
  std::vector<Cut> cuts;
  for (int i = 0; i < kFrameCuts; ++i) {
    const double at = -0.4 + kFrameAngle * (frame + static_cast<double>(i) / kFrameCuts);
    cuts.push_back(burr_cut(on_head(at), on_head(at + kFrameAngle / kFrameCuts)));
  }
  return cuts;
}

Scene cut_head(int frames) {
  Scene scene = head(kBonePitch_mm);
  for (int frame = 0; frame < frames; ++frame)
    for (const Cut& cut : frame_of_cuts(frame)) (void)scene.cut(cut);
  return scene;
}

std::vector<BlockKey> bone_blocks(const CutField& field) {
  std::vector<BlockKey> keys;
  const CoordBox b = field.bone().bounds_samples();
  for (int x = (b.min.x - 1) >> 4; x <= b.max.x >> 4; ++x)
    for (int y = (b.min.y - 1) >> 4; y <= b.max.y >> 4; ++y)
      for (int z = (b.min.z - 1) >> 4; z <= b.max.z >> 4; ++z) {
        const BlockKey key{{}, 0, {x, y, z}};
        if (field.bone().has_bone(block_samples(key))) keys.push_back(key);
      }
  return keys;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

template <class Call>
double seconds(Call call) {
  const auto start = Clock::now();
  call();
  return std::chrono::duration<double>(Clock::now() - start).count();
}

enum class Caches { warm, cold };

// The heap keeps what is given back, as the server's does. Otherwise every run of flying edges would wait for the
// system to provide the pages of its arrays again, which takes several times as long as its work.
constexpr std::size_t kKept = std::size_t{16} << 20;

// Runs both in turn, after one uncounted run of each. The spread is that of the medians of up to eleven parts of the
// run, because an interrupted call of microseconds shows nothing.
template <class Ours, class Theirs>
void versus(benchmark::State& state, Caches caches, int rounds, const char* unit, double per_second, Ours ours,
            Theirs theirs) {
  const MemoryReserve kept(kKept);
  std::vector<double> a, b, ratio;
  const auto timed = [&](auto& call) {
    if (caches == Caches::cold) flush_caches();
    return seconds(call);
  };
  for (auto _ : state) {
    ours();
    theirs();
    for (int i = 0; i < rounds; ++i) {
      a.push_back(timed(ours));
      b.push_back(timed(theirs));
    }
    constexpr int kParts = 11;
    for (int part = 0; part < kParts; ++part) {
      const auto of = [&](const std::vector<double>& all) {
        return median({all.end() - rounds + rounds * part / kParts, all.end() - rounds + rounds * (part + 1) / kParts});
      };
      ratio.push_back(of(b) / of(a));
    }
  }
  state.counters[std::string("ours_") + unit] = median(a) * per_second;
  state.counters[std::string("flying_edges_") + unit] = median(b) * per_second;
  state.counters["ratio"] = median(b) / median(a);
  state.counters["ratio_min"] = *std::ranges::min_element(ratio);
  state.counters["ratio_max"] = *std::ranges::max_element(ratio);
}

// The block of a cut that has the most triangles and no seam.
BlockKey fullest_block(const Scene& scene) {
  BlockKey best;
  std::size_t most = 0;
  BlockSamples samples;
  Mesh mesh;
  for (const BlockKey& key : scene.blocks.fine_blocks()) {
    gather_block(scene.field, scene.blocks, key, kBonePitch_mm, samples);
    if (samples.covered != 0 || samples.seams.most() > 0) continue;
    mesh_block(samples, mesh);
    if (mesh.triangles.size() <= most) continue;
    most = mesh.triangles.size();
    best = key;
  }
  OSTEON_CHECK(most > 0);
  return best;
}

void mesh_block_versus_flying_edges(benchmark::State& state, Caches caches) {
  const Scene scene = cut_head(12);
  const BlockKey key = fullest_block(scene);
  vtk_threads(1);
  const CoordBox apron = block_samples(key);
  vtkNew<vtkImageData> image;
  fill_image(*image, scene.field, key.level, {apron.min + Coord{1, 1, 1}, apron.max - Coord{1, 1, 1}});
  FlyingEdges flying_edges(image);
  BlockSamples samples;
  Mesh mesh;
  versus(
      state, caches, caches == Caches::warm ? 1001 : 99, "us", 1e6,
      [&] {
        gather_block(scene.field, scene.blocks, key, kBonePitch_mm, samples);
        mesh_block(samples, mesh);
      },
      [&] { flying_edges.run(); });
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
  state.counters["flying_edges_triangles"] = static_cast<double>(flying_edges.triangles());
}

// Makes all blocks on `threads` threads.
void mesh_all(const Scene& scene, const std::vector<BlockKey>& keys, int threads, std::vector<Mesh>& meshes) {
  meshes.resize(keys.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    BlockSamples samples;
    for (std::size_t i = next++; i < keys.size(); i = next++) {
      gather_block(scene.field, scene.blocks, keys[i], scene.field.bone().pitch_mm(), samples);
      mesh_block(samples, meshes[i]);
    }
  };
  std::vector<std::jthread> others;
  for (int i = 1; i < threads; ++i) others.emplace_back(work);
  work();
}

void mesh_whole_bone_versus_flying_edges(benchmark::State& state, Caches caches) {
  const int threads = static_cast<int>(state.range(0));
  constexpr double kPitch_mm = 0.25;
  const Scene scene = head(kPitch_mm);
  const std::vector<BlockKey> keys = bone_blocks(scene.field);
  vtk_threads(threads);
  const CoordBox bounds = scene.field.bone().bounds_samples();
  vtkNew<vtkImageData> image;
  fill_image(*image, scene.field, 0, bounds.grown(1));
  FlyingEdges flying_edges(image);
  std::vector<Mesh> meshes;
  versus(
      state, caches, 11, "ms", 1e3,
      [&] {
        meshes.clear();
        mesh_all(scene, keys, threads, meshes);
      },
      [&] { flying_edges.run(); });
  double triangles = 0;
  for (const Mesh& mesh : meshes) triangles += static_cast<double>(mesh.triangles.size());
  state.counters["triangles"] = triangles;
  state.counters["flying_edges_triangles"] = static_cast<double>(flying_edges.triangles());
  state.counters["samples"] = static_cast<double>(image->GetNumberOfPoints());
}

// What the cuts of a frame make stale, named and made, against flying edges on the box of the leaves that they changed.
// Flying edges gets the box's samples ready-made. The cuts themselves are in neither.
void mesh_frame_of_33_cuts(benchmark::State& state, Caches caches) {
  constexpr int kFirst = 12, kLast = 43;
  vtk_threads(1);
  const MemoryReserve kept(kKept);
  std::vector<double> frames, touches, meshed, cutting, blocks, crops, ratio;
  double triangles = 0, samples_in_crop = 0;
  for (auto _ : state) {
    Scene scene = cut_head(kFirst);
    for (int frame = kFirst; frame < kLast; ++frame) {
      std::set<BlockKey> stale;
      std::vector<CutReport> reports;
      std::vector<Coord> changed;
      const std::vector<Cut> cuts = frame_of_cuts(frame);
      cutting.push_back(seconds([&] {
        for (const Cut& cut : cuts) reports.push_back(scene.field.apply(cut));
      }));
      for (const CutReport& report : reports)
        changed.insert(changed.end(), report.changed_leaves.begin(), report.changed_leaves.end());
      BlockSamples samples;
      std::vector<BlockPayload> payloads;
      if (caches == Caches::cold) flush_caches();
      touches.push_back(seconds([&] {
        for (const CutReport& report : reports)
          for (const BlockKey& key : scene.blocks.touch(report.level, report.changed_leaves)) stale.insert(key);
      }));
      meshed.push_back(seconds([&] {
        for (const BlockKey& key : stale) {
          gather_block(scene.field, scene.blocks, key, kBonePitch_mm, samples);
          payloads.push_back(encode_block(samples));
        }
      }));
      frames.push_back(touches.back() + meshed.back());
      blocks.push_back(static_cast<double>(stale.size()));

      vtkNew<vtkImageData> image;
      fill_image(*image, scene.field, 2, baselines::crop_of(changed));
      FlyingEdges flying_edges(image);
      flying_edges.run();
      if (caches == Caches::cold) flush_caches();
      crops.push_back(seconds([&] { flying_edges.run(); }));
      ratio.push_back(crops.back() / frames.back());
      triangles = static_cast<double>(flying_edges.triangles());
      samples_in_crop = static_cast<double>(image->GetNumberOfPoints());
    }
  }
  state.counters["frame_ms"] = median(frames) * 1e3;
  state.counters["frame_max_ms"] = *std::ranges::max_element(frames) * 1e3;
  state.counters["touch_ms"] = median(touches) * 1e3;  // part of it: naming what is stale, with each cut
  state.counters["blocks_ms"] = median(meshed) * 1e3;  // part of it: gathering and encoding
  state.counters["cuts_ms"] = median(cutting) * 1e3;   // not part of it: the 33 cuts themselves
  state.counters["flying_edges_ms"] = median(crops) * 1e3;
  state.counters["ratio"] = median(crops) / median(frames);
  state.counters["ratio_min"] = *std::ranges::min_element(ratio);
  state.counters["ratio_max"] = *std::ranges::max_element(ratio);
  state.counters["blocks"] = median(blocks);
  state.counters["flying_edges_triangles"] = triangles;
  state.counters["flying_edges_samples"] = samples_in_crop;
}

void bytes_per_triangle(benchmark::State& state, const Scene& scene, const std::vector<BlockKey>& keys) {
  double bytes = 0, triangles = 0, blocks = 0;
  for (auto _ : state) {
    BlockSamples samples;
    for (const BlockKey& key : keys) {
      gather_block(scene.field, scene.blocks, key, kBonePitch_mm, samples);
      const BlockPayload payload = encode_block(samples);
      const auto mesh = decode_block(key, payload, samples.level_pitch_mm);
      OSTEON_CHECK(mesh.has_value());
      bytes += static_cast<double>(payload.bytes.size());
      triangles += static_cast<double>(mesh->triangles.size());
      blocks += !payload.bytes.empty();
    }
  }
  state.counters["bytes_per_triangle"] = bytes / triangles;
  state.counters["triangles"] = triangles;
  state.counters["blocks"] = blocks;
}

void mesh_bytes_per_triangle_cut(benchmark::State& state) {
  const Scene scene = cut_head(43);
  bytes_per_triangle(state, scene, scene.blocks.fine_blocks());
}

void mesh_bytes_per_triangle_bone(benchmark::State& state) {
  const Scene scene = head(kBonePitch_mm);
  bytes_per_triangle(state, scene, bone_blocks(scene.field));
}

// The surface of a cut with a 5 mm burr: a sphere of its radius through the block, solid outside.
constexpr double kPitch_mm = 0.125;
constexpr double kRadius_mm = 2.5;
const BlockKey kKey{.body = {}, .level = 2, .index = {0, 0, 0}};

std::vector<float> burred_block(const BlockKey& key) {
  const CoordBox box = block_samples(key);
  std::vector<float> values;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
        const Vec3 centre{1.0, 1.0, 1.0 + kRadius_mm};
        values.push_back(static_cast<float>(kRadius_mm - (position_mm({x, y, z}, kPitch_mm) - centre).norm()));
      }
  return values;
}

void mesh_encode(benchmark::State& state) {
  const auto solid = burred_block(kKey);
  const std::vector<float> uncut(solid.size(), -10.0f);
  BlockPayload payload;
  for (auto _ : state) {
    payload = encode_block(solid, uncut, 0, kPitch_mm);
    benchmark::DoNotOptimize(payload);
  }
  const auto mesh = decode_block(kKey, payload, kPitch_mm);
  OSTEON_CHECK(mesh.has_value() && !mesh->triangles.empty());
  state.counters["triangles"] = static_cast<double>(mesh->triangles.size());
  state.counters["bytes_per_triangle"] =
      static_cast<double>(payload.bytes.size()) / static_cast<double>(mesh->triangles.size());
}

void mesh_decode(benchmark::State& state) {
  const auto solid = burred_block(kKey);
  const auto payload = encode_block(solid, std::vector<float>(solid.size(), -10.0f), 0, kPitch_mm);
  for (auto _ : state) benchmark::DoNotOptimize(decode_block(kKey, payload, kPitch_mm));
}

void mesh_flying_edges(benchmark::State& state) {
  const auto solid = burred_block(kKey);
  vtk_threads(1);
  vtkNew<vtkImageData> image;
  image->SetDimensions(kBlockSamples, kBlockSamples, kBlockSamples);
  image->AllocateScalars(VTK_FLOAT, 1);
  for (int x = 0; x < kBlockSamples; ++x)
    for (int y = 0; y < kBlockSamples; ++y)
      for (int z = 0; z < kBlockSamples; ++z) {
        const auto at =
            (static_cast<std::size_t>(x + 1) * kBlockApron + static_cast<std::size_t>(y + 1)) * kBlockApron +
            static_cast<std::size_t>(z + 1);
        *static_cast<float*>(image->GetScalarPointer(x, y, z)) = solid[at];
      }
  FlyingEdges flying_edges(image, baselines::Inside::below);
  for (auto _ : state) flying_edges.run();
  state.counters["triangles"] = static_cast<double>(flying_edges.triangles());
}

BENCHMARK(mesh_encode)->Unit(benchmark::kMicrosecond);
BENCHMARK(mesh_decode)->Unit(benchmark::kMicrosecond);
BENCHMARK(mesh_flying_edges)->Unit(benchmark::kMicrosecond);
#define OSTEON_VERSUS(function, caches) \
  BENCHMARK_CAPTURE(function, caches, Caches::caches)->Iterations(1)->Unit(benchmark::kMillisecond)
OSTEON_VERSUS(mesh_block_versus_flying_edges, warm);
OSTEON_VERSUS(mesh_block_versus_flying_edges, cold);
OSTEON_VERSUS(mesh_whole_bone_versus_flying_edges, warm)->Arg(1)->Arg(2)->UseRealTime();
OSTEON_VERSUS(mesh_whole_bone_versus_flying_edges, cold)->Arg(1)->Arg(2)->UseRealTime();
OSTEON_VERSUS(mesh_frame_of_33_cuts, warm);
OSTEON_VERSUS(mesh_frame_of_33_cuts, cold);
BENCHMARK(mesh_bytes_per_triangle_cut)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK(mesh_bytes_per_triangle_bone)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace osteon::test
