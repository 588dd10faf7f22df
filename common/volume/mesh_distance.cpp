#include "common/volume/mesh_distance.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <set>
#include <thread>

#include "common/geometry/mesh_file.hpp"
#include "common/geometry/triangle_distance.hpp"
#include "common/volume/openvdb_start.hpp"

namespace osteon {
namespace {

constexpr float kFarthestSample_mm = 1e5f;  // from the origin; farther samples have no number

Result<void> check(const TriangleMesh& mesh, double pitch_mm, std::size_t most_triangles, double largest_mm) {
  char text[200];
  if (mesh.triangles.empty()) return failure(ErrorCode::invalid_input, "the mesh has no triangles");
  if (mesh.triangles.size() > most_triangles) {
    std::snprintf(text, sizeof text, "the mesh has %zu triangles, more than %zu; simplify it", mesh.triangles.size(),
                  most_triangles);
    return failure(ErrorCode::invalid_input, text);
  }
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t vertex : t)
      if (vertex >= mesh.positions_mm.size())
        return failure(ErrorCode::invalid_input, "the mesh has triangles without corners");
  for (const auto& p : mesh.positions_mm)
    for (const float x : p) {
      if (!std::isfinite(x)) return failure(ErrorCode::invalid_input, "the mesh has corners that are not numbers");
      if (std::abs(x) > kFarthestSample_mm) {
        std::snprintf(text, sizeof text,
                      "the mesh has a corner %.3g mm from the origin, more than %.3g mm; move it to the origin",
                      std::abs(static_cast<double>(x)), static_cast<double>(kFarthestSample_mm));
        return failure(ErrorCode::invalid_input, text);
      }
    }
  const Vec3 size = bounds(mesh).size_mm();
  if (size.maxCoeff() > largest_mm) {
    std::snprintf(text, sizeof text, "the mesh is %.3g mm long, more than %.3g mm; its unit must be the millimetre",
                  size.maxCoeff(), largest_mm);
    return failure(ErrorCode::invalid_input, text);
  }
  if (const std::size_t open = open_edges(mesh); open > 0) {
    std::snprintf(text, sizeof text,
                  "the mesh is not the closed surface of a solid: %zu of its edges are open; repair it", open);
    return failure(ErrorCode::invalid_input, text);
  }
  if (std::abs(enclosed_mm3(mesh)) < pitch_mm * pitch_mm * pitch_mm)
    return failure(
        ErrorCode::invalid_input,
        "the mesh encloses less than one sample; its unit must be the millimetre, or choose a smaller pitch");
  return {};
}

// All threads of OpenVDB call it. It forwards the call only from the caller's thread.
class Interrupter : public openvdb::util::NullInterrupter {
 public:
  explicit Interrupter(const KeepGoing& keep_going) : keep_going_(keep_going) {}
  bool wasInterrupted(int = -1) override {
    if (std::this_thread::get_id() == caller_ && !keep_going_(0.0)) stopped_ = true;
    return stopped_;
  }

