#include "viewer_client/render/view_of_camera.hpp"

#include <vtkCamera.h>

#include <numbers>

namespace osteon {

void set_view(vtkCamera& camera, const CameraView& view) {
  camera.SetPosition(view.eye_mm.x(), view.eye_mm.y(), view.eye_mm.z());
  camera.SetFocalPoint(view.target_mm.x(), view.target_mm.y(), view.target_mm.z());
  camera.SetViewUp(view.up.x(), view.up.y(), view.up.z());
  camera.SetViewAngle(view.view_angle_rad * 180.0 / std::numbers::pi);
}

CameraView view_of(vtkCamera& camera) {
  CameraView view;
  camera.GetPosition(view.eye_mm.data());
  camera.GetFocalPoint(view.target_mm.data());
  camera.GetViewUp(view.up.data());
  view.view_angle_rad = camera.GetViewAngle() * std::numbers::pi / 180.0;
  return view;
}

}  // namespace osteon
