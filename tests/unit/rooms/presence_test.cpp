// What a runtime sends about its people: who receives a message, which restrictions hold for a client that joins, how
// far it has acknowledged, and what readers receive who may not read everything.
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <map>
#include <mutex>
#include <thread>

#include "common/wire/convert.hpp"
#include "osteon/v1/people.pb.h"
#include "server/publish/presence.hpp"
#include "server/rooms/room_runtime.hpp"
#include "server/storage/room_store.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/unit/room/cuts.hpp"
#include "tests/unit/rooms/fake_session.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;

// Keeps what a session is sent.
class ReceivedSession final : public test::FakeSession {
 public:
  using FakeSession::FakeSession;
  void begin(SessionStart start) override {
    for (const SessionMessage& message : start.before) take(message.bytes, before_);
    complete_ = parsed(start.complete);
  }
  void enqueue(const SessionMessage& message) override {
    const std::lock_guard lock(mutex_);
    take(message.bytes, entries_);
    seqs_.push_back(message.seq);
    fast_.push_back(message.fast);
  }
  void hold(const wire::SessionEntry& supervised) override { held_ = supervised; }
  bool show_partners(const std::vector<CuttingState>& states) override {
    const std::lock_guard lock(mutex_);
    partners_ = states;
    return false;
  }

  std::vector<v1::SessionResponse> before_;
  v1::SessionResponse complete_;
  std::optional<wire::SessionEntry> held_;
  std::vector<v1::SessionResponse> entries() const {
    const std::lock_guard lock(mutex_);
    return entries_;
  }
  std::vector<wire::SessionEntry> fast() const {
    const std::lock_guard lock(mutex_);
    return fast_;
  }
  std::vector<RoomSeq> seqs() const {
    const std::lock_guard lock(mutex_);
    return seqs_;
  }
  std::vector<CuttingState> partners() const {
    const std::lock_guard lock(mutex_);
    return partners_;
  }

 private:
  static v1::SessionResponse parsed(const Bytes& bytes) {
    v1::SessionResponse response;
    EXPECT_TRUE(response.ParseFromString(*bytes));
    return response;
  }
  static void take(const Bytes& bytes, std::vector<v1::SessionResponse>& into) { into.push_back(parsed(bytes)); }

  mutable std::mutex mutex_;
  std::vector<v1::SessionResponse> entries_;
  std::vector<wire::SessionEntry> fast_;
  std::vector<RoomSeq> seqs_;
  std::vector<CuttingState> partners_;
};

// A driven runtime: every request is decided at once.
struct Lesson {
  Lesson() : runtime(Room(test::test_block()), {.tick = 0ns, .mesh = 1s, .pieces = 0ns}, {}) {
    instructor = join("Ada", Role::instructor);
    trainee = join("Ben", Role::trainee);
    other = join("Cy", Role::trainee);
    for (const AuthorId author : {trainee, other}) {
      sessions[author] = std::make_shared<ReceivedSession>(author);
      EXPECT_TRUE(runtime.open_session(sessions[author]));
    }
  }
  AuthorId join(const std::string& name, Role role) {
    AuthorId author;
    runtime.join(MemberKind::surgeon, name, {}, role, [&](const Result<AuthorId>& given) { author = given.value(); });
    tick();
    return author;
  }
  void tick() { runtime.tick(now += 8ms); }
  Result<RoomEvent> ask(std::function<Result<RoomEvent>(Room&)> what) {
    std::optional<Result<RoomEvent>> answer;
    runtime.queue_event(std::move(what), [&](const Result<RoomEvent>& decided) { answer = decided; });
    tick();
    return answer.value();
  }
  Result<RoomEvent> supervise(AuthorId subject, const Restrictions& word) {
    return ask([&](Room& room) { return room.supervise(instructor, subject, word); });
  }
  v1::WatchPeopleResponse news(PresenceCursor& cursor, AuthorId reader, const PeopleRights& rights = {}) {
    v1::WatchPeopleResponse response;
    const Bytes bytes = runtime.people().news(cursor, reader, rights);
    EXPECT_TRUE(!bytes || response.ParseFromString(*bytes));
    return response;
  }
  static const v1::Person* person(const v1::WatchPeopleResponse& news, AuthorId author) {
    const auto found = std::ranges::find(news.people(), author.value, &v1::Person::author);
    return found == news.people().end() ? nullptr : &*found;
  }

