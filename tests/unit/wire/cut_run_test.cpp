#include "common/wire/cut_run.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <deque>
#include <functional>
#include <limits>

#include "common/link/receive_window.hpp"
#include "common/link/sealed.hpp"
#include "common/link/send_rate.hpp"
#include "common/wire/convert.hpp"
#include "common/wire/packet_filler.hpp"
#include "common/wire/tool_state.hpp"
#include "tests/scenario/recording.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/shared_data.hpp"

namespace osteon {
namespace {

using namespace std::chrono_literals;
using test::Random;

constexpr SendWindowLimits kWide{1 << 20, 1 << 16, wire::kRunBytes};

Digest digest(std::uint8_t n) {
  Digest out;
  out.bytes.fill(n);
  return out;
}

// Any number. Small ones and both ends of the range occur more often than by chance.
std::uint64_t any(Random& random) {
  const std::uint64_t bits = random.index(~std::size_t{0});
  return random.unit() < 0.1 ? ~std::uint64_t{0} : bits >> random.index(64);
}

QuantisedPose any_pose(Random& random) {
  QuantisedPose pose;
  for (auto& p : pose.position)
    p = static_cast<std::int32_t>(static_cast<std::uint32_t>(any(random) ^ (0 - random.index(2))));
  for (auto& r : pose.rotation)
    r = static_cast<std::int16_t>(static_cast<std::uint16_t>(any(random) ^ (0 - random.index(2))));
  if (random.unit() < 0.2) pose.position[0] = std::numeric_limits<std::int32_t>::min();
  if (random.unit() < 0.2) pose.rotation[3] = std::numeric_limits<std::int16_t>::min();
  return pose;
}

// A cut after `before`. It shares a random number of properties with it: it may continue its path, or use its tool. A
// `wild` cut shares none.
Cut any_cut(Random& random, const Cut& before, bool wild) {
  Cut cut = before;
  ++cut.author_seq;
  if (random.unit() < 0.1) cut.lease_epoch = any(random);
  if (random.unit() < 0.1) cut.body = {static_cast<std::uint32_t>(any(random))};
  if (random.unit() < 0.1) cut.tool = digest(static_cast<std::uint8_t>(random.index(4)));
  if (random.unit() < 0.1) cut.level = static_cast<int>(random.index(3));
  if (random.unit() < 0.1) cut.spindle_rpm = static_cast<std::uint32_t>(any(random));
  if (random.unit() < 0.3) cut.path_us = static_cast<std::uint32_t>(any(random));
  QuantisedPose pose = before.path.empty() ? QuantisedPose{} : before.path.back();
  cut.path.clear();
  if (random.unit() < 0.8) cut.path.push_back(pose);
  for (std::size_t knots = random.index(5); knots > 0; --knots) {
    if (wild && random.unit() < 0.5) pose = any_pose(random);
    for (auto& p : pose.position)
      p = static_cast<std::int32_t>(static_cast<std::uint32_t>(p) + static_cast<std::uint32_t>(random.index(41)) - 20u);
    cut.path.push_back(pose);
  }
  return cut;
}

std::vector<Cut> any_cuts(Random& random, std::size_t count, bool wild, AuthorId author = {7},
                          std::uint64_t first = 1) {
  Cut before;
  before.author = author;
  before.author_seq = first - 1;
  before.lease_epoch = 3;
  before.tool = digest(1);
  std::vector<Cut> cuts;
  while (cuts.size() < count) cuts.push_back(before = any_cut(random, before, wild));
  return cuts;
}

Restrictions any_supervision(Random& random, std::size_t most_tools) {
  Restrictions one{.stopped = random.unit() < 0.5,
                   .taken_by = {random.index(3)},
                   .guide = {any(random)},
                   .guide_share = static_cast<int>(random.index(kWholeShare + 1)),
                   .force_limit = static_cast<int>(random.index(kMostForceLimit + 1))};
  if (random.unit() < 0.5)
    one.zone = ZoneLimit{any_pose(random).position, 1 + static_cast<std::int32_t>(random.index(1 << 20))};
  for (std::size_t tools = random.index(most_tools + 1); tools > 0; --tools)
    one.tools.push_back(digest(static_cast<std::uint8_t>(20 - tools)));
  one.words = std::string(random.index(kMostSupervisionWords + 1), 'w');
  return one;
}

wire::SessionEntry committed(const Cut& cut) {
  return {.room_seq = {cut.author_seq}, .kind = wire::SessionEntryKind::committed, .cut = cut};
}

v1::UpPacket parsed(const std::string& bytes) {
  v1::UpPacket packet;
  EXPECT_TRUE(packet.ParseFromString(bytes));
  return packet;
}

wire::ToolNumbers numbers_1_to_3() {
  wire::ToolNumbers numbers;
  for (const std::uint8_t n : {1, 2, 3}) numbers.add(n, digest(n));  // tool 0 has no number
  return numbers;
}

TEST(CutRun, AnyCutsComeBackByteForByte) {
  const wire::ToolNumbers numbers = numbers_1_to_3();
  std::size_t cuts_seen = 0, runs_seen = 0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    Random random(seed);
    const std::uint64_t first = 1 + random.index(1000);
    const std::vector<Cut> cuts = any_cuts(random, 1 + random.index(40), seed % 2 == 0, {7}, first);
    SendWindow window(kWide, first);
    wire::CutSender sender(window, numbers);
    for (const Cut& cut : cuts) ASSERT_TRUE(sender.push(cut));
    std::vector<Cut> back;
    while (back.size() < cuts.size()) {
      wire::PacketFiller<v1::UpPacket> filler(kMostPlainBytes);
      const auto picked = filler.add_items(window, 0s, 1);
      ASSERT_FALSE(picked.numbers.empty());
      const v1::UpPacket packet = parsed(filler.take());
      for (const v1::CutRun& run : packet.cuts()) {
        const auto read = wire::cuts_of(run, {7}, numbers);
        ASSERT_TRUE(read) << read.error().message;
        back.insert(back.end(), read->begin(), read->end());
        ++runs_seen;
      }
      window.acknowledge(picked.numbers.back());
    }
    ASSERT_EQ(back, cuts) << "seed " << seed;
    cuts_seen += cuts.size();
  }
  std::printf("%zu cuts in %zu runs\n", cuts_seen, runs_seen);
}

// A run ends where something in its head changes, and only there.
TEST(CutRun, ARunEndsWhereItsHeadChanges) {
  const wire::ToolNumbers numbers = numbers_1_to_3();
  const auto runs_of = [&](const std::function<void(Cut&)>& change) {
    SendWindow window(kWide);
    wire::CutSender sender(window, numbers);
    Cut cut;
    cut.author = {1};
    cut.tool = digest(1);
    cut.path = {QuantisedPose{}, QuantisedPose{{1, 2, 3}}};
    for (int i = 0; i < 4; ++i) {
      ++cut.author_seq;
      if (i == 2) change(cut);
      EXPECT_TRUE(sender.push(cut));
    }
    wire::PacketFiller<v1::UpPacket> filler(kMostPlainBytes);
    filler.add_items(window, 0s, 1);
    return parsed(filler.take()).cuts_size();
  };
  EXPECT_EQ(runs_of([](Cut&) {}), 1);
  EXPECT_EQ(runs_of([](Cut& c) { c.path.front().position[1] = 5; }), 1)
      << "a path that begins elsewhere says so itself";
  EXPECT_EQ(runs_of([](Cut& c) { c.path_us = 9000; }), 1);
  EXPECT_EQ(runs_of([](Cut& c) { c.lease_epoch = 9; }), 2);
  EXPECT_EQ(runs_of([](Cut& c) { c.body = {1}; }), 2);
  EXPECT_EQ(runs_of([](Cut& c) { c.tool = digest(2); }), 2);
  EXPECT_EQ(runs_of([](Cut& c) { c.level = 1; }), 2);
  EXPECT_EQ(runs_of([](Cut& c) { c.spindle_rpm = 1; }), 1) << "a spindle under load has another speed in every cut";
}

// Counted by hand. A step of 300, -200 and 100 takes one byte that says which numbers follow, and 2 bytes for each. The
// same step again takes that one byte. One byte before the knots gives their number.
TEST(CutRun, TakesAsFewBytesAsItSays) {
  const wire::ToolNumbers numbers = numbers_1_to_3();
  SendWindow window(kWide);
  wire::CutSender sender(window, numbers);
  Cut cut;
  cut.tool = digest(1);
  cut.path_us = 8000;
  QuantisedPose pose{{100'000, 200'000, -300'000}, {100, 200, 300, 32700}};
  const auto bytes = [&] {
    cut.author_seq = window.next();
    EXPECT_TRUE(sender.push(cut));
    return window.item(cut.author_seq).bytes.size();
  };
  const auto move = [&](int x, int y, int z) {
    pose.position[0] += x;
    pose.position[1] += y;
    pose.position[2] += z;
    cut.path.push_back(pose);
  };
  cut.path = {pose};
  EXPECT_EQ(bytes(), 1u) << "stands still";
  for (int k = 0; k < 10; ++k) move(300, -200, 100);
  EXPECT_EQ(bytes(), 1u + 7 + 9);
  cut.path = {pose};
  move(8, 0, -8);
  EXPECT_EQ(bytes(), 1u + 1 + 2) << "a drill on its way, 1 mm/s";
  cut.path = {pose};
  move(300, 0, 0);
  move(1, 0, 0);
  EXPECT_EQ(bytes(), 1u + 3 + 2) << "the step before would need 2 bytes to take back";
  cut.path_us = 7000;
  cut.path = {pose};
  EXPECT_EQ(bytes(), 3u) << "another time";
  cut.spindle_rpm = 20'000;
  EXPECT_EQ(bytes(), 1u + 3) << "from standing to full speed";
  cut.spindle_rpm -= 60;
  EXPECT_EQ(bytes(), 1u + 1) << "a little slower";
  cut.path.clear();
  move(5, 0, 0);
  EXPECT_EQ(bytes(), 1u + 2) << "begins elsewhere";
}

TEST(CutRun, IsNeverTwiceAsLongAsThePlainMessage) {
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 20000; ++seed) {
    Random random(seed);
    // The worst case is a single cut whose tool has no number.
    const Cut before = any_cut(random, {}, true), cut = any_cut(random, before, true);
    SendWindow window(kWide, before.author_seq);
    const wire::ToolNumbers none;
    wire::CutSender sender(window, none);
    ASSERT_TRUE(sender.push(before) && sender.push(cut));
    wire::PacketFiller<v1::UpPacket> first(100'000);
    first.add_items(window, 0s, 1);
    window.acknowledge(before.author_seq);
    wire::PacketFiller<v1::UpPacket> filler(kMostPlainBytes);
    filler.add_items(window, 10s, 1);
    const std::string alone = filler.take();
    ASSERT_FALSE(alone.empty());
    const double plain = static_cast<double>(wire::to_wire(cut).ByteSizeLong());
    worst = std::max(worst, static_cast<double>(alone.size()) / plain);
  }
  std::printf("at worst %.2f of the plain message\n", worst);
  EXPECT_LE(worst, 2.0);
}

// A run carries only the difference of a speed. The sum must be a valid speed.
TEST(CutRun, ASpeedBeyondTheRangeIsRefused) {
  const wire::ToolNumbers numbers = numbers_1_to_3();
  const auto speed_after = [&](std::uint32_t before,
                               std::initializer_list<std::uint8_t> difference) -> std::optional<std::uint32_t> {
    v1::CutRun run;
    run.set_author_seq(1);
    run.set_tool_number(1);
    run.set_spindle_rpm(before);
    for (int i = 0; i < 7; ++i) run.add_start(0);
    std::string cut(1, '\4');  // no knot, another speed
    for (const std::uint8_t byte : difference) cut += static_cast<char>(byte);
    run.set_cuts(cut);
    const auto cuts = wire::cuts_of(run, {7}, numbers);
    return cuts ? std::optional((*cuts)[0].spindle_rpm) : std::nullopt;
  };
  EXPECT_EQ(speed_after(1000, {2}), 1001u);
  EXPECT_EQ(speed_after(1000, {1}), 999u);
  EXPECT_EQ(speed_after(0, {1}), std::nullopt);
  EXPECT_EQ(speed_after(~0u, {1}), ~0u - 1);
  EXPECT_EQ(speed_after(~0u, {2}), std::nullopt);
  EXPECT_EQ(speed_after(1, {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1}), std::nullopt);
  EXPECT_EQ(speed_after(1, {0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1}), std::nullopt);
}

// The longest cut that fits_a_packet() accepts, with the numbers that take most bytes.
TEST(CutRun, TheLongestCutFitsAPacket) {
  Cut cut;
  cut.author = {~std::uint64_t{0}};
  cut.author_seq = ~std::uint64_t{0} - 1;
  cut.lease_epoch = ~std::uint64_t{0};
  cut.body = {~0u};
  cut.tool = digest(1);
  cut.level = 2;
  cut.spindle_rpm = cut.path_us = ~0u;
  for (std::size_t k = 0; k < wire::kMostKnotsInPacket; ++k) {
    QuantisedPose pose;
    pose.position.fill(k % 2 == 0 ? std::numeric_limits<std::int32_t>::min() / 2
                                  : std::numeric_limits<std::int32_t>::max() / 2);
    pose.rotation.fill(k % 3 == 0 ? std::int16_t{-16000} : std::int16_t{16000});
    cut.path.push_back(pose);
  }
  ASSERT_TRUE(wire::fits_a_packet(cut));
  // The cut before shares nothing with it.
  Cut before = cut;
  --before.author_seq;
  before.spindle_rpm = before.path_us = 0;
  before.path = {QuantisedPose{}};
  const wire::ToolNumbers none;
  const auto after_it = [&](SendWindow& window, auto push) {
    ASSERT_TRUE(push(before));
    (void)window.pick(0s, kMostPlainBytes, 1);
    ASSERT_TRUE(window.acknowledge(before.author_seq));
    ASSERT_TRUE(push(cut));
  };
  SendWindow window(kWide, before.author_seq), entry_window(kWide, before.author_seq);
  wire::CutSender sender(window, none);
  wire::EntrySender entry_sender(entry_window, none);
  after_it(window, [&](const Cut& one) { return sender.push(one); });
  after_it(entry_window, [&](const Cut& one) { return entry_sender.push(committed(one)); });
  std::printf("%zu B up, %zu B down\n", window.least_room(0s), entry_window.least_room(0s));
  EXPECT_LE(window.least_room(0s), kMostPlainBytes - 100);
  EXPECT_LE(entry_window.least_room(0s), kMostPlainBytes - 100);
  cut.path.resize(wire::kMostKnotsInPacket + 1);
  EXPECT_FALSE(wire::fits_a_packet(cut));
}

TEST(CutRun, WithoutItsNumberAToolGoesByItsHash) {
  Random random(1);
  const std::vector<Cut> cuts = any_cuts(random, 1, false);
  const wire::ToolNumbers known = numbers_1_to_3(), none;
  const auto run_with = [&](const wire::ToolNumbers& numbers) {
    SendWindow window(kWide);
    wire::CutSender sender(window, numbers);
    EXPECT_TRUE(sender.push(cuts[0]));
    wire::PacketFiller<v1::UpPacket> filler(kMostPlainBytes);
    filler.add_items(window, 0s, 1);
    return parsed(filler.take()).cuts(0);
  };
  const v1::CutRun by_hash = run_with(none), by_number = run_with(known);
  EXPECT_EQ(by_hash.tool_hash().size(), 32u);
  EXPECT_EQ(by_number.tool_number(), 1u);
  EXPECT_EQ(wire::cuts_of(by_hash, {7}, none), cuts);
  const auto unknown = wire::cuts_of(by_number, {7}, none);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::not_found);
  wire::ToolNumbers again = known;
  again.add(1, digest(9));
  EXPECT_EQ(again.tool_of(1), digest(1)) << "a number keeps its tool";
}

TEST(CutRun, AFullWindowChangesNothing) {
  const wire::ToolNumbers none;
  Random random(4);
  const std::vector<Cut> cuts = any_cuts(random, 20, false);
  SendWindow window({1 << 20, 3, wire::kRunBytes});
  wire::CutSender sender(window, none);
  std::vector<Cut> back;
  for (std::size_t next = 0; back.size() < cuts.size();) {
    if (next < cuts.size() && sender.push(cuts[next])) {
      ++next;
      continue;
    }
    wire::PacketFiller<v1::UpPacket> filler(kMostPlainBytes);
    const auto picked = filler.add_items(window, 0s, 1);
    const v1::UpPacket packet = parsed(filler.take());
    for (const v1::CutRun& run : packet.cuts()) {
      const auto read = wire::cuts_of(run, {7}, none);
      ASSERT_TRUE(read);
      back.insert(back.end(), read->begin(), read->end());
    }
    window.acknowledge(picked.numbers.back());
  }
  EXPECT_EQ(back, cuts);
}

// The longest supervision that fits a packet. One with more tools takes the stream.
TEST(EntryRun, TheLongestSupervisionFitsAPacket) {
  wire::SessionEntry entry{
      .room_seq = {~std::uint64_t{0}}, .kind = wire::SessionEntryKind::supervised, .lease_epoch = ~std::uint64_t{0}};
  constexpr std::int32_t kLow = std::numeric_limits<std::int32_t>::min();
  entry.supervision = {.stopped = true,
                       .taken_by = {~std::uint64_t{0}},
                       .guide = {~std::uint64_t{0}},
                       .guide_share = kWholeShare,
                       .force_limit = kMostForceLimit,
                       .zone = ZoneLimit{{kLow, kLow, kLow}, 1 << 30},
                       .tools = {},
                       .words = std::string(kMostSupervisionWords, 'w')};
  for (std::size_t n = 0; n < wire::kMostToolsInPacket; ++n)
    entry.supervision.tools.push_back(digest(static_cast<std::uint8_t>(n)));
  entry.by = {AuthorId{~std::uint64_t{0}}, std::string(wire::kMostNameInPacket, 'n')};
  ASSERT_TRUE(check(entry.supervision));
  ASSERT_TRUE(wire::fits_a_packet(entry));
  SendWindow window(kWide);
  const wire::ToolNumbers none;
  wire::EntrySender sender(window, none);
  ASSERT_TRUE(sender.push(entry));
  EXPECT_LE(window.least_room(0s), kMostPlainBytes - 100);
  entry.by.name += 'n';
  EXPECT_FALSE(wire::fits_a_packet(entry)) << "no name is cut off";
  entry.by.name.clear();
  EXPECT_TRUE(wire::fits_a_packet(entry));
  entry.supervision.tools.push_back(digest(99));
  EXPECT_FALSE(wire::fits_a_packet(entry));
}

TEST(EntryRun, ASupervisionThatNobodyDecidesSpoilsItsPacket) {
  v1::DownPacket packet;
  v1::SupervisedEntry& entry = *packet.add_supervised();
  entry.set_index(1);
  EXPECT_TRUE(wire::entries_of(packet, {})) << "one that frees";
  entry.mutable_supervision()->set_guide_share(1001);
  const auto read = wire::entries_of(packet, {});
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::invalid_input);
}

// Log entries of three authors, rejections, supervisions and events of the stream. Their packets are lost, repeated and
// reordered, and may arrive before the tools' numbers. The session's order must result.
TEST(EntryRun, AnyEntriesArriveInTheSessionsOrder) {
  const wire::ToolNumbers numbers = numbers_1_to_3(), none;
  std::size_t entries_seen = 0, packets = 0, left_out = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    std::array<Cut, 3> last;
    for (std::size_t a = 0; a < 3; ++a) {
      last[a].author = {a + 10};
      last[a].tool = digest(1);
    }
    SendWindow window(kWide);
    wire::EntrySender sender(window, numbers);
    std::vector<wire::SessionEntry> entries;
    RoomSeq seq{random.index(1000)};
    for (std::size_t i = 0; i < 60; ++i) {
      seq.value += random.unit() < 0.8 ? 1 : random.index(1000);
      const double kind = random.unit();
      wire::SessionEntry entry{.room_seq = seq};
      if (kind < 0.05) {
        entry.kind = wire::SessionEntryKind::rejected;
        entry.author_seq = any(random);
        entry.reason = static_cast<std::uint32_t>(random.index(13));
        entry.lease_epoch = any(random);
      } else if (kind < 0.08) {
        entry.kind = wire::SessionEntryKind::supervised;
        entry.lease_epoch = any(random);
        entry.supervision = any_supervision(random, wire::kMostToolsInPacket);
        entry.by = {AuthorId{random.index(4)}, std::string(random.index(wire::kMostNameInPacket + 1), 'n')};
      } else if (kind > 0.1) {
        Cut& cut = last[random.index(3)];
        cut = any_cut(random, cut, random.unit() < 0.1);
        if (random.unit() < 0.05) cut.author_seq += random.index(1000);  // some of them were rejected
        entry.kind = wire::SessionEntryKind::committed;
        entry.cut = cut;
      }
      entries.push_back(entry);
      ASSERT_TRUE(sender.push(entries.back()));
      if (random.unit() < 0.05) sender.forget(last[random.index(3)].author);
    }
    ReceiveWindow<wire::SessionEntry> in;
    std::vector<wire::SessionEntry> back;
    std::vector<std::string> flying;
    for (int turn = 0; back.size() < entries.size(); ++turn) {
      ASSERT_LT(turn, 20000);
      wire::PacketFiller<v1::DownPacket> filler(100 + random.index(kMostPlainBytes - 100));
      filler.add_items(window, turn * 8ms, 5);
      flying.push_back(filler.take());
      ++packets;
      if (random.unit() < 0.3) flying.erase(flying.begin() + static_cast<std::ptrdiff_t>(random.index(flying.size())));
      if (flying.empty() || random.unit() < 0.3) continue;
      const std::size_t which = random.index(flying.size());
      v1::DownPacket packet;
      ASSERT_TRUE(packet.ParseFromString(flying[which]));
      if (random.unit() < 0.9) flying.erase(flying.begin() + static_cast<std::ptrdiff_t>(which));
      const auto read = wire::entries_of(packet, turn < 5 ? none : numbers, &left_out);
      ASSERT_TRUE(read) << read.error().message;
      for (const wire::IndexedEntry& entry : *read) in.insert(entry.index, entry.entry);
      while (auto entry = in.take()) back.push_back(std::move(*entry));
      window.acknowledge(in.acknowledged(), in.beyond(in.acknowledged()));
    }
    for (std::size_t i = 0; i < entries.size(); ++i)
      ASSERT_EQ(back[i], entries[i]) << "seed " << seed << " entry " << i;
    entries_seen += entries.size();
  }
  std::printf("%zu entries in %zu packets, %zu runs left out for their tools\n", entries_seen, packets, left_out);
  EXPECT_GT(left_out, 0u);
}

