// Return type of a function that can fail because of a file, network, device or configuration.
#pragma once
#include <string>
#include <tl/expected.hpp>

namespace osteon {

enum class ErrorCode {
  invalid_input,  // a file, field or argument is not what it must be
  not_found,      // a file, case, server or device is not there
  unsupported,    // well-formed, but of a version or kind that this program does not know
  unavailable,    // a peer or device does not answer now; trying again may help
  cancelled,      // the caller asked to stop the work before it was complete
  denied,         // the caller's identity, role or rights do not permit this
  exhausted,      // more than a quota allows
  exists,         // it already exists, or another uses it
  internal,       // a library failed in a way that the user cannot fix
};

// One sentence for a person. It names the file, the field and the remedy.
struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

[[nodiscard]] inline tl::unexpected<Error> failure(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}
[[nodiscard]] inline tl::unexpected<Error> bad_input(std::string message) {
  return failure(ErrorCode::invalid_input, std::move(message));
}
[[nodiscard]] inline tl::unexpected<Error> bad_field(const std::string& field, const std::string& what) {
  return bad_input(field + " " + what);
}

}  // namespace osteon
