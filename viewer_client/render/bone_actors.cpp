#include "viewer_client/render/bone_actors.hpp"

#include <vtkActor.h>
#include <vtkCellPicker.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPlaneCollection.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "viewer_client/render/actors.hpp"

namespace osteon {

namespace {

constexpr Colour kBone{241, 226, 196};     // dry ivory
constexpr Colour kCutBone{219, 143, 117};  // fresh bone with marrow in it
constexpr Colour kMetal{126, 150, 184};    // bluer and darker than tools, to differ from them
constexpr Colour kEnamel{250, 250, 255};
constexpr Colour kCutEnamel{236, 214, 232};
// sawn-off pieces, in turn
constexpr std::array<Colour, 3> kPieces{{{214, 226, 200}, {200, 214, 236}, {236, 206, 214}}};

vtkSmartPointer<vtkPolyData> coloured(const Mesh& mesh, BodyId body) {
  const Colour& whole = body == BodyId{0} ? kBone : kPieces[body.value % kPieces.size()];
  const std::array palette{whole, kCutBone, kMetal, kMetal, kEnamel, kCutEnamel};
  std::vector<std::uint8_t> looks = mesh.cut_face;
  for (std::size_t v = 0; v < mesh.tissue.size(); ++v)
    if (mesh.tissue[v] != Tissue::none) looks[v] |= mesh.tissue[v] == Tissue::metal ? 2 : 4;
  return poly_data(mesh.positions_mm, mesh.normals, looks, mesh.triangles, palette);
}

vtkSmartPointer<vtkActor> bone_actor(vtkPolyData* data) {
  auto actor = actor_of(data);
  vtkProperty* bone = actor->GetProperty();
  bone->SetInterpolationToPhong();
  bone->SetAmbient(0.10);
  bone->SetDiffuse(0.88);
  bone->SetSpecular(0.13);
  bone->SetSpecularPower(22.0);
  // A closed surface hides its back faces. Not drawing them saves a third of a frame in software.
  bone->SetBackfaceCulling(1);
  return actor;
}

}  // namespace

struct BoneActors::Impl {
  vtkRenderer& renderer;
  std::map<RegionKey, vtkSmartPointer<vtkActor>> regions;
  vtkNew<vtkPlaneCollection> planes;

  void clip(vtkActor& actor) const {
    const bool open = planes->GetNumberOfItems() > 0;
    actor.GetMapper()->SetClippingPlanes(open ? planes.GetPointer() : nullptr);
    // The surface is not closed then.
    actor.GetProperty()->SetBackfaceCulling(open ? 0 : 1);
  }
};

BoneActors::BoneActors(vtkRenderer& renderer) : impl_(new Impl{renderer, {}, {}}) {}

BoneActors::~BoneActors() = default;

bool BoneActors::show(const RegionKey& region, const Mesh& mesh) {
  const auto held = impl_->regions.find(region);
  if (mesh.triangles.empty()) {
    if (held != impl_->regions.end()) {
      impl_->renderer.RemoveActor(held->second);
      impl_->regions.erase(held);
    }
    return false;
  }
  const auto data = coloured(mesh, region.body);
  if (held != impl_->regions.end()) {
    static_cast<vtkPolyDataMapper*>(held->second->GetMapper())->SetInputData(data);
    return false;
  }
  const auto actor = bone_actor(data);
  impl_->clip(*actor);
  impl_->regions.emplace(region, actor);
  return true;
}

void BoneActors::clip(const Clipping& visible) {
  impl_->planes->RemoveAllItems();
  for (const ClipPlane& side : visible) {
    vtkNew<vtkPlane> plane;
    plane->SetOrigin(side.point_mm.x(), side.point_mm.y(), side.point_mm.z());
    plane->SetNormal(side.inward.x(), side.inward.y(), side.inward.z());
    impl_->planes->AddItem(plane);
  }
  for (const auto& [key, actor] : impl_->regions) impl_->clip(*actor);
}

void BoneActors::add() {
  for (const auto& [key, actor] : impl_->regions) impl_->renderer.AddActor(actor);
}

void BoneActors::remove() {
  for (const auto& [key, actor] : impl_->regions) impl_->renderer.RemoveActor(actor);
}

std::optional<Vec3> BoneActors::surface_at(int x_px, int y_px) const {
  // Picks only the bone, neither tools nor annotations.
  vtkNew<vtkCellPicker> picker;
  picker->SetTolerance(0.0);
  picker->PickFromListOn();
  for (const auto& [key, actor] : impl_->regions) picker->AddPickList(actor);
  if (impl_->regions.empty() || picker->Pick(x_px, y_px, 0.0, &impl_->renderer) == 0) return std::nullopt;
  return Vec3(picker->GetPickPosition());
}

std::optional<Vec3> BoneActors::normal_at(const Vec3& point_mm) const {
  constexpr double kNear_mm = 2.5;
  Vec3 sum = Vec3::Zero();
  for (const auto& [key, actor] : impl_->regions) {
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

}  // namespace osteon
