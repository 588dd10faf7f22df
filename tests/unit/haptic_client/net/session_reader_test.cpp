// Tests how messages of a room that come over two ways are put in one order, and what is under way to the room.
#include "haptic_client/net/session_reader.hpp"

#include <gtest/gtest.h>

#include "common/core/overloaded.hpp"
#include "common/field/rejection.hpp"
#include "common/tools/tool_file.hpp"
#include "common/wire/bone_motion.hpp"
#include "common/wire/convert.hpp"
#include "haptic_client/net/cuts_underway.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon {
namespace {

Cut cut_of(std::uint64_t author, std::uint64_t author_seq) {
  Cut cut = test::straight_cut(find_tool("burr-round-5").value(), {0, 0, 0}, {1, 0, 0}, {0, 0, -1}, author_seq);
  cut.author = AuthorId{author};
  return cut;
}

TEST(CutsUnderway, GoOnceOverEachLineUntilTheyAreDecided) {
  CutsUnderway underway(8);
  for (std::uint64_t i = 1; i <= 4; ++i) ASSERT_TRUE(underway.push(cut_of(1, i)));
  underway.push(CuttingState{});
  EXPECT_FALSE(underway.take_cut()) << "the room has not yet sent what it has";
  EXPECT_FALSE(underway.something_to_send());
  underway.go_on(1);
  EXPECT_EQ(underway.take_cut()->author_seq, 2u);
  EXPECT_EQ(underway.take_cut()->author_seq, 3u);
  underway.decided(2);
  EXPECT_EQ(underway.take_cut()->author_seq, 4u);
  EXPECT_FALSE(underway.take_cut());
  EXPECT_TRUE(underway.take_state());
  EXPECT_FALSE(underway.take_state());
  EXPECT_FALSE(underway.something_to_send());
  // The connection is lost. 3 was decided but its answer was lost, and 4 was lost itself.
  underway.stop();
  ASSERT_TRUE(underway.push(cut_of(1, 5)));
  EXPECT_FALSE(underway.take_cut());
  underway.go_on(3);
  EXPECT_EQ(underway.take_cut()->author_seq, 4u);
  EXPECT_EQ(underway.take_cut()->author_seq, 5u);
  EXPECT_EQ(underway.undecided(), 2u);
}

TEST(CutsUnderway, AreBounded) {
  CutsUnderway underway(3);
  underway.go_on(0);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    EXPECT_TRUE(underway.push(cut_of(1, i)));
    EXPECT_TRUE(underway.take_cut());
  }
  EXPECT_FALSE(underway.push(cut_of(1, 4))) << "a sent cut is not yet decided";
  underway.decided(1);
  EXPECT_TRUE(underway.push(cut_of(1, 4)));
}

struct Heard {
  std::vector<std::string> events;
  std::vector<std::uint64_t> decided, partners, seqs;
  int free = 0;  // times that a stream began without a decision about this hand
  SessionReader reader{
      AuthorId{7},
      builtin_tool_box(),
      {.message =
           [this](const RoomMessage& message) {
             std::visit(
                 Overloaded{
                     [&](const RoomAtJoin& room) {
                       events.push_back("complete " + std::to_string(room.contained.value));
                     },
                     [&](const CutCommitted& committed) {
                       events.push_back(std::to_string(committed.seq.value) + " of " +
                                        std::to_string(committed.cut.author.value));
                     },
                     [&](const CutRejected& rejected) {
                       events.push_back(std::to_string(rejected.seq.value) + " rejects " +
                                        std::to_string(rejected.author_seq) + " until " +
                                        std::to_string(rejected.lease_epoch) + ": " +
                                        std::string(name(rejected.reason)) + ", " + rejected.sentence);
                     },
                     [&](const SceneSet& scene) { events.push_back("scene " + std::to_string(scene.seq.value)); },
                     [&](const HandSupervised& now) {
                       if (now.seq.value == 0 && now.supervision == Restrictions{}) return void(++free);
                       events.push_back(std::to_string(now.seq.value) +
                                        (now.supervision.stopped ? " stops" : " frees") + " until " +
                                        std::to_string(now.lease_epoch) + now.supervision.words);
                     },
                     [&](const ChatReceived& said) {
                       events.push_back(std::to_string(said.seq.value) + ": " + std::to_string(said.from.value) +
                                        " says " + said.words);
                     },
                     [](const auto&) {},
                 },
                 message);
           },
       .partner = [this](const CuttingState& state) { partners.push_back(100 * state.author.value + state.state_seq); },
       .bone = [this](const MountPose& seen) { seqs.push_back(seen.seen_seq); }},
      [this](std::uint64_t seq) { decided.push_back(seq); },
      [this](std::uint64_t seq) { decided.push_back(seq); }};
};

