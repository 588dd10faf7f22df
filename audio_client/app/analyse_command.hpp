// osteon-audio analyse: the analysis of a recording, without a room.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

// Adds the command "analyse". Parsing sets `chosen` if it was given; it returns the text for standard output.
void add_analyse_command(CLI::App& app, std::function<Result<std::string>()>& chosen);

}  // namespace osteon::audio