  std::chrono::nanoseconds now{};
  std::map<AuthorId, std::shared_ptr<ReceivedSession>> sessions;  // outlive the runtime, whose threads use them
  RoomRuntime runtime;
  AuthorId instructor, trainee, other;
};

// The role of the join decides what somebody may undo. Who returns with another role has to join again.
TEST(PeopleHost, AnAuthorOfAnotherRoleDoesNotComeBack) {
  Lesson lesson;
  const Digest secret{{7}};
  AuthorId author;
  lesson.runtime.join(MemberKind::surgeon, "Eve", secret, Role::instructor,
                      [&](const Result<AuthorId>& given) { author = given.value(); });
  lesson.tick();
  EXPECT_TRUE(lesson.runtime.resume(author, secret, {}, Role::instructor));
  EXPECT_TRUE(lesson.runtime.resume(author, secret, {}));  // Over plain text nobody has a role.
  const Result<void> demoted = lesson.runtime.resume(author, secret, {}, Role::trainee);
  ASSERT_FALSE(demoted);
  EXPECT_EQ(demoted.error().code, ErrorCode::denied);
}

TEST(PeopleHost, ADecisionGoesToItsAuthorAndLeavesNoGapForOthers) {
  Lesson lesson;
  const auto frozen = lesson.supervise(lesson.trainee, {.stopped = true, .words = "stop"});
  ASSERT_TRUE(frozen);
  const auto own = lesson.sessions[lesson.trainee]->entries(), others = lesson.sessions[lesson.other]->entries();
  ASSERT_EQ(own.size(), 1u);
  ASSERT_EQ(others.size(), 1u);
  ASSERT_TRUE(own.back().has_supervised());
  EXPECT_EQ(own.back().supervised().room_seq(), frozen->room_seq.value);
  EXPECT_TRUE(own.back().supervised().supervision().stopped());
  EXPECT_EQ(own.back().supervised().lease_epoch(), lesson.runtime.lease_epoch(lesson.trainee));
  EXPECT_EQ(own.back().supervised().decided_by(), lesson.instructor.value);
  EXPECT_EQ(own.back().supervised().decided_by_name(), "Ada");
  const wire::SessionEntry fast = lesson.sessions[lesson.trainee]->fast().back();
  EXPECT_EQ(fast.kind, wire::SessionEntryKind::supervised);
  EXPECT_TRUE(fast.supervision.stopped);
  EXPECT_EQ(fast.lease_epoch, lesson.runtime.lease_epoch(lesson.trainee));
  EXPECT_EQ(fast.by, (Decider{lesson.instructor, "Ada"})) << "the same as in the stream";
  ASSERT_TRUE(others.back().has_noted());
  EXPECT_EQ(others.back().noted().room_seq(), frozen->room_seq.value);

  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.say(lesson.instructor, lesson.other, "go on"); }));
  EXPECT_TRUE(lesson.sessions[lesson.trainee]->entries().back().has_noted());
  ASSERT_TRUE(lesson.sessions[lesson.other]->entries().back().has_chat());
  EXPECT_EQ(lesson.sessions[lesson.other]->entries().back().chat().words(), "go on");
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.say(lesson.instructor, {}, "all"); }));
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.annotate(lesson.instructor, {.points = {{1, 2, 3}}}); }));
  for (const auto& [author, session] : lesson.sessions) {
    const auto entries = session->entries();
    EXPECT_EQ(entries[entries.size() - 2].chat().words(), "all");
    EXPECT_TRUE(entries.back().has_noted()) << "the entry is an annotation";
    const auto seqs = session->seqs();
    for (std::size_t i = 1; i < seqs.size(); ++i) EXPECT_EQ(seqs[i].value, seqs[i - 1].value + 1) << "no gap";
  }
}