v1::SessionResponse entry(std::uint64_t index, std::uint64_t seq, std::uint64_t author, std::uint64_t author_seq) {
  v1::SessionResponse response;
  response.set_index(index);
  response.mutable_committed()->set_room_seq(seq);
  *response.mutable_committed()->mutable_cut() = wire::to_wire(cut_of(author, author_seq));
  return response;
}
wire::IndexedEntry fast(std::uint64_t index, std::uint64_t seq, std::uint64_t author, std::uint64_t author_seq) {
  return {index,
          {.room_seq = RoomSeq{seq}, .kind = wire::SessionEntryKind::committed, .cut = cut_of(author, author_seq)}};
}

TEST(SessionReader, TakesWhicheverWayIsFirstAndKeepsTheOrder) {
  Heard heard;
  heard.reader.begin();
  v1::SessionResponse complete;
  complete.mutable_complete()->set_room_seq(3);
  complete.mutable_complete()->set_decided_author_seq(5);
  ASSERT_TRUE(heard.reader.take(complete));
  ASSERT_TRUE(heard.reader.take(fast(2, 11, 7, 6)));  // the first has not come yet
  EXPECT_EQ(heard.events, std::vector<std::string>{"complete 3"});
  ASSERT_TRUE(heard.reader.take(entry(1, 10, 2, 1)));
  ASSERT_TRUE(heard.reader.take(entry(2, 11, 7, 6)));  // again, over the stream
  ASSERT_TRUE(heard.reader.take(fast(1, 10, 2, 1)));
  // A change of the scene comes only over the stream. Later entries from the fast path wait for it.
  ASSERT_TRUE(
      heard.reader.take(wire::IndexedEntry{3, {.room_seq = RoomSeq{12}, .kind = wire::SessionEntryKind::streamed}}));
  ASSERT_TRUE(heard.reader.take(wire::IndexedEntry{4,
                                                   {.room_seq = RoomSeq{13},
                                                    .kind = wire::SessionEntryKind::rejected,
                                                    .author_seq = 7,
                                                    .reason = static_cast<std::uint32_t>(Rejection::place),
                                                    .lease_epoch = 14}}));
  EXPECT_EQ(heard.reader.taken(), 2u);
  v1::SessionResponse scene;
  scene.set_index(3);
  scene.mutable_scene()->set_room_seq(12);
  ASSERT_TRUE(heard.reader.take(scene));
  EXPECT_EQ(heard.events,
            (std::vector<std::string>{"complete 3", "10 of 2", "11 of 7", "scene 12",
                                      "13 rejects 7 until 14: place, the path leaves the surroundings of the bone"}));
  EXPECT_EQ(heard.decided, (std::vector<std::uint64_t>{5, 6, 7}));
  EXPECT_EQ(heard.reader.taken(), 4u);
}

