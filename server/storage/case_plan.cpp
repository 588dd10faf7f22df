#include "server/storage/case_plan.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/surface/label_surface.hpp"
#include "common/volume/case_scan.hpp"

namespace osteon {

namespace {

// None: bone, which is not at risk.
std::optional<StructureKind> risk_of(LabelKind kind) {
  switch (kind) {
    case LabelKind::nerve:
      return StructureKind::nerve;
    case LabelKind::vessel:
      return StructureKind::vessel;
    case LabelKind::dura:
      return StructureKind::dura;
    case LabelKind::cartilage:
      return StructureKind::cartilage;
    case LabelKind::soft_tissue:
      return StructureKind::soft_tissue;
    default:
      return {};
  }
}

// The first and the last column, row and slice of each label.
struct VoxelBox {
  std::array<int, 3> first{}, last{-1, -1, -1};
};

std::array<VoxelBox, 256> boxes_of(const CaseScan& scan) {
  std::array<VoxelBox, 256> boxes;
  const auto& dims = scan.geometry.dims;
  std::size_t i = 0;
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x, ++i) {
        const std::uint8_t label = scan.labels[i];
        if (label == 0) continue;
        VoxelBox& box = boxes[label];
        const std::array at{x, y, z};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          box.first[axis] = box.last[axis] < 0 ? at[axis] : std::min(box.first[axis], at[axis]);
          box.last[axis] = std::max(box.last[axis], at[axis]);
        }
      }
  return boxes;
}

Result<TriangleMesh> surface_of(const CaseScan& scan, int label, const VoxelBox& box, std::size_t most_triangles) {
  const ScanGeometry& geometry = scan.geometry;
  VoxelGrid grid;
  for (std::size_t axis = 0; axis < 3; ++axis) grid.dims[axis] = box.last[axis] - box.first[axis] + 1;
  grid.origin_mm = geometry.position_mm(Vec3(box.first[0], box.first[1], box.first[2]));
  grid.axes_mm = geometry.axes_mm;
  const auto columns = to_index(geometry.dims[0]), rows = to_index(geometry.dims[1]);
  return label_surface(
      grid,
      [&](int slice, std::span<std::uint8_t> voxels) {
        std::size_t to = 0;
        for (int row = 0; row < grid.dims[1]; ++row) {
          const std::size_t from =
              (to_index(box.first[2] + slice) * rows + to_index(box.first[1] + row)) * columns + to_index(box.first[0]);
          for (std::size_t column = 0; column < to_index(grid.dims[0]); ++column)
            voxels[to++] = scan.labels[from + column] == label ? 1 : 0;
        }
      },
      most_triangles);
}

}  // namespace

Result<SurgicalPlan> load_plan(const std::filesystem::path& folder, const Case& bone) {
  const CaseInfo& info = bone.info();
  SurgicalPlan plan;
  for (const PlannedAxis& axis : info.axes) plan.axes.push_back({axis.name, axis.point_mm, axis.direction});
  for (const PlannedPlane& plane : info.planes) plan.planes.push_back({plane.name, plane.point_mm, plane.normal});
  struct Wanted {
    int label;
    std::string name;
    StructureKind kind;
  };
  std::vector<Wanted> wanted;
  for (const CaseLabel& label : info.labels)
    if (const auto kind = risk_of(label.kind)) wanted.push_back({label.value, label.name, *kind});
  for (const PlannedRegion& region : info.regions) {
    if (region.label == 0)
      plan.boxes.push_back({region.name, region.min_mm, region.max_mm});
    else
      wanted.push_back({region.label, region.name, StructureKind::region});
  }
  if (wanted.empty()) return plan;
  const Result<CaseScan> scan = load_scan(folder, bone);
  if (!scan) return tl::unexpected(scan.error());
  const std::array<VoxelBox, 256> boxes = boxes_of(*scan);
  const double voxel_mm = scan->geometry.axes_mm.colwise().norm().maxCoeff();
  std::size_t left = kMostPlanTriangles;
  for (const Wanted& one : wanted) {
    const VoxelBox& box = boxes[to_index(one.label)];
    if (box.last[0] < 0) continue;  // no voxel has it
    Result<TriangleMesh> surface = surface_of(*scan, one.label, box, left);
    if (!surface)
      return failure(ErrorCode::exhausted, "the structures of this case are too large to be shown: up to \"" +
                                               one.name + "\" their surfaces have more than " +
                                               std::to_string(kMostPlanTriangles) +
                                               " triangles; import the case with fewer labels");
    left -= surface->triangles.size();
    plan.structures.push_back({one.name, one.kind, voxel_mm, std::move(*surface)});
  }
  return plan;
}

}  // namespace osteon
