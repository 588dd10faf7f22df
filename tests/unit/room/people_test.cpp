// What people decide about each other in a room, draw and say: who may do it, how it affects cuts, and that its log
// entries make the same room again.
#include "server/room/people.hpp"

#include <gtest/gtest.h>

#include <random>

#include "server/room/room.hpp"
#include "server/storage/journal_entries.hpp"
#include "tests/unit/room/cuts.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::strokes;
using test::test_block;
using test::tool_named;

// An instructor, a collaborator and two trainees, each with a haptic client, and an observer.
struct Class {
  Class() : room(test_block()) {
    instructor = room.join(MemberKind::surgeon, 1, {}, Role::instructor);
    collaborator = room.join(MemberKind::surgeon, 2, {}, Role::collaborator);
    trainee = room.join(MemberKind::surgeon, 3, {}, Role::trainee);
    other = room.join(MemberKind::surgeon, 4, {}, Role::trainee);
    observer = room.join(MemberKind::watcher, 5, {}, Role::observer);
    for (const AuthorId author : {instructor, collaborator, trainee, other})
      cuts[author] = strokes(author, 100, static_cast<unsigned>(author.value));
  }
  // The author's next stroke, under the current lease.
  Outcome cut(AuthorId author) { return cut(author, room.lease_epoch(author)); }
  Outcome cut(AuthorId author, std::uint64_t epoch) {
    Cut next = cuts.at(author).at(room.decided(author));
    next.lease_epoch = epoch;
    room.set_time(room.time() + 8ms);
    return room.submit(next).value();
  }
  ErrorCode refused(const Result<RoomEvent>& event) {
    EXPECT_FALSE(event);
    return event ? ErrorCode::internal : event.error().code;
  }

  Room room;
  AuthorId instructor, collaborator, trainee, other, observer;
  std::map<AuthorId, std::vector<Cut>> cuts;
};

TEST(Supervise, AFrozenHandCutsNothingUntilItIsFreed) {
  Class all;
  ASSERT_TRUE(all.cut(all.trainee).committed());
  const std::uint64_t before = all.room.lease_epoch(all.trainee), others = all.room.lease_epoch(all.other);
  const Digest bone = all.room.field_hash();
  const auto frozen = all.room.supervise(all.instructor, all.trainee, {.stopped = true, .words = "look here"});
  ASSERT_TRUE(frozen) << frozen.error().message;
  EXPECT_EQ(frozen->kind, EventKind::supervise);
  EXPECT_GT(all.room.lease_epoch(all.trainee), before);
  EXPECT_EQ(frozen->lease_epoch, all.room.lease_epoch(all.trainee));
  EXPECT_EQ(all.room.lease_epoch(all.other), others) << "the leases of others stay";
  EXPECT_EQ(all.room.people().supervised(all.trainee).seq, frozen->room_seq);
  EXPECT_EQ(all.room.people().supervised(all.trainee).supervision.words, "look here");
  EXPECT_EQ(all.room.people().supervised(all.trainee).by, all.instructor);

  EXPECT_EQ(all.cut(all.trainee, before).rejection, Rejection::lease) << "a cut under way is rejected for its lease";
  EXPECT_EQ(all.cut(all.trainee).rejection, Rejection::frozen);
  EXPECT_EQ(all.room.field_hash(), bone);
  EXPECT_TRUE(all.cut(all.other).committed());

  const std::uint64_t while_frozen = all.room.lease_epoch(all.trainee);
  ASSERT_TRUE(all.room.supervise(all.instructor, all.trainee, {}));
  EXPECT_GT(all.room.lease_epoch(all.trainee), while_frozen);
  EXPECT_EQ(all.cut(all.trainee, while_frozen).rejection, Rejection::lease)
      << "so is a cut that was queued during the stop";
  EXPECT_TRUE(all.cut(all.trainee).committed());
}

