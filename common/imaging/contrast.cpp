#include "common/imaging/contrast.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

#include "common/imaging/components.hpp"
#include "common/imaging/segmentation.hpp"

namespace osteon::imaging {
namespace {

// [A] All limits are assumptions. What was measured on both sides is in decision 68.
constexpr double kCube_mm = 7.0;               // edge; cortex is thinner almost everywhere
constexpr double kStride_mm = 2.5;             // between the centres of cubes
constexpr double kBlood_hu = 50.0;             // without contrast medium
constexpr double kMostSpread = 0.15;           // standard deviation over the mean above kBlood_hu
constexpr double kLeast_hu = 100.0;            // of each voxel of a cube: above soft tissue
constexpr double kMost_hu = 700.0;             // of a cube's mean. Lell 2017: the medium adds 357 to 478 HU
constexpr double kLeastPool_cm3 = 2.0;         // of a scan
constexpr double kLeastPart_cm3 = 0.2;         // of homogeneous cubes in each part of a pool, and in further pools
constexpr double kSameLevel = 0.2;             // cubes of one pool are within this part of its level
constexpr double kMostUneven = 0.08;           // standard deviation of their means over the level above kBlood_hu
constexpr double kNoises = 4.0;                // blood is within so many standard deviations of the level
constexpr double kCore_mm = 2.0;               // blood is farther from anything else
constexpr double kAround_mm = 6.0;             // where soft tissue would be, from the core on
constexpr double kLeastTissue = 0.3;           // share of the surface with soft tissue before it
constexpr double kTissueFrom_hu = -200.0;      // fat has more
constexpr double kLeastBone_cm3 = 0.3;         // brighter than blood, in the rest of the scan
constexpr double kDeep_mm = 4.0;               // cortex is not so deep
constexpr double kUnmixedDeep = 0.2;           // share of a bright rest
constexpr double kUnmixedEdge = 0.1;           // share of its faces at contrast
constexpr double kMostAtBone = 0.35;           // share of the faces of contrast
constexpr double kEdge = 0.3, kBranch = 0.02;  // share of the faces of a dim rest
constexpr double kMostBranch_cm3 = 5.0;
constexpr double kFewBright = 0.01;                  // share of noise in a dim rest
constexpr int kPasses = 2;                           // a rest may touch another
constexpr std::uint8_t kCore = 1, kHomogeneous = 2;  // of a mask of cores

using Triple = std::array<int, 3>;

struct Cube {
  Triple centre{};
  double mean_hu = 0.0, variance = 0.0;
};

struct Pool {
  BloodPool evidence;
  std::vector<Triple> centres;
  double cube_cm3 = 0.0;  // for which a centre stands
  double low_hu = 0.0, high_hu = 0.0;
  bool is_even = false;  // all cubes have nearly one mean
};

tl::unexpected<Error> stopped_seeking() { return stopped_while("looking for contrast medium"); }

std::bitset<256> values(std::initializer_list<std::uint8_t> wanted) {
  std::bitset<256> set;
  for (const std::uint8_t value : wanted) set.set(value);
  return set;
}

// Looks at cubes all over the scan. Nearly all of them end at their first voxel.
class CubeSearch {
 public:
  CubeSearch(const HuVolume& volume, double threshold_hu, const VoxelMask& dense)
      : volume_(volume), threshold_hu_(threshold_hu), dense_(dense) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double spacing_mm = volume.spacing_mm[static_cast<int>(axis)];
      half_[axis] = std::max(1, static_cast<int>(std::lround(0.5 * (kCube_mm / spacing_mm - 1.0))));
      stride_[axis] = std::max(1, static_cast<int>(std::lround(kStride_mm / spacing_mm)));
      step_[axis] = std::max(1, (2 * half_[axis] + 1) / kVoxelsAcross);
    }
  }

  Result<std::vector<Cube>> homogeneous(const KeepGoing& keep_going) const {
    std::vector<Cube> found;
    const Triple& dims = volume_.dims;
    for (int z = half_[2]; z + half_[2] < dims[2]; z += stride_[2]) {
      if (!keep_going(static_cast<double>(z) / dims[2])) return stopped_seeking();
      for (int y = half_[1]; y + half_[1] < dims[1]; y += stride_[1])
        for (int x = half_[0]; x + half_[0] < dims[0]; x += stride_[0]) {
          if (dense_.at(x, y, z) == 0) continue;
          Cube cube{.centre = {x, y, z}};
          if (measure(cube) && is_homogeneous(cube)) found.push_back(cube);
        }
    }
    return found;
  }
  [[nodiscard]] double cube_cm3() const {
    return volume_.spacing_mm.prod() * stride_[0] * stride_[1] * stride_[2] * 1e-3;
  }

