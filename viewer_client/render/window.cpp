#include "viewer_client/render/window.hpp"

#include <X11/Xlib.h>
#include <vtkActor.h>
#include <vtkCallbackCommand.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkCellPicker.h>
#include <vtkCullerCollection.h>
#include <vtkFloatArray.h>
#include <vtkFrustumCoverageCuller.h>
#include <vtkImageData.h>
#include <vtkInteractorStyleTrackballCamera.h>
#include <vtkLight.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderWindowInteractor.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTypeInt32Array.h>
#include <vtkUnsignedCharArray.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <span>
#include <thread>
#include <utility>

#include "common/runtime/files.hpp"
#include "common/tools/tool.hpp"
#include "viewer_client/render/people_overlay.hpp"
#include "viewer_client/scene/stroke.hpp"
#include "viewer_client/scene/tool_mesh.hpp"

namespace osteon {

namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr Colour kBone{241, 226, 196};     // dry ivory
constexpr Colour kCutBone{219, 143, 117};  // fresh bone with marrow in it
constexpr Colour kMetal{126, 150, 184};    // bluer and darker than tools, to differ from them
constexpr Colour kEnamel{250, 250, 255};
constexpr Colour kCutEnamel{236, 214, 232};
// sawn-off pieces, in turn
constexpr std::array<Colour, 3> kPieces{{{214, 226, 200}, {200, 214, 236}, {236, 206, 214}}};
constexpr Colour kSteel{222, 227, 234};
constexpr Colour kCuttingSteel{205, 205, 202};

constexpr std::array<double, 3> kBackground{0.115, 0.140, 0.170};

// Beyond this distance the hand is visibly apart from the tool.
constexpr double kGhostFrom_mm = 0.15;
constexpr double kGhostOpacity = 0.28;

// Soft shadows in hollows up to this size, for saved pictures.
constexpr double kShadowRadius_mm = 6.0;
constexpr int kShadowSamples = 48;

vtkSmartPointer<vtkFloatArray> vectors(const std::vector<std::array<float, 3>>& from) {
  auto to = vtkSmartPointer<vtkFloatArray>::New();
  to->SetNumberOfComponents(3);
  to->SetNumberOfTuples(static_cast<vtkIdType>(from.size()));
  if (!from.empty()) std::memcpy(to->GetPointer(0), from.data(), from.size() * sizeof(from[0]));
  return to;
}

// `marked` gives the colour of each vertex.
vtkSmartPointer<vtkPolyData> poly_data(const std::vector<std::array<float, 3>>& positions,
                                       const std::vector<std::array<float, 3>>& normals,
                                       const std::vector<std::uint8_t>& marked,
                                       const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                       std::span<const Colour> palette) {
  vtkNew<vtkPoints> points;
  points->SetData(vectors(positions));

  vtkNew<vtkUnsignedCharArray> colours;
  colours->SetNumberOfComponents(3);
  colours->SetNumberOfTuples(static_cast<vtkIdType>(marked.size()));
  for (std::size_t i = 0; i < marked.size(); ++i) {
    std::memcpy(colours->GetPointer(static_cast<vtkIdType>(3 * i)), palette[marked[i]].data(), 3);
  }

  // 32-bit connectivity is a copy of our own array. Offsets of triangles are multiples of three.
  vtkNew<vtkTypeInt32Array> corners, offsets;
  corners->SetNumberOfValues(static_cast<vtkIdType>(3 * triangles.size()));
  if (!triangles.empty())
    std::memcpy(corners->GetPointer(0), triangles.data(), triangles.size() * sizeof(triangles[0]));
  offsets->SetNumberOfValues(static_cast<vtkIdType>(triangles.size() + 1));
  for (std::size_t i = 0; i <= triangles.size(); ++i) {
    offsets->SetValue(static_cast<vtkIdType>(i), static_cast<vtkTypeInt32>(3 * i));
  }
  vtkNew<vtkCellArray> cells;
  cells->SetData(offsets, corners);

  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(cells);
  const auto normal_array = vectors(normals);
  data->GetPointData()->SetNormals(normal_array);
  data->GetPointData()->SetScalars(colours);
  return data;
}

vtkSmartPointer<vtkActor> actor_of(vtkPolyData* data) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  return actor;
}

