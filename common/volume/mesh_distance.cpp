#include "common/volume/mesh_distance.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "common/geometry/mesh_file.hpp"

namespace osteon {
namespace {

void initialize_once() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

// Distance from p to a triangle: Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
double distance_to(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return ap.norm();
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return bp.norm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - ab * (d1 / (d1 - d3))).norm();
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return cp.norm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - ac * (d2 / (d2 - d6))).norm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return (bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).norm();
  const double scale = 1.0 / (va + vb + vc);
  return (ap - ab * (vb * scale) - ac * (vc * scale)).norm();
}

Result<void> check(const TriangleMesh& mesh, double pitch_mm) {
  char text[200];
  if (mesh.triangles.empty()) return failure(ErrorCode::invalid_input, "the mesh has no triangles");
  if (mesh.triangles.size() > kMostMeshTriangles) {
    std::snprintf(text, sizeof text, "the mesh has %zu triangles, more than %zu; simplify it", mesh.triangles.size(), kMostMeshTriangles);
    return failure(ErrorCode::invalid_input, text);
  }
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t vertex : t)
      if (vertex >= mesh.positions_mm.size()) return failure(ErrorCode::invalid_input, "the mesh has triangles without corners");
  for (const auto& p : mesh.positions_mm)
    for (const float x : p)
      if (!std::isfinite(x)) return failure(ErrorCode::invalid_input, "the mesh has corners that are not numbers");
  const Vec3 size = bounds(mesh).size_mm();
  if (size.maxCoeff() > kLargestMesh_mm) {
    std::snprintf(text, sizeof text, "the mesh is %.3g mm long, more than %.3g mm; its unit must be the millimetre", size.maxCoeff(),
                  kLargestMesh_mm);
    return failure(ErrorCode::invalid_input, text);
  }
  if (const std::size_t open = open_edges(mesh); open > 0) {
    std::snprintf(text, sizeof text, "the mesh is not the closed surface of a solid: %zu of its edges are open; repair it", open);
    return failure(ErrorCode::invalid_input, text);
  }
  if (std::abs(enclosed_mm3(mesh)) < pitch_mm * pitch_mm * pitch_mm)
    return failure(ErrorCode::invalid_input, "the mesh encloses less than one sample; its unit must be the millimetre, or choose a smaller pitch");
  return {};
}

Result<std::shared_ptr<const SampledDistance>> measure(const TriangleMesh& mesh, std::int32_t pitch_quanta) {
  const double pitch = pitch_quanta * kQuantum_mm;
  const std::int32_t band = std::max(4, static_cast<std::int32_t>(std::ceil(kMeshBand_mm / pitch)));
  auto made = std::make_shared<SampledDistance>();
  made->pitch = pitch_quanta;
  made->box = covering_samples(bounds(mesh), pitch).grown(band);
  const Coord dims = made->box.dims();
  const double samples = static_cast<double>(dims.x) * dims.y * dims.z;
  if (samples > kMostMeshSamples) {
    char text[160];
    std::snprintf(text, sizeof text, "a pitch of %.3g mm needs %.0f million samples for this mesh, more than %.0f million; choose a larger one",
                  pitch, samples * 1e-6, kMostMeshSamples * 1e-6);
    return failure(ErrorCode::invalid_input, text);
  }

  std::vector<openvdb::Vec3s> points;
  for (const auto& p : mesh.positions_mm)
    points.emplace_back(static_cast<float>(p[0] / pitch), static_cast<float>(p[1] / pitch), static_cast<float>(p[2] / pitch));
  std::vector<openvdb::Vec3I> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
  openvdb::Int32Grid nearest(openvdb::util::INVALID_IDX);
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  const auto width = static_cast<float>(band + 1);
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, *transform, width, width, 0, &nearest);

  // Its distances are good next to the surface and up to half a voxel wrong at the end of the band, but its nearest
  // triangles are right or beside the right one: each sample looks at those of its neighbours as well.
  const auto value = grid->getConstAccessor();
  const auto triangle = nearest.getConstAccessor();
  const double clip_mm = band * pitch;
  const auto corner = [&](std::int32_t t, std::size_t k) { return position(mesh, mesh.triangles[static_cast<std::size_t>(t)][k]); };
  made->values.reserve(static_cast<std::size_t>(samples));
  for (std::int32_t x = made->box.min.x; x <= made->box.max.x; ++x)
    for (std::int32_t y = made->box.min.y; y <= made->box.max.y; ++y)
      for (std::int32_t z = made->box.min.z; z <= made->box.max.z; ++z) {
        const openvdb::Coord at(x, y, z);
        const auto rough = static_cast<double>(value.getValue(at));
        double mm = clip_mm;
        if (std::abs(rough) < static_cast<double>(width)) {
          const Vec3 p = position_mm({x, y, z}, pitch);
          std::int32_t last = -1;
          for (int around = 0; around < 27; ++around) {
            const openvdb::Coord beside = at.offsetBy(around / 9 - 1, around / 3 % 3 - 1, around % 3 - 1);
            std::int32_t t = 0;
            if (!triangle.probeValue(beside, t) || t == last || t < 0 || static_cast<std::size_t>(t) >= mesh.triangles.size()) continue;
            last = t;
            mm = std::min(mm, distance_to(p, corner(t, 0), corner(t, 1), corner(t, 2)));
          }
        }
        made->values.push_back(static_cast<std::int16_t>(std::lround(std::copysign(mm, rough) * 1024.0)));
      }
  return std::shared_ptr<const SampledDistance>(std::move(made));
}

}  // namespace

Result<std::shared_ptr<const SampledDistance>> sampled_distance(const TriangleMesh& mesh, double pitch_mm) {
  const auto quanta = pitch_mm > 0.0 && pitch_mm < 8.0 ? static_cast<std::int32_t>(std::lround(pitch_mm * 1024.0)) : 0;
  if (quanta < 1) return failure(ErrorCode::invalid_input, "the pitch of a mesh must be between 0.001 and 8 mm");
  if (const auto good = check(mesh, pitch_mm); !good) return tl::unexpected(good.error());
  try {
    initialize_once();
    return measure(mesh, quanta);
  } catch (const std::exception& e) {
    return failure(ErrorCode::internal, std::string("the mesh could not be measured: ") + e.what());
  }
}

MeshLoader stl_beside(const std::filesystem::path& folder) {
  return [folder](const std::string& name, double pitch_mm) -> Result<std::shared_ptr<const SampledDistance>> {
    // A tool file may come from anyone; it names no files elsewhere.
    if (name.empty() || name == "." || name == ".." || name.find_first_of("/\\") != std::string::npos)
      return failure(ErrorCode::invalid_input, "\"" + name + "\" must be the plain name of an STL file beside the tool file");
    const auto mesh = read_stl(folder / name);
    if (!mesh) return tl::unexpected(mesh.error());
    auto distance = sampled_distance(*mesh, pitch_mm);
    if (!distance) return failure(distance.error().code, (folder / name).string() + ": " + distance.error().message);
    return distance;
  };
}

Result<Tool> load_tool_file(const std::filesystem::path& file) { return load_tool(file, stl_beside(file.parent_path())); }

}  // namespace osteon