// A program acts on the number. A reworded sentence changes nothing, and a number of a later version is no known
// reason.
TEST(SessionReader, KnowsAReasonByItsNumberNotByItsSentence) {
  Heard heard;
  heard.reader.begin();
  v1::SessionResponse complete;
  complete.mutable_complete()->set_room_seq(1);
  ASSERT_TRUE(heard.reader.take(complete));
  heard.events.clear();
  const auto rejected = [&](std::uint64_t index, int code, const std::string& reason) {
    v1::SessionResponse response;
    response.set_index(index);
    response.mutable_rejected()->set_room_seq(index + 1);
    response.mutable_rejected()->set_author_seq(index);
    response.mutable_rejected()->set_lease_epoch(2);
    response.mutable_rejected()->set_code(static_cast<v1::RejectionReason>(code));
    response.mutable_rejected()->set_reason(reason);
    return response;
  };
  ASSERT_TRUE(heard.reader.take(rejected(1, v1::REJECTION_REASON_FROZEN, "please wait")));
  ASSERT_TRUE(heard.reader.take(rejected(2, 1000, "of a later version")));
  ASSERT_TRUE(heard.reader.take(rejected(3, v1::REJECTION_REASON_UNSPECIFIED, "of an earlier version")));
  ASSERT_TRUE(heard.reader.take(wire::IndexedEntry{4,
                                                   {.room_seq = RoomSeq{5},
                                                    .kind = wire::SessionEntryKind::rejected,
                                                    .author_seq = 4,
                                                    .reason = 256 + static_cast<std::uint32_t>(Rejection::frozen),
                                                    .lease_epoch = 2}}));
  EXPECT_EQ(heard.events,
            (std::vector<std::string>{"2 rejects 1 until 2: frozen, please wait",
                                      "3 rejects 2 until 2: none, of a later version",
                                      "4 rejects 3 until 2: none, of an earlier version",
                                      "5 rejects 4 until 2: none, for a reason that this version does not know"}));
}

// Sequence numbers of the cuts that a rejoin acknowledges. A number that the room does not send stays unknown.
TEST(SessionReader, SaysTheSequenceNumbersOfDecidedCuts) {
  std::optional<RoomAtJoin> told;
  SessionReader reader(
      AuthorId{7}, builtin_tool_box(),
      {.message =
           [&](const RoomMessage& message) {
             if (const auto* room = std::get_if<RoomAtJoin>(&message)) told = *room;
           }},
      [](std::uint64_t) {}, [](std::uint64_t) {});
  v1::SessionResponse complete;
  complete.mutable_complete()->set_room_seq(30);
  complete.mutable_complete()->set_decided_author_seq(5);
  for (const std::uint64_t seq : {21u, 0u, 28u}) complete.mutable_complete()->add_decided_room_seqs(seq);
  ASSERT_TRUE(reader.take(complete));
  ASSERT_TRUE(told);
  EXPECT_EQ(told->seq_of(5), RoomSeq{28});
  EXPECT_EQ(told->seq_of(4), RoomSeq{}) << "rejected";
  EXPECT_EQ(told->seq_of(3), RoomSeq{21});
  for (const std::uint64_t seq : {0u, 1u, 2u, 6u}) EXPECT_EQ(told->seq_of(seq), std::nullopt) << seq;
  complete.mutable_complete()->clear_decided_room_seqs();
  ASSERT_TRUE(reader.take(complete));
  EXPECT_EQ(told->seq_of(5), std::nullopt) << "an older room does not send it";
}

wire::IndexedEntry word(std::uint64_t index, std::uint64_t seq, bool stopped) {
  wire::IndexedEntry entry{
      index, {.room_seq = RoomSeq{seq}, .kind = wire::SessionEntryKind::supervised, .lease_epoch = seq + 1}};
  entry.entry.supervision.stopped = stopped;
  return entry;
}
v1::SessionResponse streamed_word(const wire::IndexedEntry& entry) {
  v1::SessionResponse response;
  response.set_index(entry.index);
  response.mutable_supervised()->set_room_seq(entry.entry.room_seq.value);
  response.mutable_supervised()->set_lease_epoch(entry.entry.lease_epoch);
  *response.mutable_supervised()->mutable_supervision() = wire::to_wire(entry.entry.supervision);
  return response;
}

// Each entry arrives once and in the room's order, whichever way is first. An entry that only the stream brings keeps
// its position among them.
TEST(SessionReader, AnInstructorsDecisionKeepsItsSequenceNumber) {
  Heard heard;
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(word(2, 11, true)));  // a cut before it has not come
  EXPECT_TRUE(heard.events.empty());
  ASSERT_TRUE(heard.reader.take(streamed_word(word(2, 11, true))));
  ASSERT_TRUE(heard.reader.take(entry(1, 10, 7, 1)));
  ASSERT_TRUE(heard.reader.take(word(2, 11, true)));
  ASSERT_TRUE(heard.reader.take(word(4, 13, false)));
  v1::SessionResponse said;
  said.set_index(3);
  said.mutable_chat()->set_room_seq(12);
  said.mutable_chat()->set_from(4);
  said.mutable_chat()->set_words("look here");
  ASSERT_TRUE(heard.reader.take(said));
  EXPECT_EQ(heard.events,
            (std::vector<std::string>{"10 of 7", "11 stops until 12", "12: 4 says look here", "13 frees until 14"}));
  EXPECT_EQ(heard.reader.seq(), RoomSeq{13});
}

