#include "viewer_client/render/stereo.hpp"

#include <vtkCamera.h>
#include <vtkNew.h>
#include <vtkProp.h>
#include <vtkPropCollection.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <numbers>

#include "viewer_client/render/lighting.hpp"
#include "viewer_client/render/view_of_camera.hpp"

namespace osteon {

namespace {

// Between the eyes, seen from the target. 2 degrees are 6 cm at 1.7 m, which is comfortable on a desk.
constexpr double kBetweenEyes_rad = 2.0 * std::numbers::pi / 180.0;

CameraView turned(const CameraView& view, double right_rad) {
  const Eigen::AngleAxisd turn(right_rad, view.up.normalized());
  CameraView eye = view;
  eye.eye_mm = view.target_mm + turn * (view.eye_mm - view.target_mm);
  return eye;
}

}  // namespace

CameraView left_eye(const CameraView& view) { return turned(view, -0.5 * kBetweenEyes_rad); }
CameraView right_eye(const CameraView& view) { return turned(view, 0.5 * kBetweenEyes_rad); }

struct Stereo::Impl {
  Impl(vtkRenderWindow& in, vtkRenderer& of) : window(in), scene(of) { set_lighting(*right); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { window.RemoveRenderer(right); }

  vtkRenderWindow& window;
  vtkRenderer& scene;
  vtkNew<vtkRenderer> right;
  StereoMode mode = StereoMode::off;

  // The same actors. Texts in corners have their place in each picture.
  void share_actors() {
    right->RemoveAllViewProps();
    vtkPropCollection* props = scene.GetViewProps();
    vtkCollectionSimpleIterator at;
    props->InitTraversal(at);
    while (vtkProp* prop = props->GetNextProp(at)) right->AddViewProp(prop);
  }
};

Stereo::Stereo(vtkRenderWindow& window, vtkRenderer& scene) : impl_(std::make_unique<Impl>(window, scene)) {}
Stereo::~Stereo() = default;

StereoMode Stereo::mode() const { return impl_->mode; }

vtkRenderer& Stereo::right() const { return *impl_->right; }

bool Stereo::set(StereoMode mode) {
  vtkRenderWindow& window = impl_->window;
  // A window learns at its first picture what it has. Quad buffers must have been asked for before that.
  const bool has = mode != StereoMode::quad_buffer || window.GetStereoCapableWindow() != 0;
  if (!has) mode = StereoMode::off;
  impl_->mode = mode;
  window.RemoveRenderer(impl_->right);
  impl_->right->RemoveAllViewProps();
  impl_->scene.SetViewport(0.0, 0.0, 1.0, 1.0);
  if (mode == StereoMode::side_by_side) {
    impl_->scene.SetViewport(0.0, 0.0, 0.5, 1.0);
    impl_->right->SetViewport(0.5, 0.0, 1.0, 1.0);
    window.AddRenderer(impl_->right);
  }
  if (mode == StereoMode::anaglyph) window.SetStereoTypeToAnaglyph();
  if (mode == StereoMode::anaglyph) window.SetAnaglyphColorMask(4, 3);
  if (mode == StereoMode::quad_buffer) window.SetStereoTypeToCrystalEyes();
  window.SetStereoRender(mode == StereoMode::anaglyph || mode == StereoMode::quad_buffer ? 1 : 0);
  return has;
}

void Stereo::place(const CameraView& view) {
  if (impl_->mode == StereoMode::off) return;
  impl_->scene.GetActiveCamera()->SetEyeAngle(kBetweenEyes_rad * 180.0 / std::numbers::pi);
  if (impl_->mode != StereoMode::side_by_side) return;
  impl_->share_actors();
  set_view(*impl_->scene.GetActiveCamera(), left_eye(view));
  set_view(*impl_->right->GetActiveCamera(), right_eye(view));
  impl_->right->ResetCameraClippingRange();
}

}  // namespace osteon