TEST(Supervise, ATakenToolIsNobodysUntilItIsGivenBack) {
  Class all;
  ASSERT_TRUE(all.room.supervise(all.instructor, all.trainee, {.taken_by = all.instructor}));
  EXPECT_EQ(all.cut(all.trainee).rejection, Rejection::taken);
  EXPECT_TRUE(all.cut(all.instructor).committed());
  ASSERT_TRUE(all.room.supervise(all.instructor, all.trainee, {}));
  EXPECT_TRUE(all.cut(all.trainee).committed());
}

// A restriction of tools is no stop. The lease stays, so that cuts under way that obey the restriction are taken.
TEST(Supervise, AToolThatIsNotAmongThoseLeftIsRejected) {
  Class all;
  const std::uint64_t lease = all.room.lease_epoch(all.trainee);
  ASSERT_TRUE(all.room.supervise(all.instructor, all.trainee, {.tools = {tool_named("burr-round-5").hash()}}));
  EXPECT_EQ(all.room.lease_epoch(all.trainee), lease);
  EXPECT_TRUE(all.cut(all.trainee, lease).committed()) << "the first stroke is the burr's";
  EXPECT_EQ(all.cut(all.trainee).rejection, Rejection::forbidden_tool) << "the second stroke is the drill's";
  EXPECT_TRUE(all.cut(all.trainee).committed());
}

TEST(Supervise, ACutThatLeavesItsZoneIsRejected) {
  Class all;
  const Cut next = all.cuts.at(all.trainee).front();
  const auto from = next.path.front().position, to = next.path.back().position;
  double way = 0;
  for (std::size_t i = 0; i < 3; ++i) way += std::pow(to[i] - from[i], 2);
  way = std::sqrt(way);
  ASSERT_TRUE(
      all.room.supervise(all.instructor, all.trainee, {.zone = ZoneLimit{from, static_cast<std::int32_t>(way) - 1}}));
  EXPECT_EQ(all.cut(all.trainee).rejection, Rejection::zone) << "the end of the cut is outside";
  const auto second = all.cuts.at(all.trainee)[1].path;
  ASSERT_TRUE(all.room.supervise(all.instructor, all.trainee, {.zone = ZoneLimit{second.front().position, 1 << 20}}));
  EXPECT_TRUE(all.cut(all.trainee).committed());
}

TEST(Supervise, OnlyAnInstructorDoesAndOnlyAboutAHand) {
  Class all;
  for (const AuthorId by : {all.collaborator, all.trainee, all.observer})
    EXPECT_EQ(all.refused(all.room.supervise(by, all.other, {.stopped = true})), ErrorCode::denied);
  EXPECT_EQ(all.refused(all.room.supervise(AuthorId{99}, all.other, {})), ErrorCode::invalid_input);
  EXPECT_EQ(all.refused(all.room.supervise(all.instructor, all.observer, {.stopped = true})), ErrorCode::not_found);
  EXPECT_EQ(all.refused(all.room.supervise(all.instructor, AuthorId{99}, {})), ErrorCode::not_found);
  const auto bad = [&](Restrictions supervision) {
    return all.refused(all.room.supervise(all.instructor, all.trainee, supervision));
  };
  EXPECT_EQ(bad({.taken_by = AuthorId{99}}), ErrorCode::invalid_input) << "that author has not joined";
  EXPECT_EQ(bad({.guide = all.trainee}), ErrorCode::invalid_input) << "a tool cannot be guided along itself";
  EXPECT_EQ(bad({.tools = {Digest{{1}}}}), ErrorCode::invalid_input) << "the tool is unknown";
  EXPECT_EQ(bad({.guide_share = 1001}), ErrorCode::invalid_input);
  EXPECT_EQ(bad({.force_limit = -1}), ErrorCode::invalid_input);
  EXPECT_EQ(all.room.room_seq().value, 5u) << "no refused decision has a sequence number";
  // In a room whose server knows nobody by name.
  Room plain(test_block());
  const AuthorId one = plain.join(MemberKind::watcher), hand = plain.join(MemberKind::surgeon);
  EXPECT_TRUE(plain.supervise(one, hand, {.stopped = true}));
}