// Damaged bytes are refused or read as another cut. They never do harm.
TEST(CutRun, DamagedBytesDoNoHarm) {
  const wire::ToolNumbers numbers = numbers_1_to_3();
  std::size_t refused = 0, read_so = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    Random random(seed);
    SendWindow up(kWide), down(kWide);
    wire::CutSender cuts(up, numbers);
    wire::EntrySender entries(down, numbers);
    for (const Cut& cut : any_cuts(random, 8, true)) {
      ASSERT_TRUE(cuts.push(cut));
      ASSERT_TRUE(entries.push(committed(cut)));
    }
    wire::PacketFiller<v1::UpPacket> up_filler(kMostPlainBytes);
    wire::PacketFiller<v1::DownPacket> down_filler(kMostPlainBytes);
    up_filler.add_items(up, 0s, 1);
    down_filler.add_items(down, 0s, 1);
    std::string up_bytes = up_filler.take(), down_bytes = down_filler.take();
    for (std::string* bytes : {&up_bytes, &down_bytes}) {
      for (std::size_t flips = 1 + random.index(8); flips > 0; --flips)
        (*bytes)[random.index(bytes->size())] = static_cast<char>(random.index(256));
      if (random.unit() < 0.3) bytes->resize(random.index(bytes->size()));
    }
    v1::UpPacket up_packet;
    if (up_packet.ParseFromString(up_bytes))
      for (const v1::CutRun& run : up_packet.cuts()) ++(wire::cuts_of(run, {7}, numbers) ? read_so : refused);
    v1::DownPacket down_packet;
    if (down_packet.ParseFromString(down_bytes)) ++(wire::entries_of(down_packet, numbers) ? read_so : refused);
  }
  std::printf("%zu refused, %zu read otherwise or unharmed\n", refused, read_so);
  EXPECT_GT(refused, 100u);
  EXPECT_GT(read_so, 100u);
  v1::CutRun run;
  EXPECT_FALSE(wire::cuts_of(run, {7}, numbers));
  run.set_tool_number(1);
  for (int i = 0; i < 7; ++i) run.add_start(0);
  EXPECT_FALSE(wire::cuts_of(run, {7}, numbers)) << "without cuts";
  run.set_cuts(std::string("\xff\xff\xff\xff\xff\xff\xff\xff\x7f", 9));
  EXPECT_FALSE(wire::cuts_of(run, {7}, numbers)) << "2^61 knots";
  run.set_cuts(std::string("\0", 1));
  EXPECT_TRUE(wire::cuts_of(run, {7}, numbers)) << "stands where it is";
  run.set_level(3);
  EXPECT_FALSE(wire::cuts_of(run, {7}, numbers));
  run.set_level(0);
  run.set_start(6, 40000);
  EXPECT_FALSE(wire::cuts_of(run, {7}, numbers));
}

