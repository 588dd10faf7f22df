#include "tests/simulation/sim_server.hpp"

#include <algorithm>
#include <utility>

#include "common/wire/convert.hpp"
#include "osteon/v1/cutting.pb.h"
#include "server/journal/maintenance.hpp"
#include "server/publish/session_messages.hpp"
#include "server/rpc/services.hpp"

namespace osteon::test {
namespace {

using namespace std::chrono_literals;

constexpr auto kTick = std::chrono::nanoseconds(1'000'000'000 / 120);

std::unique_ptr<RoomRuntime> driven_host(Room room, RoomStore& store) {
  return std::make_unique<RoomRuntime>(std::move(room), RuntimeRates{.tick = 0ns}, nullptr, Detail::automatic, &store);
}

std::string joined(const MessageParts& parts) {
  std::string message;
  for (const Bytes& part : parts) message += *part;
  return message;
}

}  // namespace

std::shared_ptr<ToolBox> few_tools() {
  static const std::vector<Tool> tools{find_tool("burr-round-3.2").value(), find_tool("drill-3.2").value()};
  auto box = std::make_shared<ToolBox>();
  for (const Tool& tool : tools) box->add(tool);
  return box;
}

// Does what SessionStream of server/rpc/session_service.cpp does between gRPC and the runtime.
class SimServer::Session final : public SessionSubscriber,
                                 public std::enable_shared_from_this<Session>,
                                 private SessionLink::Receiver {
 public:
  static constexpr int kMaxQueuedCuts = 256;
  static constexpr int kMostUndecided = 1024;  // of a client: what may come in datagrams while nothing is decided

  Session(SimServer& server, std::shared_ptr<SimStream> stream) : server_(server), stream_(std::move(stream)) {}

  void start() {
    const auto self = weak_from_this();
    const auto with = [self](auto call) {
      if (const auto session = self.lock()) call(*session);
    };
    stream_->listen(SimStream::server,
                    {.message = [with](std::string bytes) { with([&](Session& s) { s.take(bytes); }); },
                     .writable = [with] { with([](Session& s) { s.pump(); }); },
                     .ended = [with](const Ending&) { with([](Session& s) { s.gone(); }); }});
  }
  // The server's process is gone.
  void die() {
    unlink();
    done_ = true;
    stream_->leave(SimStream::server);
  }
  [[nodiscard]] bool done() const { return done_ && queued_ == 0; }

  AuthorId author() const override { return author_; }
  void begin(SessionStart start) override {
    MessageParts before;
    if (server_.links_) {
      link_ = server_.links_->add(author_, start.decided_author_seq + 1, *this);
      before.push_back(link_message(link_->keys(), node(Datagrams::kServer).port).bytes);
    }
    for (const SessionMessage& message : start.before) before.push_back(message.bytes);
    if (server_.condition_.breakage == Breakage::hasty && !server_.power_is_out())
      for (const Bytes& entry : std::exchange(before, {})) stream_->write(SimStream::server, *entry);
    send_queue_.begin(start.contained, std::move(before), std::move(start.complete));
    pump();
  }
  void set_leaves(std::vector<FieldLeaf> leaves) override {
    send_queue_.set_leaves(std::move(leaves));
    pump();
  }
  void enqueue(const SessionMessage& message) override {
    if (closing_ || done_) return;
    const auto chance = [&] { return send_queue_.takes(message.seq) && server_.random_.index(8) == 0; };
    if (server_.condition_.breakage == Breakage::skipping && chance()) return;
    if (server_.condition_.breakage == Breakage::unsaid && message.fast.kind == wire::SessionEntryKind::supervised &&
        server_.random_.index(2) == 0)
      return send(noted_message(message.seq, {}));
    if (server_.condition_.breakage == Breakage::ordering) {
      if (!held_back_ && chance()) {
        held_back_ = message;
        return;
      }
      send(message);
      if (held_back_) send(*held_back_);
      held_back_.reset();
      return;
    }
    send(message);
  }
  void hold(const wire::SessionEntry& supervised) override {
    if (link_) link_->enqueue(0, supervised);
  }
  void know_tool(std::uint32_t number, const Digest& tool) override {
    if (link_) link_->know_tool(number, tool);
  }
  void answer(const SessionMessage& message) override { add(send_queue_.add_answer(message.bytes)); }
  void refuse(const Error& why) override { close({true, why.message}); }
  void decided() override {
    --queued_;
    if (closing_ || done_ || !paused_ || queued_ >= kMaxQueuedCuts) return;
    paused_ = false;
    stream_->read_on(SimStream::server);
  }
  void end(const std::string& why) override { close({true, why}); }
  void replaced(const std::string& why) override { close({false, why}); }
  std::size_t waiting() const override { return send_queue_.waiting(); }

 private:
  void take(const std::string& bytes) {
    if (closing_ || done_ || server_.power_is_out()) return;
    v1::SessionRequest request;
    if (!request.ParseFromString(bytes)) return close({true, "a SessionRequest could not be parsed"});
    switch (request.message_case()) {
      case v1::SessionRequest::kOpen:
        return open(request.open());
      case v1::SessionRequest::kCut:
        return queue(request.cut());
      default:
        return close({true, "SessionRequest.message is not set"});
    }
  }

  void open(const v1::SessionOpen& request) {
    if (request.server_epoch() != server_.store_->server_epoch())
      return close({false, "open.server_epoch is another one; join again"});
    author_ = AuthorId{request.author()};
    if (const Result<void> opened =
            server_.runtime_->open_session(shared_from_this(), digest_of_secret(request.secret()));
        !opened)
      close({true, opened.error().message});
  }

  void queue(const v1::Cut& message) {
    Result<Cut> cut = wire::from_wire(message);
    if (!cut) return close({true, cut.error().message});
    if (cut->author != author_) return close({true, "cut.author is not the author who opened the session"});
    // A cut that was accepted before is answered with its first decision. A cut ahead of its turn may follow others
    // that come in datagrams.
    if (link_ && cut->author_seq > taken_)
      link_->insert(*cut);
    else
      take(std::move(*cut));
    paused_ = queued_ >= kMaxQueuedCuts;
    if (paused_) stream_->stop_reading(SimStream::server);
  }

  // In order of their author_seq, on whichever way they came.
  void take(Cut cut) override {
    if (closing_ || done_) return;
    taken_ = std::max(taken_, cut.author_seq);
    if (server_.condition_.breakage == Breakage::dedup) {
      const auto taken_again = [cut](Room& room) mutable -> Result<RoomEvent> {
        if (cut.author_seq <= room.decided(cut.author)) {
          cut.author_seq = room.decided(cut.author) + 1;
          (void)room.submit(cut);
        }
        return failure(ErrorCode::cancelled, "nobody hears of it");
      };
      server_.runtime_->queue_event(taken_again, [](const Result<RoomEvent>&) {});
    }
    ++queued_;
    server_.ledger_.check(queued_ <= (link_ ? kMostUndecided : kMaxQueuedCuts), Invariant::bounds,
                          "a session has more cuts queued than it may");
    server_.runtime_->queue_cut(shared_from_this(), std::move(cut), {});
  }
  void take(CuttingState state) override {
    if (!closing_ && !done_) server_.runtime_->publish_state(std::move(state));
  }
  void arrived(std::uint64_t index) override { send_queue_.arrived(index); }

  void send(const SessionMessage& message) {
    const std::uint64_t before = send_queue_.index();
    const bool taken = send_queue_.add(message.seq, message.bytes);
    send_fast(message.fast, send_queue_.index() > before);
    add(taken);
  }
  void send_fast(const wire::SessionEntry& fast, bool numbered) {
    if (!link_) return;
    const bool goes = link_->enqueue(numbered ? send_queue_.index() : 0, fast);
    if (goes && server_.condition_.breakage == Breakage::pruning) send_queue_.arrived(send_queue_.index());
  }
  void unlink() {
    if (link_) server_.links_->remove(link_);
    link_.reset();
  }

  void add(bool taken) {
    if (closing_ || done_) return;
    server_.most_behind_ = std::max(server_.most_behind_, send_queue_.waiting());
    server_.ledger_.check(send_queue_.waiting() <= SessionSendQueue::kMaxEntries, Invariant::bounds,
                          "an send_queue holds too many entries");
    if (taken)
      pump();
    else
      close({false, "the reader is too far behind; join again"});
  }
  void close(const Ending& ending) {
    if (!closing_) closing_ = ending;
    pump();
  }
  // A server without power sends nothing.
  void pump() {
    if (done_ || server_.power_is_out()) return;
    server_.note_kept();
    while (!closing_ && stream_->writable(SimStream::server)) {
      const MessageParts parts = send_queue_.take();
      if (parts.empty()) return;
      stream_->write(SimStream::server, joined(parts));
    }
    if (!closing_) return;
    stream_->finish(*closing_);
    gone();
  }
  // Notifies the runtime from outside of its calls, as gRPC does.
  void gone() {
    if (std::exchange(done_, true)) return;
    server_.time_.post_in(0ns, [self = shared_from_this(), life = server_.life_] {
      if (self->server_.life_ != life) return;
      self->server_.runtime_->leave(*self);
      self->unlink();
    });
  }

  SimServer& server_;
  std::shared_ptr<SimStream> stream_;
  AuthorId author_;
  SessionSendQueue send_queue_;
  std::shared_ptr<SimLinks::Link> link_;  // shared with the server's links
  std::optional<SessionMessage> held_back_;
  std::optional<Ending> closing_;
  int queued_ = 0;
  std::uint64_t taken_ = 0;  // newest author_seq that was queued
  bool paused_ = false, done_ = false;
};

SimServer::SimServer(VirtualTime& time, Ledger& ledger, Datagrams& datagrams, std::uint64_t seed, const Case& bone,
                     const ServerCondition& condition)
    : time_(time),
      ledger_(ledger),
      datagrams_(datagrams),
      random_(seed),
      bone_(bone),
      condition_(condition),
      disk_(seed, condition.sector_bytes) {}

SimServer::~SimServer() {
  links_.reset();
  runtime_.reset();
  sessions_.clear();
  store_.reset();
}

RoomStore::Options SimServer::options() {
  RoomStore::Options options;
  options.limits = condition_.limits;
  options.tools = few_tools();
  options.journal.disk = &disk_;
  options.journal.page_bytes = static_cast<int>(std::max<std::size_t>(1024, condition_.sector_bytes));
  options.random = [](std::span<std::uint8_t> key) { std::ranges::fill(key, 7); };
  options.journal.durable = condition_.breakage != Breakage::forgetful;
  return options;
}

void SimServer::boot() {
  if (runtime_) return;
  ++life_;
  Result<PersistedRoom> kept = RoomStore::open(file_, bone_, options());
  if (kept && kept->store->server_epoch() == 0) {
    // Closed to entries: the operator must act.
    ledger_.check(disk_has_failed_, Invariant::served, "a journal on a sound disk takes no entries");
    kept = failure(ErrorCode::unavailable, "closed");
    disk_.mend();
    recover();
    kept = RoomStore::open(file_, bone_, options());
  }
  if (!kept) {
    ledger_.check(disk_.has_failed(), Invariant::served, "the journal cannot be opened: " + kept.error().message);
    if (power_is_out()) disk_.power_returns();
    power_fails_ = false;
    disk_.mend();
    return boot_later();
  }
  ledger_.check(!kept->made || !made_, Invariant::acknowledged, "the journal is gone");
  made_ = true;
  const Digest opened = kept->room.room_hash();
  store_ = std::move(kept->store);
  began_ = reopened_time(kept->room);
  booted_ = time_.now();
  jumped_ = {};
  runtime_ = driven_host(std::move(kept->room), *store_);
  if (condition_.fast_path)
    links_ = std::make_unique<SimLinks>(datagrams_, random_.index(1u << 30), condition_.link,
                                        [this] { return power_is_out(); });
  disk_has_failed_ = false;
  ledger_.check(opened == replayed(), Invariant::replay, "the room that was opened is not the one of its entries");
  plan_tick();
}

std::vector<LogEntry> SimServer::entries() {
  // Reads a copy, because the journal itself is in use.
  MemoryDisk copy(1, condition_.sector_bytes);
  copy.load(disk_.image());
  JournalOptions journal = options().journal;
  journal.disk = &copy;
  std::vector<LogEntry> entries;
  Result<Journal> opened = Journal::open(file_, journal);
  if (!opened) {
    ledger_.fault(Invariant::replay, "a copy of the journal cannot be opened: " + opened.error().message);
    return entries;
  }
  const Result<void> read = opened->read(RoomSeq{1}, [&](const JournalEntry& one) {
    Result<LogEntry> entry = entry_from_bytes(one.seq, std::chrono::nanoseconds(one.at_ns), one.bytes);
    ledger_.check(entry.has_value(), Invariant::replay, entry ? "" : entry.error().message);
    if (entry) entries.push_back(std::move(*entry));
    return entry.has_value();
  });
  ledger_.check(read.has_value(), Invariant::replay, read ? "" : read.error().message);
  return entries;
}

Digest SimServer::replayed() {
  const std::vector<LogEntry> kept = entries();
  ledger_.check_entries(kept);
  Result<Room> room = begin_room(bone_, store_->genesis(), condition_.limits);
  ledger_.check(room.has_value(), Invariant::replay, room ? "" : room.error().message);
  if (!room) return {};
  for (const LogEntry& entry : kept)
    if (const Result<void> replayed = room->replay(entry); !replayed) {
      ledger_.fault(Invariant::replay, replayed.error().message);
      return {};
    }
  return room->room_hash();
}

Digest SimServer::live() {
  Digest hash;
  runtime_->queue_event(
      [&](Room& room) -> Result<RoomEvent> {
        hash = room.room_hash();
        return RoomEvent{};
      },
      [](const Result<RoomEvent>&) {});
  runtime_->tick(now());
  return hash;
}

Digest SimServer::reopened(bool with_checkpoint) {
  if (!runtime_) return {};
  for (const auto& session : sessions_) session->die();
  links_.reset();
  ++life_;
  runtime_->stop();
  sessions_.clear();  // until now the runtime's thread that publishes tools used them
  if (with_checkpoint) checkpoint();
  runtime_.reset();
  if (with_checkpoint) {
    const Result<void> closed = store_->close();
    ledger_.check(closed.has_value(), Invariant::served,
                  closed ? "" : "the journal cannot be closed: " + closed.error().message);
  }
  store_.reset();
  Result<PersistedRoom> kept = RoomStore::open(file_, bone_, options());
  ledger_.check(kept.has_value(), Invariant::replay, kept ? "" : kept.error().message);
  if (!kept) return {};
  if (with_checkpoint)
    ledger_.check(kept->store->evaluated() == 0, Invariant::replay, "a checkpoint of the end was not used");
  const Digest hash = kept->room.room_hash();
  store_ = std::move(kept->store);
  runtime_ = driven_host(std::move(kept->room), *store_);
  return hash;
}

void SimServer::boot_later() {
  time_.post_in(drawn(random_, 50ms, 2s), [this, life = life_] {
    if (life == life_) boot();
  });
}

void SimServer::down() {
  ++life_;
  disk_has_failed_ = disk_has_failed_ || (disk_fails_ && disk_.has_failed());
  for (const auto& session : sessions_) session->die();
  links_.reset();
  runtime_.reset();
  store_.reset();
  sessions_.clear();
}

void SimServer::crash(bool power) {
  if (!runtime_) return;
  if (!power_fails_ && !disk_fails_ && random_.unit() < 0.3) {
    const Digest alive = live();
    ledger_.check(replayed() == alive, Invariant::replay,
                  "the journal's entries make another room than the one that crashes");
  }
  ++crashes_;
  down();
  if (power) disk_.power_returns();
  power_fails_ = disk_fails_ = operator_comes_ = false;
  disk_.mend();
  boot_later();
}

void SimServer::restart() {
  if (!runtime_ || disk_.has_failed()) return;
  runtime_->end_streams("the server stops");
  runtime_->tick(now());
  runtime_->stop();
  checkpoint();
  runtime_.reset();
  if (!power_is_out()) {
    const Result<void> closed = store_->close();
    ledger_.check(closed || disk_.has_failed(), Invariant::served,
                  closed ? "" : "the journal cannot be closed: " + closed.error().message);
  }
  down();
  if (power_is_out()) disk_.power_returns();
  power_fails_ = disk_fails_ = operator_comes_ = false;
  disk_.mend();
  boot_later();
}

void SimServer::note_kept() { ledger_.kept_up_to(store_->head().seq); }

void SimServer::lose_power_at(std::uint64_t nth) {
  if (!runtime_ || power_fails_ || disk_fails_) return;
  power_fails_ = true;
  disk_.fail_power_at(nth);
}

void SimServer::fail_disk_at(std::uint64_t nth, int error, MemoryDisk::Lasting lasting) {
  if (!runtime_ || power_fails_ || disk_fails_) return;
  disk_fails_ = true;
  disk_.fail_at(nth, error, lasting);
}

void SimServer::checkpoint() {
  const Result<void> kept = store_->checkpoint(runtime_->room_seq(), runtime_->all_leaves());
  ledger_.check(kept || disk_.has_failed(), Invariant::served, kept ? "" : "no checkpoint: " + kept.error().message);
  after_tick();
}

void SimServer::rest() {
  resting_ = true;
  writes_until_ = {};
  if (power_fails_ || disk_fails_) crash(power_fails_);
  if (runtime_) plan_tick();
}

void SimServer::recover() {
  const std::filesystem::path to = "/room/journal" + std::to_string(++recoveries_);
  const Result<RecoverReport> report = salvage_journal(file_, to, &disk_);
  if (!report) return ledger_.fault(Invariant::served, "the journal cannot be recovered: " + report.error().message);
  file_ = to;
}

void SimServer::plan_tick() {
  const bool paused = !resting_ && random_.unit() < condition_.pauses;
  const Time late = paused ? drawn(random_, 100ms, 3s) : drawn(random_, 0ns, condition_.late_most);
  time_.post_in(kTick + late, [this, life = life_, planned = ++planned_tick_] {
    if (life == life_ && planned == planned_tick_ && runtime_) tick();
  });
}

void SimServer::tick() {
  if (!resting_ && random_.unit() < condition_.slow_writes) writes_until_ = time_.now() + drawn(random_, 5ms, 400ms);
  runtime_->tick(now(), time_.now() >= writes_until_);
  std::erase_if(sessions_, [](const auto& session) { return session->done(); });
  plan_tick();
  after_tick();
}

void SimServer::after_tick() {
  if (!disk_.has_failed()) return;
  if (power_fails_) {
    time_.post_in(0ns, [this, life = life_] {
      if (life == life_) crash(true);
    });
  } else if (disk_fails_ && !std::exchange(operator_comes_, true)) {
    ++disk_failures_;
    disk_has_failed_ = true;
    // Nothing becomes durable any more, so nothing may be decided any more.
    time_.post_in(drawn(random_, 300ms, 2s), [this, life = life_] {
      if (life == life_) crash(random_.unit() < 0.5);
    });
  }
}

void SimServer::join(const JoinRequest& request, std::function<void(const Result<Joined>&)> answer) {
  if (!runtime_ || power_is_out()) return;
  std::string secret = request.secret;
  if (!request.resume) {
    secret.resize(32);
    for (char& byte : secret) byte = static_cast<char>(random_.index(256));
  }
  const auto reply = [this, secret, answer = std::move(answer)](const Result<AuthorId>& author) {
    if (power_is_out()) return;
    if (!author) return answer(tl::unexpected(author.error()));
    answer(Joined{*author, store_->server_epoch(), runtime_->lease_epoch(*author), secret});
  };
  if (!request.resume) {
    runtime_->join(MemberKind::surgeon, request.name, digest_of_secret(secret), Role::none, reply);
  } else if (const Result<void> may = runtime_->resume(request.resume, digest_of_secret(secret), request.kept); !may) {
    reply(tl::unexpected(may.error()));
  } else {
    reply(request.resume);
  }
  after_tick();
}

void SimServer::change(std::function<Result<RoomEvent>(Room&)> change,
                       std::function<void(const Result<RoomEvent>&)> answer) {
  if (!runtime_ || power_is_out()) return;
  runtime_->queue_event(std::move(change), [this, answer = std::move(answer)](const Result<RoomEvent>& event) {
    if (power_is_out()) return;
    note_kept();
    answer(event);
  });
}

void SimServer::accept(const std::shared_ptr<SimStream>& stream) {
  if (!runtime_ || power_is_out()) return stream->leave(SimStream::server);
  sessions_.push_back(std::make_shared<Session>(*this, stream));
  sessions_.back()->start();
}

}  // namespace osteon::test
