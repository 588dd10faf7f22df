#include "common/mechanics/compliant_mount.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/check.hpp"

namespace osteon {
namespace {

constexpr double kMostLag_s = 1.0;     // a slower connection does not make the others wait longer
constexpr double kLagSmoothing = 0.1;  // of one measurement

Vec3 clamped(const Vec3& v, double most) {
  const double size = v.norm();
  return size > most ? Vec3(v * (most / size)) : v;
}

// Distance of a step and all following ones, each shorter by `less`.
double braking_way(double step, double less) {
  const double whole = std::floor(step / less);
  return (whole + 1.0) * (step - 0.5 * less * whole);
}

// The longest first step for such a distance: whole multiples of `less`, and a fraction.
double braking_step(double way, double less) {
  const double whole = std::floor(0.5 * (std::sqrt(1.0 + 8.0 * way / less) - 1.0));
  return less * whole + (way - 0.5 * less * whole * (whole + 1.0)) / (whole + 1.0);
}

double against(const Vec3& step, const Vec3& load) {
  return load.isZero() ? 0.0 : std::max(0.0, -step.dot(load) / load.norm());
}

// The energy that braking after a step releases to the load.
double braking_mj(const Vec3& last, const Vec3& load, double less) {
  return load.norm() * braking_way(std::max(0.0, against(last, load) - less), less);
}

// Limits a step against the load, so that the funds cover it and the braking after it.
Vec3 slowed(const Vec3& step, const Vec3& load, double less, double funds_mj) {
  const double size = load.norm(), wanted = against(step, load),
               most = wanted > 0.0 ? braking_step(funds_mj / size, less) : 0.0;
  return wanted > most ? Vec3(step + load * ((wanted - most) / size)) : step;
}

Eigen::Quaterniond quaternion(const Vec3& turn_rad) {
  const double angle = turn_rad.norm();
  return angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn_rad / angle)) : Eigen::Quaterniond::Identity();
}

Vec3 rotation_vector(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm();
  if (sine == 0.0) return Vec3::Zero();
  return q.vec() * ((q.w() < 0.0 ? -2.0 : 2.0) * std::atan2(sine, std::abs(q.w())) / sine);
}

// Lag of the mount itself behind a growing load: damping over stiffness, the larger of translation and rotation.
double lag_of(const MountParams& m) {
  constexpr double kSI = 1e-3;
  const double place = m.mass_kg / m.stiffness_n_per_mm, turn = m.inertia_kg_mm2 / m.stiffness_nmm_per_rad;
  return 2.0 * m.damping * std::sqrt(kSI * std::max(place, turn));
}

double smoothed_lag(double lag_s, double sample_s) {
  const double sample = std::clamp(sample_s, 0.0, kMostLag_s);
  return lag_s > 0.0 ? lag_s + kLagSmoothing * (sample - lag_s) : sample;
}

}  // namespace

bool MountServer::receive(std::uint64_t author, const MountLoad& push) noexcept {
  const auto found = authors_.find(author);
  if (found == authors_.end() || !push.load.finite() || !std::isfinite(push.energy_mj)) return false;
  Author& a = found->second;
  if (push.push_seq <= a.push_seq) return false;
  // The first total is the start of the count, because an earlier session may have left any value.
  if (a.push_seq == 0) {
    a.reported_mj = push.energy_mj;
    a.received_s = now_s_;
  }
  const double gained_mj = push.energy_mj - a.reported_mj;
  if (gained_mj > 0.0) {
    // A gain that no person could have put in does not count.
    constexpr double kSpare_s = 0.5;
    share_out(author, std::min(gained_mj, params_.most_n * params_.most_mm_per_s * (now_s_ - a.received_s + kSpare_s)));
    a.reported_mj = push.energy_mj;
  }
  a.push_seq = push.push_seq;
  a.received_s = now_s_;
  a.load = {clamped(push.load.force_n, params_.most_n), clamped(push.load.moment_nmm, params_.most_nmm)};
  if (push.seen_seq > 0 && push.seen_seq <= a.seen_seq && a.seen_seq - push.seen_seq < kTimesKept)
    a.lag_s = smoothed_lag(a.lag_s, now_s_ - a.sent_s[push.seen_seq % kTimesKept]);
  return true;
}

