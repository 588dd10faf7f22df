#include "common/link/datagram.hpp"

#include <array>
#include <cstdio>

namespace osteon {

std::string to_string(const Endpoint& endpoint) {
  std::array<char, 64> text{};
  const auto byte = [&](int shift) { return static_cast<unsigned>(endpoint.low >> shift & 0xff); };
  const bool v4 = endpoint.high == 0 && endpoint.low >> 32 == 0xffff;
  if (v4)
    std::snprintf(text.data(), text.size(), "%u.%u.%u.%u:%u", byte(24), byte(16), byte(8), byte(0),
                  unsigned{endpoint.port});
  else
    std::snprintf(text.data(), text.size(), "[%x:%x:%x:%x:%x:%x:%x:%x]:%u", static_cast<unsigned>(endpoint.high >> 48),
                  static_cast<unsigned>(endpoint.high >> 32 & 0xffff),
                  static_cast<unsigned>(endpoint.high >> 16 & 0xffff), static_cast<unsigned>(endpoint.high & 0xffff),
                  static_cast<unsigned>(endpoint.low >> 48), static_cast<unsigned>(endpoint.low >> 32 & 0xffff),
                  static_cast<unsigned>(endpoint.low >> 16 & 0xffff), static_cast<unsigned>(endpoint.low & 0xffff),
                  unsigned{endpoint.port});
  return text.data();
}

}  // namespace osteon
