// osteon-audio model and resynthesise: a recording as a small model, and the model as sound, without a room.
#pragma once
#include <functional>
#include <string>

#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

// Adds the commands. Parsing sets `chosen` if one was given; it returns the text for standard output.
void add_model_commands(CLI::App& app, std::function<Result<std::string>()>& chosen);

}  // namespace osteon::audio
