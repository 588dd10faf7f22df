// A pelvis from parameters: two hip bones and a sacrum, which do not touch. It is its own mirror image.
#pragma once
#include <optional>
#include <span>

#include "common/phantoms/bone_parameters.hpp"
#include "common/phantoms/implicit_shapes.hpp"
#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// The values are those of the preset "male". deploy/docs/phantoms.md says what each of them is, and its source.
struct PelvisParameters {
  double hip_centres_mm = 180.0;
  double acetabulum_diameter_mm = 52.0;
  double acetabulum_depth = 0.9;
  double inclination_degrees = 40.0, anteversion_degrees = 18.5;
  double plane_forward_mm = 40.0;
  double spines_mm = 238.0, spine_height_mm = 76.0;
  double posterior_spines_mm = 98.0, posterior_spine_height_mm = 88.0, posterior_spine_back_mm = 112.0;
  double crests_mm = 280.0, crest_height_mm = 132.0;
  double wing_mm = 6.0, crest_mm = 13.0;
  double tubercles_mm = 60.0, tubercle_depth_mm = 16.7;
  double symphysis_mm = 37.0;
  double tuberosities_mm = 114.0, tuberosity_depth_mm = 90.0, tuberosity_back_mm = 28.0;
  double foramen_width_mm = 34.0, foramen_height_mm = 44.0;
  double sacrum_width_mm = 108.0, sacrum_height_mm = 112.0;
  double symphysis_gap_mm = 4.0, sacroiliac_gap_mm = 2.5;
  double shell_mm = 1.4, subchondral_mm = 2.2;
  double cartilage_mm = 2.0;
  double cortical_g_cm3 = 1.9;
  double cancellous_g_cm3 = 0.22;
  double texture = 0.1;
};

[[nodiscard]] std::span<const ParameterField<PelvisParameters>> pelvis_fields();
// As check_femur() and femur_parameters(). A pelvis has both sides, so the recipe's side says nothing.
[[nodiscard]] Result<void> check_pelvis(const PelvisParameters& parameters);
[[nodiscard]] Result<PelvisParameters> pelvis_parameters(const BoneRecipe& recipe);

// The origin is midway between the centres of both acetabula. The anterior pelvic plane, through both anterior superior
// iliac spines and both pubic tubercles, is parallel to x and z.
class Pelvis final : public PhantomBone {
 public:
  // The parameters have passed check_pelvis(). `only`: the hip bone of that side alone. Its landmarks and its axis have
  // names without a side.
  explicit Pelvis(const PelvisParameters& parameters, std::optional<Side> only = {});

  [[nodiscard]] std::vector<std::string> names() const override;
  [[nodiscard]] std::vector<NamedValue> parameters() const override;
  [[nodiscard]] BoneAnatomy anatomy() const override;
  [[nodiscard]] Box bounds() const override;
  [[nodiscard]] BoneDepths depths(const Vec3& at_mm) const override;
  [[nodiscard]] double cancellous_g_cm3(const Vec3& at_mm) const override;
  [[nodiscard]] std::vector<Structure> structures() const override;
  [[nodiscard]] double cortical_g_cm3(int /*bone*/) const override { return p_.cortical_g_cm3; }
  [[nodiscard]] double marrow_g_cm3(int /*bone*/) const override { return p_.cancellous_g_cm3; }  // no canal

 private:
  // Two balls and their hull, which grows together with what is there.
  struct Limb {
    Vec3 a = Vec3::Zero();
    double radius_a_mm = 0.0;
    Vec3 b = Vec3::Zero();
    double radius_b_mm = 0.0;
    double blend_mm = 0.0;
    // A ball around it.
    Vec3 middle = 0.5 * (a + b);
    double reach_mm = 0.5 * (a - b).norm() + std::max(radius_a_mm, radius_b_mm);
  };
  struct Slope {
    double value = 0.0, slope = 0.0;
  };
  // A place beside the sacrum: along its bowed axis from the base, and behind that axis.
  struct SacrumPlace {
    double along_mm = 0.0, behind_mm = 0.0;
  };

  [[nodiscard]] static Slope arch(double part, double top);
  [[nodiscard]] static double limbs_mm(const Vec3& at, double d, std::span<const Limb> limbs);
  // In the directions of the left half: x lateral, y anterior, z up.
  [[nodiscard]] Vec3 own(const Vec3& at_mm) const;
  void place_sacrum();
  void place_wing();
  void place_ilium();
  void place_pubis_and_ischium();
  [[nodiscard]] double joint_x(double y, double z) const;  // of the middle of the sacroiliac joint
  [[nodiscard]] double joint_mm(const Vec3& at) const;     // from there, positive in the ilium
  [[nodiscard]] double lunate_mm(const Vec3& at) const;    // negative where the cartilage of the acetabulum lies
  [[nodiscard]] double socket_mm(const Vec3& at) const;    // from the ball of the acetabulum, positive in bone
  // Along the wing's chord: the height of its upper edge, and how far that stands out.
  [[nodiscard]] Slope crest_z(double along_mm) const;
  [[nodiscard]] Slope crest_out(double along_mm) const;
  [[nodiscard]] double wing_mm(const Vec3& at) const;
  [[nodiscard]] double ilium_mm(const Vec3& at) const;  // cut off at the sacroiliac joint
  [[nodiscard]] double pubis_mm(const Vec3& at) const;  // with ischium and the wall of the acetabulum
  [[nodiscard]] double hip_mm(const Vec3& at) const;
  [[nodiscard]] SacrumPlace beside_sacrum(const Vec3& at) const;
  [[nodiscard]] Vec3 in_sacrum(double x, const SacrumPlace& place) const;
  [[nodiscard]] double sacrum_mm(const Vec3& at) const;

  // All points are in those directions. `unit_mm` scales what has no parameter.
  PelvisParameters p_;
  std::optional<Side> only_;
  double unit_mm_;
  double radius_mm_, rim_mm_;  // of the acetabulum; its rim's plane along the opening, from the centre
  Vec3 centre_, opening_;
  Limb fossa_;                                            // of the acetabulum, down through its notch
  Vec3 spine_, posterior_spine_, tubercle_, tuberosity_;  // centres of their balls

  // The wing is a plate over the chord between both spines: how far it stands out laterally, and where it begins and
  // ends in height, all along that chord.
  Vec3 chord_, out_;
  double chord_mm_ = 0.0;
  double crest_rise_mm_ = 0.0, crest_bulge_mm_ = 0.0;
  Profile floor_z_, floor_out_, front_;
  std::vector<Limb> ilium_, pubis_;
  double ilium_bottom_ = 0.0, pubis_top_z_ = 0.0;  // where they end in height
  // The pubic body: a bar around a line in its plane x = 0, as wide as its lateral end.
  Vec3 pubis_top_, pubis_bottom_;
  double pubis_end_x_ = 0.0, pubis_radius_mm_ = 0.0;
  // The obturator foramen.
  Vec3 foramen_, foramen_across_, foramen_up_, foramen_out_;

  double bow_mm_ = 0.0, bow_half_ = 0.0;  // the radius of the sacrum's axis, and half of its angle
  Vec3 bow_centre_;
  Vec3 bow_forward_;  // from the middle of the axis to that centre
  Profile sacrum_half_width_, sacrum_half_depth_;
  Vec3 sacrum_middle_;
  double sacrum_reach_mm_ = 0.0;  // the sacrum lies within it around that
};

}  // namespace osteon::phantoms
