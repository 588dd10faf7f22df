#include "common/link/send_rate.hpp"

#include <cmath>

namespace osteon {
namespace {

constexpr double kSmoothing_packets = 64.0;
// Loss never counts as certain or impossible, because the estimate uses few packets.
constexpr double kLeastLoss = 0.005, kMostLoss = 0.9;

double seconds(std::chrono::nanoseconds t) { return std::chrono::duration<double>(t).count(); }

}  // namespace

double SendRate::tokens(Time now) const {
  return std::min(static_cast<double>(params_.burst_bytes), tokens_ + seconds(now - filled_) * params_.bytes_per_s);
}

SendRate::Time SendRate::next(Time now, Time wanted, std::size_t needed_bytes, bool fresh) const {
  if (last_ == Time::min()) return now;
  Time at = std::max(now, last_ + (fresh ? params_.fresh_interval : params_.interval));
  at = std::max(at, std::min(wanted, last_ + params_.idle_interval));
  const std::size_t needed = std::min(needed_bytes, kMostDatagramBytes) + params_.overhead_bytes;
  const double lacking = static_cast<double>(std::max(params_.least_bytes, needed)) - tokens(at);
  if (lacking > 0.0) at += Time(static_cast<std::int64_t>(std::ceil(lacking / params_.bytes_per_s * 1e9)));
  return at;
}

std::size_t SendRate::budget(Time now, bool fresh) const {
  if (next(now, now, 0, fresh) > now) return 0;
  // A byte that is missing only by rounding counts.
  return std::min(kMostDatagramBytes, static_cast<std::size_t>(tokens(now) + 1e-3) - params_.overhead_bytes);
}

void SendRate::sent(Time now, std::size_t bytes) {
  tokens_ = tokens(now) - static_cast<double>(bytes + params_.overhead_bytes);
  filled_ = now;
  last_ = now;
}

void SendRate::acknowledge(std::uint64_t newest_counter, std::uint64_t received) {
  if (newest_counter <= newest_ || received < received_) return;
  const auto passed = static_cast<double>(newest_counter - newest_);
  // Reordered packets are counted late, so a single report may show too many or too few losses. The average over
  // several reports is correct.
  const double share = 1.0 - static_cast<double>(received - received_) / passed;
  loss_ += (1.0 - std::exp(-passed / kSmoothing_packets)) * (share - loss_);
  newest_ = newest_counter;
  received_ = received;
}

int SendRate::repeats() const {
  const double p = std::clamp(loss_, kLeastLoss, kMostLoss);
  const double in_flight = std::max(1.0, seconds(round_trip_) / seconds(params_.interval));
  const double k = std::ceil(std::log(params_.late_share / in_flight) / std::log(p));
  return std::clamp(static_cast<int>(k), params_.fewest_repeats, params_.most_repeats);
}

}  // namespace osteon