 private:
  static constexpr int kVoxelsAcross = 7;  // enough for a standard deviation, however small voxels are

  // False: a voxel is not dense.
  bool measure(Cube& cube) const {
    double sum = 0.0, squares = 0.0;
    int count = 0;
    const auto [x0, y0, z0] = cube.centre;
    for (int z = z0 - half_[2]; z <= z0 + half_[2]; z += step_[2])
      for (int y = y0 - half_[1]; y <= y0 + half_[1]; y += step_[1])
        for (int x = x0 - half_[0]; x <= x0 + half_[0]; x += step_[0]) {
          const double hu = volume_.at(x, y, z);
          if (hu < kLeast_hu) return false;
          sum += hu;
          squares += hu * hu;
          ++count;
        }
    cube.mean_hu = sum / count;
    cube.variance = std::max(0.0, squares / count - cube.mean_hu * cube.mean_hu);
    return true;
  }
  [[nodiscard]] bool is_homogeneous(const Cube& cube) const {
    return cube.mean_hu >= threshold_hu_ && cube.mean_hu <= kMost_hu &&
           std::sqrt(cube.variance) <= kMostSpread * (cube.mean_hu - kBlood_hu);
  }

  const HuVolume& volume_;
  double threshold_hu_;
  const VoxelMask& dense_;
  Triple half_{}, stride_{}, step_{};
};

// Takes out the cubes around the level at which most of them are. Nothing if they are too few.
std::optional<Pool> next_pool(std::vector<Cube>& cubes, double cube_cm3, double least_cm3, double threshold_hu) {
  constexpr double kBin_hu = 25.0;
  std::array<int, static_cast<std::size_t>(kMost_hu / kBin_hu) + 1> bins{};
  for (const Cube& cube : cubes) ++bins[static_cast<std::size_t>(cube.mean_hu / kBin_hu)];
  const double mode_hu = kBin_hu * (0.5 + static_cast<double>(std::ranges::max_element(bins) - bins.begin()));
  Pool pool;
  pool.cube_cm3 = cube_cm3;
  double sum = 0.0, squares = 0.0, variances = 0.0;
  std::erase_if(cubes, [&](const Cube& cube) {
    if (std::abs(cube.mean_hu - mode_hu) > kSameLevel * mode_hu) return false;
    pool.centres.push_back(cube.centre);
    sum += cube.mean_hu;
    squares += cube.mean_hu * cube.mean_hu;
    variances += cube.variance;
    return true;
  });
  const auto count = static_cast<double>(pool.centres.size());
  pool.evidence.homogeneous_cm3 = count * cube_cm3;
  if (pool.evidence.homogeneous_cm3 < least_cm3) return std::nullopt;
  pool.evidence.level_hu = sum / count;
  pool.evidence.noise_hu = std::sqrt(variances / count);
  const double uneven_hu = std::sqrt(std::max(0.0, squares / count - pool.evidence.level_hu * pool.evidence.level_hu));
  pool.is_even = uneven_hu <= kMostUneven * (pool.evidence.level_hu - kBlood_hu);
  const double reach_hu = kNoises * pool.evidence.noise_hu;
  pool.low_hu = std::max(threshold_hu, pool.evidence.level_hu - reach_hu);
  pool.high_hu = pool.evidence.level_hu + reach_hu;
  return pool;
}

class ContrastMarker {
 public:
  ContrastMarker(const HuVolume& volume, double metal_hu, VoxelMask& dense)
      : volume_(volume),
        metal_hu_(metal_hu),
        dense_(dense),
        core_mm_(std::max(kCore_mm, volume.spacing_mm.maxCoeff())),
        voxel_cm3_(volume.spacing_mm.prod() * 1e-3) {}

  // Marks the pool if it is blood. The first one that is stands for the scan. Error: cancelled.
  Result<void> mark(Pool pool, const KeepGoing& keep_going) {
    std::swap(pool_, pool);
    const auto any = mark_pool(keep_going);
    if (!any) return tl::unexpected(any.error());
    if (!*any || found_) std::swap(pool_, pool);
    found_ = found_ || *any;
    return {};
  }