 private:
  const KeepGoing& keep_going_;
  std::thread::id caller_ = std::this_thread::get_id();
  std::atomic<bool> stopped_{false};
};

// Around the surface: distances, which are inexact far from it, and the nearest triangle. Beyond the band only the
// sign.
struct Band {
  openvdb::FloatGrid::Ptr value;
  openvdb::Int32Grid nearest{static_cast<std::int32_t>(openvdb::util::INVALID_IDX)};
  float width = 0;  // samples
  bool stopped = false;
};

Band measure_band(const TriangleMesh& mesh, double pitch_mm, int width, const KeepGoing& keep_going) {
  std::vector<openvdb::Vec3s> points;
  for (const auto& p : mesh.positions_mm)
    points.emplace_back(static_cast<float>(p[0] / pitch_mm), static_cast<float>(p[1] / pitch_mm),
                        static_cast<float>(p[2] / pitch_mm));
  std::vector<openvdb::Vec3I> triangles;
  for (const auto& t : mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> adapter(points, triangles);
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  Interrupter interrupter(keep_going);
  Band band;
  band.width = static_cast<float>(width);
  // By its base class: libopenvdb has this template compiled for it. Any other type compiles it here for half a minute.
  openvdb::util::NullInterrupter& base = interrupter;
  band.value = openvdb::tools::meshToVolume<openvdb::FloatGrid>(base, adapter, *transform, band.width, band.width, 0,
                                                                &band.nearest);
  band.stopped = interrupter.wasInterrupted();
  return band;
}

// The band's distances are exact next to the surface and up to half a voxel wrong at its end. Its nearest triangles are
// correct, or neighbours of the correct one. So each sample also tests the triangles of its neighbours.
class BandDistance {
 public:
  BandDistance(const Band& band, const TriangleMesh& mesh, double pitch_mm)
      : width_(static_cast<double>(band.width)),
        mesh_(mesh),
        pitch_mm_(pitch_mm),
        value_(band.value->getConstAccessor()),
        nearest_(band.nearest.getConstAccessor()) {}

  // Distance in mm. Outside the band, the width of the band.
  [[nodiscard]] double at(Coord sample) const {
    const openvdb::Coord here(sample.x, sample.y, sample.z);
    const auto rough = static_cast<double>(value_.getValue(here));
    double mm = width_ * pitch_mm_;
    if (std::abs(rough) < width_) {
      const Vec3 p = position_mm(sample, pitch_mm_);
      std::int32_t last = -1;
      for (int around = 0; around < 27; ++around) {
        const openvdb::Coord beside = here.offsetBy(around / 9 - 1, around / 3 % 3 - 1, around % 3 - 1);
        std::int32_t t = 0;
        if (!nearest_.probeValue(beside, t) || t == last || t < 0 ||
            static_cast<std::size_t>(t) >= mesh_.triangles.size())
          continue;
        last = t;
        const auto& [a, b, c] = mesh_.triangles[static_cast<std::size_t>(t)];
        mm = std::min(
            mm,
            std::sqrt(
                distance_to_triangle<double>(p, position(mesh_, a), position(mesh_, b), position(mesh_, c)).squared));
      }
    }
    return std::copysign(mm, rough);
  }

 private:
  double width_;
  const TriangleMesh& mesh_;
  double pitch_mm_;
  openvdb::FloatGrid::ConstAccessor value_;
  openvdb::Int32Grid::ConstAccessor nearest_;
};

Result<std::shared_ptr<const SampledDistance>> measure_distances(const TriangleMesh& mesh, std::int32_t pitch_quanta) {
  const double pitch = pitch_quanta * kQuantum_mm;
  const std::int32_t band = std::max(4, static_cast<std::int32_t>(std::ceil(kMeshBand_mm / pitch)));
  auto made = std::make_shared<SampledDistance>();
  made->pitch = pitch_quanta;
  made->box = covering_samples(bounds(mesh), pitch).grown(band);
  const Coord dims = made->box.dims();
  const double samples = static_cast<double>(dims.x) * dims.y * dims.z;
  if (samples > kMostMeshSamples) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "a pitch of %.3g mm needs %.0f million samples for this mesh, more than %.0f million; choose a larger one",
        pitch, samples * 1e-6, kMostMeshSamples * 1e-6);
    return failure(ErrorCode::invalid_input, text);
  }

  const Band found = measure_band(mesh, pitch, band + 1, [](double) { return true; });
  const BandDistance distance(found, mesh, pitch);
  const double clip_mm = band * pitch;
  made->values.reserve(static_cast<std::size_t>(samples));
  for (std::int32_t x = made->box.min.x; x <= made->box.max.x; ++x)
    for (std::int32_t y = made->box.min.y; y <= made->box.max.y; ++y)
      for (std::int32_t z = made->box.min.z; z <= made->box.max.z; ++z) {
        const double mm = std::clamp(distance.at({x, y, z}), -clip_mm, clip_mm);
        made->values.push_back(static_cast<std::int16_t>(std::lround(mm * 1024.0)));
      }
  return std::shared_ptr<const SampledDistance>(std::move(made));
}

}  // namespace