TEST(TakeBack, ATraineeTakesBackOnlyTheirOwn) {
  Class all;
  const RoomSeq own = all.cut(all.trainee).room_seq, others = all.cut(all.other).room_seq;
  const RoomSeq by_other[] = {others};
  EXPECT_EQ(all.refused(all.room.undo(all.trainee, by_other)), ErrorCode::denied);
  EXPECT_EQ(all.refused(all.room.undo_last(all.trainee, 1, all.other)), ErrorCode::denied);
  EXPECT_EQ(all.refused(all.room.undo_to(all.trainee, RoomSeq{own.value - 1})), ErrorCode::denied);
  const auto undone = all.room.undo_last(all.trainee, 1, {});
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs, std::vector{own}) << "the newest cut of all is another author's";
  EXPECT_EQ(all.refused(all.room.redo_last(all.other, 1)), ErrorCode::denied) << "another author made that undo";
  EXPECT_TRUE(all.room.redo_last(all.trainee, 1));
  const auto any = all.room.undo_last(all.collaborator, 1, {});
  ASSERT_TRUE(any);
  EXPECT_EQ(any->seqs, std::vector{others});
}

// However the undo is requested, and whatever they have done themselves.
TEST(TakeBack, ACollaboratorTakesBackAnyonesButNeverAllThatTheOthersDid) {
  Class all;
  const RoomSeq first = all.cut(all.trainee).room_seq;
  const RoomSeq own = all.cut(all.collaborator).room_seq;
  const RoomSeq second = all.cut(all.other).room_seq;
  const Digest bone = all.room.field_hash();
  const RoomSeq both[] = {first, second}, one[] = {second}, all_three[] = {first, own, second};
  const AuthorId by = all.collaborator;
  const auto refused = [&](const Result<RoomEvent>& undo) {
    if (all.refused(undo) != ErrorCode::denied) return ADD_FAILURE() << "the undo was not denied";
    EXPECT_NE(undo.error().message.find("only an instructor"), std::string::npos) << undo.error().message;
  };
  refused(all.room.undo_last(by, 1'000'000, {}));
  refused(all.room.undo_last(by, 3, {}));
  refused(all.room.undo_since(by, 0s));
  refused(all.room.undo_to(by, RoomSeq{}));
  refused(all.room.undo_to(by, RoomSeq{first.value - 1}));
  refused(all.room.undo(by, both));
  refused(all.room.undo(by, all_three));
  EXPECT_EQ(all.room.field_hash(), bone);
  // After the undo of one cut, the other is everything that is left of others.
  ASSERT_TRUE(all.room.undo(by, one));
  refused(all.room.undo_last(by, 1, all.trainee));
  refused(all.room.undo_last(by, 1'000'000, {}));
  // They may undo their own work at any count.
  const auto undone = all.room.undo_last(by, 1'000'000, by);
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs, std::vector{own});
  ASSERT_TRUE(all.room.redo_last(by, 2)) << "a redo of what a collaborator undid, also of others' cuts";
  EXPECT_EQ(all.room.field_hash(), bone);

  // An instructor undoes everything and redoes it.
  ASSERT_TRUE(all.room.undo_last(all.instructor, 1'000'000, {}));
  EXPECT_EQ(all.room.field_hash(), Room(test_block()).field_hash());
  refused(all.room.redo_last(by, 1));
  refused(all.room.redo_last(by, 1'000'000));
  ASSERT_TRUE(all.room.redo_last(all.instructor, 1));
  EXPECT_EQ(all.room.field_hash(), bone);
  // Whoever may undo anyone's work may redo a part of it.
  ASSERT_TRUE(all.room.undo_last(all.instructor, 1, {}));
  EXPECT_TRUE(all.room.redo_last(by, 1));
}

