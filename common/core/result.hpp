// What a function returns when the world (file, network, device, configuration) can make it fail.
#pragma once
#include <string>
#include <tl/expected.hpp>

namespace osteon {

enum class ErrorCode {
  invalid_input,  // a file, field or argument is not what it must be
  not_found,      // a file, case, server or device is not there
  unsupported,    // well-formed, but of a version or kind that this program does not know
  unavailable,    // a peer or device does not answer now; trying again may help
  cancelled,      // the user asked to stop
  denied,         // the caller may not do that here
  exhausted,      // more than a quota allows
  exists,         // it is already there, or in use by another
  internal,       // a library failed in a way that the user cannot mend
};

// One sentence for a person: it names the file, the field and the remedy.
struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

[[nodiscard]] inline tl::unexpected<Error> failure(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

}  // namespace osteon