void MountServer::share_out(std::uint64_t from, double energy_mj) noexcept {
  if (authors_.size() < 2) return;  // nobody else could be pushed back by it
  for (auto& [author, a] : authors_)
    if (author != from) a.granted_mj += energy_mj / static_cast<double>(authors_.size() - 1);
}

void MountServer::step(double dt_s) noexcept {
  now_s_ += dt_s;
  Load all;
  for (auto& [author, a] : authors_) {
    if (now_s_ - a.received_s > params_.silent_s) a.load = std::exp(-dt_s / params_.fade_s) * a.load;
    all = all + a.load;
  }
  mount_.step(all, dt_s);
}

MountPose MountServer::seen(std::uint64_t author) noexcept {
  MountPose seen;
  seen.shift = mount_.shift();
  for (const auto& [other, a] : authors_) seen.lag_s = std::max(seen.lag_s, a.lag_s);
  const auto found = authors_.find(author);
  if (found == authors_.end()) return seen;
  Author& a = found->second;
  seen.seen_seq = ++a.seen_seq;
  a.sent_s[a.seen_seq % kTimesKept] = now_s_;
  seen.energy_mj = a.granted_mj;
  seen.push_seq = a.push_seq;
  return seen;
}

MountFollower::MountFollower(const MountFollowerParams& params)
    : params_(params), own_mj_(params.allowance_mj), mount_lag_s_(lag_of(params.mount)), low_pass_s_(params.least_s) {
  OSTEON_CHECK(params.mount.good() && params.least_s > 0.0 && params.most_s >= params.least_s && params.per_lag >= 0.0);
  OSTEON_CHECK(params.most_mm_per_s2 > 0.0 && params.most_rad_per_s2 > 0.0);
  OSTEON_CHECK(params.allowance_mj >= 0.0 && params.reserve_mj >= 0.0 && params.granted_most_mj >= 0.0);
}

void MountFollower::see(const MountPose& seen) noexcept {
  if (seen.seen_seq <= seen_seq_ || !seen.shift.finite() || !std::isfinite(seen.energy_mj) ||
      !std::isfinite(seen.lag_s))
    return;
  seen_seq_ = seen.seen_seq;
  since_seen_s_ = 0.0;
  received_ = {clamped(seen.shift.place_mm, params_.mount.most_mm),
               quaternion(clamped(seen.shift.turn_rad, params_.mount.most_rad))};
  slowest_s_ = std::clamp(seen.lag_s, 0.0, kMostLag_s);
  if (timed_seq_ > 0 && seen.push_seq >= timed_seq_) {
    lag_s_ = smoothed_lag(lag_s_, now_s_ - timed_s_);
    timed_seq_ = 0;
  }
  // As on the server, the first total is the start of the count.
  if (total_mj_ < 0.0) total_mj_ = std::max(0.0, seen.energy_mj);
  const double gained_mj = seen.energy_mj - total_mj_;
  if (gained_mj <= 0.0) return;
  total_mj_ = seen.energy_mj;
  granted_mj_ += gained_mj;
  others_mj_ = std::min(others_mj_ + gained_mj, params_.granted_most_mj);
}

