#include "common/wire/bone_motion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace osteon::wire {
namespace {

constexpr double kPerNewton = 1e3, kPerNewtonMillimetre = 1e2, kPerMillijoule = 1e3;
constexpr double kPerMillimetre = 65536.0, kPerRadian = 1048576.0;
constexpr std::int64_t kMostEnergy = std::int64_t{1} << 53;  // steps that a double still counts one by one
constexpr std::uint32_t kMostLag_ms = 60'000;

using Numbers = google::protobuf::RepeatedField<std::int32_t>;

tl::unexpected<Error> bad(const std::string& field, const std::string& what) {
  return failure(ErrorCode::invalid_input, field + " " + what);
}

void set(Numbers& out, const Vec3& v, double per_unit) {
  constexpr double kMost = std::numeric_limits<std::int32_t>::max();
  for (int i = 0; i < 3; ++i)
    out.Add(std::isnan(v[i]) ? 0 : static_cast<std::int32_t>(std::clamp(std::round(v[i] * per_unit), -kMost, kMost)));
}

Result<Vec3> get(const Numbers& in, double per_unit, const char* field) {
  if (in.size() != 3) return bad(field, "needs 3 numbers, this has " + std::to_string(in.size()));
  return Vec3(Vec3(in[0], in[1], in[2]) / per_unit);
}

std::int64_t energy_steps(double mj) {
  if (!(mj > 0.0)) return 0;
  return static_cast<std::int64_t>(std::min(std::floor(mj * kPerMillijoule), static_cast<double>(kMostEnergy)));
}

Result<double> energy_mj(std::int64_t steps, const char* field) {
  if (steps < 0 || steps > kMostEnergy) return bad(field, "is " + std::to_string(steps) + " and must be from 0 to 2^53");
  return static_cast<double>(steps) / kPerMillijoule;
}

}  // namespace

v1::BonePush to_wire(const BonePush& push) {
  v1::BonePush out;
  out.set_push_seq(push.push_seq);
  set(*out.mutable_force(), push.load.force_n, kPerNewton);
  set(*out.mutable_moment(), push.load.moment_nmm, kPerNewtonMillimetre);
  out.set_energy(energy_steps(push.energy_mj));
  out.set_seen_seq(push.seen_seq);
  return out;
}

v1::BoneSeen to_wire(const BoneSeen& seen) {
  v1::BoneSeen out;
  out.set_seen_seq(seen.seen_seq);
  set(*out.mutable_place(), seen.shift.place_mm, kPerMillimetre);
  set(*out.mutable_turn(), seen.shift.turn_rad, kPerRadian);
  out.set_energy(energy_steps(seen.energy_mj));
  out.set_push_seq(seen.push_seq);
  const double lag_ms = std::isfinite(seen.lag_s) ? std::clamp(std::round(1e3 * seen.lag_s), 0.0, double{kMostLag_ms}) : 0.0;
  out.set_lag_ms(static_cast<std::uint32_t>(lag_ms));
  return out;
}

Result<BonePush> from_wire(const v1::BonePush& push) {
  if (push.push_seq() == 0) return bad("push.push_seq", "must be at least 1");
  const Result<Vec3> force = get(push.force(), kPerNewton, "push.force");
  if (!force) return tl::unexpected(force.error());
  const Result<Vec3> moment = get(push.moment(), kPerNewtonMillimetre, "push.moment");
  if (!moment) return tl::unexpected(moment.error());
  const Result<double> energy = energy_mj(push.energy(), "push.energy");
  if (!energy) return tl::unexpected(energy.error());
  return BonePush{push.push_seq(), {*force, *moment}, *energy, push.seen_seq()};
}

Result<BoneSeen> from_wire(const v1::BoneSeen& seen) {
  if (seen.seen_seq() == 0) return bad("bone.seen_seq", "must be at least 1");
  const Result<Vec3> place = get(seen.place(), kPerMillimetre, "bone.place");
  if (!place) return tl::unexpected(place.error());
  const Result<Vec3> turn = get(seen.turn(), kPerRadian, "bone.turn");
  if (!turn) return tl::unexpected(turn.error());
  if (turn->norm() > std::numbers::pi) return bad("bone.turn", "is more than half a turn");
  const Result<double> energy = energy_mj(seen.energy(), "bone.energy");
  if (!energy) return tl::unexpected(energy.error());
  if (seen.lag_ms() > kMostLag_ms)
    return bad("bone.lag_ms", "is " + std::to_string(seen.lag_ms()) + " and must be at most 60000");
  return BoneSeen{seen.seen_seq(), {*place, *turn}, *energy, seen.push_seq(), 1e-3 * seen.lag_ms()};
}

}  // namespace osteon::wire
