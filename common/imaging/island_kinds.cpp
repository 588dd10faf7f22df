#include "common/imaging/island_kinds.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/imaging/segmentation.hpp"

namespace osteon::imaging {
namespace {

// [A] All limits are assumptions. Each is far from what was measured on both sides, see decision 65.
constexpr double kTissue_hu = -300.0;      // tissue has more; air, lung and foam have less
constexpr double kOpenAir_hu = -930.0;     // air around a patient has less on average; lung has more
constexpr double kBeside_mm = 2.0;         // the skin over a bone is thicker
constexpr double kLastAir_mm = 5.0;        // of a line of sight that leaves the scan
constexpr double kBody_mm = 10.0;          // so much tissue ends a line of sight; a table's sheets do not
constexpr double kMostInSoftTissue = 0.5;  // at_air of bone in a patient
constexpr double kLeastExposed = 0.2;      // of a table or a cast
constexpr double kMostThick_mm = 6.0;      // of a table or a cast
constexpr double kLeastLong = 15.0;        // length of a table over its thickness
constexpr double kLeastPatient = 0.05;     // volume of bone in soft tissue over that of a table or a cast
constexpr double kLeastSurrounded = 0.5;   // share of the bone within a cast's box that it surrounds
constexpr double kMostlyMetal = 0.5, kSomeMetal = 0.1, kNearMetal = 0.9;
constexpr int kMetalBlur_voxels = 1;
constexpr std::int64_t kMostLines = 20000;  // of sight, for one island
constexpr std::size_t kMostSamples = 500;   // voxels of bone that a cast may surround

using Voxel = std::array<int, 3>;

bool contains(const Voxel& dims, const Voxel& at) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (at[axis] < 0 || at[axis] >= dims[axis]) return false;
  return true;
}

Voxel moved(Voxel at, const Voxel& step, int count) {
  for (std::size_t axis = 0; axis < 3; ++axis) at[axis] += count * step[axis];
  return at;
}

class IslandNamer {
 public:
  IslandNamer(const HuVolume& volume, const VoxelMask& bone, const Islands& islands, double metal_hu)
      : volume_(volume), bone_(bone), islands_(islands), metal_hu_(metal_hu), runs_(islands.list.size()) {
    for (const VoxelRun& run : islands.components.runs)
      runs_[static_cast<std::size_t>(islands.number[run.component] - 1)].push_back(&run);
  }

  Result<std::vector<IslandNature>> name(const KeepGoing& keep_going) {
    std::vector<IslandNature> natures;
    for (std::size_t i = 0; i < runs_.size(); ++i) {
      if (!keep_going(0.5 * static_cast<double>(i) / static_cast<double>(runs_.size())))
        return stopped_while("naming the islands");
      natures.push_back(measured(i));
    }
    in_soft_tissue_cm3_ = find_patient(natures);
    for (std::size_t i = 0; i < natures.size(); ++i) {
      if (!keep_going(0.5 + 0.5 * static_cast<double>(i) / static_cast<double>(natures.size())))
        return stopped_while("naming the islands");
      if (!may_be_equipment(i, natures[i])) continue;
      natures[i].exposed = exposed(i, natures[i]);
      if (natures[i].exposed < kLeastExposed) continue;
      if (surrounds_bone(i))
        natures[i].kind = IslandKind::cast;
      else if (length_mm(i) >= kLeastLong * natures[i].thickness_mm)
        natures[i].kind = IslandKind::table;
    }
    return natures;
  }

 private:
  [[nodiscard]] double hu(const Voxel& at) const { return volume_.at(at[0], at[1], at[2]); }
  [[nodiscard]] bool is_bone(const Voxel& at) const { return bone_.at(at[0], at[1], at[2]) != 0; }

  // Calls visit(voxel, axis, step) for each face of a voxel of the island that has no bone on its other side.
  template <class Visit>
  void each_face(std::size_t island, Visit visit) const {
    for (const VoxelRun* run : runs_[island])
      for (int column = run->first; column <= run->last; ++column)
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (const int side : {-1, 1}) {
            Voxel step{};
            step[axis] = side;
            const Voxel at{column, run->row, run->slice}, beside = moved(at, step, 1);
            if (contains(bone_.dims, beside) && !is_bone(beside)) visit(at, axis, step);
          }
  }

  [[nodiscard]] bool has_air_beside(const Voxel& at, std::size_t axis, const Voxel& step) const {
    const int reach = std::max(1, static_cast<int>(kBeside_mm / volume_.spacing_mm[static_cast<int>(axis)] + 1e-6));
    for (int i = 1; i <= reach; ++i) {
      const Voxel beside = moved(at, step, i);
      if (!contains(bone_.dims, beside) || is_bone(beside)) return false;
      if (hu(beside) < kTissue_hu) return true;
    }
    return false;
  }

