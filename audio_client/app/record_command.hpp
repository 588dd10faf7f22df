// osteon-audio record: a source of the sound server into a WAV file (Niu 2008, section 8.4), without a room.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

// Adds the command "record". Parsing sets `chosen` if it was given; it returns the text for standard output.
void add_record_command(CLI::App& app, std::function<Result<std::string>()>& chosen);

}  // namespace osteon::audio
