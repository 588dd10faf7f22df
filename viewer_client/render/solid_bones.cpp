#include "viewer_client/render/solid_bones.hpp"

#include <vtkActor.h>
#include <vtkCellPicker.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <map>
#include <vector>

#include "viewer_client/render/actors.hpp"

namespace osteon {

namespace {
constexpr int kMostPeels = 4;  // each takes the nearest and the farthest layer; what is left between is mixed
}  // namespace

struct SolidBones::Impl {
  struct Paint {
    Colour colour{255, 255, 255};
    double opacity = 1.0;
  };
  vtkRenderer& renderer;
  std::map<int, vtkSmartPointer<vtkActor>> surfaces;
  std::map<int, Paint> paints;

  void apply(int bone) {
    const auto found = surfaces.find(bone);
    if (found == surfaces.end()) return;
    const auto& [colour, opacity] = paints[bone];
    vtkProperty* property = found->second->GetProperty();
    property->SetColor(colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
    property->SetOpacity(opacity);
    found->second->SetVisibility(opacity > 0.0 ? 1 : 0);
    follow_translucent();
  }

  // Where translucent bones lie behind each other, VTK's usual pass mixes them as if they were at one place. Peeling
  // takes them by their distance, and draws them several times. One alone hides its back, so it needs no order.
  void follow_translucent() {
    const auto count = std::ranges::count_if(surfaces, [](const auto& of) {
      return of.second->GetVisibility() != 0 && of.second->GetProperty()->GetOpacity() < 1.0;
    });
    renderer.SetUseDepthPeeling(count > 1 ? 1 : 0);
  }
};

SolidBones::SolidBones(vtkRenderer& renderer) : impl_(new Impl{renderer, {}, {}}) {
  renderer.SetMaximumNumberOfPeels(kMostPeels);
  renderer.SetOcclusionRatio(0.0);
}

SolidBones::~SolidBones() = default;

void SolidBones::clear() {
  for (const auto& [bone, actor] : impl_->surfaces) impl_->renderer.RemoveActor(actor);
  impl_->surfaces.clear();
  impl_->follow_translucent();
}

void SolidBones::show(int bone, const Mesh& mesh) {
  const std::vector<Colour> unused(mesh.positions_mm.size());
  const auto actor = bone_actor(poly_data(mesh.positions_mm, mesh.normals, unused, mesh.triangles));
  actor->GetMapper()->ScalarVisibilityOff();
  auto& held = impl_->surfaces[bone];
  if (held) impl_->renderer.RemoveActor(held);
  held = actor;
  impl_->renderer.AddActor(actor);
  impl_->apply(bone);
}

void SolidBones::set_paint(int bone, const std::array<std::uint8_t, 3>& colour, double opacity) {
  impl_->paints[bone] = {colour, opacity};
  impl_->apply(bone);
}

std::optional<SolidHit> SolidBones::at(int x_px, int y_px) const {
  vtkNew<vtkCellPicker> picker;
  picker->SetTolerance(0.0);
  picker->PickFromListOn();
  bool any = false;
  for (const auto& [bone, actor] : impl_->surfaces) {
    if (actor->GetVisibility() == 0) continue;
    picker->AddPickList(actor);
    any = true;
  }
  if (!any || picker->Pick(x_px, y_px, 0.0, &impl_->renderer) == 0) return std::nullopt;
  for (const auto& [bone, actor] : impl_->surfaces)
    if (actor == picker->GetActor()) return SolidHit{bone, Vec3(picker->GetPickPosition())};
  return std::nullopt;
}

}  // namespace osteon
