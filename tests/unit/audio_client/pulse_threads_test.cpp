// The threads on the way from the engine to the sound server, run by deploy/with-null-sink.
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "audio_client/output/audio_output.hpp"

namespace osteon::audio {
namespace {

struct Scheduling {
  int policy = -1, priority = -1;
  bool operator==(const Scheduling&) const = default;
};

// 0: the calling thread.
Scheduling scheduling_of(pid_t thread) {
  sched_param param{};
  if (::sched_getparam(thread, &param) != 0) return {};
  return {::sched_getscheduler(thread), param.sched_priority};
}

// Of the threads of libpulse in this process.
std::vector<Scheduling> pulse_scheduling() {
  std::vector<Scheduling> threads;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm"), name);
    if (name == "threaded-ml") threads.push_back(scheduling_of(std::stoi(task.path().filename().string())));
  }
  return threads;
}

// The priority that RtAudio is asked for.
constexpr int kRaised = 20;

bool machine_allows_real_time() {
  bool allows = false;
  std::thread([&] {
    const sched_param raised{.sched_priority = kRaised};
    allows = ::pthread_setschedparam(::pthread_self(), SCHED_RR, &raised) == 0;
  }).join();
  return allows;
}

struct SilentSource final : SoundSource {
  void render(std::span<float> left, std::span<float> right) noexcept override {
    std::ranges::fill(left, 0.0F);
    std::ranges::fill(right, 0.0F);
  }
};

TEST(PulseThreads, CarryTheSoundInRealTimeIfTheMachineAllowsIt) {
  const Scheduling before = scheduling_of(0);
  SilentSource source;
  const auto output = open_output({.kind = OutputKind::pulse}, source);
  ASSERT_TRUE(output) << output.error().message;
  const std::vector<Scheduling> threads = pulse_scheduling();
  ASSERT_FALSE(threads.empty());
  const Scheduling wanted = machine_allows_real_time() ? Scheduling{SCHED_RR, kRaised} : before;
  for (const Scheduling& thread : threads) EXPECT_EQ(thread, wanted);
  EXPECT_EQ(scheduling_of(0), before) << "the thread that opened the output stays as it was";
}

}  // namespace
}  // namespace osteon::audio