// The person decides, not the program: a room in which only one collaborator has worked is wholly theirs to undo.
TEST(TakeBack, ACollaboratorTakesBackAllOfTheirOwnAlsoOfAnEarlierJoin) {
  Class all;
  ASSERT_TRUE(all.cut(all.collaborator).committed());
  const AuthorId anew = all.room.join(MemberKind::surgeon, 2, {}, Role::collaborator);
  const auto undone = all.room.undo_last(anew, 100, {});
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs.size(), 1u);
  EXPECT_TRUE(all.room.redo_last(anew, 100));
}

TEST(TakeBack, WhatWasDoneSinceATime) {
  Class all;
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(all.cut(all.trainee).committed());
  all.room.set_time(all.room.time() + 10s);
  const Digest then = all.room.field_hash();
  const auto since = all.room.time();
  std::vector<RoomSeq> later;
  for (int i = 0; i < 4; ++i) later.push_back(all.cut(i % 2 ? all.trainee : all.other).room_seq);
  const auto undone = all.room.undo_since(all.instructor, since);
  ASSERT_TRUE(undone) << undone.error().message;
  EXPECT_EQ(undone->seqs, later);
  EXPECT_EQ(all.room.field_hash(), then);
  EXPECT_EQ(all.refused(all.room.undo_since(all.instructor, since)), ErrorCode::unavailable);
  const auto all_of_it = all.room.undo_since(all.instructor, 0s);
  ASSERT_TRUE(all_of_it);
  EXPECT_EQ(all_of_it->seqs.size(), 3u);
  EXPECT_EQ(all.room.field_hash(), Room(test_block()).field_hash());
  EXPECT_EQ(all.refused(all.room.undo_since(all.instructor, all.room.time() + 1h)), ErrorCode::unavailable);
}

Annotation line(std::size_t points) {
  return {.kind = AnnotationKind::line, .points = std::vector<std::array<std::int32_t, 3>>(points, {1, 2, 3})};
}

TEST(Annotations, AreTheirAuthorsAndTheInstructorsToWipeOff) {
  Class all;
  const auto first = all.room.annotate(all.trainee, line(2));
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_TRUE(all.room.people().annotations().contains(1));
  EXPECT_EQ(all.room.people().annotations().at(1).author, all.trainee) << "the room sets the author";
  Annotation again = line(5);
  again.id = 1;
  EXPECT_EQ(all.refused(all.room.annotate(all.other, again)), ErrorCode::denied);
  ASSERT_TRUE(all.room.annotate(all.trainee, again));
  EXPECT_EQ(all.room.people().annotations().at(1).points.size(), 5u);
  again.id = 7;
  EXPECT_EQ(all.refused(all.room.annotate(all.trainee, again)), ErrorCode::not_found);
  EXPECT_EQ(all.refused(all.room.wipe_off(all.other, 1)), ErrorCode::denied);
  EXPECT_EQ(all.refused(all.room.wipe_off(all.trainee, 2)), ErrorCode::not_found);
  ASSERT_TRUE(all.room.wipe_off(all.instructor, 1));
  EXPECT_TRUE(all.room.people().annotations().empty());
  ASSERT_TRUE(all.room.annotate(all.trainee, line(2)));
  EXPECT_TRUE(all.room.people().annotations().contains(2)) << "a number is used only once";

  // An author has one pointer.
  Annotation pointer{.points = {{1, 2, 3}}};
  ASSERT_TRUE(all.room.annotate(all.instructor, pointer));
  pointer.points = {{4, 5, 6}};
  ASSERT_TRUE(all.room.annotate(all.instructor, pointer));
  ASSERT_TRUE(all.room.annotate(all.trainee, pointer));
  EXPECT_EQ(all.room.people().annotations().size(), 3u);
  EXPECT_EQ(all.room.people().annotations().at(3).points[0][0], 4);
}

