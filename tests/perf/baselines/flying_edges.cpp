#include "tests/perf/baselines/flying_edges.hpp"

#include <algorithm>
#include <functional>
#include <vector>

#include "common/core/check.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon::baselines {

void fill_image(vtkImageData& image, const CutField& field, int level, const CoordBox& box, Inside inside) {
  const Coord d = box.dims();
  image.SetDimensions(d.z, d.y, d.x);
  image.AllocateScalars(VTK_FLOAT, 1);
  const std::size_t plane = static_cast<std::size_t>(d.y) * static_cast<std::size_t>(d.z);
  auto* out = static_cast<float*>(image.GetScalarPointer());
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x, out += plane) {
    const std::span<float> values(out, plane);
    field.gather_solid(level, {{x, box.min.y, box.min.z}, {x, box.max.y, box.max.z}}, values);
    if (inside == Inside::above) std::ranges::transform(values, values.begin(), std::negate());
  }
}

FlyingEdges::FlyingEdges(vtkImageData* image, Inside inside) {
  constexpr double kJustAbove = 1e-30;
  filter_->SetInputData(image);
  filter_->SetValue(0, inside == Inside::above ? kJustAbove : 0.0);
  filter_->ComputeNormalsOn();
  filter_->ComputeGradientsOff();
}

void FlyingEdges::run() {
  filter_->Modified();
  filter_->Update();
}

long long FlyingEdges::triangles() { return filter_->GetOutput()->GetNumberOfPolys(); }

CoordBox crop_of(std::span<const Coord> changed_leaves) {
  OSTEON_CHECK(!changed_leaves.empty());
  CoordBox crop{changed_leaves.front(), changed_leaves.front()};
  for (const Coord& leaf : changed_leaves) {
    crop.min = {std::min(crop.min.x, leaf.x), std::min(crop.min.y, leaf.y), std::min(crop.min.z, leaf.z)};
    crop.max = {std::max(crop.max.x, leaf.x), std::max(crop.max.y, leaf.y), std::max(crop.max.z, leaf.z)};
  }
  crop.max = crop.max + Coord{kLeafSize - 1, kLeafSize - 1, kLeafSize - 1};
  return crop.grown(1);
}

}  // namespace osteon::baselines
