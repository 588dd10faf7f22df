#include "server/rooms/bone_mount.hpp"

#include <algorithm>

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr auto kSendAtRest = 50ms;
constexpr auto kLongestStep = 100ms;  // longest step after the machine stood still: the bone loses that time too
constexpr double kRest_mj = 1e-6;     // less than a thousandth of a millimetre

}  // namespace

void BoneMount::join(AuthorId author) {
  const MutexLock lock(mutex_);
  bone_.join(author.value);
}

void BoneMount::leave(AuthorId author) {
  const MutexLock lock(mutex_);
  bone_.leave(author.value);
}

void BoneMount::push(AuthorId author, const MountLoad& push) {
  const MutexLock lock(mutex_);
  (void)bone_.receive(author.value, push);
}

bool BoneMount::step(std::chrono::nanoseconds now) {
  const MutexLock lock(mutex_);
  const auto since = stepped_.count() < 0 ? 0ns : std::min<std::chrono::nanoseconds>(now - stepped_, kLongestStep);
  stepped_ = now;
  bone_.step(1e-9 * static_cast<double>(since.count()));
  if (bone_.mount().stored_mj() < kRest_mj && now - sent_ < kSendAtRest) return false;
  sent_ = now;
  return true;
}

MountPose BoneMount::seen(AuthorId author) {
  const MutexLock lock(mutex_);
  return bone_.seen(author.value);
}

}  // namespace osteon
