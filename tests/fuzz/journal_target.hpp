// Fuzz targets for the contents of a journal: log entries of a room, its initial state, and the files themselves.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

// Takes any bytes as a sequence of log entries, each with its sequence number and time. A refused entry must change
// nothing.
// The accepted entries must make the same room again. Does not compute the bone's fields, and is therefore ten times as
// fast.
[[nodiscard]] Target entries_target();
// The same with the bone's fields. Also starts from a checkpoint, and continues afterwards.
[[nodiscard]] Target evaluated_entries_target();
[[nodiscard]] Target genesis_target();
// Takes any bytes as a list of damages to a small journal. What is read or salvaged must equal what was written, up to
// some entry.
[[nodiscard]] Target journal_file_target();

}  // namespace osteon::fuzz