// Restrictions that hold at the start of a stream arrive before its leaves are complete. If none arrive, none hold any
// more.
TEST(SessionReader, EveryStreamSaysWhatHoldsForTheHand) {
  Heard heard;
  v1::SessionResponse complete;
  complete.mutable_complete()->set_room_seq(3);
  heard.reader.begin();
  wire::IndexedEntry before = word(0, 0, true);
  before.entry.lease_epoch = 5;
  ASSERT_TRUE(heard.reader.take(streamed_word(before)));
  ASSERT_TRUE(heard.reader.take(complete));
  EXPECT_EQ(heard.events, (std::vector<std::string>{"0 stops until 5", "complete 3"}));
  EXPECT_EQ(heard.free, 0);
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(complete));
  EXPECT_EQ(heard.free, 1);
}

TEST(SessionReader, TakesTheNewestOfAPartnersTool) {
  Heard heard;
  heard.reader.begin();
  const auto state = [](std::uint64_t author, std::uint64_t seq) {
    CuttingState of;
    of.author = AuthorId{author};
    of.state_seq = seq;
    return of;
  };
  const auto streamed = [&](std::uint64_t author, std::uint64_t seq) {
    v1::SessionResponse response;
    *response.mutable_partner() = wire::to_wire(state(author, seq));
    return response;
  };
  heard.reader.take(state(2, 8));
  ASSERT_TRUE(heard.reader.take(streamed(2, 7)));
  ASSERT_TRUE(heard.reader.take(streamed(2, 9)));
  ASSERT_TRUE(heard.reader.take(streamed(3, 1)));
  heard.reader.take(state(7, 50));  // its own
  EXPECT_EQ(heard.partners, (std::vector<std::uint64_t>{208, 209, 301}));
}

TEST(SessionReader, PassesOnWhereTheBoneStandsOnItsMount) {
  Heard heard;
  heard.reader.begin();
  v1::SessionResponse seq;
  *seq.mutable_bone() = wire::to_wire(MountPose{4, {Vec3(1, 2, 3), Vec3::Zero()}, 0, 0, 0});
  ASSERT_TRUE(heard.reader.take(seq));
  EXPECT_EQ(heard.seqs, (std::vector<std::uint64_t>{4}));
  seq.mutable_bone()->clear_turn();
  const Result<void> refused = heard.reader.take(seq);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("bone.turn"), std::string::npos) << refused.error().message;
  EXPECT_EQ(heard.seqs.size(), 1u);
}

// A killed server may have lost what it had sent, so nothing of the new stream's order has been received yet. The
// durable sequence number shows the loss.
TEST(SessionReader, ItsSequenceNumberIsThatOfThePresentStream) {
  Heard heard;
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(entry(1, 10, 2, 1)));
  v1::SessionResponse kept;
  kept.mutable_durable()->set_room_seq(9);
  kept.mutable_durable()->set_chain(std::string(32, 'c'));
  ASSERT_TRUE(heard.reader.take(kept));
  EXPECT_EQ(heard.reader.seq(), RoomSeq{10});
  heard.reader.begin();
  EXPECT_EQ(heard.reader.seq(), RoomSeq{0});
  EXPECT_EQ(heard.reader.kept().value().room_seq, RoomSeq{9});
  // The scene comes before the leaves, which are not there yet.
  v1::SessionResponse scene, complete;
  scene.mutable_scene()->set_room_seq(8);
  ASSERT_TRUE(heard.reader.take(scene));
  EXPECT_EQ(heard.reader.seq(), RoomSeq{0});
  complete.mutable_complete()->set_room_seq(8);
  ASSERT_TRUE(heard.reader.take(complete));
  EXPECT_EQ(heard.reader.seq(), RoomSeq{8});
  scene.set_index(1);
  scene.mutable_scene()->set_room_seq(9);
  ASSERT_TRUE(heard.reader.take(scene));
  EXPECT_EQ(heard.reader.seq(), RoomSeq{9});
}

