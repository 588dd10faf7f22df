#include "common/field/restrictions.hpp"

#include <algorithm>

namespace osteon {
namespace {

tl::unexpected<Error> bad(const std::string& field, const std::string& why) {
  return failure(ErrorCode::invalid_input, "supervision." + field + " " + why);
}

}  // namespace

// Steps have 32 bits, so their differences have 33, and the sum of their squares could overflow 64. This happens only
// far beyond any radius, so large differences are rejected first.
bool ZoneLimit::contains(const std::array<std::int32_t, 3>& tip) const {
  std::int64_t square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t from = std::int64_t{tip[axis]} - centre[axis];
    if (from > radius || from < -std::int64_t{radius}) return false;
    square += from * from;
  }
  return square <= std::int64_t{radius} * radius;
}

Result<void> check(const Restrictions& supervision) {
  if (supervision.guide_share < 0 || supervision.guide_share > kWholeShare)
    return bad("guide_share",
               "is " + std::to_string(supervision.guide_share) + "; give 0 to " + std::to_string(kWholeShare));
  if (supervision.force_limit < 0 || supervision.force_limit > kMostForceLimit)
    return bad("force_limit", "is " + std::to_string(supervision.force_limit) + " hundredths of a newton; give 0 to " +
                                  std::to_string(kMostForceLimit));
  // 2^30 steps are about a kilometre.
  if (supervision.zone && (supervision.zone->radius <= 0 || supervision.zone->radius > 1 << 30))
    return bad("zone.radius", "is " + std::to_string(supervision.zone->radius) + " steps; give more than 0");
  if (supervision.tools.size() > kMostLimitedTools)
    return bad("tools", "names " + std::to_string(supervision.tools.size()) + "; give at most " +
                            std::to_string(kMostLimitedTools));
  if (std::ranges::adjacent_find(supervision.tools, std::ranges::greater_equal{}) != supervision.tools.end())
    return bad("tools", "are not in the order of their hashes, each once");
  if (supervision.words.size() > kMostSupervisionWords)
    return bad("words", "are longer than " + std::to_string(kMostSupervisionWords) + " bytes");
  return {};
}

Rejection breach(const Restrictions& supervision, const Cut& cut) {
  if (supervision.stopped) return Rejection::frozen;
  if (supervision.taken_by) return Rejection::taken;
  if (!supervision.tools.empty() && !std::ranges::binary_search(supervision.tools, cut.tool))
    return Rejection::forbidden_tool;
  const auto within = [&](const QuantisedPose& knot) { return supervision.zone->contains(knot.position); };
  if (supervision.zone && !std::ranges::all_of(cut.path, within)) return Rejection::zone;
  return Rejection::none;
}

}  // namespace osteon
