#include "viewer_client/render/solid_marks.hpp"

#include <vtkActor.h>
#include <vtkAppendPolyData.h>
#include <vtkConeSource.h>
#include <vtkCubeSource.h>
#include <vtkGlyph3D.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkSphereSource.h>

#include <array>

#include "viewer_client/render/layer_above.hpp"

namespace osteon {

namespace {

// Red, green, blue. As on the planes.
constexpr std::array<std::array<double, 3>, 3> kMarkColours{
    {{0.98, 0.86, 0.47}, {0.98, 0.86, 0.47}, {1.0, 0.24, 0.24}}};
// In radii of a ball.
constexpr double kBarLength = 3.2, kBarWidth = 0.4, kPyramidHeight = 2.6, kPyramidRadius = 1.6;
constexpr int kBallSides = 12, kPyramidSides = 3;
constexpr double kMarkAmbient = 0.65;  // light from everywhere, so that no side is black

}  // namespace

struct SolidMarks::Impl {
  struct Kind {
    vtkNew<vtkPolyData> places;
    vtkNew<vtkGlyph3D> shapes;
    vtkNew<vtkPolyDataMapper> mapper;
    vtkNew<vtkActor> actor;
  };

  explicit Impl(LayerAbove& over) : layer(over) {
    vtkNew<vtkSphereSource> ball;
    ball->SetRadius(1.0);
    ball->SetThetaResolution(kBallSides);
    ball->SetPhiResolution(kBallSides);
    vtkNew<vtkAppendPolyData> star;
    for (int axis = 0; axis < 3; ++axis) {
      vtkNew<vtkCubeSource> bar;
      bar->SetXLength(axis == 0 ? kBarLength : kBarWidth);
      bar->SetYLength(axis == 1 ? kBarLength : kBarWidth);
      bar->SetZLength(axis == 2 ? kBarLength : kBarWidth);
      star->AddInputConnection(bar->GetOutputPort());
    }
    vtkNew<vtkConeSource> pyramid;
    pyramid->SetDirection(0.0, 0.0, 1.0);
    pyramid->SetHeight(kPyramidHeight);
    pyramid->SetRadius(kPyramidRadius);
    pyramid->SetResolution(kPyramidSides);
    const std::array<vtkAlgorithmOutput*, 3> forms{ball->GetOutputPort(), star->GetOutputPort(),
                                                   pyramid->GetOutputPort()};
    for (std::size_t i = 0; i < kinds.size(); ++i) {
      Kind& kind = kinds[i];
      kind.shapes->SetSourceConnection(forms[i]);
      kind.shapes->SetInputData(kind.places);
      kind.shapes->SetScaleModeToDataScalingOff();
      kind.shapes->OrientOff();
      kind.mapper->SetInputConnection(kind.shapes->GetOutputPort());
      kind.mapper->ScalarVisibilityOff();
      kind.actor->SetMapper(kind.mapper);
      vtkProperty* paint = kind.actor->GetProperty();
      paint->SetColor(kMarkColours[i][0], kMarkColours[i][1], kMarkColours[i][2]);
      paint->SetAmbient(kMarkAmbient);
      paint->SetDiffuse(1.0 - kMarkAmbient);
      kind.actor->VisibilityOff();
      layer.add(kind.actor, 0);
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    for (Kind& kind : kinds) layer.remove(kind.actor);
  }

  LayerAbove& layer;
  std::array<Kind, 3> kinds;
};

SolidMarks::SolidMarks(LayerAbove& layer) : impl_(std::make_unique<Impl>(layer)) {}

SolidMarks::~SolidMarks() = default;

void SolidMarks::show(SolidMark kind, std::span<const Vec3> points_mm, double radius_mm) {
  Impl::Kind& of = impl_->kinds[static_cast<std::size_t>(kind)];
  vtkNew<vtkPoints> points;
  for (const Vec3& point : points_mm) points->InsertNextPoint(point.x(), point.y(), point.z());
  of.places->SetPoints(points);
  of.shapes->SetScaleFactor(radius_mm);
  of.actor->SetVisibility(points_mm.empty() ? 0 : 1);
}

}  // namespace osteon
