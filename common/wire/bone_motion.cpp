#include "common/wire/bone_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

namespace osteon::wire {
namespace {

constexpr double kPerNewton = 1e3, kPerNewtonMillimetre = 1e2, kPerMillijoule = 1e3;
constexpr double kPerMillimetre = 65536.0, kPerRadian = 1048576.0;
constexpr std::int64_t kMostEnergy = std::int64_t{1} << 53;  // largest number of steps that a double counts exactly
constexpr std::uint32_t kMostLag_ms = 60'000;

using Integers = google::protobuf::RepeatedField<std::int32_t>;

void set(Integers& out, const Vec3& v, double per_unit) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  for (int i = 0; i < 3; ++i)
    out.Add(std::isnan(v[i]) ? 0 : static_cast<std::int32_t>(std::clamp(std::round(v[i] * per_unit), -kMost, kMost)));
}

std::int64_t energy_steps(double mj) {
  if (!(mj > 0.0)) return 0;
  return static_cast<std::int64_t>(std::min(std::floor(mj * kPerMillijoule), static_cast<double>(kMostEnergy)));
}

// Continues to read after a wrong number. The first fault is the error.
class Reading {
 public:
  void expect(bool good, const char* field, const std::string& what) {
    if (!good && !error_) error_ = Error{ErrorCode::invalid_input, std::string(field) + " " + what};
  }
  Vec3 vector(const Integers& in, double per_unit, const char* field) {
    expect(in.size() == 3, field, "needs 3 numbers, this has " + std::to_string(in.size()));
    return in.size() == 3 ? Vec3(Vec3(in[0], in[1], in[2]) / per_unit) : Vec3(Vec3::Zero());
  }
  double energy_mj(std::int64_t steps, const char* field) {
    expect(steps >= 0 && steps <= kMostEnergy, field, "is " + std::to_string(steps) + " and must be from 0 to 2^53");
    return static_cast<double>(steps) / kPerMillijoule;
  }
  template <class T>
  Result<T> of(const T& read) const {
    if (error_) return tl::unexpected(*error_);
    return read;
  }

 private:
  std::optional<Error> error_;
};

}  // namespace

v1::MountLoad to_wire(const MountLoad& push) {
  v1::MountLoad out;
  out.set_push_seq(push.push_seq);
  set(*out.mutable_force(), push.load.force_n, kPerNewton);
  set(*out.mutable_moment(), push.load.moment_nmm, kPerNewtonMillimetre);
  out.set_energy(energy_steps(push.energy_mj));
  out.set_seen_seq(push.seen_seq);
  return out;
}

v1::MountPose to_wire(const MountPose& seen) {
  v1::MountPose out;
  out.set_seen_seq(seen.seen_seq);
  set(*out.mutable_place(), seen.shift.place_mm, kPerMillimetre);
  set(*out.mutable_turn(), seen.shift.turn_rad, kPerRadian);
  out.set_energy(energy_steps(seen.energy_mj));
  out.set_push_seq(seen.push_seq);
  const double lag_ms =
      std::isfinite(seen.lag_s) ? std::clamp(std::round(1e3 * seen.lag_s), 0.0, double{kMostLag_ms}) : 0.0;
  out.set_lag_ms(static_cast<std::uint32_t>(lag_ms));
  return out;
}

Result<MountLoad> from_wire(const v1::MountLoad& push) {
  Reading read;
  read.expect(push.push_seq() > 0, "push.push_seq", "must be at least 1");
  const Vec3 force_n = read.vector(push.force(), kPerNewton, "push.force");
  const Vec3 moment_nmm = read.vector(push.moment(), kPerNewtonMillimetre, "push.moment");
  const double energy_mj = read.energy_mj(push.energy(), "push.energy");
  return read.of(MountLoad{push.push_seq(), {force_n, moment_nmm}, energy_mj, push.seen_seq()});
}

Result<MountPose> from_wire(const v1::MountPose& seen) {
  Reading read;
  read.expect(seen.seen_seq() > 0, "bone.seen_seq", "must be at least 1");
  const Vec3 place_mm = read.vector(seen.place(), kPerMillimetre, "bone.place");
  const Vec3 turn_rad = read.vector(seen.turn(), kPerRadian, "bone.turn");
  read.expect(turn_rad.norm() <= std::numbers::pi, "bone.turn", "is more than half a turn");
  const double energy_mj = read.energy_mj(seen.energy(), "bone.energy");
  read.expect(seen.lag_ms() <= kMostLag_ms, "bone.lag_ms",
              "is " + std::to_string(seen.lag_ms()) + " and must be at most 60000");
  return read.of(MountPose{seen.seen_seq(), {place_mm, turn_rad}, energy_mj, seen.push_seq(), 1e-3 * seen.lag_ms()});
}

}  // namespace osteon::wire
