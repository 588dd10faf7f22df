#include "tests/support/pad/busy_sdl.hpp"

#include <chrono>

#include "tests/support/pad/virtual_pad.hpp"

namespace osteon::test {

namespace {

constexpr std::chrono::seconds kLongestHold{20};

}  // namespace

BusySdl::BusySdl() {
  thread_ = std::thread([this] {
    VirtualPad::lock_sdl();
    held_.set_value();
    free_.get_future().wait_for(kLongestHold);
    waited_too_long_ = !asked_;
    VirtualPad::unlock_sdl();
  });
  held_.get_future().wait();
}

bool BusySdl::end() {
  if (!thread_.joinable()) return !waited_too_long_;
  asked_ = true;
  free_.set_value();
  thread_.join();
  return !waited_too_long_;
}

}  // namespace osteon::test
