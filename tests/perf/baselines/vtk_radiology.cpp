#include "tests/perf/baselines/vtk_radiology.hpp"

#include <vtkCamera.h>
#include <vtkColorTransferFunction.h>
#include <vtkFixedPointVolumeRayCastMapper.h>
#include <vtkImageData.h>
#include <vtkImageReslice.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPiecewiseFunction.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkVolume.h>
#include <vtkVolumeProperty.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "common/radiology/attenuation.hpp"

namespace osteon::baselines {
namespace {

using radiology::BoneHu;

// The samples in VTK's order: x fastest.
void fill(vtkImageData& image, const BoneHu& bone) {
  const radiology::HuLattice lattice = bone.lattice();
  const Coord d = lattice.dims, first = bone.box().min - Coord{1, 1, 1};
  image.SetDimensions(d.x, d.y, d.z);
  image.SetSpacing(bone.pitch_mm(), bone.pitch_mm(), bone.pitch_mm());
  image.SetOrigin(position_mm(first, bone.pitch_mm()).data());
  image.AllocateScalars(VTK_UNSIGNED_SHORT, 1);
  auto* to = static_cast<std::uint16_t*>(image.GetScalarPointer());
  for (std::int32_t z = 0; z < d.z; ++z)
    for (std::int32_t y = 0; y < d.y; ++y)
      for (std::int32_t x = 0; x < d.x; ++x, ++to)
        *to = lattice.steps[(to_index(x) * to_index(d.y) + to_index(y)) * to_index(d.z) + to_index(z)];
}

double ms_of_frame(vtkRenderWindow& window) {
  const auto start = std::chrono::steady_clock::now();
  window.Render();
  window.WaitForCompletion();
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct VtkRadiograph::Parts {
  vtkNew<vtkImageData> image;
  vtkNew<vtkFixedPointVolumeRayCastMapper> mapper;
  vtkNew<vtkVolume> volume;
  vtkNew<vtkRenderer> renderer;
  vtkNew<vtkRenderWindow> window;
  int columns = 0, rows = 0;
};

VtkRadiograph::VtkRadiograph(const BoneHu& bone, const radiology::ConeBeam& beam) : parts_(std::make_unique<Parts>()) {
  Parts& p = *parts_;
  const radiology::PixelGrid& grid = beam.detector;
  p.columns = grid.columns;
  p.rows = grid.rows;
  fill(*p.image, bone);
  p.mapper->SetInputData(p.image);
  p.mapper->SetNumberOfThreads(1);
  p.mapper->SetBlendModeToComposite();
  p.mapper->AutoAdjustSampleDistancesOff();
  p.mapper->SetSampleDistance(static_cast<float>(bone.pitch_mm()));
  p.mapper->SetImageSampleDistance(1.0f);
  vtkNew<vtkPiecewiseFunction> opacity;
  for (double steps = 0.0; steps <= 65535.0; steps += 100.0)
    opacity->AddPoint(steps, 1.0 - std::exp(-radiology::kStep_per_mm * steps));
  vtkNew<vtkColorTransferFunction> black;
  black->AddRGBPoint(0.0, 0.0, 0.0, 0.0);
  vtkNew<vtkVolumeProperty> property;
  property->SetScalarOpacity(opacity);
  property->SetScalarOpacityUnitDistance(1.0);
  property->SetColor(black);
  property->SetInterpolationTypeToLinear();
  property->ShadeOff();
  p.volume->SetMapper(p.mapper);
  p.volume->SetProperty(property);
  p.renderer->AddVolume(p.volume);
  p.renderer->SetBackground(1.0, 1.0, 1.0);
  p.window->SetMultiSamples(0);
  p.window->SetSize(grid.columns, grid.rows);
  p.window->AddRenderer(p.renderer);
  const Vec3 centre = grid.at(0.5 * (grid.columns - 1), 0.5 * (grid.rows - 1)), up = -grid.row_mm.normalized();
  const double height = grid.row_mm.norm() * grid.rows, distance = (centre - beam.source_mm).norm();
  vtkCamera& camera = *p.renderer->GetActiveCamera();
  camera.SetPosition(beam.source_mm.data());
  camera.SetFocalPoint(centre.data());
  camera.SetViewUp(up.data());
  camera.SetViewAngle(2.0 * std::atan(0.5 * height / distance) * 180.0 / std::numbers::pi);
  p.renderer->ResetCameraClippingRange();
}
VtkRadiograph::~VtkRadiograph() = default;

double VtkRadiograph::cast_ms() {
  parts_->volume->VisibilityOff();
  const double empty = ms_of_frame(*parts_->window);
  parts_->volume->VisibilityOn();
  parts_->image->Modified();  // as after a cut
  return ms_of_frame(*parts_->window) - empty;
}

std::vector<std::uint8_t> VtkRadiograph::picture() const {
  vtkNew<vtkUnsignedCharArray> pixels;
  parts_->window->GetRGBACharPixelData(0, 0, parts_->columns - 1, parts_->rows - 1, 1, pixels);
  std::vector<std::uint8_t> grey;
  for (int row = parts_->rows - 1; row >= 0; --row)
    for (int column = parts_->columns - 1; column >= 0; --column)
      grey.push_back(pixels->GetValue(4 * (static_cast<vtkIdType>(row) * parts_->columns + column)));
  return grey;
}

struct VtkSlices::Parts {
  vtkNew<vtkImageData> image;
  vtkNew<vtkImageReslice> reslice;
};

VtkSlices::VtkSlices(const BoneHu& bone) : parts_(std::make_unique<Parts>()) {
  fill(*parts_->image, bone);
  parts_->reslice->SetInputData(parts_->image);
  parts_->reslice->SetNumberOfThreads(1);
  parts_->reslice->SetEnableSMP(false);
  parts_->reslice->SetOutputDimensionality(2);
  parts_->reslice->SetInterpolationModeToLinear();
  parts_->reslice->SetBackgroundLevel(0.0);
}
VtkSlices::~VtkSlices() = default;

std::span<const std::uint16_t> VtkSlices::slice(const radiology::PixelGrid& plane) {
  const Vec3 right = plane.column_mm.normalized(), down = plane.row_mm.normalized(), normal = right.cross(down);
  vtkNew<vtkMatrix4x4> axes;
  for (int i = 0; i < 3; ++i) {
    axes->SetElement(i, 0, right[i]);
    axes->SetElement(i, 1, down[i]);
    axes->SetElement(i, 2, normal[i]);
    axes->SetElement(i, 3, plane.first_mm[i]);
  }
  vtkImageReslice& reslice = *parts_->reslice;
  reslice.SetResliceAxes(axes);
  reslice.SetOutputSpacing(plane.column_mm.norm(), plane.row_mm.norm(), 1.0);
  reslice.SetOutputOrigin(0.0, 0.0, 0.0);
  reslice.SetOutputExtent(0, plane.columns - 1, 0, plane.rows - 1, 0, 0);
  reslice.Update();
  return {static_cast<const std::uint16_t*>(reslice.GetOutput()->GetScalarPointer()), plane.count()};
}

}  // namespace osteon::baselines
