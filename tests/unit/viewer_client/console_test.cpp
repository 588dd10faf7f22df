// Tests how the console carries out a line, with a supervision client that records what it was asked.
#include "viewer_client/app/console.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace osteon {
namespace {

using namespace std::chrono_literals;

Digest digest(std::uint8_t n) {
  Digest out;
  out.bytes.fill(n);
  return out;
}

class FakeDesk final : public SupervisionClient {
 public:
  AuthorId self() const override { return {1}; }
  std::vector<PersonSeen> people() const override { return people_; }
  std::vector<Annotation> annotations() const override { return drawn_; }
  std::vector<WordsSeen> words() const override { return words_; }
  bool wait(const std::function<bool()>& done, std::chrono::milliseconds patience) const override {
    patience_ = patience;
    if (done()) return true;
    if (late_) people_.push_back(*std::exchange(late_, std::nullopt));
    return done();
  }
  Result<RoomSeq> supervise(AuthorId subject, const Restrictions& supervision) override {
    asked_.emplace_back(subject, supervision);
    for (PersonSeen& person : people_)
      if (person.author == subject ||
          (!subject && person.hand && person.role != Role::instructor && person.author != self()))
        person.supervision = supervision, person.decided = RoomSeq{place_ + 1};
    return RoomSeq{++place_};
  }
  Result<std::pair<RoomSeq, std::size_t>> undo(const UndoSelection& what) override {
    undo_ = what;
    return std::pair(RoomSeq{++place_}, std::size_t{3});
  }
  Result<std::pair<RoomSeq, std::size_t>> redo(std::uint32_t count) override {
    return std::pair(RoomSeq{++place_}, std::size_t{count});
  }
  Result<RoomSeq> mark(const std::string& label) override {
    label_ = label;
    return RoomSeq{++place_};
  }
  Result<std::uint32_t> draw(const Annotation& drawn) override {
    drawn_.push_back(drawn);
    drawn_.back().id = static_cast<std::uint32_t>(drawn_.size());
    drawn_.back().author = self();
    return drawn_.back().id;
  }
  Result<void> wipe_off(std::uint32_t annotation) override {
    std::erase_if(drawn_, [&](const Annotation& one) { return annotation == 0 || one.id == annotation; });
    return {};
  }
  Result<RoomSeq> say(AuthorId to, const std::string& words) override {
    words_.push_back({RoomSeq{++place_}, self(), to, words});
    return RoomSeq{place_};
  }
  Result<std::pair<AuthorId, std::size_t>> demonstrate(const DemonstrationSource& what) override {
    shown_ = what;
    late_ = {.author = {9}, .name = "demonstrator", .here = true, .hand = true};
    return std::pair(AuthorId{9}, std::size_t{12});
  }
  Result<void> end_demonstration(AuthorId demonstrator) override {
    if (demonstrator == AuthorId{9}) return {};
    return failure(ErrorCode::not_found, "nothing is shown");
  }
  Result<std::vector<std::pair<std::string, Digest>>> tools() override {
    return std::vector{std::pair(std::string("drill"), digest(2)), std::pair(std::string("burr"), digest(1))};
  }
  Result<RoomSeen> status() override {
    return RoomSeen{.name = "lesson",
                    .room_seq = RoomSeq{place_},
                    .removed_mm3 = 1.5,
                    .bodies = {{}},
                    .marks = {{RoomSeq{4}, "start"}, {RoomSeq{8}, "start"}, {RoomSeq{9}, "after lunch"}}};
  }

