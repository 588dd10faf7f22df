#include "viewer_client/render/bone_scene.hpp"

#include <vtkCamera.h>
#include <vtkCullerCollection.h>
#include <vtkFrustumCoverageCuller.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <utility>

#include "viewer_client/render/bone_actors.hpp"
#include "viewer_client/render/lighting.hpp"
#include "viewer_client/render/orientation_marker.hpp"
#include "viewer_client/render/people_overlay.hpp"
#include "viewer_client/render/plan_actors.hpp"
#include "viewer_client/render/status_text.hpp"
#include "viewer_client/render/tool_actors.hpp"
#include "viewer_client/render/view_of_camera.hpp"

namespace osteon {

struct BoneScene::Impl {
  vtkRenderWindow& window;
  vtkNew<vtkRenderer> renderer;
  BoneActors bone{*renderer};
  ToolActors tools{*renderer};
  StatusText status{*renderer};
  OrientationMarker marker{window};
  Stereo stereo{window, *renderer};
  std::optional<PeopleOverlay> people;
  std::optional<PlanActors> plan;

  bool smooth = false;
  std::vector<std::string> said;
  std::string holding, hint;
  std::vector<Vec3> stroke_mm;

  explicit Impl(vtkRenderWindow& on);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  void add_in_order();
};

BoneScene::Impl::Impl(vtkRenderWindow& on) : window(on) {
  // Default multisampling is several times slower in software.
  window.SetMultiSamples(0);
  window.AddRenderer(renderer);
  set_lighting(*renderer);
  // Draws near regions first, so that hidden regions need no lighting. This saves a quarter of a close frame in
  // software.
  if (auto* culler = vtkFrustumCoverageCuller::SafeDownCast(renderer->GetCullers()->GetLastItem())) {
    culler->SetSortingStyleToFrontToBack();
  }
  const BonePictures pictures{renderer, &stereo.right()};
  people.emplace(pictures, window, [this](const Vec3& point_mm) { return bone.normal_at(point_mm); });
  plan.emplace(pictures, window);
}

BoneScene::Impl::~Impl() {
  plan.reset();
  people.reset();
  window.RemoveRenderer(renderer);
}

// Regions at the same distance are drawn in the order of their keys, not of their arrival. One surface then gives one
// picture, even where two triangles coincide.
void BoneScene::Impl::add_in_order() {
  bone.remove();
  tools.remove();
  bone.add();
  tools.add();
}

BoneScene::BoneScene(vtkRenderWindow& window) : impl_(std::make_unique<Impl>(window)) {}

BoneScene::~BoneScene() = default;

void BoneScene::show_region(const RegionKey& region, const Mesh& mesh) {
  if (impl_->bone.show(region, mesh)) impl_->add_in_order();
}

void BoneScene::set_density(std::shared_ptr<const DensityGrid> density) { impl_->bone.set_density(std::move(density)); }

void BoneScene::show_tools(std::span<const CuttingState> states) {
  if (impl_->tools.show_tools(states)) impl_->add_in_order();
  impl_->people->show_tools(states);
}

void BoneScene::learn_tool(const Tool& tool) { impl_->tools.learn(tool); }

void BoneScene::show_items(std::span<const SceneItem> items) {
  impl_->tools.show_items(items);
  impl_->add_in_order();
}

void BoneScene::show_text(const std::string& gauges, const std::string& notice) { impl_->status.show(gauges, notice); }

void BoneScene::show_annotations(std::span<const Annotation> drawn) { impl_->people->show_annotations(drawn); }

void BoneScene::show_names(std::map<AuthorId, std::string> names) { impl_->people->show_names(std::move(names)); }

void BoneScene::show_words(const std::vector<std::string>& said, const std::string& holding) {
  impl_->said = said;
  impl_->holding = holding;
}

void BoneScene::show_pen(const std::string& hint, const std::vector<Vec3>& stroke_mm) {
  impl_->hint = hint;
  impl_->stroke_mm = stroke_mm;
}

std::optional<Vec3> BoneScene::surface_at(int x_px, int y_px) const {
  return impl_->bone.surface_at(x_px, impl_->window.GetActualSize()[1] - 1 - y_px);
}

std::optional<Vec3> BoneScene::normal_at(const Vec3& point_mm) const { return impl_->bone.normal_at(point_mm); }

void BoneScene::look(const CameraView& view) { set_view(*impl_->renderer->GetActiveCamera(), view); }

CameraView BoneScene::camera() const { return view_of(*impl_->renderer->GetActiveCamera()); }

void BoneScene::show_plan(const SurgicalPlan& plan) { impl_->plan->show(plan); }

void BoneScene::name_axes(std::function<std::string(const std::string&)> written) {
  impl_->plan->name_axes(std::move(written));
}

void BoneScene::show_planned(bool on) { impl_->plan->set_planned(on); }

void BoneScene::show_risks(bool on) { impl_->plan->set_risks(on); }

void BoneScene::show_marker(bool on) { impl_->marker.show(on); }

void BoneScene::clip(const Clipping& visible) { impl_->bone.clip(visible); }

bool BoneScene::set_stereo(StereoMode mode) { return impl_->stereo.set(mode); }

StereoMode BoneScene::stereo() const { return impl_->stereo.mode(); }

void BoneScene::set_smooth(bool smooth) {
  impl_->smooth = smooth;
  impl_->renderer->SetUseFXAA(smooth);
}

void BoneScene::draw() {
  impl_->people->show_words(impl_->said, impl_->holding, impl_->hint);
  impl_->people->show_stroke(impl_->stroke_mm);
  const CameraView view = camera();
  const bool two_pictures = stereo() == StereoMode::side_by_side;
  impl_->marker.follow(view);
  impl_->stereo.place(view);  // first, because names and axes are placed with these cameras
  impl_->people->place(two_pictures);
  impl_->plan->place(two_pictures);
  impl_->renderer->ResetCameraClippingRange();
  impl_->window.Render();
  impl_->window.WaitForCompletion();
  look(view);
}

Result<void> BoneScene::save_png(const std::filesystem::path& file) {
  impl_->renderer->SetUseSSAO(true);
  impl_->renderer->SetUseFXAA(true);
  draw();
  const Image picture = image();
  impl_->renderer->SetUseSSAO(false);
  impl_->renderer->SetUseFXAA(impl_->smooth);
  return write_png(picture, file);
}

Image BoneScene::image() const { return image_of(impl_->window); }

bool draws_in_software(vtkRenderWindow& window) {
  const std::string capabilities = window.ReportCapabilities();
  return capabilities.find("llvmpipe") != std::string::npos || capabilities.find("softpipe") != std::string::npos;
}

}  // namespace osteon
