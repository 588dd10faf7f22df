// How items are placed on the bone: where a guide lies on the surface, what pins fix, how a screw follows its thread,
// how a trial implant is driven home. Pure. Queries the bone through a function.
#pragma once
#include <functional>
#include <optional>
#include <span>

#include "common/core/result.hpp"
#include "common/tools/guide.hpp"
#include "common/tools/scene_item.hpp"

namespace osteon {

// The remaining bone: a signed distance at a point of its frame, negative inside. Exact near the surface. Elsewhere it
// only needs the right sign and must not exceed the true distance.
using BoneQuery = std::function<double(const Vec3& point_bone_mm)>;

struct SurfacePlace {
  Vec3 point_mm;
  Vec3 outward;  // unit normal out of the bone, averaged over about a millimetre
};
// The surface point nearest to `near_mm`, if it is no farther than `reach_mm`.
[[nodiscard]] std::optional<SurfacePlace> nearest_surface(const BoneQuery& bone, const Vec3& near_mm,
                                                          double reach_mm = 20.0);

// The pose of an item set down on the bone near a point. The origin is on the surface and +z points into the bone,
// along `axis` or, without one, against the surface's normal. Its x is as near to `across` as that allows. Error
// invalid_input: no bone there.
[[nodiscard]] Result<Pose> place_on_bone(const BoneQuery& bone, const Vec3& near_mm, const std::optional<Vec3>& axis,
                                         const Vec3& across);

// An item with its definition.
struct Standing {
  SceneItem item;
  Tool tool;
};

// The number of the guide's pin holes that contain a pin. The pin's axis is within the hole's play, its tip beyond the
// guide.
[[nodiscard]] int pins_in(const Tool& guide, const Pose& pose_bone_guide, std::span<const Standing> scene);
inline constexpr int kPinsThatFix = 2;

// Applies the rules for setting an item. A guide that pins fix cannot be moved; it is `seated` while two pins or more
// are in it. Pins and screws move along and about their axis only. A screw follows its thread, one pitch per turn, in
// both directions. `before`: the same item as it stands, or null for a new one. `bone`: may be empty if the bone is
// unknown; then `seated` is not set where it depends on the bone. Errors: invalid_input, with the remedy.
[[nodiscard]] Result<SceneItem> set_by_rules(std::span<const Standing> scene, const Standing* before,
                                             const Standing& wanted, const BoneQuery& bone);

// A standing screw after some turns, in (positive) or out. It stops when the underside of its head meets bone; then
// fewer turns are made.
struct Driven {
  Pose pose_bone_item;
  double turns = 0;     // in this motion
  bool seated = false;  // the head is on the bone
};
[[nodiscard]] Driven turn_screw(const Tool& screw, const Pose& pose_bone_screw, double turns, const BoneQuery& bone);

// How an implant lies in its cavity, over the part of its surface that faces the direction of insertion.
struct Fit {
  double contact_fraction = 0;  // share of that surface within the tolerance of bone
  double largest_gap_mm = 0;    // as far as `bone` is exact
  double largest_overlap_mm = 0;
};
struct FitParams {
  double tolerance_mm = 0.2;      // distance that counts as contact
  double most_overlap_mm = 0.02;  // an implant that meets this much bone stops
  double least_contact = 0.5;     // smallest contact to be seated
  int points = 2000;
};
[[nodiscard]] Fit fit_of(const Tool& implant, const Pose& pose_bone_implant, const BoneQuery& bone,
                         const FitParams& params = {});

struct Seating {
  Pose pose_bone_item;
  double advance_mm = 0;
  bool stopped = false;  // by bone, not by `most_mm`
  bool seated = false;   // stopped, with enough contact to bone
  Fit fit;
};
// Drives an implant along its axis until bone stops it. Error invalid_input: it meets bone where it starts.
[[nodiscard]] Result<Seating> drive_home(const Tool& implant, const Pose& pose_bone_implant, double most_mm,
                                         const BoneQuery& bone, const FitParams& params = {});

}  // namespace osteon
