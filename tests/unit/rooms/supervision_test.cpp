// The restrictions of a person. They hold when the person joins again, for everything beside cutting, and everybody in
// the room is sent them.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "osteon/v1/people.pb.h"
#include "server/room/room.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/storage/journal_entries.hpp"
#include "server/storage/room_store.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/fake_session.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::strokes;
using test::test_block;
using test::tool_named;

constexpr std::uint32_t kAda = 1, kBen = 2, kCy = 3;
const Digest kSecret{{7}};

// An instructor's console, a trainee with a haptic client and a viewer, and a collaborator with a haptic client.
struct Held {
  Held() : room(test_block()) {
    ada = room.join(MemberKind::watcher, kAda, kSecret, Role::instructor);
    ben = room.join(MemberKind::surgeon, kBen, kSecret, Role::trainee);
    viewer = room.join(MemberKind::watcher, kBen, kSecret, Role::trainee);
    cy = room.join(MemberKind::surgeon, kCy, kSecret, Role::collaborator);
    for (const AuthorId author : {ben, cy}) cuts[author] = strokes(author, 100, static_cast<unsigned>(author.value));
  }
  Outcome cut(AuthorId author) {
    Cut next = cuts.at(author).at(room.decided(author));
    next.lease_epoch = room.lease_epoch(author);
    room.set_time(room.time() + 8ms);
    return room.submit(next).value();
  }
  void decide(AuthorId subject, const Restrictions& word) {
    const auto decided = room.supervise(ada, subject, word);
    ASSERT_TRUE(decided) << decided.error().message;
  }
  AuthorId again(std::uint32_t person, Role role) {
    const AuthorId author = room.join(MemberKind::surgeon, person, kSecret, role);
    cuts[author] = strokes(author, 100, static_cast<unsigned>(author.value));
    return author;
  }
  static ErrorCode refused(const Result<RoomEvent>& event) {
    EXPECT_FALSE(event);
    return event ? ErrorCode::internal : event.error().code;
  }

  Room room;
  AuthorId ada, ben, viewer, cy;
  std::map<AuthorId, std::vector<Cut>> cuts;
};

TEST(CarriedOver, AHandThatJoinsAnewIsHeldAsItWas) {
  Held all;
  const Restrictions word{.stopped = true, .force_limit = 300, .words = "wait"};
  all.decide(all.ben, word);
  const RoomSeq before = all.room.room_seq();
  const AuthorId again = all.again(kBen, Role::trainee);
  EXPECT_EQ(all.room.room_seq().value, before.value + 2) << "one entry for the join, one for the restrictions";
  EXPECT_EQ(all.room.people().supervised(again).supervision, word);
  EXPECT_EQ(all.room.people().supervised(again).by, all.ada) << "the instructor's decision still holds";
  EXPECT_EQ(all.cut(again).rejection, Rejection::frozen);
  // Neither another role nor a third start lifts the restrictions.
  const AuthorId third = all.again(kBen, Role::collaborator);
  EXPECT_EQ(all.cut(third).rejection, Rejection::frozen);
  all.decide(third, {});
  EXPECT_TRUE(all.cut(all.again(kBen, Role::trainee)).committed()) << "the newest join of the person decides";
}

TEST(CarriedOver, OnlyToTheSamePersonsHand) {
  Held all;
  all.decide(all.ben, {.stopped = true});
  const RoomSeq before = all.room.room_seq();
  (void)all.room.join(MemberKind::watcher, kBen, kSecret, Role::trainee);
  EXPECT_TRUE(all.cut(all.again(kCy, Role::collaborator)).committed());
  EXPECT_TRUE(all.cut(all.again(0, Role::trainee)).committed()) << "a person without a name is unknown";
  // An author of the server itself, which shows something, is not a person who comes back.
  EXPECT_EQ(all.room.people().supervised(all.room.join(MemberKind::surgeon, kBen, {}, Role::collaborator)).seq,
            RoomSeq{});
  EXPECT_EQ(all.room.room_seq().value, before.value + 6) << "four joins, two cuts and nothing else";
  // Unknown persons do not restrict each other either.
  all.decide(all.again(0, Role::trainee), {.stopped = true});
  EXPECT_TRUE(all.cut(all.again(0, Role::trainee)).committed());
}