Result<std::shared_ptr<const SampledDistance>> sampled_distance(const TriangleMesh& mesh, double pitch_mm) {
  const auto quanta = pitch_mm > 0.0 && pitch_mm < 8.0 ? static_cast<std::int32_t>(std::lround(pitch_mm * 1024.0)) : 0;
  if (quanta < 1) return failure(ErrorCode::invalid_input, "the pitch of a mesh must be between 0.001 and 8 mm");
  if (const auto good = check(mesh, pitch_mm, kMostMeshTriangles, kLargestMesh_mm); !good)
    return tl::unexpected(good.error());
  try {
    start_openvdb();
    return measure_distances(mesh, quanta);
  } catch (const std::exception& e) {
    return failure(ErrorCode::internal, std::string("the mesh could not be measured: ") + e.what());
  }
}

namespace {

// Memory of the band and of the resulting case, by their leaves: about this many bytes for each sample near the
// surface.
constexpr double kBytesPerSample = 24.0, kMostBytes = 12e9;
constexpr double kMostLattice = 4e9;  // samples of the whole box, most of which are never read
constexpr double kBandShare = 0.5;    // fraction of the time

// The connected parts of a surface, in two groups: those that bound bone, and those with opposite orientation that
// bound cavities within it.
struct Shells {
  TriangleMesh bone, cavities;
};

Shells shells_of(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.positions_mm.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : {t[1], t[2]}) parent[root(v)] = root(t[0]);
  const Vec3 origin = position(mesh, 0);
  std::vector<double> six_volumes(mesh.positions_mm.size(), 0.0);
  for (const auto& [a, b, c] : mesh.triangles)
    six_volumes[root(a)] +=
        (position(mesh, a) - origin).dot((position(mesh, b) - origin).cross(position(mesh, c) - origin));
  const double outwards = enclosed_mm3(mesh);
  Shells out{{mesh.positions_mm, {}, {}}, {mesh.positions_mm, {}, {}}};
  for (const auto& t : mesh.triangles)
    (six_volumes[root(t[0])] * outwards < 0.0 ? out.cavities : out.bone).triangles.push_back(t);
  return out;
}

// A mesh's distance where it is near, and its sign everywhere.
class PartDistance {
 public:
  PartDistance(const TriangleMesh& mesh, double pitch_mm, int width, const KeepGoing& keep_going)
      : band_(measure_band(mesh, pitch_mm, width, keep_going)),
        distance_(band_, mesh, pitch_mm),
        sign_(band_.value->getConstAccessor()) {
    for (auto leaf = band_.value->tree().cbeginLeaf(); leaf; ++leaf)
      near_.insert(part_of({leaf->origin().x(), leaf->origin().y(), leaf->origin().z()}));
  }
  [[nodiscard]] bool stopped() const { return band_.stopped; }
  [[nodiscard]] bool near(Coord first) const { return near_.contains(part_of(first)); }
  [[nodiscard]] bool inside(Coord sample) const { return sign_.getValue({sample.x, sample.y, sample.z}) < 0.0f; }
  [[nodiscard]] double at(Coord sample) const { return distance_.at(sample); }

 private:
  static Coord part_of(Coord c) { return shift_down(c, 6); }
  static_assert(Case::kPartSamples == 1 << 6);
  Band band_;
  BandDistance distance_;
  openvdb::FloatGrid::ConstAccessor sign_;
  std::set<Coord> near_;  // parts with samples in the band
};

