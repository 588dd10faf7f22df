#include "viewer_client/render/window.hpp"

#include <vtkCamera.h>
#include <vtkCullerCollection.h>
#include <vtkFrustumCoverageCuller.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>

#include <numbers>
#include <utility>

#include "viewer_client/render/bone_actors.hpp"
#include "viewer_client/render/lighting.hpp"
#include "viewer_client/render/people_overlay.hpp"
#include "viewer_client/render/status_text.hpp"
#include "viewer_client/render/tool_actors.hpp"
#include "viewer_client/render/x_connection.hpp"

namespace osteon {

namespace {

void set_up(vtkRenderWindow& window, vtkRenderer& renderer, const WindowOptions& options) {
  // Default multisampling is several times slower in software.
  window.SetMultiSamples(0);
  window.SetSize(options.width_px, options.height_px);
  window.SetWindowName(options.title.c_str());
  window.AddRenderer(&renderer);
  set_lighting(renderer);
  // Draws near regions first, so that hidden regions need no lighting. This saves a quarter of a close frame in
  // software.
  if (auto* culler = vtkFrustumCoverageCuller::SafeDownCast(renderer.GetCullers()->GetLastItem())) {
    culler->SetSortingStyleToFrontToBack();
  }
}

bool draws_in_software(vtkRenderWindow& window) {
  const std::string capabilities = window.ReportCapabilities();
  return capabilities.find("llvmpipe") != std::string::npos || capabilities.find("softpipe") != std::string::npos;
}

}  // namespace

struct BoneWindow::Impl {
  // VTK ends the process if it cannot reach the X server. An X server without clients restarts, and refuses the next
  // client for that moment. So this connection is the first to open and the last to close.
  XConnection connection;
  vtkNew<vtkRenderer> renderer;
  vtkNew<vtkRenderWindow> window;
  BoneActors bone{*renderer};
  ToolActors tools{*renderer};
  StatusText status{*renderer};
  std::optional<PeopleOverlay> people;
  std::optional<WindowInput> input;

  bool smooth = false;  // live pictures have smooth edges
  std::vector<std::string> said;
  std::string holding;

  Impl(XConnection to, const WindowOptions& options);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  void add_in_order();
};

BoneWindow::Impl::Impl(XConnection to, const WindowOptions& options) : connection(std::move(to)) {
  set_up(*window, *renderer, options);
  people.emplace(*renderer, *window, [this](const Vec3& point_mm) { return bone.normal_at(point_mm); });
  input.emplace(*window, [this](int x_px, int y_px) { return bone.surface_at(x_px, y_px); });
  // Smooth edges cost a graphics card nothing, but a processor a sixth of the frame. Saved pictures always have them.
  smooth = !draws_in_software(*window);
  renderer->SetUseFXAA(smooth);
}

BoneWindow::Impl::~Impl() {
  // The window still points to both, so they must go first.
  people.reset();
  input.reset();
  window->Finalize();
}

// Regions at the same distance are drawn in the order of their keys, not of their arrival. One surface then gives one
// picture, even where two triangles coincide.
void BoneWindow::Impl::add_in_order() {
  bone.remove();
  tools.remove();
  bone.add();
  tools.add();
}

BoneWindow::BoneWindow(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

BoneWindow::~BoneWindow() = default;

Result<std::unique_ptr<BoneWindow>> BoneWindow::open(const WindowOptions& options) {
  auto connection = XConnection::open();
  if (!connection) return tl::unexpected(connection.error());
  return std::unique_ptr<BoneWindow>(new BoneWindow(std::make_unique<Impl>(std::move(*connection), options)));
}

void BoneWindow::show_region(const RegionKey& region, const Mesh& mesh) {
  if (impl_->bone.show(region, mesh)) impl_->add_in_order();
}

void BoneWindow::show_tools(std::span<const CuttingState> states) {
  if (impl_->tools.show_tools(states)) impl_->add_in_order();
  impl_->people->show_tools(states);
}

void BoneWindow::learn_tool(const Tool& tool) { impl_->tools.learn(tool); }

void BoneWindow::show_items(std::span<const SceneItem> items) {
  impl_->tools.show_items(items);
  impl_->add_in_order();
}

void BoneWindow::show_text(const std::string& gauges, const std::string& notice) { impl_->status.show(gauges, notice); }

void BoneWindow::show_annotations(std::span<const Annotation> drawn) { impl_->people->show_annotations(drawn); }

void BoneWindow::show_names(std::map<AuthorId, std::string> names) { impl_->people->show_names(std::move(names)); }

void BoneWindow::show_words(const std::vector<std::string>& said, const std::string& holding) {
  impl_->said = said;
  impl_->holding = holding;
}

std::optional<Vec3> BoneWindow::surface_at(int x_px, int y_px) const {
  return impl_->bone.surface_at(x_px, impl_->window->GetActualSize()[1] - 1 - y_px);
}

void BoneWindow::look(const CameraView& view) {
  vtkCamera* camera = impl_->renderer->GetActiveCamera();
  camera->SetPosition(view.eye_mm.x(), view.eye_mm.y(), view.eye_mm.z());
  camera->SetFocalPoint(view.target_mm.x(), view.target_mm.y(), view.target_mm.z());
  camera->SetViewUp(view.up.x(), view.up.y(), view.up.z());
  camera->SetViewAngle(view.view_angle_rad * 180.0 / std::numbers::pi);
}

CameraView BoneWindow::camera() const {
  vtkCamera* camera = impl_->renderer->GetActiveCamera();
  CameraView view;
  camera->GetPosition(view.eye_mm.data());
  camera->GetFocalPoint(view.target_mm.data());
  camera->GetViewUp(view.up.data());
  view.view_angle_rad = camera->GetViewAngle() * std::numbers::pi / 180.0;
  return view;
}

void BoneWindow::draw() {
  impl_->people->show_words(impl_->said, impl_->holding, impl_->input->hint());
  impl_->people->show_stroke(impl_->input->stroke());
  impl_->people->place();
  impl_->renderer->ResetCameraClippingRange();
  impl_->window->Render();
  impl_->window->WaitForCompletion();
}

Result<void> BoneWindow::save_png(const std::filesystem::path& file) {
  impl_->renderer->SetUseSSAO(true);
  impl_->renderer->SetUseFXAA(true);
  draw();
  const Image picture = image();
  impl_->renderer->SetUseSSAO(false);
  impl_->renderer->SetUseFXAA(impl_->smooth);
  return write_png(picture, file);
}

Image BoneWindow::image() const { return image_of(*impl_->window); }

WindowEvents BoneWindow::events() { return impl_->input->events(); }

}  // namespace osteon
