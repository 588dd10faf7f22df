// What one block of surface costs to make and to read, against VTK's flying edges on the same samples.
#include <benchmark/benchmark.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <cmath>
#include <vector>

#include "common/core/check.hpp"
#include "common/surface/mesh_block.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.125;
constexpr double kRadius_mm = 2.5;

// The surface that a 5 mm burr leaves: a sphere of its radius through the block, solid outside.
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

const BlockKey kKey{.body = {}, .level = 2, .index = {0, 0, 0}};

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
  vtkNew<vtkFlyingEdges3D> filter;
  filter->SetInputData(image);
  filter->SetValue(0, 0.0);
  filter->ComputeNormalsOn();
  filter->ComputeGradientsOff();
  for (auto _ : state) {
    filter->Modified();
    filter->Update();
  }
  state.counters["triangles"] = static_cast<double>(filter->GetOutput()->GetNumberOfPolys());
}

BENCHMARK(mesh_encode)->Unit(benchmark::kMicrosecond);
BENCHMARK(mesh_decode)->Unit(benchmark::kMicrosecond);
BENCHMARK(mesh_flying_edges)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace osteon::test
