// A tibia with its fibula from parameters: a plateau that slopes backwards, a tapered shaft with a tuberosity, and the
// malleoli. The two bones do not touch.
#pragma once
#include <array>
#include <span>

#include "common/phantoms/bone_parameters.hpp"
#include "common/phantoms/implicit_shapes.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// Where along the tibia the parameters of its shaft hold, from the tip of the medial malleolus; parts of its length.
inline constexpr std::array kTibiaStations{0.12, 0.30, 0.50, 0.70, 0.86};

// The values are those of the preset "male". deploy/docs/phantoms.md says what each of them is, and its source.
struct TibiaParameters {
  double length_mm = 370.0;
  double plateau_width_mm = 76.1, plateau_depth_mm = 48.2;
  double slope_degrees = 7.0;
  double width_12_mm = 32.0, depth_12_mm = 28.0, cortex_12_mm = 2.4;
  double width_30_mm = 22.5, depth_30_mm = 24.0, cortex_30_mm = 4.4;
  double width_50_mm = 23.5, depth_50_mm = 29.0, cortex_50_mm = 5.6;
  double width_70_mm = 28.5, depth_70_mm = 34.0, cortex_70_mm = 4.6;
  double width_86_mm = 46.0, depth_86_mm = 40.0, cortex_86_mm = 2.4;
  double shell_mm = 1.4;
  double marrow_from = 0.22, marrow_to = 0.74;
  double malleolus_mm = 13.0;
  double tuberosity_mm = 5.0;
  double fibula_length_mm = 362.0;
  double fibula_width_mm = 13.0, fibula_head_mm = 25.0, fibula_cortex_mm = 2.8;
  double gap_mm = 2.5;
  double cartilage_mm = 2.5;
  double cortical_g_cm3 = 1.9;
  double cancellous_g_cm3 = 0.23;
  double marrow_g_cm3 = 0.08;
  double texture = 0.1;
};

[[nodiscard]] std::span<const ParameterField<TibiaParameters>> tibia_fields();
// As check_femur() and femur_parameters().
[[nodiscard]] Result<void> check_tibia(const TibiaParameters& parameters);
[[nodiscard]] Result<TibiaParameters> tibia_parameters(const BoneRecipe& recipe);

// The origin is the middle of the plateau. The shaft is along z, and the plateau's width along x.
class Tibia final : public PhantomBone {
 public:
  // The parameters have passed check_tibia().
  Tibia(const TibiaParameters& parameters, Side side);

  [[nodiscard]] std::vector<std::string> names() const override { return {"tibia", "fibula"}; }
  [[nodiscard]] std::vector<NamedValue> parameters() const override;
  [[nodiscard]] BoneAnatomy anatomy() const override;
  [[nodiscard]] Box bounds() const override;
  [[nodiscard]] BoneDepths depths(const Vec3& at_mm) const override;
  [[nodiscard]] double cancellous_g_cm3(const Vec3& at_mm) const override;
  [[nodiscard]] double cortical_g_cm3(int /*bone*/) const override { return p_.cortical_g_cm3; }
  [[nodiscard]] double marrow_g_cm3(int /*bone*/) const override { return p_.marrow_g_cm3; }
  [[nodiscard]] std::vector<Structure> structures() const override;

 private:
  // In the bone's own directions, as in a femur: x lateral, y anterior, z proximal.
  [[nodiscard]] Vec3 own(const Vec3& at_mm) const { return {side_ * at_mm.x(), -at_mm.y(), at_mm.z()}; }
  [[nodiscard]] Vec3 world(const Vec3& own) const { return {side_ * own.x() + 0.0, 0.0 - own.y(), own.z() + 0.0}; }
  [[nodiscard]] double height_of(double part_of_length) const { return (part_of_length - 1.0) * p_.length_mm; }
  [[nodiscard]] double plafond() const { return height_of(0.0) + p_.malleolus_mm; }  // z of the joint face
  [[nodiscard]] double tibia_mm(const Vec3& at) const;
  [[nodiscard]] double fibula_mm(const Vec3& at) const;
  [[nodiscard]] Vec3 fibula_centre(double z) const;
  [[nodiscard]] Vec3 between_bones(double z) const;          // half way from one bone to the other
  [[nodiscard]] double joint_face_mm(const Vec3& at) const;  // negative where cartilage lies

  TibiaParameters p_;
  double side_;  // of lateral along x: 1 for left, -1 for right
  Profile half_width_, half_depth_, cortex_, fibula_radius_;
  Vec3 malleolus_, tuberosity_, fibula_head_, fibula_foot_;  // centres of their balls
  double malleolus_radius_mm_ = 0.0, fibula_foot_radius_mm_ = 0.0;
};

}  // namespace osteon::phantoms
