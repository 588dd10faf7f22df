// Tests that a bone is a function of the set of its cuts. Applies random cuts of all tools in random orders, some of
// them again, and compares the hashes of the fields.
// Takes cuts, orders, threads that share a cut and, if wanted, the number of the first order (each number is another
// order) and how many samples the kernel computes at once. Prints JSON, and progress to stderr. Linked with differently
// built kernels it must print the same hash.
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <set>
#include <thread>

#include "common/field/kernel.hpp"
#include "common/volume/cut_field.hpp"
#include "tests/support/scenes/random_cuts.hpp"

namespace osteon::test {
namespace {

// Shared by the threads. Guarded by `mutex`.
struct Tally {
  std::mutex mutex;
  std::set<Digest> names;
  std::set<std::uint64_t> orders;  // by a hash of each
  int done = 0, differing = 0;
};

CutField apply_in_order(const Case& bone, const std::vector<Cut>& cuts, const std::vector<std::size_t>& order) {
  CutField field(bone, BodyId{});
  for (const std::size_t i : order) field.apply(cuts[i]);
  return field;
}

// FNV-1a over the indices of an order.
std::uint64_t number_of(const std::vector<std::size_t>& order) {
  std::uint64_t number = 0xcbf29ce484222325u;
  for (const std::size_t place : order) number = (number ^ place) * 0x100000001b3u;
  return number;
}

int run(std::size_t count, int orders, int threads, int first_order, int lanes) {
  const int used = limit_kernel_lanes(lanes);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const Case bone = ball_of_bone();
  Random random(1);
  const std::vector<Cut> cuts = grazing_cuts(count, random);
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };

  // The expected result of all orders: the order in which the cuts were made.
  std::vector<std::size_t> plain(count);
  for (std::size_t i = 0; i < count; ++i) plain[i] = i;
  const CutField reference = apply_in_order(bone, cuts, plain);
  const Digest expected = reference.hash();
  // A field that is cut away everywhere would be the same after any order.
  std::size_t samples = 0, between = 0;
  for (const FieldLeaf& leaf : reference.leaves()) {
    const auto band = static_cast<std::int16_t>(4.0 * 1024.0 * level_pitch_mm(bone.pitch_mm(), leaf.level));
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      const std::int16_t value = leaf.value(i);
      ++samples;
      between += value > -band && value < band ? 1 : 0;
    }
  }

  Tally tally;
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int i = next++; i < orders; i = next++) {
      Random own(1000 + static_cast<std::uint64_t>(first_order + i));
      const std::vector<std::size_t> order = order_with_repeats(count, count / 10, own);
      const Digest name = apply_in_order(bone, cuts, order).hash();
      const std::lock_guard lock(tally.mutex);
      tally.names.insert(name);
      tally.orders.insert(number_of(order));
      tally.differing += name == expected ? 0 : 1;
      ++tally.done;
      if (tally.done == orders || tally.done % std::max(1, orders / 20) == 0)
        std::fprintf(stderr, "%d of %d orders, %d differ, %.0f s\n", tally.done, orders, tally.differing, seconds());
    }
  };
  // If each cut has one thread, as many orders run at once as there are processors. Otherwise one after the other.
  const int at_once = threads == 1 ? std::max(1, static_cast<int>(std::thread::hardware_concurrency())) : 1;
  std::vector<std::jthread> pool;
  for (int i = 0; i < at_once; ++i) pool.emplace_back(work);
  pool.clear();

  tally.names.insert(expected);
  std::printf(
      "{\"cuts\": %zu, \"orders\": %d, \"threads\": %d, \"lanes\": %d, \"seconds\": %.1f, \"tools\": %zu, "
      "\"names\": %zu, \"differing\": %d, \"partly_cut\": %.4f, \"name\": \"%s\", \"order_numbers\": [",
      count, orders, threads, used, seconds(), cutting_tools(), tally.names.size(), tally.differing,
      samples == 0 ? 0.0 : static_cast<double>(between) / static_cast<double>(samples), to_hex(expected).c_str());
  const char* before = "";
  for (const std::uint64_t number : tally.orders) {
    std::printf("%s\"%016llx\"", before, static_cast<unsigned long long>(number));
    before = ", ";
  }
  std::printf("]}\n");
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const long cuts = argc > 1 ? std::atol(argv[1]) : 0;
  const int orders = argc > 2 ? std::atoi(argv[2]) : 0, threads = argc > 3 ? std::atoi(argv[3]) : 0;
  const int first_order = argc > 4 ? std::atoi(argv[4]) : 0, lanes = argc > 5 ? std::atoi(argv[5]) : 16;
  if (cuts < 1 || cuts > 1000000 || orders < 1 || threads < 1 || threads > 64 || first_order < 0 || lanes < 4) {
    std::fprintf(stderr, "osteon-set-property: needs the numbers of cuts, of orders and of threads\n");
    return 1;
  }
  return osteon::test::run(static_cast<std::size_t>(cuts), orders, threads, first_order, lanes);
}