vtkSmartPointer<vtkActor> steel_actor(vtkPolyData* data) {
  auto actor = actor_of(data);
  vtkProperty* steel = actor->GetProperty();
  steel->SetInterpolationToPhong();
  steel->SetAmbient(0.14);
  steel->SetDiffuse(0.74);
  steel->SetSpecular(0.75);
  steel->SetSpecularPower(38.0);
  return actor;
}

// `girth` scales across the tool's axis.
void set_pose(vtkActor* actor, const Pose& pose, double girth = 1.0) {
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  vtkNew<vtkMatrix4x4> matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      matrix->SetElement(row, column, rotation(row, column) * (column < 2 ? girth : 1.0));
    matrix->SetElement(row, 3, pose.position_mm[row]);
  }
  actor->SetUserMatrix(matrix);
}

bool same_place(const Pose& a, const Pose& b) {
  return (a.position_mm - b.position_mm).norm() < kGhostFrom_mm && a.rotation.angularDistance(b.rotation) < 0.02;
}

// A light that moves with the camera. Position in units of the eye's distance: right, up, towards the eye.
void add_light(vtkRenderer* renderer, double x, double y, double z, double intensity, double r, double g, double b) {
  vtkNew<vtkLight> light;
  light->SetLightTypeToCameraLight();
  light->SetPosition(x, y, z);
  light->SetFocalPoint(0.0, 0.0, 0.0);
  light->SetColor(r, g, b);
  light->SetIntensity(intensity);
  renderer->AddLight(light);
}

// VTK's trackball, with our own keys instead of VTK's. After P or L the left button draws once instead of rotating.
class BoneStyle : public vtkInteractorStyleTrackballCamera {
 public:
  static BoneStyle* New();
  vtkTypeMacro(BoneStyle, vtkInteractorStyleTrackballCamera);
  enum class Pen { up, pointer, line };
  WindowEvents pending;
  std::function<std::optional<Vec3>(int x, int y)> surface_at;  // in VTK's display coordinates: rows from the bottom

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

struct CloseDisplay {
  void operator()(Display* display) const { XCloseDisplay(display); }
};
using OpenDisplay = std::unique_ptr<Display, CloseDisplay>;

// Connects to the X server directly, because VTK ends the process if there is none. The connection stays open as long
// as the window. An X server without clients restarts, and refuses the next client for that moment.
Result<OpenDisplay> open_display() {
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0') {
    return failure(ErrorCode::not_found,
                   "there is no screen to draw on: set DISPLAY to an X server's display, or start the program with "
                   "`xvfb-run -a`");
  }
  OpenDisplay display(XOpenDisplay(name));
  // An X server that has just lost its last client may need a moment.
  for (int attempt = 0; !display && attempt < 10; ++attempt) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    display.reset(XOpenDisplay(name));
  }
  if (!display) {
    return failure(ErrorCode::not_found, "the X display " + std::string(name) +
                                             " named by DISPLAY cannot be opened: correct DISPLAY, or start the "
                                             "program with `xvfb-run -a`");
  }
  int opcode = 0, event = 0, error = 0;
  const bool has_gl = XQueryExtension(display.get(), "GLX", &opcode, &event, &error) != 0;
  if (!has_gl) {
    return failure(ErrorCode::not_found, "the X display " + std::string(name) +
                                             " has no OpenGL (GLX): use one that has, or start the program with "
                                             "`xvfb-run -a`");
  }
  return display;
}

}  // namespace

struct BoneWindow::Impl {
  OpenDisplay display;  // closed last
  vtkNew<vtkRenderer> renderer;
  vtkNew<vtkRenderWindow> window;
  vtkSmartPointer<vtkRenderWindowInteractor> interactor;
  vtkNew<BoneStyle> style;
  vtkNew<vtkTextActor> gauges, notice;

