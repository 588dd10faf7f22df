// X-rays that one person shoots and another sees: a window and another person's C-arm, in a room with certificates.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <QAction>
#include <QDockWidget>
#include <QLabel>
#include <QLocale>
#include <QPushButton>
#include <QSettings>
#include <QTreeWidget>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "osteon/v1/people.pb.h"
#include "server/rpc/room_server.hpp"
#include "tests/integration/window_bench.hpp"
#include "tests/support/authentication/people.hpp"
#include "tests/unit/room/cuts.hpp"
#include "viewer_client/desktop/c_arm_panel.hpp"
#include "viewer_client/desktop/library.hpp"
#include "viewer_client/desktop/slice_view.hpp"

namespace osteon {
namespace {

using testing::HasSubstr;

// A person who has a C-arm, and nothing else of a window.
class OtherCArm {
 public:
  explicit OtherCArm(const RoomSubscriptionOptions& options) {
    room_ = std::make_unique<RoomLink>(options,
                                       RoomLink::Events{[] {},
                                                        [this](const WatchedRoom& room) {
                                                          inside_.set_room(room_.get());
                                                          panel_->enter(room.bounds, {});
                                                        },
                                                        [](const Error& error) { ADD_FAILURE() << error.message; }});
    CArmPanel::Events events;
    events.in_beam = [] { return CArmPanel::InBeam{}; };
    events.say = [](const QString& sentence) { ADD_FAILURE() << sentence.toStdString(); };
    events.shots = [this] { return ShotsOfAll{room_->self(), room_->people(), room_->shots()}; };
    events.share = [this](const SharedShots::Message& message, RoomLink::Answered answered) {
      if (refusal_) return ++refused_, answered(tl::unexpected(*refusal_));
      room_->ask([message](RoomSubscription& room) { return room.share_shots(message.run, message.session); },
                 std::move(answered));
    };
    panel_ = std::make_unique<CArmPanel>(inside_, std::move(events));
    panel_->show();
  }
  ~OtherCArm() {
    panel_.reset();
    inside_.set_room(nullptr);
  }
  OtherCArm(const OtherCArm&) = delete;
  OtherCArm& operator=(const OtherCArm&) = delete;

  [[nodiscard]] CArmPanel& panel() const { return *panel_; }
  // What the room answers in place of taking a shot. None: it takes them.
  void refuse(const std::optional<Error>& why) { refusal_ = why; }
  [[nodiscard]] int refused() const { return refused_; }

