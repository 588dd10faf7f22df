#include "common/tools/placing.hpp"

#include <cmath>
#include <string>

#include "common/core/overloaded.hpp"

namespace osteon {
namespace {

tl::unexpected<Error> refuse(const Tool& tool, const char* why) {
  return failure(ErrorCode::invalid_input, "\"" + tool.name + "\" " + why);
}

}  // namespace

Result<Placed> placed(const Placing& how, const Standing* before, const Standing& wanted, const BoneQuery& bone) {
  const Tool& tool = wanted.tool;
  return std::visit(Overloaded{
                        [&](std::monostate) -> Result<Placed> { return Placed{wanted.item}; },
                        [&](const OntoBone& place) -> Result<Placed> {
                          Placed result{wanted.item};
                          const Result<Pose> pose = place_on_bone(bone, place.near_mm, place.axis, place.across);
                          if (!pose) return tl::unexpected(pose.error());
                          result.item.pose_bone_item = *pose;
                          return result;
                        },
                        [&](const ByThread& by) -> Result<Placed> {
                          if (tool.kind != ToolKind::screw)
                            return refuse(tool, "has no thread; only screws are turned");
                          if (before == nullptr) return refuse(tool, "does not stand on the bone yet; place it first");
                          if (!(std::abs(by.turns * tool.thread_pitch_mm) <= kFarthestMotion_mm))
                            return refuse(tool, "is turned by at most 100 mm of its thread at once");
                          const Driven driven = turn_screw(tool, before->item.pose_bone_item, by.turns, bone);
                          Placed result{before->item};
                          result.item.pose_bone_item = driven.pose_bone_item;
                          result.item.turns += driven.turns;
                          return result;
                        },
                        [&](const DriveHome& drive) -> Result<Placed> {
                          if (tool.kind != ToolKind::trial_cup && tool.kind != ToolKind::trial_stem)
                            return refuse(tool, "is no implant; only those are driven home");
                          if (before == nullptr) return refuse(tool, "does not stand on the bone yet; place it first");
                          if (!(drive.most_mm > 0.0 && drive.most_mm <= kFarthestMotion_mm))
                            return refuse(tool, "is driven by more than 0 and at most 100 mm");
                          const Result<Seating> seating =
                              drive_home(tool, before->item.pose_bone_item, drive.most_mm, bone);
                          if (!seating) return tl::unexpected(seating.error());
                          Placed result{before->item, seating->fit.contact_fraction};
                          result.item.pose_bone_item = seating->pose_bone_item;
                          return result;
                        },
                    },
                    how);
}

}  // namespace osteon
