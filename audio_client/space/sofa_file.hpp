// Head-related transfer functions from a SOFA file (AES69), by libmysofa.
#pragma once
#include <filesystem>

#include "audio_client/space/hrtf.hpp"

namespace osteon::audio {

// `file`: empty: the library's own default, which Debian's package libmysofa1 has (MIT's KEMAR). The responses are
// converted to `rate_hz`. Errors: not_found (there is no such file), invalid_input (it has no such functions).
[[nodiscard]] Result<Hrtf> read_hrtf(const std::filesystem::path& file, double rate_hz);

}  // namespace osteon::audio
