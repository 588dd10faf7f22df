#include "common/field/rejection.hpp"

namespace osteon {

std::string_view sentence(Rejection reason) {
  switch (reason) {
    case Rejection::none:
      return "the cut was applied";
    case Rejection::body:
      return "the room has no such body";
    case Rejection::lease:
      return "the cut was made under a tool lease that has ended";
    case Rejection::tool:
      return "the tool is not registered in the room, or does not cut";
    case Rejection::level:
      return "the level is finer than the tool or the case allows";
    case Rejection::path:
      return "the path has no poses or more than a cut may have";
    case Rejection::rotation:
      return "a rotation on the path is not a unit quaternion";
    case Rejection::place:
      return "the path leaves the surroundings of the bone";
    case Rejection::sweep:
      return "the path is longer than one cut may sweep";
    case Rejection::spindle:
      return "the spindle is faster than any tool turns";
    case Rejection::time:
      return "the tool has worked longer than time has passed";
    case Rejection::rate:
      return "the tool sweeps more than the room can follow";
    case Rejection::power:
      return "the tool removes more bone than any motor can";
    case Rejection::frozen:
      return "an instructor has stopped this person";
    case Rejection::taken:
      return "an instructor has taken over this person's tool";
    case Rejection::forbidden_tool:
      return "an instructor allows this person only other tools";
    case Rejection::zone:
      return "an instructor allows this person to cut only in another place";
    case Rejection::metal:
      return "the cut would remove metal";
  }
  return "the reason is unknown";
}

}  // namespace osteon