// The haptic client was restarted while the decision was under way.
TEST(CarriedOver, ADecisionAboutAnOlderJoinHoldsForTheNewestToo) {
  Held all;
  const AuthorId again = all.again(kBen, Role::trainee);
  all.decide(all.ben, {.stopped = true});
  EXPECT_EQ(all.cut(again).rejection, Rejection::frozen);
  // But not if something else was decided about the newer join.
  all.decide(again, {.force_limit = 100});
  all.decide(all.ben, {});
  EXPECT_EQ(all.room.people().supervised(again).supervision, (Restrictions{.force_limit = 100}));
  // Without roles, several people may have one name. Then only the author that was named is meant.
  Room plain(test_block());
  const AuthorId one = plain.join(MemberKind::surgeon, kBen, kSecret),
                 other = plain.join(MemberKind::surgeon, kBen, kSecret);
  ASSERT_TRUE(plain.supervise(other, one, {.stopped = true}));
  EXPECT_TRUE(plain.people().supervised(other).supervision.may_cut());
}

TEST(CarriedOver, ItsLogEntriesReplay) {
  Held all;
  all.decide(all.ben, {.stopped = true, .zone = ZoneLimit{{1, 2, 3}, 4}});
  (void)all.again(kBen, Role::trainee);
  all.decide(all.ben, {});
  Room replayed(test_block());
  for (const LogEntry& entry : all.room.take_entries()) {
    const Result<LogEntry> read = entry_from_bytes(entry.seq, entry.at, to_bytes(entry));
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_TRUE(replayed.replay(*read));
  }
  EXPECT_EQ(replayed.room_hash(), all.room.room_hash());
}

// The journal of a server that did not carry restrictions over: its entries decide.
TEST(CarriedOver, NothingInAReplay) {
  Held all;
  all.decide(all.ben, {.stopped = true});
  Room replayed(test_block());
  for (const LogEntry& entry : all.room.take_entries()) ASSERT_TRUE(replayed.replay(entry));
  const AuthorId next{replayed.authors() + 1};
  ASSERT_TRUE(replayed.replay({RoomSeq{replayed.room_seq().value + 1}, replayed.time(), next,
                               JoinEntry{next, MemberKind::surgeon, kBen, kSecret, Role::trainee}}));
  EXPECT_EQ(replayed.people().supervised(next).seq, RoomSeq{});
  Cut cut = strokes(next, 1, 5).front();
  ASSERT_TRUE(replayed.replay({RoomSeq{replayed.room_seq().value + 1}, replayed.time(), next, CutEntry{cut}}));
}

SceneItem guide() {
  SceneItem item;
  item.tool = tool_named("guide-1").hash();
  item.pose_bone_item = pose_along({1, 2, 0}, {0, 0, -1});
  return item;
}

// Everything but cutting is refused, from the haptic client and from the person's viewer.
TEST(Held, TakesNothingBackAndPlacesNothing) {
  for (const bool taken : {false, true}) {
    Held all;
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(all.cut(all.ben).committed());
    ASSERT_TRUE(all.room.undo_last(all.ben, 1, {}));
    const auto placed = all.room.set_item(all.ben, guide());
    ASSERT_TRUE(placed) << placed.error().message;
    all.decide(all.ben, taken ? Restrictions{.taken_by = all.cy} : Restrictions{.stopped = true});
    const RoomSeq seq = all.room.room_seq();
    const Digest bone = all.room.field_hash();
    const RoomSeq first[] = {RoomSeq{5}};
    for (const AuthorId by : {all.ben, all.viewer}) {
      EXPECT_EQ(all.refused(all.room.redo_last(by, 1)), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.undo(by, first)), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.undo_last(by, 1, {})), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.undo_to(by, RoomSeq{4})), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.undo_since(by, 0s)), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.set_item(by, guide())), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.remove_item(by, placed->item)), ErrorCode::denied);
      EXPECT_EQ(all.refused(all.room.remove_body(by, BodyId{0})), ErrorCode::denied);
    }
    EXPECT_EQ(all.room.room_seq(), seq);
    EXPECT_EQ(all.room.field_hash(), bone);
    EXPECT_TRUE(all.room.say(all.ben, {}, "why?")) << "speaking is no work on the bone";
    all.decide(all.ben, {});
    EXPECT_TRUE(all.room.redo_last(all.ben, 1));
    EXPECT_TRUE(all.room.remove_item(all.ben, placed->item));
  }
}

