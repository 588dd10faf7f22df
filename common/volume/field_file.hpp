// Cut fields in a .vdb file that other OpenVDB programs can read: one grid per body and level, with the case's hash and
// the room's place; and as text beside them the scene and the tools.
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
  double pitch_mm = 0;                // h of the case
  std::vector<FieldLeaf> leaves;      // of all bodies, sorted by (body, level, origin); none at full band everywhere
  std::vector<BodyId> bodies;         // those that exist, also without leaves; sorted
  std::vector<SceneItem> items = {};  // what stands on the bone
  std::vector<Tool> tools = {};       // that are not built in
};

// A .vdb file, and after it a seal: "osteon-fields-1\\n" and the SHA-256 of the rest. Other programs do not look there.
// Writes and syncs beside `file` and renames, so no half-written file is ever seen. Grids are named
// "cuts.body0.level2", hold R in mm, and have the transform of their level. Error: internal (disk).
[[nodiscard]] Result<void> save_fields(const std::filesystem::path& file, const SavedFields& fields);
// The file may come from anyone. Errors: not_found; unsupported (of another kernel or format); invalid_input (not a
// field file, damaged, values or places that no cut leaves, too large).
[[nodiscard]] Result<SavedFields> load_fields(const std::filesystem::path& file);
// The same, and an error (invalid_input) when it is of another case.
[[nodiscard]] Result<SavedFields> load_fields(const std::filesystem::path& file, const Case& bone);

}  // namespace osteon
