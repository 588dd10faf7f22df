#include "common/link/backoff.hpp"

#include <algorithm>

#include "common/core/check.hpp"

namespace osteon {

Backoff::Backoff(std::uint64_t seed, const BackoffBounds& bounds)
    : bounds_(bounds), limit_(bounds.least), random_(seed) {
  OSTEON_CHECK(bounds.least.count() > 0 && bounds.least <= bounds.most);
}

std::chrono::nanoseconds Backoff::next() {
  limit_ = std::min(2 * limit_, bounds_.most);
  // The library's distributions differ between libraries. The modulus favours no value by more than 1e-9.
  const auto span = static_cast<std::uint64_t>((limit_ - bounds_.least).count()) + 1;
  return bounds_.least + std::chrono::nanoseconds(static_cast<std::int64_t>(random_() % span));
}

}  // namespace osteon
