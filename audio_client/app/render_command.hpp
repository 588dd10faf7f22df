// osteon-audio render: the sound of a recorded session, without a room.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

// Adds the command "render". Parsing sets `chosen` if it was given; it returns the text for standard output.
void add_render_command(CLI::App& app, std::function<Result<std::string>()>& chosen);

}  // namespace osteon::audio
