// What the people of a room decide about each other, draw and say.
#include <algorithm>
#include <string>

#include "server/room/room.hpp"

namespace osteon {
namespace {

tl::unexpected<Error> deny(std::string why) { return failure(ErrorCode::denied, std::move(why)); }

std::string author_name(AuthorId author) { return "author " + std::to_string(author.value); }

}  // namespace

Result<RoomEvent> Room::supervise(AuthorId by, AuthorId subject, Restrictions supervision) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (!people_.supervises(by)) return deny(author_name(by) + " is not an instructor in this room");
  if (!surgeons_.contains(subject))
    return failure(ErrorCode::not_found, author_name(subject) + " has not joined this room to cut");
  if (Result<void> sound = check(supervision); !sound) return tl::unexpected(sound.error());
  for (const AuthorId named : {supervision.taken_by, supervision.guide}) {
    if (!named) continue;
    if (named == subject)
      return bad_input("supervision names the author itself as holder or guide of its tool; name another author");
    if (!knows(named)) return bad_input("supervision names " + author_name(named) + ", who has not joined this room");
  }
  for (const Digest& tool : supervision.tools)
    if (!tools_->find(tool))
      return bad_input("supervision.tools names " + to_hex(tool) + ", which this room does not know; add it first");
  // The instructor may not know yet that the person has joined again. If both authors had the same restrictions, the
  // new one gets these too.
  const Restrictions before = people_.supervised(subject).supervision;
  const AuthorId newest = people_.role(subject) == Role::none ? subject : people_.newest_hand(people_.person(subject));
  const bool follows = newest && newest != subject && newest != supervision.taken_by && newest != supervision.guide &&
                       people_.supervised(newest).supervision == before && before != supervision;
  RoomEvent event = decide(by, SuperviseEntry{subject, supervision});
  if (follows) event.further.push_back(decide(by, SuperviseEntry{newest, std::move(supervision)}));
  return event;
}

Result<RoomEvent> Room::annotate(AuthorId by, Annotation drawn) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (Result<void> sound = check(drawn); !sound) return tl::unexpected(sound.error());
  drawn.author = by;
  const auto& all = people_.annotations();
  if (drawn.id == 0) drawn.id = people_.replaced_by(drawn);
  if (drawn.id == 0) {
    if (all.size() >= kMostAnnotations)
      return bad_input("the room has " + std::to_string(kMostAnnotations) +
                       " annotations and takes no more; wipe some off");
    drawn.id = people_.last_annotation() + 1;
  } else {
    const auto known = all.find(drawn.id);
    if (known == all.end())
      return failure(ErrorCode::not_found, "the room has no annotation " + std::to_string(drawn.id));
    if (known->second.author != by)
      return deny("annotation " + std::to_string(drawn.id) + " is another's; draw a new one");
  }
  const std::uint32_t id = drawn.id;
  return decide(by, AnnotationEntry{id, std::move(drawn)});
}

Result<RoomEvent> Room::wipe_off(AuthorId by, std::uint32_t annotation) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  const auto known = people_.annotations().find(annotation);
  if (known == people_.annotations().end())
    return failure(ErrorCode::not_found, "the room has no annotation " + std::to_string(annotation));
  if (known->second.author != by && !people_.supervises(by))
    return deny("annotation " + std::to_string(annotation) + " is another's; only an instructor may wipe it off");
  return decide(by, AnnotationEntry{annotation, std::nullopt});
}

Result<RoomEvent> Room::say(AuthorId by, AuthorId to, std::string words) {
  if (Result<void> member = check_member(by); !member) return tl::unexpected(member.error());
  if (to && !knows(to)) return failure(ErrorCode::not_found, author_name(to) + " has not joined this room");
  if (words.empty() || words.size() > kMostWordsBytes)
    return bad_input("words need 1 to " + std::to_string(kMostWordsBytes) + " bytes, these have " +
                     std::to_string(words.size()));
  return decide(by, WordsEntry{to, std::move(words)});
}

