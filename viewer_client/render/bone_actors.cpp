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

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "viewer_client/render/actors.hpp"

namespace osteon {

namespace {

using Vec3f = Eigen::Vector3f;

constexpr Colour kBone{241, 226, 196};     // dry ivory
constexpr Colour kCutBone{219, 143, 117};  // fresh bone with marrow in it
constexpr Colour kMetal{126, 150, 184};    // bluer and darker than tools, to differ from them
constexpr Colour kEnamel{250, 250, 255};
constexpr Colour kCutEnamel{236, 214, 232};
// sawn-off pieces, in turn
constexpr std::array<Colour, 3> kPieces{{{214, 226, 200}, {200, 214, 236}, {236, 206, 214}}};

// Cut faces by density. Between the densities of cancellous bone and of cortex the colours are mixed.
const Vec3f kCutCortex{240.0f, 214.0f, 184.0f};  // pale
const Vec3f kStruts{233.0f, 198.0f, 162.0f};     // trabeculae
const Vec3f kPores{156.0f, 96.0f, 74.0f};        // marrow between them: brownish, because no blood is simulated
constexpr float kCancellous_g_cm3 = 0.7f, kCortex_g_cm3 = 1.4f;
constexpr float kPore_mm = 1.3f;      // distance of pores [A]
constexpr float kSolid_g_cm3 = 1.9f;  // without pores
constexpr float kPoreEdge = 0.04f;    // of the texture's values, over which the edge of a pore is soft

float smooth(float from, float to, float value) {
  const float t = std::clamp((value - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

// A number from 0 to 1 that depends only on the lattice point.
float hashed(int x, int y, int z) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ static_cast<std::uint32_t>(y) * 0xd8163841u ^
                    static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h = (h ^ h >> 13) * 0x5bd1e995u;
  return static_cast<float>((h ^ h >> 15) & 0xffffu) / 65535.0f;
}

// Smooth values from 0 to 1 about lattice points in the bone's frame, so that the texture stays where it is.
float texture_at(const std::array<float, 3>& at_mm) {
  std::array<int, 3> first{};
  std::array<float, 3> t{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float at = at_mm[axis] / kPore_mm;
    first[axis] = static_cast<int>(std::floor(at));
    t[axis] = smooth(0.0f, 1.0f, at - static_cast<float>(first[axis]));
  }
  float sum = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    float weight = 1.0f;
    for (std::size_t axis = 0; axis < 3; ++axis) weight *= (corner >> axis & 1) != 0 ? t[axis] : 1.0f - t[axis];
    sum += weight * hashed(first[0] + (corner & 1), first[1] + (corner >> 1 & 1), first[2] + (corner >> 2 & 1));
  }
  return sum;
}

Colour cut_colour(const std::array<float, 3>& at_mm, const DensityGrid& density) {
  const auto g_cm3 = static_cast<float>(density.g_cm3(Vec3(at_mm[0], at_mm[1], at_mm[2])));
  // The share of struts follows from the density of solid bone. They are where the texture is near its middle value, so
  // they form a net. Most values are near the middle, hence the shape of `width`.
  const float share = std::clamp(g_cm3 / kSolid_g_cm3, 0.0f, 1.0f), squared = share * share;
  const float width = 0.2f * share + 0.35f * squared * squared;
  const float pore = smooth(width - kPoreEdge, width + kPoreEdge, std::abs(texture_at(at_mm) - 0.5f));
  const float cortex = smooth(kCancellous_g_cm3, kCortex_g_cm3, g_cm3);
  const Vec3f cancellous = kStruts + pore * (kPores - kStruts);
  const Vec3f mixed = cancellous + cortex * (kCutCortex - cancellous);
  return {static_cast<std::uint8_t>(mixed.x()), static_cast<std::uint8_t>(mixed.y()),
          static_cast<std::uint8_t>(mixed.z())};
}

vtkSmartPointer<vtkPolyData> coloured(const Mesh& mesh, BodyId body, const DensityGrid* density) {
  const Colour& whole = body == BodyId{0} ? kBone : kPieces[body.value % kPieces.size()];
  const std::array palette{whole, kCutBone, kMetal, kMetal, kEnamel, kCutEnamel};
  std::vector<std::uint8_t> looks = mesh.cut_face;
  for (std::size_t v = 0; v < mesh.tissue.size(); ++v)
    if (mesh.tissue[v] != Tissue::none) looks[v] |= mesh.tissue[v] == Tissue::metal ? 2 : 4;
  std::vector<Colour> colours(looks.size());
  for (std::size_t v = 0; v < looks.size(); ++v)
    colours[v] = looks[v] == 1 && density != nullptr ? cut_colour(mesh.positions_mm[v], *density) : palette[looks[v]];
  return poly_data(mesh.positions_mm, mesh.normals, colours, mesh.triangles);
}

}  // namespace

struct BoneActors::Impl {
  vtkRenderer& renderer;
  std::map<RegionKey, vtkSmartPointer<vtkActor>> regions;
  vtkNew<vtkPlaneCollection> planes;
  std::shared_ptr<const DensityGrid> density;  // shared with whoever received it; null: not known

  void clip(vtkActor& actor) const {
    const bool open = planes->GetNumberOfItems() > 0;
    actor.GetMapper()->SetClippingPlanes(open ? planes.GetPointer() : nullptr);
    // The surface is not closed then.
    actor.GetProperty()->SetBackfaceCulling(open ? 0 : 1);
  }
};

BoneActors::BoneActors(vtkRenderer& renderer) : impl_(new Impl{renderer, {}, {}, {}}) {}

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
  const auto data = coloured(mesh, region.body, impl_->density.get());
  if (held != impl_->regions.end()) {
    static_cast<vtkPolyDataMapper*>(held->second->GetMapper())->SetInputData(data);
    return false;
  }
  const auto actor = bone_actor(data);
  impl_->clip(*actor);
  impl_->regions.emplace(region, actor);
  return true;
}

void BoneActors::set_density(std::shared_ptr<const DensityGrid> density) { impl_->density = std::move(density); }

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
