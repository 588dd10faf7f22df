#include "tests/simulation/sim_client.hpp"

#include <algorithm>
#include <utility>

#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.pb.h"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {

using namespace std::chrono_literals;

namespace {

constexpr auto kCutTime = 8ms;
constexpr auto kFirstAnswer = 5s, kLaterAnswers = 1s;  // common/wire/room_client.cpp
constexpr std::size_t kWindowBytes = 64 * 1024;        // of HTTP/2

// Messages that end a program without a fault: its user starts it again.
bool may_be_told(const std::string& why) {
  return why.starts_with("the server stops") || why.starts_with("the room takes no more cuts") ||
         why.find("takes no more entries") != std::string::npos;  // of the journal
}

}  // namespace

SimClient::SimClient(VirtualTime& time, Ledger& ledger, SimServer& server, Datagrams& datagrams, std::uint64_t number,
                     std::uint64_t seed, const Case& bone, const HandPlan& hand, const DatagramPlan& plan,
                     Breakage breakage)
    : time_(time),
      ledger_(ledger),
      server_(server),
      datagrams_(datagrams),
      number_(number),
      random_(seed),
      path_(time, seed + 1, {}),
      plan_(plan),
      bone_(bone),
      hand_(hand),
      breakage_(breakage),
      cuts_left_(hand.cuts) {}

void SimClient::set_ways() {
  const Endpoint own = node(number_, port_), room = node(Datagrams::kServer);
  PathQuality up = plan_.quality, down = plan_.quality;
  if (plan_.up_blocked || up_stopped_ > 0) up.loss = 1;
  if (plan_.down_blocked || down_stopped_ > 0) down.loss = 1;
  datagrams_.network().set_quality(own, room, up);
  datagrams_.network().set_quality(room, own, down);
}

void SimClient::move() {
  if (!fast_) return;
  ++port_;
  set_ways();
  fast_->move(node(number_, port_));
}

void SimClient::stop_datagrams(bool up, bool down, Time from, Time until) {
  const auto add = [this, up, down](int one) {
    up_stopped_ += up ? one : 0;
    down_stopped_ += down ? one : 0;
    set_ways();
  };
  time_.post(from, [add] { add(1); });
  time_.post(until, [add] { add(-1); });
}

void SimClient::block_datagrams(bool up, bool down) {
  plan_.up_blocked |= up;
  plan_.down_blocked |= down;
  set_ways();
}

void SimClient::heal() {
  path_.set({});
  path_.heal();
  plan_.quality = {.delay = 1ms};
  up_stopped_ = down_stopped_ = 0;
  set_ways();
  held_back_until_ = requests_there_;
  if (stream_ && stream_->delayed_until() != Time::max())
    held_back_until_ = std::max(held_back_until_, stream_->delayed_until());
}

template <class Call>
void SimClient::later(Time in, Call call) {
  time_.post_in(in, [this, life = life_, call = std::move(call)]() mutable {
    if (life == life_) call();
  });
}

// One request and its answer. Error unavailable: no answer came. Any other error: the server's own.
template <class Answer>
void SimClient::ask(std::function<void(std::function<void(const Result<Answer>&)>)> request, Time patience,
                    std::function<void(const Result<Answer>&)> heard) {
  const auto over = std::make_shared<bool>(false);  // shared by everything that may finish first
  const auto finish = [this, over, life = life_, heard = std::move(heard)](const Result<Answer>& answer) {
    if (!std::exchange(*over, true) && life == life_) heard(answer);
  };
  time_.post_in(patience, [finish] { finish(failure(ErrorCode::unavailable, "no answer")); });
  const std::optional<Time> there = path_.arrival();
  if (!there) return;
  requests_there_ = std::max(requests_there_, *there);
  time_.post(*there, [this, finish, request = std::move(request)] {
    const auto back = [this, finish](const Result<Answer>& answer) {
      if (const std::optional<Time> here = path_.arrival()) time_.post(*here, [finish, answer] { finish(answer); });
    };
    if (!server_.up()) return back(failure(ErrorCode::unavailable, "nobody answers"));
    request([back](const Result<Answer>& answer) {
      if (answer || answer.error().code != ErrorCode::unavailable) return back(answer);
      back(failure(ErrorCode::unsupported, answer.error().message));  // FAILED_PRECONDITION: the server's decision
    });
  });
}

