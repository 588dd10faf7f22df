#include "common/volume/case.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "common/core/check.hpp"
#include "common/core/freed_memory.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/sparse_volume.hpp"

namespace osteon {

// Grids of one case. `clearance` has one sample for each leaf of level 0, at the leaf's middle.
struct Case::Grids {
  CaseInfo info;
  Digest hash;
  SparseVolume surface, density, clearance, bone, tissue;
  CoordBox bounds;
  double volume_mm3 = 0.0;
  std::vector<Coord> metal_leaves, hard_leaves;  // of `tissue`, sorted
};

namespace {

constexpr const char* kInfoFile = "case.json";
constexpr const char* kVolumeFile = "bone.vdb";
const std::vector<std::string> kGridNames{"surface", "density", "clearance", "bone", "tissue"};
constexpr std::uint64_t kMostCaseLeaves = 4'000'000;  // of a grid; a larger one is of no bone

VdbLimits limits_for(const std::filesystem::path& file) {
  return {.memory_bytes = most_case_memory(file), .leaves = kMostCaseLeaves, .grids = 16};
}

// Clearance is stored up to this distance from the bone, in leaves. Farther points get this distance.
constexpr int kClearanceLeaves = 12;

float to_quantum(float mm) { return std::round(mm * 1024.0f) / 1024.0f + 0.0f; }

// The samples of a leaf from a part, with `outside` beyond the part.
template <class T>
void read_leaf(const CoordBox& part, const std::vector<T>& from, Coord origin, T outside,
               std::array<T, kLeafVoxels>& out) {
  const Coord dims = part.dims();
  const std::int32_t first = std::max(origin.z, part.min.z), last = std::min(origin.z + kLeafSize - 1, part.max.z);
  std::ranges::fill(out, outside);
  for (std::int32_t x = std::max(origin.x, part.min.x); x <= std::min(origin.x + kLeafSize - 1, part.max.x); ++x)
    for (std::int32_t y = std::max(origin.y, part.min.y); y <= std::min(origin.y + kLeafSize - 1, part.max.y); ++y) {
      const std::size_t row = (static_cast<std::size_t>(x - part.min.x) * static_cast<std::size_t>(dims.y) +
                               static_cast<std::size_t>(y - part.min.y)) *
                              static_cast<std::size_t>(dims.z);
      for (std::int32_t z = first; z <= last; ++z)
        out[static_cast<std::size_t>((x - origin.x) * 64 + (y - origin.y) * 8 + (z - origin.z))] =
            from[row + static_cast<std::size_t>(z - part.min.z)];
    }
}

// Stores one number if all values are equal, as in most of a bone's inside.
void store_leaf(SparseVolume& volume, Coord origin, std::span<const float, kLeafVoxels> values) {
  if (std::ranges::all_of(values, [&](float v) { return v == values[0]; })) {
    if (values[0] != volume.background()) volume.set_constant(origin, values[0]);
  } else {
    std::ranges::copy(values, volume.edit_leaf(origin));
  }
}

// Adds one leaf of bone from the samples of a part. False: the density is not a number.
bool add_leaf(Case::Grids& grids, const CoordBox& box, const PartSamples& part, Coord origin) {
  const float band = grids.surface.background();
  std::array<float, kLeafVoxels> s, rho, tissue, bone;
  std::array<std::uint8_t, kLeafVoxels> number;
  std::array<Tissue, kLeafVoxels> known;
  number.fill(1);
  known.fill(Tissue::none);
  read_leaf(box, part.surface_mm, origin, band, s);
  for (float& value : s) {
    if (std::isnan(value)) return false;
    value = std::clamp(to_quantum(std::clamp(value, -2.0f * band, 2.0f * band)), -band, band);
  }
  if (std::ranges::all_of(s, [&](float v) { return v == band; })) return true;
  if (!part.bone.empty()) read_leaf(box, part.bone, origin, std::uint8_t{0}, number);
  if (!part.tissue.empty()) read_leaf(box, part.tissue, origin, Tissue::none, known);
  // A sample inside the surface without a number lies between the voxels of the scan. It counts as bone 1.
  for (std::size_t i = 0; i < kLeafVoxels; ++i)
    bone[i] = s[i] < 0.0f ? std::max(1.0f, static_cast<float>(number[i])) : 0.0f;
  // Only a leaf that is wholly inside becomes a constant. A surface leaf stays a leaf even if its samples are equal.
  if (std::ranges::all_of(s, [&](float v) { return v == -band; })) {
    grids.surface.set_constant(origin, -band);
    store_leaf(grids.bone, origin, bone);
  } else {
    std::ranges::copy(s, grids.surface.edit_leaf(origin));
    std::ranges::copy(bone, grids.bone.edit_leaf(origin));
  }
  read_leaf(box, part.density_g_cm3, origin, 0.0f, rho);
  for (std::size_t i = 0; i < kLeafVoxels; ++i) {
    if (!std::isfinite(rho[i])) return false;
    rho[i] = std::max(0.0f, rho[i]) + 0.0f;
    const Tissue by_density = rho[i] >= kCorticalFrom_g_cm3 ? Tissue::cortical : Tissue::trabecular;
    const Tissue found = s[i] >= 0.0f ? Tissue::none : known[i] != Tissue::none ? known[i] : by_density;
    tissue[i] = static_cast<float>(found);
  }
  store_leaf(grids.tissue, origin, tissue);
  store_leaf(grids.density, origin, rho);
  return true;
}

void hash_volume(Hasher& hasher, const std::string& name, const SparseVolume& volume) {
  hasher.text(name);
  hasher.number(static_cast<double>(volume.background()));
  const auto place = [&](Coord c) {
    for (const std::int32_t i : {c.x, c.y, c.z}) hasher.integer(static_cast<std::uint32_t>(i));
  };
  for (const Coord origin : volume.constants()) {
    place(origin);
    hasher.number(static_cast<double>(volume.value(origin)));
  }
  hasher.text("leaves");
  for (const Coord origin : volume.leaves()) {
    place(origin);
    hasher.bytes(std::as_bytes(std::span(volume.leaf(origin), kLeafVoxels)));
  }
}

Digest content_hash(const Case::Grids& grids) {
  Hasher hasher;
  hash_description(hasher, grids.info);
  const SparseVolume* volumes[] = {&grids.surface, &grids.density, &grids.clearance, &grids.bone, &grids.tissue};
  for (std::size_t i = 0; i < kGridNames.size(); ++i) hash_volume(hasher, kGridNames[i], *volumes[i]);
  return hasher.finish();
}

// Computes box and volume of the bone from the surface.
void measure(Case::Grids& grids) {
  constexpr std::int32_t kFar = std::numeric_limits<std::int32_t>::max();
  grids.bounds = {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  const auto include = [&](Coord origin) {
    CoordBox& b = grids.bounds;
    b.min = {std::min(b.min.x, origin.x), std::min(b.min.y, origin.y), std::min(b.min.z, origin.z)};
    b.max = {std::max(b.max.x, origin.x + 7), std::max(b.max.y, origin.y + 7), std::max(b.max.z, origin.z + 7)};
  };
  const double pitch = grids.info.pitch_mm;
  double samples = 0.0;
  for (const Coord origin : grids.surface.constants()) {
    include(origin);
    samples += kLeafVoxels;
  }
  for (const Coord origin : grids.surface.leaves()) {
    include(origin);
    const float* leaf = grids.surface.leaf(origin);
    // A sample whose distance is within half a pitch of the surface is partly bone.
    for (int i = 0; i < kLeafVoxels; ++i) samples += std::clamp(0.5 - static_cast<double>(leaf[i]) / pitch, 0.0, 1.0);
  }
  grids.volume_mm3 = samples * pitch * pitch * pitch;
}

bool has_inside(const Case::Grids& grids) {
  const auto inside = [&](Coord origin) {
    const float* leaf = grids.surface.leaf(origin);
    return std::any_of(leaf, leaf + kLeafVoxels, [](float s) { return s < 0.0f; });
  };
  return !grids.surface.constants().empty() || std::ranges::any_of(grids.surface.leaves(), inside);
}

// Finds the leaves with metal and enamel from the tissue.
void find_hard_leaves(Case::Grids& grids) {
  constexpr auto kMetal = static_cast<float>(Tissue::metal), kEnamel = static_cast<float>(Tissue::enamel);
  const auto note = [&](Coord origin, std::span<const float> leaf) {
    const bool metal = std::ranges::find(leaf, kMetal) != leaf.end();
    if (metal) grids.metal_leaves.push_back(origin);
    if (metal || std::ranges::find(leaf, kEnamel) != leaf.end()) grids.hard_leaves.push_back(origin);
  };
  for (const Coord origin : grids.tissue.leaves()) note(origin, std::span(grids.tissue.leaf(origin), kLeafVoxels));
  for (const Coord origin : grids.tissue.constants()) {
    const float value = grids.tissue.value(origin);
    note(origin, std::span(&value, 1));
  }
  std::ranges::sort(grids.metal_leaves);
  std::ranges::sort(grids.hard_leaves);
}

// Whether the box meets one of these leaves.
bool meets(const std::vector<Coord>& leaves, const CoordBox& box) {
  if (leaves.empty()) return false;
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize)
        if (std::ranges::binary_search(leaves, Coord{x, y, z})) return true;
  return false;
}

// Lower envelope of parabolas along one line of squared distances: the exact Euclidean distance transform, one axis at
// a time (Felzenszwalb and Huttenlocher, Distance transforms of sampled functions, 2012).
void distance_along_line(std::vector<double>& line) {
  const int n = static_cast<int>(line.size());
  std::vector<int> parabola(line.size());
  std::vector<double> from(line.size() + 1), result(line.size());
  int last = -1;
  for (int q = 0; q < n; ++q) {
    if (std::isinf(line[static_cast<std::size_t>(q)])) continue;
    double cross = -std::numeric_limits<double>::infinity();
    while (last >= 0) {
      const int p = parabola[static_cast<std::size_t>(last)];
      cross = (line[static_cast<std::size_t>(q)] + q * q - line[static_cast<std::size_t>(p)] - p * p) / (2.0 * (q - p));
      if (cross > from[static_cast<std::size_t>(last)]) break;
      --last;
    }
    if (last < 0) cross = -std::numeric_limits<double>::infinity();
    ++last;
    parabola[static_cast<std::size_t>(last)] = q;
    from[static_cast<std::size_t>(last)] = cross;
  }
  if (last < 0) return;
  for (int q = 0, k = 0; q < n; ++q) {
    while (k < last && from[static_cast<std::size_t>(k + 1)] < q) ++k;
    const int p = parabola[static_cast<std::size_t>(k)];
    result[static_cast<std::size_t>(q)] = (q - p) * (q - p) + line[static_cast<std::size_t>(p)];
  }
  line = std::move(result);
}

// The distance between leaves, minus one leaf diagonal on either side, is a lower bound of the distance to the bone.
SparseVolume make_clearance(const SparseVolume& surface, double pitch) {
  std::vector<Coord> occupied = surface.leaves();
  const std::vector<Coord> inside = surface.constants();
  occupied.insert(occupied.end(), inside.begin(), inside.end());
  const double leaf_mm = kLeafSize * pitch;
  SparseVolume clearance(static_cast<float>((kClearanceLeaves - 2) * leaf_mm));
  if (occupied.empty()) return clearance;

  CoordBox box{shift_down(occupied.front(), 3), shift_down(occupied.front(), 3)};
  for (const Coord origin : occupied) {
    const Coord c = shift_down(origin, 3);
    box.min = {std::min(box.min.x, c.x), std::min(box.min.y, c.y), std::min(box.min.z, c.z)};
    box.max = {std::max(box.max.x, c.x), std::max(box.max.y, c.y), std::max(box.max.z, c.z)};
  }
  DenseVolume<double> squared(box.grown(kClearanceLeaves), std::numeric_limits<double>::infinity());
  for (const Coord origin : occupied) squared.at(shift_down(origin, 3)) = 0.0;

  const Coord dims = squared.box.dims();
  const std::size_t strides[3] = {static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z),
                                  static_cast<std::size_t>(dims.z), 1};
  const std::size_t sizes[3] = {static_cast<std::size_t>(dims.x), static_cast<std::size_t>(dims.y),
                                static_cast<std::size_t>(dims.z)};
  std::vector<double> line;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (std::size_t i = 0; i < sizes[u]; ++i)
      for (std::size_t j = 0; j < sizes[v]; ++j) {
        const std::size_t start = i * strides[u] + j * strides[v];
        line.resize(sizes[axis]);
        for (std::size_t k = 0; k < sizes[axis]; ++k) line[k] = squared.values[start + k * strides[axis]];
        distance_along_line(line);
        for (std::size_t k = 0; k < sizes[axis]; ++k) squared.values[start + k * strides[axis]] = line[k];
      }
  }
  const Coord low = squared.box.min, high = squared.box.max;
  for (std::int32_t x = low.x; x <= high.x; ++x)
    for (std::int32_t y = low.y; y <= high.y; ++y)
      for (std::int32_t z = low.z; z <= high.z; ++z) {
        const double leaves = std::sqrt(squared.at({x, y, z})) - std::sqrt(3.0);
        const float bound = std::clamp(static_cast<float>(leaves * leaf_mm), 0.0f, clearance.background());
        if (bound >= clearance.background()) continue;
        clearance.edit_leaf(floor_to({x, y, z}, kLeafSize))[(x & 7) * 64 + (y & 7) * 8 + (z & 7)] = bound;
      }
  return clearance;
}

