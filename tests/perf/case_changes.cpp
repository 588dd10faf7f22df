// Damaged cases, each validated by a process of its own like an upload. Takes the number of changes of a small case and
// of a large one, and prints JSON. "unchanged": the changed bytes have no meaning, so it is the same case.
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "common/volume/case.hpp"
#include "server/upload_validation/case_check.hpp"
#include "tests/support/changed_bytes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

struct Counts {
  int changed = 0, refused = 0, unchanged = 0, other = 0;
  std::size_t longest = 0;  // bytes of a sentence
};

long peak_mib() {
  rusage used{};
  ::getrusage(RUSAGE_CHILDREN, &used);
  return used.ru_maxrss / 1024;
}

// A solid case whose densities cannot be compressed: a file of 65 MB.
Result<Case> large_case() {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> density(0.2f, 1.0f);
  const FillPart fill = [&](const CoordBox&, PartSamples& samples) {
    for (float& value : samples.density_g_cm3) value = density(random);
    return PartKind::inside;
  };
  return Case::build(
      {.title = "A large block", .source = "noise", .pitch_mm = 0.5, .calibration = {}, .threshold_hu = 0},
      {{0, 0, 0}, {255, 255, 247}}, fill);
}

void change(const fs::path& folder, const fs::path& place, int count, std::mt19937& random, const Digest& hash,
            Counts& counts) {
  std::ostringstream out;
  out << std::ifstream(folder / "bone.vdb", std::ios::binary).rdbuf();
  const std::string sound = out.str();
  for (int i = 0; i < count; ++i) {
    std::ofstream(folder / "bone.vdb", std::ios::binary) << test::changed_bytes(sound, random);
    fs::remove_all(place);
    fs::create_directory(place);
    if (!pack_case(folder, place / "case.zip")) continue;
    ++counts.changed;
    const auto checked = check_case(test::program("osteon-server"), place / "case.zip", place, {});
    if (!checked) counts.longest = std::max(counts.longest, checked.error().message.size());
    ++(!checked ? counts.refused : checked->hash == hash ? counts.unchanged : counts.other);
  }
}

int run(int small_count, int large_count) {
  const test::TempDir temp;
  std::mt19937 random(1);
  Counts counts;
  const Case small = test::plain_block(4, 2, 1.0);
  const Result<Case> large = large_case();
  if (!large || !small.save(temp / "small") || !large->save(temp / "large")) return 1;
  const auto large_bytes = fs::file_size(temp / "large" / "bone.vdb");
  change(temp / "small", temp / "place", small_count, random, small.hash(), counts);
  const long small_mib = peak_mib();
  change(temp / "large", temp / "place", large_count, random, large->hash(), counts);
  const nlohmann::json said{{"changed", counts.changed},
                            {"refused", counts.refused},
                            {"unchanged", counts.unchanged},
                            {"other", counts.other},
                            {"longest_sentence_bytes", counts.longest},
                            {"large_mib", large_bytes >> 20},
                            {"peak_small_mib", small_mib},
                            {"peak_mib", peak_mib()}};
  std::printf("%s\n", said.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace osteon

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "osteon-case-changes: needs how many changes of a small case and how many of a large one\n");
    return 1;
  }
  return osteon::run(std::atoi(argv[1]), std::atoi(argv[2]));
}