TEST(PeopleHost, WhoJoinsIsSentFirstWhatHolds) {
  Lesson lesson;
  const AuthorId away = lesson.join("Di", Role::trainee);
  ASSERT_TRUE(lesson.supervise(away, {.taken_by = lesson.instructor}));
  const auto comes = [&] {
    const auto session = std::make_shared<ReceivedSession>(away);
    EXPECT_TRUE(lesson.runtime.open_session(session));
    return session;
  };
  const auto first = comes();
  const auto told = std::ranges::find_if(first->before_, [](const auto& entry) { return entry.has_supervised(); });
  ASSERT_NE(told, first->before_.end());
  EXPECT_EQ(told->supervised().room_seq(), 0u);
  EXPECT_EQ(told->supervised().supervision().taken_by(), lesson.instructor.value);
  EXPECT_EQ(told->supervised().lease_epoch(), first->complete_.complete().lease_epoch());
  EXPECT_EQ(told->supervised().decided_by(), lesson.instructor.value);
  EXPECT_EQ(told->supervised().decided_by_name(), "Ada");
  ASSERT_TRUE(first->held_) << "its link is sent them too, for the flag";
  EXPECT_FALSE(first->held_->supervision.may_cut());
  lesson.runtime.leave(*first);

  // The restrictions were lifted while it was away. It must not go on obeying them.
  ASSERT_TRUE(lesson.supervise(away, {}));
  const auto second = comes();
  ASSERT_TRUE(second->held_);
  EXPECT_TRUE(second->held_->supervision.may_cut());
  EXPECT_EQ(std::ranges::count_if(lesson.sessions[lesson.trainee]->before_,
                                  [](const auto& entry) { return entry.has_supervised(); }),
            0)
      << "nothing was decided about this author";
}

TEST(PeopleHost, WhatIsDecidedIsPendingUntilItIsAcknowledged) {
  Lesson lesson;
  PresenceCursor cursor;
  const v1::WatchPeopleResponse first = lesson.news(cursor, lesson.instructor);
  EXPECT_TRUE(first.complete());
  ASSERT_EQ(first.people_size(), 3);
  const v1::Person* ben = Lesson::person(first, lesson.trainee);
  EXPECT_EQ(ben->name(), "Ben");
  EXPECT_EQ(ben->role(), v1::ROLE_TRAINEE);
  EXPECT_TRUE(ben->here() && ben->hand());
  EXPECT_FALSE(ben->has_supervision());
  EXPECT_FALSE(Lesson::person(first, lesson.instructor)->here()) << "it has joined, but no stream is open";

  const RoomSeq seq = lesson.supervise(lesson.trainee, {.stopped = true})->room_seq;
  v1::WatchPeopleResponse next = lesson.news(cursor, lesson.instructor);
  EXPECT_FALSE(next.complete());
  ASSERT_EQ(next.people_size(), 1) << "nobody else has changed";
  EXPECT_EQ(next.people(0).decided_room_seq(), seq.value);
  EXPECT_EQ(next.people(0).decided_by(), lesson.instructor.value);
  EXPECT_LT(next.people(0).acknowledged_room_seq(), seq.value);
  EXPECT_TRUE(next.people(0).supervision().stopped());
  EXPECT_EQ(lesson.runtime.people().news(cursor, lesson.instructor, {}), nullptr) << "everything was sent";

  lesson.runtime.people().acknowledged(lesson.trainee, seq);
  lesson.runtime.people().acknowledged(lesson.trainee, RoomSeq{1});
  next = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(next.people_size(), 1);
  EXPECT_EQ(next.people(0).acknowledged_room_seq(), seq.value) << "the acknowledgement for later entries came earlier";

  lesson.runtime.leave(*lesson.sessions[lesson.trainee]);
  next = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(next.people_size(), 1);
  EXPECT_FALSE(next.people(0).here());
  EXPECT_TRUE(next.people(0).hand());
}

