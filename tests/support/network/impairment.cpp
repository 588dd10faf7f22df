#include "tests/support/network/impairment.hpp"

#include <algorithm>

namespace osteon::test {

std::vector<Impairment::Copy> Impairment::pass(Time now, std::size_t bytes) {
  ++counts_.given;
  // All random numbers are drawn for every datagram. So a change of one share does not change the fate by the others.
  const bool lost = random_.unit() < quality_.loss, held_back = random_.unit() < quality_.reorder,
             twice = random_.unit() < quality_.duplicate, spoiled = random_.unit() < quality_.corrupt;
  const Time delay = std::max(Time{}, quality_.delay - quality_.jitter + up_to(2 * quality_.jitter));
  const Time held = up_to(quality_.reorder_by), second = up_to(quality_.reorder_by);

  Time leaves = now;
  if (quality_.bytes_per_s > 0) {
    const double waiting = std::chrono::duration<double>(busy_until_ - now).count() * quality_.bytes_per_s;
    if (waiting + static_cast<double>(bytes) > static_cast<double>(quality_.queue_bytes)) {
      ++counts_.overflowed;
      return {};
    }
    const double takes_ns = static_cast<double>(bytes) / quality_.bytes_per_s * 1e9;
    busy_until_ = std::max(now, busy_until_) + Time(static_cast<std::int64_t>(takes_ns));
    leaves = busy_until_;
  }
  if (lost) {
    ++counts_.lost;
    return {};
  }
  Time at = leaves + delay;
  if (held_back) {
    ++counts_.held_back;
    at += held;
  } else {
    at = last_arrival_ = std::max(at, last_arrival_);
  }
  if (spoiled) ++counts_.corrupted;
  std::vector<Copy> copies{{at, spoiled}};
  if (twice) {
    ++counts_.duplicated;
    copies.push_back({at + second, spoiled});
  }
  return copies;
}

void Impairment::spoil(std::span<std::uint8_t> bytes) {
  if (bytes.empty()) return;
  for (std::size_t flips = 1 + flips_.index(3); flips > 0; --flips)
    bytes[flips_.index(bytes.size())] ^= static_cast<std::uint8_t>(1u << flips_.index(8));
}

}  // namespace osteon::test