void SimClient::start() {
  ++programs_;
  room_.reset();
  stream_.reset();
  underway_.emplace(kMostUnderway);
  backoff_.emplace(random_.index(1 << 30), BackoffBounds{.least = 20ms, .most = 2s});
  tools_ = std::make_shared<ToolBox>();  // the room says which tools it has
  replica_.emplace(bone_, BodyId{0}, tools_);
  watch_ = {};
  health_ = haptic::RoomHealth::follows;
  from_room_.clear();
  renewed_.clear();
  own_.clear();
  felt_.clear();
  held_ = {};
  work_planned_ = bone_is_here_ = interrupted_ = heard_ = false;
  join();
}

void SimClient::start_anew() {
  if (stream_) stream_->leave(SimStream::client);
  fast_.reset();
  ++life_;
  later(drawn(random_, 300ms, 2s), [this] { start(); });
}

void SimClient::lost(const std::string& why) {
  ledger_.check(may_be_told(why), Invariant::served, "a client was turned away: " + why);
  start_anew();
}

void SimClient::leave() {
  if (stream_) stream_->leave(SimStream::client);
  stream_.reset();
  fast_.reset();
  gone_ = true;
  ++life_;
}

void SimClient::join() {
  // A person with a name has the same name after a restart. The others have none.
  if (!user_) user_ = random_.unit() < 0.7 ? "user " + std::to_string(number_) : "";
  const std::string user = *user_;
  const SimServer::JoinRequest request{.name = user, .resume = {}, .secret = {}, .kept = {}};
  ask<SimServer::Joined>([this, request](auto answer) { server_.join(request, answer); }, kFirstAnswer,
                         [this](const Result<SimServer::Joined>& room) {
                           if (room) return joined(*room);
                           if (room.error().code != ErrorCode::unavailable) return lost(room.error().message);
                           later(drawn(random_, 100ms, 1s), [this] { join(); });
                         });
}

void SimClient::joined(const SimServer::Joined& room) {
  room_ = room;
  lease_epoch_ = room.lease_epoch;
  reader_.emplace(
      room.author, tools_, callbacks(),
      [this](std::uint64_t author_seq) {
        ledger_.told_decided(room_->author, author_seq);
        if (fast_) fast_->decided(author_seq);
        underway_->decided(author_seq);
      },
      [this](std::uint64_t author_seq) {
        ledger_.told_decided(room_->author, author_seq);
        underway_->go_on(author_seq);
        later(drawn(random_, 0ns, 1ms), [this] { send(); });  // its writer wakes up
      });
  open_line();
  later(drawn(random_, 0ns, 100ms), [this] { move_hand(); });
}

void SimClient::open_line() {
  stream_ = std::make_shared<SimStream>(path_, random_.unit() < 0.2 ? 2048 : kWindowBytes);
  underway_->stop();
  reader_->begin();
  offer_.reset();
  numbered_tools_.clear();
  fast_.reset();
  said_.clear();
  const auto on_line = [this, life = life_, line = stream_.get()](auto call) {
    if (life == life_ && stream_.get() == line) call();
  };
  stream_->listen(SimStream::client,
                  {.message = [this, on_line](std::string bytes) { on_line([&] { hear(bytes); }); },
                   .writable = [this, on_line] { on_line([&] { send(); }); },
                   .ended = [this, on_line](const Ending& ending) { on_line([&] { line_ended(ending); }); }});
  stream_->stop_reading(SimStream::server);
  v1::SessionRequest request;
  request.mutable_open()->set_author(room_->author.value);
  request.mutable_open()->set_server_epoch(room_->server_epoch);
  request.mutable_open()->set_secret(room_->secret);
  stream_->write(SimStream::client, request.SerializeAsString());
  const std::optional<Time> there = path_.arrival();
  if (!there) return stream_->break_off("the server cannot be reached");
  time_.post(*there, [this, line = stream_] {
    server_.accept(line);
    line->read_on(SimStream::server);
  });
}

void SimClient::line_ended(const Ending& ending) {
  fast_.reset();
  if (ending.stands) return lost(ending.why);
  pass(Interrupted{});
  come_again();
}

