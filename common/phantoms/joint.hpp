// Several phantom bones in one frame, each at its pose and perhaps sawn off: a joint.
#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/phantoms/phantom_bone.hpp"

namespace osteon::phantoms {

// A plane through a bone, in the bone's frame. What lies on the side of the normal is sawn off.
struct Cut {
  Vec3 point_mm = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  // a unit vector
};

struct JointMember {
  std::string name;  // before its parameters, and before what has a name that another member has, too
  std::unique_ptr<PhantomBone> bone;
  Pose pose = {};  // from the bone's frame to that of the joint
  std::optional<Cut> cut = {};
};

// Bones are numbered through all members, in their order. At a cut, cortex, cancellous bone and marrow lie open, as in
// a sawn bone: what was inside can be seen and worked on.
class Joint final : public PhantomBone {
 public:
  // At least one member; their names differ. `parameters` are those of the joint itself; a member's parameter has the
  // member's name before it, such as femur.length_mm. So has a bone, a landmark, an axis, a plane or a structure whose
  // name several members have, even beyond their cuts: "femur, knee centre".
  Joint(std::vector<JointMember> members, std::vector<NamedValue> parameters);
  Joint(const Joint&) = delete;  // its structures point to it
  Joint& operator=(const Joint&) = delete;
  // Structures of the joint itself. They replace those of members with equal names.
  void set_structures(std::vector<Structure> structures) { structures_ = std::move(structures); }

  [[nodiscard]] std::vector<std::string> names() const override;
  [[nodiscard]] std::vector<NamedValue> parameters() const override;
  // Landmarks beyond a cut are left out, and planes never. An axis whose point lies beyond it begins where its line
  // leaves the bone's cut, and is left out if that is nowhere beside the bone.
  [[nodiscard]] BoneAnatomy anatomy() const override;
  [[nodiscard]] Box bounds() const override;
  [[nodiscard]] BoneDepths depths(const Vec3& at_mm) const override { return find(at_mm).depths; }
  [[nodiscard]] double cancellous_g_cm3(const Vec3& at_mm) const override;
  [[nodiscard]] double cortical_g_cm3(int bone) const override;
  [[nodiscard]] double marrow_g_cm3(int bone) const override;
  [[nodiscard]] std::vector<Structure> structures() const override;
  [[nodiscard]] std::array<bool, 2> sawn_ends() const override;

  // The first two members that come nearer to each other than `gap_mm`, by name.
  [[nodiscard]] std::optional<std::pair<std::string, std::string>> nearer_than(double gap_mm) const;

 private:
  struct Placed {
    JointMember member;
    Pose back;           // from the joint's frame to the bone's
    Box box;             // contains what is left of the bone, in its frame
    int first_bone = 0;  // bones of the members before it
  };
  struct Found {
    const Placed* member = nullptr;
    Vec3 at_mm = Vec3::Zero();  // in the member's frame
    BoneDepths depths;
  };
  [[nodiscard]] Found find(const Vec3& at_mm) const;
  [[nodiscard]] const Placed& member_of(int bone) const;
  [[nodiscard]] double surface_mm(const Placed& placed, const Vec3& at_mm) const;  // of one member, in the joint
  [[nodiscard]] bool meet(const Placed& a, const Placed& b, double gap_mm) const;

  std::vector<Placed> members_;
  std::vector<NamedValue> parameters_;
  std::vector<Structure> structures_;
};

// What a recipe changes in a joint: its own parameters, and those of each member, without the member's name.
struct JointChanges {
  std::map<std::string, double> own;
  std::map<std::string, std::map<std::string, double>, std::less<>> members;  // one for each name
};
// A member and the names of its parameters.
struct MemberParameters {
  std::string_view member;
  std::vector<std::string_view> names;
};
// `kind` is that of the joint, such as knee, and `own` the names of its own parameters. Error: invalid_input, naming
// the parameter that is not among them and belongs to no member.
[[nodiscard]] Result<JointChanges> joint_changes(std::string_view kind, const std::map<std::string, double>& changes,
                                                 std::span<const std::string_view> own,
                                                 std::span<const MemberParameters> members);

// What was found for a member. An error, which begins with a parameter's name, gets the member's name before it:
// femur.shell_mm.
template <class Found>
[[nodiscard]] Result<Found> of_member(std::string_view member, Result<Found> found) {
  if (found) return found;
  std::string message = found.error().message;
  message.insert(message.starts_with('"') ? 1 : 0, std::string(member) + ".");
  return tl::unexpected(Error{found.error().code, std::move(message)});
}

// A landmark, and the line of a structure, that the bone has.
[[nodiscard]] Vec3 point_of(const PhantomBone& bone, std::string_view landmark);
[[nodiscard]] std::vector<Vec3> line_of(const PhantomBone& bone, std::string_view structure);

}  // namespace osteon::phantoms
