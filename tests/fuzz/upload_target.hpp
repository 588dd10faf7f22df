// Fuzz target for uploaded archives. An archive must come out as files of a case within the quota, or not at all.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target upload_target();

}  // namespace osteon::fuzz
