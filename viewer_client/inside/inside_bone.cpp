#include "viewer_client/inside/inside_bone.hpp"

#include <algorithm>
#include <atomic>
#include <new>
#include <span>
#include <thread>
#include <utility>

#include "common/core/mutex.hpp"
#include "common/runtime/log.hpp"

namespace osteon {
namespace {

using Clock = std::chrono::steady_clock;

// [A] For so long the held bone is used at a time. Cuts wait meanwhile, and get in during the rest that follows.
constexpr std::chrono::milliseconds kUse{4};
constexpr std::chrono::microseconds kRest{200};
constexpr std::chrono::milliseconds kLongestWait{500};
constexpr double kScanRead = 0.3, kMade = 0.8;  // of the whole progress
constexpr std::int32_t kCubeSide = 32;          // samples; one step of a renewal
constexpr std::size_t kLeavesOfStep = 64;       // of one step after cuts

// All leaves of level 0 in a cube of a box, as if they had changed: that renews its samples.
ChangedLeaves leaves_in(const CoordBox& cube) {
  ChangedLeaves leaves;
  const Coord first = floor_to(cube.min, kLeafSize);
  for (std::int32_t x = first.x; x <= cube.max.x; x += kLeafSize)
    for (std::int32_t y = first.y; y <= cube.max.y; y += kLeafSize)
      for (std::int32_t z = first.z; z <= cube.max.z; z += kLeafSize) leaves.origins.push_back({x, y, z});
  return leaves;
}

// Steps that renew the whole box.
std::vector<ChangedLeaves> steps_of(const CoordBox& box) {
  std::vector<ChangedLeaves> steps;
  const Coord first = floor_to(box.min, kCubeSide);
  for (std::int32_t x = first.x; x <= box.max.x; x += kCubeSide)
    for (std::int32_t y = first.y; y <= box.max.y; y += kCubeSide)
      for (std::int32_t z = first.z; z <= box.max.z; z += kCubeSide)
        steps.push_back(leaves_in({{x, y, z}, {x + kCubeSide - 1, y + kCubeSide - 1, z + kCubeSide - 1}}));
  return steps;
}

std::vector<ChangedLeaves> steps_of(std::span<const ChangedLeaves> changes) {
  std::vector<ChangedLeaves> steps;
  for (const ChangedLeaves& change : changes)
    for (std::size_t i = 0; i < change.origins.size(); i += kLeavesOfStep) {
      const auto first = change.origins.begin() + static_cast<std::ptrdiff_t>(i);
      const std::size_t count = std::min(kLeavesOfStep, change.origins.size() - i);
      steps.push_back({change.level, {first, first + static_cast<std::ptrdiff_t>(count)}});
    }
  return steps;
}

void append(InsideChange& to, bool all, std::span<const CoordBox> boxes) {
  to.all |= all || to.boxes.size() + boxes.size() > InsideChange::kMostBoxes;
  if (to.all)
    to.boxes.clear();
  else
    to.boxes.insert(to.boxes.end(), boxes.begin(), boxes.end());
}

}  // namespace

struct InsideBone::Impl {
  Impl(std::shared_ptr<HeldBone> from, InsideOptions given) : held(std::move(from)), options(std::move(given)) {}

  const std::shared_ptr<HeldBone> held;
  const InsideOptions options;
  std::atomic<bool> ending{false}, woken{false};
  std::atomic<bool> unwanted{false};  // what `painting` draws

  struct Entry {
    std::shared_ptr<InsidePainter> painter;  // shared with its owner
    InsideChange change;
  };
  mutable Mutex mutex{LockRank::leaf};
  CondVar painted;
  std::vector<Entry> painters OSTEON_GUARDED_BY(mutex);
  const InsidePainter* painting OSTEON_GUARDED_BY(mutex) = nullptr;
  InsideStatus status OSTEON_GUARDED_BY(mutex);

  // Of the inside thread.
  std::optional<radiology::BoneHu> bone;
  bool renewed = false;  // once since it was made
  HeldBoneStatus seen;   // when the bone was brought up to date last
  std::thread thread;