struct Bytes {
  double a_cut = 0, head = 0, plain = 0;
};

Bytes bytes_of(const std::vector<Cut>& cuts) {
  SendWindow window(kWide);
  wire::ToolNumbers numbers;
  for (const Cut& cut : cuts)
    if (!numbers.number_of(cut.tool)) numbers.add(static_cast<std::uint32_t>(1 + cut.spindle_rpm % 100), cut.tool);
  wire::CutSender sender(window, numbers);
  Bytes sum;
  for (Cut cut : cuts) {
    cut.author_seq = window.next();
    EXPECT_TRUE(sender.push(cut));
    const SendItem& item = window.item(cut.author_seq);
    sum.a_cut += static_cast<double>(item.bytes.size());
    sum.head += static_cast<double>(item.head.size() + wire::kRunBytes);
    sum.plain += static_cast<double>(wire::to_wire(cut).ByteSizeLong());
  }
  const auto count = static_cast<double>(cuts.size());
  return {sum.a_cut / count, sum.head / count, sum.plain / count};
}

TEST(CutRun, BytesOfRealCuts) {
  const auto recording =
      test::read_recording(test::source_dir() / "tests" / "scenario" / "recordings" / "drill_and_burr");
  ASSERT_TRUE(recording) << recording.error().message;
  std::vector<Cut> cuts = recording->cuts;
  for (Cut& cut : cuts) cut.path_us = 7000;
  const Bytes recorded = bytes_of(cuts);

  // A free hand with a bur: 30 mm/s round an ellipse, turning, trembling by 0.05 mm and 0.2 degrees, 3 knots in 8 ms.
  Random random(5);
  std::vector<Cut> free_hand;
  Cut cut;
  cut.tool = digest(1);
  cut.path_us = 8000;
  cut.spindle_rpm = 20000;
  for (int i = 0; i < 1000; ++i) {
    QuantisedPose last = cut.path.empty() ? QuantisedPose{} : cut.path.back();
    cut.path.assign(1, last);
    for (int k = 0; k < 2; ++k) {
      const double t = i * 0.008 + k * 0.004;
      const Vec3 tip(10 * std::cos(3 * t), 8 * std::sin(3 * t), -1);
      Pose pose = pose_along(tip + random.in_cube(0.05), {0.3 * std::sin(t), 0.2, -1});
      pose.rotation =
          pose.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(random.between(-0.0035, 0.0035), random.direction()));
      cut.path.push_back(quantise(pose));
    }
    free_hand.push_back(cut);
  }
  const Bytes wild = bytes_of(free_hand);
  std::printf("recorded: %zu cuts, %.1f B a cut in a run, %.1f B a head, %.1f B as plain messages\n", cuts.size(),
              recorded.a_cut, recorded.head, recorded.plain);
  std::printf("free hand: %.1f B a cut in a run, %.1f B a head, %.1f B as plain messages\n", wild.a_cut, wild.head,
              wild.plain);
  EXPECT_LE(recorded.a_cut, 20.0);
  EXPECT_LE(wild.a_cut, 40.0);
}

