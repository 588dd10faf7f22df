#include "audio_client/output/audio_output.hpp"

#include "common/core/check.hpp"

namespace osteon::audio {

Result<OutputKind> output_kind(std::string_view name) {
  if (name == "pulse") return OutputKind::pulse;
  if (name == "none") return OutputKind::none;
  return failure(ErrorCode::invalid_input,
                 "there is no output \"" + std::string(name) + "\"; choose --output pulse or --output none");
}

Result<std::unique_ptr<AudioOutput>> open_output(const OutputParams& params, SoundSource& source) {
  OSTEON_CHECK(params.rate_hz > 0 && params.frames > 0 && params.buffers > 0);
  if (params.kind == OutputKind::none) return make_paced_output(params, source);
  return open_pulse_output(params, source);
}

}  // namespace osteon::audio
