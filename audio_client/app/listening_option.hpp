// From where, and over what, a listener hears the tools.
#pragma once
#include <string>
#include <vector>

#include "audio_client/space/sound_path.hpp"
#include "common/core/result.hpp"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace osteon::audio {

struct ListeningOption {
  std::string listen = "loudspeakers", hrtf;
  std::vector<double> listener_mm, up;  // empty: the usual ones
};

// Adds --listen, --hrtf, --listener and --listener-up. `middle`: what the listener looks at ("the bone"). `listening`
// outlives `command`.
void add_listening(CLI::App& command, ListeningOption& listening, const std::string& middle);

// The listener, with that middle at the origin; move_to_middle() moves it. Errors: invalid_input, not_found (--hrtf).
[[nodiscard]] Result<Space> read(const ListeningOption& option, double rate_hz);
void move_to_middle(Space& space, const Vec3& middle_mm);

}  // namespace osteon::audio
