#include "common/runtime/realtime.hpp"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

namespace osteon {
namespace {

constexpr std::size_t kStackBytes = 256 * 1024;
constexpr unsigned long kExactSlack_ns = 1;

// Writes every page of the stack once, so that none is missing later.
[[gnu::noinline]] void touch_stack() noexcept {
  volatile char stack[kStackBytes];
  for (std::size_t i = 0; i < kStackBytes; i += 1024) stack[i] = 0;
  static_cast<void>(stack[0]);
}

bool try_fifo(int priority) noexcept {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters) == 0;
}

bool try_slack() noexcept {
  return ::prctl(PR_SET_TIMERSLACK, kExactSlack_ns) == 0 &&
         ::prctl(PR_GET_TIMERSLACK) == static_cast<int>(kExactSlack_ns);
}

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

long limit(int resource, long unit) {
  rlimit value{};
  if (::getrlimit(static_cast<__rlimit_resource>(resource), &value) != 0) return -1;
  return value.rlim_cur == RLIM_INFINITY ? LONG_MAX : static_cast<long>(value.rlim_cur) / unit;
}

std::string preemption() {
  if (first_line("/sys/kernel/realtime") == "1") return "rt";
  // "none (voluntary) full": the one in parentheses is active. Only root can read it.
  const std::string modes = first_line("/sys/kernel/debug/sched/preempt");
  const std::size_t open = modes.find('('), close = modes.find(')');
  if (open != std::string::npos && close != std::string::npos) return modes.substr(open + 1, close - open - 1);
  utsname name{};
  if (::uname(&name) != 0) return "";
  const std::string version = name.version;
  if (version.find("PREEMPT_RT") != std::string::npos) return "rt";
  if (version.find("PREEMPT_DYNAMIC") != std::string::npos) return "dynamic";
  if (version.find("PREEMPT") != std::string::npos) return "full";
  return "voluntary";
}

std::string kib(long value) { return value == LONG_MAX ? "unlimited" : std::to_string(value) + " KiB"; }

constexpr const char* kLimits = "/etc/security/limits.d/osteon.conf";

}  // namespace

Realtime make_realtime(int priority) noexcept {
  Realtime got;
  got.locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  touch_stack();
  got.exact = try_slack();
  got.fifo = try_fifo(priority);
  return got;
}

MachineFacts look_at_machine(int priority) {
  MachineFacts facts;
  facts.cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::thread([&] {
    facts.slack_works = try_slack();
    facts.fifo_works = try_fifo(priority);
  }).join();
  facts.rtprio_limit = limit(RLIMIT_RTPRIO, 1);
  facts.memlock_limit_kib = limit(RLIMIT_MEMLOCK, 1024);
  // One page shows whether locking is allowed at all. The limit says how much.
  void* const page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (page != MAP_FAILED) {
    facts.lock_works = ::mlock(page, 4096) == 0;
    ::munmap(page, 4096);
  }
  if (::geteuid() == 0) facts.memlock_limit_kib = LONG_MAX;  // the limit does not apply to root
  for (int core = 0; core < facts.cores; ++core) {
    const std::string governor =
        first_line("/sys/devices/system/cpu/cpu" + std::to_string(core) + "/cpufreq/scaling_governor");
    if (!governor.empty()) facts.governors.push_back(governor);
  }
  facts.preemption = preemption();
  if (const std::string runtime = first_line("/proc/sys/kernel/sched_rt_runtime_us"); !runtime.empty()) {
    facts.rt_runtime_us = std::atol(runtime.c_str());
    facts.rt_runtime_known = true;
  }
  timespec resolution{};
  if (::clock_getres(CLOCK_MONOTONIC, &resolution) == 0)
    facts.timer_resolution_ns = resolution.tv_sec * 1'000'000'000L + resolution.tv_nsec;
  facts.clock_source = first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource");
  std::ifstream cpu("/proc/cpuinfo");
  for (std::string line; std::getline(cpu, line);)
    if (line.rfind("flags", 0) == 0) {
      facts.virtual_machine = line.find(" hypervisor") != std::string::npos;
      break;
    }
  return facts;
}

