// Bytes that are made once and then stand unchanged within several messages. Pure.
#pragma once
#include <memory>
#include <string>
#include <string_view>

#include "common/field/cut.hpp"

namespace osteon::wire {

// The cut as a serialised osteon.v1.Cut: with fields in the order of their numbers, as protobuf writes them.
[[nodiscard]] std::shared_ptr<const std::string> encoded(const Cut& cut);

// Appends a field of kind message, string or bytes to a serialised message. The result has the same bytes as protobuf's
// own if fields are appended in the order of their numbers.
void append_field(std::string& message, int number, std::string_view content);

}  // namespace osteon::wire
