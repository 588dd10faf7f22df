// Joins and sessions of a room: who joins, what is decided of their requests, and what is sent to everybody.
#include <algorithm>
#include <charconv>
#include <future>
#include <iterator>
#include <memory>

#include "common/wire/encoded_cut.hpp"
#include "server/rooms/runtime_impl.hpp"

namespace osteon {
namespace {

using Clock = RoomRuntime::Clock;

// Largest number of cuts whose results a session begins with. A haptic client never has more cuts with unknown results.
constexpr std::size_t kMostRepeatedResults = 1024;

}  // namespace

Error only_to_be_watched() {
  return {ErrorCode::unavailable,
          "this room shows what happened in another: it can be watched, with osteon-viewer, and not changed"};
}

// A name that cannot be read now is left empty.
std::map<std::uint32_t, std::string> RoomRuntime::Impl::names_of(RoomStore* store) {
  std::map<std::uint32_t, std::string> names;
  if (store == nullptr) return names;
  const Result<std::vector<Person>> people = store->people();
  if (!people) return names;
  for (const Person& person : *people) {
    std::uint32_t number = 0;
    const char* end = person.pseudonym.data() + person.pseudonym.size();
    if (std::from_chars(person.pseudonym.data(), end, number).ptr == end) names[number] = person.label;
  }
  return names;
}

void RoomRuntime::Impl::decide(QueuedCut& queued) {
  if (closed() || player)
    return later([subscriber = queued.subscriber](const Result<void>&) { subscriber->decided(); });
  const Clock::time_point taken = Clock::now();
  const auto encoded = wire::encoded(queued.cut);  // once: log entry and messages contain these bytes
  Result<Outcome> outcome = [&] {
    const WriterLock lock(room_mutex);
    Result<Outcome> decision = room.submit(queued.cut, encoded);
    room_seq = room.room_seq().value;
    if (cuts_during_copy && decision && decision->committed() && !decision->repeated)
      cuts_during_copy->push_back(queued.cut);
    return decision;
  }();
  if (!outcome)
    return later([subscriber = queued.subscriber, why = outcome.error()](const Result<void>&) {
      subscriber->refuse(why);
      subscriber->decided();
    });
  if (!outcome->report.changed_leaves.empty()) note_changed(queued.arrived);
  const Clock::time_point done = Clock::now();
  const bool newly = outcome->committed() && !outcome->repeated;
  if (newly) metrics.committed(queued.arrived, taken, done);
  if (!outcome->committed() && !outcome->repeated) metrics.rejected(outcome->rejection);
  SessionMessage message = outcome->committed() ? cut_message(outcome->room_seq, queued.cut, *encoded)
                                                : rejection_message(outcome->room_seq, queued.cut.author_seq,
                                                                    outcome->lease_epoch, outcome->rejection);
  publish_durable(room.time());
  later([this, subscriber = queued.subscriber, message = std::move(message), repeated = outcome->repeated,
         to_all = outcome->committed(), newly, done](const Result<void>& durable) {
    const Clock::time_point kept = Clock::now();
    if (durable) {
      const MutexLock lock(sessions_mutex);
      // The author may have come back on another stream meanwhile.
      const auto author = open_authors.find(subscriber->author());
      if (!repeated && to_all)
        sessions.each([&](SessionSubscriber& one) { one.enqueue(message); });
      else if (author != open_authors.end())
        repeated ? author->second->answer(message) : author->second->enqueue(message);
      if (!repeated && field_readers.size() > 0) {
        const SessionMessage said = to_all ? message : noted_message(message.seq, {});
        field_readers.each([&](FieldSubscriber& one) { one.enqueue(said); });
      }
    }
    if (durable && newly) metrics.acknowledged(done, kept, Clock::now());
    if (durable && newly) people.took_cut(subscriber->author());
    subscriber->decided();
  });
}

void RoomRuntime::Impl::decide(QueuedEvent& queued) {
  Result<RoomEvent> event = [&]() -> Result<RoomEvent> {
    if (const std::optional<Error> why = closed()) return tl::unexpected(*why);
    if (player) return tl::unexpected(only_to_be_watched());
    const WriterLock lock(room_mutex);
    Result<RoomEvent> decision = queued.change(room);
    room_seq = room.room_seq().value;
    return decision;
  }();
  std::vector<EventMessages> sent;
  if (event && event->room_seq) {
    sent.push_back({messages_of(*event), personal_message(*event)});
    event->leaves.clear();
    for (const RoomEvent& one : event->further) sent.push_back({messages_of(one), personal_message(one)});
    if (event->scene || event->bone) show_scene();
    if (event->bone) note_changed(queued.arrived);
  }
  later([this, sent = std::move(sent), event = std::move(event),
         answer = std::move(queued.answer)](const Result<void>& durable) {
    if (!durable) return answer(tl::unexpected(durable.error()));
    if (event) {
      people.take(*event);
      for (const RoomEvent& one : event->further) people.take(one);
    }
    {
      const MutexLock lock(sessions_mutex);
      if (event && event->tool && event->room_seq) {
        const std::uint32_t number = number_of(event->tool->hash);
        sessions.each([&](SessionSubscriber& subscriber) { subscriber.know_tool(number, event->tool->hash); });
      }
      for (const EventMessages& one : sent)
        for (const SessionMessage& message : one.messages) {
          sessions.each([&](SessionSubscriber& subscriber) {
            subscriber.enqueue(one.personal.is_for(subscriber.author()) ? *one.personal.message : message);
          });
          field_readers.each([&](FieldSubscriber& reader) { reader.enqueue(message); });
        }
    }
    answer(event);
  });
}

// [tick] Every second: the witness, up to which clients can rely on the room.
void RoomRuntime::Impl::publish_durable(std::chrono::nanoseconds now) {
  if (!store || now < next_durable) return;
  next_durable = now + std::chrono::seconds(1);
  later([this](const Result<void>& durable) {
    if (!durable) return;
    const SessionMessage message = durable_message(store->witness());
    const MutexLock lock(sessions_mutex);
    sessions.each([&](SessionSubscriber& subscriber) { subscriber.answer(message); });
  });
}

// [any thread] Tools get numbers when they are first sent, the same for all sessions.
std::uint32_t RoomRuntime::Impl::number_of(const Digest& tool) {
  const MutexLock lock(numbers_mutex);
  return tool_numbers.emplace(tool, static_cast<std::uint32_t>(tool_numbers.size() + 1)).first->second;
}

// [tick] What every session is sent for an event that is not a cut. Only this thread changes the room.
std::vector<SessionMessage> RoomRuntime::Impl::messages_of(const RoomEvent& event) {
  std::vector<SessionMessage> messages;
  if (event.tool) messages.push_back(tool_message(event.room_seq, event.tool->tool, number_of(event.tool->hash)));
  if (event.bone) messages = change_messages(event);
  if (event.scene) messages.push_back(scene_message(event.room_seq, room.items()));
  // So that there is no gap in the sequence numbers.
  if (messages.empty()) messages.push_back(noted_message(event.room_seq, event.mark));
  return messages;
}

RoomRuntime::Impl::Personal RoomRuntime::Impl::personal_message(const RoomEvent& event) {
  if (const auto* decided = std::get_if<SuperviseEntry>(&event.people)) {
    const Decider by{event.author, people.name_of(event.author)};
    return {decided->subject, supervised_message(event.room_seq, decided->supervision, event.lease_epoch, by)};
  }
  if (const auto* said = std::get_if<WordsEntry>(&event.people))
    return {said->to, said_message(event.room_seq, event.author, *said)};
  return {};
}

// [thread of the state publisher]
bool RoomRuntime::Impl::send_partners(const std::vector<CuttingState>& states) {
  bool owed = false;
  const MutexLock lock(sessions_mutex);
  sessions.each([&](SessionSubscriber& subscriber) { owed |= subscriber.show_partners(states); });
  return owed;
}

void RoomRuntime::Impl::end_sessions(const std::string& why, bool to_return) {
  const MutexLock lock(sessions_mutex);
  ended = why;
  may_return = to_return;
  sessions.each([&](SessionSubscriber& subscriber) { to_return ? subscriber.replaced(why) : subscriber.end(why); });
  field_readers.each([&](FieldSubscriber& reader) { to_return ? reader.replaced(why) : reader.end(why); });
}

bool RoomRuntime::Impl::ends(FieldSubscriber& reader) const {
  if (ended) may_return ? reader.replaced(*ended) : reader.end(*ended);
  return ended.has_value();
}

Result<FieldSubscriber*> RoomRuntime::Impl::place_for(const FieldSubscriber& reader, std::size_t leaf_bytes) const {
  FieldSubscriber* before = nullptr;
  std::size_t waiting = 0;
  field_readers.each([&](FieldSubscriber& one) {
    if (one.author() == reader.author())
      before = &one;
    else
      waiting += one.leaf_bytes();
  });
  if (!before && field_readers.size() >= kMostFieldReaders)
    return failure(ErrorCode::exhausted, std::to_string(kMostFieldReaders) +
                                             " viewers show the inside of this bone already; close one of them");
  if (waiting > 0 && waiting + leaf_bytes > rates_.most_leaf_bytes)
    return failure(ErrorCode::exhausted, "the inside of the bone is being sent to others; ask again");
  return before;
}

Result<void> RoomRuntime::check_witness(const Witness& kept) {
  if (impl_->player) return {};
  if (impl_->store) return impl_->store->check_witness(kept);
  return failure(ErrorCode::unavailable,
                 "the room begins anew: it has no journal, and none of the " + std::to_string(kept.head.seq.value) +
                     " events that were acknowledged to you; start again to join it as it is now");
}

Result<void> RoomRuntime::resume(AuthorId author, const Digest& secret, const std::optional<Witness>& kept,
                                 std::optional<Role> role) {
  if (impl_->player) return tl::unexpected(only_to_be_watched());
  if (kept)
    if (Result<void> has = check_witness(*kept); !has) return has;
  const ReaderLock lock(impl_->room_mutex);
  if (!impl_->room.proves(author, secret))
    return failure(ErrorCode::invalid_input, "the room does not know author " + std::to_string(author.value) +
                                                 " of an earlier connection: " +
                                                 (impl_->store ? "its journal begins anew, or ends before that join"
                                                               : "without a journal it ends with its server") +
                                                 "; start again to join it as it is now");
  // What an author may undo depends on the role of the join.
  if (role && impl_->room.people().role(author) != *role)
    return failure(ErrorCode::denied,
                   "your role here is another than when author " + std::to_string(author.value) + " joined; join anew");
  return {};
}

void RoomRuntime::join(MemberKind kind, const std::string& name, const Digest& secret, Role role,
                       std::function<void(const Result<AuthorId>&)> answer) {
  if (impl_->player) {
    if (kind == MemberKind::watcher) return answer(AuthorId{impl_->next_watcher++});
    return answer(tl::unexpected(only_to_be_watched()));
  }
  std::uint32_t person = 0;
  if (impl_->store && !name.empty()) {
    const Result<std::uint32_t> known = impl_->store->person(name);
    if (!known) return answer(tl::unexpected(known.error()));
    person = *known;
  }
  queue_event(
      [=, this](Room& room) -> Result<RoomEvent> {
        return room.admit(kind, impl_->store ? person : impl_->person_of(name), secret, role);
      },
      [this, kind, name, role, answer = std::move(answer)](const Result<RoomEvent>& event) {
        if (!event) return answer(tl::unexpected(event.error()));
        impl_->people.joined(event->author, name, role, kind == MemberKind::surgeon);
        for (const RoomEvent& held : event->further) impl_->people.take(held);
        impl_->authors = std::max<std::uint64_t>(impl_->authors, event->author.value);
        answer(event->author);
      });
}

Result<AuthorId> RoomRuntime::join(MemberKind kind, const std::string& name, const Digest& secret, Role role) {
  std::promise<Result<AuthorId>> answer;
  join(kind, name, secret, role, [&](const Result<AuthorId>& author) { answer.set_value(author); });
  return answer.get_future().get();
}

SessionStart RoomRuntime::Impl::start_of_field() {
  SessionStart start;
  start.contained = room.room_seq();
  start.bodies = room.bodies();
  for (const ToolBox::Entry* entry : room.tools()->entries())
    start.before.push_back(tool_message(RoomSeq{}, entry->tool, number_of(entry->hash)));
  start.complete = complete_message(start, {});
  return start;
}

SessionStart RoomRuntime::Impl::start_of_session(AuthorId author, const People::Supervised& held, const Decider& by) {
  SessionStart start = start_of_field();
  start.decided_author_seq = room.decided(author);
  start.lease_epoch = room.lease_epoch(author);
  start.before.push_back(scene_message(start.contained, room.items()));
  // The client is sent its restrictions before it can cut, also the message that there are none any more.
  if (held.seq) start.before.push_back(supervised_message(RoomSeq{}, held.supervision, start.lease_epoch, by));
  start.complete = complete_message(start, room.decided_seqs(author, kMostRepeatedResults));
  return start;
}

std::vector<FieldLeaf> RoomRuntime::Impl::places_of_leaves() const {
  std::vector<FieldLeaf> leaves;
  for (const BodyId body : room.bodies())
    std::ranges::move(room.find_field(body)->leaf_places(), std::back_inserter(leaves));
  return leaves;
}

template <class Receiver>
void RoomRuntime::Impl::give_leaves(RoomRuntime& runtime, const std::shared_ptr<Receiver>& receiver,
                                    std::vector<FieldLeaf> leaves) {
  read_leaves(leaves);
  if (!store) return receiver->set_leaves(std::move(leaves));
  // What the receiver begins with may not be durable yet, and `complete` says that it is decided. So the receiver
  // sends nothing before it has the leaves, and it gets them once everything is durable. Datagrams do not come sooner
  // either, since their keys are sent with the rest.
  runtime.queue_event([](Room&) { return RoomEvent{}; },
                      [receiver, leaves = std::move(leaves)](const Result<RoomEvent>& kept) mutable {
                        if (kept) receiver->set_leaves(std::move(leaves));
                      });
}

Result<void> RoomRuntime::open_session(const std::shared_ptr<SessionSubscriber>& subscriber, const Digest& secret) {
  if (impl_->player) return tl::unexpected(only_to_be_watched());
  std::vector<FieldLeaf> leaves;
  bool again = false;
  {
    // Held until the subscriber is in the list. So every entry after `contained` is committed, and enqueued, later.
    const ReaderLock room_lock(impl_->room_mutex);
    if (!impl_->room.may_cut(subscriber->author()))
      return failure(ErrorCode::invalid_input, "open.author " + std::to_string(subscriber->author().value) +
                                                   " has not joined this room as a haptic client; call Join first");
    leaves = impl_->places_of_leaves();
    const std::vector<const ToolBox::Entry*> tools = impl_->room.tools()->entries();
    const People::Supervised& held = impl_->room.people().supervised(subscriber->author());
    const Decider by{held.by, impl_->people.name_of(held.by)};
    SessionStart start = impl_->start_of_session(subscriber->author(), held, by);
    const std::uint64_t lease_epoch = start.lease_epoch;
    const MutexLock lock(impl_->sessions_mutex);
    SessionSubscriber*& open = impl_->open_authors[subscriber->author()];
    if (open && !impl_->room.proves(subscriber->author(), secret))
      return failure(ErrorCode::invalid_input, "open.author " + std::to_string(subscriber->author().value) +
                                                   " has an open session; join again for another");
    if (open) {
      open->replaced("another connection of the same client has replaced it");
      impl_->sessions.remove(*open);
      again = true;
    }
    open = subscriber.get();
    impl_->sessions.add(*subscriber);
    if (!again) impl_->people.came(subscriber->author());  // before it can leave
    if (impl_->mount && subscriber->feels_bone()) impl_->mount->join(subscriber->author());
    subscriber->begin(std::move(start));
    for (const ToolBox::Entry* entry : tools) subscriber->know_tool(impl_->number_of(entry->hash), entry->hash);
    if (held.seq)
      subscriber->hold({.room_seq = {},
                        .kind = wire::SessionEntryKind::supervised,
                        .lease_epoch = lease_epoch,
                        .supervision = held.supervision,
                        .by = by});
    if (impl_->redial) subscriber->answer(*impl_->redial);
    if (impl_->ended) impl_->may_return ? subscriber->replaced(*impl_->ended) : subscriber->end(*impl_->ended);
  }
  impl_->give_leaves(*this, subscriber, std::move(leaves));
  return {};
}

Result<void> RoomRuntime::watch_field(const std::shared_ptr<FieldSubscriber>& reader) {
  if (impl_->player)
    return failure(ErrorCode::unavailable,
                   "this room shows what happened in another: it sends its surface and not the inside of its bone");
  {
    // Whoever asks in vain costs no work under the room's lock.
    const MutexLock lock(impl_->sessions_mutex);
    if (impl_->ends(*reader)) return {};
    if (const Result<FieldSubscriber*> place = impl_->place_for(*reader); !place) return tl::unexpected(place.error());
  }
  std::vector<FieldLeaf> leaves;
  {
    // Held until the reader is in the list, as for sessions.
    const ReaderLock room_lock(impl_->room_mutex);
    leaves = impl_->places_of_leaves();
    SessionStart start = impl_->start_of_field();
    start.leaf_bytes = leaves.size() * std::size_t{kLeafVoxels} * sizeof(FieldLeaf{}.values[0]);
    const MutexLock lock(impl_->sessions_mutex);
    if (impl_->ends(*reader)) return {};
    const Result<FieldSubscriber*> before = impl_->place_for(*reader, start.leaf_bytes);
    if (!before) return tl::unexpected(before.error());
    if (*before) {
      (*before)->replaced("another connection of the same viewer has replaced it");
      impl_->field_readers.remove(**before);
    } else {
      impl_->people.came(reader->author());
    }
    impl_->field_readers.add(*reader);
    reader->begin(std::move(start));
  }
  impl_->give_leaves(*this, reader, std::move(leaves));
  return {};
}

void RoomRuntime::watch_mesh(MeshSubscriber& subscriber, const std::optional<ViewFrustum>& look) {
  impl_->people.came(subscriber.author());
  if (look) impl_->people.looked(subscriber.author(), *look);
  impl_->mesh.watch(subscriber, look);
}
void RoomRuntime::look(AuthorId viewer, const ViewFrustum& from) {
  impl_->mesh.look(viewer, from);
  impl_->people.looked(viewer, from);
}
bool RoomRuntime::draws_near() const { return impl_->mesh.draws_near(); }
void RoomRuntime::watch_cutting(StateSubscriber& subscriber) {
  impl_->people.came(subscriber.author());
  impl_->board.watch(subscriber);
}
void RoomRuntime::leave(MeshSubscriber& subscriber) {
  impl_->mesh.leave(subscriber);
  impl_->people.went(subscriber.author());
}
void RoomRuntime::leave(StateSubscriber& subscriber) {
  impl_->board.leave(subscriber);
  impl_->people.went(subscriber.author());
}
Presence& RoomRuntime::people() { return impl_->people; }
void RoomRuntime::publish_state(CuttingState state) {
  impl_->board.update(std::move(state));
  // A driven room does nothing between its ticks.
  if (!impl_->driven()) impl_->board.publish_soon(RoomSeq{impl_->room_seq});
}
void RoomRuntime::push_bone(AuthorId author, const MountLoad& push) {
  if (impl_->mount) impl_->mount->push(author, push);
}

void RoomRuntime::leave(SessionSubscriber& subscriber) {
  bool was_open = false;
  {
    const MutexLock lock(impl_->sessions_mutex);
    was_open = impl_->sessions.remove(subscriber);
    if (was_open) impl_->open_authors.erase(subscriber.author());
    if (was_open && impl_->mount) impl_->mount->leave(subscriber.author());
  }
  if (!was_open) return;
  impl_->board.session_over(subscriber.author());
  impl_->people.went(subscriber.author());
}

void RoomRuntime::leave(FieldSubscriber& reader) {
  {
    const MutexLock lock(impl_->sessions_mutex);
    if (!impl_->field_readers.remove(reader)) return;
  }
  impl_->people.went(reader.author());
}

void RoomRuntime::ask_to_redial(std::chrono::milliseconds after, const std::string& why) {
  const SessionMessage message = redial_message(after, why);
  const MutexLock lock(impl_->sessions_mutex);
  impl_->redial = message;
  impl_->sessions.each([&](SessionSubscriber& subscriber) { subscriber.answer(message); });
}

void RoomRuntime::send_away(const std::string& why) {
  impl_->end_sessions(why, true);
  impl_->mesh.end_streams(why);
  impl_->board.end_streams(why);
  impl_->people.end_streams(why);
}

void RoomRuntime::end_streams(const std::string& why) {
  impl_->end_sessions(why);
  impl_->mesh.end_streams(why);
  impl_->board.end_streams(why);
  impl_->people.end_streams(why);
}

}  // namespace osteon