  // Whether a line from the voxel's face leaves the scan through open air, and no body is in its way.
  [[nodiscard]] bool sees_outside(const Voxel& at, std::size_t axis, const Voxel& step) const {
    const double spacing_mm = volume_.spacing_mm[static_cast<int>(axis)];
    double tissue_mm = 0.0;
    int length = 1;
    for (Voxel along = moved(at, step, 1); contains(bone_.dims, along); along = moved(at, step, ++length)) {
      if (hu(along) < kTissue_hu) continue;
      tissue_mm += spacing_mm;
      if (tissue_mm >= kBody_mm) return false;
    }
    const int last = std::min(length - 1, static_cast<int>(std::ceil(kLastAir_mm / spacing_mm)));
    double sum = 0.0;
    for (int i = length - last; i < length; ++i) sum += hu(moved(at, step, i));
    return sum < kOpenAir_hu * last;
  }

  // The facts that do not depend on other islands, and whether it is metal.
  [[nodiscard]] IslandNature measured(std::size_t island) const {
    IslandNature nature;
    std::int64_t metal = 0;
    for (const VoxelRun* run : runs_[island])
      for (int column = run->first; column <= run->last; ++column)
        metal += hu({column, run->row, run->slice}) >= metal_hu_ ? 1 : 0;
    double surface_mm2 = 0.0, at_air_mm2 = 0.0;
    const double volume_mm3 = volume_.spacing_mm.prod();
    each_face(island, [&](const Voxel& at, std::size_t axis, const Voxel& step) {
      const double area_mm2 = volume_mm3 / volume_.spacing_mm[static_cast<int>(axis)];
      surface_mm2 += area_mm2;
      if (has_air_beside(at, axis, step)) at_air_mm2 += area_mm2;
    });
    const auto voxels = static_cast<double>(islands_.list[island].voxels);
    nature.metal = static_cast<double>(metal) / voxels;
    if (surface_mm2 > 0.0) {
      nature.at_air = at_air_mm2 / surface_mm2;
      nature.thickness_mm = 2.0 * voxels * volume_mm3 / surface_mm2;
    }
    if (is_contrast(island))
      nature.kind = IslandKind::contrast;
    else if (nature.metal >= kMostlyMetal || (nature.metal >= kSomeMetal && near_metal(island) >= kNearMetal))
      nature.kind = IslandKind::metal;
    return nature;
  }

  // All voxels of an island are, or none is.
  [[nodiscard]] bool is_contrast(std::size_t island) const {
    const VoxelRun& run = *runs_[island].front();
    return bone_.at(run.first, run.row, run.slice) == mask_value(BoneVoxel::contrast);
  }

  // Share of voxels that may be metal's blurred edge, or are metal.
  [[nodiscard]] double near_metal(std::size_t island) const {
    std::int64_t near = 0;
    for (const VoxelRun* run : runs_[island])
      for (int column = run->first; column <= run->last; ++column) near += is_near_metal(column, *run) ? 1 : 0;
    return static_cast<double>(near) / static_cast<double>(islands_.list[island].voxels);
  }
  [[nodiscard]] bool is_near_metal(int column, const VoxelRun& run) const {
    constexpr int kReach = kMetalBlur_voxels;
    for (int z = std::max(0, run.slice - kReach); z <= std::min(bone_.dims[2] - 1, run.slice + kReach); ++z)
      for (int y = std::max(0, run.row - kReach); y <= std::min(bone_.dims[1] - 1, run.row + kReach); ++y)
        for (int x = std::max(0, column - kReach); x <= std::min(bone_.dims[0] - 1, column + kReach); ++x)
          if (hu({x, y, z}) >= metal_hu_) return true;
    return false;
  }

  // The volume of bone that lies in soft tissue. Takes samples of it.
  [[nodiscard]] double find_patient(const std::vector<IslandNature>& natures) {
    const auto lies_in_it = [&](std::size_t i) {
      return natures[i].kind == IslandKind::bone && natures[i].thickness_mm > 0.0 &&
             natures[i].at_air <= kMostInSoftTissue;
    };
    double volume_cm3 = 0.0;
    std::size_t runs = 0;
    for (std::size_t i = 0; i < natures.size(); ++i) {
      if (!lies_in_it(i)) continue;
      volume_cm3 += islands_.list[i].volume_cm3;
      runs += runs_[i].size();
    }
    const std::size_t every = runs / kMostSamples + 1;
    std::size_t passed = 0;
    for (std::size_t i = 0; i < natures.size(); ++i) {
      if (!lies_in_it(i)) continue;
      for (const VoxelRun* run : runs_[i])
        if (passed++ % every == 0) samples_.push_back({i, {(run->first + run->last) / 2, run->row, run->slice}});
    }
    return volume_cm3;
  }

