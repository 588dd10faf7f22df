// A bone on a compliant mount (mount.hpp). A server simulates it at 120 Hz, and the users of several clients feel it at
// 1 kHz. The networks between them delay, lose and reorder packets. The server simulates the bone under the newest load
// of every client. A client shows its user a pose that follows the newest received one, low-passed and slew limited. It
// never gives the user energy that nobody has put in: time-domain passivity (Ryu, Artigas and Preusche 2010, with
// energies sent in packets).
//
//   hand --load--> MountFollower --MountLoad--> MountServer --MountPose--> MountFollower --pose--> hand
//
// What a user puts in is the work of the load along the motion of the bone as shown to that user. Each client keeps an
// account:
//
//   funds = allowance + put in - released - given away + granted >= 0
//
// A step of the shown bone that would overdraw the account is reduced in so far as it releases energy. Motion is slowed
// before that, so that it seldom stops abruptly. The received pose is not forgotten: the bone goes there as soon as
// that is paid for, or once it costs nothing because the user lets go. It also accelerates gradually, because the
// client's own energy ledger looks one tick ahead and expects accelerations of some m/s².
//
// A client gives away almost all energy that its user has put in. The server grants it to the other clients, who need
// it to be pushed back. They pass on what they do not use. Messages contain totals that never decrease, so loss and
// reordering do no harm. Over all users, for any network and any user:
//
//   sum of put in >= sum of released - sum of allowances
//
// The sent pose is that of the whole bone, so a user's own load is seen as late as that of others. Therefore two equal
// loads cancel also while they grow. At rest, when low pass and network have settled, all users feel the closed form of
// mount.hpp. The price is that the bone yields late on a slow network, because the low pass follows the slowest
// connection.
#pragma once
#include <array>
#include <cstdint>
#include <map>

#include "common/mechanics/mount.hpp"

namespace osteon {

// From a client: how its user loads the bone, world frame. The newest value counts.
struct MountLoad {
  std::uint64_t push_seq = 0;  // rises by one with every message
  Load load;                   // of the tool on the bone
  double energy_mj = 0;        // that the client has given away since it began; never decreases
  std::uint64_t seen_seq = 0;  // newest MountPose that arrived; 0: none
};

// To a client: the pose of the bone. The newest value counts.
struct MountPose {
  std::uint64_t seen_seq = 0;  // rises by one with every message to this client
  Shift shift;
  double energy_mj = 0;        // granted to this client since it joined; never decreases
  std::uint64_t push_seq = 0;  // the client's newest load that it includes; 0: none
  double lag_s = 0;  // time from a pose sent to the load that answers it, for the slowest client that loads the bone
};

struct MountServerParams {
  MountParams mount;
  double most_n = 100.0, most_nmm = 20000.0;  // of one user's load; larger loads are limited to this
  double most_mm_per_s = 500.0;  // limits the energy that a client can have put in: most_n along this speed
  double silent_s = 0.5;         // a load that is not renewed for this time fades ...
  double fade_s = 0.2;           // ... with this time constant
};

// The server's end. [tick] all of it. Authors are those who may load the bone.
class MountServer {
 public:
  explicit MountServer(const MountServerParams& params) : params_(params), mount_(params.mount) {}

  // Starts again if the author has already joined.
  void join(std::uint64_t author) { authors_.insert_or_assign(author, Author{}); }
  void leave(std::uint64_t author) { authors_.erase(author); }
  // False if the load is ignored: the author has not joined, or the load is not newer than the last one or not finite.
  bool receive(std::uint64_t author, const MountLoad& push) noexcept;
  void step(double dt_s) noexcept;
  // The pose to send to this author. For anybody else only the pose, with seen_seq 0.
  [[nodiscard]] MountPose seen(std::uint64_t author) noexcept;

  [[nodiscard]] const Mount& mount() const noexcept { return mount_; }

 private:
  static constexpr std::size_t kTimesKept = 256;
  struct Author {
    std::uint64_t push_seq = 0, seen_seq = 0;
    Load load;
    double reported_mj = 0, granted_mj = 0;
    double received_s = 0, lag_s = 0;
    std::array<double, kTimesKept> sent_s{};  // send times of the last poses, by number
  };
  void share_out(std::uint64_t from, double energy_mj) noexcept;

  MountServerParams params_;
  Mount mount_;
  std::map<std::uint64_t, Author> authors_;
  double now_s_ = 0;
};

struct MountFollowerParams {
  MountParams mount;
  double least_s = 0.03, most_s = 2.0;  // time constant of the low pass
  double per_lag = 4.0;                 // times the lag of the slowest connection and of the mount itself
  double most_mm_per_s = 60.0, most_rad_per_s = 1.0;
  double most_mm_per_s2 = 5000.0, most_rad_per_s2 = 50.0;  // except for a stop that the funds require [A]
  double allowance_mj = 2.0;                               // that may be released without being put in, in total
  double reserve_mj = 2.0;                                 // of what this user put in; the rest is given away at once
  double granted_most_mj = 50.0;                           // largest unused part of what others gave
  double hand_on_s = 0.5;  // time constant with which the unused part is given away again
  double silent_s = 0.5;   // without a received pose for this time the bone stops
};

// The client's end. [haptic] all of it except the constructor. Nothing allocates.
class MountFollower {
 public:
  explicit MountFollower(const MountFollowerParams& params);

  void see(const MountPose& seen) noexcept;
  // One tick. `load` is what the tool did to the bone since the last tick, held constant over this step.
  void step(const Load& load, double dt_s) noexcept;
  // The newest load and the energy given away. May be called any number of times.
  [[nodiscard]] MountLoad push() noexcept;
  // The session restarted. Numbers and totals of the server start again; the bone continues from its shown pose.
  void rejoin() noexcept;

  [[nodiscard]] Pose pose_world_bone() const;
  [[nodiscard]] Shift shift() const noexcept;
  // Work of the load along the motion of the shown bone, since the start: what the user put in, and what was released.
  [[nodiscard]] double put_in_mj() const noexcept { return put_in_mj_; }
  [[nodiscard]] double released_mj() const noexcept { return released_mj_; }
  [[nodiscard]] double given_mj() const noexcept { return given_mj_; }
  [[nodiscard]] double granted_mj() const noexcept { return granted_mj_; }
  // Energy that the bone may still release.
  [[nodiscard]] double funds_mj() const noexcept { return own_mj_ + others_mj_; }
  // Whether the last step was reduced for lack of funds.
  [[nodiscard]] bool held_back() const noexcept { return held_back_; }
  [[nodiscard]] double low_pass_s() const noexcept { return low_pass_s_; }

 private:
  struct Place {
    Vec3 mm = Vec3::Zero();
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  };

  MountFollowerParams params_;
  Place received_, smooth_, shown_;                        // the newest pose, after one pass, after both
  Vec3 move_mm_ = Vec3::Zero(), turn_rad_ = Vec3::Zero();  // of the last step
  Load load_;
  double own_mj_, others_mj_ = 0;  // funds: of what this user put in, and of what was granted
  double put_in_mj_ = 0, released_mj_ = 0, given_mj_ = 0, granted_mj_ = 0;
  double total_mj_ = -1;  // newest total sent by the server; negative: none yet
  double since_seen_s_ = 0, now_s_ = 0;
  double lag_s_ = 0, slowest_s_ = 0, mount_lag_s_, low_pass_s_;
  std::uint64_t seen_seq_ = 0, push_seq_ = 0, timed_seq_ = 0;
  double timed_s_ = 0;  // when the load with that number was made
  bool held_back_ = false;
};

}  // namespace osteon