 private:
  std::optional<Error> refusal_;
  int refused_ = 0;
  InsideLink inside_;
  std::unique_ptr<RoomLink> room_;
  std::unique_ptr<CArmPanel> panel_;
};

QTreeWidget& tree_of(const QWidget& panel) { return *panel.findChild<QTreeWidget*>("c_arm_others"); }
QPushButton* button_of(const QWidget& panel, const char* name) { return panel.findChild<QPushButton*>(name); }
std::string text_of(const QWidget& panel, const char* label) {
  return panel.findChild<QLabel*>(label)->text().toStdString();
}

class ShotsTest : public test::WindowBench {
 protected:
  void SetUp() override {
    QSettings().setValue("tour/seen", true);
    WindowBench::SetUp();
    const Case bone = test::test_block();
    ASSERT_TRUE(bone.save(dir_ / "case"));
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone, dir_ / "case"}}});
    ASSERT_TRUE(rooms->create("ward", nullptr));
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0", {.certificates = people_.server()});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    server_ = std::move(*started);
  }
  // Every client has left before the server ends.
  void TearDown() override {
    WindowBench::TearDown();
    server_.reset();
  }
  [[nodiscard]] CArmPanel& panel() const { return *dynamic_cast<CArmPanel*>(window_->findChild<QWidget*>("c_arm")); }
  // The window, as this person.
  void join(const std::string& name, Role role) {
    window_->join({QString::fromStdString(server_->address()), "ward", "", people_.credentials(name, role, "ward")});
    ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
    auto* dock = window_->findChild<QDockWidget*>("c_arm_panel");
    if (!dock->isVisible()) dock->toggleViewAction()->trigger();
    ASSERT_TRUE(until([&] { return button_of(panel(), "c_arm_shot")->isEnabled(); })) << problem();
  }
  [[nodiscard]] RoomSubscriptionOptions other(const std::string& name, Role role) {
    RoomSubscriptionOptions options;
    options.address = server_->address();
    options.room = "ward";
    options.credentials = people_.credentials(name, role, "ward");
    options.keep_trying = true;
    options.cache = dir_ / "cache";
    return options;
  }
  void show_dock(const char* name, bool shown) const {
    auto* dock = window_->findChild<QDockWidget*>(name);
    if (dock->isVisible() != shown) dock->toggleViewAction()->trigger();
  }
  // Calls that the room has open, streams too: each has a share of it.
  [[nodiscard]] long open_calls() const { return server_->rooms().find("ward").value().use_count() - 1; }
  // Without the short ones.
  [[nodiscard]] long open_streams() const {
    long least = open_calls();
    for (int i = 0; i < 20; ++i, QTest::qWait(25)) least = std::min(least, open_calls());
    return least;
  }
  // The whole picture of one shot.
  static std::shared_ptr<const CArmPicture> shoot(const CArmPanel& panel) {
    const std::uint64_t before = panel.console().totals().shots;
    QTest::mouseClick(button_of(panel, "c_arm_shot"), Qt::LeftButton);
    EXPECT_TRUE(until([&] { return panel.console().totals().shots == before + 1 && !panel.picture()->coarse; }));
    return panel.picture();
  }
  // Waits until the panel shows another person's picture of these bytes.
  static void expect_seen(const CArmPanel& panel, const CArmPicture& original) {
    const auto seen = [&] {
      const auto& shown = panel.others_picture();
      return shown && !shown->coarse && shown->shot.seed == original.shot.seed;
    };
    ASSERT_TRUE(until(seen));
    const CArmPicture& shown = *panel.others_picture();
    EXPECT_EQ(shown.columns, original.columns);
    EXPECT_EQ(shown.shot.position, original.shot.position);
    EXPECT_EQ(shown.shot.air_kerma_at_metre_ugy, original.shot.air_kerma_at_metre_ugy);
    EXPECT_EQ(shown.letters, original.letters);
    EXPECT_EQ(shown.grey, original.grey) << "to the last bit";
  }

  test::TempDir dir_;
  test::People people_;
  std::unique_ptr<RoomServer> server_;
};

TEST_F(ShotsTest, EverybodySeesTheShotsOfTheOthers) {
  join("ben", Role::trainee);
  OtherCArm other_arm(other("ada", Role::instructor));
  CArmPanel &ben = panel(), &ada = other_arm.panel();
  ASSERT_TRUE(until([&] { return button_of(ada, "c_arm_shot")->isEnabled(); }));
  QTreeWidget &of_ada = tree_of(ada), &of_ben = tree_of(ben);
  EXPECT_FALSE(of_ada.isVisible()) << "nobody has shot";

  // By keyboard.
  QTest::mouseClick(button_of(ben, "c_arm_lateral"), Qt::LeftButton);
  const auto lateral = shoot(ben);
  ASSERT_TRUE(until([&] { return of_ada.isVisible(); }));
  ASSERT_EQ(of_ada.topLevelItemCount(), 2);
  const QTreeWidgetItem& row = *of_ada.topLevelItem(1);
  EXPECT_EQ(row.text(0), "ben");
  EXPECT_EQ(row.text(1), "1");
  EXPECT_EQ(QLocale().toDouble(row.text(2)), 0.02);
  EXPECT_NEAR(QLocale().toDouble(row.text(3)), lateral->shot.dose_area_gy_cm2, 0.0000051);
  EXPECT_FALSE(ada.others_picture()) << "nobody has asked for it";
  EXPECT_FALSE(button_of(ada, "c_arm_save")->isEnabled());
  QTest::keyClick(&of_ada, Qt::Key_Down);
  expect_seen(ada, *lateral);
  EXPECT_THAT(text_of(ada, "c_arm_words"),
              HasSubstr("ben, shot 1: made again from the bone and the tools as they were at "));
  EXPECT_TRUE(button_of(ada, "c_arm_save")->isEnabled());

  // Live, the newest picture follows, and so do the counts.
  QTest::mouseClick(button_of(ben, "c_arm_ap"), Qt::LeftButton);
  QTest::mousePress(button_of(ben, "c_arm_live"), Qt::LeftButton);
  EXPECT_TRUE(until([&] { return ben.console().totals().shots >= 6; })) << problem();
  QTest::mouseRelease(button_of(ben, "c_arm_live"), Qt::LeftButton);
  EXPECT_TRUE(until([&] { return ben.console().idle(); })) << problem();
  const std::uint64_t shots = ben.console().totals().shots;
  expect_seen(ada, *ben.picture());
  EXPECT_TRUE(until([&] { return row.text(1) == QString::number(shots); })) << row.text(1).toStdString();
  EXPECT_NEAR(QLocale().toDouble(row.text(2)), 0.02 + static_cast<double>(shots - 1) / 15.0, 0.0051);
  ASSERT_EQ(row.childCount(), 2) << "a press is one line, the newest first";
  EXPECT_THAT(row.child(0)->text(0).toStdString(), HasSubstr("Shots 2 to " + std::to_string(shots)));
  EXPECT_EQ(row.child(0)->text(1), QString::number(shots - 1));
  EXPECT_THAT(row.child(1)->text(0).toStdString(), HasSubstr("Shot 1,"));

  // An earlier one again.
  of_ada.setCurrentItem(row.child(1));
  expect_seen(ada, *lateral);

  // Each counts their own alone, and sees their own when they shoot.
  EXPECT_EQ(text_of(ada, "c_arm_shots"), "0");
  EXPECT_FALSE(of_ben.isVisible());
  (void)shoot(ada);
  EXPECT_EQ(of_ada.currentItem(), of_ada.topLevelItem(0));
  EXPECT_FALSE(ada.others_picture());
  EXPECT_EQ(text_of(ada, "c_arm_shots"), "1");
  ASSERT_TRUE(until([&] { return of_ben.isVisible(); }));
  EXPECT_EQ(of_ben.topLevelItem(1)->text(0), "ada");
  EXPECT_EQ(ben.console().totals().shots, shots);
  of_ben.setCurrentItem(of_ben.topLevelItem(1));
  expect_seen(ben, *ada.picture());
}

