#include "tests/perf/sound_output/output_trial.hpp"

#include <memory>
#include <utility>

#include "audio_client/space/listener.hpp"
#include "audio_client/space/sofa_file.hpp"

namespace osteon::test {

Result<audio::SynthParams> synth_of(const OutputTrial& trial) {
  const Result<audio::Listening> way = audio::listening(trial.listen);
  if (!way) return tl::unexpected(way.error());
  audio::SynthParams params;
  params.rate_hz = kOutputRate_hz;
  params.space.listening = *way;
  params.space.pose_bone_head = audio::looking(audio::usual_listener_mm(*way), Vec3::Zero(), -Vec3::UnitY());
  if (*way != audio::Listening::headphones) return params;
  Result<audio::Hrtf> hrtf = audio::read_hrtf({}, kOutputRate_hz);
  if (!hrtf) return tl::unexpected(hrtf.error());
  params.space.hrtf = std::make_shared<const audio::Hrtf>(std::move(*hrtf));
  return params;
}

nlohmann::json described(const OutputTrial& trial) {
  return {{"listen", trial.listen},
          {"frames", trial.output.frames},
          {"buffers", trial.output.buffers},
          {"awake", trial.awake}};
}

}  // namespace osteon::test
