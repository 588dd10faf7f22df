// Cut fields in a .vdb file: one grid per body and level, with the case's hash and the room's place.
#pragma once
#include <filesystem>
#include <vector>

#include "common/volume/cut_field.hpp"

namespace osteon {

struct SavedFields {
  Digest case_hash;
  std::uint32_t kernel_version = 0;
  RoomSeq room_seq;
  std::vector<FieldLeaf> leaves;  // of all bodies, sorted by (body, level, origin)
  std::vector<BodyId> bodies;     // those that exist, also without leaves
};

// Writes beside `file` and renames, so no half-written file is ever seen. Errors: internal (disk).
[[nodiscard]] Result<void> save_fields(const std::filesystem::path& file, const SavedFields& fields, double pitch_mm);
// Errors: not_found; invalid_input (not a field file, damaged, values that no cut leaves).
[[nodiscard]] Result<SavedFields> load_fields(const std::filesystem::path& file);

}  // namespace osteon
