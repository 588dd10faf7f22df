// Prints how many times as fast as it sounds the synthesis is: a scripted drilling that moves round the surgeon's head,
// heard by the head that libmysofa comes with. In processor time of one thread.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <utility>
#include <vector>

#include "audio_client/space/sofa_file.hpp"
#include "audio_client/synth/drill_synth.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace {

using namespace osteon;

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// `moving`: the filters of the ears change in every block, which is the dearest case.
double speed(audio::DrillSynth& synth, const std::vector<CuttingState>& states, bool moving) {
  std::vector<float> left(test::kFramesPerState), right(test::kFramesPerState);
  synth.reset();
  double peak = 0;
  const double from_s = processor_s();
  for (std::size_t i = 0; i < states.size(); ++i) {
    audio::SoundScene scene = audio::sound_scene({&states[i], 1}, 0);
    const double turn = moving ? 0.05 * static_cast<double>(i) : 0.0;
    scene.tools[0].tip_mm = Vec3(150 * std::cos(turn), 0, 150 * std::sin(turn));
    synth.aim(scene);
    synth.process(left, right);
    peak = std::max<double>(peak, *std::ranges::max_element(left));
  }
  const double took_s = processor_s() - from_s;
  if (peak == 0) std::fputs("nothing is heard\n", stderr);
  return peak == 0 ? 0.0 : static_cast<double>(states.size()) / 120.0 / took_s;
}

}  // namespace

int main() {
  auto hrtf = audio::read_hrtf({}, test::kRate_hz);
  if (!hrtf) {
    std::fprintf(stderr, "osteon-sound-bench: %s\n", hrtf.error().message.c_str());
    return 1;
  }
  audio::SynthParams params;
  params.rate_hz = test::kRate_hz;
  audio::Space& space = params.space;
  space.listening = audio::Listening::headphones;
  space.pose_bone_head = audio::looking(audio::usual_listener_mm(space.listening), Vec3::Zero(), -Vec3::UnitY());
  space.hrtf = std::make_shared<const audio::Hrtf>(std::move(*hrtf));
  audio::DrillSynth synth;
  synth.prepare(params);
  const test::ScriptedDrilling script = test::scripted_drilling();
  for (const bool moving : {false, true})
    std::printf("%s %.1f times as fast\n", moving ? "moving" : "still", speed(synth, script.states, moving));
  return 0;
}
