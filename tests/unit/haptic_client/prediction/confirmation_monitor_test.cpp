// What a room that does not answer means for the spindle.
#include "haptic_client/prediction/confirmation_monitor.hpp"

#include <gtest/gtest.h>

namespace osteon::haptic::test {
namespace {

// If the room does not answer, little bone may be gone that only this client has removed.
TEST(ConfirmationMonitor, HoldsTheSpindleWhileTheRoomDoesNotFollow) {
  ConfirmationMonitor watch;
  EXPECT_EQ(watch.update(100.0, false, 0), RoomHealth::follows);
  EXPECT_EQ(watch.update(200.0, false, 0), RoomHealth::follows);  // nobody cuts, so no answer is needed
  EXPECT_EQ(watch.update(201.9, false, 1), RoomHealth::follows);
  EXPECT_EQ(watch.update(202.1, false, 1), RoomHealth::silent);
  EXPECT_EQ(watch.update(202.2, true, 1), RoomHealth::follows);
  EXPECT_EQ(watch.update(223.0, false, 1), RoomHealth::lost);

  EXPECT_EQ(watch.update(300.0, true, 512), RoomHealth::follows);
  EXPECT_EQ(watch.update(300.1, true, 513), RoomHealth::behind);
  EXPECT_EQ(watch.update(300.2, true, 300), RoomHealth::behind);  // no switching on and off at the limit
  EXPECT_EQ(watch.update(300.3, true, 256), RoomHealth::follows);
}

}  // namespace
}  // namespace osteon::haptic::test