  bool smooth = false;  // live pictures have smooth edges

  std::map<RegionKey, vtkSmartPointer<vtkActor>> regions;

  struct DrawnTool {
    std::string name;
    vtkSmartPointer<vtkActor> body, ghost;
  };
  std::map<AuthorId, DrawnTool> tools;
  std::map<std::string, vtkSmartPointer<vtkPolyData>> tool_data;  // null: there is no such tool
  std::map<Digest, std::string> tool_names;                       // all tools that can be drawn
  std::map<std::uint32_t, vtkSmartPointer<vtkActor>> items;

  std::unique_ptr<PeopleOverlay> people;
  std::vector<std::string> said;
  std::string holding;

  // Rows from the bottom.
  std::optional<Vec3> surface_at(int x, int y) const;
  std::optional<Vec3> normal_at(const Vec3& point_mm) const;
  vtkPolyData* data_of(const std::string& name);
  static vtkSmartPointer<vtkPolyData> data_of(const Tool& tool);
  void add_in_order();
};

vtkPolyData* BoneWindow::Impl::data_of(const std::string& name) {
  const auto [place, fresh] = tool_data.try_emplace(name);
  if (fresh) {
    if (const Result<Tool> tool = find_tool(name)) place->second = data_of(*tool);
  }
  return place->second;
}

vtkSmartPointer<vtkPolyData> BoneWindow::Impl::data_of(const Tool& tool) {
  const ToolMesh mesh = tool_mesh(tool);
  return poly_data(mesh.positions_mm, mesh.normals, mesh.cutting, mesh.triangles, std::array{kSteel, kCuttingSteel});
}

std::optional<Vec3> BoneWindow::Impl::surface_at(int x, int y) const {
  // Picks only the bone, neither tools nor annotations.
  vtkNew<vtkCellPicker> picker;
  picker->SetTolerance(0.0);
  picker->PickFromListOn();
  for (const auto& [key, actor] : regions) picker->AddPickList(actor);
  if (regions.empty() || picker->Pick(x, y, 0.0, renderer) == 0) return std::nullopt;
  return Vec3(picker->GetPickPosition());
}

// The mean normal of the vertices near a point.
std::optional<Vec3> BoneWindow::Impl::normal_at(const Vec3& point_mm) const {
  constexpr double kNear_mm = 2.5;
  Vec3 sum = Vec3::Zero();
  for (const auto& [key, actor] : regions) {
    const double* box = actor->GetBounds();
    bool near = true;
    for (int axis = 0; axis < 3; ++axis)
      near = near && point_mm[axis] > box[2 * axis] - kNear_mm && point_mm[axis] < box[2 * axis + 1] + kNear_mm;
    if (!near) continue;
    vtkPolyData* data = static_cast<vtkPolyDataMapper*>(actor->GetMapper())->GetInput();
    for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i) {
      if ((Vec3(data->GetPoint(i)) - point_mm).norm() > kNear_mm) continue;
      sum += Vec3(data->GetPointData()->GetNormals()->GetTuple(i));
    }
  }
  if (sum.norm() < 1e-6) return std::nullopt;
  return sum.normalized();
}

// Regions at the same distance are drawn in the order of their keys, not of their arrival. One surface then gives one
// picture, even where two triangles coincide.
void BoneWindow::Impl::add_in_order() {
  for (const auto& [key, actor] : regions) renderer->RemoveActor(actor);
  for (const auto& [author, tool] : tools) {
    renderer->RemoveActor(tool.body);
    renderer->RemoveActor(tool.ghost);
  }
  for (const auto& [id, actor] : items) renderer->RemoveActor(actor);
  for (const auto& [key, actor] : regions) renderer->AddActor(actor);
  for (const auto& [id, actor] : items) renderer->AddActor(actor);
  for (const auto& [author, tool] : tools) {
    renderer->AddActor(tool.body);
    renderer->AddActor(tool.ghost);
  }
}

