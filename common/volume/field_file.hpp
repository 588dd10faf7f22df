// Cut fields in a .vdb file that other OpenVDB programs can read: one grid for each body and level, with the case's
// hash and the room's sequence number. The scene and the tools are added as text.
#pragma once
#include <filesystem>
#include <vector>

#include "common/tools/scene_item.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon {

struct SavedFields {
  Digest case_hash;
  std::uint32_t kernel_version = 0;
  RoomSeq room_seq;
  double pitch_mm = 0;            // h of the case
  std::vector<FieldLeaf> leaves;  // of all bodies, sorted by (body, level, origin); no leaf is at full band everywhere
  std::vector<BodyId> bodies;     // existing bodies, also those without leaves; sorted
  std::vector<SceneItem> items = {};  // items on the bone
  std::vector<Tool> tools = {};       // tools that are not built in
};

// A .vdb file followed by a seal: "osteon-fields-1\\n" and the SHA-256 of the rest. Other programs ignore the seal. The
// file is written and synced beside `file` and then renamed, so that a partly written file is never visible. Grids are
// named "cuts.body0.level2", contain R in mm, and have the transform of their level. Error: internal (disk).
[[nodiscard]] Result<void> save_fields(const std::filesystem::path& file, const SavedFields& fields);
// The file may come from an untrusted source. Errors: not_found; unsupported (of another kernel or format);
// invalid_input (not a field file, damaged, values or positions that no cut leaves, too large).
[[nodiscard]] Result<SavedFields> load_fields(const std::filesystem::path& file);
// The same. Error invalid_input also if it belongs to another case.
[[nodiscard]] Result<SavedFields> load_fields(const std::filesystem::path& file, const Case& bone);

}  // namespace osteon
