// The gauges of the window: when the plot is drawn, and what the devices of others hold. And the panel Tool,
// whose choices the gauges show. And the distance to structures at risk.
#include <gtest/gtest.h>

#include <QAction>
#include <QComboBox>
#include <QCursor>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QLocale>
#include <QStatusBar>
#include <QTest>
#include <QToolTip>
#include <QWidget>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "tests/integration/window_bench.hpp"
#include "viewer_client/desktop/gauges_panel.hpp"
#include "viewer_client/desktop/risk_gauge.hpp"
#include "viewer_client/desktop/tool_names.hpp"

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
  ASSERT_TRUE(QTest::qWaitForWindowExposed(&plot, 30000));
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

// The tip of a tool, above the middle of the plate below. `holder`: empty for the own hand.
HeldTool tool_at(const char* name, double above_mm, const char* holder) {
  HeldTool tool;
  tool.state.tool_name = name;
  tool.state.pose_bone_tool.position_mm = {0, 0, above_mm};
  tool.holder = holder;
  return tool;
}

// A square plate of 200 mm in the plane z = 0, without thickness. So the distance of a point above it is its z.
std::shared_ptr<const SurgicalPlan> plan_with_plate() {
  SurgicalPlan::Structure plate;
  plate.name = "plate";
  plate.surface.positions_mm = {{-100, -100, 0}, {100, -100, 0}, {100, 100, 0}, {-100, 100, 0}};
  plate.surface.triangles = {{0, 1, 2}, {0, 2, 3}, {2, 1, 0}, {3, 2, 0}};
  SurgicalPlan plan;
  plan.structures.push_back(plate);
  return std::make_shared<const SurgicalPlan>(plan);
}

TEST(RiskGauge, SaysWhoseToolIsNearestAndEachInItsToolTip) {
  const test::Desk desk;
  ASSERT_TRUE(desk.stands()) << "Xvfb is needed; deploy/install installs it";
  QLocale::setDefault(QLocale::c());
  RiskGauge gauge;
  gauge.set_limit_mm(5.0);
  gauge.set_plan(plan_with_plate());
  const QString drill = tool_title("drill-3.2");

  // Two people hold the same drill.
  const HeldTool ours = tool_at("drill-3.2", 40.0, ""), theirs = tool_at("drill-3.2", 2.0, "Berg");
  gauge.show_tools({});
  EXPECT_TRUE(gauge.isHidden()) << "no hand holds a tool";
  gauge.show_tools(std::vector{ours});
  EXPECT_EQ(gauge.text().toStdString(), "plate: 40.0 mm") << "the own tool alone needs no name";
  EXPECT_FALSE(gauge.warns());
  gauge.show_tools(std::vector{theirs});
  EXPECT_EQ(gauge.text().toStdString(), "Berg: Near plate: 2.0 mm");
  // Whoever comes first in the list.
  for (const auto& tools : {std::vector{ours, theirs}, std::vector{theirs, ours}}) {
    gauge.show_tools(tools);
    EXPECT_EQ(gauge.text().toStdString(), "Berg: Near plate: 2.0 mm");
    EXPECT_TRUE(gauge.warns());
    EXPECT_TRUE(gauge.toolTip().split('\n').contains("Your tool (" + drill + "): plate: 40.0 mm"));
    EXPECT_TRUE(gauge.toolTip().split('\n').contains("Berg (" + drill + "): Near plate: 2.0 mm"));
  }
  gauge.show_tools(std::vector{tool_at("drill-3.2", 1.0, ""), theirs});
  EXPECT_EQ(gauge.text().toStdString(), "Your tool: Near plate: 1.0 mm");

  // A long name does not widen the status bar.
  gauge.show_tools(std::vector{ours, tool_at("drill-3.2", 2.0, std::string(200, 'W').c_str())});
  EXPECT_LT(gauge.sizeHint().width(), 400);
  gauge.show_tools({});
  EXPECT_TRUE(gauge.isHidden());
  EXPECT_TRUE(gauge.toolTip().isEmpty());
}

TEST(RiskGauge, ItsToolTipGoesOnWhileItIsRead) {
  const test::Desk desk;
  ASSERT_TRUE(desk.stands()) << "Xvfb is needed; deploy/install installs it";
  QLocale::setDefault(QLocale::c());
  QWidget window;
  window.setAttribute(Qt::WA_AlwaysShowToolTips);  // no window manager makes it the active window
  RiskGauge gauge(&window);
  gauge.set_plan(plan_with_plate());
  gauge.resize(300, 100);
  window.resize(300, 100);
  gauge.show_tools(std::vector{tool_at("drill-3.2", 40.0, "")});
  window.show();
  ASSERT_TRUE(QTest::qWaitForWindowExposed(&window, 30000));
  // The screen's own pointer: an event alone would not put the label under it.
  QCursor::setPos(gauge.mapToGlobal(QPoint(50, 50)));
  ASSERT_TRUE(QTest::qWaitFor([&] { return gauge.underMouse(); }, 10000));
  QCursor::setPos(gauge.mapToGlobal(QPoint(51, 50)));
  ASSERT_TRUE(QTest::qWaitFor([] { return QToolTip::isVisible(); }, 10000));
  ASSERT_TRUE(QToolTip::text().endsWith("40.0 mm"));
  gauge.show_tools(std::vector{tool_at("drill-3.2", 39.0, "")});
  EXPECT_TRUE(QToolTip::text().endsWith("39.0 mm")) << QToolTip::text().toStdString();
  QToolTip::hideText();
}