  void run();
  void live();
  [[nodiscard]] bool wait_for_bone();
  [[nodiscard]] Result<void> make();
  [[nodiscard]] std::optional<CaseScan> scan_of(const Case& imported, const KeepGoing& keep_going);
  void follow();
  void renew(std::span<const ChangedLeaves> steps);
  void paint();
  void rest(Clock::time_point begun);
  void say(const HeldBoneStatus& now);
  void fail(const Error& why);
  template <class Set>
  void set_status(Set set) {
    const MutexLock lock(mutex);
    set(status);
  }
};

// [inside thread]
void InsideBone::Impl::run() try { live(); } catch (const std::bad_alloc&) {
  fail({ErrorCode::exhausted,
        "there is not enough memory for slices and radiographs of this bone; close other programs, or import it with a "
        "coarser --pitch"});
}

void InsideBone::Impl::live() {
  if (!wait_for_bone()) return;
  if (const Result<void> made = make(); !made) {
    const HeldBoneStatus now = held->status();
    if (!ending) fail(now.state == HeldBoneState::failed && now.why ? *now.why : made.error());
    return;
  }
  while (!ending) {
    const Clock::time_point begun = Clock::now();
    woken = false;
    follow();
    paint();
    say(seen);
    rest(begun);
    const auto due = [this](const HeldBoneStatus& now) {
      return ending || woken || now.room_seq != seen.room_seq || now.state != seen.state ||
             now.asked_again != seen.asked_again;
    };
    while (!held->wait(due, kLongestWait)) {
    }
  }
}

// False: there will be none.
bool InsideBone::Impl::wait_for_bone() {
  while (!ending) {
    HeldBoneStatus now;
    held->wait(
        [&](const HeldBoneStatus& given) {
          now = given;
          return ending || given.state != HeldBoneState::begins;
        },
        kLongestWait);
    say(now);
    if (now.state == HeldBoneState::failed) return false;
    if (now.state != HeldBoneState::begins) return !ending;
  }
  return false;
}

Result<void> InsideBone::Impl::make() {
  const KeepGoing keep_going = [this](double fraction) {
    set_status([&](InsideStatus& now) { now.progress = fraction; });
    return !ending;
  };
  set_status([](InsideStatus& now) { now.state = InsideState::makes; });
  std::optional<Case> imported;
  (void)held->read([&](const Replica& replica) { imported = replica.committed().bone(); });
  if (!imported) return failure(ErrorCode::unavailable, "the inside of the bone is not there any more");
  const std::optional<CaseScan> scan = scan_of(*imported, part(keep_going, 0.0, kScanRead));
  if (ending) return stopped_while("reading the scan");
  auto made = radiology::BoneHu::make(*imported, scan ? &*scan : nullptr, part(keep_going, kScanRead, kMade));
  if (!made) return tl::unexpected(made.error());
  bone.emplace(std::move(*made));
  set_status([&](InsideStatus& now) { now.from_scan = scan.has_value(); });
  return {};
}

// A case without a scan has HU from its density. So has one whose scan is damaged.
std::optional<CaseScan> InsideBone::Impl::scan_of(const Case& imported, const KeepGoing& keep_going) {
  if (options.case_folder.empty()) return {};
  Result<CaseScan> scan = load_scan(options.case_folder, imported, keep_going);
  if (scan && !scan->hu.empty()) return std::move(*scan);
  if (!scan && scan.error().code != ErrorCode::not_found && !ending) {
    log::warn("slices and radiographs are made from the density alone", {{"reason", scan.error().message}});
    set_status([&](InsideStatus& now) { now.scan_fault = scan.error(); });
  }
  return {};
}

// What was counted as changed before the bone is read is read at least as new.
void InsideBone::Impl::follow() {
  seen = held->status();
  const FieldChanges changes = held->take_changes();
  if (changes.all || !renewed)
    renew(steps_of(bone->box()));
  else
    renew(steps_of(changes.leaves));
  renewed = true;
}

void InsideBone::Impl::renew(std::span<const ChangedLeaves> steps) {
  std::size_t next = 0;
  while (next < steps.size() && !ending) {
    std::vector<CoordBox> boxes;
    const bool there = held->read([&](const Replica& replica) {
      const std::vector<const CutField*> bodies = replica.bodies();
      const Clock::time_point until = Clock::now() + kUse;
      do {
        const std::vector<CoordBox> changed = bone->update(bodies, steps.subspan(next, 1));
        boxes.insert(boxes.end(), changed.begin(), changed.end());
      } while (++next < steps.size() && Clock::now() < until && !ending);
    });
    {
      const MutexLock lock(mutex);
      for (Entry& entry : painters) append(entry.change, false, boxes);
      status.progress = kMade + (1.0 - kMade) * static_cast<double>(next) / static_cast<double>(steps.size());
    }
    if (!there) return;  // the bone as it was
    // Who waits for a lock gets it only when nobody takes it again at once.
    if (next < steps.size()) std::this_thread::sleep_for(kRest);
  }
}

void InsideBone::Impl::paint() {
  std::vector<Entry> round;
  {
    const MutexLock lock(mutex);
    for (Entry& entry : painters) round.push_back({entry.painter, std::exchange(entry.change, {})});
  }
  const KeepGoing keep_going = [this](double) { return !ending && !unwanted; };
  for (const Entry& entry : round) {
    {
      const MutexLock lock(mutex);
      const bool still = std::ranges::any_of(painters, [&](const Entry& one) { return one.painter == entry.painter; });
      if (!still || ending) continue;
      painting = entry.painter.get();
      unwanted = false;
    }
    entry.painter->paint(*bone, entry.change, keep_going);
    const MutexLock lock(mutex);
    painting = nullptr;
    painted.notify_all();
  }
}

// More pictures than a display shows, or a whole processor for them, help nobody.
void InsideBone::Impl::rest(Clock::time_point begun) {
  const Clock::time_point end = Clock::now(), until = std::max(begun + options.period, end + (end - begun) / 2);
  if (until > end)
    held->wait([this](const HeldBoneStatus&) { return ending.load(); },
               std::chrono::ceil<std::chrono::milliseconds>(until - end));
}

void InsideBone::Impl::say(const HeldBoneStatus& now) {
  const MutexLock lock(mutex);
  status.why = now.why;
  if (bone) status.room_seq = now.room_seq;
  switch (now.state) {
    case HeldBoneState::begins:
      status.state = InsideState::begins;
      break;
    case HeldBoneState::follows:
      if (bone) status.state = InsideState::follows;
      break;
    case HeldBoneState::interrupted:
      if (bone) status.state = InsideState::interrupted;
      break;
    case HeldBoneState::failed:
      status.state = InsideState::failed;
      break;
  }
}

void InsideBone::Impl::fail(const Error& why) {
  log::warn("the inside of the bone is not shown", {{"reason", why.message}});
  const MutexLock lock(mutex);
  status.state = InsideState::failed;
  status.why = why;
  painting = nullptr;
  painted.notify_all();
}

InsideBone::InsideBone(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::unique_ptr<InsideBone> InsideBone::start(std::shared_ptr<HeldBone> held, const InsideOptions& options) {
  std::unique_ptr<InsideBone> made(new InsideBone(std::make_unique<Impl>(std::move(held), options)));
  made->impl_->thread = std::thread([inside = made->impl_.get()] { inside->run(); });
  return made;
}

InsideBone::~InsideBone() {
  end();
  impl_->thread.join();
}

void InsideBone::end() {
  impl_->ending = true;
  impl_->held->wake_waiting();
}

void InsideBone::add(std::shared_ptr<InsidePainter> painter) {
  {
    const MutexLock lock(impl_->mutex);
    impl_->painters.push_back({std::move(painter), {.all = true}});
  }
  wake();
}

void InsideBone::remove(const InsidePainter& painter) {
  MutexLock lock(impl_->mutex);
  std::erase_if(impl_->painters, [&](const Impl::Entry& entry) { return entry.painter.get() == &painter; });
  while (impl_->painting == &painter) {
    impl_->unwanted = true;
    impl_->painted.wait(lock);
  }
}

void InsideBone::wake() {
  impl_->woken = true;
  impl_->held->wake_waiting();
}

InsideStatus InsideBone::status() const {
  const MutexLock lock(impl_->mutex);
  return impl_->status;
}

}  // namespace osteon
