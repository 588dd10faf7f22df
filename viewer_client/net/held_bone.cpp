#include "viewer_client/net/held_bone.hpp"

#include <atomic>
#include <mutex>
#include <thread>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/link/backoff.hpp"
#include "common/runtime/log.hpp"

namespace osteon {

struct HeldBone::Impl {
  Impl(std::unique_ptr<FieldSource> from, const HeldBoneOptions& given) : source(std::move(from)), options(given) {}

  const std::unique_ptr<FieldSource> source;
  const HeldBoneOptions options;

  std::atomic<bool> ending{false};
  // Held while the bone changes, which takes long for the first leaves and after an undo. So `status` has its own.
  mutable Mutex mutex{LockRank::received};
  std::optional<FieldFollower> follower OSTEON_GUARDED_BY(mutex);
  mutable Mutex status_mutex{LockRank::leaf};
  mutable CondVar changed;
  HeldBoneStatus status OSTEON_GUARDED_BY(status_mutex);

  std::thread thread;
  std::once_flag thread_joined;

  void run();
  // True: the bone was fetched.
  bool fetch(Backoff& backoff);
  [[nodiscard]] FieldSource::End follow(Backoff& backoff);
  [[nodiscard]] Result<void> take(const v1::WatchFieldResponse& message);
  // Returns false when it ends.
  bool pause(Backoff& backoff);
  [[nodiscard]] bool has_bone() const {
    const MutexLock lock(mutex);
    return follower && follower->whole();
  }
  void interrupt(const Error& why);
  void fail(const Error& why);
};

// [bone thread]
void HeldBone::Impl::run() {
  Backoff backoff(static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count()),
                  {.least = options.pause, .most = options.longest_pause});
  if (!fetch(backoff)) return;
  while (true) {
    const FieldSource::End end = follow(backoff);
    if (end.for_good) return fail(end.why);
    interrupt(end.why);
    if (!pause(backoff)) return;
  }
}

bool HeldBone::Impl::fetch(Backoff& backoff) {
  while (true) {
    const Result<Case> bone = source->imported();
    if (bone) {
      const MutexLock lock(mutex);
      follower.emplace(*bone, options.most_bytes);
      return true;
    }
    if (bone.error().code != ErrorCode::unavailable) {
      fail(bone.error());
      return false;
    }
    interrupt(bone.error());
    if (!pause(backoff)) return false;
  }
}

// One stream, from its beginning to its end.
FieldSource::End HeldBone::Impl::follow(Backoff& backoff) {
  {
    const MutexLock lock(mutex);
    follower->begin();
  }
  std::optional<Error> fault;
  bool followed = false;
  FieldSource::End end = source->read([&](const v1::WatchFieldResponse& message) {
    const Result<void> taken = take(message);
    if (!taken) fault = taken.error();
    if (taken && !followed) {
      const MutexLock lock(mutex);
      followed = follower->follows();
    }
    return taken.has_value();
  });
  if (followed) backoff.reset();
  if (fault) end = {*fault, fault->code != ErrorCode::unavailable};
  return end;
}

Result<void> HeldBone::Impl::take(const v1::WatchFieldResponse& message) {
  if (ending) return failure(ErrorCode::unavailable, "it ends");
  HeldBoneStatus now;
  now.state = HeldBoneState::follows;
  bool follows = false;
  const Result<void> taken = [&] {
    const MutexLock lock(mutex);
    Result<void> one = follower->take(message);
    now.bytes = follower->bytes();
    follows = one && follower->follows();
    if (!follows) return one;
    now.room_seq = follower->bone().room_seq();
    now.bodies = follower->bone().bodies().size();
    return one;
  }();
  const MutexLock lock(status_mutex);
  now.asked_again = status.asked_again;
  if (follows)
    status = now;
  else
    status.bytes = now.bytes;
  if (follows) changed.notify_all();
  return taken;
}

bool HeldBone::Impl::pause(Backoff& backoff) {
  MutexLock lock(status_mutex);
  changed.wait_for(lock, backoff.next(), [&] { return ending.load(); });
  if (!ending) ++status.asked_again;
  return !ending;
}

void HeldBone::Impl::interrupt(const Error& why) {
  const bool whole = has_bone();
  if (ending) return;
  bool followed = false;
  {
    const MutexLock lock(status_mutex);
    followed = status.state == HeldBoneState::follows;
    if (whole) status.state = HeldBoneState::interrupted;
    status.why = why;
    changed.notify_all();
  }
  // Under no lock: the log has its own.
  if (followed) log::warn("the inside of the bone is asked for again", {{"reason", why.message}});
}

void HeldBone::Impl::fail(const Error& why) {
  {
    const MutexLock lock(mutex);
    if (ending) return;
    follower.reset();
  }
  log::warn("the inside of the bone is not shown", {{"reason", why.message}});
  const MutexLock lock(status_mutex);
  status.state = HeldBoneState::failed;
  status.bodies = status.bytes = 0;
  status.why = why;
  changed.notify_all();
}

HeldBone::HeldBone(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::unique_ptr<HeldBone> HeldBone::start(std::unique_ptr<FieldSource> source, const HeldBoneOptions& options) {
  std::unique_ptr<HeldBone> bone(new HeldBone(std::make_unique<Impl>(std::move(source), options)));
  bone->impl_->thread = std::thread([inside = bone->impl_.get()] { inside->run(); });
  return bone;
}

HeldBone::~HeldBone() { end_and_join(); }

void HeldBone::end_and_join() {
  end();
  std::call_once(impl_->thread_joined, [this] { impl_->thread.join(); });
}

void HeldBone::end() {
  {
    const MutexLock lock(impl_->status_mutex);  // for who is about to wait
    impl_->ending = true;
    impl_->changed.notify_all();
  }
  impl_->source->cancel();
}

HeldBoneStatus HeldBone::status() const {
  const MutexLock lock(impl_->status_mutex);
  return impl_->status;
}

bool HeldBone::read(const std::function<void(const Replica& bone)>& use) const {
  const MutexLock lock(impl_->mutex);
  if (!impl_->follower || !impl_->follower->whole()) return false;
  use(impl_->follower->bone());
  return true;
}

FieldChanges HeldBone::take_changes() {
  const MutexLock lock(impl_->mutex);
  return impl_->follower ? impl_->follower->take_changes() : FieldChanges{.all = true};
}

bool HeldBone::wait(const std::function<bool(const HeldBoneStatus&)>& done, std::chrono::milliseconds patience) const {
  MutexLock lock(impl_->status_mutex);
  return impl_->changed.wait_for(lock, patience,
                                 [&]() OSTEON_REQUIRES(impl_->status_mutex) { return done(impl_->status); });
}

void HeldBone::wake_waiting() const {
  const MutexLock lock(impl_->status_mutex);  // for who is about to wait
  impl_->changed.notify_all();
}

}  // namespace osteon
