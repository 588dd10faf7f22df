#include "viewer_client/inside/shared_shots.hpp"

#include <algorithm>

namespace osteon {

void SharedShots::add(const CArmShot& shot, bool first, const ShotTotals& session) {
  session_ = session;
  if (first || !press_) press_ = ShotRun{{}, shot.number, 0.0, {}};
  press_->last = shot;
  press_->exposure_s += shot.exposure_s;
  // A newer state takes the place of one that waits.
  if (!waiting_.empty() && waiting_.back().first_number == press_->first_number) waiting_.pop_back();
  waiting_.push_back(*press_);
  if (waiting_.size() > kMostWaiting) waiting_.pop_front();
}

std::optional<SharedShots::Message> SharedShots::due(Clock::time_point now) {
  if (under_way_ || waiting_.empty() || now < next_) return {};
  under_way_ = true;
  next_ = now + kApart;
  Message message{waiting_.front(), session_};
  waiting_.pop_front();
  return message;
}

void SharedShots::put_back(const ShotRun& run) {
  const auto is_newer = [&](const ShotRun& waiting) { return same_press(waiting, run); };
  if (waiting_.size() < kMostWaiting && std::ranges::none_of(waiting_, is_newer)) waiting_.push_front(run);
}

}  // namespace osteon