Result<void> Room::may_change(AuthorId by) const {
  if (Result<void> member = check_member(by); !member) return member;
  for (const Restrictions* held : people_.binding(by))
    if (!held->may_cut())
      return deny(std::string(held->stopped ? "your hand is stopped" : "your tool is taken") +
                  "; you cannot undo, redo, place or remove anything until an instructor lets you go on");
  return {};
}

Result<void> Room::may_cut_again(AuthorId by, const std::set<RoomSeq>& seqs) const {
  for (const RoomSeq seq : seqs) {
    const Event& event = events_.at(seq);
    if (event.kind != EventKind::cut) continue;
    const Cut* cut = event.missed.get();
    for (auto body = bodies_.begin(); body != bodies_.end() && cut == nullptr; ++body)
      cut = body->second.history.find_cut(seq);
    if (cut == nullptr) continue;
    const auto forbidden = [&](AuthorId whose) -> Result<void> {
      for (const Restrictions* held : people_.binding(whose))
        if (const Rejection why = breach(*held, *cut); why != Rejection::none)
          return deny("event " + std::to_string(seq.value) + " is a cut that " + author_name(whose) +
                      " may not make now: " + std::string(sentence(why)));
      return {};
    };
    if (Result<void> may = forbidden(by); !may) return may;
    if (people_.supervises(by)) continue;
    if (Result<void> may = forbidden(event.author); !may) return may;
  }
  return {};
}

Result<void> Room::may_take_back(AuthorId by, const std::set<RoomSeq>& seqs) const {
  if (people_.may_undo_all(by)) return {};
  if (people_.only_own(by)) return are_own(by, seqs);
  if (!takes_all_of_others(by, seqs)) return {};
  return deny(
      "this takes back all that others have done here, and only an instructor may do that; take back less, or only "
      "your own");
}

Result<void> Room::may_do_again(AuthorId by, const std::set<RoomSeq>& undos) const {
  if (people_.may_undo_all(by)) return {};
  if (people_.only_own(by)) return are_own(by, undos);
  for (const RoomSeq seq : undos)
    if (const Event& undo = events_.at(seq); undo.all_of_others && !people_.same_person(by, undo.author))
      return deny("event " + std::to_string(seq.value) +
                  " took back all that others had done; only an instructor may redo it");
  return {};
}

Result<void> Room::are_own(AuthorId by, const std::set<RoomSeq>& seqs) const {
  for (const RoomSeq seq : seqs)
    if (!people_.same_person(by, events_.at(seq).author))
      return deny("event " + std::to_string(seq.value) + " is not " + author_name(by) +
                  "'s own, and a trainee may only take back their own");
  return {};
}

bool Room::takes_all_of_others(AuthorId by, const std::set<RoomSeq>& seqs) const {
  const auto is_others = [&](const Event& event) {
    return event.kind != EventKind::split && !people_.same_person(by, event.author);
  };
  if (std::ranges::none_of(seqs, [&](RoomSeq seq) { return is_others(events_.at(seq)); })) return false;
  const auto stays = [&](const auto& event) {
    return can_be_undone(event.first) && !event.second.undone && is_others(event.second) && !seqs.contains(event.first);
  };
  return std::ranges::none_of(events_, stays);
}

// Whoever stops an author or takes its tool ends its lease: what the author predicted on top is void.
void Room::apply(const LogEntry& entry, const SuperviseEntry& supervise, RoomEvent& event) {
  event.kind = EventKind::supervise;
  event.people = supervise;
  Surgeon& surgeon = surgeons_.at(supervise.subject);
  const Restrictions& before = people_.supervised(supervise.subject).supervision;
  if (before.stopped != supervise.supervision.stopped || before.taken_by != supervise.supervision.taken_by)
    grant(surgeon);
  people_.supervise(entry.seq, entry.author, supervise);
  event.lease_epoch = surgeon.epoch;
}

void Room::apply(const LogEntry& /*entry*/, const AnnotationEntry& annotation, RoomEvent& event) {
  event.kind = EventKind::annotation;
  event.people = annotation;
  people_.draw(annotation);
}

void Room::apply(const LogEntry& /*entry*/, const WordsEntry& words, RoomEvent& event) {
  event.kind = EventKind::words;
  event.people = words;
}

}  // namespace osteon
