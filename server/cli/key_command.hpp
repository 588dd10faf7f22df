// The command osteon-server key: shows and changes the key with which a server signs its journals.
#pragma once
#include <functional>

#include <string>

#include "common/core/result.hpp"
#include "server/journal/signing.hpp"

namespace CLI {
class App;
}

namespace osteon {

// Adds the command to the program. Parsing sets `chosen` if it was given.
void add_key_command(CLI::App& app, std::function<Result<void>()>& chosen);

// A key as 64 digits, or a file that contains them or is a signing key. Errors, naming --key: not_found, invalid_input.
[[nodiscard]] Result<PublicKey> public_key_of(const std::string& given);

}  // namespace osteon