// The redo would repeat what the instructor has forbidden since. It may be the person's own undo or somebody else's.
TEST(Held, DoesNothingAgainThatItMayNotCut) {
  Held all;
  ASSERT_TRUE(all.cut(all.ben).committed());  // The burr's cut.
  const RoomSeq drilled = all.cut(all.ben).room_seq;
  ASSERT_TRUE(all.room.undo_last(all.ben, 1, {}));
  const Digest bone = all.room.field_hash();
  all.decide(all.ben, {.tools = {tool_named("burr-round-5").hash()}});
  const Result<RoomEvent> denied = all.room.redo_last(all.ben, 1);
  ASSERT_EQ(all.refused(denied), ErrorCode::denied);
  EXPECT_NE(denied.error().message.find("event " + std::to_string(drilled.value)), std::string::npos)
      << denied.error().message;
  EXPECT_EQ(all.refused(all.room.redo_last(all.cy, 1)), ErrorCode::denied) << "a friend cannot redo it for them either";
  EXPECT_EQ(all.room.field_hash(), bone);
  all.decide(all.ben, {.tools = {tool_named("drill-3.2").hash()}});
  EXPECT_TRUE(all.room.redo_last(all.ben, 1));

  ASSERT_TRUE(all.room.undo_last(all.cy, 1, {}));
  const auto at = all.cuts.at(all.ben)[1].path.front().position;
  all.decide(all.cy, {.zone = ZoneLimit{at, 1}});
  EXPECT_EQ(all.refused(all.room.redo_last(all.cy, 1)), ErrorCode::denied)
      << "another author's cut is outside the person's zone";
  all.decide(all.cy, {.zone = ZoneLimit{at, 1 << 20}});
  EXPECT_TRUE(all.room.redo_last(all.cy, 1));

  // Whoever supervises them may redo anything.
  ASSERT_TRUE(all.room.undo_last(all.ada, 2, {}));
  all.decide(all.ben, {.stopped = true});
  EXPECT_TRUE(all.room.redo_last(all.ada, 1));
}

// Such a cut is in the history of no body.
TEST(Held, ACutThatMetNoBoneIsJudgedToo) {
  Held all;
  for (Cut& cut : all.cuts.at(all.ben))
    for (QuantisedPose& knot : cut.path) knot.position[2] += static_cast<std::int32_t>(20.0 / kQuantum_mm);
  ASSERT_TRUE(all.cut(all.ben).committed());
  ASSERT_EQ(all.room.field_hash(), Room(test_block()).field_hash());
  ASSERT_TRUE(all.room.undo_last(all.ben, 1, {}));
  all.decide(all.ben, {.tools = {tool_named("drill-3.2").hash()}});
  EXPECT_EQ(all.refused(all.room.redo_last(all.ben, 1)), ErrorCode::denied);
}

// A haptic client has no command for an undo. A person undoes at their viewer what their haptic client did, also before
// it was restarted.
TEST(TakeBackByPerson, AtAnyOfTheirPrograms) {
  Held all;
  const RoomSeq own = all.cut(all.ben).room_seq, others = all.cut(all.cy).room_seq;
  const AuthorId again = all.again(kBen, Role::trainee);
  const RoomSeq named[] = {own}, foreign[] = {others};
  EXPECT_EQ(all.refused(all.room.undo(all.viewer, foreign)), ErrorCode::denied);
  for (const AuthorId by : {all.viewer, again}) {
    const auto undone = all.room.undo_last(by, 1, {});
    ASSERT_TRUE(undone) << undone.error().message;
    EXPECT_EQ(undone->seqs, std::vector{own}) << "the newest cut of all is another person's";
    ASSERT_TRUE(all.room.redo_last(all.viewer, 1)) << "any program of the person may redo it";
    ASSERT_TRUE(all.room.undo(by, named));
    ASSERT_TRUE(all.room.redo_last(all.ben, 1));
  }
  ASSERT_TRUE(all.cut(again).committed());
  const auto older = all.room.undo_last(all.cy, 1, all.ben);
  ASSERT_TRUE(older) << older.error().message;
  EXPECT_EQ(older->seqs, std::vector{own}) << "the undo is of that author only";
  EXPECT_EQ(all.refused(all.room.redo_last(all.viewer, 1)), ErrorCode::denied) << "another person made that undo";
  // An author without a name may undo only what has its own number.
  const AuthorId nobody = all.again(0, Role::trainee),
                 stranger = all.room.join(MemberKind::watcher, 0, kSecret, Role::trainee);
  const RoomSeq cut[] = {all.cut(nobody).room_seq};
  EXPECT_EQ(all.refused(all.room.undo(stranger, cut)), ErrorCode::denied);
  EXPECT_TRUE(all.room.undo(nobody, cut));
}

