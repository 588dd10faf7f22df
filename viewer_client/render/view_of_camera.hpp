// CameraView and VTK's camera.
#pragma once
#include "viewer_client/scene/camera_view.hpp"

class vtkCamera;

namespace osteon {

void set_view(vtkCamera& camera, const CameraView& view);
[[nodiscard]] CameraView view_of(vtkCamera& camera);

}  // namespace osteon