class ToolPanel : public test::WindowBench {
 protected:
  // The number of a gauge.
  [[nodiscard]] double gauge(const char* name) const { return QLocale().toDouble(label(name).section(' ', 0, 0)); }
  // The haptic client reports this wear of the tool, while the pointer is over the bone.
  [[nodiscard]] bool is_as_blunt_as(const char* wear) {
    return until([&] {
      hover(middle());
      return label("wear") == wear;
    });
  }
  void type_wear(const char* wear) {
    auto* box = window_->findChild<QDoubleSpinBox*>("wear_set");
    ASSERT_NE(box, nullptr);
    box->setFocus();
    box->selectAll();
    QTest::keyClicks(box, wear);
    QTest::keyClick(box, Qt::Key_Return);
  }
  // The only haptic client of this window shows force in this way, and is connected.
  [[nodiscard]] bool shows_force(const std::string& choice) {
    return until([&] {
      const auto clients = test::children("osteon-haptic");
      if (clients.size() != 1) return false;
      std::ifstream file("/proc/" + std::to_string(clients[0]) + "/cmdline", std::ios::binary);
      const std::string options(std::istreambuf_iterator<char>(file), {});
      const std::string wanted = std::string("--force-choice") + '\0' + choice + '\0';
      return options.find(wanted) != std::string::npos && label("device") == "Pointer";
    });
  }
};

// One session for all, because each window starts a server and two clients.
TEST_F(ToolPanel, WearLawAndForceChoiceReachTheToolInTheHand) {
  open();
  ASSERT_TRUE(shows_force("proportional")) << problem();
  EXPECT_EQ(label("temperature"), "not simulated");
  click_tool("drill");
  ASSERT_TRUE(is_as_blunt_as("1.00")) << problem();
  type_wear("2.5");
  EXPECT_TRUE(is_as_blunt_as("2.50")) << problem();
  // Four laws fit a drill, and its own one is shown.
  auto* law = window_->findChild<QComboBox*>("law_set");
  ASSERT_EQ(law->count(), 4);
  EXPECT_EQ(law->currentText(), "Measured thrust");
  law->setFocus();
  QTest::keyClick(law, Qt::Key_Down);
  EXPECT_EQ(law->currentText(), "Energy of the removed volume");
  EXPECT_EQ(view_->pointer().input().law, "allotta");
  // Another tool has its own wear and law. The drill gets its wear and law back.
  click_tool("bur");
  EXPECT_TRUE(is_as_blunt_as("1.00")) << problem();
  EXPECT_EQ(law->currentText(), "Milling");
  click_tool("drill");
  EXPECT_EQ(law->currentText(), "Energy of the removed volume");
  EXPECT_EQ(view_->pointer().input().law, "allotta");
  EXPECT_TRUE(is_as_blunt_as("2.50")) << problem();
  // An item is placed by a click, so nobody chooses wear and law for it.
  click_tool("pin");
  EXPECT_FALSE(law->isEnabled());
  EXPECT_FALSE(window_->findChild<QDoubleSpinBox*>("wear_set")->isEnabled());

  // Another way to show force starts the client again. Its drill is as blunt as before, and the hand gets less than the
  // bone gives.
  trigger("force_compressed");
  EXPECT_EQ(window_->statusBar()->currentMessage(), "The haptic client starts again to show force in this way.");
  ASSERT_TRUE(shows_force("compressed")) << problem();
  click_tool("drill");
  ASSERT_TRUE(is_as_blunt_as("2.50")) << problem();
  view_->pointer().set_push(30.0);
  press(middle());
  EXPECT_TRUE(push_until([&] {
    return gauge("force_bone") > 15.0 && gauge("force_hand") < 0.85 * gauge("force_bone");
  })) << problem()
      << ", hand " << label("force_hand").toStdString();
  release(middle());
  // The choice is there at the next start.
  window_ = std::make_unique<MainWindow>();
  show();
  EXPECT_TRUE(window_->findChild<QAction*>("force_compressed")->isChecked());
  trigger("force_proportional");
  EXPECT_EQ(window_->statusBar()->currentMessage(), "The next practice room shows force in this way.");
}

}  // namespace
}  // namespace osteon
