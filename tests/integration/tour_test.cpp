// The tour of the first start: it points at what is to be done next, and covers nothing else.
#include <gtest/gtest.h>

#include <QApplication>
#include <QListWidget>
#include <QPushButton>
#include <QSettings>
#include <QTest>
#include <QWheelEvent>
#include <memory>

#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/tour.hpp"

namespace osteon {
namespace {

class TourTest : public test::WindowBench {};

TEST_F(TourTest, FollowsWhatIsDone) {
  QSettings().remove("tour/seen");
  window_ = std::make_unique<MainWindow>();
  show();
  view_ = window_->findChild<BoneView*>("bone");
  auto* tour = window_->findChild<Tour*>("tour");
  ASSERT_NE(tour, nullptr);
  ASSERT_TRUE(until([&] { return tour->isVisible(); }));
  const auto at = [&](int step) { return tour->accessibleName() == QString("Step %1 of 5").arg(step); };
  const auto ring_is_about = [&](const char* name) {
    const auto* part = window_->findChild<QWidget*>(name);
    const QRect ring = window_->findChild<QWidget*>("tour_ring")->geometry();
    return ring.contains(QRect(part->mapTo(window_.get(), QPoint(0, 0)), part->size())) &&
           ring.width() < part->width() + 20;
  };
  EXPECT_TRUE(at(1));
  EXPECT_TRUE(ring_is_about("examples"));
  EXPECT_FALSE(tour->isAncestorOf(QApplication::focusWidget())) << "it takes no focus by itself";
  // Over another page it would hide what that is for.
  trigger("import_scan");
  EXPECT_FALSE(tour->isVisible());
  EXPECT_FALSE(window_->findChild<QWidget*>("tour_ring")->isVisible());
  part<QPushButton>("imaging_back").click();
  EXPECT_TRUE(tour->isVisible());
  EXPECT_TRUE(at(1));
  open();
  EXPECT_TRUE(at(2));
  EXPECT_TRUE(until([&] { return ring_is_about("tools"); }));
  drill();
  release(middle());
  EXPECT_TRUE(at(4));
  EXPECT_TRUE(until([&] { return ring_is_about("push_set"); }));
  QWheelEvent wheel(QPointF(middle()), view_->mapToGlobal(middle()), {}, {0, 120}, Qt::NoButton, {}, Qt::NoScrollPhase,
                    false);
  QApplication::sendEvent(view_, &wheel);
  EXPECT_TRUE(at(5));
  EXPECT_TRUE(until([&] { return ring_is_about("undo_button"); }));
  trigger("undo");
  EXPECT_FALSE(tour->isVisible());
  // It comes once.
  window_ = std::make_unique<MainWindow>();
  show();
  QTest::qWait(100);
  EXPECT_FALSE(window_->findChild<Tour*>("tour")->isVisible());
}

TEST_F(TourTest, BeginsWithWhatIsStillToBeDone) {
  auto* tour = window_->findChild<Tour*>("tour");
  trigger("tour_again");
  EXPECT_EQ(tour->accessibleName(), "Step 1 of 5");
  // The card covers a part of the list that it is about, and nothing of the list beside it.
  const auto place = [&](const char* name) {
    const auto* part = window_->findChild<QWidget*>(name);
    return QRect(part->mapTo(window_.get(), QPoint(0, 0)), part->size());
  };
  EXPECT_TRUE(place("examples").contains(tour->geometry()));
  EXPECT_FALSE(place("recent").intersects(tour->geometry()));
  tour->end();
  open();
  trigger("tour_again");
  EXPECT_EQ(tour->accessibleName(), "Step 2 of 5");
  tour->end();
  click_tool("drill");
  trigger("tour_again");
  EXPECT_EQ(tour->accessibleName(), "Step 3 of 5");
  tour->end();
  trigger("start_page");
  trigger("tour_again");
  EXPECT_EQ(tour->accessibleName(), "Step 1 of 5");
}

TEST_F(TourTest, IsLedAndEndedByTheKeyboard) {
  auto* tour = window_->findChild<Tour*>("tour");
  trigger("tour_again");
  ASSERT_TRUE(tour->isVisible());
  QWidget* next = QApplication::focusWidget();
  ASSERT_EQ(next, window_->findChild<QWidget*>("tour_next"));
  QTest::keyClick(next, Qt::Key_Space);
  EXPECT_EQ(tour->accessibleName(), "Step 2 of 5");
  QTest::keyClick(next, Qt::Key_Escape);
  EXPECT_FALSE(tour->isVisible());
  EXPECT_NE(QApplication::focusWidget(), next);
  // All of it by one key.
  trigger("tour_again");
  for (int step = 0; step < 5; ++step) QTest::keyClick(QApplication::focusWidget(), Qt::Key_Space);
  EXPECT_FALSE(tour->isVisible());
  // Escape ends it also from elsewhere, and nobody needs to look for the card.
  trigger("tour_again");
  auto* examples = window_->findChild<QListWidget*>("examples");
  examples->setFocus();
  QTest::keyClick(examples, Qt::Key_Escape);
  EXPECT_FALSE(tour->isVisible());
  // One key ends it and puts the tool down.
  open();
  click_tool("drill");
  trigger("tour_again");
  view_->setFocus();
  QTest::keyClick(view_, Qt::Key_Escape);
  EXPECT_FALSE(tour->isVisible());
  EXPECT_FALSE(view_->holding());
}

}  // namespace
}  // namespace osteon
