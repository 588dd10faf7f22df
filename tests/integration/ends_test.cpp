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
#include "viewer_client/desktop/bone_view.hpp"
#include "viewer_client/desktop/room_link.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/held_tools.hpp"

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

// The room goes on to show the tool of an ended session for ten seconds, at rest.
TEST_F(WindowEnds, TheViewGoesToNoToolOfAnEndedSession) {
  constexpr AuthorId kGone{4}, kThere{5};
  const auto tool_at = [](AuthorId author, const Vec3& at_mm) {
    CuttingState state;
    state.author = author;
    state.tool_name = "drill-3.2";
    state.pose_bone_tool.position_mm = at_mm;
    return state;
  };
  const auto hand = [](AuthorId author, bool here) {
    PersonSeen person;
    person.author = author;
    person.here = here;
    person.hand = true;
    return person;
  };
  const Vec3 gone_mm(60, 0, 0), there_mm(0, 60, 0);
  std::vector<PersonSeen> people;
  RenderQueue queue;
  BoneView view;
  BoneView::Events events;
  events.people = [&people] { return people; };
  view.set_events(events);
  view.show_room(&queue, {Vec3(-80, -80, -80), Vec3(80, 80, 80)});
  queue.put_states({tool_at(kGone, gone_mm), tool_at(kThere, there_mm)});
  view.arrived();
  const auto off_mm = [&](const Vec3& at_mm) {
    view.look_overview();
    view.look_tool();
    return (view.camera().target_mm - at_mm).norm();
  };
  EXPECT_LT(off_mm(gone_mm), 1.0) << "until the room says who is there, each tool counts";
  people = {hand(kGone, false), hand(kThere, true)};
  EXPECT_LT(off_mm(there_mm), 1.0);
  people[1].here = false;
  EXPECT_LT(off_mm(Vec3::Zero()), 1.0) << "the camera stays at the middle of the bone";
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

#ifndef __SANITIZE_ADDRESS__  // which has an allocator of its own, and keeps what is freed
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
#endif

}  // namespace
}  // namespace osteon
