#include "viewer_client/render/window.hpp"

#include <vtkNew.h>
#include <vtkRenderWindow.h>

#include <optional>
#include <utility>

#include "viewer_client/render/x_connection.hpp"

namespace osteon {

struct BoneWindow::Impl {
  // VTK ends the process if it cannot reach the X server. An X server without clients restarts, and refuses the next
  // client for that moment. So this connection is the first to open and the last to close.
  XConnection connection;
  vtkNew<vtkRenderWindow> window;
  std::optional<BoneScene> scene;
  std::optional<WindowInput> input;

  Impl(XConnection to, const WindowOptions& options);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();
};

BoneWindow::Impl::Impl(XConnection to, const WindowOptions& options) : connection(std::move(to)) {
  window->SetSize(options.width_px, options.height_px);
  window->SetWindowName(options.title.c_str());
  scene.emplace(*window);
  input.emplace(*window,
                [this](int x_px, int y_px) { return scene->surface_at(x_px, window->GetActualSize()[1] - 1 - y_px); });
  // Smooth edges cost a graphics card nothing, but a processor a sixth of the frame.
  scene->set_smooth(!draws_in_software(*window));
}

BoneWindow::Impl::~Impl() {
  // The window still points to both, so they must go first.
  scene.reset();
  input.reset();
  window->Finalize();
}

BoneWindow::BoneWindow(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

BoneWindow::~BoneWindow() = default;

Result<std::unique_ptr<BoneWindow>> BoneWindow::open(const WindowOptions& options) {
  auto connection = XConnection::open();
  if (!connection) return tl::unexpected(connection.error());
  return std::unique_ptr<BoneWindow>(new BoneWindow(std::make_unique<Impl>(std::move(*connection), options)));
}

BoneScene& BoneWindow::scene() { return *impl_->scene; }

void BoneWindow::draw() {
  impl_->scene->show_pen(impl_->input->hint(), impl_->input->stroke());
  impl_->scene->draw();
}

WindowEvents BoneWindow::events() { return impl_->input->events(); }

}  // namespace osteon
