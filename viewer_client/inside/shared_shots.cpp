#include "viewer_client/inside/shared_shots.hpp"

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

}  // namespace osteon
