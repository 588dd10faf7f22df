// A bone of known shape, tissue and density: a closed form of its parameters. Each kind of bone is one pair of files.
#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/case_description.hpp"

namespace osteon::phantoms {

enum class Side { left, right };

// A parameter of a bone. Its name ends in the unit, such as head_diameter_mm; without a unit it is a fraction.
struct NamedValue {
  std::string name;
  double value = 0.0;
  double least = 0.0, most = 0.0;  // outside of these no such bone exists
};

// What a person chooses. deploy/docs/phantoms.md lists presets, conditions and parameters.
struct BoneRecipe {
  std::string kind = "femur";
  Side side = Side::left;
  std::string preset = "male";                 // female, male, small, large
  std::string condition = "adult";             // young, adult, osteoporotic
  std::map<std::string, double> changes = {};  // of the preset's parameters, by name
};

// Tissue at a point. Marrow fills the medullary canal.
enum class BoneTissue { none, cortical, cancellous, marrow };

// Where a point lies in a bone. Each is the distance to a face, mm, negative beyond it: exact on the face, and close to
// the Euclidean distance beside it.
struct BoneDepths {
  double surface_mm = 0.0;  // the outer face of cortex, negative in bone
  double cortex_mm = 0.0;   // the inner face of cortex, negative in cancellous bone and marrow
  double marrow_mm = 0.0;   // the end of marrow, negative in the canal
  int bone = 1;             // number of the nearest bone, from 1
};
// How fast BoneDepths::surface_mm grows at most beside the surface, mm per mm. Everywhere, the surface is at least as
// far as surface_mm says, divided by this.
inline constexpr double kSteepest = 2.6;

[[nodiscard]] BoneTissue tissue_of(const BoneDepths& depths);

struct BoneAnatomy {
  std::vector<Landmark> landmarks;
  std::vector<PlannedAxis> axes;
  std::vector<PlannedPlane> planes = {};
};

// What lies beside bone: cartilage, where a ligament begins, a vessel or a nerve. A closed form, too.
struct Structure {
  std::string name;
  LabelKind kind = LabelKind::soft_tissue;
  double hu = 0.0;
  Box bounds;                                            // contains it
  std::function<double(const Vec3& at_mm)> distance_mm;  // to its surface, mm, negative inside; near it to first order
  std::vector<Vec3> line_mm = {};                        // the middle of a vessel or nerve, from its proximal end
};

// Contains a bone's bounds and those of its structures.
[[nodiscard]] Box with_structures(Box bounds, std::span<const Structure> structures);

// Immutable, so any thread may read it. The frame is LPS in millimetres; each kind says where its origin lies.
class PhantomBone {
 public:
  virtual ~PhantomBone() = default;

  [[nodiscard]] virtual std::vector<std::string> names() const = 0;  // of bone 1, 2, …
  [[nodiscard]] virtual std::vector<NamedValue> parameters() const = 0;
  [[nodiscard]] virtual BoneAnatomy anatomy() const = 0;
  [[nodiscard]] virtual Box bounds() const = 0;  // contains the bone
  [[nodiscard]] virtual BoneDepths depths(const Vec3& at_mm) const = 0;
  // Density, g/cm³: that of cancellous bone at a point, and those of the other tissues of a bone by its number.
  [[nodiscard]] virtual double cancellous_g_cm3(const Vec3& at_mm) const = 0;
  [[nodiscard]] virtual double cortical_g_cm3(int bone) const = 0;
  [[nodiscard]] virtual double marrow_g_cm3(int bone) const = 0;
  // Whether it is sawn off below and above, along z: there a scan ends in bone, as one of a patient does.
  [[nodiscard]] virtual std::array<bool, 2> sawn_ends() const { return {}; }
  // They never reach into bone. The bone must outlive them.
  [[nodiscard]] virtual std::vector<Structure> structures() const { return {}; }

  [[nodiscard]] BoneTissue tissue(const Vec3& at_mm) const { return tissue_of(depths(at_mm)); }
  // Mean of the density over `blur_mm` of depth, as samples of that pitch have it. Outside, cortex goes on.
  [[nodiscard]] double density_g_cm3(const Vec3& at_mm, double blur_mm) const;
};

inline constexpr std::string_view kBoneKinds[] = {"femur", "tibia", "patella", "knee", "pelvis", "hip"};
inline constexpr std::string_view kPresets[] = {"female", "male", "small", "large"};
inline constexpr std::string_view kConditions[] = {"young", "adult", "osteoporotic"};

// Whether a bone of this kind has both sides, so that a recipe's side says nothing.
[[nodiscard]] constexpr bool has_both_sides(std::string_view kind) { return kind == "pelvis"; }

// Error: invalid_input, naming the kind, preset, condition or parameter that is wrong, and what is allowed.
[[nodiscard]] Result<std::unique_ptr<PhantomBone>> make_bone(const BoneRecipe& recipe);

}  // namespace osteon::phantoms
