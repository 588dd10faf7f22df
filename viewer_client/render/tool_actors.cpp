#include "viewer_client/render/tool_actors.hpp"

#include <vtkActor.h>
#include <vtkMapper.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "viewer_client/render/actors.hpp"
#include "viewer_client/scene/tool_mesh.hpp"

namespace osteon {

namespace {

constexpr Colour kSteel{222, 227, 234};
constexpr Colour kCuttingSteel{205, 205, 202};

// Beyond this distance the hand is visibly apart from the tool.
constexpr double kGhostFrom_mm = 0.15;
constexpr double kGhostOpacity = 0.28;

vtkSmartPointer<vtkPolyData> data_of(const Tool& tool) {
  const ToolMesh mesh = tool_mesh(tool);
  return poly_data(mesh.positions_mm, mesh.normals, mesh.cutting, mesh.triangles, std::array{kSteel, kCuttingSteel});
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

vtkSmartPointer<vtkActor> ghost_actor(vtkPolyData* data) {
  auto actor = actor_of(data);
  actor->GetMapper()->ScalarVisibilityOff();
  actor->GetProperty()->SetColor(0.55, 0.78, 0.95);
  actor->GetProperty()->SetOpacity(kGhostOpacity);
  actor->GetProperty()->SetBackfaceCulling(1);
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

}  // namespace

struct ToolActors::Impl {
  struct DrawnTool {
    std::string name;
    vtkSmartPointer<vtkActor> body, ghost;
  };

  vtkRenderer& renderer;
  std::map<AuthorId, DrawnTool> tools;
  std::map<std::uint32_t, vtkSmartPointer<vtkActor>> items;
  std::map<std::string, vtkSmartPointer<vtkPolyData>> shapes;  // null: there is no such tool
  std::map<Digest, std::string> names;                         // all tools that can be drawn

  // Null: there is no such tool.
  vtkPolyData* shape_of(const std::string& name);
  void remove_tools();
  void remove_items();
};

vtkPolyData* ToolActors::Impl::shape_of(const std::string& name) {
  const auto [place, fresh] = shapes.try_emplace(name);
  if (fresh) {
    if (const Result<Tool> tool = find_tool(name)) place->second = data_of(*tool);
  }
  return place->second;
}

void ToolActors::Impl::remove_tools() {
  for (const auto& [author, tool] : tools) {
    renderer.RemoveActor(tool.body);
    renderer.RemoveActor(tool.ghost);
  }
}

void ToolActors::Impl::remove_items() {
  for (const auto& [id, actor] : items) renderer.RemoveActor(actor);
}

ToolActors::ToolActors(vtkRenderer& renderer) : impl_(new Impl{renderer, {}, {}, {}, {}}) {
  for (const Tool& tool : builtin_tools()) impl_->names.emplace(tool.hash(), tool.name);
}

ToolActors::~ToolActors() = default;

void ToolActors::learn(const Tool& tool) {
  impl_->shapes[tool.name] = data_of(tool);
  impl_->names[tool.hash()] = tool.name;
}

bool ToolActors::show_tools(std::span<const CuttingState> states) {
  std::map<AuthorId, Impl::DrawnTool> shown;
  bool changed = false;
  for (const CuttingState& state : states) {
    vtkPolyData* data = impl_->shape_of(state.tool_name);
    if (data == nullptr) continue;

    auto held = impl_->tools.extract(state.author);
    Impl::DrawnTool tool;
    if (!held.empty() && held.mapped().name == state.tool_name) {
      tool = held.mapped();
    } else {
      if (!held.empty()) impl_->tools.insert(std::move(held));
      changed = true;
      tool = {state.tool_name, steel_actor(data), ghost_actor(data)};
    }
    set_pose(tool.body, state.pose_bone_tool);
    // The hand pushes mostly along the axis. A thinner ghost hides inside the tool instead of sharing its surface.
    set_pose(tool.ghost, state.pose_bone_device, 0.95);
    tool.ghost->SetVisibility(same_place(state.pose_bone_tool, state.pose_bone_device) ? 0 : 1);
    shown.emplace(state.author, std::move(tool));
  }
  impl_->remove_tools();  // the rest: tools that left or changed
  impl_->tools = std::move(shown);
  return changed;
}

void ToolActors::show_items(std::span<const SceneItem> items) {
  impl_->remove_items();
  impl_->items.clear();
  for (const SceneItem& item : items) {
    const auto name = impl_->names.find(item.tool);
    vtkPolyData* data = name == impl_->names.end() ? nullptr : impl_->shape_of(name->second);
    if (data == nullptr) continue;
    const auto actor = steel_actor(data);
    set_pose(actor, item.pose_bone_item);
    impl_->items.emplace(item.id, actor);
  }
}

void ToolActors::add() {
  for (const auto& [id, actor] : impl_->items) impl_->renderer.AddActor(actor);
  for (const auto& [author, tool] : impl_->tools) {
    impl_->renderer.AddActor(tool.body);
    impl_->renderer.AddActor(tool.ghost);
  }
}

void ToolActors::remove() {
  impl_->remove_tools();
  impl_->remove_items();
}

}  // namespace osteon