TEST_F(ShotsTest, WhatARoomDidNotTakeIsSharedLater) {
  join("ben", Role::trainee);
  OtherCArm other_arm(other("ada", Role::instructor));
  const CArmPanel& ada = other_arm.panel();
  ASSERT_TRUE(until([&] { return button_of(ada, "c_arm_shot")->isEnabled(); }));
  const QTreeWidget& of_ben = tree_of(panel());

  // A room that was away gets the last shot when it is back.
  other_arm.refuse(Error{ErrorCode::unavailable, "the server does not answer"});
  (void)shoot(ada);
  ASSERT_TRUE(until([&] { return other_arm.refused() >= 2; })) << "it is tried again";
  EXPECT_FALSE(of_ben.isVisible());
  other_arm.refuse({});
  ASSERT_TRUE(until([&] { return of_ben.isVisible(); }));
  EXPECT_EQ(of_ben.topLevelItem(1)->text(1), "1");

  // A refusal holds until the next press.
  other_arm.refuse(Error{ErrorCode::denied, "not now"});
  (void)shoot(ada);
  EXPECT_TRUE(until([&] {
    return text_of(ada, "c_arm_words").find("The others do not see your shots: not now") != std::string::npos;
  }));
  other_arm.refuse({});
  (void)shoot(ada);
  EXPECT_TRUE(until([&] { return of_ben.topLevelItem(1)->text(1) == "3"; }));
  EXPECT_TRUE(until([&] { return text_of(ada, "c_arm_words").empty(); })) << text_of(ada, "c_arm_words");
}

// A room keeps the latest presses only.
TEST_F(ShotsTest, APersonIsLookedAtWithWhatTheRoomHas) {
  constexpr AuthorId kBen{2}, kCarl{3};
  PersonSeen ben, carl;
  ben.author = kBen;
  ben.name = "ben";
  ben.shots = {2, 0.04, 0.001};
  carl.author = kCarl;
  carl.name = "carl";
  carl.shots = {1, 0.02, 0.001};
  const ShotRun first{kBen, 1, 0.02, {.number = 1}}, second{kBen, 2, 0.02, {.number = 2}};
  std::optional<ShotRun> told;
  OthersShots tree([&](const std::optional<ShotRun>& run) { told = run; });
  tree.take({AuthorId{1}, {ben, carl}, {first, second}});
  EXPECT_FALSE(tree.of_other());

  // Both kinds of rows keep what is looked at.
  QTreeWidgetItem& row = *tree.topLevelItem(1);
  ASSERT_EQ(row.text(0), "ben");
  tree.setCurrentItem(&row);
  EXPECT_EQ(told, second);
  tree.take({AuthorId{1}, {ben, carl}, {}});
  EXPECT_EQ(told, second);
  ASSERT_EQ(row.childCount(), 1);
  tree.setCurrentItem(row.child(0));
  tree.take({AuthorId{1}, {ben, carl}, {}});
  EXPECT_EQ(told, second);

  // Of a person without a press nothing is shown, and no own picture either.
  tree.setCurrentItem(tree.topLevelItem(2));
  EXPECT_EQ(told, std::nullopt);
  EXPECT_TRUE(tree.of_other());
  tree.choose_own();
  EXPECT_FALSE(tree.of_other());
}

