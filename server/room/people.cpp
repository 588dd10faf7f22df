#include "server/room/people.hpp"

#include <algorithm>
#include <span>

#include "common/access/role_table.hpp"

namespace osteon {

void People::draw(const AnnotationEntry& entry) {
  last_annotation_ = std::max(last_annotation_, entry.id);
  if (entry.drawn)
    annotations_[entry.id] = *entry.drawn;
  else
    annotations_.erase(entry.id);
}

Role People::role(AuthorId author) const {
  const auto member = members_.find(author);
  return member == members_.end() ? Role::none : member->second.role;
}

std::uint32_t People::person(AuthorId author) const {
  const auto member = members_.find(author);
  return member == members_.end() ? 0 : member->second.person;
}

bool People::supervises(AuthorId author) const {
  const Role of = role(author);
  return of == Role::instructor || of == Role::none;
}

bool People::may_undo_all(AuthorId author) const {
  const Role of = role(author);
  return of == Role::none || has_right(of, Right::undo_all);
}

AuthorId People::newest_hand(std::uint32_t person) const {
  if (person == 0) return {};
  for (auto member = members_.rbegin(); member != members_.rend(); ++member)
    if (member->second.hand && member->second.person == person) return member->first;
  return {};
}

std::array<const Restrictions*, 2> People::binding(AuthorId author) const {
  const AuthorId hand = supervises(author) ? author : newest_hand(person(author));
  return {&supervised(author).supervision, &supervised(hand).supervision};
}

const People::Supervised& People::supervised(AuthorId author) const {
  static const Supervised kFree;
  const auto found = supervised_.find(author);
  return found == supervised_.end() ? kFree : found->second;
}

std::uint32_t People::replaced_by(const Annotation& drawn) const {
  if (drawn.kind != AnnotationKind::pointer) return 0;
  const auto same = [&](const auto& entry) {
    return entry.second.author == drawn.author && entry.second.kind == AnnotationKind::pointer;
  };
  const auto found = std::ranges::find_if(annotations_, same);
  return found == annotations_.end() ? 0 : found->first;
}

void People::add_to(Hasher& hasher) const {
  for (const auto& [author, member] : members_) {
    if (member.role == Role::none) continue;
    hasher.integer(author.value);
    hasher.integer(static_cast<std::uint64_t>(member.role));
  }
  const auto whole = [&](std::int64_t value) { hasher.integer(static_cast<std::uint64_t>(value)); };
  for (const auto& [author, supervised] : supervised_) {
    const Restrictions& one = supervised.supervision;
    hasher.text("supervision");
    hasher.integer(author.value);
    hasher.integer(supervised.seq.value);
    hasher.integer(one.stopped ? 1 : 0);
    hasher.integer(one.taken_by.value);
    hasher.integer(one.guide.value);
    whole(one.guide_share);
    whole(one.force_limit);
    hasher.integer(one.zone ? 1 : 0);
    if (one.zone) {
      for (const std::int32_t steps : one.zone->centre) whole(steps);
      whole(one.zone->radius);
    }
    hasher.integer(one.tools.size());
    for (const Digest& tool : one.tools) hasher.bytes(std::as_bytes(std::span(tool.bytes)));
    hasher.text(one.words);
  }
  for (const auto& [id, drawn] : annotations_) {
    hasher.text("annotation");
    hasher.integer(id);
    hasher.integer(drawn.author.value);
    hasher.integer(static_cast<std::uint64_t>(drawn.kind));
    hasher.integer(drawn.points.size());
    for (const auto& point : drawn.points)
      for (const std::int32_t steps : point) whole(steps);
    hasher.text(drawn.words);
    hasher.integer(drawn.colour);
  }
}

}  // namespace osteon
