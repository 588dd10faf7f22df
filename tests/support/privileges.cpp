#include "tests/support/privileges.hpp"

#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstring>

#include "common/core/check.hpp"

namespace osteon::test {
namespace {

using Capabilities = std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3>;

void call(long number, Capabilities& capabilities) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  OSTEON_CHECK(::syscall(number, &header, capabilities.data()) == 0);
}

}  // namespace

WithoutPrivileges::WithoutPrivileges() {
  Capabilities capabilities{};
  static_assert(sizeof capabilities == sizeof before_);
  call(SYS_capget, capabilities);
  std::memcpy(before_.data(), capabilities.data(), sizeof before_);
  for (auto& some : capabilities) some.effective = 0;
  call(SYS_capset, capabilities);
}

WithoutPrivileges::~WithoutPrivileges() {
  Capabilities capabilities{};
  std::memcpy(capabilities.data(), before_.data(), sizeof before_);
  call(SYS_capset, capabilities);
}

}  // namespace osteon::test