TEST(Annotations, AreBounded) {
  Class all;
  const auto bad = [&](const Annotation& drawn) { return all.refused(all.room.annotate(all.instructor, drawn)); };
  EXPECT_EQ(bad(line(1)), ErrorCode::invalid_input);
  EXPECT_EQ(bad(line(kMostAnnotationPoints + 1)), ErrorCode::invalid_input);
  EXPECT_EQ(bad({.points = {}}), ErrorCode::invalid_input);
  EXPECT_EQ(bad({.points = {{1, 2, 3}, {1, 2, 3}}}), ErrorCode::invalid_input);
  EXPECT_EQ(bad({.kind = AnnotationKind::label, .points = {{1, 2, 3}}}), ErrorCode::invalid_input)
      << "a label needs text";
  EXPECT_EQ(bad({.points = {{1, 2, 3}}, .words = std::string(kMostAnnotationWords + 1, 'x')}),
            ErrorCode::invalid_input);
  EXPECT_EQ(bad({.points = {{1, 2, 3}}, .colour = 0x1000000}), ErrorCode::invalid_input);
  EXPECT_EQ(bad({.kind = static_cast<AnnotationKind>(9), .points = {{1, 2, 3}}}), ErrorCode::invalid_input);
  for (std::size_t i = 0; i < kMostAnnotations; ++i)
    ASSERT_TRUE(all.room.annotate(all.trainee, line(kMostAnnotationPoints)));
  EXPECT_EQ(bad(line(2)), ErrorCode::invalid_input);
  ASSERT_TRUE(all.room.wipe_off(all.trainee, 17));
  EXPECT_TRUE(all.room.annotate(all.instructor, line(2)));
}

TEST(Words, HaveAPlaceAndALength) {
  Class all;
  const auto said = all.room.say(all.instructor, all.trainee, "slower");
  ASSERT_TRUE(said);
  EXPECT_EQ(said->kind, EventKind::words);
  EXPECT_EQ(std::get<WordsEntry>(said->people).words, "slower");
  EXPECT_TRUE(all.room.say(all.trainee, {}, std::string(kMostWordsBytes, 'x')));
  EXPECT_EQ(all.refused(all.room.say(all.trainee, {}, std::string(kMostWordsBytes + 1, 'x'))),
            ErrorCode::invalid_input);
  EXPECT_EQ(all.refused(all.room.say(all.trainee, {}, "")), ErrorCode::invalid_input);
  EXPECT_EQ(all.refused(all.room.say(all.trainee, AuthorId{99}, "who?")), ErrorCode::not_found);
  EXPECT_EQ(all.refused(all.room.say(AuthorId{99}, {}, "me")), ErrorCode::invalid_input);
}

LogEntry through_bytes(const LogEntry& entry) {
  Result<LogEntry> read = entry_from_bytes(entry.seq, entry.at, to_bytes(entry));
  EXPECT_TRUE(read) << read.error().message;
  return std::move(*read);
}

