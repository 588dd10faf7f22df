// Removes the extra rights of a process that root runs.
#pragma once
#include <array>
#include <cstdint>

namespace osteon::test {

// While it exists, file permissions apply to this thread, and to its forks, as to any user.
class WithoutPrivileges {
 public:
  WithoutPrivileges();
  ~WithoutPrivileges();
  WithoutPrivileges(const WithoutPrivileges&) = delete;
  WithoutPrivileges& operator=(const WithoutPrivileges&) = delete;

 private:
  std::array<std::uint32_t, 6> before_{};  // as capget() returns them
};

}  // namespace osteon::test
