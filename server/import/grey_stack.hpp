// Reads a CT volume from PNG slices whose grey values stand for HU.
#pragma once
#include <filesystem>
#include <optional>

#include "common/core/keep_going.hpp"
#include "common/imaging/window_level.hpp"
#include "server/import/given_geometry.hpp"

namespace osteon::import {

struct GreyFormat {
  GivenGeometry given;
  // Instead of slope and intercept: the HU that the slices show from black to white.
  std::optional<imaging::Window> window;
};

// Slices are ordered by the number at the end of their names. Grey values of up to 8 or of 16 bits are taken as they
// are stored, whatever a file says of gamma; transparency is ignored. Errors: not_found (no such folder), invalid_input
// (no PNG files; a slice that is missing, damaged, in colours, or of another size or depth), exhausted (memory),
// cancelled.
[[nodiscard]] Result<CtScan> read_grey_stack(const std::filesystem::path& folder, const GreyFormat& format,
                                             const KeepGoing& keep_going);

}  // namespace osteon::import
