// The gauges of the window: when the plot is drawn, and what the devices of others hold.
#include <gtest/gtest.h>

#include <QTest>

#include "tests/integration/desk.hpp"
#include "viewer_client/desktop/gauges_panel.hpp"

namespace osteon {
namespace {

// Each repaint of a part composes the picture of the bone anew, which takes a fifth of a processor without a GPU.
TEST(ScrollingPlot, LevelLinesAreNotDrawnAgainAndAgain) {
  const test::Desk desk;
  ASSERT_TRUE(desk.stands()) << "Xvfb is needed; deploy/install installs it";
  struct Counter : QObject {
    int paints = 0;
    bool eventFilter(QObject* watched, QEvent* event) override {
      paints += event->type() == QEvent::Paint;
      return QObject::eventFilter(watched, event);
    }
  } counter;
  ScrollingPlot plot;
  plot.installEventFilter(&counter);
  plot.show();
  ASSERT_TRUE(QTest::qWaitForWindowExposed(&plot));
  double at_s = 0.0;
  const auto paints_of = [&](double force_n, int count) {
    const int before = counter.paints;
    for (int i = 0; i < count; ++i) {
      plot.add(at_s += 0.1, force_n + (i % 2) * 0.001, 0.0);
      QApplication::processEvents();
    }
    return counter.paints - before;
  };
  paints_of(0.0, 10);
  EXPECT_EQ(paints_of(8.0, 90), 90) << "the step scrolls through the plot";
  EXPECT_LE(paints_of(8.0, 300), 12) << "the step leaves the plot after ten seconds";
  EXPECT_EQ(paints_of(8.0, 300), 0);
  EXPECT_EQ(paints_of(3.0, 90), 90);
}

TEST(HandForce, IsThePointersElseThatOfTheStatesDevice) {
  CuttingState state;
  state.force_physical_N = {0, 0, 20};
  EXPECT_FALSE(hand_force(state, std::nullopt)) << "a device without force, or an older program";
  state.device_holds_N = 0.88;
  state.force_hand_N = 0.5;
  state.depth_mm = 3.0;
  const auto shown = hand_force(state, std::nullopt);
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->bone_n, 20.0);
  EXPECT_EQ(shown->hand_n, 0.5);
  EXPECT_EQ(shown->device_holds_n, 0.88);
  EXPECT_EQ(shown->depth_mm, 3.0);
  EXPECT_FALSE(shown->saturated);
  state.force_hand_N = 0.88;
  EXPECT_TRUE(hand_force(state, std::nullopt)->saturated);
  PointerOutput output;
  output.force_hand_n = {0, 3, 4};
  output.device_holds_n = 30.0;
  EXPECT_EQ(hand_force(state, output)->hand_n, 5.0);
  EXPECT_EQ(hand_force(state, output)->device_holds_n, 30.0);
}

}  // namespace
}  // namespace osteon
