// What a process may do because root runs it.
#pragma once
#include <array>
#include <cstdint>

namespace osteon::test {

// For as long as it lives, this thread is bound by the permissions of files as anybody is, and so is what it forks.
class WithoutPrivileges {
 public:
  WithoutPrivileges();
  ~WithoutPrivileges();
  WithoutPrivileges(const WithoutPrivileges&) = delete;
  WithoutPrivileges& operator=(const WithoutPrivileges&) = delete;

 private:
  std::array<std::uint32_t, 6> before_{};  // as capget() has them
};

}  // namespace osteon::test