void MountFollower::step(const Load& load, double dt_s) noexcept {
  load_ = load.finite() ? load : Load{};
  now_s_ += dt_s;
  since_seen_s_ += dt_s;

  // Two passes, so that neither the pose nor its speed jumps when a pose arrives.
  low_pass_s_ =
      std::clamp(params_.per_lag * (std::max(lag_s_, slowest_s_) + mount_lag_s_), params_.least_s, params_.most_s);
  const double share = -std::expm1(-dt_s / low_pass_s_), share_again = -std::expm1(-dt_s / params_.least_s);
  if (since_seen_s_ <= params_.silent_s) {
    smooth_.mm += share * (received_.mm - smooth_.mm);
    smooth_.turn =
        (quaternion(share * rotation_vector(received_.turn * smooth_.turn.conjugate())) * smooth_.turn).normalized();
  } else {
    smooth_ = shown_;
  }
  Vec3 move_mm = clamped(share_again * (smooth_.mm - shown_.mm), params_.most_mm_per_s * dt_s);
  Vec3 turn_rad =
      clamped(share_again * rotation_vector(smooth_.turn * shown_.turn.conjugate()), params_.most_rad_per_s * dt_s);
  // Slowed before the funds run out, and accelerated and stopped no faster than a real bone.
  const double most_mm = params_.most_mm_per_s2 * dt_s * dt_s, most_rad = params_.most_rad_per_s2 * dt_s * dt_s;
  // Translation and rotation each get what they need for braking. If both need more, each gets half of the remaining
  // funds.
  double funds_move_mj = braking_mj(move_mm_, load_.force_n, most_mm);
  double funds_turn_mj = braking_mj(turn_rad_, load_.moment_nmm, most_rad);
  const double needed_mj = funds_move_mj + funds_turn_mj, left_mj = funds_mj() - needed_mj;
  if (left_mj < 0.0) {
    funds_move_mj *= funds_mj() / needed_mj;
    funds_turn_mj *= funds_mj() / needed_mj;
  } else {
    const bool moves = against(move_mm, load_.force_n) > 0.0, turns = against(turn_rad, load_.moment_nmm) > 0.0;
    funds_move_mj += left_mj * (turns ? 0.5 : 1.0);
    funds_turn_mj += left_mj * (moves ? 0.5 : 1.0);
  }
  const Vec3 paid_mm = slowed(move_mm, load_.force_n, most_mm, funds_move_mj);
  const Vec3 paid_rad = slowed(turn_rad, load_.moment_nmm, most_rad, funds_turn_mj);
  held_back_ = paid_mm != move_mm || paid_rad != turn_rad;
  move_mm = move_mm_ + clamped(paid_mm - move_mm_, most_mm);
  turn_rad = turn_rad_ + clamped(paid_rad - turn_rad_, most_rad);

  // The energy that the step takes from the user, and what it gives. It changes only along force and moment, and only
  // as far as there are funds.
  double by_move_mj = load_.force_n.dot(move_mm), by_turn_mj = load_.moment_nmm.dot(turn_rad);
  const double taken_mj = std::max(0.0, by_move_mj) + std::max(0.0, by_turn_mj);
  const double wanted_mj = std::max(0.0, -by_move_mj) + std::max(0.0, -by_turn_mj);
  const double most_mj = funds_mj() + taken_mj;
  if (wanted_mj > most_mj) {
    held_back_ = true;
    const double less = 1.0 - most_mj / wanted_mj;
    if (by_move_mj < 0.0) move_mm -= less * by_move_mj / load_.force_n.squaredNorm() * load_.force_n;
    if (by_turn_mj < 0.0) turn_rad -= less * by_turn_mj / load_.moment_nmm.squaredNorm() * load_.moment_nmm;
    by_move_mj = load_.force_n.dot(move_mm);
    by_turn_mj = load_.moment_nmm.dot(turn_rad);
  }
  move_mm_ = move_mm;
  turn_rad_ = turn_rad;
  shown_.mm += move_mm;
  shown_.turn = (quaternion(turn_rad) * shown_.turn).normalized();

  // The user's own funds are spent first. Granted funds cover the rest.
  const double net_mj = by_move_mj + by_turn_mj;
  (net_mj > 0.0 ? put_in_mj_ : released_mj_) += std::abs(net_mj);
  own_mj_ += net_mj;
  if (own_mj_ < 0.0) {
    others_mj_ = std::max(0.0, others_mj_ + own_mj_);
    own_mj_ = 0.0;
  }

  // Granted funds are passed on while they are not needed here, so that a client without funds eventually gets them.
  const double spare_mj = std::max(0.0, own_mj_ - params_.reserve_mj);
  const double handed_on_mj = held_back_ || net_mj < 0.0 ? 0.0 : std::min(1.0, dt_s / params_.hand_on_s) * others_mj_;
  own_mj_ -= spare_mj;
  others_mj_ -= handed_on_mj;
  given_mj_ += spare_mj + handed_on_mj;
}

MountLoad MountFollower::push() noexcept {
  MountLoad push{++push_seq_, load_, given_mj_, seen_seq_};
  if (timed_seq_ == 0) {
    timed_seq_ = push_seq_;
    timed_s_ = now_s_;
  }
  return push;
}

void MountFollower::rejoin() noexcept {
  seen_seq_ = timed_seq_ = 0;
  total_mj_ = -1.0;
}

Pose MountFollower::pose_world_bone() const { return osteon::pose_world_bone(params_.mount, shift()); }

Shift MountFollower::shift() const noexcept { return {shown_.mm, rotation_vector(shown_.turn)}; }

}  // namespace osteon
