#include "viewer_client/scene/people_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/tools/tool.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/inbox.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr AuthorId kAda{3}, kBerg{4}, kCy{5};
const PeopleView::Clock::time_point kNow{};

Person person(AuthorId author, const std::string& name, Role role = Role::trainee) {
  Person one;
  one.author = author;
  one.name = name;
  one.role = role;
  one.here = true;
  one.hand = role != Role::instructor;
  return one;
}

PeopleChange all_three() {
  PeopleChange change;
  change.complete = true;
  change.people = {person(kAda, "Ada"), person(kBerg, "Dr. Berg", Role::instructor), person(kCy, "Cy")};
  return change;
}

// Ada under what was decided about her.
PeopleChange about_ada(const Supervision& supervision) {
  PeopleChange change;
  change.people = {person(kAda, "Ada")};
  change.people[0].supervision = supervision;
  return change;
}

PeopleChange said(std::uint64_t place, AuthorId from, AuthorId to, const std::string& words) {
  PeopleChange change;
  change.words = {{RoomSeq{place}, from, to, words}};
  return change;
}

TEST(PeopleView, TheHandIsToldWhatWasDecidedAboutIt) {
  PeopleView view("Ada");
  view.take(all_three(), kNow);
  EXPECT_THAT(view.notices(kNow), IsEmpty());
  EXPECT_EQ(view.holding(), "");
  Supervision stopped;
  stopped.stopped = true;
  stopped.words = "mind the dura";
  view.take(about_ada(stopped), kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("Dr. Berg has stopped your hand: mind the dura"));
  EXPECT_EQ(view.holding(), "Your hand is stopped\nmind the dura");
  view.take(about_ada({}), kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre(testing::_, "Dr. Berg has set your hand free"));
  EXPECT_EQ(view.holding(), "");
}

TEST(PeopleView, OthersAreToldOfWhom) {
  PeopleView view("Cy");
  view.take(all_three(), kNow);
  Supervision stopped;
  stopped.stopped = true;
  view.take(about_ada(stopped), kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("Dr. Berg has stopped Ada's hand"));
  EXPECT_EQ(view.holding(), "") << "it is not Cy's hand";
}