  // The rest of a patient's bone must be there to say that an island is none of it.
  [[nodiscard]] bool may_be_equipment(std::size_t island, const IslandNature& nature) const {
    if (nature.kind != IslandKind::bone || nature.at_air < kLeastExposed || nature.thickness_mm > kMostThick_mm)
      return false;
    const double volume_cm3 = islands_.list[island].volume_cm3;
    const double others_cm3 = in_soft_tissue_cm3_ - (nature.at_air <= kMostInSoftTissue ? volume_cm3 : 0.0);
    return others_cm3 >= kLeastPatient * volume_cm3;
  }

  // Share of the surface from which one sees outside. Follows some of the lines only if there are very many.
  [[nodiscard]] double exposed(std::size_t island, const IslandNature& nature) const {
    std::int64_t at_air = 0;
    each_face(island, [&](const Voxel& at, std::size_t axis, const Voxel& step) {
      at_air += has_air_beside(at, axis, step) ? 1 : 0;
    });
    const std::int64_t every = at_air / kMostLines + 1;
    std::int64_t passed = 0;
    double all_mm2 = 0.0, seen_mm2 = 0.0;
    each_face(island, [&](const Voxel& at, std::size_t axis, const Voxel& step) {
      if (!has_air_beside(at, axis, step) || passed++ % every != 0) return;
      const double area_mm2 = volume_.spacing_mm.prod() / volume_.spacing_mm[static_cast<int>(axis)];
      all_mm2 += area_mm2;
      if (sees_outside(at, axis, step)) seen_mm2 += area_mm2;
    });
    return all_mm2 > 0.0 ? nature.at_air * seen_mm2 / all_mm2 : 0.0;
  }

  [[nodiscard]] double length_mm(std::size_t island) const {
    const Island& of = islands_.list[island];
    double longest_mm = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      longest_mm =
          std::max(longest_mm, (of.last[axis] - of.first[axis] + 1) * volume_.spacing_mm[static_cast<int>(axis)]);
    return longest_mm;
  }

  // Whether most samples of bone within the island's box have it around them.
  [[nodiscard]] bool surrounds_bone(std::size_t island) {
    const Island& of = islands_.list[island];
    const VoxelBox box{of.first, of.last};
    std::vector<Voxel> inside;
    for (const auto& [owner, at] : samples_)
      if (owner != island && box.contains({at, at})) inside.push_back(at);
    if (inside.empty()) return false;
    if (shell_.values.empty()) shell_ = VoxelMask(bone_.dims);
    for (const VoxelRun* run : runs_[island]) fill_run(shell_, *run, 1);
    const auto surrounded = std::ranges::count_if(inside, [&](const Voxel& at) { return shell_lies_around(at); });
    for (const VoxelRun* run : runs_[island]) fill_run(shell_, *run, 0);
    return static_cast<double>(surrounded) >= kLeastSurrounded * static_cast<double>(inside.size());
  }

  // Whether the shell lies in all eight directions of one of the planes of voxels. A headrest is open on one side.
  [[nodiscard]] bool shell_lies_around(const Voxel& at) const {
    for (std::size_t u = 0; u < 3; ++u) {
      const std::size_t v = (u + 1) % 3;
      bool all = true;
      for (int i = 0; i < 9 && all; ++i) {
        if (i == 4) continue;
        Voxel step{};
        step[u] = i % 3 - 1;
        step[v] = i / 3 - 1;
        all = meets_shell(at, step);
      }
      if (all) return true;
    }
    return false;
  }
  [[nodiscard]] bool meets_shell(Voxel at, const Voxel& step) const {
    for (; contains(bone_.dims, at); at = moved(at, step, 1))
      if (shell_.at(at[0], at[1], at[2]) != 0) return true;
    return false;
  }

  struct Sample {
    std::size_t island;
    Voxel at;
  };

  const HuVolume& volume_;
  const VoxelMask& bone_;
  const Islands& islands_;
  double metal_hu_;
  std::vector<std::vector<const VoxelRun*>> runs_;  // of each island
  double in_soft_tissue_cm3_ = 0.0;
  std::vector<Sample> samples_;  // of bone in soft tissue
  VoxelMask shell_;              // 1 for the island that may be a cast
};

}  // namespace

std::string_view name_of(IslandKind kind) {
  switch (kind) {
    case IslandKind::table:
      return "table";
    case IslandKind::cast:
      return "cast";
    case IslandKind::metal:
      return "metal";
    case IslandKind::contrast:
      return "contrast";
    case IslandKind::bone:
      break;
  }
  return "bone";
}

Result<std::vector<IslandNature>> name_islands(const HuVolume& volume, const VoxelMask& bone, const Islands& islands,
                                               double metal_hu, const KeepGoing& keep_going) {
  return IslandNamer(volume, bone, islands, metal_hu).name(keep_going);
}

}  // namespace osteon::imaging
