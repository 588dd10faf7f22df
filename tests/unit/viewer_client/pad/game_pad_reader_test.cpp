// The game pad on its thread, with a pad that exists in SDL only.
#include "viewer_client/pad/game_pad_reader.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <thread>

#include "tests/support/pad/virtual_pad.hpp"
#include "tests/support/wait.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr auto kReaderPatience = 20s;

// Holds SDL's lock of all pads, as a device that does not answer does.
class BusySdl {
 public:
  BusySdl() {
    thread_ = std::thread([this] {
      test::VirtualPad::lock_sdl();
      held_.set_value();
      free_.get_future().wait_for(kReaderPatience);
      waited_too_long_ = !asked_;
      test::VirtualPad::unlock_sdl();
    });
    held_.get_future().wait();
  }
  ~BusySdl() { end(); }
  BusySdl(const BusySdl&) = delete;
  BusySdl& operator=(const BusySdl&) = delete;
  // False: somebody waited for SDL until the lock was given up.
  bool end() {
    if (!thread_.joinable()) return !waited_too_long_;
    asked_ = true;
    free_.set_value();
    thread_.join();
    return !waited_too_long_;
  }

 private:
  std::promise<void> held_, free_;
  std::atomic<bool> asked_ = false, waited_too_long_ = false;
  std::thread thread_;
};

class GamePadReaderTest : public testing::Test {
 protected:
  // The readings until one fulfils the condition. The last one is in `read_`.
  template <class Condition>
  [[nodiscard]] bool reads(Condition condition) {
    return test::wait_until(
        [&] {
          read_ = reader_->take();
          lost_ += read_.lost;
          opened_ += read_.opened;
          return condition();
        },
        kReaderPatience);
  }

  test::VirtualPad plug_;  // first: it hides the pads of this machine
  std::unique_ptr<GamePadReader> reader_;
  GamePadReading read_;
  int lost_ = 0, opened_ = 0;
};

TEST_F(GamePadReaderTest, NobodyWaitsForASdlThatDoesNotAnswer) {
  ASSERT_TRUE(plug_.plug_in());
  BusySdl busy;
  reader_ = std::make_unique<GamePadReader>();
  // Meanwhile its thread comes to SDL.
  for (const auto until = std::chrono::steady_clock::now() + 300ms; std::chrono::steady_clock::now() < until;) {
    EXPECT_FALSE(reader_->take().is_open);
    reader_->rumble({1.0, 1.0});
    std::this_thread::sleep_for(5ms);
  }
  EXPECT_TRUE(busy.end()) << "somebody waited";
  EXPECT_TRUE(reads([&] { return read_.is_open; }));
  EXPECT_EQ(opened_, 1);
}

TEST_F(GamePadReaderTest, APadIsReadRumblesAndIsLostOnce) {
  reader_ = std::make_unique<GamePadReader>();
  ASSERT_TRUE(plug_.plug_in());
  ASSERT_TRUE(reads([&] { return read_.is_open; }));
  EXPECT_EQ(read_.name, "Virtual Pad");
  GamePadState held;
  held.a = true;
  held.right_trigger = 1.0;
  plug_.hold(held);
  EXPECT_TRUE(reads([&] { return read_.state.a && read_.state.right_trigger > 0.99; }));
  EXPECT_TRUE(plug_.quiet());
  reader_->rumble({0.5, 0.25});
  EXPECT_TRUE(test::wait_until([&] { return !plug_.quiet(); }, kReaderPatience));
  plug_.unplug();
  ASSERT_TRUE(reads([&] { return !read_.is_open; }));
  EXPECT_FALSE(read_.state.a);
  EXPECT_EQ(read_.name, "Virtual Pad") << "for the sentence that says that it is gone";
  std::this_thread::sleep_for(50ms);
  EXPECT_FALSE(reader_->take().lost);
  EXPECT_EQ(lost_, 1);
  EXPECT_EQ(opened_, 1);
}

}  // namespace
}  // namespace osteon