// Keeps the sequence numbers that a session is sent.
class Placed final : public test::FakeSession {
 public:
  using FakeSession::FakeSession;
  void enqueue(const SessionMessage& message) override {
    seqs.push_back(message.seq.value);
    if (message.fast.kind == wire::SessionEntryKind::supervised) told.push_back(message.fast.supervision);
  }
  void hold(const wire::SessionEntry& supervised) override { held = supervised.supervision; }

  std::vector<std::uint64_t> seqs;
  std::vector<Restrictions> told;
  std::optional<Restrictions> held;
};

struct HeldRuntime {
  explicit HeldRuntime(RoomRuntime& of) : runtime(of) {}
  AuthorId join(MemberKind kind, const std::string& name, Role role) {
    std::optional<AuthorId> author;
    runtime.join(kind, name, kSecret, role, [&](const Result<AuthorId>& given) { author = given.value(); });
    runtime.tick(now += 8ms);
    return author.value();
  }
  void supervise(AuthorId by, AuthorId subject, const Restrictions& word) {
    runtime.queue_event([=](Room& room) { return room.supervise(by, subject, word); },
                        [](const Result<RoomEvent>& decided) { EXPECT_TRUE(decided); });
    runtime.tick(now += 8ms);
  }
  std::shared_ptr<Placed> session(AuthorId author) {
    auto subscriber = std::make_shared<Placed>(author);
    EXPECT_TRUE(runtime.open_session(subscriber, kSecret));
    subscribers.push_back(subscriber);  // The runtime uses it until it leaves.
    return subscriber;
  }
  RoomRuntime& runtime;
  std::chrono::nanoseconds now{};
  std::vector<std::shared_ptr<Placed>> subscribers;
};

constexpr RuntimeRates kDriven{.tick = 0ns, .mesh = 1s, .pieces = 0ns};

void expect_held(HeldRuntime& lesson) {
  const AuthorId ada = lesson.join(MemberKind::watcher, "Ada", Role::instructor);
  const AuthorId ben = lesson.join(MemberKind::surgeon, "Ben", Role::trainee);
  const AuthorId cy = lesson.join(MemberKind::surgeon, "Cy", Role::trainee);
  const auto session = lesson.session(cy);
  const Restrictions word{.stopped = true, .words = "wait"};
  lesson.supervise(ada, ben, word);
  const AuthorId again = lesson.join(MemberKind::surgeon, "Ben", Role::trainee);
  EXPECT_EQ(lesson.session(again)->held, word);
  EXPECT_EQ(lesson.session(lesson.join(MemberKind::surgeon, "Dora", Role::trainee))->held, std::nullopt);
  // The session receives every sequence number.
  ASSERT_FALSE(session->seqs.empty());
  EXPECT_EQ(session->seqs.back(), lesson.runtime.room_seq().value);
  for (std::size_t i = 1; i < session->seqs.size(); ++i) EXPECT_EQ(session->seqs[i], session->seqs[i - 1] + 1);
  // The presence shows the restrictions.
  PresenceCursor cursor;
  v1::WatchPeopleResponse news;
  ASSERT_TRUE(news.ParseFromString(*lesson.runtime.people().news(cursor, ada, {})));
  const auto person = std::ranges::find(news.people(), again.value, &v1::Person::author);
  ASSERT_NE(person, news.people().end());
  EXPECT_TRUE(person->supervision().stopped());
  // A decision that was under way while the haptic client was restarted.
  const AuthorId third = lesson.join(MemberKind::surgeon, "Ben", Role::trainee);
  const auto own = lesson.session(third);
  lesson.supervise(ada, again, {});
  ASSERT_EQ(own->told.size(), 1u);
  EXPECT_EQ(own->told.front(), Restrictions{});
  EXPECT_EQ(session->seqs.back(), lesson.runtime.room_seq().value);
}

TEST(CarriedOver, IsSentByARuntimeWithoutAJournal) {
  RoomRuntime runtime(Room(test_block()), kDriven, {});
  HeldRuntime lesson(runtime);
  expect_held(lesson);
  runtime.stop();
}

TEST(CarriedOver, IsSentByARuntimeWithAJournal) {
  const test::TempDir folder;
  PersistedRoom kept = RoomStore::open(folder / "room.journal", test_block(), RoomStore::Options{}).value();
  RoomRuntime runtime(std::move(kept.room), kDriven, {}, Detail::automatic, kept.store.get());
  HeldRuntime lesson(runtime);
  expect_held(lesson);
  runtime.stop();
  ASSERT_TRUE(kept.store->close());
}

}  // namespace
}  // namespace osteon