TEST(SessionReader, BeginsAnewWithEachStream) {
  Heard heard;
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(entry(1, 10, 2, 1)));
  ASSERT_TRUE(heard.reader.take(entry(3, 12, 2, 3)));  // never to be passed on: the stream breaks
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(entry(1, 13, 2, 4)));
  EXPECT_EQ(heard.events, (std::vector<std::string>{"10 of 2", "13 of 2"}));
}

// The first outcome of a cut that was sent again. It was received before, or is in the leaves, where an undo may have
// followed.
TEST(SessionReader, AnswersOutsideTheOrderOnlySayWhatIsDecided) {
  Heard heard;
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(entry(0, 4, 7, 3)));
  v1::SessionResponse rejected;
  rejected.mutable_rejected()->set_author_seq(4);
  ASSERT_TRUE(heard.reader.take(rejected));
  EXPECT_TRUE(heard.events.empty());
  EXPECT_EQ(heard.decided, (std::vector<std::uint64_t>{3, 4}));
}

// The stream skips what datagrams have brought. Its next entry may overtake thousands that are still handed over.
TEST(SessionReader, TheStreamMayOvertakeAllThatDatagramsHaveBrought) {
  constexpr std::uint64_t kByDatagram = 20000;
  Heard heard;
  heard.reader.begin();
  ASSERT_TRUE(heard.reader.take(entry(kByDatagram + 1, kByDatagram + 1, 2, kByDatagram + 1)));
  for (std::uint64_t n = 1; n <= kByDatagram; ++n) ASSERT_TRUE(heard.reader.take(fast(n, n, 2, n)));
  EXPECT_EQ(heard.reader.taken(), kByDatagram + 1);
  EXPECT_EQ(heard.events.size(), kByDatagram + 1);
}

// Datagrams overtake the stream. A cut waits for the message that brings its tool.
TEST(SessionReader, ACutThatOvertakesItsToolWaitsForIt) {
  Heard heard;
  heard.reader.begin();
  Tool wide = edited(find_tool("burr-round-5").value(), "diameter_mm", 6.0).value();
  wide.name = "burr-wide";
  wire::IndexedEntry cut = fast(2, 11, 2, 1);
  cut.entry.cut.tool = wide.hash();
  ASSERT_TRUE(heard.reader.take(cut));
  EXPECT_TRUE(heard.events.empty());
  v1::SessionResponse tool;
  tool.set_index(1);
  tool.mutable_tool()->set_room_seq(10);
  *tool.mutable_tool()->mutable_tool() = wire::to_wire(wide);
  const Result<void> taken = heard.reader.take(tool);
  ASSERT_TRUE(taken) << taken.error().message;
  EXPECT_EQ(heard.events, std::vector<std::string>{"11 of 2"});
}

TEST(SessionReader, RefusesWhatNoCorrectServerSends) {
  Heard heard;
  heard.reader.begin();
  v1::SessionResponse strange = entry(1, 10, 2, 1);
  strange.mutable_committed()->mutable_cut()->set_tool_hash(std::string(32, 'x'));
  EXPECT_FALSE(heard.reader.fault());
  EXPECT_FALSE(heard.reader.take(strange));
  EXPECT_TRUE(heard.reader.fault());
  heard.reader.begin();
  EXPECT_FALSE(heard.reader.fault());
  EXPECT_FALSE(heard.reader.take(v1::SessionResponse{}));
  heard.reader.begin();
  wire::IndexedEntry unknown = fast(1, 11, 2, 2);
  unknown.entry.cut.tool.bytes[0] ^= 1;
  EXPECT_FALSE(heard.reader.take(unknown)) << "its turn has come, but not its tool";
  EXPECT_FALSE(heard.reader.take(entry(2, 12, 2, 3))) << "an entry before it is missing";
  EXPECT_FALSE(heard.reader.take(fast(3, 13, 2, 4)));
  EXPECT_TRUE(heard.events.empty());
}

}  // namespace
}  // namespace osteon
