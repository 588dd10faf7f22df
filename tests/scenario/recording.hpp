// A recorded session: its cuts in the order in which they were made, and the hash of the field that they leave in the
// scene's bone. Tests replay it. osteon-record-scenarios makes it again after a change of the kernel.
#pragma once
#include <filesystem>
#include <vector>

#include "common/core/digest.hpp"
#include "common/core/result.hpp"
#include "common/field/cut.hpp"
#include "common/volume/case.hpp"

namespace osteon::test {

struct Recording {
  std::vector<Cut> cuts;
  Digest field_hash;
};

// The bone of every recording: a plain block, 20 mm square and 5 mm thick, h = 0.5 mm.
[[nodiscard]] Case recorded_bone();

// FILE.cuts holds length-delimited Cut messages, FILE.hash the hash in hexadecimal.
[[nodiscard]] Result<Recording> read_recording(const std::filesystem::path& stem);
[[nodiscard]] Result<void> write_recording(const std::filesystem::path& stem, const Recording& recording);

}  // namespace osteon::test
