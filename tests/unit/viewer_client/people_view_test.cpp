#include "viewer_client/scene/people_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/tools/tool.hpp"
#include "viewer_client/scene/camera_view.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr AuthorId kAda{3}, kBerg{4}, kCy{5}, kSelf{8};
const PeopleView::Clock::time_point kNow{};

PersonSeen person(AuthorId author, const std::string& name, Role role = Role::trainee) {
  PersonSeen one;
  one.author = author;
  one.name = name;
  one.role = role;
  one.here = true;
  one.hand = role != Role::instructor;
  return one;
}

PeopleSeen all_three() {
  return {{person(kAda, "Ada"), person(kBerg, "Dr. Berg", Role::instructor), person(kCy, "Cy")}, {}, {}};
}

// Ada with the restrictions that were decided about her.
PeopleSeen about_ada(const Restrictions& supervision) {
  PeopleSeen seen = all_three();
  seen.people[0].supervision = supervision;
  return seen;
}

PeopleSeen said(std::uint64_t place, AuthorId from, AuthorId to, const std::string& words) {
  PeopleSeen seen = all_three();
  seen.words = {{RoomSeq{place}, from, to, words}};
  return seen;
}

TEST(PeopleView, TheHandSeesWhatWasDecidedAboutIt) {
  PeopleView view("Ada");
  view.take(all_three(), kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), IsEmpty());
  EXPECT_EQ(view.holding(), "");
  Restrictions stopped;
  stopped.stopped = true;
  stopped.words = "mind the dura";
  view.take(about_ada(stopped), kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("Dr. Berg has stopped your hand: mind the dura"));
  EXPECT_EQ(view.holding(), "Your hand is stopped\nmind the dura");
  view.take(about_ada({}), kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre(testing::_, "Dr. Berg has set your hand free"));
  EXPECT_EQ(view.holding(), "");
}

TEST(PeopleView, OthersSeeWhomItConcerns) {
  PeopleView view("Cy");
  view.take(all_three(), kSelf, kNow);
  Restrictions stopped;
  stopped.stopped = true;
  view.take(about_ada(stopped), kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("Dr. Berg has stopped Ada's hand"));
  EXPECT_EQ(view.holding(), "") << "this is not Cy's hand";
}

TEST(PeopleView, EveryKindOfDecisionHasItsSentence) {
  PeopleView view("#3");
  view.take(all_three(), kSelf, kNow);
  const auto told = [&](const Restrictions& supervision) {
    view.take(about_ada(supervision), kSelf, kNow);
    const auto shown = view.notices(kNow);
    return shown.empty() ? std::string() : shown.back();
  };
  EXPECT_EQ(told({.taken_by = kBerg}), "Dr. Berg has taken over your tool");
  EXPECT_EQ(view.holding(), "Dr. Berg holds your tool");
  EXPECT_EQ(told({}), "Dr. Berg has given your tool back");
  EXPECT_EQ(told({.guide = kCy, .guide_share = 500}), "Dr. Berg leads your hand along the tool of Cy");
  EXPECT_EQ(view.holding(), "Your hand is led along the tool of Cy");
  EXPECT_EQ(told({}), "Dr. Berg leads your hand no more");
  EXPECT_EQ(told({.force_limit = 850}), "Dr. Berg limits your force to 8.50 N");
  EXPECT_EQ(told({}), "Dr. Berg limits your force no more");
  EXPECT_EQ(told({.zone = ZoneLimit{{1024, 0, -2048}, 12 * 1024}}),
            "Dr. Berg lets you cut only within 12.0 mm of a point");
  EXPECT_EQ(view.holding(), "Cut only within 12.0 mm of 1.0 0.0 -2.0");
  EXPECT_EQ(told({}), "Dr. Berg lets you cut everywhere");
  const Tool& drill = builtin_tools()[0];
  EXPECT_EQ(told({.tools = {drill.hash()}}), "Dr. Berg lets you cut with " + drill.name + " only");
  EXPECT_EQ(told({.tools = {Digest{}}}), "Dr. Berg lets you cut with 1 other tool only");
  EXPECT_EQ(told({}), "Dr. Berg lets you cut with every tool");
  EXPECT_EQ(told({.words = "well done"}), "Dr. Berg about your hand: well done");
}

TEST(PeopleView, WhoDecidedIsNamedOnlyWhereItIsCertain) {
  PeopleView view("Ada");
  PeopleSeen change = all_three();
  change.people.push_back(person(AuthorId{9}, "Dr. Cho", Role::instructor));
  view.take(change, kSelf, kNow);
  change.people[0].supervision.stopped = true;
  view.take(change, kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("An instructor has stopped your hand"));
}