  [[nodiscard]] bool has_found() const { return found_; }

  // Adds what belongs to the pools. Nothing: there is none, and the mask is as before. Error: cancelled.
  Result<std::optional<BloodPool>> finish(const KeepGoing& keep_going) {
    if (!found_) return std::optional<BloodPool>();
    if (auto added = add_rest(part(keep_going, 0.0, 0.8)); !added) return tl::unexpected(added.error());
    if (auto given = give_back_enclosed(part(keep_going, 0.8, 1.0)); !given) return tl::unexpected(given.error());
    const auto marked = std::ranges::count(dense_.values, mask_value(BoneVoxel::contrast));
    pool_.evidence.contrast_cm3 = static_cast<double>(marked) * voxel_cm3_;
    if (marked > 0 && brighter_bone_cm3() >= kLeastBone_cm3) return std::optional(pool_.evidence);
    std::ranges::replace(dense_.values, mask_value(BoneVoxel::contrast), mask_value(BoneVoxel::dense));
    return std::optional<BloodPool>();
  }

 private:
  [[nodiscard]] bool is_marked(const Triple& at) const {
    return dense_.at(at[0], at[1], at[2]) == mask_value(BoneVoxel::contrast);
  }
  [[nodiscard]] double hu(const Triple& at) const { return volume_.at(at[0], at[1], at[2]); }
  [[nodiscard]] bool contains(const Triple& at) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (at[axis] < 0 || at[axis] >= volume_.dims[axis]) return false;
    return true;
  }

  // 1 for voxels that are farther than `depth_mm` from every voxel outside of `inside`.
  template <class Inside>
  Result<VoxelMask> deep_in(Inside inside, double depth_mm, const KeepGoing& keep_going) const {
    VoxelMask outside(volume_.dims);
    for (std::size_t i = 0; i < outside.values.size(); ++i) outside.values[i] = inside(i) ? 0 : 1;
    auto near = within_mm(outside, volume_.spacing_mm, depth_mm, keep_going);
    if (near)
      for (std::uint8_t& value : near->values) value = value == 0 ? 1 : 0;
    return near;
  }

  // What has the level of blood and lies in soft tissue.
  Result<bool> mark_pool(const KeepGoing& keep_going) {
    auto cores = deep_in(
        [&](std::size_t i) {
          return dense_.values[i] != 0 && volume_.values[i] >= pool_.low_hu && volume_.values[i] <= pool_.high_hu;
        },
        core_mm_, part(keep_going, 0.0, 0.4));
    if (!cores) return tl::unexpected(cores.error());
    for (const auto& [x, y, z] : pool_.centres)
      if (cores->at(x, y, z) != 0) cores->at(x, y, z) = kHomogeneous;
    const auto pieces =
        find_components(*cores, values({kCore, kHomogeneous}), Connectivity::corners, part(keep_going, 0.4, 0.5));
    if (!pieces) return tl::unexpected(pieces.error());
    const auto are_blood = blood_pieces(*cores, *pieces, part(keep_going, 0.5, 0.6));
    if (!are_blood) return tl::unexpected(are_blood.error());
    bool any = false;
    for (const VoxelRun& run : pieces->runs) {
      fill_run(*cores, run, (*are_blood)[run.component] ? 1 : 0);
      any = any || (*are_blood)[run.component];
    }
    if (!any) return false;
    // The edge of a vessel is blurred, so a voxel more than the core was far from it.
    const auto around =
        within_mm(*cores, volume_.spacing_mm, core_mm_ + volume_.spacing_mm.maxCoeff(), part(keep_going, 0.6, 1.0));
    if (!around) return tl::unexpected(around.error());
    for (std::size_t i = 0; i < dense_.values.size(); ++i)
      if (around->values[i] != 0 && dense_.values[i] != 0 && volume_.values[i] <= pool_.high_hu)
        dense_.values[i] = mask_value(BoneVoxel::contrast);
    return true;
  }

  // What lies before the faces of a piece.
  struct Surroundings {
    std::int64_t homogeneous = 0, faces = 0, tissue = 0;
  };

  Result<std::vector<bool>> blood_pieces(const VoxelMask& cores, const Components& pieces,
                                         const KeepGoing& keep_going) const {
    std::vector<Surroundings> all(pieces.count);
    for (const VoxelRun& run : pieces.runs)
      for (int x = run.first; x <= run.last; ++x)
        all[run.component].homogeneous += cores.at(x, run.row, run.slice) == kHomogeneous ? 1 : 0;
    const auto is_large = [&](std::size_t piece) {
      return static_cast<double>(all[piece].homogeneous) * pool_.cube_cm3 >= kLeastPart_cm3;
    };
    int slice = -1;
    for (const VoxelRun& run : pieces.runs) {
      if (run.slice != slice && !keep_going(static_cast<double>(slice = run.slice) / volume_.dims[2]))
        return stopped_seeking();
      if (is_large(run.component)) look_around(cores, run, all[run.component]);
    }
    std::vector<bool> blood(pieces.count, false);
    for (std::size_t i = 0; i < blood.size(); ++i) {
      blood[i] = is_large(i) && static_cast<double>(all[i].tissue) >= kLeastTissue * static_cast<double>(all[i].faces);
    }
    return blood;
  }
  void look_around(const VoxelMask& cores, const VoxelRun& run, Surroundings& seen) const {
    for (int x = run.first; x <= run.last; ++x)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int side : {-1, 1}) {
          Triple at{x, run.row, run.slice};
          at[axis] += side;
          if (contains(at) && cores.at(at[0], at[1], at[2]) == 0) look_along(at, axis, side, seen);
        }
  }
  void look_along(Triple at, std::size_t axis, int side, Surroundings& seen) const {
    const int steps = static_cast<int>(std::ceil(kAround_mm / volume_.spacing_mm[static_cast<int>(axis)]));
    bool tissue = false;
    for (int i = 0; i < steps; ++i, at[axis] += side) {
      if (!contains(at)) return;  // nobody knows what follows
      tissue = tissue || (hu(at) >= kTissueFrom_hu && hu(at) < pool_.low_hu);
    }
    ++seen.faces;
    seen.tissue += tissue ? 1 : 0;
  }

  // A part of the dense voxels that are not marked.
  struct Rest {
    std::int64_t voxels = 0, surface = 0, touching = 0, deep = 0, bright = 0;
    double deep_hu = 0.0;  // sum
  };

  // Blood that is not mixed yet, thin vessels, and blurred edges.
  Result<void> add_rest(const KeepGoing& keep_going) {
    const auto deep =
        deep_in([&](std::size_t i) { return dense_.values[i] != 0; }, kDeep_mm, part(keep_going, 0.0, 0.5));
    if (!deep) return tl::unexpected(deep.error());
    for (int pass = 0; pass < kPasses; ++pass) {
      const KeepGoing passing = part(keep_going, 0.5 + 0.25 * pass, 0.75 + 0.25 * pass);
      const auto pieces = find_components(dense_, values({mask_value(BoneVoxel::dense)}), Connectivity::corners,
                                          part(passing, 0.0, 0.5));
      if (!pieces) return tl::unexpected(pieces.error());
      const auto rests = measure_rests(*pieces, *deep, part(passing, 0.5, 1.0));
      if (!rests) return tl::unexpected(rests.error());
      std::vector<bool> belongs;
      for (const Rest& rest : *rests) belongs.push_back(is_contrast(rest));
      for (const VoxelRun& run : pieces->runs)
        if (belongs[run.component]) fill_run(dense_, run, mask_value(BoneVoxel::contrast));
    }
    return {};
  }
  // Blood lies in soft tissue. What bone encloses is cancellous bone.
  Result<void> give_back_enclosed(const KeepGoing& keep_going) {
    const auto pieces = find_components(dense_, values({mask_value(BoneVoxel::contrast)}), Connectivity::corners,
                                        part(keep_going, 0.0, 0.5));
    if (!pieces) return tl::unexpected(pieces.error());
    std::vector<std::int64_t> faces(pieces->count, 0), at_bone(pieces->count, 0);
    int slice = -1;
    for (const VoxelRun& run : pieces->runs) {
      if (run.slice != slice && !keep_going(0.5 + 0.5 * (slice = run.slice) / volume_.dims[2]))
        return stopped_seeking();
      for (int x = run.first; x <= run.last; ++x)
        each_beside({x, run.row, run.slice}, [&](std::uint8_t value) {
          faces[run.component] += value != mask_value(BoneVoxel::contrast) ? 1 : 0;
          at_bone[run.component] += value == mask_value(BoneVoxel::dense) ? 1 : 0;
        });
    }
    for (const VoxelRun& run : pieces->runs)
      if (static_cast<double>(at_bone[run.component]) > kMostAtBone * static_cast<double>(faces[run.component]))
        fill_run(dense_, run, mask_value(BoneVoxel::dense));
    return {};
  }
  Result<std::vector<Rest>> measure_rests(const Components& pieces, const VoxelMask& deep,
                                          const KeepGoing& keep_going) const {
    std::vector<Rest> rests(pieces.count);
    int slice = -1;
    for (const VoxelRun& run : pieces.runs) {
      if (run.slice != slice && !keep_going(static_cast<double>(slice = run.slice) / volume_.dims[2]))
        return stopped_seeking();
      Rest& rest = rests[run.component];
      for (int x = run.first; x <= run.last; ++x) {
        const Triple at{x, run.row, run.slice};
        ++rest.voxels;
        each_beside(at, [&](std::uint8_t value) {
          rest.surface += value != mask_value(BoneVoxel::dense) ? 1 : 0;
          rest.touching += value == mask_value(BoneVoxel::contrast) ? 1 : 0;
        });
        rest.bright += hu(at) > pool_.high_hu ? 1 : 0;
        if (deep.at(x, run.row, run.slice) == 0) continue;
        ++rest.deep;
        rest.deep_hu += hu(at);
      }
    }
    return rests;
  }
  // Calls `visit` with what lies on the other side of each face of a voxel.
  template <class Visit>
  void each_beside(const Triple& at, Visit visit) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1}) {
        Triple beside = at;
        beside[axis] += side;
        if (contains(beside)) visit(dense_.at(beside[0], beside[1], beside[2]));
      }
  }
  [[nodiscard]] bool is_contrast(const Rest& rest) const {
    const auto all = static_cast<double>(rest.voxels);
    const double touching =
        rest.surface > 0 ? static_cast<double>(rest.touching) / static_cast<double>(rest.surface) : 0.0;
    if (static_cast<double>(rest.bright) <= kFewBright * all)
      return touching >= kEdge || (touching >= kBranch && all * voxel_cm3_ <= kMostBranch_cm3);
    const auto deep = static_cast<double>(rest.deep);
    return touching >= kUnmixedEdge && deep >= kUnmixedDeep * all && rest.deep_hu >= pool_.evidence.level_hu * deep;
  }

  [[nodiscard]] double brighter_bone_cm3() const {
    std::int64_t brighter = 0;
    for (std::size_t i = 0; i < dense_.values.size(); ++i)
      brighter += dense_.values[i] == mask_value(BoneVoxel::dense) && volume_.values[i] > pool_.high_hu &&
                          volume_.values[i] < metal_hu_
                      ? 1
                      : 0;
    return static_cast<double>(brighter) * voxel_cm3_;
  }

  const HuVolume& volume_;
  double metal_hu_;
  VoxelMask& dense_;
  double core_mm_, voxel_cm3_;
  Pool pool_;
  bool found_ = false;  // pool_ is blood
};

}  // namespace

