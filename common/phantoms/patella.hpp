// A patella from parameters: a rounded triangle with its apex below, a domed front, and two facets behind that meet at
// a ridge.
#pragma once
#include <array>
#include <span>

#include "common/phantoms/bone_parameters.hpp"
#include "common/phantoms/implicit_shapes.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// The values are those of the preset "male". deploy/docs/phantoms.md says what each of them is, and its source.
struct PatellaParameters {
  double height_mm = 45.0;
  double width_mm = 47.0;
  double thickness_mm = 23.0;
  double facets_degrees = 130.0;
  double ridge_mm = 3.0;
  double shell_mm = 1.6;
  double cartilage_mm = 3.0;
  double cortical_g_cm3 = 1.9;
  double cancellous_g_cm3 = 0.40;
  double texture = 0.1;
};

[[nodiscard]] std::span<const ParameterField<PatellaParameters>> patella_fields();
// As check_femur() and femur_parameters().
[[nodiscard]] Result<void> check_patella(const PatellaParameters& parameters);
[[nodiscard]] Result<PatellaParameters> patella_parameters(const BoneRecipe& recipe);

// The origin is the middle of the bone's height, width and thickness. The ridge is along z, and the front faces -y. It
// has no marrow.
class Patella final : public PhantomBone {
 public:
  // The parameters have passed check_patella().
  Patella(const PatellaParameters& parameters, Side side);

  [[nodiscard]] std::vector<std::string> names() const override { return {"patella"}; }
  [[nodiscard]] std::vector<NamedValue> parameters() const override;
  [[nodiscard]] BoneAnatomy anatomy() const override;
  [[nodiscard]] Box bounds() const override;
  [[nodiscard]] BoneDepths depths(const Vec3& at_mm) const override;
  [[nodiscard]] double cancellous_g_cm3(const Vec3& at_mm) const override;
  [[nodiscard]] double cortical_g_cm3(int /*bone*/) const override { return p_.cortical_g_cm3; }
  [[nodiscard]] double marrow_g_cm3(int /*bone*/) const override { return p_.cancellous_g_cm3; }
  [[nodiscard]] std::vector<Structure> structures() const override;

 private:
  // In the bone's own directions, as in a femur: x lateral, y anterior, z proximal.
  [[nodiscard]] Vec3 own(const Vec3& at_mm) const { return {side_ * at_mm.x(), -at_mm.y(), at_mm.z()}; }
  [[nodiscard]] Vec3 world(const Vec3& own) const { return {side_ * own.x() + 0.0, 0.0 - own.y(), own.z() + 0.0}; }
  [[nodiscard]] double outline_mm(double x, double z) const;
  [[nodiscard]] double surface_mm(const Vec3& at) const;

  // A circle in the coronal plane, and the normal of the outline's side between it and the next one.
  struct Disc {
    double x = 0.0, z = 0.0, radius = 0.0;
    double normal_x = 0.0, normal_z = 0.0;
  };

  PatellaParameters p_;
  double side_;                    // of lateral along x: 1 for left, -1 for right
  std::array<Disc, 4> outline_{};  // its hull: apex, lateral, base and medial, against the clock from x to z
  double rim_mm_;                  // thickness of the thinnest part of the rim
};

}  // namespace osteon::phantoms
