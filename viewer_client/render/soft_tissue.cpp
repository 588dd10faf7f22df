#include "viewer_client/render/soft_tissue.hpp"

#include <vtkColorTransferFunction.h>
#include <vtkFixedPointVolumeRayCastMapper.h>
#include <vtkImageData.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderer.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace osteon {

namespace {

// [A] Usual HU: fat from -120 on, muscle at 50, cancellous bone from 200 on, cortex from 800 on. The skin is seen where
// voxels are partly air.
struct TissueLook {
  double hu, opacity_per_mm;
  double red, green, blue;  // 0 to 1
};
constexpr TissueLook kTissueLooks[] = {
    {-500.0, 0.0, 0.90, 0.72, 0.60},  {-300.0, 0.020, 0.90, 0.72, 0.60}, {-150.0, 0.008, 0.93, 0.80, 0.58},
    {-30.0, 0.008, 0.93, 0.78, 0.56}, {20.0, 0.018, 0.74, 0.32, 0.26},   {90.0, 0.020, 0.78, 0.36, 0.30},
    {180.0, 0.030, 0.88, 0.62, 0.50}, {300.0, 0.25, 0.93, 0.86, 0.74},   {900.0, 0.60, 0.96, 0.92, 0.84},
    {2000.0, 0.80, 1.0, 0.98, 0.95},
};
constexpr double kFineSample = 0.6;      // of the smallest voxel edge, along a ray
constexpr double kMostRays = 200'000.0;  // [A] the mapper casts on the CPU
constexpr float kCoarseRays = 3.0f, kCoarseSamples = 3.0f;

}  // namespace

struct SoftTissue::Impl {
  explicit Impl(vtkRenderer& in) : renderer(in) {
    vtkNew<vtkPiecewiseFunction> opacity;
    vtkNew<vtkColorTransferFunction> colour;
    for (const TissueLook& look : kTissueLooks) {
      opacity->AddPoint(look.hu, look.opacity_per_mm);
      colour->AddRGBPoint(look.hu, look.red, look.green, look.blue);
    }
    vtkVolumeProperty* look = volume->GetProperty();
    look->SetScalarOpacity(opacity);
    look->SetScalarOpacityUnitDistance(1.0);
    look->SetColor(colour);
    look->SetInterpolationTypeToLinear();
    // VTK's shading is black inside muscle, where the HU change in no direction.
    look->ShadeOff();
    mapper->SetBlendModeToComposite();
    mapper->AutoAdjustSampleDistancesOff();
    volume->SetMapper(mapper);
  }

  vtkRenderer& renderer;
  vtkNew<vtkFixedPointVolumeRayCastMapper> mapper;
  vtkNew<vtkVolume> volume;
  bool shown = false;
  float sample_mm = 1.0f;
};

SoftTissue::SoftTissue(vtkRenderer& renderer) : impl_(std::make_unique<Impl>(renderer)) {}

SoftTissue::~SoftTissue() { hide(); }

void SoftTissue::show(const VoxelGrid& grid, std::span<const std::int16_t> hu) {
  hide();
  // The distances of voxels belong to the data, because rays are sampled in them. Directions and place are the
  // volume's.
  const Vec3 edges_mm = grid.axes_mm.colwise().norm();
  vtkNew<vtkImageData> image;
  image->SetDimensions(grid.dims[0], grid.dims[1], grid.dims[2]);
  image->SetSpacing(edges_mm.x(), edges_mm.y(), edges_mm.z());
  image->AllocateScalars(VTK_SHORT, 1);
  std::memcpy(image->GetScalarPointer(), hu.data(), hu.size_bytes());
  vtkNew<vtkMatrix4x4> placed;
  for (int row = 0; row < 3; ++row) {
    for (int axis = 0; axis < 3; ++axis) placed->SetElement(row, axis, grid.axes_mm(row, axis) / edges_mm[axis]);
    placed->SetElement(row, 3, grid.origin_mm[row]);
  }
  impl_->mapper->SetInputData(image);
  impl_->volume->SetUserMatrix(placed);
  impl_->sample_mm = static_cast<float>(kFineSample * edges_mm.minCoeff());
  impl_->renderer.AddVolume(impl_->volume);
  impl_->shown = true;
  set_coarse(false);
}

void SoftTissue::hide() {
  if (!impl_->shown) return;
  impl_->renderer.RemoveVolume(impl_->volume);
  impl_->mapper->SetInputData(static_cast<vtkImageData*>(nullptr));
  impl_->shown = false;
}

bool SoftTissue::shown() const { return impl_->shown; }

void SoftTissue::set_coarse(bool coarse) {
  const int* size = impl_->renderer.GetSize();
  const double pixels = static_cast<double>(size[0]) * size[1];
  const auto fine_px = static_cast<float>(std::max(1.0, std::sqrt(pixels / kMostRays)));
  impl_->mapper->SetImageSampleDistance(coarse ? kCoarseRays * fine_px : fine_px);
  impl_->mapper->SetSampleDistance(coarse ? kCoarseSamples * impl_->sample_mm : impl_->sample_mm);
}

}  // namespace osteon
