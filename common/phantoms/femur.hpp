// A femur from parameters: a head on a neck, two trochanters, a bowed shaft, and two condyles that rest on a plane.
#pragma once
#include <array>
#include <span>

#include "common/phantoms/bone_parameters.hpp"
#include "common/phantoms/implicit_shapes.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// Where along the femur the parameters of its shaft hold, from the plane on which the condyles rest; parts of its
// length.
inline constexpr std::array kFemurStations{0.15, 0.25, 0.40, 0.55, 0.74, 0.80};

// The values are those of the preset "male". deploy/docs/phantoms.md says what each of them is, and its source.
struct FemurParameters {
  double length_mm = 419.8;
  double head_diameter_mm = 47.6;
  double neck_shaft_degrees = 121.5;
  double anteversion_degrees = 12.1;
  double offset_mm = 43.5;
  double neck_height_mm = 34.0, neck_depth_mm = 28.0;
  double proximal_width_mm = 97.8;
  double trochanter_height_mm = 2.0;
  double trochanters_mm = 67.2;
  double shaft_valgus_degrees = 7.0;
  double shaft_lateral_mm = 3.0;
  double shaft_forward_mm = 29.0;
  double bow_radius_mm = 943.0;
  double bow_apex = 0.42;
  double width_15_mm = 40.0, depth_15_mm = 35.5, cortex_15_mm = 2.6;
  double width_25_mm = 31.5, depth_25_mm = 32.0, cortex_25_mm = 4.4;
  double width_40_mm = 27.5, depth_40_mm = 30.0, cortex_40_mm = 6.6;
  double width_55_mm = 28.0, depth_55_mm = 29.6, cortex_55_mm = 7.1;
  double width_74_mm = 29.0, depth_74_mm = 29.0, cortex_74_mm = 6.6;
  double width_80_mm = 33.0, depth_80_mm = 31.0, cortex_80_mm = 4.6;
  double shell_mm = 1.6;
  double marrow_from = 0.25, marrow_to = 0.76;
  double bicondylar_width_mm = 82.0;
  double condyle_depth_mm = 61.1;
  double medial_condyle_radius_mm = 22.0, lateral_condyle_radius_mm = 21.0;
  double condyle_width_mm = 27.4;
  double notch_width_mm = 22.0;
  double cartilage_mm = 2.5;
  double cortical_g_cm3 = 1.9;
  double cancellous_g_cm3 = 0.22;
  double compressive_g_cm3 = 0.58, tensile_g_cm3 = 0.40;
  double marrow_g_cm3 = 0.08;
  double texture = 0.1;
};

[[nodiscard]] std::span<const ParameterField<FemurParameters>> femur_fields();
// Parameters that fit together. Error: invalid_input, naming one that does not, and its range beside the others.
[[nodiscard]] Result<void> check_femur(const FemurParameters& parameters);
// The preset, changed by condition and changes. Errors: those of change() and check_femur().
[[nodiscard]] Result<FemurParameters> femur_parameters(const BoneRecipe& recipe);

// The origin lies between the condyles, at the height of the centre of the medial one. +z is the normal of the plane on
// which both condyles rest, and x is along the line through their most posterior points.
class Femur final : public PhantomBone {
 public:
  // The parameters have passed check_femur().
  Femur(const FemurParameters& parameters, Side side);

  [[nodiscard]] std::vector<std::string> names() const override;
  [[nodiscard]] std::vector<NamedValue> parameters() const override;
  [[nodiscard]] BoneAnatomy anatomy() const override;
  [[nodiscard]] Box bounds() const override;
  [[nodiscard]] BoneDepths depths(const Vec3& at_mm) const override;
  [[nodiscard]] double cancellous_g_cm3(const Vec3& at_mm) const override;
  [[nodiscard]] double cortical_g_cm3(int /*bone*/) const override { return p_.cortical_g_cm3; }
  [[nodiscard]] double marrow_g_cm3(int /*bone*/) const override { return p_.marrow_g_cm3; }
  [[nodiscard]] std::vector<Structure> structures() const override;

  // The smallest dot product of `direction` with any point of the condyles, mm. `direction` is a unit vector with
  // x = 0.
  [[nodiscard]] double lowest_along_mm(const Vec3& direction) const;

 private:
  // All that follows is in the bone's own directions: x lateral, y anterior, z proximal. It is the same for both sides.
  [[nodiscard]] Vec3 own(const Vec3& at_mm) const { return {side_ * at_mm.x(), -at_mm.y(), at_mm.z()}; }
  [[nodiscard]] Vec3 world(const Vec3& own) const { return {side_ * own.x() + 0.0, 0.0 - own.y(), own.z() + 0.0}; }
  [[nodiscard]] double along_shaft(const Vec3& at) const { return at.dot(up_); }
  [[nodiscard]] double height_of(double part_of_length) const;  // along the shaft
  [[nodiscard]] Vec3 shaft_centre(double along) const;
  [[nodiscard]] double shaft_mm(const Vec3& at) const;
  [[nodiscard]] double neck_mm(const Vec3& at) const;
  [[nodiscard]] double proximal_mm(const Vec3& at, double shaft) const;
  [[nodiscard]] double distal_mm(const Vec3& at, double shaft) const;
  [[nodiscard]] double surface_mm(const Vec3& at) const;
  void place_shaft();
  void place_hip();
  void place_trabeculae();

  // Everything within `half_width_mm` of a plate in a sagittal plane: the hull of two circles.
  struct Condyle {
    double x = 0.0, radius_mm = 0.0;
    Vec3 posterior = Vec3::Zero(), anterior = Vec3::Zero();  // centres of the circles, with x = 0
  };
  [[nodiscard]] double condyle_mm(const Condyle& condyle, const Vec3& at) const;
  [[nodiscard]] double joint_face_mm(const Vec3& at) const;     // negative where knee cartilage lies
  [[nodiscard]] Vec3 epicondyle(const Condyle& condyle) const;  // its tip

  FemurParameters p_;
  double side_;            // of lateral along x: 1 for left, -1 for right
  double head_radius_mm_;  // often used
  Vec3 up_, lateral_;      // along the shaft, and across it in the coronal plane
  Profile half_width_, half_depth_, cortex_;
  double bottom_ = 0.0, top_ = 0.0;               // of the shaft, along it
  Vec3 neck_base_, neck_, neck_up_, neck_front_;  // where its axis meets that of the shaft, and its directions
  double neck_length_mm_ = 0.0;
  Vec3 head_, trochanter_, trochanter_tip_, lesser_, lesser_tip_;  // centres, and the tip of the lesser one
  Condyle medial_, lateral_condyle_;
  Vec3 trochlea_ = Vec3::Zero();  // the middle of its round groove
  Vec3 compressive_from_, compressive_to_;
  std::vector<Vec3> tensile_;  // a line through the middle of the group
};

}  // namespace osteon::phantoms
