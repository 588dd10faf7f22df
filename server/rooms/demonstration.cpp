#include "server/rooms/demonstration.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"
#include "server/auth/authorizer.hpp"
#include "server/rooms/playback.hpp"
#include "server/rooms/room_runtime.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostUndecided = 64;
constexpr Clock::duration kLongestPause = 3s;  // longer pauses are shortened: somebody thought, or the room was closed
constexpr Clock::time_point kNever = Clock::time_point::max();

struct Recorded {
  Cut cut;
  std::chrono::nanoseconds at{};
};

}  // namespace

// Its own thread makes the cuts. The room's threads report the results.
class Demonstration final : public SessionSubscriber, public std::enable_shared_from_this<Demonstration> {
 public:
  Demonstration(RoomRuntime& runtime, AuthorId author, std::vector<Recorded> cuts, double speed)
      : runtime_(runtime), author_(author), cuts_(std::move(cuts)), speed_(speed) {}

  // Call it before start(). `by` may be an earlier identity of the person. A newer session of the same person does not
  // end what they started.
  [[nodiscard]] Result<void> stand_under(Authorizer& authorizer, const Caller& by, const std::string& room) {
    const auto end = [weak = weak_from_this()](const Refusal& why) {
      if (const auto self = weak.lock()) self->refuse({ErrorCode::denied, why.sentence});
    };
    auto entered = authorizer.enter(by, room, {}, "/osteon.v1.PeopleService/Demonstrate", end);
    if (!entered) return failure(ErrorCode::denied, entered.error().sentence);
    const MutexLock lock(mutex_);
    watched_ = std::move(*entered);
    return {};
  }
  [[nodiscard]] Result<void> start() {
    if (Result<void> opened = runtime_.open_session(shared_from_this()); !opened) return opened;
    thread_ = std::thread([this] { run(); });
    return {};
  }
  // Called once, and not on its own thread.
  void stop() {
    finish();
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] bool over() const {
    const MutexLock lock(mutex_);
    return over_;
  }

  // Empty: it ran to its end, or somebody ended it.
  [[nodiscard]] std::string why() const {
    const MutexLock lock(mutex_);
    return why_;
  }

  AuthorId author() const override { return author_; }
  // Its tool follows its path on the bone, wherever the mount has moved the bone. No force is recorded.
  bool feels_bone() const override { return false; }
  void begin(SessionStart start) override {
    const MutexLock lock(mutex_);
    lease_ = start.lease_epoch;
    body_ = start.bodies.front();
  }
  void set_leaves(std::vector<FieldLeaf>) override {}
  // Decided before its session was open.
  void hold(const wire::SessionEntry& supervised) override {
    const MutexLock lock(mutex_);
    stopped_ = !supervised.supervision.may_cut();
  }
  void enqueue(const SessionMessage& message) override {
    const wire::SessionEntry& entry = message.fast;
    const MutexLock lock(mutex_);
    if (entry.kind == wire::SessionEntryKind::supervised) {
      lease_ = entry.lease_epoch;
      stopped_ = !entry.supervision.may_cut();
    } else if (entry.kind == wire::SessionEntryKind::committed && entry.cut.author == author_) {
      undecided_.pop_front();
    } else if (entry.kind == wire::SessionEntryKind::rejected) {
      lease_ = entry.lease_epoch;
      // Cuts that were rejected because of the lease are made again under the new lease. Cuts that are wrong in
      // themselves are left out.
      const auto reason = static_cast<Rejection>(entry.reason);
      if (reason == Rejection::lease || reason == Rejection::frozen || reason == Rejection::taken)
        again_.push_back(undecided_.front());
      undecided_.pop_front();
    }
    wake_.notify_one();
  }
  void answer(const SessionMessage&) override {}
  void refuse(const Error& why) override {
    log::error("demonstration ended", {{"author", author_.value}, {"reason", why.message}});
    const MutexLock lock(mutex_);
    why_ = why.message;
    over_ = true;
    wake_.notify_one();
  }
  void decided() override {}
  void end(const std::string&) override { finish(); }
  std::size_t waiting() const override { return 0; }

 private:
  void finish() {
    const MutexLock lock(mutex_);
    over_ = true;
    wake_.notify_one();
  }