Result<Case> build_of_mesh(CaseInfo info, const TriangleMesh& mesh, double density_g_cm3, const KeepGoing& keep_going) {
  const double pitch = info.pitch_mm;
  constexpr int kWidth = 5;  // samples: the case's band and one more
  const CoordBox box = covering_samples(bounds(mesh), pitch).grown(kWidth);
  const Shells shells = shells_of(mesh);
  const auto waiting = [&](double) { return keep_going(0.0); };
  const PartDistance bone(shells.bone, pitch, kWidth, waiting);
  std::optional<PartDistance> cavities;
  if (!bone.stopped() && !shells.cavities.triangles.empty()) cavities.emplace(shells.cavities, pitch, kWidth, waiting);
  if (bone.stopped() || (cavities && cavities->stopped())) return stopped_while("measuring the mesh");

  const auto fill = [&](const CoordBox& part, PartSamples& samples) {
    std::ranges::fill(samples.density_g_cm3, static_cast<float>(density_g_cm3));
    if (!bone.near(part.min) && !(cavities && cavities->near(part.min)))
      return bone.inside(part.min) && !(cavities && cavities->inside(part.min)) ? PartKind::inside : PartKind::outside;
    float* out = samples.surface_mm.data();
    for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
      for (std::int32_t y = part.min.y; y <= part.max.y; ++y)
        for (std::int32_t z = part.min.z; z <= part.max.z; ++z) {
          // The difference of two solids is the maximum of one distance and the other's negative.
          const double mm = bone.at({x, y, z});
          *out++ = static_cast<float>(cavities ? std::max(mm, -cavities->at({x, y, z})) : mm);
        }
    return PartKind::samples;
  };
  return Case::build(std::move(info), box, fill,
                     [&](double done) { return keep_going(kBandShare + (1.0 - kBandShare) * done); });
}

}  // namespace

Result<Case> case_of_mesh(CaseInfo info, const TriangleMesh& mesh, double density_g_cm3, const KeepGoing& keep_going) {
  const double pitch = info.pitch_mm;
  char text[240];
  if (!mesh.triangles.empty()) {
    const double longest = bounds(mesh).size_mm().maxCoeff();
    if (longest < kSmallestBone_mm || longest > kLargestBone_mm) {
      std::snprintf(text, sizeof text,
                    "the mesh is %.3g mm long, and a bone has %g to %g mm; say which unit its numbers have", longest,
                    kSmallestBone_mm, kLargestBone_mm);
      return failure(ErrorCode::invalid_input, text);
    }
  }
  if (const auto good = check(mesh, pitch, kMostBoneTriangles, kLargestBone_mm); !good)
    return tl::unexpected(good.error());
  // The band is ten samples deep, and its leaves extend about seven samples beyond it.
  const double bytes = area_mm2(mesh) / (pitch * pitch) * 17.0 * kBytesPerSample;
  const Vec3 samples = bounds(mesh).size_mm() / pitch;
  if (bytes > kMostBytes || samples.prod() > kMostLattice) {
    const double finest =
        std::max(pitch * std::sqrt(bytes / kMostBytes), pitch * std::cbrt(samples.prod() / kMostLattice));
    std::snprintf(text, sizeof text,
                  "a pitch of %.3g mm would take some %.0f GB of memory; this bone allows %.2g mm and coarser", pitch,
                  bytes * 1e-9, 1.05 * finest);
    return failure(ErrorCode::invalid_input, text);
  }
  try {
    start_openvdb();
    return build_of_mesh(std::move(info), mesh, density_g_cm3, keep_going);
  } catch (const std::exception& e) {
    return failure(ErrorCode::internal, std::string("the mesh could not be measured: ") + e.what());
  }
}

MeshLoader stl_beside(const std::filesystem::path& folder) {
  return [folder](const std::string& name, double pitch_mm) -> Result<std::shared_ptr<const SampledDistance>> {
    // A tool file may come from an untrusted source, so it must not name files in other folders.
    if (name.empty() || name == "." || name == ".." || name.find_first_of("/\\") != std::string::npos)
      return failure(ErrorCode::invalid_input,
                     "\"" + name + "\" must be the plain name of an STL file beside the tool file");
    const auto mesh = read_stl(folder / name);
    if (!mesh) return tl::unexpected(mesh.error());
    auto distance = sampled_distance(*mesh, pitch_mm);
    if (!distance) return failure(distance.error().code, (folder / name).string() + ": " + distance.error().message);
    return distance;
  };
}

Result<Tool> load_tool_file(const std::filesystem::path& file) {
  return load_tool(file, stl_beside(file.parent_path()));
}

}  // namespace osteon