std::vector<MachineFinding> judge(const MachineFacts& facts, int priority, long memory_kib) {
  std::vector<MachineFinding> findings;
  const auto say = [&](Finding kind, std::string sentence, std::string remedy = {}) {
    findings.push_back({kind, std::move(sentence), std::move(remedy)});
  };
  const std::string lines = std::string("write two lines into ") + kLimits +
                            ", \"@audio - rtprio 95\" and \"@audio - memlock unlimited\", "
                            "add yourself to that group (sudo usermod -aG audio $USER) and log in again";

  if (facts.fifo_works)
    say(Finding::fine, "Threads may run at real-time priority " + std::to_string(priority) + ".");
  else
    say(Finding::lacking,
        "Threads may not run at real-time priority " + std::to_string(priority) + " (the limit is " +
            std::to_string(std::max(0L, facts.rtprio_limit)) + "), so other programs delay the haptic loop.",
        lines);

  if (facts.lock_works && facts.memlock_limit_kib >= memory_kib)
    say(Finding::fine, "Memory may be locked.");
  else
    say(Finding::lacking,
        "No more than " + kib(facts.lock_works ? facts.memlock_limit_kib : 0) + " of memory may be locked and " +
            kib(memory_kib) + " are needed, so the haptic loop may wait for the disk.",
        lines);

  if (facts.slack_works && facts.timer_resolution_ns >= 0 && facts.timer_resolution_ns <= 1000)
    say(Finding::fine, "Timers are exact: " + std::to_string(facts.timer_resolution_ns) + " ns, without slack.");
  else if (!facts.slack_works)
    say(Finding::lacking, "Timer slack cannot be set, so the haptic loop wakes up to 50 us late.",
        "run it outside the sandbox that forbids prctl(PR_SET_TIMERSLACK)");
  else
    say(Finding::lacking, "Timers are as coarse as " + std::to_string(facts.timer_resolution_ns) + " ns.",
        "boot a kernel with CONFIG_HIGH_RES_TIMERS and without highres=off");

  if (facts.cores < 2)
    say(Finding::lacking, "There is one core; the haptic loop spins and would take it from all else.",
        "give the machine at least two cores");
  else
    say(Finding::fine, "There are " + std::to_string(facts.cores) + " cores.");

  if (facts.rt_runtime_known && facts.rt_runtime_us >= 0 && facts.rt_runtime_us < 500'000)
    say(Finding::lacking,
        "Real-time threads are stopped after " + std::to_string(facts.rt_runtime_us / 1000) + " ms of every second.",
        "sudo sysctl kernel.sched_rt_runtime_us=950000");

  const auto slow = std::ranges::count_if(facts.governors, [](const std::string& g) { return g != "performance"; });
  if (slow > 0)
    say(Finding::note,
        "The clock of " + std::to_string(slow) + " cores is governed by \"" +
            *std::ranges::find_if(facts.governors, [](const std::string& g) { return g != "performance"; }) +
            "\" and slows down between ticks.",
        "sudo cpupower frequency-set -g performance");
  else if (!facts.governors.empty())
    say(Finding::fine, "All cores run at full clock.");
  else
    say(Finding::fine, "The clock of the cores is not controlled from here.");

  if (facts.preemption == "rt" || facts.preemption == "full")
    say(Finding::fine, facts.preemption == "rt" ? "The kernel is a real-time one." : "The kernel can be preempted.");
  else
    say(Finding::note,
        facts.preemption == "dynamic" ? "The kernel's preemption was chosen at boot and is unknown."
                                      : "The kernel is preempted only at certain points (" + facts.preemption + ").",
        "boot with preempt=full, or install linux-image-rt-amd64");

  if (facts.clock_source != "tsc" && facts.clock_source != "kvm-clock" && facts.clock_source != "arch_sys_counter" &&
      !facts.clock_source.empty())
    say(Finding::note, "The clock is read from \"" + facts.clock_source + "\", which takes microseconds.",
        "boot with clocksource=tsc tsc=reliable");
  if (facts.virtual_machine)
    say(Finding::note,
        "This is a virtual machine: its host may stop it for milliseconds, which nothing in it can prevent.",
        "run the haptic client on real hardware");

  std::ranges::stable_sort(
      findings, [](Finding a, Finding b) { return a > b; }, &MachineFinding::kind);
  return findings;
}

}  // namespace osteon