TEST(PeopleHost, AReaderIsSentWhatConcernsThem) {
  Lesson lesson;
  ASSERT_TRUE(lesson.supervise(lesson.trainee, {.stopped = true}));
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.say(lesson.instructor, lesson.other, "secret"); }));
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.say(lesson.instructor, {}, "open"); }));
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.say(lesson.other, lesson.instructor, "why?"); }));
  const PeopleRights trainees{.others_supervision = false, .others_words = false};
  const auto told = [&](AuthorId reader, const PeopleRights& rights) {
    PresenceCursor cursor;
    return lesson.news(cursor, reader, rights);
  };
  EXPECT_FALSE(Lesson::person(told(lesson.other, trainees), lesson.trainee)->has_supervision());
  EXPECT_TRUE(Lesson::person(told(lesson.trainee, trainees), lesson.trainee)->has_supervision())
      << "their own restrictions";
  EXPECT_TRUE(Lesson::person(told(lesson.instructor, {}), lesson.trainee)->has_supervision());
  EXPECT_EQ(told(lesson.trainee, trainees).words_size(), 1);
  // A viewer beside a haptic client belongs to the same person, whoever else may watch.
  const auto window = [&](const std::string& name) {
    AuthorId author;
    lesson.runtime.join(MemberKind::watcher, name, {}, Role::trainee,
                        [&](const Result<AuthorId>& given) { author = given.value(); });
    lesson.tick();
    return author;
  };
  const auto bens = window("Ben"), nobodys = window("");
  EXPECT_TRUE(Lesson::person(told(bens, trainees), lesson.trainee)->has_supervision());
  EXPECT_FALSE(Lesson::person(told(nobodys, trainees), lesson.trainee)->has_supervision());
  EXPECT_EQ(told(window("Cy"), trainees).words_size(), 3)
      << "a message to the haptic client is also sent to the person's viewer";
  EXPECT_EQ(told(bens, trainees).words_size(), 1);
  EXPECT_EQ(told(lesson.other, trainees).words_size(), 3);
  EXPECT_EQ(told(lesson.instructor, {}).words_size(), 3);
}

TEST(PeopleHost, DrawingsComeAndGoAndWordsAreBounded) {
  Lesson lesson;
  PresenceCursor cursor;
  (void)lesson.news(cursor, lesson.instructor);
  const auto draw = [&](std::int32_t x) {
    return lesson.ask([&](Room& room) { return room.annotate(lesson.instructor, {.points = {{x, 2, 3}}}); });
  };
  ASSERT_TRUE(draw(1));
  ASSERT_TRUE(draw(7));
  v1::WatchPeopleResponse news = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(news.annotations_size(), 1) << "only the newest pointer";
  EXPECT_EQ(news.annotations(0).points(0), 7);
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.wipe_off(lesson.instructor, 1); }));
  news = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(news.wiped_size(), 1);
  EXPECT_EQ(news.wiped(0), 1u);
  // Drawn and wiped off between two reads: no reader needs it.
  ASSERT_TRUE(draw(9));
  ASSERT_TRUE(lesson.ask([&](Room& room) { return room.wipe_off(lesson.instructor, 2); }));
  news = lesson.news(cursor, lesson.instructor);
  EXPECT_EQ(news.annotations_size() + news.wiped_size(), 0);

  for (int i = 0; i < 100; ++i)
    ASSERT_TRUE(lesson.ask([&](Room& room) { return room.say(lesson.instructor, {}, std::to_string(i)); }));
  news = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(news.words_size(), static_cast<int>(Presence::kMostWords));
  EXPECT_EQ(news.words(news.words_size() - 1).words(), "99") << "the newest message";
}

