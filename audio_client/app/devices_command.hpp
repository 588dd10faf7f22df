// osteon-audio devices: the sinks and sources that --device can name.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

// Adds the command. Parsing sets `chosen` if it was given; it returns the text for standard output.
void add_devices_command(CLI::App& app, std::function<Result<std::string>()>& chosen);

}  // namespace osteon::audio
