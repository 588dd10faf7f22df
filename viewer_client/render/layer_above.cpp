#include "viewer_client/render/layer_above.hpp"

#include <vtkNew.h>
#include <vtkProp.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>

namespace osteon {

struct LayerAbove::Impl {
  Impl(vtkRenderWindow& in, const BonePictures& of) : window(in), bone{of.left, of.right} {
    window.SetNumberOfLayers(std::max(2, window.GetNumberOfLayers()));
    for (int picture = 0; picture < kPictures; ++picture) {
      vtkRenderer* layer = above[static_cast<std::size_t>(picture)];
      layer->SetLayer(1);
      layer->InteractiveOff();
      layer->SetActiveCamera(bone[static_cast<std::size_t>(picture)]->GetActiveCamera());
      layer->SetDraw(0);
      window.AddRenderer(layer);
    }
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    for (vtkRenderer* layer : above) window.RemoveRenderer(layer);
  }

  vtkRenderWindow& window;
  std::array<vtkRenderer*, kPictures> bone;
  std::array<vtkNew<vtkRenderer>, kPictures> above;
};

LayerAbove::LayerAbove(vtkRenderWindow& window, const BonePictures& bone)
    : impl_(std::make_unique<Impl>(window, bone)) {}

LayerAbove::~LayerAbove() = default;

vtkRenderer* LayerAbove::above(int picture) const { return impl_->above[static_cast<std::size_t>(picture)]; }

void LayerAbove::add(vtkProp* prop) {
  for (int picture = 0; picture < kPictures; ++picture) add(prop, picture);
}

void LayerAbove::add(vtkProp* prop, int picture) { above(picture)->AddViewProp(prop); }

void LayerAbove::remove(vtkProp* prop) {
  for (vtkRenderer* layer : impl_->above) layer->RemoveViewProp(prop);
}

void LayerAbove::place(bool any, bool two_pictures) {
  for (int picture = 0; picture < kPictures; ++picture) {
    above(picture)->SetViewport(impl_->bone[static_cast<std::size_t>(picture)]->GetViewport());
    above(picture)->SetDraw(any && (picture == 0 || two_pictures) ? 1 : 0);
  }
}

LayerAbove::Frame LayerAbove::frame(int picture) const {
  const int* size = impl_->window.GetSize();
  const double* share = impl_->bone[static_cast<std::size_t>(picture)]->GetViewport();
  const auto px = [](double value) { return static_cast<int>(std::lround(value)); };
  const int left = px(share[0] * size[0]);
  return {left, px(share[2] * size[0]) - left, size[1]};
}

std::array<double, 2> LayerAbove::on_screen(int picture, const std::array<double, 3>& point_mm) const {
  vtkRenderer& bone = *impl_->bone[static_cast<std::size_t>(picture)];
  bone.SetWorldPoint(point_mm[0], point_mm[1], point_mm[2], 1.0);
  bone.WorldToDisplay();
  return {bone.GetDisplayPoint()[0] - frame(picture).left, bone.GetDisplayPoint()[1]};
}

}  // namespace osteon
