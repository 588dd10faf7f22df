// From where, and over what, a listener hears the tools.
#pragma once
#include <string>
#include <vector>

#include "audio_client/space/sound_path.hpp"
#include "common/core/result.hpp"

namespace CLI {  // the library's
class App;
}

namespace osteon::audio {

struct ListeningOption {
  std::string listen = "loudspeakers", hrtf;
  std::vector<double> listener_mm, up;  // empty: the usual ones
};

// Adds --listen, --hrtf, --listener and --listener-up. `listening` outlives `command`.
void add_listening(CLI::App& command, ListeningOption& listening);

// The listener, with the middle of the bone at the origin; move_to_bone() moves it. Errors: invalid_input, not_found
// (--hrtf).
[[nodiscard]] Result<Space> read(const ListeningOption& option, double rate_hz);
void move_to_bone(Space& space, const Vec3& centre_mm);

}  // namespace osteon::audio
