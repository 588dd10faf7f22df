#include "server/rooms/job_thread.hpp"

#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace osteon {
namespace {

TEST(JobThread, RunsJobsInTheirOrderOnAThreadOfItsOwn) {
  JobThread jobs;
  jobs.start();
  std::vector<int> order;
  std::thread::id where;
  for (int i = 0; i < 100; ++i)
    jobs.run([&, i] {
      order.push_back(i);
      where = std::this_thread::get_id();
    });
  jobs.stop();
  ASSERT_EQ(order.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
  EXPECT_NE(where, std::this_thread::get_id());
}

// Somebody waits for the result of this job.
TEST(JobThread, RunsWhatComesAfterItsEndWithinTheCall) {
  JobThread jobs;
  jobs.start();
  jobs.stop();
  bool ran = false;
  jobs.run([&] { ran = true; });
  EXPECT_TRUE(ran);
}

TEST(JobThread, EndsAfterTheJobsThatWait) {
  JobThread jobs;
  jobs.start();
  std::promise<void> begin;
  int ran = 0;
  jobs.run([&] { begin.get_future().wait(); });
  for (int i = 0; i < 10; ++i) jobs.run([&] { ++ran; });
  begin.set_value();
  jobs.stop();
  EXPECT_EQ(ran, 10);
}

}  // namespace
}  // namespace osteon