TEST(PeopleView, TheRoomSaysWhoDecided) {
  PeopleView view("Ada");
  PeopleSeen change = all_three();
  change.people.push_back(person(AuthorId{9}, "Dr. Cho", Role::instructor));
  view.take(change, kSelf, kNow);
  change.people[0].supervision.stopped = true;
  change.people[0].decided_by = AuthorId{9};
  view.take(change, kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("Dr. Cho has stopped your hand"));
  EXPECT_EQ(view.holding(), "Your hand is stopped\nDecided by Dr. Cho");
  change.people[0].supervision = {};
  change.people[0].decided_by = kBerg;
  view.take(change, kSelf, kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre(testing::_, "Dr. Berg has set your hand free"));
  EXPECT_EQ(view.holding(), "") << "no decision holds";
}

TEST(PeopleView, WhoComesLaterSeesWhatAlreadyHolds) {
  PeopleView view("Ada");
  PeopleSeen change = all_three();
  change.people[0].supervision.stopped = true;
  view.take(change, kSelf, kNow);
  EXPECT_EQ(view.notices(kNow).size(), 1u);
  // After a lost connection everything is sent once more. Nothing of it is new.
  view.take(change, kSelf, kNow + 60s);
  EXPECT_THAT(view.notices(kNow + 60s), IsEmpty());
  EXPECT_EQ(view.holding(), "Your hand is stopped");
}

TEST(PeopleView, WordsSayWhoSpeaksToWhom) {
  PeopleView view("Ada");
  view.take(all_three(), kSelf, kNow);
  view.take(said(1, kBerg, {}, "good morning"), kSelf, kNow);
  view.take(said(2, kBerg, kAda, "slower"), kSelf, kNow);
  view.take(said(3, kBerg, kSelf, "turn the bone"), kSelf, kNow);
  view.take(said(4, kCy, kBerg, "may I?"), kSelf, kNow);
  view.take(said(5, AuthorId{77}, {}, "hello"), kSelf, kNow);
  EXPECT_THAT(view.notices(kNow),
              ElementsAre("Dr. Berg: good morning", "Dr. Berg to you: slower", "Dr. Berg to you: turn the bone",
                          "Cy to Dr. Berg: may I?", "#77: hello"));
  view.take(said(5, AuthorId{77}, {}, "hello"), kSelf, kNow);
  EXPECT_EQ(view.notices(kNow).front(), "Dr. Berg: good morning") << "a message sent again is not new";
  view.take(said(6, kCy, {}, "one more"), kSelf, kNow);
  EXPECT_EQ(view.notices(kNow).size(), PeopleView::kMostNotices);
  EXPECT_EQ(view.notices(kNow).back(), "Cy: one more");
}

TEST(PeopleView, NoticesPass) {
  PeopleView view;
  view.take(all_three(), kSelf, kNow);
  view.take(said(1, kBerg, {}, "first"), kSelf, kNow);
  view.take(said(2, kBerg, {}, "second"), kSelf, kNow + PeopleView::kShown / 2);
  EXPECT_EQ(view.notices(kNow + PeopleView::kShown - 1ms).size(), 2u);
  EXPECT_THAT(view.notices(kNow + PeopleView::kShown), ElementsAre("Dr. Berg: second"));
  EXPECT_THAT(view.notices(kNow + 2 * PeopleView::kShown), IsEmpty());
}

TEST(PeopleView, PeopleAreFoundByNameOrNumber) {
  PeopleView view;
  PeopleSeen change = all_three();
  PersonSeen gone = person(AuthorId{9}, "Ada");
  gone.here = false;
  change.people.push_back(gone);
  change.people.push_back(person(AuthorId{10}, ""));
  view.take(change, kSelf, kNow);
  EXPECT_EQ(view.find("Ada")->author, kAda) << "who is here";
  EXPECT_EQ(view.find("#9")->author, AuthorId{9});
  EXPECT_EQ(view.find("Dr. Berg")->author, kBerg);
  for (const char* nobody : {"ada", "#", "#3x", "#99", ""}) {
    const auto found = view.find(nobody);
    ASSERT_FALSE(found) << nobody;
    EXPECT_EQ(found.error().code, ErrorCode::not_found);
    EXPECT_THAT(found.error().message, HasSubstr("Ada, Dr. Berg, Cy, #10"));
  }
  EXPECT_EQ(view.names().at(AuthorId{10}), "#10");
  EXPECT_EQ(view.name_of(kCy), "Cy");
  // A person who came back under the same name is the newer one.
  change.people[0].here = false;
  change.people[3].here = true;
  view.take(change, kSelf, kNow);
  EXPECT_EQ(view.find("Ada")->author, AuthorId{9});
}

