// What comes in the hand of somebody who wants to be let in.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target ticket_target();           // the text, whoever wrote it
[[nodiscard]] Target ticket_contents_target();  // contents that the server's own key has signed
[[nodiscard]] Target access_list_target();      // the file of who was revoked

}  // namespace osteon::fuzz