// A shot with this number.
CArmShot shot_numbered(std::uint64_t number, ShotMode mode = ShotMode::single) {
  CArmShot shot;
  shot.number = number;
  shot.mode = mode;
  shot.position = {{1, 2, 3}, 0.01 * static_cast<double>(number), -0.5, {0, 10, 0}};
  shot.air_kerma_at_metre_ugy = 1.0 / 3.0;
  shot.seed = 70 + number;
  return shot;
}

TEST(PeopleHost, ShotsOfACArmGoToEverybodyAndAPressHasOneState) {
  Lesson lesson;
  PresenceCursor cursor;
  (void)lesson.news(cursor, lesson.instructor);
  Presence& people = lesson.runtime.people();
  const RoomSeq before = lesson.runtime.room_seq();
  const ShotRun single{.author = lesson.instructor, .first_number = 1, .exposure_s = 0.02, .last = shot_numbered(1)};
  people.shot(lesson.trainee, single, {1, 0.02, 0.001});
  v1::WatchPeopleResponse news = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(news.shots_size(), 1);
  EXPECT_EQ(news.shots(0).author(), lesson.trainee.value) << "of the caller, whatever the message says";
  const Result<ShotRun> sent = wire::from_wire(news.shots(0));
  ASSERT_TRUE(sent) << sent.error().message;
  EXPECT_EQ(sent->last, shot_numbered(1)) << "the same picture can be made of it";
  ASSERT_EQ(news.people_size(), 1);
  EXPECT_EQ(news.people(0).author(), lesson.trainee.value);
  EXPECT_EQ(news.people(0).session_shots().shots(), 1u);
  EXPECT_EQ(news.people(0).session_shots().exposure_s(), 0.02);
  EXPECT_EQ(news.people(0).session_shots().dose_area_gy_cm2(), 0.001);

  // Live pictures of one press: a reader gets the newest, after what was before it.
  const auto live = [&](std::uint64_t last, double exposure_s) {
    people.shot(lesson.trainee, {{}, 2, exposure_s, shot_numbered(last, ShotMode::live)}, {last, exposure_s, 0.01});
  };
  live(5, 0.25);
  people.shot(lesson.other, {{}, 1, 0.02, shot_numbered(1)}, {1, 0.02, 0.001});
  live(9, 0.5);
  live(7, 0.375);  // came late
  news = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(news.shots_size(), 2);
  EXPECT_EQ(news.shots(0).author(), lesson.other.value);
  EXPECT_EQ(news.shots(1).author(), lesson.trainee.value);
  EXPECT_EQ(news.shots(1).first_number(), 2u);
  EXPECT_EQ(news.shots(1).last().number(), 9u);
  EXPECT_EQ(news.shots(1).exposure_s(), 0.5);
  EXPECT_EQ(Lesson::person(news, lesson.trainee)->session_shots().shots(), 9u);
  EXPECT_EQ(people.news(cursor, lesson.instructor, {}), nullptr) << "everything was sent";

  // Whoever comes later gets all of them, as far as they may. Nobody has shot who has not joined.
  people.shot(AuthorId{99}, single, {1, 0.02, 0.001});
  PresenceCursor later, without;
  EXPECT_EQ(lesson.news(later, lesson.other).shots_size(), 3);
  news = lesson.news(without, lesson.other, {.shots = false});
  EXPECT_EQ(news.shots_size(), 0);
  EXPECT_FALSE(Lesson::person(news, lesson.trainee)->has_session_shots());
  EXPECT_EQ(lesson.runtime.room_seq(), before) << "it is no event of the room";
}

