// A bone on a mount (mount.hpp) between a server at 120 Hz and the hands of several clients at 1 kHz, over lines that
// delay, lose and reorder. The server simulates the bone under everybody's newest push. A client shows its hand a pose
// that follows the newest one told, low-passed and slew limited, and never gives the hand energy that nobody put in:
// time-domain passivity (Ryu, Artigas and Preusche 2010, with energy told in packets).
//
//   hand --load--> MountFollower --MountLoad--> MountServer --MountPose--> MountFollower --pose--> hand
//
// What a user puts in is the work of the load over the way of the bone as shown to that user. Each client keeps an
// account:
//
//   funds = allowance + put in - released - given away + granted >= 0
//
// A step of the shown bone that would overdraw it is held back as far as it gives energy, and ahead of that it is
// slowed, so that it seldom stops at once. Nothing is forgotten by that: the pose told is where the bone goes as soon
// as that is paid for, or costs nothing as the hand lets go. Nor does it set out at once: the hand's own ledger, which
// looks a tick ahead, reckons with accelerations of some m/s².
//
// What its hand has put in, but for a little, a client gives away; the server grants it to the others, who need it to
// be pushed back and hand on what they do not. Totals that never fall are told, so that loss and order do no harm. Over
// all users, for any line and any hand:
//
//   sum of put in >= sum of released - sum of allowances
//
// The pose told is that of the whole bone: one's own push is seen as late as those of others. So two equal pushes
// cancel while they grow too, and at rest, where low pass and line have come to their end, all hands feel the closed
// form of mount.hpp. The price is that the bone yields late where the line is long: the low pass follows the slowest
// line.
#pragma once
#include <array>
#include <cstdint>
#include <map>

#include "common/mechanics/mount.hpp"

namespace osteon {

// From a client: how its hand loads the bone, world frame. The newest counts.
struct MountLoad {
  std::uint64_t push_seq = 0;  // rises by one with every push
  Load load;                   // of the tool on the bone
  double energy_mj = 0;        // that the client has given away since it began; never falls
  std::uint64_t seen_seq = 0;  // newest MountPose that has come; 0: none
};

// To a client: where the bone is. The newest counts.
struct MountPose {
  std::uint64_t seen_seq = 0;  // rises by one with every one told to this client
  Shift shift;
  double energy_mj = 0;        // granted to this client since it joined; never falls
  std::uint64_t push_seq = 0;  // its newest push that is in it; 0: none
  double lag_s = 0;            // from a place told to the push that answers it, of the slowest who pushes
};

struct MountServerParams {
  MountParams mount;
  double most_n = 100.0, most_nmm = 20000.0;  // of one user's load; more is taken for so much
  double most_mm_per_s = 500.0;               // a client cannot have put in more than most_n over this
  double silent_s = 0.5;                      // a push that is not renewed for so long dies away ...
  double fade_s = 0.2;                        // ... with this time constant
};

// The server's end. [tick] all of it. Authors are those who may push.
class MountServer {
 public:
  explicit MountServer(const MountServerParams& params) : params_(params), mount_(params.mount) {}

  // Begins anew where the author is there already.
  void join(std::uint64_t author) { authors_.insert_or_assign(author, Author{}); }
  void leave(std::uint64_t author) { authors_.erase(author); }
  // False where it is ignored: of nobody who joined, not newer than the last, or not finite.
  bool receive(std::uint64_t author, const MountLoad& push) noexcept;
  void step(double dt_s) noexcept;
  // To be sent to this author; for anybody else the place alone, with seen_seq 0.
  [[nodiscard]] MountPose seen(std::uint64_t author) noexcept;

  [[nodiscard]] const Mount& mount() const noexcept { return mount_; }

 private:
  static constexpr std::size_t kTimesKept = 256;
  struct Author {
    std::uint64_t push_seq = 0, seen_seq = 0;
    Load load;
    double told_mj = 0, granted_mj = 0;
    double heard_s = 0, lag_s = 0;
    std::array<double, kTimesKept> sent_s{};  // of the last places told, by number
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
  double per_lag = 4.0;                 // it is this many times the lag of the slowest line and of the mount itself
  double most_mm_per_s = 60.0, most_rad_per_s = 1.0;
  double most_mm_per_s2 = 5000.0, most_rad_per_s2 = 50.0;  // but for a stop that funds compel [A]
  double allowance_mj = 2.0;                               // that may be released unpaid, in all
  double kept_mj = 2.0;                                    // of what this hand put in; the rest is given away at once
  double granted_most_mj = 50.0;                           // of what others gave, at hand
  double hand_on_s = 0.5;  // time constant with which that is given away again while it is not wanted
  double silent_s = 0.5;   // without a place told for so long the bone stands
};

// The client's end. [haptic] all of it but the constructor; nothing allocates.
class MountFollower {
 public:
  explicit MountFollower(const MountFollowerParams& params);

  void see(const MountPose& seen) noexcept;
  // One tick: `load` is what the tool did to the bone since the last one, held over this step.
  void step(const Load& load, double dt_s) noexcept;
  // The newest load and what was given away; of as many pushes as one likes.
  [[nodiscard]] MountLoad push() noexcept;
  // The session began anew: numbers and totals of the server do, the bone goes on from where it is shown.
  void rejoin() noexcept;

  [[nodiscard]] Pose pose_world_bone() const;
  [[nodiscard]] Shift shift() const noexcept;
  // Work of the load over the shown bone's way, from the start: what the hand put in, and what was released to it.
  [[nodiscard]] double put_in_mj() const noexcept { return put_in_mj_; }
  [[nodiscard]] double released_mj() const noexcept { return released_mj_; }
  [[nodiscard]] double given_mj() const noexcept { return given_mj_; }
  [[nodiscard]] double granted_mj() const noexcept { return granted_mj_; }
  // At hand for what the bone may release.
  [[nodiscard]] double funds_mj() const noexcept { return own_mj_ + others_mj_; }
  // The last step was held back for want of it.
  [[nodiscard]] bool held_back() const noexcept { return held_back_; }
  [[nodiscard]] double low_pass_s() const noexcept { return low_pass_s_; }

 private:
  struct Place {
    Vec3 mm = Vec3::Zero();
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  };

  MountFollowerParams params_;
  Place told_, smooth_, shown_;                            // the newest pose, after one pass, after both
  Vec3 move_mm_ = Vec3::Zero(), turn_rad_ = Vec3::Zero();  // of the last step
  Load load_;
  double own_mj_, others_mj_ = 0;  // funds: of what this hand put in, and of what was granted
  double put_in_mj_ = 0, released_mj_ = 0, given_mj_ = 0, granted_mj_ = 0;
  double total_mj_ = -1;  // told by the server, newest; negative: not yet
  double since_seen_s_ = 0, now_s_ = 0;
  double lag_s_ = 0, slowest_s_ = 0, mount_lag_s_, low_pass_s_;
  std::uint64_t seen_seq_ = 0, push_seq_ = 0, timed_seq_ = 0;
  double timed_s_ = 0;  // when the push of that number was made
  bool held_back_ = false;
};

}  // namespace osteon
