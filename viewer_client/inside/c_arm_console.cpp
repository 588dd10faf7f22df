#include "viewer_client/inside/c_arm_console.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {
namespace {

constexpr double kFarthest_mm = 0.5 * radiology::kMostOfCArm_mm;  // of an isocentre

// What is no number changes nothing.
void set_within(double& value, double wanted, double most) {
  if (!std::isnan(wanted)) value = std::clamp(wanted, -most, most);
}

CArmConsole::Clock::duration period_of(ShotMode mode) {
  const double per_s = mode == ShotMode::live ? kLive_per_s : kPulses_per_s;
  return std::chrono::duration_cast<CArmConsole::Clock::duration>(std::chrono::duration<double>(1.0 / per_s));
}

}  // namespace

double exposure_of(ShotMode mode) { return mode == ShotMode::live ? 1.0 / kLive_per_s : kPulse_s; }

void CArmConsole::begin(const Box& bone, std::span<const CArmShot> kept) {
  stop();
  bone_ = bone;
  position_ = {};
  position_.isocentre_mm = middle_of_bone();
  shots_.assign(kept.begin(), kept.end());
  totals_ = {};
  last_number_ = 0;
  for (const CArmShot& shot : shots_) {
    totals_.add(shot);
    last_number_ = std::max(last_number_, shot.number);
  }
}

Vec3 CArmConsole::middle_of_bone() const { return bone_.empty() ? Vec3(Vec3::Zero()) : bone_.centre_mm(); }

void CArmConsole::set_orbit(double rad) { set_within(position_.orbit_rad, rad, kMostOrbit_rad); }

void CArmConsole::set_tilt(double rad) { set_within(position_.tilt_rad, rad, kMostTilt_rad); }

void CArmConsole::set_translation(int axis, double mm) {
  set_within(position_.translation_mm[axis], mm, kMostTranslation_mm);
}

void CArmConsole::take_view(radiology::View view) {
  const radiology::CArm arm = radiology::c_arm_at(view, position_.isocentre_mm);
  position_.translation_mm = Vec3::Zero();
  set_orbit(arm.orbit_rad);
  set_tilt(arm.tilt_rad);
}

void CArmConsole::set_isocentre(const Vec3& point_mm) {
  if (!(point_mm.norm() < kFarthest_mm)) return;
  position_.isocentre_mm = point_mm;
  position_.translation_mm = Vec3::Zero();
}

void CArmConsole::press(ShotMode mode, Clock::time_point now) {
  owed_ = mode;
  if (mode == ShotMode::single) return;
  held_ = mode;
  // Whoever taps a pedal again and again gets no more pictures than by holding it.
  next_ = std::max(next_, now);
}

void CArmConsole::stop() {
  held_.reset();
  owed_.reset();
  under_way_.reset();
}

std::optional<ShotOrder> CArmConsole::due(Clock::time_point now) {
  if (!owed_ && !held_) return {};
  if (under_way_ && !(under_way_->counted && under_way_->order.position != position_)) return {};
  const ShotMode mode = owed_ ? *owed_ : *held_;
  if (mode != ShotMode::single) {
    if (now < next_) return {};
    // A picture that comes late moves those after it. Nothing is caught up on.
    next_ = std::max(next_ + period_of(mode), now);
  }
  owed_.reset();
  ++last_id_;
  const ShotOrder order{last_id_, mode, position_, first_seed_ + last_id_};
  under_way_ = UnderWay{order};
  return order;
}

CArmConsole::Came CArmConsole::came(std::uint64_t order, bool coarse, const CArmShot& made) {
  if (!under_way_ || under_way_->order.id != order) return Came::dropped;
  const bool counted = under_way_->counted;
  if (coarse)
    under_way_->counted = true;
  else
    under_way_.reset();
  if (counted) return Came::finer;
  shots_.push_back(made);
  shots_.back().number = ++last_number_;
  totals_.add(shots_.back());
  return Came::shot;
}

}  // namespace osteon
