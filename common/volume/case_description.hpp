// What a case says of itself: the content of its case.json.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon {

// Version of the files of new cases. Version 1 has nothing from CaseInfo::scan on. It is read too, and keeps its hash.
inline constexpr int kCaseSchemaVersion = 2;

// density (g/cm³) = intercept + slope · HU, never below zero.
struct DensityCalibration {
  double slope_g_cm3_per_hu = 0.0;
  double intercept_g_cm3 = 0.0;
  friend bool operator==(const DensityCalibration&, const DensityCalibration&) = default;
};

// Density from Hounsfield units. Rho 1995 scanned bones of eight people in water and gives one line for each bone.
// Finite element studies quote ρ = 131 + 1.067 HU kg/m³ from it as the line for cancellous bone of the proximal
// femur. [A] The quotation is not checked against the paper's tables; its abstract gives no coefficients. The abstract
// says that CT numbers predict the mechanical properties of cancellous bone (r² > 0.6), but not those of cortical
// bone (r² < 0.2). So the line is an extrapolation in cortex: a scan of 1700 HU gives 1.94 g/cm³, while compact bone
// has 1.8 to 2.1. It also knows nothing of this scanner, its kernel and its tube voltage.
inline constexpr DensityCalibration kRho1995{.slope_g_cm3_per_hu = 0.001067, .intercept_g_cm3 = 0.131};

// Where the voxels of a scan lie in the bone's frame (LPS, mm).
struct ScanGeometry {
  std::array<int, 3> dims{};                              // columns, rows, slices
  Vec3 origin_mm = Vec3::Zero();                          // centre of the first voxel
  Eigen::Matrix3d axes_mm = Eigen::Matrix3d::Identity();  // steps to the next column, row and slice; one in each column

  [[nodiscard]] std::size_t count() const;
  [[nodiscard]] Vec3 position_mm(const Vec3& voxel) const { return origin_mm + axes_mm * voxel; }
  friend bool operator==(const ScanGeometry&, const ScanGeometry&) = default;
};

// The scan of a case, see CaseScan.
struct ScanInfo {
  Digest hash;  // of its voxels
  ScanGeometry geometry;
  friend bool operator==(const ScanInfo&, const ScanInfo&) = default;
};

enum class LabelKind : std::uint8_t {
  bone,
  cortical,
  cancellous,
  metal,
  enamel,
  cartilage,
  nerve,
  vessel,
  dura,
  soft_tissue,
};
// As in case.json, such as "soft_tissue".
[[nodiscard]] std::string_view name_of(LabelKind kind);

// How a label, or the density, was made.
struct LabelProvenance {
  std::string method;                             // such as "threshold, islands"
  std::map<std::string, double> parameters = {};  // names end in the unit, such as threshold_hu
  std::vector<std::string> edits = {};            // corrections by hand, in order
  friend bool operator==(const LabelProvenance&, const LabelProvenance&) = default;
};

struct CaseLabel {
  int value = 0;  // of its voxels, 1 to 255
  std::string name;
  LabelKind kind = LabelKind::bone;
  LabelProvenance provenance = {};
  friend bool operator==(const CaseLabel&, const CaseLabel&) = default;
};

// Points and directions are in the bone's frame (LPS). Directions and normals are unit vectors.
struct Landmark {
  std::string name;
  Vec3 point_mm = Vec3::Zero();
  friend bool operator==(const Landmark&, const Landmark&) = default;
};
struct PlannedAxis {
  std::string name;
  Vec3 point_mm = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
  friend bool operator==(const PlannedAxis&, const PlannedAxis&) = default;
};
struct PlannedPlane {
  std::string name;
  Vec3 point_mm = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
  friend bool operator==(const PlannedPlane&, const PlannedPlane&) = default;
};
// All voxels of a label, or a box.
struct PlannedRegion {
  std::string name;
  int label = 0;                                      // value of one of CaseInfo::labels; 0: the box
  Vec3 min_mm = Vec3::Zero(), max_mm = Vec3::Zero();  // of the box
  friend bool operator==(const PlannedRegion&, const PlannedRegion&) = default;
};

struct CaseInfo {
  std::string title;    // shown to people; no patient identity
  std::string source;   // kind and geometry of the input, e.g. "DICOM CT, 512x512x46, 0.84x0.84x3 mm"
  double pitch_mm = 0;  // h, isotropic
  DensityCalibration calibration;
  std::optional<LabelProvenance> density_from = {};  // how the calibration and the density were found
  double threshold_hu = 0;                           // bone is at or above it; 0 if bones come from labels
  std::optional<ScanInfo> scan = {};
  std::vector<CaseLabel> labels = {};   // of the grid "labels" of the scan: what a voxel belongs to
  std::vector<CaseLabel> tissues = {};  // of its grid "tissue": what a voxel is made of
  std::vector<Landmark> landmarks = {};
  std::vector<PlannedAxis> axes = {};
  std::vector<PlannedPlane> planes = {};
  std::vector<PlannedRegion> regions = {};
  int schema_version = kCaseSchemaVersion;
  friend bool operator==(const CaseInfo&, const CaseInfo&) = default;
};

inline constexpr std::size_t kMostCaseEntries = 1000;   // of landmarks, axes, planes and regions, each
inline constexpr std::size_t kMostCaseTextBytes = 200;  // of a name, a method and an edit

// The first fault of the description, without the file's name. It is checked when a case is built and when it is read.
// Error: invalid_input, naming the field.
[[nodiscard]] Result<void> check_description(const CaseInfo& info);

// Everything that the description says, in a fixed order, for the hash of a case.
void hash_description(Hasher& hasher, const CaseInfo& info);

struct CaseDescription {
  CaseInfo info;
  Digest content_hash;
};
// The text of case.json.
[[nodiscard]] std::string to_text(const CaseDescription& description);
// Errors: invalid_input (no such file, or no description; names the file, the field and the remedy), unsupported
// (schema version).
[[nodiscard]] Result<CaseDescription> read_description(const std::filesystem::path& file);

}  // namespace osteon