// A box of samples from a larger volume. Empty if the volume is empty.
template <class T>
void copy_part(const DenseVolume<T>& from, const CoordBox& part, std::vector<T>& out) {
  out.clear();
  if (from.values.empty()) return;
  const auto row = static_cast<std::size_t>(part.dims().z);
  for (std::int32_t x = part.min.x; x <= part.max.x; ++x)
    for (std::int32_t y = part.min.y; y <= part.max.y; ++y) {
      const T* first = from.values.data() + from.index({x, y, part.min.z});
      out.insert(out.end(), first, first + row);
    }
}

}  // namespace

Result<Case> Case::build(CaseInfo info, const CoordBox& box, const FillPart& fill, const KeepGoing& keep_going) {
  if (const Result<void> sound = check_description(info); !sound)
    return bad_input("the description of the case: " + sound.error().message);
  const float band = band_mm(info.pitch_mm);
  auto grids = std::make_shared<Grids>(Grids{std::move(info),
                                             {},
                                             SparseVolume(band),
                                             SparseVolume(0.0f),
                                             SparseVolume(0.0f),
                                             SparseVolume(0.0f),
                                             SparseVolume(0.0f),
                                             {},
                                             0.0,
                                             {},
                                             {}});
  PartSamples samples;
  constexpr std::int32_t kPart = kPartSamples;
  const Coord first = floor_to(box.min, kPart), last = box.max;
  for (std::int32_t px = first.x; px <= last.x; px += kPart) {
    const double done = static_cast<double>(px - first.x) / std::max(1, last.x - first.x);
    if (keep_going && !keep_going(done)) return stopped_while("building the case");
    for (std::int32_t py = first.y; py <= last.y; py += kPart)
      for (std::int32_t pz = first.z; pz <= last.z; pz += kPart) {
        const CoordBox part{{std::max(px, box.min.x), std::max(py, box.min.y), std::max(pz, box.min.z)},
                            {std::min(px + kPart - 1, box.max.x), std::min(py + kPart - 1, box.max.y),
                             std::min(pz + kPart - 1, box.max.z)}};
        const Coord dims = part.dims();
        const std::size_t count =
            static_cast<std::size_t>(dims.x) * static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(dims.z);
        samples.surface_mm.resize(count);
        samples.density_g_cm3.resize(count);
        samples.bone.clear();
        samples.tissue.clear();
        const PartKind kind = fill(part, samples);
        if (kind == PartKind::outside) continue;
        if (kind == PartKind::inside) std::ranges::fill(samples.surface_mm, -band);
        const Coord leaf = floor_to(part.min, kLeafSize);
        for (std::int32_t x = leaf.x; x <= part.max.x; x += kLeafSize)
          for (std::int32_t y = leaf.y; y <= part.max.y; y += kLeafSize)
            for (std::int32_t z = leaf.z; z <= part.max.z; z += kLeafSize)
              if (!add_leaf(*grids, part, samples, {x, y, z}))
                return failure(ErrorCode::invalid_input,
                               "the bone's distance or density has values that are not numbers");
      }
  }
  measure(*grids);
  if (!has_inside(*grids))
    return failure(ErrorCode::invalid_input,
                   "no sample lies in bone: there is none, or it is thinner than a sample; choose a lower --threshold "
                   "or a smaller --pitch");
  find_hard_leaves(*grids);
  grids->clearance = make_clearance(grids->surface, grids->info.pitch_mm);
  grids->hash = content_hash(*grids);
  Case result;
  result.grids_ = std::move(grids);
  return result;
}

