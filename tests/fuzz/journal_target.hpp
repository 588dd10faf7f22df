// What a journal may hold as fuzz targets: entries of a room, what a room began as, and the files themselves.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// Any bytes as a sequence of entries, each with its place and time: what is refused changes nothing, what is taken
// makes the same room again. Without the bone's fields, ten times as fast as with them.
[[nodiscard]] Target entries_target();
// The same with them: from a checkpoint too, and gone on with.
[[nodiscard]] Target evaluated_entries_target();
[[nodiscard]] Target genesis_target();
// Any bytes as a list of damages to a small journal: what is read or recovered is what was written, up to some entry.
[[nodiscard]] Target journal_file_target();

}  // namespace osteon::fuzz
