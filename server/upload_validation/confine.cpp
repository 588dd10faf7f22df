#include "server/upload_validation/confine.hpp"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace osteon {
namespace {

// Landlock as its documentation describes it, beyond what the headers of Debian 12 have.
struct Ruleset {
  std::uint64_t files, net, scoped;
};
struct __attribute__((packed)) Beneath {
  std::uint64_t allowed;
  std::int32_t folder;
};
constexpr std::uint32_t kVersion = 1, kPathBeneath = 1;
// Bits in order: execute, write, read, list; remove folders, files; make character devices, folders, files, sockets,
// pipes, block devices, symbolic links; move between folders, truncate, control devices.
constexpr std::uint64_t kAll1 = (1u << 13) - 1, kMove = 1u << 13, kShorten = 1u << 14, kControl = 1u << 15;
constexpr std::uint64_t kOwn = 0b1'1011'1110 | kMove | kShorten;  // of these, what the folder is for
static_assert((kOwn & (1u << 0 | 1u << 6 | 1u << 9 | 1u << 10 | 1u << 11 | 1u << 12)) == 0,
              "no programs, devices, sockets, pipes and links");
constexpr std::uint64_t kSignals = 1u << 1;

bool confine_files(const std::filesystem::path& folder) {
  const long version = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, kVersion);
  if (version < 1) return false;
  const std::uint64_t handled =
      kAll1 | (version >= 2 ? kMove : 0) | (version >= 3 ? kShorten : 0) | (version >= 5 ? kControl : 0);
  const Ruleset wanted{handled, 0, version >= 6 ? kSignals : 0};
  const int rules = static_cast<int>(::syscall(SYS_landlock_create_ruleset, &wanted, sizeof wanted, 0));
  const int place = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC);
  const Beneath own{kOwn & handled, place};
  const bool done = rules >= 0 && place >= 0 && ::syscall(SYS_landlock_add_rule, rules, kPathBeneath, &own, 0) == 0 &&
                    ::syscall(SYS_landlock_restrict_self, rules, 0) == 0;
  if (place >= 0) ::close(place);
  if (rules >= 0) ::close(rules);
  return done;
}

#if defined(__x86_64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kMachine = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kMachine = 0;
#endif

// Denied with EPERM. Reading and writing, memory, threads and clocks stay allowed.
constexpr long kDenied[] = {SYS_socket,
                            SYS_execve,
                            SYS_execveat,
                            SYS_ptrace,
                            SYS_process_vm_readv,
                            SYS_process_vm_writev,
                            SYS_kill,
                            SYS_tkill,
                            SYS_rt_sigqueueinfo,
                            SYS_rt_tgsigqueueinfo,
                            SYS_pidfd_open,
                            SYS_pidfd_getfd,
                            SYS_pidfd_send_signal,
                            SYS_io_uring_setup,
                            SYS_bpf,
                            SYS_perf_event_open,
                            SYS_userfaultfd,
                            SYS_keyctl,
                            SYS_add_key,
                            SYS_request_key,
                            SYS_unshare,
                            SYS_setns,
                            SYS_mount};

bool confine_calls() {
  if (kMachine == 0) return false;
  std::vector<sock_filter> filter;
  const auto add = [&](std::uint16_t code, std::uint32_t k, std::uint8_t yes = 0, std::uint8_t no = 0) {
    filter.push_back({code, yes, no, k});
  };
  const auto load = [&](std::size_t at) { add(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(at)); };
  const auto deny = [&] { add(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM); };
  // The numbers mean these calls on this architecture only. Those of x32 begin at bit 30.
  load(offsetof(seccomp_data, arch));
  add(BPF_JMP | BPF_JEQ | BPF_K, kMachine, 1, 0);
  deny();
  load(offsetof(seccomp_data, nr));
  add(BPF_JMP | BPF_JGE | BPF_K, 0x40000000, 0, 1);
  deny();
  for (const long call : kDenied) {
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 1);
    deny();
  }
  // A process may signal itself and read its own limits, but nobody else's.
  for (const auto& [call, self] :
       {std::pair{SYS_tgkill, static_cast<std::uint32_t>(::getpid())}, std::pair{SYS_prlimit64, 0u}}) {
    load(offsetof(seccomp_data, nr));
    add(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, 3);
    load(offsetof(seccomp_data, args));
    add(BPF_JMP | BPF_JEQ | BPF_K, self, 1, 0);
    deny();
  }
  add(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

}  // namespace

Confinement confine_to(const std::filesystem::path& folder) {
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return {};
  Confinement held;
  held.files = confine_files(folder);
  held.calls = confine_calls();
  return held;
}

}  // namespace osteon