Result<Case> Case::build(CaseInfo info, const DenseVolume<float>& surface_mm, const DenseVolume<float>& density_g_cm3,
                         const SampleLabels& labels, const KeepGoing& keep_going) {
  OSTEON_CHECK(surface_mm.box == density_g_cm3.box);
  OSTEON_CHECK(labels.bone.values.empty() || labels.bone.box == surface_mm.box);
  OSTEON_CHECK(labels.tissue.values.empty() || labels.tissue.box == surface_mm.box);
  const FillPart fill = [&](const CoordBox& part, PartSamples& to) {
    copy_part(surface_mm, part, to.surface_mm);
    copy_part(density_g_cm3, part, to.density_g_cm3);
    copy_part(labels.bone, part, to.bone);
    copy_part(labels.tissue, part, to.tissue);
    return PartKind::samples;
  };
  return build(std::move(info), surface_mm.box, fill, keep_going);
}

Result<Case> Case::load(const std::filesystem::path& folder) {
  const auto file = folder / kInfoFile;
  if (std::filesystem::is_regular_file(folder))
    return bad_input(folder.string() +
                     " is a file, but a case is a folder; if it is a case file, unpack it with: osteon-import unpack " +
                     folder.string() + " --out FOLDER");
  if (!std::filesystem::is_directory(folder))
    return failure(ErrorCode::not_found,
                   "there is no case folder " + folder.string() + "; make one with osteon-import");
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    return failure(ErrorCode::invalid_input,
                   folder.string() + " is not a case: it has no " + kInfoFile + "; make one with osteon-import");
  auto described = read_description(file);
  if (!described) return tl::unexpected(described.error());
  const Digest named = described->content_hash;
  auto volumes = load_volumes(folder / kVolumeFile, kGridNames, limits_for(folder / kVolumeFile));
  if (!volumes) return tl::unexpected(volumes.error());
  auto& v = *volumes;
  auto grids = std::make_shared<Grids>(Grids{std::move(described->info),
                                             named,
                                             std::move(v[0]),
                                             std::move(v[1]),
                                             std::move(v[2]),
                                             std::move(v[3]),
                                             std::move(v[4]),
                                             {},
                                             0.0,
                                             {},
                                             {}});
  if (!has_inside(*grids))
    return bad_input((folder / kVolumeFile).string() + " is empty: no sample lies in bone; import the case again");
  if (content_hash(*grids) != named)
    return failure(ErrorCode::invalid_input, folder.string() + ": the content does not match content_hash of " +
                                                 kInfoFile + "; import the case again");
  measure(*grids);
  find_hard_leaves(*grids);
  Case result;
  result.grids_ = std::move(grids);
  return result;
}

