// Fuzz targets for what a client shows to be admitted.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target ticket_target();           // the text, from any source
[[nodiscard]] Target ticket_contents_target();  // contents signed by the server's own key
[[nodiscard]] Target access_list_target();      // the file of revoked people and tickets

}  // namespace osteon::fuzz