TEST_F(ShotsTest, AnObserversShotsStayInTheirWindow) {
  join("olga", Role::observer);
  EXPECT_TRUE(until([&] { return text_of(panel(), "c_arm_words").find("You are an observer") != std::string::npos; }))
      << text_of(panel(), "c_arm_words");
  (void)shoot(panel());
  EXPECT_EQ(text_of(panel(), "c_arm_shots"), "1");
  QTest::qWait(1000);
  PresenceCursor cursor;
  v1::WatchPeopleResponse news;
  const Bytes all = server_->rooms().find("ward").value()->runtime().people().news(cursor, {}, {});
  ASSERT_TRUE(news.ParseFromString(*all));
  EXPECT_EQ(news.shots_size(), 0);
  for (const v1::Person& person : news.people()) EXPECT_FALSE(person.has_session_shots()) << person.name();

  // They see the others' shots.
  OtherCArm other_arm(other("ada", Role::instructor));
  ASSERT_TRUE(until([&] { return button_of(other_arm.panel(), "c_arm_shot")->isEnabled(); }));
  const auto original = shoot(other_arm.panel());
  ASSERT_TRUE(until([&] { return tree_of(panel()).isVisible(); }));
  tree_of(panel()).setCurrentItem(tree_of(panel()).topLevelItem(1));
  expect_seen(panel(), *original);
  EXPECT_FALSE(tree_of(other_arm.panel()).isVisible());
}

// A hidden pane costs neither the network nor the server anything, and one stream is enough for all panes.
TEST_F(ShotsTest, TheInsideIsFetchedWhileAPaneShowsItAndNotElse) {
  // The window opens as the one before was left.
  for (const char* name : {"slices_panel", "c_arm_panel"}) show_dock(name, false);
  const std::filesystem::path cache = data_folder() / "cache";
  std::filesystem::remove_all(cache);
  window_->join(
      {QString::fromStdString(server_->address()), "ward", "", people_.credentials("ben", Role::trainee, "ward")});
  ASSERT_TRUE(until([&] { return view_->surface_shown(); })) << problem();
  // A slow window opens its own streams one after the other.
  long without = -1;
  int looks_alike = 0;
  ASSERT_TRUE(until([&] {
    const long before = std::exchange(without, open_streams());
    looks_alike = without == before ? looks_alike + 1 : 0;
    return looks_alike == 6;
  }));
  const auto* slice = window_->findChild<SliceView*>("slice_0");
  const auto* shot = button_of(panel(), "c_arm_shot");
  EXPECT_FALSE(std::filesystem::exists(cache));

  for (const char* time : {"at first", "again"}) {
    show_dock("slices_panel", true);
    ASSERT_TRUE(until([&] { return slice->image() != nullptr; })) << time << problem();
    EXPECT_EQ(open_streams(), without + 1) << time;
    EXPECT_TRUE(std::filesystem::exists(cache));
    show_dock("c_arm_panel", true);
    ASSERT_TRUE(until([&] { return shot->isEnabled(); })) << time << problem();
    EXPECT_EQ(open_streams(), without + 1) << time << ": both panes look at one bone";
    show_dock("slices_panel", false);
    EXPECT_EQ(open_streams(), without + 1) << time << ": the C-arm is still seen";
    show_dock("c_arm_panel", false);
    EXPECT_TRUE(until([&] { return open_calls() == without; })) << time << ": nothing is fetched any more";
    EXPECT_EQ(open_streams(), without) << time;
  }
}

// Of the same room: a plan is for everybody, as the shots are.
TEST_F(ShotsTest, OnlyAnInstructorPlans) {
  const auto* draw = window_->findChild<QAction*>("draw_axis");
  join("ben", Role::trainee);
  EXPECT_TRUE(until([&] { return !draw->isEnabled(); }));
  EXPECT_EQ(draw->toolTip().toStdString(), "Only an instructor plans in this room.");
  join("ada", Role::instructor);
  QTest::qWait(1000);
  EXPECT_TRUE(draw->isEnabled());
}

}  // namespace
}  // namespace osteon
