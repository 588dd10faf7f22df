// What the window lets go of: connections that nobody takes, and data that nobody draws.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/room_link.hpp"
#include "viewer_client/scene/camera_view.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

class WindowEnds : public test::WindowBench {};

double resident_mb() {
  std::ifstream pages("/proc/self/statm");
  double all = 0.0, resident = 0.0;
  pages >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

// The threads of a connection write into the link's queue. A room may be left before the GUI thread has the connection.
TEST_F(WindowEnds, AConnectionThatNobodyTookEndsBeforeItsQueue) {
  open();
  QString address;
  ASSERT_TRUE(until([&] {
    address = label("connection").section(' ', -1);
    return address.contains(':');
  }));
  std::vector<std::string> ended;
  const auto mark = [&](const char* name) {
    return std::shared_ptr<void>(nullptr, [&ended, name](void*) { ended.emplace_back(name); });
  };
  std::atomic<bool> joined = false;
  auto link = [&] {
    RoomSubscriptionOptions options;
    options.address = address.toStdString();
    options.first_look = [&joined, held = mark("connection")](const Box& bone) {
      joined = true;
      return look_of(overview(bone), 640, 480);
    };
    return std::make_unique<RoomLink>(
        options, RoomLink::Events{[] {}, [held = mark("link")](const WatchedRoom&) {}, [](const Error&) {}});
  }();
  // This thread handles no events meanwhile.
  for (int wait = 0; wait < 500 && !joined; ++wait) std::this_thread::sleep_for(20ms);
  ASSERT_TRUE(joined);
  std::this_thread::sleep_for(500ms);
  link.reset();
  EXPECT_EQ(ended, (std::vector<std::string>{"connection", "link"}));
}

// Nothing is drawn in a hidden window, but the room goes on.
TEST_F(WindowEnds, AHiddenWindowKeepsNothingOfWhatArrives) {
  open();
  drill();
  release(middle());
  ASSERT_TRUE(until([&] { return !view_->pointer().pushing(); }));
  window_->hide();
  undo_pushes();
  ASSERT_TRUE(until([&] { return !cut(); })) << problem();
  EXPECT_FALSE(view_->updater()->any_arrivals());
}

// The C library keeps free memory below memory that is still used. Room after room, this would add up.
TEST_F(WindowEnds, ARoomThatIsLeftGivesFreeMemoryBack) {
  open();
  using Block = std::array<char, 1000>;
  std::vector<std::unique_ptr<Block>> freed(100'000);
  for (auto& block : freed) block = std::make_unique<Block>();
  const auto above = std::move(freed.back());  // the last one fills no gap: it lies above the others
  freed.clear();
  const double before_mb = resident_mb();
  trigger("start_page");
  EXPECT_LT(resident_mb(), before_mb - 80.0);
}

}  // namespace
}  // namespace osteon