Result<void> Case::save(const std::filesystem::path& folder, const KeepGoing& keep_going) const {
  return write(folder, nullptr, keep_going);
}

Result<void> Case::save(const std::filesystem::path& folder, const CaseScan& scan, const KeepGoing& keep_going) const {
  OSTEON_CHECK(info().scan && info().scan->geometry == scan.geometry);
  if (Result<void> known = check_labels_of(scan, info()); !known) return known;
  return write(folder, &scan, keep_going);
}

Result<void> Case::write(const std::filesystem::path& folder, const CaseScan* scan, const KeepGoing& keep_going) const {
  namespace fs = std::filesystem;
  const auto stopped = [&] { return keep_going && !keep_going(1.0); };
  if (stopped()) return failure(ErrorCode::cancelled, "stopped; nothing was written");
  std::error_code error;
  if (fs::exists(folder, error))
    return failure(ErrorCode::exists, folder.string() + " is already there; choose another name or remove it first");
  fs::path partial = folder;
  if (!partial.has_filename()) partial = partial.parent_path();
  const fs::path target = partial;
  partial += ".partial-" + std::to_string(::getpid());
  fs::create_directories(partial, error);
  if (error)
    return failure(ErrorCode::internal, "cannot make the folder " + target.string() + ": " + error.message() +
                                            "; choose a place where you may write");

  const auto write_files = [&]() -> Result<void> {
    const auto& g = *grids_;
    if (auto saved = save_volumes(partial / kVolumeFile, g.info.pitch_mm,
                                  {{"surface", &g.surface},
                                   {"density", &g.density},
                                   {"clearance", &g.clearance},
                                   {"bone", &g.bone},
                                   {"tissue", &g.tissue}});
        !saved)
      return saved;
    if (stopped()) return failure(ErrorCode::cancelled, "stopped; nothing was written");
    give_back_freed_memory();
    if (scan)
      if (auto saved = save_scan(partial / kScanFile, *scan, keep_going); !saved) return saved;
    std::ofstream out(partial / kInfoFile);
    out << to_text({g.info, g.hash});
    out.close();
    if (!out)
      return failure(ErrorCode::internal, "cannot write " + (partial / kInfoFile).string() + "; is the disk full?");
    if (stopped()) return failure(ErrorCode::cancelled, "stopped; nothing was written");
    fs::rename(partial, target, error);
    if (error)
      return failure(ErrorCode::internal,
                     "cannot rename " + partial.string() + " to " + target.string() + ": " + error.message());
    return {};
  };
  Result<void> written = write_files();
  if (!written) fs::remove_all(partial, error);
  return written;
}

