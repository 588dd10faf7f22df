#include "common/link/random_bytes.hpp"

#include <sodium.h>

#include "common/core/check.hpp"

namespace osteon {

FillRandom system_random() {
  OSTEON_CHECK(sodium_init() >= 0);
  return [](std::span<std::uint8_t> into) { randombytes_buf(into.data(), into.size()); };
}

}  // namespace osteon