TEST(PeopleHost, ShotsAreBoundedAndComeAtMostTenTimesASecond) {
  Lesson lesson;
  class CountedReader final : public PresenceSubscriber {
   public:
    void changed() override { ++times; }
    void end(const std::string&) override {}
    std::size_t waiting() const override { return 0; }
    int times = 0;
  } reader;
  Presence& people = lesson.runtime.people();
  people.watch(reader);
  people.shot(lesson.other, {{}, 1, 0.02, shot_numbered(1)}, {1, 0.02, 0.001});
  lesson.tick();
  const int at_first = reader.times;
  // For a second, each tick of 8 ms with a shot of its own.
  for (std::uint64_t number = 1; number <= 125; ++number) {
    people.shot(lesson.trainee, {{}, number, 0.02, shot_numbered(number)}, {number, 0.02, 0.001});
    lesson.tick();
  }
  EXPECT_GE(reader.times - at_first, 5);
  EXPECT_LE(reader.times - at_first, 11);
  PresenceCursor cursor;
  const v1::WatchPeopleResponse news = lesson.news(cursor, lesson.instructor);
  ASSERT_EQ(news.shots_size(), static_cast<int>(Presence::kMostRuns));
  EXPECT_EQ(news.shots(0).author(), lesson.other.value) << "nobody pushes out the shots of the others";
  for (int i = 1; i < news.shots_size(); ++i)
    EXPECT_EQ(news.shots(i).first_number(), 125 - Presence::kMostRuns + 1 + static_cast<std::uint64_t>(i));
  EXPECT_EQ(Lesson::person(news, lesson.trainee)->session_shots().shots(), 125u) << "the counts are of all of them";
  people.leave(reader);
}

// However many have joined and left, a reader is sent a bounded number.
TEST(Presence, ThoseWhoWereHereLongestAgoAreLeftOut) {
  Room room(test::test_block());
  for (int i = 0; i < 600; ++i) (void)room.join(MemberKind::surgeon);
  Presence board(room, {});
  const auto count = [&] {
    PresenceCursor cursor;
    v1::WatchPeopleResponse news;
    EXPECT_TRUE(news.ParseFromString(*board.news(cursor, {}, {})));
    return news;
  };
  EXPECT_EQ(count().people_size(), static_cast<int>(Presence::kMostAbsent));
  EXPECT_EQ(count().people(0).author(), 600 - Presence::kMostAbsent + 1);
  board.came(AuthorId{3});
  EXPECT_EQ(count().people(0).author(), 3u) << "a present person is always listed";
  board.went(AuthorId{3});
  EXPECT_EQ(count().people(0).author(), 3u) << "it was the last to be present";
}

CuttingState state(std::uint64_t author, std::uint64_t seq) {
  CuttingState one;
  one.author = {author};
  one.state_seq = seq;
  return one;
}

TEST(PartnerSendQueue, SendsTheNewestThirtyTimesASecond) {
  PartnerSendQueue send_queue;
  const PartnerSendQueue::Clock::time_point start{};
  int told = 0;
  std::uint64_t newest = 0;
  for (std::uint64_t ms = 0; ms < 1000; ++ms) {
    send_queue.enqueue({state(1, ms + 1)}, true);
    EXPECT_TRUE(send_queue.waits());
    if (const auto one = send_queue.take(start + std::chrono::milliseconds(ms))) {
      ++told;
      newest = one->state_seq;
      EXPECT_EQ(newest, ms + 1) << "an older state is never sent";
    }
  }
  EXPECT_GE(told, 28);
  EXPECT_LE(told, 31);
  // The last one is still due, and is sent.
  EXPECT_NE(newest, 1000u);
  EXPECT_EQ(send_queue.take(start + 2s)->state_seq, 1000u);
  EXPECT_FALSE(send_queue.waits());
  send_queue.enqueue({state(1, 1000)}, true);
  EXPECT_FALSE(send_queue.waits()) << "the state is unchanged";
}

