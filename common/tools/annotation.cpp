#include "common/tools/annotation.hpp"

#include <string>

namespace osteon {
namespace {

tl::unexpected<Error> bad(const std::string& field, const std::string& why) {
  return failure(ErrorCode::invalid_input, "drawn." + field + " " + why);
}

}  // namespace

Result<void> check(const Annotation& drawn) {
  if (drawn.kind < AnnotationKind::pointer || drawn.kind > AnnotationKind::label)
    return bad("kind", "must be pointer, line or label");
  const bool line = drawn.kind == AnnotationKind::line;
  const std::size_t least = line ? 2 : 1, most = line ? kMostAnnotationPoints : 1;
  if (drawn.points.size() < least || drawn.points.size() > most)
    return bad("points", "are " + std::to_string(drawn.points.size()) + "; give " + std::to_string(least) +
                             (line ? " to " + std::to_string(most) : ""));
  if (drawn.words.size() > kMostAnnotationWords)
    return bad("words", "are longer than " + std::to_string(kMostAnnotationWords) + " bytes");
  if (drawn.kind == AnnotationKind::label && drawn.words.empty()) return bad("words", "are missing; a label has some");
  if (drawn.colour > 0xffffff) return bad("colour", "has more than 24 bits");
  return {};
}

}  // namespace osteon
