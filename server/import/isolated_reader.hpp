// Runs a reader of foreign files in a child process, so that a library that aborts on a damaged file costs one clear
// sentence instead of the program.
#pragma once
#include <filesystem>
#include <functional>

#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"

namespace osteon::import {

// Called by the reader before each file that it opens.
using AtFile = std::function<void(const std::filesystem::path&)>;
using ScanReader = std::function<Result<CtScan>(const AtFile& at_file, const KeepGoing& keep_going)>;

// The reader's result. A child that dies is an error (invalid_input) naming the file that it had open; what libraries
// print on the way is dropped. Call it before the program has other threads.
[[nodiscard]] Result<CtScan> read_isolated(const ScanReader& reader, const KeepGoing& keep_going);

}  // namespace osteon::import
