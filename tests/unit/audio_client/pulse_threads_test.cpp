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

// Scheduling of the threads of libpulse in this process.
std::vector<int> pulse_policies() {
  std::vector<int> policies;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::string name;
    std::getline(std::ifstream(task.path() / "comm"), name);
    if (name == "threaded-ml") policies.push_back(::sched_getscheduler(std::stoi(task.path().filename().string())));
  }
  return policies;
}

bool machine_allows_real_time() {
  bool allows = false;
  std::thread([&] {
    const sched_param raised{.sched_priority = 20};
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
  SilentSource source;
  const auto output = open_output({.kind = OutputKind::pulse}, source);
  ASSERT_TRUE(output) << output.error().message;
  const std::vector<int> policies = pulse_policies();
  ASSERT_FALSE(policies.empty());
  const int wanted = machine_allows_real_time() ? SCHED_RR : SCHED_OTHER;
  for (const int policy : policies) EXPECT_EQ(policy, wanted);
  EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER) << "the thread that opened the output stays as it was";
}

}  // namespace
}  // namespace osteon::audio