TEST(PeopleView, OfOneNameWhoFitsBetterIsMeant) {
  PeopleView view("Ada");
  PeopleSeen seen = all_three();
  PersonSeen window = person(AuthorId{2}, "Ada");  // older than her hand
  window.hand = false;
  window.look = ViewFrustum{};
  seen.people.push_back(window);
  seen.people.push_back(person(AuthorId{9}, "Ada"));
  seen.people.back().hand = false;
  seen.people[0].supervision.stopped = true;
  view.take(seen, kSelf, kNow);
  EXPECT_EQ(view.find("Ada", PeopleView::Fit::looking)->author, AuthorId{2});
  EXPECT_EQ(view.find("Ada", PeopleView::Fit::hand)->author, kAda);
  EXPECT_EQ(view.find("Ada")->author, AuthorId{9});
  EXPECT_EQ(view.holding(), "Your hand is stopped");
}

TEST(PeopleView, TheProgramItselfMaySaySomething) {
  PeopleView view;
  view.tell("no", kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("no"));
  EXPECT_NE(colour_of(kAda), colour_of(kBerg));
  EXPECT_EQ(colour_of(kAda) >> 24, 0u);
}

TEST(PeopleView, DrawingsAreThoseOfTheRoom) {
  PeopleView view;
  PeopleSeen seen;
  seen.annotations = {{.id = 1, .words = "a"}, {.id = 2, .words = "b"}};
  view.take(seen, kSelf, kNow);
  EXPECT_EQ(view.annotations(), seen.annotations);
  view.take({}, kSelf, kNow);
  EXPECT_TRUE(view.annotations().empty());
}

TEST(Wrapped, BreaksAtBlanksAndCutsOff) {
  EXPECT_EQ(wrapped("one two three", 7, 9), "one two\nthree");
  EXPECT_EQ(wrapped("  a \n b\t c ", 80, 9), "a b c") << "words are shown as one line";
  EXPECT_EQ(wrapped("abcdefghij", 4, 9), "abcd\nefgh\nij");
  EXPECT_EQ(wrapped("x abcdefghij", 4, 9), "x\nabcd\nefgh\nij");
  EXPECT_EQ(wrapped("äöü äöü", 3, 9), "äöü\näöü") << "characters, not bytes";
  EXPECT_EQ(wrapped("a b c d", 1, 2), "a\nb ...");
  EXPECT_EQ(wrapped("", 10, 2), "");
}

TEST(CameraView, LooksAsSomebodyElse) {
  CameraView own;
  own.view_angle_rad = 0.7;
  ViewFrustum look;
  look.eye_mm = Vec3(10, -200, 50);
  look.target_mm = Vec3(10, 0, 0);
  const CameraView view = looking_as(look, own);
  EXPECT_EQ(view.eye_mm, look.eye_mm);
  EXPECT_EQ(view.target_mm, look.target_mm);
  EXPECT_EQ(view.view_angle_rad, 0.7);
  EXPECT_NEAR(view.up.dot(look.target_mm - look.eye_mm), 0.0, 1e-9);
  EXPECT_GT(view.up.z(), 0.9);
  look.eye_mm = Vec3(10, 0, 300);  // along the body: the face is up
  EXPECT_LT((looking_as(look, own).up - Vec3(0, -1, 0)).norm(), 1e-9);
  look.eye_mm = look.target_mm;
  EXPECT_EQ(looking_as(look, own).eye_mm, own.eye_mm);
}

// A person who follows sees the same picture as the other, also where the other has rolled it.
TEST(CameraView, RollsAsSomebodyElseDoes) {
  CameraView theirs;
  theirs.eye_mm = Vec3(10, -200, 0);
  theirs.target_mm = Vec3(10, 0, 0);
  theirs.up = Vec3(2, 3, 2);  // as `look at … up` takes it
  const ViewFrustum look = look_of(theirs, 800, 600);
  ASSERT_TRUE(look.up);
  EXPECT_LT((*look.up - Vec3(1, 0, 1).normalized()).norm(), 1e-9) << "across the line of sight, of length 1";
  EXPECT_LT((looking_as(look, CameraView()).up - *look.up).norm(), 1e-9);
  theirs.up = Vec3(0, 1, 0);
  EXPECT_FALSE(look_of(theirs, 800, 600).up) << "there is no up direction along the line of sight";
  theirs.eye_mm = theirs.target_mm;
  EXPECT_FALSE(look_of(theirs, 800, 600).up);
}

// A roll of the picture is sent like any other move of the camera.
TEST(CameraView, LooksThatRollAreNotNearEachOther) {
  ViewFrustum look{Vec3(0, -200, 0), Vec3::Zero(), 0.001, 0.4, Vec3(0, 0, 1)}, other = look;
  EXPECT_TRUE(nearly_equal(look, other));
  other.up = Vec3(std::sin(0.03), 0, std::cos(0.03));
  EXPECT_TRUE(nearly_equal(look, other));
  other.up = Vec3(std::sin(0.2), 0, std::cos(0.2));
  EXPECT_FALSE(nearly_equal(look, other));
  other.up.reset();
  EXPECT_FALSE(nearly_equal(look, other));
}

}  // namespace
}  // namespace osteon
