#include "server/publish/presence.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "common/wire/convert.hpp"
#include "osteon/v1/people.pb.h"

namespace osteon {

Presence::Presence(const Room& room, const std::map<std::uint32_t, std::string>& names) : room_seq_(room.room_seq()) {
  revision_ = room.authors() + 1;  // everybody present from now on was here later than all of them
  for (std::uint64_t author = 1; author <= room.authors(); ++author) {
    const AuthorId id{author};
    Entry& entry = people_[id];
    entry.revision = revision_;
    const auto name = names.find(room.people().person(id));
    if (name != names.end()) entry.name = name->second;
    entry.role = room.people().role(id);
    entry.hand = room.may_cut(id);
    entry.supervision = room.people().supervised(id).supervision;
    entry.decided = room.people().supervised(id).seq;
    entry.decided_by = room.people().supervised(id).by;
    entry.last_here = author;
  }
  for (const auto& [id, drawn] : room.people().annotations()) annotations_[id] = {revision_, drawn};
}

Presence::Entry* Presence::change(AuthorId author) {
  const auto found = people_.find(author);
  if (found == people_.end()) return nullptr;
  found->second.revision = ++revision_;
  return &found->second;
}

void Presence::joined(AuthorId author, const std::string& name, Role role, bool hand) {
  const MutexLock lock(mutex_);
  Entry& entry = people_[author];
  entry.revision = entry.last_here = ++revision_;
  entry.name = name;
  entry.role = role;
  entry.hand = hand;
}

void Presence::came(AuthorId author) {
  const MutexLock lock(mutex_);
  if (Entry* entry = change(author)) ++entry->streams;
}

void Presence::went(AuthorId author) {
  const MutexLock lock(mutex_);
  Entry* entry = change(author);
  if (entry == nullptr || entry->streams == 0 || --entry->streams > 0) return;
  entry->look.reset();
  entry->last_here = revision_;
}

void Presence::take(const RoomEvent& event) {
  const MutexLock lock(mutex_);
  if (const auto* decided = std::get_if<SuperviseEntry>(&event.people)) {
    if (Entry* entry = change(decided->subject)) {
      entry->supervision = decided->supervision;
      entry->decided = event.room_seq;
      entry->decided_by = event.author;
    }
  } else if (const auto* drawn = std::get_if<AnnotationEntry>(&event.people)) {
    ++revision_;
    if (drawn->drawn)
      annotations_[drawn->id] = {revision_, *drawn->drawn};
    else
      annotations_.erase(drawn->id);
  } else if (const auto* said = std::get_if<WordsEntry>(&event.people)) {
    ++revision_;
    words_.push_back({++words_said_, event.room_seq, event.author, said->to, said->words});
    if (words_.size() > kMostWords) words_.pop_front();
  }
}

void Presence::took_cut(AuthorId author) {
  const MutexLock lock(mutex_);
  if (Entry* entry = change(author)) ++entry->cuts;
}

void Presence::acknowledged(AuthorId author, RoomSeq seq) {
  const MutexLock lock(mutex_);
  const auto found = people_.find(author);
  if (found != people_.end() && seq > found->second.acknowledged) change(author)->acknowledged = seq;
}

void Presence::looked(AuthorId author, const ViewFrustum& from) {
  const MutexLock lock(mutex_);
  if (Entry* entry = change(author)) entry->look = from;
}

void Presence::shot(AuthorId author, ShotRun run, const ShotTotals& session) {
  const MutexLock lock(mutex_);
  run.author = author;
  const auto known = std::ranges::find_if(runs_, [&](const RunEntry& entry) { return same_press(entry.run, run); });
  if (known != runs_.end() && known->run.last.number > run.last.number) return;
  Entry* entry = change(author);
  if (entry == nullptr) return;
  entry->shots = session;
  if (known != runs_.end()) runs_.erase(known);
  runs_.push_back({++runs_told_, std::move(run)});
  if (runs_.size() > kMostRuns) runs_.erase(surplus_run(runs_, &RunEntry::run));
}

std::vector<AuthorId> Presence::supervised_hands() const {
  const MutexLock lock(mutex_);
  std::vector<AuthorId> hands;
  for (const auto& [author, entry] : people_)
    if (entry.hand && entry.role != Role::instructor) hands.push_back(author);
  return hands;
}

RoomSeq Presence::acknowledged_by(AuthorId author) const {
  const MutexLock lock(mutex_);
  const auto found = people_.find(author);
  return found == people_.end() ? RoomSeq{} : found->second.acknowledged;
}

std::string Presence::name_of(AuthorId author) const {
  const MutexLock lock(mutex_);
  const auto found = people_.find(author);
  return found == people_.end() ? std::string() : found->second.name;
}

void Presence::watch(PresenceSubscriber& subscriber) {
  const MutexLock lock(streams_mutex_);
  subscribers_.push_back(&subscriber);
  subscriber.changed();
  if (ended_) subscriber.end(*ended_);
}

void Presence::leave(PresenceSubscriber& subscriber) {
  const MutexLock lock(streams_mutex_);
  std::erase(subscribers_, &subscriber);
}

void Presence::end_streams(const std::string& why) {
  const MutexLock lock(streams_mutex_);
  ended_ = why;
  for (PresenceSubscriber* subscriber : subscribers_) subscriber->end(why);
}

std::size_t Presence::streams() const {
  const MutexLock lock(streams_mutex_);
  return subscribers_.size();
}

void Presence::publish(RoomSeq room_seq, Clock::time_point now) {
  if (now < next_) return;
  {
    const MutexLock lock(mutex_);
    room_seq_ = room_seq;
    if (std::exchange(published_, revision_) == revision_) return;
  }
  next_ = now + kApart;
  const MutexLock lock(streams_mutex_);
  for (PresenceSubscriber* subscriber : subscribers_) subscriber->changed();
}

Bytes Presence::news(PresenceCursor& cursor, AuthorId reader, const PeopleRights& rights) const {
  const MutexLock lock(mutex_);
  if (cursor.begun && cursor.revision == revision_) return nullptr;
  // Of the people who have left, the latest.
  std::vector<std::uint64_t> absent;
  for (const auto& [author, entry] : people_)
    if (entry.streams == 0) absent.push_back(entry.last_here);
  std::uint64_t least = 0;
  if (absent.size() > kMostAbsent) {
    std::ranges::nth_element(absent, absent.end() - static_cast<std::ptrdiff_t>(kMostAbsent));
    least = absent[absent.size() - kMostAbsent];
  }

  // A person's tool and window are separate authors. Events about one of them concern the other as well.
  const auto self = people_.find(reader);
  const std::string name = self == people_.end() ? std::string() : self->second.name;
  const auto is_readers = [&](AuthorId author) OSTEON_REQUIRES(mutex_) {
    const auto one = people_.find(author);
    return author == reader || (!name.empty() && one != people_.end() && one->second.name == name);
  };
  v1::WatchPeopleResponse out;
  for (const auto& [author, entry] : people_) {
    if (!rights.people || entry.revision <= cursor.revision || (entry.streams == 0 && entry.last_here < least))
      continue;
    v1::Person& person = *out.add_people();
    person.set_author(author.value);
    person.set_name(entry.name);
    person.set_role(static_cast<v1::Role>(entry.role));
    person.set_here(entry.streams > 0);
    person.set_hand(entry.hand);
    person.set_session_cuts(entry.cuts);
    if (rights.shots && entry.shots.shots > 0) *person.mutable_session_shots() = wire::to_wire(entry.shots);
    if (entry.look) *person.mutable_look() = wire::to_wire(*entry.look);
    if (!(is_readers(author) ? rights.own_supervision : rights.others_supervision)) continue;
    if (entry.decided) *person.mutable_supervision() = wire::to_wire(entry.supervision);
    person.set_decided_room_seq(entry.decided.value);
    person.set_decided_by(entry.decided_by.value);
    person.set_acknowledged_room_seq(entry.acknowledged.value);
  }
  std::set<std::uint32_t> drawn;
  for (const auto& [id, one] : annotations_) {
    drawn.insert(id);
    if (rights.drawings && one.revision > cursor.revision) *out.add_annotations() = wire::to_wire(one.annotation);
  }
  for (const std::uint32_t known : cursor.annotations)
    if (rights.drawings && !drawn.contains(known)) out.add_wiped(known);
  for (const ChatEntry& said : words_) {
    const bool own = !said.to || is_readers(said.to) || is_readers(said.from);
    if (said.number <= cursor.words || !(own ? rights.own_words : rights.others_words)) continue;
    v1::Words& words = *out.add_words();
    words.set_room_seq(said.seq.value);
    words.set_from(said.from.value);
    words.set_to(said.to.value);
    words.set_words(said.words);
  }
  for (const RunEntry& told : runs_)
    if (rights.shots && told.number > cursor.runs) *out.add_shots() = wire::to_wire(told.run);
  out.set_room_seq(room_seq_.value);
  out.set_complete(!cursor.begun);
  const bool nothing = cursor.begun && out.people().empty() && out.annotations().empty() && out.wiped().empty() &&
                       out.words().empty() && out.shots().empty();
  cursor = {revision_, words_said_, runs_told_, std::move(drawn), true};
  return nothing ? nullptr : serialised(out);
}

}  // namespace osteon