TEST(PartnerSendQueue, HoldsNothingOfWhatGoesAnotherWayOrOfWhoIsGone) {
  PartnerSendQueue send_queue;
  send_queue.enqueue({state(1, 1), state(2, 1)}, false);
  EXPECT_FALSE(send_queue.waits());
  send_queue.enqueue({state(1, 2), state(2, 1)}, true);
  EXPECT_EQ(send_queue.take({})->author, AuthorId{1});
  EXPECT_FALSE(send_queue.take({}));
  send_queue.enqueue({state(2, 2)}, true);
  send_queue.enqueue({}, true);
  EXPECT_FALSE(send_queue.waits());
  std::vector<CuttingState> many;
  for (std::uint64_t author = 1; author <= 40; ++author) many.push_back(state(author, 1));
  send_queue.enqueue(many, true);
  std::size_t told = 0;
  while (send_queue.take({})) ++told;
  EXPECT_EQ(told, PartnerSendQueue::kMost);
}

// Somebody's name, the decisions about them and their annotations are there again when the room is reopened.
TEST(PeopleHost, NamesAndDecisionsOutliveTheProcess) {
  const test::TempDir folder;
  const auto open = [&] {
    return RoomStore::open(folder / "room.journal", test::test_block(), RoomStore::Options{}).value();
  };
  AuthorId trainee;
  RoomSeq seq;
  {
    PersistedRoom kept = open();
    RoomRuntime runtime(std::move(kept.room), {.tick = 1ms, .mesh = 1s, .pieces = 0ns}, {}, Detail::automatic,
                        kept.store.get());
    const AuthorId instructor = runtime.join(MemberKind::watcher, "Ada", {}, Role::instructor).value();
    trainee = runtime.join(MemberKind::surgeon, "Ben", {}, Role::trainee).value();
    std::promise<RoomSeq> decided;
    runtime.queue_event([&](Room& room) { return room.supervise(instructor, trainee, {.stopped = true}); },
                        [](const Result<RoomEvent>&) {});
    runtime.queue_event(
        [&](Room& room) {
          return room.annotate(instructor, {.points = {{1, 2, 3}}, .words = "here"});
        },
        [&](const Result<RoomEvent>& event) { decided.set_value(event.value().room_seq); });
    seq = decided.get_future().get();
    runtime.stop();
    ASSERT_TRUE(kept.store->close());
  }
  PersistedRoom kept = open();
  RoomRuntime runtime(std::move(kept.room), {.tick = 1ms, .mesh = 1s, .pieces = 0ns}, {}, Detail::automatic,
                      kept.store.get());
  PresenceCursor cursor;
  v1::WatchPeopleResponse news;
  ASSERT_TRUE(news.ParseFromString(*runtime.people().news(cursor, {}, {})));
  const v1::Person* ben = Lesson::person(news, trainee);
  ASSERT_NE(ben, nullptr);
  EXPECT_EQ(ben->name(), "Ben");
  EXPECT_EQ(ben->role(), v1::ROLE_TRAINEE);
  EXPECT_TRUE(ben->hand() && !ben->here());
  EXPECT_TRUE(ben->supervision().stopped());
  EXPECT_EQ(ben->decided_room_seq(), seq.value - 1);
  ASSERT_EQ(news.annotations_size(), 1);
  EXPECT_EQ(news.annotations(0).words(), "here");
  runtime.stop();
}

TEST(PeopleHost, HapticClientsAreSentOthersTools) {
  RoomRuntime runtime(Room(test::test_block()), {.tick = 2ms, .mesh = 50ms, .pieces = 0ns}, {});
  const auto one = std::make_shared<ReceivedSession>(runtime.join(MemberKind::surgeon).value());
  ASSERT_TRUE(runtime.open_session(one));
  runtime.publish_state(state(77, 5));
  const auto told = [&] {
    return std::ranges::any_of(one->partners(), [](const CuttingState& s) { return s.state_seq == 5; });
  };
  for (int i = 0; i < 2000 && !told(); ++i) std::this_thread::sleep_for(5ms);
  EXPECT_TRUE(told());
  runtime.stop();
}

}  // namespace
}  // namespace osteon
