// What the people of a room decide about each other, draw and say.
#include <algorithm>
#include <string>

#include "server/room/room.hpp"

namespace osteon {
namespace {

tl::unexpected<Error> refuse(std::string why) { return failure(ErrorCode::invalid_input, std::move(why)); }
tl::unexpected<Error> deny(std::string why) { return failure(ErrorCode::denied, std::move(why)); }

std::string author_name(AuthorId author) { return "author " + std::to_string(author.value); }

}  // namespace

Result<RoomEvent> Room::supervise(AuthorId by, AuthorId subject, Supervision supervision) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (!people_.oversees(by)) return deny(author_name(by) + " is no instructor here");
  if (!surgeons_.contains(subject)) return failure(ErrorCode::not_found, author_name(subject) + " has no hand in this room");
  if (Result<void> sound = check(supervision); !sound) return tl::unexpected(sound.error());
  for (const AuthorId named : {supervision.taken_by, supervision.guide}) {
    if (!named) continue;
    if (named == subject) return refuse("supervision names the hand itself as who holds or guides it; name another author");
    if (!knows(named)) return refuse("supervision names " + author_name(named) + ", who has not joined this room");
  }
  for (const Digest& tool : supervision.tools)
    if (!tools_->find(tool)) return refuse("supervision.tools names " + to_hex(tool) + ", which this room does not know; add it first");
  return decide(by, SuperviseRow{subject, std::move(supervision)});
}

Result<RoomEvent> Room::annotate(AuthorId by, Annotation drawn) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (Result<void> sound = check(drawn); !sound) return tl::unexpected(sound.error());
  drawn.author = by;
  const auto& all = people_.annotations();
  if (drawn.id == 0) drawn.id = people_.replaced_by(drawn);
  if (drawn.id == 0) {
    if (all.size() >= kMostAnnotations)
      return refuse("the room has " + std::to_string(kMostAnnotations) + " annotations and takes no more; wipe some off");
    drawn.id = people_.last_annotation() + 1;
  } else {
    const auto known = all.find(drawn.id);
    if (known == all.end()) return failure(ErrorCode::not_found, "the room has no annotation " + std::to_string(drawn.id));
    if (known->second.author != by) return deny("annotation " + std::to_string(drawn.id) + " is another's; draw a new one");
  }
  const std::uint32_t id = drawn.id;
  return decide(by, AnnotationRow{id, std::move(drawn)});
}

Result<RoomEvent> Room::wipe_off(AuthorId by, std::uint32_t annotation) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  const auto known = people_.annotations().find(annotation);
  if (known == people_.annotations().end())
    return failure(ErrorCode::not_found, "the room has no annotation " + std::to_string(annotation));
  if (known->second.author != by && !people_.oversees(by))
    return deny("annotation " + std::to_string(annotation) + " is another's, which only an instructor wipes off");
  return decide(by, AnnotationRow{annotation, std::nullopt});
}

Result<RoomEvent> Room::say(AuthorId by, AuthorId to, std::string words) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (to && !knows(to)) return failure(ErrorCode::not_found, author_name(to) + " has not joined this room");
  if (words.empty() || words.size() > kMostWordsBytes)
    return refuse("words need 1 to " + std::to_string(kMostWordsBytes) + " bytes, these have " + std::to_string(words.size()));
  return decide(by, WordsRow{to, std::move(words)});
}

Result<void> Room::may_take_back(AuthorId by, const std::set<RoomSeq>& places) const {
  if (!people_.only_own(by)) return {};
  for (const RoomSeq place : places)
    if (events_.at(place).author != by)
      return deny("event " + std::to_string(place.value) + " is not " + author_name(by) + "'s own, and a trainee takes back no other");
  return {};
}

// Who stops a hand or takes its tool takes its lease: what it predicted on top falls.
void Room::apply(const RoomRow& row, const SuperviseRow& supervise, RoomEvent& event) {
  event.kind = EventKind::supervise;
  event.people = supervise;
  Surgeon& surgeon = surgeons_.at(supervise.subject);
  const Supervision& before = people_.supervised(supervise.subject).supervision;
  if (before.stopped != supervise.supervision.stopped || before.taken_by != supervise.supervision.taken_by) grant(surgeon);
  people_.supervise(row.place, supervise);
  event.lease_epoch = surgeon.epoch;
}

void Room::apply(const RoomRow& /*row*/, const AnnotationRow& annotation, RoomEvent& event) {
  event.kind = EventKind::annotation;
  event.people = annotation;
  people_.draw(annotation);
}

void Room::apply(const RoomRow& /*row*/, const WordsRow& words, RoomEvent& event) {
  event.kind = EventKind::words;
  event.people = words;
}

}  // namespace osteon
