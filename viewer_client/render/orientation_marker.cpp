#include "viewer_client/render/orientation_marker.hpp"

#include <vtkAnnotatedCubeActor.h>
#include <vtkCamera.h>
#include <vtkNew.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <algorithm>

namespace osteon {

namespace {

constexpr int kLeast_px = 48, kMost_px = 110;
constexpr double kShare = 0.16;    // of the window's shorter side
constexpr double kDistance = 4.6;  // of the eye, in edges of the cube: all of it is seen from any side
constexpr double kAngle_deg = 24.0;

void set_colours(vtkAnnotatedCubeActor& cube) {
  // One colour for each axis, so that a face is recognised before its letter is.
  const auto colour = [](vtkProperty* face, double r, double g, double b) {
    face->SetColor(r, g, b);
    face->SetAmbient(0.45);
    face->SetDiffuse(0.6);
  };
  colour(cube.GetXPlusFaceProperty(), 0.10, 0.02, 0.02);
  colour(cube.GetXMinusFaceProperty(), 0.10, 0.02, 0.02);
  colour(cube.GetYPlusFaceProperty(), 0.02, 0.10, 0.02);
  colour(cube.GetYMinusFaceProperty(), 0.02, 0.10, 0.02);
  colour(cube.GetZPlusFaceProperty(), 0.02, 0.02, 0.10);
  colour(cube.GetZMinusFaceProperty(), 0.02, 0.02, 0.10);
  colour(cube.GetCubeProperty(), 0.86, 0.88, 0.90);
  colour(cube.GetTextEdgesProperty(), 0.2, 0.2, 0.2);
}

}  // namespace

struct OrientationMarker::Impl {
  explicit Impl(vtkRenderWindow& on) : window(on) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { window.RemoveRenderer(renderer); }

  vtkRenderWindow& window;
  vtkNew<vtkRenderer> renderer;
  vtkNew<vtkAnnotatedCubeActor> cube;
  bool shown = false;
};

OrientationMarker::OrientationMarker(vtkRenderWindow& window) : impl_(std::make_unique<Impl>(window)) {
  vtkAnnotatedCubeActor& cube = *impl_->cube;
  // DICOM LPS: +x to the patient's left, +y to the back, +z to the head.
  cube.SetXPlusFaceText("L");
  cube.SetXMinusFaceText("R");
  cube.SetYPlusFaceText("P");
  cube.SetYMinusFaceText("A");
  cube.SetZPlusFaceText("H");
  cube.SetZMinusFaceText("F");
  cube.SetFaceTextScale(0.62);
  cube.SetZFaceTextRotation(90);
  set_colours(cube);
  impl_->renderer->AddActor(impl_->cube);
  impl_->renderer->SetLayer(1);
  impl_->renderer->InteractiveOff();
  window.SetNumberOfLayers(std::max(2, window.GetNumberOfLayers()));
}

OrientationMarker::~OrientationMarker() = default;

void OrientationMarker::show(bool on) {
  if (on == impl_->shown) return;
  impl_->shown = on;
  if (on)
    impl_->window.AddRenderer(impl_->renderer);
  else
    impl_->window.RemoveRenderer(impl_->renderer);
}

void OrientationMarker::follow(const CameraView& view) {
  if (!impl_->shown) return;
  const int* size = impl_->window.GetSize();
  const double edge_px = std::clamp<double>(kShare * std::min(size[0], size[1]), kLeast_px, kMost_px);
  impl_->renderer->SetViewport(1.0 - edge_px / std::max(1, size[0]), 0.0, 1.0, edge_px / std::max(1, size[1]));
  const Vec3 eye = kDistance * (view.eye_mm - view.target_mm).normalized();
  vtkCamera* camera = impl_->renderer->GetActiveCamera();
  camera->SetFocalPoint(0.0, 0.0, 0.0);
  camera->SetPosition(eye.x(), eye.y(), eye.z());
  camera->SetViewUp(view.up.x(), view.up.y(), view.up.z());
  camera->SetViewAngle(kAngle_deg);
  impl_->renderer->ResetCameraClippingRange();
}

}  // namespace osteon