void SimClient::come_again() {
  later(backoff_->next(), [this] {
    SimServer::JoinRequest request{.name = {}, .resume = room_->author, .secret = room_->secret, .kept = {}};
    if (const auto& kept = reader_->kept()) request.kept = Witness{{kept->room_seq, kept->chain}, kept->seal};
    ask<SimServer::Joined>([this, request](auto answer) { server_.join(request, answer); }, kLaterAnswers,
                           [this](const Result<SimServer::Joined>& again) {
                             if (!again && again.error().code == ErrorCode::unavailable) return come_again();
                             if (!again) return lost(again.error().message);
                             backoff_->reset();
                             room_ = *again;
                             ++resumed_;
                             open_line();
                           });
  });
}

void SimClient::send() {
  if (!stream_) return;
  while (stream_->writable(SimStream::client)) {
    const std::optional<Cut> cut = underway_->take_cut();
    if (!cut) return;
    if (fast_ && fast_->send(*cut)) continue;
    v1::SessionRequest request;
    *request.mutable_cut() = wire::to_wire(*cut);
    stream_->write(SimStream::client, request.SerializeAsString());
  }
}

// Messages of a stream for the session itself.
void SimClient::follow(const v1::SessionResponse& response) {
  if (response.has_link()) offer_ = response.link();
  if (response.has_tool() && response.tool().tool_number() != 0)
    if (const Result<Digest> tool = wire::digest_from_wire(response.tool().tool().tool_hash())) {
      numbered_tools_.emplace_back(response.tool().tool_number(), *tool);
      if (fast_) fast_->know_tool(response.tool().tool_number(), *tool);
    }
  if (response.has_complete()) open_fast_path(response.complete().decided_author_seq());
  if (fast_ && response.index() != 0) fast_->received(response.index());
}