const CaseInfo& Case::info() const { return grids_->info; }
const Digest& Case::hash() const { return grids_->hash; }
CoordBox Case::bounds_samples() const { return grids_->bounds; }
double Case::volume_mm3() const { return grids_->volume_mm3; }

std::size_t Case::memory_bytes() const {
  std::size_t bytes = 0;
  for (const SparseVolume* volume :
       {&grids_->surface, &grids_->density, &grids_->clearance, &grids_->bone, &grids_->tissue})
    bytes += volume->memory_bytes();
  return bytes;
}

Box Case::bounds() const {
  return {position_mm(grids_->bounds.min, pitch_mm()), position_mm(grids_->bounds.max, pitch_mm())};
}

void Case::gather_surface(const CoordBox& box, std::span<float> out) const { grids_->surface.gather(box, out); }
bool Case::view_surface(const CoordBox& box, std::span<LeafView> leaves) const {
  grids_->surface.view(box, leaves);
  return std::ranges::any_of(leaves, [](const LeafView& leaf) { return leaf.samples != nullptr; });
}
void Case::gather_density(const CoordBox& box, std::span<float> out) const { grids_->density.gather(box, out); }
double Case::surface_mm(const Vec3& point_mm) const { return grids_->surface.trilinear(point_mm / pitch_mm()); }
double Case::density_g_cm3(const Vec3& point_mm) const { return grids_->density.trilinear(point_mm / pitch_mm()); }