BoneWindow::BoneWindow(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

BoneWindow::~BoneWindow() {
  impl_->people.reset();
  // The window still points to the style and the renderer, so it must go first.
  impl_->interactor->SetInteractorStyle(nullptr);
  impl_->window->Finalize();
}

Result<std::unique_ptr<BoneWindow>> BoneWindow::open(const WindowOptions& options) {
  auto display = open_display();
  if (!display) return tl::unexpected(display.error());
  auto impl = std::make_unique<Impl>();
  impl->display = std::move(*display);
  vtkRenderer* renderer = impl->renderer;
  vtkRenderWindow* window = impl->window;

  // Default multisampling is several times slower in software.
  window->SetMultiSamples(0);
  window->SetSize(options.width_px, options.height_px);
  window->SetWindowName(options.title.c_str());
  window->AddRenderer(renderer);

  renderer->SetBackground(kBackground[0], kBackground[1], kBackground[2]);
  renderer->SetAutomaticLightCreation(0);
  add_light(renderer, -0.55, 0.75, 1.0, 0.78, 1.00, 0.97, 0.93);  // key, from the upper left
  add_light(renderer, 0.90, -0.10, 0.7, 0.34, 0.90, 0.94, 1.00);  // fill, from the right
  add_light(renderer, 0.0, 0.0, 1.0, 0.20, 1.0, 1.0, 1.0);        // headlight, so that no hole is black
  renderer->SetSSAORadius(kShadowRadius_mm);
  renderer->SetSSAOBias(0.02 * kShadowRadius_mm);
  renderer->SetSSAOKernelSize(kShadowSamples);
  renderer->SetSSAOBlur(true);

  const auto text = [&](vtkTextActor* actor, int size, double r, double g, double b) {
    actor->GetTextProperty()->SetFontFamilyToArial();
    actor->GetTextProperty()->SetFontSize(size);
    actor->GetTextProperty()->SetColor(r, g, b);
    // Readable over bright bone too.
    actor->GetTextProperty()->SetBackgroundColor(kBackground[0], kBackground[1], kBackground[2]);
    actor->GetTextProperty()->SetBackgroundOpacity(0.55);
    renderer->AddActor2D(actor);
  };
  text(impl->gauges, 18, 0.93, 0.94, 0.95);
  impl->gauges->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  impl->gauges->SetPosition(0.016, 0.972);
  impl->gauges->GetTextProperty()->SetVerticalJustificationToTop();
  impl->gauges->GetTextProperty()->SetLineSpacing(1.25);
  text(impl->notice, 15, 0.78, 0.82, 0.86);
  impl->notice->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  impl->notice->SetPosition(0.016, 0.024);

  const auto normal_at = [at = impl.get()](const Vec3& point_mm) { return at->normal_at(point_mm); };
  impl->people = std::make_unique<PeopleOverlay>(*renderer, *window, normal_at);
  impl->style->surface_at = [at = impl.get()](int x, int y) { return at->surface_at(x, y); };

  for (const Tool& tool : builtin_tools()) impl->tool_names.emplace(tool.hash(), tool.name);

  impl->interactor = vtkSmartPointer<vtkRenderWindowInteractor>::New();
  impl->interactor->SetRenderWindow(window);
  impl->interactor->SetInteractorStyle(impl->style);
  // The interactor must not draw: the program draws at its own rate.
  impl->interactor->EnableRenderOff();
  vtkNew<vtkCallbackCommand> redraw, closed;
  redraw->SetClientData(impl->style);
  redraw->SetCallback(
      [](vtkObject*, unsigned long, void* style, void*) { static_cast<BoneStyle*>(style)->pending.redraw = true; });
  closed->SetClientData(impl->style);
  closed->SetCallback(
      [](vtkObject*, unsigned long, void* style, void*) { static_cast<BoneStyle*>(style)->pending.closed = true; });
  impl->interactor->AddObserver(vtkCommand::RenderEvent, redraw);
  impl->interactor->AddObserver(vtkCommand::ExposeEvent, redraw);
  impl->interactor->AddObserver(vtkCommand::ConfigureEvent, redraw);
  impl->interactor->AddObserver(vtkCommand::ExitEvent, closed);
  impl->interactor->Initialize();

  // Draws near regions first, so that hidden regions need no lighting. This saves a quarter of a close frame in
  // software.
  if (auto* culler = vtkFrustumCoverageCuller::SafeDownCast(renderer->GetCullers()->GetLastItem())) {
    culler->SetSortingStyleToFrontToBack();
  }
  // Smooth edges cost a graphics card nothing, but a processor a sixth of the frame. Saved pictures always have them.
  const std::string capabilities = window->ReportCapabilities();
  impl->smooth =
      capabilities.find("llvmpipe") == std::string::npos && capabilities.find("softpipe") == std::string::npos;
  renderer->SetUseFXAA(impl->smooth);
  return std::unique_ptr<BoneWindow>(new BoneWindow(std::move(impl)));
}

void BoneWindow::show_region(const RegionKey& region, const Mesh& mesh) {
  const auto held = impl_->regions.find(region);
  if (mesh.triangles.empty()) {
    if (held != impl_->regions.end()) {
      impl_->renderer->RemoveActor(held->second);
      impl_->regions.erase(held);
    }
    return;
  }

  const Colour& whole = region.body == BodyId{0} ? kBone : kPieces[region.body.value % kPieces.size()];
  const std::array palette{whole, kCutBone, kMetal, kMetal, kEnamel, kCutEnamel};
  std::vector<std::uint8_t> looks = mesh.cut_face;
  for (std::size_t v = 0; v < mesh.tissue.size(); ++v)
    if (mesh.tissue[v] != Tissue::none) looks[v] |= mesh.tissue[v] == Tissue::metal ? 2 : 4;
  const auto data = poly_data(mesh.positions_mm, mesh.normals, looks, mesh.triangles, palette);
  if (held != impl_->regions.end()) {
    static_cast<vtkPolyDataMapper*>(held->second->GetMapper())->SetInputData(data);
    return;
  }
  auto actor = actor_of(data);
  vtkProperty* bone = actor->GetProperty();
  bone->SetInterpolationToPhong();
  bone->SetAmbient(0.10);
  bone->SetDiffuse(0.88);
  bone->SetSpecular(0.13);
  bone->SetSpecularPower(22.0);
  // A closed surface hides its back faces. Not drawing them saves a third of a frame in software.
  bone->SetBackfaceCulling(1);
  impl_->regions.emplace(region, actor);
  impl_->add_in_order();
}

void BoneWindow::show_tools(std::span<const CuttingState> states) {
  std::map<AuthorId, Impl::DrawnTool> shown;
  bool changed = false;
  for (const CuttingState& state : states) {
    vtkPolyData* data = impl_->data_of(state.tool_name);
    if (data == nullptr) continue;

    auto held = impl_->tools.extract(state.author);
    Impl::DrawnTool tool;
    if (!held.empty() && held.mapped().name == state.tool_name) {
      tool = held.mapped();
    } else {
      if (!held.empty()) impl_->tools.insert(std::move(held));
      changed = true;
      tool.name = state.tool_name;
      tool.body = steel_actor(data);
      tool.ghost = actor_of(data);
      tool.ghost->GetMapper()->ScalarVisibilityOff();
      tool.ghost->GetProperty()->SetColor(0.55, 0.78, 0.95);
      tool.ghost->GetProperty()->SetOpacity(kGhostOpacity);
      tool.ghost->GetProperty()->SetBackfaceCulling(1);
    }
    set_pose(tool.body, state.pose_bone_tool);
    // The hand pushes mostly along the axis. A thinner ghost hides inside the tool instead of sharing its surface.
    set_pose(tool.ghost, state.pose_bone_device, 0.95);
    tool.ghost->SetVisibility(same_place(state.pose_bone_tool, state.pose_bone_device) ? 0 : 1);
    shown.emplace(state.author, std::move(tool));
  }
  // The rest belongs to tools that left or changed.
  for (const auto& [author, tool] : impl_->tools) {
    impl_->renderer->RemoveActor(tool.body);
    impl_->renderer->RemoveActor(tool.ghost);
  }
  impl_->tools = std::move(shown);
  if (changed) impl_->add_in_order();
  impl_->people->show_tools(states);
}

void BoneWindow::learn_tool(const Tool& tool) {
  impl_->tool_data[tool.name] = Impl::data_of(tool);
  impl_->tool_names[tool.hash()] = tool.name;
}

void BoneWindow::show_items(std::span<const SceneItem> items) {
  for (const auto& [id, actor] : impl_->items) impl_->renderer->RemoveActor(actor);
  impl_->items.clear();
  for (const SceneItem& item : items) {
    const auto name = impl_->tool_names.find(item.tool);
    vtkPolyData* data = name == impl_->tool_names.end() ? nullptr : impl_->data_of(name->second);
    if (data == nullptr) continue;
    const auto actor = steel_actor(data);
    set_pose(actor, item.pose_bone_item);
    impl_->items.emplace(item.id, actor);
  }
  impl_->add_in_order();
}

void BoneWindow::show_text(const std::string& gauges, const std::string& notice) {
  impl_->gauges->SetInput(gauges.c_str());
  impl_->notice->SetInput(notice.c_str());
  impl_->gauges->SetVisibility(gauges.empty() ? 0 : 1);
  impl_->notice->SetVisibility(notice.empty() ? 0 : 1);
}

void BoneWindow::show_annotations(std::span<const Annotation> drawn) { impl_->people->show_annotations(drawn); }

void BoneWindow::show_names(std::map<AuthorId, std::string> names) { impl_->people->show_names(std::move(names)); }

void BoneWindow::show_words(const std::vector<std::string>& said, const std::string& holding) {
  impl_->said = said;
  impl_->holding = holding;
}

std::optional<Vec3> BoneWindow::surface_at(int x_px, int y_px) const {
  return impl_->surface_at(x_px, impl_->window->GetActualSize()[1] - 1 - y_px);
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
  using Pen = BoneStyle::Pen;
  const Pen pen = impl_->style->pen();
  impl_->people->show_words(impl_->said, impl_->holding,
                            pen == Pen::up        ? ""
                            : pen == Pen::pointer ? "click on the bone to point there, Esc to leave it"
                                                  : "draw on the bone with the left button, Esc to leave it");
  impl_->people->show_stroke(impl_->style->stroke());
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

  // VTK's rows run from the bottom.
  vtkNew<vtkImageData> pixels;
  pixels->SetDimensions(picture.width_px, picture.height_px, 1);
  pixels->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < picture.height_px; ++y) {
    std::memcpy(pixels->GetScalarPointer(0, picture.height_px - 1 - y, 0), picture.at(0, y).data(),
                3 * static_cast<std::size_t>(picture.width_px));
  }
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(pixels);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* png = writer->GetResult();
  if (png == nullptr || png->GetNumberOfValues() == 0) {
    return failure(ErrorCode::internal, "the picture for " + file.string() + " could not be made into a PNG");
  }
  return write_file(file, std::string_view(reinterpret_cast<const char*>(png->GetPointer(0)),
                                           static_cast<std::size_t>(png->GetNumberOfValues())));
}

Image BoneWindow::image() const {
  const int* size = impl_->window->GetActualSize();
  Image image;
  image.width_px = size[0];
  image.height_px = size[1];
  image.rgb.resize(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]));
  vtkNew<vtkUnsignedCharArray> rows;
  impl_->window->GetPixelData(0, 0, size[0] - 1, size[1] - 1, 0, rows);
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(image.width_px);
  for (int y = 0; y < image.height_px; ++y) {
    std::memcpy(image.rgb[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px)].data(),
                rows->GetPointer(0) + static_cast<std::size_t>(image.height_px - 1 - y) * row_bytes, row_bytes);
  }
  return image;
}

WindowEvents BoneWindow::events() {
  impl_->interactor->ProcessEvents();
  if (impl_->interactor->GetDone()) impl_->style->pending.closed = true;
  return std::exchange(impl_->style->pending, WindowEvents{});
}

}  // namespace osteon
