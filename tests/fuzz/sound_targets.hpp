// Fuzz targets for files of sounds that untrusted people can send: recordings, models, records of sessions, presets
// and heads.
#pragma once
#include "tests/fuzz/targets.hpp"

namespace osteon::fuzz {

[[nodiscard]] Target wav_file_target();     // WAV and RF64
[[nodiscard]] Target sound_model_target();  // a spectral model, whose digest is right
[[nodiscard]] Target session_log_target();  // a CSV of osteon-haptic --session-log
[[nodiscard]] Target preset_target();       // YAML: the sound of a group of tools
[[nodiscard]] Target head_target();         // SOFA: what the ears of a head hear from each direction

}  // namespace osteon::fuzz