TEST(PeopleView, EveryKindOfDecisionHasItsSentence) {
  PeopleView view("#3");
  view.take(all_three(), kNow);
  const auto told = [&](const Supervision& supervision) {
    view.take(about_ada(supervision), kNow);
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
  EXPECT_EQ(told({.zone = ZoneLimit{{1024, 0, -2048}, 12 * 1024}}), "Dr. Berg lets you cut only within 12.0 mm of a point");
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
  PeopleChange change = all_three();
  change.people.push_back(person(AuthorId{9}, "Dr. Cho", Role::instructor));
  view.take(change, kNow);
  Supervision stopped;
  stopped.stopped = true;
  view.take(about_ada(stopped), kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("An instructor has stopped your hand"));
}

TEST(PeopleView, WhatAlreadyHoldsIsToldToWhoComesLater) {
  PeopleView view("Ada");
  PeopleChange change = all_three();
  change.people[0].supervision.stopped = true;
  view.take(change, kNow);
  EXPECT_EQ(view.notices(kNow).size(), 1u);
  // After a connection was lost everything is told once more: nothing of it is new.
  view.take(change, kNow + 60s);
  EXPECT_THAT(view.notices(kNow + 60s), IsEmpty());
  EXPECT_EQ(view.holding(), "Your hand is stopped");
}

TEST(PeopleView, WordsSayWhoSpeaksToWhom) {
  PeopleView view("Ada");
  view.set_self(AuthorId{8});
  view.take(all_three(), kNow);
  view.take(said(1, kBerg, {}, "good morning"), kNow);
  view.take(said(2, kBerg, kAda, "slower"), kNow);
  view.take(said(3, kBerg, AuthorId{8}, "turn the bone"), kNow);
  view.take(said(4, kCy, kBerg, "may I?"), kNow);
  view.take(said(5, AuthorId{77}, {}, "hello"), kNow);
  EXPECT_THAT(view.notices(kNow), ElementsAre("Dr. Berg: good morning", "Dr. Berg to you: slower", "Dr. Berg to you: turn the bone",
                                              "Cy to Dr. Berg: may I?", "#77: hello"));
  view.take(said(5, AuthorId{77}, {}, "hello"), kNow);
  EXPECT_EQ(view.notices(kNow).size(), 5u) << "told again";
  view.take(said(6, kCy, {}, "one more"), kNow);
  EXPECT_EQ(view.notices(kNow).size(), PeopleView::kMostNotices);
  EXPECT_EQ(view.notices(kNow).back(), "Cy: one more");
}

TEST(PeopleView, NoticesPass) {
  PeopleView view;
  view.take(all_three(), kNow);
  view.take(said(1, kBerg, {}, "first"), kNow);
  view.take(said(2, kBerg, {}, "second"), kNow + PeopleView::kShown / 2);
  EXPECT_EQ(view.notices(kNow + PeopleView::kShown - 1ms).size(), 2u);
  EXPECT_THAT(view.notices(kNow + PeopleView::kShown), ElementsAre("Dr. Berg: second"));
  EXPECT_THAT(view.notices(kNow + 2 * PeopleView::kShown), IsEmpty());
}

TEST(PeopleView, PeopleAreFoundByNameOrNumber) {
  PeopleView view;
  PeopleChange change = all_three();
  Person gone = person(AuthorId{9}, "Ada");
  gone.here = false;
  change.people.push_back(gone);
  change.people.push_back(person(AuthorId{10}, ""));
  view.take(change, kNow);
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
  // Who came back under the same name is the newer one.
  change.people[0].here = false;
  change.people[3].here = true;
  view.take(change, kNow);
  EXPECT_EQ(view.find("Ada")->author, AuthorId{9});
}

TEST(PeopleView, DrawingsComeGoAndAreReplaced) {
  PeopleView view;
  PeopleChange change;
  change.annotations = {{.id = 2, .words = "b"}, {.id = 1, .words = "a"}};
  change.room_seq = RoomSeq{7};
  view.take(change, kNow);
  ASSERT_EQ(view.annotations().size(), 2u);
  EXPECT_EQ(view.annotations()[0].words, "a");
  EXPECT_EQ(view.room_seq(), RoomSeq{7});
  PeopleChange next;
  next.annotations = {{.id = 2, .words = "c"}};
  next.wiped = {1};
  view.take(next, kNow);
  ASSERT_EQ(view.annotations().size(), 1u);
  EXPECT_EQ(view.annotations()[0].words, "c");
  EXPECT_EQ(view.room_seq(), RoomSeq{7});
  PeopleChange anew;
  anew.complete = true;
  view.take(anew, kNow);
  EXPECT_TRUE(view.annotations().empty()) << "another server has none of them";
}

TEST(Inbox, SaysSeveralChangesOfPeopleAsOne) {
  Inbox inbox;
  EXPECT_FALSE(inbox.take().people);
  PeopleChange first = all_three();
  first.annotations = {{.id = 1}, {.id = 2}};
  first.words = {{RoomSeq{1}, kBerg, {}, "one"}};
  PeopleChange second = about_ada({.stopped = true});
  second.annotations = {{.id = 3}};
  second.wiped = {1};
  second.words = {{RoomSeq{2}, kBerg, {}, "two"}};
  second.room_seq = RoomSeq{9};
  inbox.put_people(first);
  inbox.put_people(second);
  PeopleView together, one_by_one;
  together.take(*inbox.take().people, kNow);
  one_by_one.take(first, kNow);
  one_by_one.take(second, kNow);
  EXPECT_EQ(together.annotations(), one_by_one.annotations());
  EXPECT_EQ(together.annotations().size(), 2u);
  EXPECT_TRUE(together.find("Ada")->supervision.stopped);
  EXPECT_EQ(together.room_seq(), RoomSeq{9});
  EXPECT_THAT(together.notices(kNow), testing::IsSupersetOf({"Dr. Berg: one", "Dr. Berg: two"}));
  EXPECT_FALSE(inbox.take().people);
  // What was wiped and drawn anew stands; a whole list drops what came before it, but no words.
  inbox.put_people(second);
  PeopleChange again;
  again.annotations = {{.id = 1}};
  inbox.put_people(again);
  EXPECT_TRUE(inbox.take().people->wiped.empty());
  inbox.put_people(second);
  inbox.put_people(all_three());
  const PeopleChange last = inbox.take().people.value_or(PeopleChange{});
  EXPECT_TRUE(last.complete);
  EXPECT_TRUE(last.annotations.empty());
  EXPECT_EQ(last.words.size(), 1u);
  for (std::uint64_t i = 0; i < 1000; ++i) inbox.put_people(said(i, kAda, {}, "again"));
  EXPECT_EQ(inbox.take().people->words.size(), 64u);
}

TEST(Wrapped, BreaksAtBlanksAndCutsOff) {
  EXPECT_EQ(wrapped("one two three", 7, 9), "one two\nthree");
  EXPECT_EQ(wrapped("  a \n b\t c ", 80, 9), "a b c") << "what is said is one line";
  EXPECT_EQ(wrapped("abcdefghij", 4, 9), "abcd\nefgh\nij");
  EXPECT_EQ(wrapped("x abcdefghij", 4, 9), "x\nabcd\nefgh\nij");
  EXPECT_EQ(wrapped("äöü äöü", 3, 9), "äöü\näöü") << "characters, not bytes";
  EXPECT_EQ(wrapped("a b c d", 1, 2), "a\nb ...");
  EXPECT_EQ(wrapped("", 10, 2), "");
}

TEST(CameraView, LooksAsSomebodyElse) {
  CameraView own;
  own.view_angle_rad = 0.7;
  Look look;
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

}  // namespace
}  // namespace osteon