double Case::clearance_mm(const Vec3& point_mm) const {
  const Vec3 leaf = point_mm / (kLeafSize * pitch_mm());
  return static_cast<double>(grids_->clearance.value({static_cast<std::int32_t>(std::floor(leaf.x())),
                                                      static_cast<std::int32_t>(std::floor(leaf.y())),
                                                      static_cast<std::int32_t>(std::floor(leaf.z()))}));
}

Tissue Case::tissue(Coord sample) const { return static_cast<Tissue>(static_cast<int>(grids_->tissue.value(sample))); }
void Case::gather_hard(int level, const CoordBox& box, std::span<Tissue> out) const {
  const auto shown = [](Tissue t) { return t == Tissue::metal || t == Tissue::enamel ? t : Tissue::none; };
  const std::int32_t wide = 1 << std::abs(level), half = wide / 2;
  std::size_t i = 0;
  for (std::int32_t x = box.min.x; x <= box.max.x; ++x)
    for (std::int32_t y = box.min.y; y <= box.max.y; ++y)
      for (std::int32_t z = box.min.z; z <= box.max.z; ++z) {
        const Coord at{x, y, z};
        if (level <= 0) {
          out[i++] = shown(tissue(wide * at));
          continue;
        }
        // The corners of the cell that contains the sample, the nearest first.
        const Coord low = shift_down(at, level), part = at - wide * low;
        const Coord near{part.x > half, part.y > half, part.z > half};
        Tissue found = Tissue::none;
        std::int32_t least = std::numeric_limits<std::int32_t>::max();
        for (int corner = 0; corner < 8; ++corner) {
          const Coord step{near.x ^ (corner >> 2 & 1), near.y ^ (corner >> 1 & 1), near.z ^ (corner & 1)};
          const Coord away = part - wide * step;
          const std::int32_t distance = away.x * away.x + away.y * away.y + away.z * away.z;
          if (distance >= least) continue;
          const Tissue there = tissue(low + step);
          if (there == Tissue::none) continue;
          found = there;
          least = distance;
        }
        out[i++] = shown(found);
      }
}
const std::vector<Coord>& Case::metal_leaves() const { return grids_->metal_leaves; }
const std::vector<Coord>& Case::hard_leaves() const { return grids_->hard_leaves; }
bool Case::has_metal(const CoordBox& box) const { return meets(grids_->metal_leaves, box); }
bool Case::has_hard(const CoordBox& box) const { return meets(grids_->hard_leaves, box); }
int Case::bone_number(Coord sample) const { return static_cast<int>(grids_->bone.value(sample)); }

bool Case::has_surface(const CoordBox& box) const {
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize)
        if (grids_->surface.leaf({x, y, z})) return true;
  return false;
}

bool Case::has_bone(const CoordBox& box) const {
  const Coord first = floor_to(box.min, kLeafSize);
  for (std::int32_t x = first.x; x <= box.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= box.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= box.max.z; z += kLeafSize)
        if (grids_->surface.leaf({x, y, z}) || grids_->surface.value({x, y, z}) < 0.0f) return true;
  return false;
}

}  // namespace osteon
