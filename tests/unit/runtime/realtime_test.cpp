// The findings about a machine, fact by fact. A watchdog detects a loop that has stopped.
#include "common/runtime/realtime.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <thread>

#include "common/runtime/watchdog.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr int kPriority = 80;
constexpr long kMemory_kib = 500'000;

MachineFacts good_machine() {
  MachineFacts facts;
  facts.cores = 8;
  facts.fifo_works = facts.lock_works = facts.slack_works = true;
  facts.rtprio_limit = 95;
  facts.memlock_limit_kib = LONG_MAX;
  facts.governors = {"performance", "performance"};
  facts.preemption = "rt";
  facts.rt_runtime_us = 950'000;
  facts.rt_runtime_known = true;
  facts.timer_resolution_ns = 1;
  facts.clock_source = "tsc";
  return facts;
}

// The findings that are not fine, as one text.
std::string complaints(const MachineFacts& facts, Finding least = Finding::note) {
  std::string text;
  for (const MachineFinding& finding : judge(facts, kPriority, kMemory_kib))
    if (finding.kind >= least) text += finding.sentence + " | " + finding.remedy + "\n";
  return text;
}

TEST(Machine, AGoodOneLacksNothing) {
  EXPECT_EQ(complaints(good_machine()), "");
  for (const MachineFinding& finding : judge(good_machine(), kPriority, kMemory_kib)) {
    EXPECT_TRUE(finding.remedy.empty()) << finding.sentence;
    EXPECT_EQ(finding.sentence.back(), '.');
  }
}

TEST(Machine, EachLackIsNamedWithItsRemedy) {
  struct Case {
    const char* sentence;
    const char* remedy;
    Finding kind;
    void (*spoil)(MachineFacts&);
  };
  const Case cases[] = {
      {"real-time priority 80", "rtprio 95", Finding::lacking,
       [](MachineFacts& f) { f.fifo_works = false, f.rtprio_limit = 0; }},
      {"8192 KiB", "memlock unlimited", Finding::lacking, [](MachineFacts& f) { f.memlock_limit_kib = 8192; }},
      {"may be locked", "memlock unlimited", Finding::lacking, [](MachineFacts& f) { f.lock_works = false; }},
      {"slack", "PR_SET_TIMERSLACK", Finding::lacking, [](MachineFacts& f) { f.slack_works = false; }},
      {"4000000 ns", "HIGH_RES_TIMERS", Finding::lacking, [](MachineFacts& f) { f.timer_resolution_ns = 4'000'000; }},
      {"one core", "two cores", Finding::lacking, [](MachineFacts& f) { f.cores = 1; }},
      {"100 ms of every second", "sched_rt_runtime_us", Finding::lacking,
       [](MachineFacts& f) { f.rt_runtime_us = 100'000; }},
      {"powersave", "cpupower", Finding::note, [](MachineFacts& f) { f.governors[1] = "powersave"; }},
      {"voluntary", "preempt=full", Finding::note, [](MachineFacts& f) { f.preemption = "voluntary"; }},
      {"hpet", "clocksource=tsc", Finding::note, [](MachineFacts& f) { f.clock_source = "hpet"; }},
      {"virtual machine", "real hardware", Finding::note, [](MachineFacts& f) { f.virtual_machine = true; }},
  };
  for (const Case& one : cases) {
    MachineFacts facts = good_machine();
    one.spoil(facts);
    const auto findings = judge(facts, kPriority, kMemory_kib);
    EXPECT_EQ(findings.front().kind, one.kind) << one.sentence;  // the most important finding comes first
    EXPECT_EQ(std::ranges::count_if(findings, [](const MachineFinding& f) { return f.kind != Finding::fine; }), 1)
        << one.sentence;
    EXPECT_NE(findings.front().sentence.find(one.sentence), std::string::npos) << findings.front().sentence;
    EXPECT_NE(findings.front().remedy.find(one.remedy), std::string::npos) << findings.front().remedy;
  }
}

// Unlimited time, or a kernel that does not report it, is no finding.
TEST(Machine, WhatIsNotReportedIsNoLack) {
  MachineFacts facts = good_machine();
  facts.rt_runtime_us = -1;
  facts.governors.clear();
  facts.clock_source.clear();
  facts.rt_runtime_known = true;
  EXPECT_EQ(complaints(facts), "");
}

// The facts of this machine agree with each other and with what a thread gets.
TEST(Machine, ThisOneIsSeenAsItIs) {
  const MachineFacts facts = look_at_machine(kPriority);
  EXPECT_GE(facts.cores, 1);
  EXPECT_TRUE(facts.slack_works);
  EXPECT_GT(facts.timer_resolution_ns, 0);
  Realtime got;
  std::thread([&] { got = make_realtime(kPriority); }).join();
  EXPECT_EQ(got.fifo, facts.fifo_works);
  EXPECT_TRUE(got.exact);
  EXPECT_GE(judge(facts, kPriority, kMemory_kib).size(), 5u);
}

TEST(Watchdog, SaysWhenALoopStands) {
  std::atomic<int> called{0};
  Watchdog watchdog(20ms, 0, [&] { ++called; });
  std::this_thread::sleep_for(60ms);
  EXPECT_EQ(watchdog.stalls(), 0u) << "the loop has not begun";
  watchdog.beat();
  const auto start = std::chrono::steady_clock::now();
  while (called == 0 && std::chrono::steady_clock::now() - start < 10s) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(called, 1);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 15ms);
  std::this_thread::sleep_for(60ms);
  EXPECT_EQ(called, 1) << "called once for each stall";
  EXPECT_EQ(watchdog.stalls(), 1u);
  EXPECT_GE(watchdog.longest(), 20ms);

  // The loop goes on and stops again.
  watchdog.beat();
  const auto again = std::chrono::steady_clock::now();
  while (called == 1 && std::chrono::steady_clock::now() - again < 10s) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(called, 2);
  watchdog.beat();
  watchdog.rest();
  std::this_thread::sleep_for(80ms);
  EXPECT_EQ(called, 2) << "it stops on purpose";
}

}  // namespace
}  // namespace osteon
