#include "common/phantoms/joint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/check.hpp"

namespace osteon::phantoms {
namespace {

constexpr double kBoxStep_mm = 3.0;   // of the search for what a cut leaves
constexpr double kMeetStep_mm = 0.5;  // of the search for places where members meet
constexpr double kOnPlane_mm = 1e-6;  // a point this near a cut lies on it

double outside_mm(const Box& box, const Vec3& at) {
  return (box.min_mm - at).cwiseMax(at - box.max_mm).cwiseMax(0.0).norm();
}

double beyond_mm(const std::optional<Cut>& cut, const Vec3& at) {
  return cut ? cut->normal.dot(at - cut->point_mm) : -std::numeric_limits<double>::infinity();
}

// The corners of a box are numbered 0 to 7: a bit for each axis says whether it is at the box's greatest value.
Vec3 corner(const Box& box, int bits) {
  return {(bits & 1) != 0 ? box.max_mm.x() : box.min_mm.x(), (bits & 2) != 0 ? box.max_mm.y() : box.min_mm.y(),
          (bits & 4) != 0 ? box.max_mm.z() : box.min_mm.z()};
}

Box moved(const Box& box, const Pose& pose) {
  Box found;
  for (int bits = 0; bits < 8; ++bits) found.include(pose.point(corner(box, bits)));
  return found;
}

// Contains what a cut leaves of a box.
Box kept(const Box& box, const std::optional<Cut>& cut) {
  if (!cut) return box;
  Box found;
  for (int bits = 0; bits < 8; ++bits) {
    const Vec3 a = corner(box, bits);
    const double beyond_a = beyond_mm(cut, a);
    if (beyond_a <= 0.0) found.include(a);
    for (const int axis : {1, 2, 4}) {
      const Vec3 b = corner(box, bits ^ axis);
      const double beyond_b = beyond_mm(cut, b);
      if (beyond_a <= 0.0 && beyond_b > 0.0) found.include(a + beyond_a / (beyond_a - beyond_b) * (b - a));
    }
  }
  return found;
}

// A box around what a cut leaves, from the cells of a coarse lattice that may hold bone.
Box box_of(const JointMember& member) {
  Box whole = kept(member.bone->bounds(), member.cut);
  if (!member.cut) return whole;
  const double reach = 0.5 * std::sqrt(3.0) * kBoxStep_mm;
  Box box;
  const Eigen::Array3i cells = (whole.size_mm() / kBoxStep_mm).array().floor().cast<int>();
  for (int i = 0; i <= cells.x(); ++i)
    for (int j = 0; j <= cells.y(); ++j)
      for (int k = 0; k <= cells.z(); ++k) {
        const Vec3 lowest = whole.min_mm + kBoxStep_mm * Vec3(i, j, k);
        const Vec3 middle = lowest.array() + 0.5 * kBoxStep_mm;
        if (member.bone->depths(middle).surface_mm > kSteepest * reach) continue;
        box.include(lowest);
        box.include(lowest.array() + kBoxStep_mm);
      }
  return kept(box, member.cut);
}

template <class Named>
struct OfMember {
  std::string member;
  Named named;
  bool is_left = true;  // by the member's cut
};

// What is left. Before each name that occurs in several members stands the member's. So no name depends on a cut.
template <class Named>
std::vector<Named> told_apart(std::vector<OfMember<Named>> all) {
  std::map<std::string, int> count;
  for (const OfMember<Named>& one : all) ++count[one.named.name];
  std::vector<Named> found;
  for (OfMember<Named>& one : all) {
    if (!one.is_left) continue;
    if (count[one.named.name] > 1) one.named.name = one.member + ", " + one.named.name;
    found.push_back(std::move(one.named));
  }
  return found;
}

}  // namespace

Joint::Joint(std::vector<JointMember> members, std::vector<NamedValue> parameters)
    : parameters_(std::move(parameters)) {
  int bones = 0;
  for (JointMember& member : members) {
    const Pose back = member.pose.inverse();
    const Box box = box_of(member);
    const int count = static_cast<int>(member.bone->names().size());
    members_.push_back({std::move(member), back, box, bones});
    bones += count;
  }
}

Joint::Found Joint::find(const Vec3& at_mm) const {
  Found found;
  found.depths.surface_mm = std::numeric_limits<double>::infinity();
  for (const Placed& placed : members_) {
    const Vec3 at = placed.back.point(at_mm);
    if (found.member != nullptr && outside_mm(placed.box, at) >= found.depths.surface_mm) continue;
    BoneDepths depths = placed.member.bone->depths(at);
    depths.surface_mm = std::max(depths.surface_mm, beyond_mm(placed.member.cut, at));
    if (found.member != nullptr && depths.surface_mm >= found.depths.surface_mm) continue;
    depths.bone += placed.first_bone;
    found = {&placed, at, depths};
  }
  return found;
}

double Joint::surface_mm(const Placed& placed, const Vec3& at_mm) const {
  const Vec3 at = placed.back.point(at_mm);
  return std::max(placed.member.bone->depths(at).surface_mm, beyond_mm(placed.member.cut, at));
}

const Joint::Placed& Joint::member_of(int bone) const {
  std::size_t i = members_.size() - 1;
  while (i > 0 && members_[i].first_bone >= bone) --i;
  return members_[i];
}

double Joint::cancellous_g_cm3(const Vec3& at_mm) const {
  const Found found = find(at_mm);
  return found.member->member.bone->cancellous_g_cm3(found.at_mm);
}

double Joint::cortical_g_cm3(int bone) const {
  const Placed& placed = member_of(bone);
  return placed.member.bone->cortical_g_cm3(bone - placed.first_bone);
}

double Joint::marrow_g_cm3(int bone) const {
  const Placed& placed = member_of(bone);
  return placed.member.bone->marrow_g_cm3(bone - placed.first_bone);
}

std::vector<std::string> Joint::names() const {
  struct Bone {
    std::string name;
  };
  std::vector<OfMember<Bone>> bones;
  for (const Placed& placed : members_)
    for (std::string& name : placed.member.bone->names()) bones.push_back({placed.member.name, {std::move(name)}});
  std::vector<std::string> names;
  for (Bone& bone : told_apart(std::move(bones))) names.push_back(std::move(bone.name));
  return names;
}

std::vector<NamedValue> Joint::parameters() const {
  std::vector<NamedValue> values = parameters_;
  for (const Placed& placed : members_)
    for (NamedValue& value : placed.member.bone->parameters()) {
      value.name = placed.member.name + "." + value.name;
      values.push_back(std::move(value));
    }
  return values;
}

BoneAnatomy Joint::anatomy() const {
  std::vector<OfMember<Landmark>> landmarks;
  std::vector<OfMember<PlannedAxis>> axes;
  std::vector<OfMember<PlannedPlane>> planes;
  for (const Placed& placed : members_) {
    const auto& [name, bone, pose, cut] = placed.member;
    BoneAnatomy own = bone->anatomy();
    for (const Landmark& landmark : own.landmarks)
      landmarks.push_back(
          {name, {landmark.name, pose.point(landmark.point_mm)}, beyond_mm(cut, landmark.point_mm) <= kOnPlane_mm});
    for (PlannedAxis& axis : own.axes) {
      bool is_left = true;
      if (const double beyond = beyond_mm(cut, axis.point_mm); beyond > kOnPlane_mm) {
        const double along = cut->normal.dot(axis.direction);
        is_left = std::abs(along) >= 1e-6;
        if (is_left) axis.point_mm -= beyond / along * axis.direction;
        is_left = is_left && outside_mm(placed.box, axis.point_mm) <= kOnPlane_mm;
      }
      axes.push_back({name, {axis.name, pose.point(axis.point_mm), pose.direction(axis.direction)}, is_left});
    }
    for (const PlannedPlane& plane : own.planes)
      planes.push_back({name, {plane.name, pose.point(plane.point_mm), pose.direction(plane.normal)}});
  }
  return {told_apart(std::move(landmarks)), told_apart(std::move(axes)), told_apart(std::move(planes))};
}

std::vector<Structure> Joint::structures() const {
  std::vector<OfMember<Structure>> found;
  for (const Placed& placed : members_)
    for (Structure& own : placed.member.bone->structures()) {
      if (std::ranges::find(structures_, own.name, &Structure::name) != structures_.end()) continue;
      const Box left = kept(own.bounds, placed.member.cut);
      const bool is_left = !left.empty();
      if (is_left) own.bounds = moved(left, placed.member.pose);
      for (Vec3& at : own.line_mm) at = placed.member.pose.point(at);
      own.distance_mm = [this, distance = std::move(own.distance_mm), &placed](const Vec3& at_mm) {
        const Vec3 at = placed.back.point(at_mm);
        const double own_mm = std::max(distance(at), beyond_mm(placed.member.cut, at));
        // Where another bone is, there is no structure.
        return own_mm < 0.0 ? std::max(own_mm, -depths(at_mm).surface_mm) : own_mm;
      };
      found.push_back({placed.member.name, std::move(own), is_left});
    }
  std::vector<Structure> all = told_apart(std::move(found));
  all.insert(all.end(), structures_.begin(), structures_.end());
  return all;
}

std::array<bool, 2> Joint::sawn_ends() const {
  constexpr double kAlongZ = 0.9;
  std::array<bool, 2> sawn{};
  for (const Placed& placed : members_) {
    if (!placed.member.cut) continue;
    const double z = placed.member.pose.direction(placed.member.cut->normal).z();
    sawn[0] = sawn[0] || z < -kAlongZ;
    sawn[1] = sawn[1] || z > kAlongZ;
  }
  return sawn;
}

Box Joint::bounds() const {
  Box box;
  for (const Placed& placed : members_) {
    const Box own = moved(placed.box, placed.member.pose);
    box.include(own.min_mm);
    box.include(own.max_mm);
  }
  return box;
}

// Two bones are nearer than a gap where both are within half of it. A cell in which they may be is divided, down to
// small ones.
bool Joint::meet(const Placed& a, const Placed& b, double gap_mm) const {
  const Box box_a = moved(a.box, a.member.pose).grown(gap_mm), box_b = moved(b.box, b.member.pose).grown(gap_mm);
  std::vector<Box> open{{box_a.min_mm.cwiseMax(box_b.min_mm), box_a.max_mm.cwiseMin(box_b.max_mm)}};
  if (open.front().empty()) return false;
  while (!open.empty()) {
    const Box cell = open.back();
    open.pop_back();
    const Vec3 size = cell.size_mm(), middle = cell.centre_mm();
    const double farther = std::max(surface_mm(a, middle), surface_mm(b, middle));
    if (farther < 0.5 * gap_mm) return true;
    int longest = 0;
    const double edge = size.maxCoeff(&longest);
    if (edge < kMeetStep_mm || farther - 0.5 * kSteepest * size.norm() >= 0.5 * gap_mm) continue;
    Box low = cell, high = cell;
    low.max_mm[longest] = high.min_mm[longest] = middle[longest];
    open.push_back(low);
    open.push_back(high);
  }
  return false;
}

std::optional<std::pair<std::string, std::string>> Joint::nearer_than(double gap_mm) const {
  for (std::size_t i = 0; i < members_.size(); ++i)
    for (std::size_t j = i + 1; j < members_.size(); ++j)
      if (meet(members_[i], members_[j], gap_mm)) return std::pair(members_[i].member.name, members_[j].member.name);
  return std::nullopt;
}

Result<JointChanges> joint_changes(std::string_view kind, const std::map<std::string, double>& changes,
                                   std::span<const std::string_view> own, std::span<const MemberParameters> members) {
  OSTEON_CHECK(!members.empty());
  JointChanges found;
  for (const MemberParameters& one : members) found.members[std::string(one.member)];
  for (const auto& [name, value] : changes) {
    const std::size_t dot = name.find('.');
    if (dot == std::string::npos && std::ranges::find(own, name) != own.end()) {
      found.own[name] = value;
      continue;
    }
    const auto member = dot == std::string::npos ? found.members.end() : found.members.find(name.substr(0, dot));
    if (member != found.members.end()) {
      member->second[name.substr(dot + 1)] = value;
      continue;
    }
    // A bone that has such a parameter is the best example.
    const std::string last = dot == std::string::npos ? name : name.substr(dot + 1);
    auto like = std::ranges::find_if(
        members, [&](const auto& one) { return std::ranges::find(one.names, last) != one.names.end(); });
    const std::string example =
        like != members.end() ? std::string(like->member) + "." + last
                              : std::string(members.front().member) + "." + std::string(members.front().names.front());
    std::string message = "\"" + name + "\" is no parameter of a " + std::string(kind) + "; write ";
    for (const std::string_view known : own) message.append(known).append(", ");
    return bad_input(message.append("or a bone's parameter after its name, such as ").append(example));
  }
  return found;
}

Vec3 point_of(const PhantomBone& bone, std::string_view landmark) {
  const std::vector<Landmark> landmarks = bone.anatomy().landmarks;
  const auto found = std::ranges::find(landmarks, landmark, &Landmark::name);
  OSTEON_CHECK(found != landmarks.end());
  return found->point_mm;
}

std::vector<Vec3> line_of(const PhantomBone& bone, std::string_view structure) {
  std::vector<Structure> structures = bone.structures();
  const auto found = std::ranges::find(structures, structure, &Structure::name);
  OSTEON_CHECK(found != structures.end() && !found->line_mm.empty());
  return std::move(found->line_mm);
}

}  // namespace osteon::phantoms