  mutable std::vector<PersonSeen> people_;
  mutable std::optional<PersonSeen> late_;  // who is in the list of people after a wait for it
  std::vector<Annotation> drawn_;
  std::vector<WordsSeen> words_;
  std::vector<std::pair<AuthorId, Restrictions>> asked_;
  UndoSelection undo_;
  DemonstrationSource shown_;
  std::string label_;
  mutable std::chrono::milliseconds patience_{};
  std::uint64_t place_ = 10;
};

struct ConsoleTest : ::testing::Test {
  ConsoleTest() {
    desk.people_ = {{.author = {1}, .name = "Ada", .role = Role::instructor, .here = true},
                    {.author = {2}, .name = "Ben", .role = Role::trainee, .here = true, .hand = true, .cuts = 7},
                    {.author = {3}, .name = "Ben", .role = Role::trainee, .here = true},
                    {.author = {4}, .name = "Cy Young", .role = Role::trainee, .hand = true},
                    {.author = {5}, .name = "Twin", .here = true, .hand = true},
                    {.author = {6}, .name = "Twin", .here = true, .hand = true}};
  }
  std::string say(const std::string& line) { return console.answer(line).value_or("nothing"); }
  FakeDesk desk;
  Console console{desk};
};

TEST_F(ConsoleTest, WordsInQuotesAreOne) {
  EXPECT_EQ(words_of_line("  freeze  \"Cy Young\"\t now\r").value(),
            (std::vector<std::string>{"freeze", "Cy Young", "now"}));
  EXPECT_EQ(words_of_line("a \"\" b").value(), (std::vector<std::string>{"a", "", "b"}));
  EXPECT_FALSE(words_of_line("say \"half"));
  EXPECT_EQ(say("freeze \"Cy"), "error a quote has no end");
  EXPECT_EQ(say(""), "nothing");
  EXPECT_EQ(say("# a remark"), "nothing");
}

TEST_F(ConsoleTest, SaysWhatIsKnownWhereItKnowsNothing) {
  EXPECT_EQ(say("halt Ben").find("error there is no command \"halt\"; known are people, freeze, free, take"), 0u);
  EXPECT_EQ(say("freeze"), "error the form is: freeze NAME|all [WORDS]");
  for (const char* line : {"people now",
                           "free",
                           "take all",
                           "guide Ben to Ada",
                           "limit Ben",
                           "limit heat Ben 3",
                           "undo",
                           "undo 0",
                           "undo 2 of",
                           "redo 0",
                           "mark",
                           "draw 1 2 3",
                           "label 1 2 3",
                           "wipe",
                           "wipe 0",
                           "say",
                           "view",
                           "wait Ben",
                           "wait acknowledged",
                           "quit now",
                           "demonstrate a b"})
    EXPECT_EQ(say(line).find("error the form is: "), 0u) << line << ": " << say(line);
  EXPECT_TRUE(desk.asked_.empty());
  EXPECT_FALSE(console.over());
}

// A name means the person's hand rather than their viewer, and the console never guesses.
TEST_F(ConsoleTest, FindsWhoIsMeant) {
  EXPECT_EQ(say("freeze Ben"), "ok at 11");
  EXPECT_EQ(desk.asked_.back().first, AuthorId{2});
  EXPECT_EQ(say("freeze \"Cy Young\""), "ok at 12") << "who is away";
  EXPECT_EQ(desk.asked_.back().first, AuthorId{4});
  EXPECT_EQ(say("freeze #3"), "ok at 13");
  EXPECT_EQ(desk.asked_.back().first, AuthorId{3});
  EXPECT_EQ(say("freeze Twin"), "error several are called \"Twin\"; say which: #5, #6");
  EXPECT_EQ(say("freeze Di").find("error there is nobody called \"Di\""), 0u);
  EXPECT_EQ(say("freeze #99"), "error there is no author #99");
  EXPECT_EQ(desk.asked_.size(), 3u);
}

// All restrictions of a hand are sent each time, so that one decision does not undo another.
TEST_F(ConsoleTest, DecisionsAddUp) {
  EXPECT_EQ(say("limit force Ben 2.5").find("ok"), 0u);
  EXPECT_EQ(say("limit zone Ben 1 -2 3 10").find("ok"), 0u);
  EXPECT_EQ(say("limit tools Ben drill,burr").find("ok"), 0u);
  EXPECT_EQ(say("guide Ben along Ada share 0.25").find("ok"), 0u);
  EXPECT_EQ(say("take Ben").find("ok"), 0u);
  EXPECT_EQ(say("freeze Ben look here").find("ok"), 0u);
  const Restrictions all{.stopped = true,
                         .taken_by = {1},
                         .guide = {1},
                         .guide_share = 250,
                         .force_limit = 250,
                         .zone = ZoneLimit{{1024, -2048, 3072}, 10240},
                         .tools = {digest(1), digest(2)},
                         .words = "look here"};
  EXPECT_EQ(desk.asked_.back(), (std::pair(AuthorId{2}, all)));
  EXPECT_NE(say("people").find("#2 \"Ben\" trainee here haptic frozen taken by #1 guided along #1 share 0.250 force "
                               "2.500 zone 1.000 -2.000 3.000 "
                               "10.000 tools burr,drill words \"look here\" pending cuts 7"),
            std::string::npos)
      << say("people");
  for (const char* line : {"limit force Ben none", "limit zone Ben none", "limit tools Ben none", "unguide Ben",
                           "give-back Ben", "free Ben"})
    EXPECT_EQ(say(line).find("ok"), 0u) << line;
  EXPECT_EQ(desk.asked_.back().second, Restrictions{});
  EXPECT_EQ(say("limit force Ben 0").find("ok"), 0u);
  EXPECT_EQ(desk.asked_.back().second.force_limit, 1) << "a limit of zero differs from no limit";
  EXPECT_EQ(say("limit force Ben 1000").find("error"), 0u);
  EXPECT_EQ(say("limit tools Ben saw"), "error the room knows no tool \"saw\"");
  EXPECT_EQ(say("guide Ben along Ada share 2").find("error"), 0u);
}

// A person with a hand in the room takes the tool into that hand. It must not be a hand that is away, or another
// person's hand with the same name.
TEST_F(ConsoleTest, ATakenToolIsInTheHandOfWhoTypes) {
  desk.people_.push_back({.author = {7}, .name = "Ada", .role = Role::instructor, .hand = true});
  desk.people_.push_back({.author = {8}, .name = "Ada", .role = Role::trainee, .here = true, .hand = true});
  EXPECT_EQ(say("take Ben").find("ok"), 0u);
  EXPECT_EQ(desk.asked_.back().second.taken_by, AuthorId{1});
  desk.people_[6].here = true;
  EXPECT_EQ(say("take Ben").find("ok"), 0u);
  EXPECT_EQ(desk.asked_.back().second.taken_by, AuthorId{7});
}

TEST_F(ConsoleTest, AllAreDecidedAboutAtOnceUnlessMoreHoldsForOne) {
  EXPECT_EQ(say("freeze all"), "ok at 11");
  ASSERT_EQ(desk.asked_.size(), 1u);
  EXPECT_EQ(desk.asked_[0], (std::pair(AuthorId{}, Restrictions{.stopped = true})));
  EXPECT_EQ(say("free all"), "ok at 12");
  EXPECT_EQ(say("limit force Ben 3"), "ok at 13");
  desk.asked_.clear();
  EXPECT_EQ(say("freeze all"), "ok at 17");
  ASSERT_EQ(desk.asked_.size(), 4u) << "each hand except the instructor's";
  EXPECT_EQ(desk.asked_[0], (std::pair(AuthorId{2}, Restrictions{.stopped = true, .force_limit = 300})));
}

TEST_F(ConsoleTest, UndoesWhatWasAskedFor) {
  EXPECT_EQ(say("undo 2"), "ok at 11 events 3");
  EXPECT_EQ(desk.undo_.count, 2u);
  EXPECT_EQ(say("undo 2 of Ben").find("ok"), 0u);
  EXPECT_EQ(desk.undo_.of, AuthorId{2});
  EXPECT_EQ(say("undo 1.5 s").find("ok"), 0u);
  EXPECT_EQ(desk.undo_.newest, 1500ms);
  EXPECT_EQ(desk.undo_.count, 0u);
  EXPECT_EQ(say("undo to 4").find("ok"), 0u);
  EXPECT_EQ(desk.undo_.to, RoomSeq{4});
  EXPECT_EQ(say("undo to start").find("ok"), 0u);
  EXPECT_EQ(desk.undo_.to, RoomSeq{8}) << "the newest of that label";
  EXPECT_EQ(say("undo to after lunch").find("ok"), 0u);
  EXPECT_EQ(desk.undo_.to, RoomSeq{9});
  EXPECT_EQ(say("undo to 5"), "error the room has no mark \"5\"");
  EXPECT_EQ(say("undo all").find("ok"), 0u);
  EXPECT_TRUE(desk.undo_.all);
  EXPECT_EQ(say("redo"), "ok at 18 events 1");
  EXPECT_EQ(say("mark before it all"), "ok at 19");
  EXPECT_EQ(desk.label_, "before it all");
}

TEST_F(ConsoleTest, DrawsInMillimetres) {
  EXPECT_EQ(say("point 1 2 -3 look here"), "ok drawing 1");
  EXPECT_EQ(desk.drawn_.back().points, (std::vector<std::array<std::int32_t, 3>>{{1024, 2048, -3072}}));
  EXPECT_EQ(desk.drawn_.back().words, "look here");
  EXPECT_EQ(say("draw 0 0 0 0.5 0 0 1 1 1"), "ok drawing 2");
  EXPECT_EQ(desk.drawn_.back().kind, AnnotationKind::line);
  EXPECT_EQ(desk.drawn_.back().points.size(), 3u);
  EXPECT_EQ(say("label 1 1 1 the \"big\" nerve"), "ok drawing 3");
  EXPECT_EQ(desk.drawn_.back().words, "the big nerve");
  EXPECT_EQ(say("drawn"),
            "ok 3 drawings: 1 pointer of #1 \"Ada\" from 1.000 2.000 -3.000 \"look here\"; 2 line of #1 \"Ada\" from "
            "0.000 0.000 0.000; "
            "3 label of #1 \"Ada\" from 1.000 1.000 1.000 \"the big nerve\"");
  EXPECT_EQ(say("point 1 2 x").find("error a point is"), 0u);
  EXPECT_EQ(say("point 1 2 1e9").find("error"), 0u);
  EXPECT_EQ(say("wipe 2"), "ok");
  EXPECT_EQ(desk.drawn_.size(), 2u);
  EXPECT_EQ(say("wipe all"), "ok");
  EXPECT_TRUE(desk.drawn_.empty());
}

TEST_F(ConsoleTest, SpeaksToOneOrToAll) {
  EXPECT_EQ(say("say Ben a little slower"), "ok at 11 to #2 \"Ben\"");
  EXPECT_EQ(desk.words_.back().words, "a little slower");
  EXPECT_EQ(say("say all stop please"), "ok at 12 to all");
  EXPECT_EQ(desk.words_.back().words, "stop please");
  EXPECT_EQ(say("say well done"), "ok at 13 to all") << "nobody has the name well";
  EXPECT_EQ(desk.words_.back().words, "well done");
  EXPECT_EQ(say("say hello"), "ok at 14 to all");
  EXPECT_EQ(say("say #77 hello").find("error"), 0u);
  EXPECT_EQ(say("say Twin hello").find("error several"), 0u);
  EXPECT_EQ(say("said").find("ok at 11 #1 \"Ada\" to #2 \"Ben\" \"a little slower\"; at 12"), 0u);
}

TEST_F(ConsoleTest, SaysWhereSomebodyLooksAndWhetherTheyHaveAcknowledged) {
  EXPECT_EQ(say("view Ben").find("error nobody knows"), 0u);
  desk.people_[2].look = ViewFrustum{.eye_mm = {1, 2, 3}, .target_mm = {4, 5, -6}};
  EXPECT_EQ(say("view Ben"), "ok eye 1.000 2.000 3.000 target 4.000 5.000 -6.000") << "by the viewer of the same name";
  desk.people_[2].look->up = Vec3(0, 1, 0);
  EXPECT_EQ(say("view Ben"), "ok eye 1.000 2.000 3.000 target 4.000 5.000 -6.000 up 0.000 1.000 0.000");
  desk.people_[1].decided = RoomSeq{9};
  desk.people_[1].decided_by = AuthorId{1};
  EXPECT_NE(say("people").find(" pending decided by #1"), std::string::npos) << say("people");
  EXPECT_EQ(say("wait acknowledged Ben 2"), "error #2 \"Ben\" has not acknowledged event 9 yet");
  EXPECT_EQ(desk.patience_, 2s);
  desk.people_[1].acknowledged = RoomSeq{12};
  EXPECT_EQ(say("wait acknowledged Ben"), "ok at 12");
}

// The answer comes before the demonstrator is in the list of people. The next command may still name it.
TEST_F(ConsoleTest, Demonstrates) {
  EXPECT_EQ(say("demonstrate"), "ok demonstrator #9 cuts 12");
  EXPECT_EQ(say("demonstrate \"the other room\" of Ben from 3 to 77 speed 0.5"), "ok demonstrator #9 cuts 12");
  EXPECT_EQ(desk.shown_.room, "the other room");
  EXPECT_EQ(desk.shown_.of, AuthorId{2});
  EXPECT_EQ(desk.shown_.from, RoomSeq{3});
  EXPECT_EQ(desk.shown_.to, RoomSeq{77});
  EXPECT_DOUBLE_EQ(desk.shown_.speed, 0.5);
  EXPECT_EQ(say("demonstrate of #1234"), "ok demonstrator #9 cuts 12") << "a person known only in the other room";
  EXPECT_EQ(desk.shown_.of, AuthorId{1234});
  EXPECT_EQ(say("demonstrate speed 0").find("error"), 0u);
  EXPECT_EQ(say("guide Ben along #9 share 1"), "ok at 11");
  EXPECT_EQ(say("end-demonstration #9"), "ok");
  EXPECT_EQ(say("end-demonstration 8"), "error nothing is shown");
  EXPECT_EQ(say("quit"), "ok");
  EXPECT_TRUE(console.over());
}

}  // namespace
}  // namespace osteon
