#include "common/wire/plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>

#include "common/wire/convert.hpp"

namespace osteon::wire {

namespace {

constexpr std::size_t kPartPoints = 65536, kPartTriangles = 65536;
constexpr int kMostPlanned = 1000, kMostStructures = 2000;  // as a case may have

constexpr double kLeastPitch_mm = 1e-3, kMostPitch_mm = 100.0;
constexpr std::int32_t kFarthestLeaf = 1 << 20;

tl::unexpected<Error> bad_plan(const std::string& what) {
  return failure(ErrorCode::invalid_input, "the plan from the server has " + what);
}
tl::unexpected<Error> bad_density(const std::string& what) {
  return failure(ErrorCode::invalid_input, "the density from the server has " + what);
}

bool is_unit(const Vec3& v) { return v.allFinite() && std::abs(v.norm() - 1.0) < 1e-3; }

}  // namespace

std::vector<v1::GetPlanResponse> to_wire(const SurgicalPlan& plan) {
  std::vector<v1::GetPlanResponse> messages(1);
  v1::GetPlanResponse& first = messages.front();
  for (const SurgicalPlan::Axis& axis : plan.axes) {
    v1::PlannedAxis& to = *first.add_axes();
    to.set_name(axis.name);
    *to.mutable_point_mm() = to_wire(axis.point_mm);
    *to.mutable_direction() = to_wire(axis.direction);
  }
  for (const SurgicalPlan::Plane& plane : plan.planes) {
    v1::PlannedPlane& to = *first.add_planes();
    to.set_name(plane.name);
    *to.mutable_point_mm() = to_wire(plane.point_mm);
    *to.mutable_normal() = to_wire(plane.normal);
  }
  for (const SurgicalPlan::Region& box : plan.boxes) {
    v1::PlannedBox& to = *first.add_boxes();
    to.set_name(box.name);
    *to.mutable_min_mm() = to_wire(box.min_mm);
    *to.mutable_max_mm() = to_wire(box.max_mm);
  }
  for (const SurgicalPlan::Structure& structure : plan.structures) {
    v1::LabelledStructure& to = *first.add_structures();
    to.set_name(structure.name);
    to.set_kind(static_cast<v1::StructureKind>(structure.kind));
    to.set_voxel_mm(structure.voxel_mm);
    to.set_points(static_cast<std::uint32_t>(structure.surface.positions_mm.size()));
    to.set_triangles(static_cast<std::uint32_t>(structure.surface.triangles.size()));
  }
  // `add` gets a part and a range of what it is to have.
  const auto in_parts = [&](std::size_t structure, std::size_t count, std::size_t most, const auto& add) {
    for (std::size_t from = 0; from < count; from += most) {
      v1::SurfacePart& part = *messages.emplace_back().add_parts();
      part.set_structure(static_cast<std::uint32_t>(structure));
      for (std::size_t i = from; i < std::min(count, from + most); ++i) add(part, i);
    }
  };
  for (std::size_t s = 0; s < plan.structures.size(); ++s) {
    const TriangleMesh& mesh = plan.structures[s].surface;
    in_parts(s, mesh.positions_mm.size(), kPartPoints, [&](v1::SurfacePart& part, std::size_t i) {
      for (const float value : mesh.positions_mm[i]) part.add_points_mm(value);
    });
    in_parts(s, mesh.triangles.size(), kPartTriangles, [&](v1::SurfacePart& part, std::size_t i) {
      for (const std::uint32_t corner : mesh.triangles[i]) part.add_triangles(corner);
    });
  }
  messages.back().set_complete(true);
  return messages;
}

Result<void> PlanReader::begin(const v1::GetPlanResponse& message) {
  if (std::max({message.axes_size(), message.planes_size(), message.boxes_size()}) > kMostPlanned ||
      message.structures_size() > kMostStructures)
    return bad_plan("more entries than a case may have");
  for (const v1::PlannedAxis& axis : message.axes()) {
    plan_.axes.push_back({axis.name(), from_wire(axis.point_mm()), from_wire(axis.direction())});
    if (!plan_.axes.back().point_mm.allFinite() || !is_unit(plan_.axes.back().direction))
      return bad_plan("an axis without a point or a unit vector");
  }
  for (const v1::PlannedPlane& plane : message.planes()) {
    plan_.planes.push_back({plane.name(), from_wire(plane.point_mm()), from_wire(plane.normal())});
    if (!plan_.planes.back().point_mm.allFinite() || !is_unit(plan_.planes.back().normal))
      return bad_plan("a plane without a point or a unit vector");
  }
  for (const v1::PlannedBox& box : message.boxes()) {
    plan_.boxes.push_back({box.name(), from_wire(box.min_mm()), from_wire(box.max_mm())});
    const SurgicalPlan::Region& region = plan_.boxes.back();
    if (!region.min_mm.allFinite() || !region.max_mm.allFinite() ||
        (region.min_mm.array() > region.max_mm.array()).any())
      return bad_plan("a box without two corners, the lower one first");
  }
  std::size_t triangles = 0;
  for (const v1::LabelledStructure& structure : message.structures()) {
    // A kind that this version does not know is shown as soft tissue: it may be at risk.
    const bool known = v1::StructureKind_IsValid(structure.kind()) && structure.kind() != 0;
    plan_.structures.push_back({structure.name(),
                                known ? static_cast<StructureKind>(structure.kind()) : StructureKind::soft_tissue,
                                structure.voxel_mm(),
                                {}});
    sizes_.push_back({structure.points(), structure.triangles()});
    triangles += structure.triangles();
    if (!(structure.voxel_mm() > 0.0) || !std::isfinite(structure.voxel_mm()) ||
        structure.points() > 3 * std::size_t{structure.triangles()} || triangles > kMostPlanTriangles)
      return bad_plan("a structure of an impossible size");
  }
  return {};
}

Result<void> PlanReader::add(const v1::SurfacePart& part) {
  if (part.structure() >= plan_.structures.size()) return bad_plan("a part of no structure");
  TriangleMesh& mesh = plan_.structures[part.structure()].surface;
  const Size& size = sizes_[part.structure()];
  const auto points = static_cast<std::size_t>(part.points_mm_size()),
             corners = static_cast<std::size_t>(part.triangles_size());
  if (points + corners == 0) return bad_plan("an empty part");
  if (points % 3 != 0 || corners % 3 != 0 || mesh.positions_mm.size() + points / 3 > size.points ||
      mesh.triangles.size() + corners / 3 > size.triangles)
    return bad_plan("a part of a wrong size");
  for (int i = 0; i < part.points_mm_size(); i += 3) {
    mesh.positions_mm.push_back({part.points_mm(i), part.points_mm(i + 1), part.points_mm(i + 2)});
    if (!std::ranges::all_of(mesh.positions_mm.back(), [](float value) { return std::isfinite(value); }))
      return bad_plan("a point that is not finite");
  }
  for (int i = 0; i < part.triangles_size(); i += 3) {
    mesh.triangles.push_back({part.triangles(i), part.triangles(i + 1), part.triangles(i + 2)});
    if (std::ranges::any_of(mesh.triangles.back(), [&](std::uint32_t corner) { return corner >= size.points; }))
      return bad_plan("a triangle of no points");
  }
  return {};
}

Result<void> PlanReader::add(const v1::GetPlanResponse& message) {
  if (complete_) return bad_plan("a message after its end");
  const int listed = message.axes_size() + message.planes_size() + message.boxes_size() + message.structures_size();
  if (begun_ && listed != 0) return bad_plan("a list after its first message");
  if (begun_ && message.parts_size() == 0) return bad_plan("an empty message");
  if (!begun_)
    if (Result<void> good = begin(message); !good) return good;
  begun_ = true;
  for (const v1::SurfacePart& part : message.parts())
    if (Result<void> good = add(part); !good) return good;
  complete_ = message.complete();
  return {};
}

Result<SurgicalPlan> PlanReader::finish() {
  if (!complete_) return failure(ErrorCode::invalid_input, "the plan from the server ended too early");
  for (std::size_t s = 0; s < sizes_.size(); ++s)
    if (plan_.structures[s].surface.positions_mm.size() != sizes_[s].points ||
        plan_.structures[s].surface.triangles.size() != sizes_[s].triangles)
      return bad_plan("a structure that is not complete");
  return std::move(plan_);
}

std::vector<v1::GetDensityResponse> to_wire(const DensityGrid& density) {
  constexpr int kLeavesOfMessage = 1000;  // half a MiB
  std::vector<v1::GetDensityResponse> messages(1);
  for (const auto& [leaf, samples] : density.leaves()) {
    if (messages.back().leaves_size() == kLeavesOfMessage) messages.emplace_back();
    v1::DensityLeaf& to = *messages.back().add_leaves();
    *to.mutable_leaf() = to_wire(leaf);
    to.set_samples(samples.data(), samples.size());
  }
  for (v1::GetDensityResponse& message : messages) message.set_pitch_mm(density.pitch_mm());
  messages.back().set_complete(true);
  return messages;
}

Result<void> DensityReader::add(const v1::GetDensityResponse& message) {
  if (complete_) return bad_density("a message after its end");
  if (!(message.pitch_mm() >= kLeastPitch_mm && message.pitch_mm() <= kMostPitch_mm) ||
      (begun_ && message.pitch_mm() != density_.pitch_mm()))
    return bad_density("an invalid pitch");
  if (begun_ && message.leaves_size() == 0) return bad_density("an empty message");
  if (!begun_) density_ = DensityGrid(message.pitch_mm());
  begun_ = true;
  for (const v1::DensityLeaf& leaf : message.leaves()) {
    DensityLeaf samples;
    const Coord place = from_wire(leaf.leaf());
    if (leaf.samples().size() != samples.size() || density_.leaves().size() >= kMostDensityLeaves)
      return bad_density("a wrong size");
    if (std::max({std::abs(std::int64_t{place.x}), std::abs(std::int64_t{place.y}), std::abs(std::int64_t{place.z})}) >
            kFarthestLeaf ||
        density_.leaves().contains(place))
      return bad_density("a leaf that is too far away, or comes twice");
    std::copy(leaf.samples().begin(), leaf.samples().end(), samples.begin());
    density_.add(place, samples);
  }
  complete_ = message.complete();
  return {};
}

Result<DensityGrid> DensityReader::finish() {
  if (!complete_) return failure(ErrorCode::invalid_input, "the density from the server ended too early");
  return std::move(density_);
}

}  // namespace osteon::wire