void SimClient::open_fast_path(std::uint64_t decided) {
  if (!offer_ || !plan_.wanted) return;
  const auto bytes_of = [](const std::string& text) {
    return std::span<const std::uint8_t>(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  };
  const std::optional<SealKey> up = key_of(bytes_of(offer_->key_up())), down = key_of(bytes_of(offer_->key_down()));
  ledger_.check(up && down, Invariant::served, "the room offers a fast path without keys");
  if (!up || !down) return;
  ++port_;
  set_ways();
  fast_ = std::make_unique<SimFastPath>(
      datagrams_, random_.index(1 << 30), node(number_, port_), SessionKeys{offer_->session(), *up, *down}, decided + 1,
      plan_.link, plan_.clock_ahead,
      SimFastPath::Hears{.entry = [this](wire::IndexedEntry entry) { hear_entry(std::move(entry)); },
                         .dead =
                             [this] {
                               underway_->again();
                               send();
                             }});
  for (const auto& [number, tool] : numbered_tools_) fast_->know_tool(number, tool);
}

void SimClient::hear_entry(wire::IndexedEntry entry) {
  if (entry.entry.kind != wire::SessionEntryKind::streamed) {
    ++datagrams_.counts().entries;
    said_.emplace(entry.index, entry.entry);
  }
  by_datagram_ = true;
  const Result<void> taken = reader_->take(std::move(entry));
  by_datagram_ = false;
  ledger_.check(taken.has_value(), Invariant::datagrams, "an entry that came in a datagram is not taken");
}

void SimClient::compare(const v1::SessionResponse& response) {
  const auto said = said_.find(response.index());
  if (response.index() == 0 || said == said_.end()) return;
  const wire::SessionEntry& entry = said->second;
  const bool same = [&] {
    if (response.has_committed()) {
      const Result<Cut> cut = wire::from_wire(response.committed().cut());
      return entry.kind == wire::SessionEntryKind::committed &&
             entry.room_seq.value == response.committed().room_seq() && cut && *cut == entry.cut;
    }
    if (response.has_rejected())
      return entry.kind == wire::SessionEntryKind::rejected && entry.room_seq.value == response.rejected().room_seq() &&
             entry.author_seq == response.rejected().author_seq() &&
             entry.lease_epoch == response.rejected().lease_epoch();
    if (response.has_supervised()) {
      const Result<Restrictions> decided = wire::from_wire(response.supervised().supervision());
      return entry.kind == wire::SessionEntryKind::supervised &&
             entry.room_seq.value == response.supervised().room_seq() &&
             entry.lease_epoch == response.supervised().lease_epoch() && decided && *decided == entry.supervision &&
             entry.by == Decider{AuthorId{response.supervised().decided_by()}, response.supervised().decided_by_name()};
    }
    return false;
  }();
  ledger_.check(same, Invariant::datagrams,
                "the stream says another entry " + std::to_string(response.index()) + " than datagrams did");
}

void SimClient::hear(const std::string& bytes) {
  v1::SessionResponse response;
  ledger_.check(response.ParseFromString(bytes), Invariant::served, "a message cannot be parsed");
  compare(response);
  follow(response);
  if (const Result<void> taken = reader_->take(std::move(response)); !taken)
    lost("it sent what no correct server sends: " + taken.error().message);
}

RoomCallbacks SimClient::callbacks() {
  return {.message = [this](RoomMessage&& message) {
    std::visit([this](const auto& one) { note(one); }, message);
    pass(std::move(message));
  }};
}

void SimClient::note(const RoomAtJoin& room) {
  ledger_.told_up_to(room.contained);
  const std::size_t seqs = room.decided_seqs.size();
  ledger_.check(seqs == std::min<std::size_t>(room.decided_author_seq, kMostUnderway), Invariant::served,
                "a session begins with the sequence numbers of " + std::to_string(seqs) + " cuts");
  for (std::uint64_t own = 1; own <= room.decided_author_seq; ++own)
    if (const std::optional<RoomSeq> seq = room.seq_of(own)) ledger_.acknowledged_seq(*seq, room_->author, own);
}
void SimClient::note(const CutCommitted& committed) { ledger_.told_committed(committed.seq, committed.cut); }
void SimClient::note(const CutRejected& rejected) {
  ledger_.told_rejected(rejected.seq, room_->author, rejected.author_seq);
}
void SimClient::note(const BonePart& part) { ledger_.told_up_to(part.seq); }
void SimClient::note(const SceneSet& scene) { ledger_.told_up_to(scene.seq); }
void SimClient::note(const HandSupervised& decided) {
  if (decided.seq) ledger_.told_event(decided.seq, EventKind::supervise);
}
void SimClient::note(const ChatReceived& said) { ledger_.told_event(said.seq, EventKind::words); }
void SimClient::note(const EventNoted& noted) { ledger_.told_up_to(noted.seq); }

void SimClient::pass(RoomMessage&& message) {
  from_room_.push_back({std::move(message), by_datagram_});
  if (!std::exchange(work_planned_, true)) later(drawn(random_, 0ns, 4ms), [this] { work(); });
}

void SimClient::work() {
  work_planned_ = false;
  heard_ = !from_room_.empty();
  while (!from_room_.empty()) {
    const Received received = std::move(from_room_.front());
    from_room_.pop_front();
    std::visit([this](const auto& one) { take(one); }, received.message);
    if (const auto* committed = std::get_if<CutCommitted>(&received.message)) measure(*committed, received.by_datagram);
  }
  replica_->settle();
  (void)replica_->take_changes();
  ledger_.check(replica_->unconfirmed() == felt_.size(), Invariant::felt,
                "the hand feels " + std::to_string(replica_->unconfirmed()) +
                    " undecided cuts of its own where there are " + std::to_string(felt_.size()));
  watch();
}

void SimClient::take(const FieldLeaf& leaf) {
  if (interrupted_)
    renewed_.push_back(leaf);
  else
    replica_->restore(leaf);
}

void SimClient::take(const Interrupted&) {
  interrupted_ = bone_is_here_;
  renewed_.clear();
  // The leaves received so far may be out of date: bone may have come back since.
  if (!bone_is_here_) replica_.emplace(bone_, BodyId{0}, tools_);
}

void SimClient::take(const RoomAtJoin& room) {
  std::erase_if(felt_, [&](const auto& cut) { return cut.first <= room.decided_author_seq; });
  if (interrupted_ && breakage_ != Breakage::replica) {
    replica_->renew(room.contained, room.bodies, renewed_, room.decided_author_seq);
    follow_lease(room.lease_epoch);
  } else {
    for (const FieldLeaf& leaf : renewed_) replica_->restore(leaf);
    replica_->change(room.contained, room.bodies, {});
    replica_->joined(room.contained);
    lease_epoch_ = room.lease_epoch;
  }
  interrupted_ = false;
  renewed_.clear();
  bone_is_here_ = true;
}

void SimClient::take(const CutCommitted& committed) {
  if (committed.cut.author == room_->author) felt_.erase(committed.cut.author_seq);
  replica_->commit(committed.seq, committed.cut, committed.cut.author == room_->author);
}

void SimClient::measure(const CutCommitted& committed, bool by_datagram) {
  const std::optional<Time> age = ledger_.age(committed.cut, time_.now());
  if (age && committed.cut.author != room_->author)
    (by_datagram ? felt_by_datagram_ms_ : felt_by_stream_ms_)
        .push_back(std::chrono::duration<float, std::milli>(*age).count());
}

void SimClient::take(const CutRejected& rejected) {
  felt_.erase(rejected.author_seq);
  replica_->reject(rejected.seq, rejected.author_seq);
  follow_lease(rejected.lease_epoch);
}

void SimClient::take(const BonePart& part) {
  replica_->change(part.seq, part.bodies, part.leaves);
  follow_lease(part.lease_epoch);
}

// If restrictions arrive before the leaves, their lease comes with the leaves.
void SimClient::take(const HandSupervised& decided) {
  held_ = decided.supervision;
  if (!decided.seq) return;
  replica_->note(decided.seq);
  follow_lease(decided.lease_epoch);
}

void SimClient::follow_lease(std::uint64_t epoch) {
  if (epoch <= lease_epoch_) return;
  lease_epoch_ = epoch;
  replica_->lease(epoch);
  std::erase_if(felt_, [&](const auto& cut) { return cut.second < epoch; });
}

void SimClient::watch() {
  const bool silent = interrupted_ && replica_->unconfirmed() == 0;
  const double now_s = std::chrono::duration<double>(time_.now()).count();
  health_ = watch_.update(now_s, std::exchange(heard_, false) && !interrupted_, silent ? 1 : replica_->unconfirmed());
  if (health_ == haptic::RoomHealth::lost) lost("the server stops answering");
}

bool SimClient::settled() const {
  return room_ && stream_ && stream_->at_rest() && bone_is_here_ && !interrupted_ && from_room_.empty() &&
         underway_->undecided() == 0 && replica_->unconfirmed() == 0;
}

bool SimClient::connected() const {
  return time_.now() >= held_back_until_ &&
         (gone_ || (room_ && stream_ && stream_->open() && bone_is_here_ && !interrupted_));
}

std::string SimClient::standing() const {
  if (gone_) return "gone";
  if (!room_) return "not joined";
  return "author " + std::to_string(room_->author.value) + ", " + (bone_is_here_ ? "" : "without its bone, ") +
         (interrupted_ ? "interrupted, " : "") + std::to_string(underway_->undecided()) + " cuts undecided, " +
         std::to_string(replica_->unconfirmed()) + " unconfirmed, at sequence number " +
         std::to_string(replica_->room_seq().value);
}

// The hand's loop: a run of cuts, a pause, sometimes another action.
void SimClient::move_hand() {
  watch();
  if (resting_ || cuts_left_ <= 0) return later(250ms, [this] { move_hand(); });
  if (!bone_is_here_ || health_ != haptic::RoomHealth::follows) return later(50ms, [this] { move_hand(); });
  const auto at = [&] { return random_.between(-hand_.reach_mm, hand_.reach_mm); };
  at_ = quantise(pose_along({at(), at(), random_.between(-1.0, 0.0)}, {0, 0, -1}));
  cut(1 + static_cast<int>(random_.index(static_cast<std::size_t>(hand_.run))));
}

void SimClient::cut(int left) {
  watch();
  const bool may = health_ == haptic::RoomHealth::follows && underway_->undecided() < kMostUnderway;
  if (left == 0 || resting_ || cuts_left_ <= 0 || !may) {
    if (!resting_) do_something_else();
    return later(drawn(random_, 10ms, hand_.pause_most), [this] { move_hand(); });
  }
  --cuts_left_;
  ++cuts_made_;
  const Pose from = dequantise(at_);
  const Vec3 to =
      from.position_mm + Vec3{random_.between(-0.4, 0.4), random_.between(-0.4, 0.4), random_.between(-0.2, 0.1)};
  Cut one =
      straight_cut(hand_.tools[random_.index(hand_.tools.size())], from.position_mm, to, {0, 0, -1}, own_.size() + 1);
  one.author = room_->author;
  one.lease_epoch = lease_epoch_;
  one.level = std::min(one.level, hand_.level);
  one.path_us = 8000;
  if (random_.unit() < hand_.beyond / 4) {
    // A cut that no room accepts.
    if (random_.unit() < 0.5)
      one.path.back().position[0] += 1 << 20;
    else
      one.spindle_rpm = 200'000;
  }
  at_ = quantise(pose_along(to, {0, 0, -1}));
  own_.push_back(one);
  ledger_.made(one, time_.now());
  const bool pushed = underway_->push(one);
  ledger_.check(pushed && underway_->undecided() <= kMostUnderway, Invariant::bounds,
                "cuts under way are beyond their bound");
  if (fast_) {
    CuttingState state;
    state.author = room_->author;
    state.state_seq = ++state_seq_;
    state.pose_bone_tool = dequantise(at_);
    state.phase = CuttingPhase::cutting;
    fast_->send(state);
  }
  send();
  replica_->add_own(one);
  felt_[one.author_seq] = one.lease_epoch;
  ledger_.check(replica_->unconfirmed() <= haptic::ConfirmationMonitor::kMostUnconfirmed + 1, Invariant::bounds,
                "a replica holds too much unconfirmed");
  later(kCutTime, [this, left] { cut(left - 1); });
}

void SimClient::do_something_else() {
  double which = random_.unit();
  const auto chance = [&](double share) {
    which -= share;
    return which < 0;
  };
  const std::size_t count = 1 + random_.index(3);
  if (chance(hand_.undo)) {
    const bool own = random_.unit() < 0.5;
    return change([count, own](Room& room, AuthorId by) { return room.undo_last(by, count, own ? by : AuthorId{}); });
  }
  if (chance(hand_.redo)) return change([count](Room& room, AuthorId by) { return room.redo_last(by, count); });
  if (chance(hand_.mark)) return change([](Room& room, AuthorId by) { return room.mark(by, "here"); });
  if (chance(hand_.supervise)) return supervise();
  if (chance(hand_.say)) return change([](Room& room, AuthorId by) { return room.say(by, {}, "well done"); });
  if (chance(hand_.again) && stream_ && underway_->may_go() && stream_->writable(SimStream::client)) {
    // Sent again although it is decided: for the server, the answer may have been lost.
    const std::size_t sent = own_.size() - underway_->undecided();
    if (sent == 0) return;
    v1::SessionRequest request;
    *request.mutable_cut() = wire::to_wire(own_[random_.index(sent)]);
    stream_->write(SimStream::client, request.SerializeAsString());
  }
}

// Every client is an instructor here, and no client obeys restrictions. Their cuts go on, so that the room must refuse
// them.
void SimClient::supervise() {
  Restrictions word;
  const double which = random_.unit();
  word.stopped = which < 0.2;
  if (which >= 0.2 && which < 0.3) word.taken_by = room_->author;
  if (which >= 0.3 && which < 0.4)
    word.zone = ZoneLimit{at_.position, 1 + static_cast<std::int32_t>(random_.index(2048))};
  if (which >= 0.4 && which < 0.5)
    word.tools = {find_tool(random_.unit() < 0.5 ? "burr-round-3.2" : "drill-3.2").value().hash()};
  if (which < 0.6) word.words = "as I say";
  const std::uint64_t pick = random_.index(1000);
  change([word, pick](Room& room, AuthorId by) -> Result<RoomEvent> {
    // One of the newest authors: older ones may have left.
    const AuthorId subject{room.authors() - pick % std::min<std::uint64_t>(room.authors(), 4)};
    Restrictions said = word;
    if (said.taken_by == subject) said.taken_by = {};
    return room.supervise(by, subject, said);
  });
}

void SimClient::change(std::function<Result<RoomEvent>(Room&, AuthorId)> change) {
  ask<RoomEvent>([this, change = std::move(change), by = room_->author](
                     auto answer) { server_.change([change, by](Room& room) { return change(room, by); }, answer); },
                 5s,
                 [this](const Result<RoomEvent>& event) {
                   if (event && event->room_seq) ledger_.told_event(event->room_seq, event->kind);
                   if (!event && event.error().code == ErrorCode::denied) ++denied_;
                 });
}

}  // namespace osteon::test
