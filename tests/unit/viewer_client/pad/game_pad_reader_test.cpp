// The game pad on its thread, with a pad that exists in SDL only.
#include "viewer_client/pad/game_pad_reader.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <thread>

#include "tests/support/pad/busy_sdl.hpp"
#include "tests/support/pad/virtual_pad.hpp"
#include "tests/support/wait.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

constexpr auto kReaderPatience = 20s;

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
  test::BusySdl busy;
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

TEST_F(GamePadReaderTest, AStateThatSdlDoesNotRenewBecomesOld) {
  ASSERT_TRUE(plug_.plug_in());
  reader_ = std::make_unique<GamePadReader>();
  ASSERT_TRUE(reads([&] { return read_.is_open && read_.age < 100ms; }));
  test::BusySdl busy;
  ASSERT_TRUE(reads([&] { return read_.age > 200ms; }));
  EXPECT_TRUE(read_.is_open);
  EXPECT_TRUE(busy.end()) << "somebody waited";
  EXPECT_TRUE(reads([&] { return read_.age < 100ms; }));
}

TEST_F(GamePadReaderTest, ARumbleFromBeforeAPadDoesNotReachIt) {
  ASSERT_TRUE(plug_.plug_in());
  test::BusySdl busy;
  reader_ = std::make_unique<GamePadReader>();
  reader_->rumble({1.0, 1.0});
  EXPECT_TRUE(busy.end());
  ASSERT_TRUE(reads([&] { return read_.is_open; }));
  // A later one does, so the first one is not still on its way.
  reader_->rumble({0.25, 0.0});
  ASSERT_TRUE(test::wait_until([&] { return !plug_.heard().empty() && !plug_.quiet(); }, kReaderPatience));
  for (const auto& motors : plug_.heard()) EXPECT_LT(motors.low, 0.5 * 65535);
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