  struct Step {
    enum class What { cut, rest, end } what;
    Recorded cut{};
  };
  // Waits for the next cut that is due, for the end, or for the time to show the tool at rest. A stopped tool is shown
  // at rest at once; any other tool at `seen_at_work`, the time until which it is shown at work. Null: it is at rest
  // already.
  Step next(const std::optional<Clock::time_point>& seen_at_work) {
    MutexLock lock(mutex_);
    while (!over_) {
      const bool may_go_on = !stopped_ && undecided_.size() < kMostUndecided;
      const bool all_made = again_.empty() && made_ == cuts_.size();
      if (all_made && undecided_.empty()) break;
      const Clock::time_point now = Clock::now();
      const bool has_next = may_go_on && !all_made;
      if (has_next && now >= due_) return {Step::What::cut, next_cut()};
      if (seen_at_work && (stopped_ || now >= *seen_at_work)) return {Step::What::rest};
      if (has_next || seen_at_work)
        wake_.wait_until(lock, std::min(has_next ? due_ : kNever, seen_at_work.value_or(kNever)));
      else
        wake_.wait(lock);
    }
    return {Step::What::end};
  }
  Recorded next_cut() OSTEON_REQUIRES(mutex_) {
    if (!again_.empty()) {
      const std::size_t which = again_.front();
      again_.pop_front();
      undecided_.push_back(which);
      // Not faster than the tool moved, since a lease allows only a limited rate.
      due_ = Clock::now() + at_speed(std::chrono::microseconds(cuts_[which].cut.path_us));
      return stamped(which);
    }
    const std::size_t which = made_++;
    undecided_.push_back(which);
    if (made_ < cuts_.size()) {
      const Clock::duration apart = std::min<Clock::duration>(cuts_[made_].at - cuts_[which].at, kLongestPause);
      due_ = std::max(due_, Clock::now()) +
             at_speed(std::max<Clock::duration>(apart, std::chrono::microseconds(cuts_[made_].cut.path_us)));
    }
    return stamped(which);
  }
  [[nodiscard]] Clock::duration at_speed(Clock::duration time) const {
    return std::chrono::duration_cast<Clock::duration>(time / speed_);
  }
  Recorded stamped(std::size_t which) OSTEON_REQUIRES(mutex_) {
    Recorded out = cuts_[which];
    out.cut.author = author_;
    out.cut.author_seq = ++author_seq_;
    out.cut.lease_epoch = lease_;
    out.cut.body = body_;
    out.cut.path_us = static_cast<std::uint32_t>(std::min(std::llround(out.cut.path_us / speed_), 4'000'000'000ll));
    return out;
  }

  void run() {
    Player tool(Playback{}, {});
    std::optional<Clock::time_point> seen_at_work;
    for (Step step = next({}); step.what != Step::What::end; step = next(seen_at_work)) {
      if (step.what == Step::What::rest) {
        for (CuttingState& state : tool.at_rest()) runtime_.publish_state(std::move(state));
        seen_at_work.reset();
        continue;
      }
      const Clock::time_point now = Clock::now();
      runtime_.queue_cut(shared_from_this(), step.cut.cut, now);
      if (std::optional<CuttingState> state = tool.see(step.cut.cut, runtime_.tools(), now.time_since_epoch())) {
        runtime_.publish_state(std::move(*state));
        seen_at_work = now + Player::kSeenAfterCut;
      }
    }
    runtime_.leave(*this);
    std::shared_ptr<OpenStream> watched;  // destroyed without the lock, since its destructor takes it
    const MutexLock lock(mutex_);
    over_ = true;
    watched = std::move(watched_);
  }

  RoomRuntime& runtime_;
  const AuthorId author_;
  const std::vector<Recorded> cuts_;
  const double speed_;
  mutable Mutex mutex_{LockRank::leaf};
  CondVar wake_;
  std::uint64_t lease_ OSTEON_GUARDED_BY(mutex_) = 0, author_seq_ OSTEON_GUARDED_BY(mutex_) = 0;
  BodyId body_ OSTEON_GUARDED_BY(mutex_);
  std::size_t made_ OSTEON_GUARDED_BY(mutex_) = 0;  // number of cuts_ that were made
  std::deque<std::size_t> undecided_ OSTEON_GUARDED_BY(mutex_), again_ OSTEON_GUARDED_BY(mutex_);  // indices into cuts_
  Clock::time_point due_ OSTEON_GUARDED_BY(mutex_){};
  bool stopped_ OSTEON_GUARDED_BY(mutex_) = false, over_ OSTEON_GUARDED_BY(mutex_) = false;
  std::string why_ OSTEON_GUARDED_BY(mutex_);
  std::shared_ptr<OpenStream> watched_ OSTEON_GUARDED_BY(mutex_);  // shared with the authorizer while it ends this
  std::thread thread_;
};

namespace {

// What is read from a journal.
struct Recording {
  std::vector<Recorded> cuts;
  std::vector<Tool> tools;  // the tools of the cuts
};

// `over`: nobody waits for the result any more.
Result<Recording> read_recording(const DemonstrationPlace& in, const WhatToShow& what, const std::atomic<bool>& over) {
  std::map<RoomSeq, Recorded> cuts;
  std::set<RoomSeq> undone;
  std::map<Digest, Tool> tools;
  bool too_many = false;
  const auto take = [&](const LogEntry& entry) {
    if (const auto* cut = std::get_if<CutEntry>(&entry.what)) {
      if (entry.seq >= what.from && (!what.of || cut->cut.author == what.of)) cuts[entry.seq] = {cut->cut, entry.at};
    } else if (const auto* undo = std::get_if<UndoEntry>(&entry.what)) {
      undone.insert(undo->seqs.begin(), undo->seqs.end());
    } else if (const auto* redo = std::get_if<RedoEntry>(&entry.what)) {
      for (const RoomSeq seq : redo->seqs) undone.erase(seq);
    } else if (const auto* added = std::get_if<ToolEntry>(&entry.what)) {
      tools.emplace(added->tool.hash(), added->tool);
    }
    too_many = cuts.size() > Demonstrations::kMostCuts;
    return !too_many && !over;
  };
  const Result<RoomGenesis> genesis = in.read(what.room.empty() ? in.room : what.room, what.to, take);
  if (!genesis) return tl::unexpected(genesis.error());
  if (genesis->case_hash != in.runtime.bone().hash())
    return failure(ErrorCode::invalid_input,
                   "room " + genesis->room + " is of another case; show one of the same bone");
  if (too_many)
    return failure(ErrorCode::invalid_input, "there are more than " + std::to_string(Demonstrations::kMostCuts) +
                                                 " cuts; say from where to where");
  for (const Tool& tool : genesis->tools) tools.emplace(tool.hash(), tool);

  Recording out;
  std::set<Digest> used;
  for (auto& [seq, recorded] : cuts) {
    if (undone.contains(seq)) continue;
    used.insert(recorded.cut.tool);
    out.cuts.push_back(std::move(recorded));
  }
  for (const Digest& hash : used)
    if (const auto tool = tools.find(hash); tool != tools.end()) out.tools.push_back(tool->second);
  return out;
}

// Waits until the room knows the tool.
Result<void> add_tool(RoomRuntime& runtime, AuthorId by, const Tool& tool) {
  std::promise<Result<RoomEvent>> answer;
  runtime.queue_event([by, tool](Room& room) { return room.add_tool(by, tool); },
                      [&](const Result<RoomEvent>& added) { answer.set_value(added); });
  const Result<RoomEvent> added = answer.get_future().get();
  if (!added) return tl::unexpected(added.error());
  return {};
}

}  // namespace

Demonstrations::Demonstrations() = default;
Demonstrations::~Demonstrations() { end_all(); }

Result<Shown> Demonstrations::begin(const DemonstrationPlace& in, AuthorId by, const Caller& caller,
                                    const WhatToShow& what) {
  if (!(what.speed >= kLeastSpeed && what.speed <= kMostSpeed))
    return failure(ErrorCode::invalid_input,
                   "the speed is not from 0.001 to " + std::to_string(static_cast<int>(kMostSpeed)));
  Result<Recording> recording = read_recording(in, what, over_);
  if (!recording) return tl::unexpected(recording.error());
  if (over_) return failure(ErrorCode::unavailable, "the room is closed");
  if (recording->cuts.empty()) return failure(ErrorCode::not_found, "there is no cut to show");
  RoomRuntime& runtime = in.runtime;
  for (const Tool& tool : recording->tools)
    if (!runtime.tools().find(tool.hash()))
      if (const Result<void> known = add_tool(runtime, by, tool); !known) return tl::unexpected(known.error());

  const MutexLock lock(mutex_);
  std::erase_if(going_on_, [](const auto& one) {
    if (!one->over()) return false;
    one->stop();
    return true;
  });
  if (over_) return failure(ErrorCode::unavailable, "the room is closed");
  if (going_on_.size() >= kMost)
    return failure(ErrorCode::unavailable,
                   "the room shows " + std::to_string(kMost) + " demonstrations already; end one first");
  const Result<AuthorId> author = runtime.join(MemberKind::surgeon, "demonstrator", {}, Role::collaborator);
  if (!author) return tl::unexpected(author.error());
  const Shown shown{*author, recording->cuts.size()};
  const auto one = std::make_shared<Demonstration>(runtime, *author, std::move(recording->cuts), what.speed);
  if (in.authorizer)
    if (const Result<void> may = one->stand_under(*in.authorizer, caller, in.room); !may)
      return tl::unexpected(may.error());
  if (const Result<void> started = one->start(); !started) return tl::unexpected(started.error());
  going_on_.push_back(one);
  return shown;
}

Result<void> Demonstrations::end(AuthorId demonstrator) {
  const MutexLock lock(mutex_);
  const auto one = std::ranges::find(going_on_, demonstrator, [](const auto& d) { return d->author(); });
  if (one == going_on_.end() || (*one)->over()) {
    const std::string why = one == going_on_.end() ? std::string() : (*one)->why();
    return failure(ErrorCode::not_found, "author " + std::to_string(demonstrator.value) + " demonstrates nothing" +
                                             (why.empty() ? "" : ": " + why));
  }
  (*one)->stop();
  going_on_.erase(one);
  return {};
}

void Demonstrations::end_all() {
  const MutexLock lock(mutex_);
  over_ = true;
  for (const auto& one : going_on_) one->stop();
  going_on_.clear();
}

}  // namespace osteon
