// Targets for the files of a case and for its cut fields.
#include <cmath>
#include <filesystem>
#include <span>
#include <string_view>

#include "common/core/check.hpp"
#include "common/core/digest.hpp"
#include "common/field/kernel.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/field_file.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/import_targets.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/described_case.hpp"

namespace osteon::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr double kCasePitch_mm = 1.0;

const Case& a_case() {
  static const Case made = test::plain_block(4.0, 3.0, kCasePitch_mm);
  return made;
}

const CaseScan& a_scan() {
  static const CaseScan made = test::turned_scan();
  return made;
}

// A case in which every field of the description is set.
const Case& a_described_case() {
  static const Case made = [] {
    const auto built = test::described_ball(test::full_description(a_scan()));
    OSTEON_CHECK(built.has_value());
    return *built;
  }();
  return made;
}

// A valid case in a folder. The input replaces one of its files.
class CaseFolder {
 public:
  CaseFolder() { OSTEON_CHECK(a_described_case().save(folder_ / "case", a_scan())); }
  [[nodiscard]] fs::path path() const { return folder_ / "case"; }
  [[nodiscard]] Bytes file(const char* name) const { return bytes_of_file(path() / name); }

 private:
  test::TempDir folder_;
};

void load_case(const fs::path& folder) {
  const auto loaded = Case::load(folder);
  if (!loaded) return expect_bounded(loaded.error());
  OSTEON_CHECK(loaded->pitch_mm() > 0.0 && loaded->volume_mm3() >= 0.0);
  (void)loaded->surface_mm(Vec3::Zero());
}

void read_with(std::span<const std::uint8_t> data, const char* name) {
  static const CaseFolder sound;
  static const InputFile info("case.json"), volume("bone.vdb");
  const bool is_info = std::string_view(name) == "case.json";
  const InputFile& changed = is_info ? info : volume;
  const char* other = is_info ? "bone.vdb" : "case.json";
  if (!fs::exists(changed.folder() / other)) fs::copy_file(sound.path() / other, changed.folder() / other);
  changed.write(data);
  load_case(changed.folder());
}

// The bone with all that schema 2 has, and the same bone in schema 1.
std::vector<Bytes> descriptions() {
  CaseInfo earlier{
      .title = "A femur", .source = "closed form", .pitch_mm = 0.5, .calibration = {}, .threshold_hu = 0.0};
  earlier.schema_version = 1;
  const auto bone = test::described_ball(earlier);
  OSTEON_CHECK(bone.has_value());
  return {CaseFolder().file("case.json"), bytes_of_text(to_text({earlier, bone->hash()}))};
}

// An accepted scan is the one that the case describes.
void read_scan(std::span<const std::uint8_t> data) {
  static const InputFile file("scan.vdb");
  const auto scan = load_scan(file.write(data).parent_path(), a_described_case());
  if (!scan) return expect_bounded(scan.error());
  OSTEON_CHECK(scan->hu == a_scan().hu && scan->labels == a_scan().labels && scan->tissue == a_scan().tissue);
}

// The end of a file of fields. Every input gets a valid one, because otherwise only the seal would be tested.
constexpr std::string_view kSeal = "osteon-fields-1\n";

Bytes sealed(std::span<const std::uint8_t> data) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(data));
  Bytes bytes(data.begin(), data.end());
  bytes.insert(bytes.end(), kSeal.begin(), kSeal.end());
  const Digest digest = hasher.finish();
  bytes.insert(bytes.end(), digest.bytes.begin(), digest.bytes.end());
  return bytes;
}

void read_fields(std::span<const std::uint8_t> data) {
  static const InputFile file("fields.vdb");
  const auto fields = load_fields(file.write(sealed(data)), a_case());
  if (!fields) return expect_bounded(fields.error());
  for (const FieldLeaf& leaf : fields->leaves) OSTEON_CHECK(leaf.holds_values());
}

Bytes some_fields() {
  CutField field(a_case(), BodyId{0});
  const Tool& drill = builtin_tools()[0];
  field.apply(test::straight_cut(drill, {2, 2, 2}, {2, 2, -2}, {0, 0, -1}));
  const InputFile file("fields.vdb");
  const fs::path path = file.write({});
  SavedFields saved{.case_hash = a_case().hash(),
                    .kernel_version = kKernelVersion,
                    .room_seq = {1},
                    .pitch_mm = kCasePitch_mm,
                    .leaves = field.leaves(),
                    .bodies = {BodyId{0}}};
  OSTEON_CHECK(save_fields(path, saved));
  Bytes bytes = bytes_of_file(path);
  bytes.resize(bytes.size() - kSeal.size() - sizeof(Digest::bytes));
  return bytes;
}

}  // namespace

Target case_info_target() {
  Target target{"case_info", [](std::span<const std::uint8_t> data) { read_with(data, "case.json"); }, descriptions()};
  target.change = change_number;
  target.mutations = 200;
  return target;
}

Target bone_volume_target() {
  Target target{"bone_volume",
                [](std::span<const std::uint8_t> data) { read_with(data, "bone.vdb"); },
                {CaseFolder().file("bone.vdb")}};
  target.mutations = 300;
  return target;
}

Target scan_volume_target() {
  Target target{"scan_volume", read_scan, {CaseFolder().file("scan.vdb")}};
  target.mutations = 300;
  return target;
}

Target cut_fields_target() {
  Target target{"cut_fields", read_fields, {some_fields()}};
  target.mutations = 300;
  return target;
}

}  // namespace osteon::fuzz
