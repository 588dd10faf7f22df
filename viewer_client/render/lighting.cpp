#include "viewer_client/render/lighting.hpp"

#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

namespace osteon {

namespace {

// Soft shadows in hollows up to this size, for saved pictures.
constexpr double kShadowRadius_mm = 6.0;
constexpr int kShadowSamples = 48;

// A light that moves with the camera. Position in units of the eye's distance: right, up, towards the eye.
void add_light(vtkRenderer& renderer, double x, double y, double z, double intensity, double r, double g, double b) {
  vtkNew<vtkLight> light;
  light->SetLightTypeToCameraLight();
  light->SetPosition(x, y, z);
  light->SetFocalPoint(0.0, 0.0, 0.0);
  light->SetColor(r, g, b);
  light->SetIntensity(intensity);
  renderer.AddLight(light);
}

}  // namespace

void set_lighting(vtkRenderer& renderer) {
  renderer.SetBackground(kBackground[0], kBackground[1], kBackground[2]);
  renderer.SetAutomaticLightCreation(0);
  add_light(renderer, -0.55, 0.75, 1.0, 0.78, 1.00, 0.97, 0.93);  // key, from the upper left
  add_light(renderer, 0.90, -0.10, 0.7, 0.34, 0.90, 0.94, 1.00);  // fill, from the right
  add_light(renderer, 0.0, 0.0, 1.0, 0.20, 1.0, 1.0, 1.0);        // headlight, so that no hole is black
  renderer.SetSSAORadius(kShadowRadius_mm);
  renderer.SetSSAOBias(0.02 * kShadowRadius_mm);
  renderer.SetSSAOKernelSize(kShadowSamples);
  renderer.SetSSAOBlur(true);
}

}  // namespace osteon