// Whatever the people do, a replay of the log entries, through the journal's bytes, makes the same room again.
TEST(PeopleEntries, ReplayedMakeTheSameRoom) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Class all;
    Room replayed(test_block());
    std::mt19937 random(seed);
    const AuthorId authors[] = {all.instructor, all.collaborator, all.trainee, all.other};
    std::set<std::size_t> kinds;
    for (int i = 0; i < 50; ++i) {
      const AuthorId by = authors[random() % 4], subject = authors[1 + random() % 3];
      all.room.set_time(all.room.time() + 8ms);
      switch (random() % 8) {
        case 0: {
          Restrictions word{
              .stopped = random() % 3 == 0, .force_limit = static_cast<int>(random() % 900), .words = "words"};
          if (random() % 3 == 0) word.taken_by = all.instructor;
          if (random() % 3 == 0) word.guide = all.instructor, word.guide_share = 500;
          if (random() % 3 == 0) word.zone = ZoneLimit{{-1, 2, 3}, 1 << 13};
          if (random() % 3 == 0) word.tools = {tool_named("drill-3.2").hash()};
          (void)all.room.supervise(all.instructor, subject, word);
          break;
        }
        case 1:
          (void)all.room.annotate(by, random() % 2 ? line(2 + random() % 5)
                                                   : Annotation{.points = {{-7, 8, 9}}, .words = "here", .colour = 1});
          break;
        case 2:
          (void)all.room.wipe_off(by, static_cast<std::uint32_t>(1 + random() % 6));
          break;
        case 3:
          (void)all.room.say(by, random() % 2 ? subject : AuthorId{}, "so");
          break;
        case 4:
          (void)all.room.undo_last(by, 1, {});
          break;
        default:
          (void)all.cut(by);
      }
      for (const LogEntry& entry : all.room.take_entries()) {
        kinds.insert(entry.what.index());
        const Result<void> followed = replayed.replay(through_bytes(entry));
        ASSERT_TRUE(followed) << followed.error().message;
        ASSERT_EQ(to_bytes(through_bytes(entry)), to_bytes(entry));
      }
      ASSERT_EQ(replayed.room_hash(), all.room.room_hash()) << "seed " << seed << " event " << i;
    }
    EXPECT_GE(kinds.size(), 6u);
    for (const AuthorId author : authors) {
      EXPECT_EQ(replayed.people().role(author), all.room.people().role(author));
      EXPECT_EQ(replayed.people().supervised(author).supervision, all.room.people().supervised(author).supervision);
    }
    EXPECT_EQ(replayed.people().annotations(), all.room.people().annotations());
  }
}

TEST(PeopleEntries, EveryOneOfThemIsInTheHash) {
  Class plain, all;
  EXPECT_EQ(plain.room.room_hash(), all.room.room_hash());
  std::set<std::string> hashes{to_hex(all.room.room_hash())};
  const auto changed = [&](const char* what) {
    EXPECT_TRUE(hashes.insert(to_hex(all.room.room_hash())).second) << what;
  };
  const auto decide = [&](const char* what, const Restrictions& word) {
    // At the same sequence number each time: instead of the others, not after them.
    all = Class();
    EXPECT_TRUE(all.room.supervise(all.instructor, all.trainee, word)) << what;
    changed(what);
  };
  decide("nothing", {});
  decide("stopped", {.stopped = true});
  decide("taken", {.taken_by = all.instructor});
  decide("guide", {.guide = all.instructor});
  decide("share", {.guide = all.instructor, .guide_share = 1});
  decide("force", {.force_limit = 1});
  decide("zone", {.zone = ZoneLimit{{1, 2, 3}, 4}});
  decide("another zone", {.zone = ZoneLimit{{1, 2, 4}, 4}});
  decide("tools", {.tools = {tool_named("drill-3.2").hash()}});
  decide("words", {.words = "a"});
  all = Class();
  ASSERT_TRUE(all.room.annotate(all.trainee, line(2)));
  changed("a line");
}

// An entry that no room would have decided is refused.
TEST(PeopleEntries, ThatCannotBeAreRefused) {
  Class all;
  const auto refused = [&](decltype(LogEntry::what) what) {
    const LogEntry entry{RoomSeq{all.room.room_seq().value + 1}, all.room.time(), all.instructor, std::move(what)};
    EXPECT_FALSE(all.room.replay(entry));
  };
  refused(SuperviseEntry{all.observer, {}});
  refused(SuperviseEntry{AuthorId{99}, {}});
  refused(SuperviseEntry{all.trainee, {.taken_by = AuthorId{99}}});
  refused(SuperviseEntry{all.trainee, {.tools = {Digest{{1}}}}});
  refused(SuperviseEntry{all.trainee, {.guide_share = 5000}});
  refused(AnnotationEntry{1, std::nullopt});
  refused(AnnotationEntry{2, line(2)});
  Annotation one = line(1);
  one.id = 1;
  one.author = all.trainee;
  refused(AnnotationEntry{1, one});
  refused(WordsEntry{{}, ""});
  refused(WordsEntry{AuthorId{99}, "x"});
  EXPECT_EQ(all.room.room_seq().value, 5u);
}

}  // namespace
}  // namespace osteon