// A surgeon drills and burrs as recorded for 8 s, then holds the tool still for 8 s. Counts the bytes of the uplink
// with headers and seal. Every packet has the pose while the tool moves. 30 packets a second have the effort.
TEST(PacketFiller, UplinkBytesOfDrillingAndRest) {
  const auto recording =
      test::read_recording(test::source_dir() / "tests" / "scenario" / "recordings" / "drill_and_burr");
  ASSERT_TRUE(recording) << recording.error().message;
  for (const double loss : {0.0, 0.3}) {
    Random random(1);
    SendWindow window({16 * 1024, 4096, wire::kRunBytes});
    wire::ToolNumbers numbers;
    for (const Cut& cut : recording->cuts)
      if (!numbers.number_of(cut.tool)) numbers.add(cut.spindle_rpm, cut.tool);
    wire::CutSender sender(window, numbers);
    SendRate rate;
    ReceiveWindow<int> in;
    std::deque<std::pair<SendWindow::Time, std::uint64_t>> answers;  // at the sender, 80 ms after the packet
    std::uint64_t counter = 0, received = 0, answered = 0;
    std::array<double, 2> bytes{};
    std::array<int, 2> packets{};
    SendWindow::Time effort_at{};
    CuttingState state;
    for (auto t = 0ms; t < 16s; t += 1ms) {
      const bool cutting = t < 8s;
      while (!answers.empty() && answers.front().first <= t) {
        window.acknowledge(answers.front().second);
        answers.pop_front();
      }
      const auto next = static_cast<std::size_t>(t / 8ms);
      if (cutting && t % 8ms == 0ms && next < recording->cuts.size()) {
        Cut cut = recording->cuts[next];
        cut.author_seq = window.next();
        cut.path_us = 8000;
        ASSERT_TRUE(sender.push(cut));
        ++state.state_seq;
        state.pose_bone_tool = dequantise(cut.path.back());
        state.pose_bone_device = state.pose_bone_tool;
        state.pose_bone_device.position_mm.z() -= 0.7;
      }
      const int repeats = rate.repeats();
      const auto wanted = cutting ? t : window.next_due(t, repeats).value_or(SendWindow::Time::max());
      if (rate.next(t, wanted, 100 + window.least_room(t)) > t) continue;
      wire::PacketFiller<v1::UpPacket> filler(rate.budget(t) - kSealBytes);
      v1::UpPacket head;
      v1::PacketTimes& times = *head.mutable_times();
      times.set_sent_us(static_cast<std::uint64_t>(1'000'000'000 + t / 1us));
      times.set_echo_sent_us(static_cast<std::uint64_t>(2'000'000'000 + t / 1us));
      times.set_echo_received_us(static_cast<std::uint64_t>(1'000'000'000 + t / 1us));
      times.set_received_counter(++counter + 1000);
      times.set_received_packets(counter);
      head.set_acknowledged(1000 + counter);
      if (cutting) *head.mutable_state() = wire::to_tool_state(state, 1, t - effort_at >= 33ms);
      if (head.state().has_effort()) effort_at = t;
      ASSERT_TRUE(filler.add(head));
      const auto picked = filler.add_items(window, t, repeats);
      const std::size_t size = filler.take().size() + kSealBytes;
      ASSERT_LE(size, kMostDatagramBytes);
      rate.sent(t, size);
      bytes[cutting ? 0 : 1] += static_cast<double>(size + 28);
      ++packets[cutting ? 0 : 1];
      if (random.unit() < loss) continue;
      ++received;
      rate.acknowledge(counter, received);
      for (const std::uint64_t number : picked.numbers) in.insert(number, 0);
      while (in.take()) {
      }
      if (in.acknowledged() > answered) answers.emplace_back(t + 80ms, answered = in.acknowledged());
    }
    const double cutting_kbit = bytes[0] * 8 / 8000.0, idle_kbit = bytes[1] * 8 / 8000.0;
    std::printf("loss %2.0f %%: %.0f kbit/s in %.0f B packets while cutting, %.1f kbit/s idle (%.1f %% less)\n",
                100 * loss, cutting_kbit, bytes[0] / packets[0], idle_kbit, 100 * (1 - idle_kbit / cutting_kbit));
    EXPECT_TRUE(window.empty());
    EXPECT_LE(cutting_kbit, 300.0);
    EXPECT_LE(idle_kbit, 0.2 * cutting_kbit);
  }
}

TEST(PacketFiller, FillsUpToItsBudgetAndLeavesOutWhatDoesNotFit) {
  const wire::ToolNumbers numbers = numbers_1_to_3();
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const std::size_t budget = random.index(kMostPlainBytes + 1);
    SendWindow window(kWide);
    wire::EntrySender sender(window, numbers);
    for (const Cut& cut : any_cuts(random, random.index(100), false)) ASSERT_TRUE(sender.push(committed(cut)));
    wire::PacketFiller<v1::DownPacket> filler(budget);
    v1::DownPacket head;
    head.set_acknowledged(any(random));
    head.mutable_times()->set_sent_us(123456789);
    const bool has_head = filler.add(head);
    const auto picked = filler.add_items(window, 0s, 1);
    std::size_t partners = 0;
    for (std::uint64_t p = 1; p <= 8; ++p) {
      v1::DownPacket part;
      CuttingState state;
      state.author = {p};
      state.state_seq = 9;
      *part.add_partners() = wire::to_tool_state(state, 0, random.unit() < 0.5);
      if (filler.add(part)) ++partners;
    }
    const std::string bytes = filler.take();
    ASSERT_LE(bytes.size(), budget);
    v1::DownPacket packet;
    ASSERT_TRUE(packet.ParseFromString(bytes));
    ASSERT_EQ(static_cast<std::size_t>(packet.partners_size()), partners);
    ASSERT_EQ(packet.has_times(), has_head);
    if (has_head) {
      ASSERT_EQ(packet.acknowledged(), head.acknowledged());
    }
    const auto entries = wire::entries_of(packet, numbers);
    ASSERT_TRUE(entries);
    ASSERT_EQ(entries->size(), picked.numbers.size());
    for (std::size_t r = 0; r < entries->size(); ++r) ASSERT_EQ((*entries)[r].index, picked.numbers[r]);
  }
}

TEST(ToolState, ComesBackWithinItsSteps) {
  CuttingState state;
  state.author = {4};
  state.state_seq = 99;
  state.pose_bone_tool = pose_along({1, -2, 300}, {1, 0, 0.5});
  state.pose_bone_device = pose_along({1.2, -2, 300}, {1, 0.1, 0.5});
  state.tool_name = "burr-round-5";
  state.spindle_rpm = 20000;
  state.feed_mm_per_s = 1.2345;
  state.density_g_cm3 = 1.85;
  state.engaged_fraction = 0.25;
  state.force_physical_N = {1, -2.5, 3};
  state.torque_Nmm = -12.34;
  state.depth_mm = -3.5;
  state.phase = CuttingPhase::cutting;
  state.on_metal = state.irrigation = true;
  state.flutes_full = 0.625;
  state.force_hand_N = 3.25;
  state.device_holds_N = 0.88;
  state.time_ns = 123'456'789'012'345;
  state.cortex_mm = 4.567;
  state.seated = 0.375;
  state.blows = 70'000;
  state.blow_impulse_N_s = 2.8;
  wire::KnownToolState known;
  const v1::ToolState full = wire::to_tool_state(state, 5, true);
  ASSERT_TRUE(wire::take_over(full, known).value());
  EXPECT_EQ(known.state.author, state.author);
  EXPECT_EQ(known.buttons, 5u);
  EXPECT_TRUE(known.state.on_metal);
  EXPECT_TRUE(known.state.irrigation);
  EXPECT_FALSE(known.state.suction);
  EXPECT_EQ(known.state.flutes_full, 0.625);
  EXPECT_EQ(known.state.tool_name, state.tool_name);
  EXPECT_EQ(known.state.spindle_rpm, 20000);
  EXPECT_NEAR(known.state.feed_mm_per_s, 1.2345, 0.0005 + 1e-9);
  EXPECT_NEAR(known.state.density_g_cm3, 1.85, 1e-9);
  EXPECT_NEAR(known.state.torque_Nmm, -12.34, 1e-9);
  EXPECT_EQ(known.state.depth_mm, -3.5);
  EXPECT_EQ(known.state.engaged_fraction, 0.25);
  EXPECT_EQ(known.state.force_physical_N, state.force_physical_N);
  EXPECT_EQ(known.state.phase, state.phase);
  EXPECT_EQ(known.state.force_hand_N, 3.25);
  EXPECT_NEAR(known.state.device_holds_N, 0.88, 1e-9);
  EXPECT_EQ(known.state.time_ns, 123'456'789'012'000) << "microseconds";
  EXPECT_NEAR(known.state.cortex_mm, 4.567, 0.005);
  EXPECT_EQ(known.state.seated, 0.375);
  EXPECT_EQ(known.state.blows, 70'000u);
  EXPECT_NEAR(known.state.blow_impulse_N_s, 2.8, 1e-9);
  EXPECT_LT((known.state.pose_bone_tool.position_mm - state.pose_bone_tool.position_mm).norm(), 0.001);
  EXPECT_LT(known.state.pose_bone_device.rotation.angularDistance(state.pose_bone_device.rotation), 2e-4);
  // A pose alone leaves the effort unchanged. An old state changes nothing.
  state.state_seq = 100;
  state.pose_bone_tool.position_mm.x() = 7;
  state.force_physical_N = {0, 0, 0};
  state.irrigation = false;
  state.suction = true;
  state.time_ns += 16'000'000;
  state.blows = 70'002;  // the state between was lost
  const v1::ToolState pose_only = wire::to_tool_state(state, 0, false);
  ASSERT_TRUE(wire::take_over(pose_only, known).value());
  EXPECT_EQ(known.state.pose_bone_tool.position_mm.x(), 7);
  EXPECT_EQ(known.state.force_physical_N, Vec3(1, -2.5, 3));
  EXPECT_FALSE(known.state.irrigation);
  EXPECT_TRUE(known.state.suction);
  EXPECT_EQ(known.state.flutes_full, 0.625);
  EXPECT_EQ(known.state.time_ns, 123'456'805'012'000);
  EXPECT_EQ(known.state.blows, 70'002u);
  EXPECT_FALSE(wire::take_over(full, known).value());
  EXPECT_EQ(known.state.state_seq, 100u);
  std::printf("a state: %zu B with its effort, %zu B without\n", full.ByteSizeLong(), pose_only.ByteSizeLong());
  EXPECT_LE(pose_only.ByteSizeLong(), 80u);
}

TEST(ToolState, RefusesBadOnesByTheNameOfTheField) {
  const auto refused = [](const std::function<void(v1::ToolState&)>& change, const std::string& field) {
    CuttingState state;
    state.state_seq = 2;
    v1::ToolState bad = wire::to_tool_state(state, 0, true);
    bad.set_phase(v1::CUTTING_PHASE_FREE);
    change(bad);
    wire::KnownToolState known;
    const auto answer = wire::take_over(bad, known);
    ASSERT_FALSE(answer) << field;
    EXPECT_NE(answer.error().message.find(field), std::string::npos) << answer.error().message;
    EXPECT_EQ(known.state.state_seq, 0u);
  };
  refused([](v1::ToolState& s) { s.mutable_pose_bone_tool()->add_position(1); }, "pose_bone_tool");
  refused([](v1::ToolState& s) { s.mutable_pose_bone_tool()->set_rotation(3, 100); }, "pose_bone_tool");
  refused([](v1::ToolState& s) { s.mutable_pose_bone_device()->add_rotation(70000); }, "pose_bone_device");
  refused([](v1::ToolState& s) { s.set_phase(v1::CUTTING_PHASE_UNSPECIFIED); }, "phase");
  refused([](v1::ToolState& s) { s.mutable_effort()->add_force(1); }, "effort.force");
  refused([](v1::ToolState& s) { s.mutable_effort()->set_engaged(1001); }, "effort.engaged");
  refused([](v1::ToolState& s) { s.mutable_effort()->set_tool_name(std::string(65, 'x')); }, "effort.tool_name");
  refused([](v1::ToolState& s) { s.mutable_effort()->set_seated(1001); }, "effort.seated");
  refused([](v1::ToolState& s) { s.set_time_us(std::numeric_limits<std::uint64_t>::max()); }, "time_us");
}

}  // namespace
}  // namespace osteon
