// A case: the imported bone, which never changes. It is a folder with case.json, bone.vdb and, if it comes from a scan,
// scan.vdb. It is named by the hash of its content. case.json contains the hash of the scan, so the first two files can
// be verified without the third.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/field/tissue.hpp"
#include "common/volume/block_gather.hpp"
#include "common/volume/case_description.hpp"
#include "common/volume/dense_volume.hpp"
#include "common/volume/iso_surface.hpp"

namespace osteon {

struct CaseScan;

// What an importer knows about the samples beside distance and density. Each volume is empty or covers the same box as
// the distance.
struct SampleLabels {
  // Number of the bone, from 1; used only for samples inside the surface. Empty: all samples are bone 1.
  DenseVolume<std::uint8_t> bone;
  DenseVolume<Tissue> tissue;  // metal, enamel, or none (the density decides). Empty: none everywhere.
};

// What a part of a bone contains, so that a builder need not read every sample of a uniform part.
enum class PartKind {
  samples,  // distance and density are filled
  outside,  // no sample within the band of 4 voxels around the bone: nothing is read
  inside,   // every sample is bone, deeper than the band: the distance is not read
};
// Samples of a part, z fastest.
struct PartSamples {
  std::vector<float> surface_mm;  // signed distance; outside the band only the sign matters
  std::vector<float> density_g_cm3;
  std::vector<std::uint8_t> bone;  // as SampleLabels; empty unless filled
  std::vector<Tissue> tissue;      // the same
};
// Fills the samples of a box. Distance and density have one value for each sample of the box; the labels are empty.
// Called once for each part, always in the same order, by one thread.
using FillPart = std::function<PartKind(const CoordBox& box, PartSamples& samples)>;

// Read-only after construction, so any thread may read it at any time.
class Case {
 public:
  // Builds from the signed distance to the bone surface (mm, negative inside) and the density (g/cm³), both over the
  // same box. The distance matters only in the band of 4 voxels; outside it, only its sign.
  [[nodiscard]] static Result<Case> build(CaseInfo info, const DenseVolume<float>& surface_mm,
                                          const DenseVolume<float>& density_g_cm3, const SampleLabels& labels = {},
                                          const KeepGoing& keep_going = {});
  // The same from parts of at most kPartSamples³, for large bones: the whole is never in memory. A leaf with one
  // density is stored as one number. `keep_going` is called between parts. If it returns false, the error is cancelled.
  static constexpr std::int32_t kPartSamples = 64;
  [[nodiscard]] static Result<Case> build(CaseInfo info, const CoordBox& box, const FillPart& fill,
                                          const KeepGoing& keep_going = {});
  // Does not read the scan, see load_scan(). Errors: not_found (no such folder), invalid_input (no or broken case.json
  // / bone.vdb, or content that does not match its hash), unsupported (schema version), exhausted (more memory than a
  // file of its size may need).
  [[nodiscard]] static Result<Case> load(const std::filesystem::path& folder);
  // Writes beside `folder` and renames, so that a partly written case is never visible. `keep_going` is called before
  // the renaming, too. Errors: exists, internal (disk), cancelled.
  [[nodiscard]] Result<void> save(const std::filesystem::path& folder, const KeepGoing& keep_going = {}) const;
  // The same with its scan, which describe_scan() has described for info(). Error invalid_input too: the scan has
  // labels that info() does not list.
  [[nodiscard]] Result<void> save(const std::filesystem::path& folder, const CaseScan& scan,
                                  const KeepGoing& keep_going = {}) const;

  [[nodiscard]] const CaseInfo& info() const;
  [[nodiscard]] const Digest& hash() const;
  [[nodiscard]] double pitch_mm() const { return info().pitch_mm; }
  [[nodiscard]] Box bounds() const;                // of the bone's surface band, mm
  [[nodiscard]] CoordBox bounds_samples() const;   // the same in samples of level 0
  [[nodiscard]] double volume_mm3() const;         // of the bone
  [[nodiscard]] std::size_t memory_bytes() const;  // of the grids' samples

  // Samples of level 0, z fastest. Signed distance S clipped to ±4 h, and density.
  void gather_surface(const CoordBox& box, std::span<float> out) const;
  // The leaves of S that meet the box, x slowest. False if all their samples are on one side, outside the band.
  bool view_surface(const CoordBox& box, std::span<LeafView> leaves) const;
  void gather_density(const CoordBox& box, std::span<float> out) const;
  // Trilinear, at any point of the bone frame.
  [[nodiscard]] double surface_mm(const Vec3& point_mm) const;
  [[nodiscard]] double density_g_cm3(const Vec3& point_mm) const;
  // A lower bound of the distance to the bone, mm. Zero in the bone and near it.
  [[nodiscard]] double clearance_mm(const Vec3& point_mm) const;
  [[nodiscard]] Tissue tissue(Coord sample) const;
  // Origins of the leaves that contain metal, and of those that contain metal or enamel. Sorted, and empty for most
  // cases.
  [[nodiscard]] const std::vector<Coord>& metal_leaves() const;
  [[nodiscard]] const std::vector<Coord>& hard_leaves() const;
  // On the samples of a level: metal, enamel or none, taken from the nearest bone sample of level 0. z fastest.
  void gather_hard(int level, const CoordBox& box, std::span<Tissue> out) const;
  // Number of the bone that the sample belongs to, from 1; 0: no bone.
  [[nodiscard]] int bone_number(Coord sample) const;
  // Whether any sample of level 0 in the box is within the band of the surface. If none is, all are on one side of it.
  [[nodiscard]] bool has_surface(const CoordBox& box) const;
  // Whether any sample of level 0 in the box is bone or in the band around it.
  [[nodiscard]] bool has_bone(const CoordBox& box) const;
  // Whether any leaf of level 0 that the box meets contains metal, or metal or enamel.
  [[nodiscard]] bool has_metal(const CoordBox& box) const;
  [[nodiscard]] bool has_hard(const CoordBox& box) const;

  struct Grids;

 private:
  Case() = default;
  [[nodiscard]] Result<void> write(const std::filesystem::path& folder, const CaseScan* scan,
                                   const KeepGoing& keep_going) const;
  std::shared_ptr<const Grids> grids_;  // shared by copies of one case: immutable
};

}  // namespace osteon
