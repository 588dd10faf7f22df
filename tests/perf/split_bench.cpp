// Work of a room's tick when a fragment comes off a ball of bone, and when many cuts are undone. Takes the ball's size
// in samples. Prints JSON.
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "common/core/check.hpp"
#include "common/core/mutex.hpp"
#include "common/field/kernel.hpp"
#include "server/publish/session_messages.hpp"
#include "server/rooms/fragment_detector.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5;

double ms_since(std::chrono::steady_clock::time_point start) {
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::size_t bytes_of(const RoomEvent& event, double& ms) {
  const auto start = std::chrono::steady_clock::now();
  std::size_t bytes = 0;
  for (const SessionMessage& message : change_messages(event)) bytes += message.bytes->size();
  ms = ms_since(start);
  return bytes;
}

double field_megabytes(const Room& room) {
  std::size_t bytes = 0;
  for (const BodyId body : room.bodies()) bytes += room.find_field(body)->memory_bytes();
  return 1e-6 * static_cast<double>(bytes);
}

int run(int samples) {
  const double radius_mm = 0.5 * samples * kPitch_mm;
  const Case built = large_ball(radius_mm, kPitch_mm);
  Room room(built);
  SharedMutex mutex{LockRank::room};
  FragmentDetector watch(room, mutex, [&](std::vector<FieldLeaf>& leaves) {
    for (FieldLeaf& leaf : leaves) room.find_field(leaf.body)->read(leaf);
  });
  auto start = std::chrono::steady_clock::now();
  OSTEON_CHECK(watch.look().empty());
  std::printf("{\"samples\": %d, \"first_look_ms\": %.1f, ", samples, ms_since(start));

  // A bur removes a cap 6 mm high, in rows 1.5 mm apart.
  const auto burr = find_tool("burr-round-5");
  OSTEON_CHECK(burr.has_value());
  const AuthorId surgeon = room.join(MemberKind::surgeon);
  const double x0 = radius_mm - 6.0, cap = std::sqrt(radius_mm * radius_mm - x0 * x0) + 4.0;
  std::uint64_t cuts = 0;
  for (double z = cap; z > -cap; z -= 1.5)
    for (double y = -cap; y < cap; y += 20.0) {
      Cut cut = straight_cut(*burr, {x0, y, z}, {x0, std::min(cap, y + 20.0), z}, {0, 0, -1}, ++cuts);
      cut.author = surgeon;
      const auto outcome = room.submit(cut);
      OSTEON_CHECK(outcome && outcome->committed());
    }
  const double before = field_megabytes(room);
  start = std::chrono::steady_clock::now();
  std::vector<Separation> found = watch.look();
  const double look_ms = ms_since(start);
  OSTEON_CHECK(found.size() == 1);
  std::size_t mask = 0;
  for (const Fragment& fragment : found[0].fragments) mask += fragment.left.size() + fragment.taken.size();
  start = std::chrono::steady_clock::now();
  const auto split = room.split(std::move(found[0]));
  const double split_ms = ms_since(start);
  OSTEON_CHECK(split.has_value());
  double rows_ms = 0;
  const std::size_t split_bytes = bytes_of(*split, rows_ms);
  std::printf(
      "\"cuts\": %llu, \"look_ms\": %.1f, \"mask_leaves\": %zu, \"split_ms\": %.2f, \"split_leaves\": %zu, "
      "\"rows_ms\": %.2f, "
      "\"split_bytes\": %zu, \"field_mb_before\": %.2f, \"field_mb\": %.2f, ",
      static_cast<unsigned long long>(cuts), look_ms, mask, split_ms, split->leaves.size(), rows_ms, split_bytes,
      before, field_megabytes(room));
  // Undoes cuts elsewhere. They do not affect the split.
  for (int i = 0; i < 100; ++i) {
    Cut cut = straight_cut(*burr, {-radius_mm + 1.5, -10.0 + 0.2 * i, 0}, {-radius_mm + 1.5, -9.8 + 0.2 * i, 0},
                           {1, 0, 0}, ++cuts);
    cut.author = surgeon;
    const auto outcome = room.submit(cut);
    OSTEON_CHECK(outcome && outcome->committed());
  }
  start = std::chrono::steady_clock::now();
  const auto undone = room.undo_last(surgeon, 100, {});
  std::printf("\"undo_100_ms\": %.2f, \"undo_leaves\": %zu, ", ms_since(start), undone->leaves.size());
  // Undoes a cut of the kerf, which also undoes the split.
  start = std::chrono::steady_clock::now();
  const auto back = room.undo_last(surgeon, 1, {});
  std::printf("\"undo_split_ms\": %.2f, ", ms_since(start));
  start = std::chrono::steady_clock::now();
  const auto again = room.redo_last(surgeon, 1);
  std::printf("\"redo_split_ms\": %.2f, \"bodies\": %zu}\n", ms_since(start), room.bodies().size());
  OSTEON_CHECK(undone.has_value() && back.has_value() && again.has_value());
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const int samples = argc > 1 ? std::atoi(argv[1]) : 0;
  if (samples < 40) {
    std::fprintf(stderr, "osteon-split-bench: needs the ball's size in samples, 40 or more\n");
    return 1;
  }
  return osteon::test::run(samples);
}
