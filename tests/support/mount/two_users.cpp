#include "tests/support/mount/two_users.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <random>

#include "common/mechanics/simulated_hand.hpp"

namespace osteon::test {
namespace {

constexpr double kDt = 1e-3;
constexpr double kServerDt = 1.0 / 120.0;
constexpr double kCoupling = 50.0;  // N/mm

double whole(double value, double step) { return step * std::round(value / step); }
Vec3 whole(const Vec3& v, double step) { return {whole(v.x(), step), whole(v.y(), step), whole(v.z(), step)}; }

// Rounded as on the wire; totals are rounded down.
MountLoad rounded(MountLoad push) {
  push.load = {whole(push.load.force_n, 1e-3), whole(push.load.moment_nmm, 1e-2)};
  push.energy_mj = 1e-3 * std::floor(push.energy_mj / 1e-3);
  return push;
}
MountPose rounded(MountPose seen) {
  seen.shift = {whole(seen.shift.place_mm, 0x1p-16), whole(seen.shift.turn_rad, 0x1p-20)};
  seen.energy_mj = 1e-3 * std::floor(seen.energy_mj / 1e-3);
  seen.lag_s = whole(seen.lag_s, 1e-3);
  return seen;
}

template <class Message>
class Line {
 public:
  void send(const Message& message, double now_s, double after_s) { under_way_.push_back({now_s + after_s, message}); }
  template <class Take>
  void deliver(double now_s, const Take& take) {
    for (std::size_t i = 0; i < under_way_.size();) {
      if (under_way_[i].at_s > now_s) {
        ++i;
        continue;
      }
      take(under_way_[i].message);
      under_way_.erase(under_way_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

 private:
  struct Packet {
    double at_s;
    Message message;
  };
  std::deque<Packet> under_way_;
};

struct User {
  User(const MountFollowerParams& client, const HandParams& params) : bone(client), hand(params, {-kApart_mm, 0, 0}) {}
  static constexpr double kApart_mm = 2.0;  // distance of a hand that does not push

  MountFollower bone;
  Hand hand;  // its x: depth of the tip beyond the face of the unloaded bone
  Line<MountLoad> up;
  Line<MountPose> down;
  double side = 1.0;  // pushes along x or against it
  Vec3 face_mm;       // contact point, bone frame
  double push_mm = 0, from_s = 0, ramp_s = 0;
  double force_n = 0, face_x_mm = 0;
  Load load;
  double put_in_mj = 0;

  // Motion of the face along the push.
  double face_now_mm() const { return side * (bone.pose_world_bone().point(face_mm).x() - face_mm.x()); }
};

// Rest position of the hand, for a push that begins at from_s of the cycle and ends after 7/8 of it.
double wanted_mm(const User& user, double in_cycle_s, double cycle_s) {
  const double up = std::clamp((in_cycle_s - user.from_s) / user.ramp_s, 0.0, 1.0);
  const double down = std::clamp((in_cycle_s - 0.875 * cycle_s) / 0.2, 0.0, 1.0);
  return (1.0 - down) * up * (user.push_mm + User::kApart_mm) - User::kApart_mm;
}

// Forces at rest: springs k from e1 and e2 on the mount as their line sees it.
struct AtRest {
  double force_n[2], other_n[2];
};
AtRest at_rest(const TwoUsersRun& run, const User (&users)[2], double k) {
  const MountParams& m = run.server.mount;
  const double mount = 1.0 / (1.0 / m.stiffness_n_per_mm + run.arm_mm * run.arm_mm / m.stiffness_nmm_per_rad);
  const double e[2] = {users[0].side * users[0].push_mm, users[1].side * users[1].push_mm};
  const double x = k * (e[0] + e[1]) / (mount + 2.0 * k);
  AtRest rest{};
  for (int i = 0; i < 2; ++i) {
    rest.force_n[i] = users[i].side * k * (e[i] - x);
    rest.other_n[i] = rest.force_n[i] - users[i].side * k * (e[i] - k * e[i] / (mount + k));
  }
  return rest;
}

}  // namespace

TwoUsersResult push_each_other(const TwoUsersRun& run) {
  std::mt19937_64 random(run.seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto travel_s = [&](int i) {
    return 1e-3 * std::max(0.0, run.delay_ms[i] + uniform(-run.jitter_ms, run.jitter_ms));
  };

  HandParams hand = expert_hand();
  hand.stiffness_n_per_mm *= run.hand_stiffness;
  User users[2] = {User(run.client, hand), User(run.client, hand)};
  MountServer server(run.server);
  server.join(1);
  server.join(2);
  const double k = 1.0 / (1.0 / hand.stiffness_n_per_mm + 1.0 / kCoupling);

  TwoUsersResult result;
  double server_s = 0.0, cycle_end_s = 0.0, error_sum = 0.0;
  for (long tick = 0; tick < run.ticks; ++tick) {
    const double now_s = kDt * static_cast<double>(tick), in_cycle_s = run.cycle_s - (cycle_end_s - now_s);
    // A new push: against each other or side by side, quick or slow, together or not.
    if (now_s >= cycle_end_s) {
      cycle_end_s = now_s + run.cycle_s;
      for (User& user : users) {
        user.push_mm = uniform(run.least_push_mm, run.most_push_mm);
        user.from_s = uniform(0.0, 0.1 * run.cycle_s);
        user.ramp_s = uniform(0.05, 1.0);
        user.side = &user == users || uniform(0.0, 1.0) < 0.25 ? 1.0 : -1.0;
        user.face_mm = {-10.0 * user.side, run.arm_mm, 0.0};
      }
      if (uniform(0.0, 1.0) < 0.5) users[1].from_s = users[0].from_s, users[1].ramp_s = users[0].ramp_s;
      for (User& user : users) user.face_x_mm = user.face_now_mm();
    }

    for (std::size_t i = 0; i < 2; ++i) {
      User& user = users[i];
      user.down.deliver(now_s, [&](const MountPose& seen) { user.bone.see(seen); });
      const Shift before = user.bone.shift();
      user.bone.step(user.load, kDt);
      const Shift after = user.bone.shift();
      const Vec3 move_mm = after.place_mm - before.place_mm, turn_rad = after.turn_rad - before.turn_rad;
      user.put_in_mj += user.load.force_n.dot(move_mm) + user.load.moment_nmm.dot(turn_rad);
      result.most_step_mm = std::max(result.most_step_mm, move_mm.norm());
      result.held_back += user.bone.held_back();
      result.slowest_low_pass_s = std::max(result.slowest_low_pass_s, user.bone.low_pass_s());

      // The coupling with the damping that a sampled spring needs. It does not pull.
      HandCommand command;
      command.axis = Vec3::UnitX();
      command.target_mm.x() = in_cycle_s < 0.0 ? -User::kApart_mm : wanted_mm(user, in_cycle_s, run.cycle_s);
      const double hertz = 0.6 + 1.7 * static_cast<double>(i);
      if (run.shaken) command.target_mm.x() += 2.0 * std::sin(6.283 * hertz * now_s) * uniform(0.5, 1.0);
      const double face_mm = user.face_now_mm();
      const double deep_mm = user.hand.position_mm().x() - face_mm;
      const double speed = user.hand.velocity_mm_per_s().x() - (face_mm - user.face_x_mm) / kDt;
      user.face_x_mm = face_mm;
      user.force_n = deep_mm > 0.0 ? std::max(0.0, kCoupling * (deep_mm + kDt * speed)) : 0.0;
      user.hand.step(command, {-user.force_n, 0, 0}, kDt);
      const Pose pose = user.bone.pose_world_bone();
      user.load =
          Load::at({user.side * user.force_n, 0, 0}, pose.point(user.face_mm) - pose.point(run.server.mount.centre_mm));
      double& most_n = result.most_force_n[2 * tick >= run.ticks];
      most_n = std::max(most_n, user.force_n);
      if (tick % 8 == static_cast<long>(3 * i)) {
        const MountLoad push = rounded(user.bone.push());
        if (uniform(0.0, 1.0) >= run.loss) user.up.send(push, now_s, travel_s(static_cast<int>(i)));
      }
    }
    result.most_created_mj = std::max(result.most_created_mj, -users[0].put_in_mj - users[1].put_in_mj);

    if (now_s >= server_s) {
      server_s += kServerDt;
      for (std::size_t i = 0; i < 2; ++i)
        users[i].up.deliver(now_s, [&](const MountLoad& push) { static_cast<void>(server.receive(i + 1, push)); });
      server.step(kServerDt);
      for (std::size_t i = 0; i < 2; ++i) {
        const MountPose seen = rounded(server.seen(i + 1));
        if (uniform(0.0, 1.0) >= run.loss) users[i].down.send(seen, now_s, travel_s(static_cast<int>(i)));
      }
    }

    // The end of a push. There the closed form has both in contact.
    const double measured_s = 0.875 * run.cycle_s;
    if (!run.shaken && in_cycle_s < measured_s && in_cycle_s + kDt >= measured_s) {
      const AtRest rest = at_rest(run, users, k);
      if (rest.force_n[0] < 1.0 || rest.force_n[1] < 1.0) continue;
      for (std::size_t i = 0; i < 2; ++i) {
        const double error = std::abs((users[i].force_n - rest.force_n[i]) / rest.other_n[i]);
        result.worst_error = std::max(result.worst_error, error);
        result.least_other_n = std::min(result.least_other_n, std::abs(rest.other_n[i]));
        error_sum += error;
      }
      ++result.rests;
    }
  }
  for (const User& user : users) {
    result.put_in_mj += user.bone.put_in_mj();
    result.released_mj += user.bone.released_mj();
    result.account_difference_mj = std::max(result.account_difference_mj,
                                            std::abs(user.put_in_mj - user.bone.put_in_mj() + user.bone.released_mj()));
  }
  if (result.rests > 0) result.mean_error = error_sum / (2.0 * result.rests);
  return result;
}

}  // namespace osteon::test
