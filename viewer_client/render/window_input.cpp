#include "viewer_client/render/window_input.hpp"

#include <vtkCallbackCommand.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkSmartPointer.h>

#include <utility>

#include "common/tools/annotation.hpp"
#include "viewer_client/scene/stroke.hpp"

namespace osteon {

namespace {

// VTK's trackball, with our own keys instead of VTK's.
class BoneStyle : public vtkInteractorStyleTrackballCamera {
 public:
  static BoneStyle* New();
  vtkTypeMacro(BoneStyle, vtkInteractorStyleTrackballCamera);
  enum class Pen { up, pointer, line };
  WindowEvents pending;
  WindowInput::SurfaceAt surface_at;

  [[nodiscard]] Pen pen() const { return pen_; }
  [[nodiscard]] std::vector<Vec3> stroke() const {
    return stroke_ ? stroke_->line(kMostAnnotationPoints) : std::vector<Vec3>{};
  }

  void OnChar() override {
    switch (Interactor->GetKeyCode()) {
      case 'o':
      case 'O':
        pending.wants_overview = true;
        break;
      case 't':
      case 'T':
        pending.wants_tool = true;
        break;
      case 'p':
      case 'P':
        take(pen_ == Pen::pointer ? Pen::up : Pen::pointer);
        break;
      case 'l':
      case 'L':
        take(pen_ == Pen::line ? Pen::up : Pen::line);
        break;
      case 'x':
      case 'X':
        pending.wants_wipe = true;
        break;
      case kEscape:
        take(Pen::up);
        break;
      case 'q':
      case 'Q':
        pending.closed = true;
        break;
      default:
        break;
    }
  }

  void OnLeftButtonDown() override {
    if (pen_ == Pen::up) return vtkInteractorStyleTrackballCamera::OnLeftButtonDown();
    const std::optional<Vec3> at = under_mouse();
    if (!at) return;  // not on the bone: the pen stays active
    if (pen_ == Pen::pointer) {
      pending.pointed = at;
      take(Pen::up);
    } else {
      stroke_.emplace().add(*at);
    }
  }
  void OnMouseMove() override {
    if (!stroke_) return vtkInteractorStyleTrackballCamera::OnMouseMove();
    if (const std::optional<Vec3> at = under_mouse()) stroke_->add(*at);
    pending.redraw = true;
  }
  void OnLeftButtonUp() override {
    if (!stroke_) return vtkInteractorStyleTrackballCamera::OnLeftButtonUp();
    pending.drawn = stroke();
    take(Pen::up);
  }

 private:
  static constexpr char kEscape = 27;

  std::optional<Vec3> under_mouse() const {
    const int* at = Interactor->GetEventPosition();
    return surface_at ? surface_at(at[0], at[1]) : std::nullopt;
  }
  void take(Pen pen) {
    pen_ = pen;
    stroke_.reset();
    pending.redraw = true;
  }

  Pen pen_ = Pen::up;
  std::optional<Stroke> stroke_;  // while the button is down
};
vtkStandardNewMacro(BoneStyle);

}  // namespace

struct WindowInput::Impl {
  vtkNew<BoneStyle> style;
  vtkNew<vtkRenderWindowInteractor> interactor;
};

WindowInput::WindowInput(vtkRenderWindow& window, SurfaceAt surface_at) : impl_(std::make_unique<Impl>()) {
  BoneStyle* style = impl_->style;
  style->surface_at = std::move(surface_at);
  vtkRenderWindowInteractor* interactor = impl_->interactor;
  interactor->SetRenderWindow(&window);
  interactor->SetInteractorStyle(style);
  // The interactor must not draw: the program draws at its own rate.
  interactor->EnableRenderOff();
  vtkNew<vtkCallbackCommand> redraw, closed;
  redraw->SetClientData(style);
  redraw->SetCallback(
      [](vtkObject*, unsigned long, void* to, void*) { static_cast<BoneStyle*>(to)->pending.redraw = true; });
  closed->SetClientData(style);
  closed->SetCallback(
      [](vtkObject*, unsigned long, void* to, void*) { static_cast<BoneStyle*>(to)->pending.closed = true; });
  interactor->AddObserver(vtkCommand::RenderEvent, redraw);
  interactor->AddObserver(vtkCommand::ExposeEvent, redraw);
  interactor->AddObserver(vtkCommand::ConfigureEvent, redraw);
  interactor->AddObserver(vtkCommand::ExitEvent, closed);
  interactor->Initialize();
}

WindowInput::~WindowInput() {
  // The window keeps the interactor, which must not call the style any more.
  impl_->interactor->RemoveAllObservers();
  impl_->interactor->SetInteractorStyle(nullptr);
}

WindowEvents WindowInput::events() {
  impl_->interactor->ProcessEvents();
  if (impl_->interactor->GetDone()) impl_->style->pending.closed = true;
  return std::exchange(impl_->style->pending, WindowEvents{});
}

std::string WindowInput::hint() const {
  switch (impl_->style->pen()) {
    case BoneStyle::Pen::pointer:
      return "click on the bone to point there, Esc to leave it";
    case BoneStyle::Pen::line:
      return "draw on the bone with the left button, Esc to leave it";
    case BoneStyle::Pen::up:
      break;
  }
  return "";
}

std::vector<Vec3> WindowInput::stroke() const { return impl_->style->stroke(); }

}  // namespace osteon