Result<std::optional<BloodPool>> mark_contrast(const HuVolume& volume, double threshold_hu, double metal_hu,
                                               VoxelMask& dense, const KeepGoing& keep_going) {
  const CubeSearch search(volume, threshold_hu, dense);
  auto cubes = search.homogeneous(part(keep_going, 0.0, 0.2));
  if (!cubes) return tl::unexpected(cubes.error());
  ContrastMarker marker(volume, metal_hu, dense);
  // Arteries, veins and a false lumen may have levels of their own. Nobody knows how many, so each gets half of the
  // rest of the progress.
  double done = 0.2;
  while (auto pool =
             next_pool(*cubes, search.cube_cm3(), marker.has_found() ? kLeastPart_cm3 : kLeastPool_cm3, threshold_hu)) {
    if (!pool->is_even) continue;
    const double then = 0.5 * (done + 0.6);
    if (auto marked = marker.mark(std::move(*pool), part(keep_going, done, then)); !marked)
      return tl::unexpected(marked.error());
    done = then;
    std::erase_if(*cubes, [&](const Cube& cube) {
      return dense.at(cube.centre[0], cube.centre[1], cube.centre[2]) == mask_value(BoneVoxel::contrast);
    });
  }
  return marker.finish(part(keep_going, 0.6, 1.0));
}

}  // namespace osteon::imaging
