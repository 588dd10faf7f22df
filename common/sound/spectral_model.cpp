#include "common/sound/spectral_model.hpp"

#include <utility>

#include "common/core/check.hpp"
#include "common/sound/oscillator.hpp"
#include "common/sound/random.hpp"

namespace osteon::sound {
namespace {

// Adds one partial, whose phase begins at `turns` and follows its frequency. It begins and ends within a hop.
void add_partial(std::span<float> sound, const Partial& partial, int hop, double turns, double rate_hz) {
  Sinusoid from = partial.points.front();
  from.amplitude = 0;
  std::ptrdiff_t at = (static_cast<std::ptrdiff_t>(partial.first) - 1) * hop;
  for (const Sinusoid& to : partial.points) {
    turns = add_linear(sound, at, hop, from, to, turns, rate_hz);
    from = to;
    at += hop;
  }
  Sinusoid death = from;
  death.amplitude = 0;
  add_linear(sound, at, hop, from, death, turns, rate_hz);
}

// Of what the model's partials and the samples of its impacts leave.
std::vector<NoiseModel> noise_layers(std::vector<float> rest, const SpectralAnalysis& a, double rate_hz,
                                     const SpectralParams& params) {
  std::vector<float> weight(rest.size(), 1.0F);
  for (const Transient& transient : a.model.transients) {
    const std::vector<float> flanks = transient_weight(transient.samples.size(), rate_hz);
    for (std::size_t i = 0; i < flanks.size(); ++i) weight[transient.begin + i] *= 1.0F - flanks[i];
  }
  for (std::size_t i = 0; i < rest.size(); ++i) rest[i] *= weight[i];
  NoiseParams low = params.low_noise, high = params.high_noise;
  low.to_hz = high.from_hz = params.noise_split_hz;
  high.to_hz = 0.5 * rate_hz;
  return {noise_model(rest, rate_hz, low, weight), noise_model(rest, rate_hz, high, weight)};
}

}  // namespace

SpectralAnalysis spectral_analysis(std::span<const float> samples, double rate_hz, const SpectralParams& params) {
  return *spectral_analysis(samples, rate_hz, params, [](double) { return true; });
}

Result<SpectralAnalysis> spectral_analysis(std::span<const float> samples, double rate_hz, const SpectralParams& params,
                                           const KeepGoing& keep_going) {
  OSTEON_CHECK(rate_hz > 0);
  bool goes_on = true;
  const KeepGoing watched = [&](double done) { return goes_on = goes_on && keep_going(done); };
  SpectralAnalysis a;
  a.impacts = impacts(samples, rate_hz, params.transients);
  // The peaks take most of the time.
  const auto peaks = frame_peaks(samples, rate_hz, params.partials, a.impacts, part(watched, 0.0, 0.8));
  if (!watched(0.8)) return stopped_while("modelling the sound");
  a.partials = continued(peaks, rate_hz, params.partials, a.impacts);
  a.sines = sound_with_phases(a.partials, rate_hz, params.partials.hop, samples.size(), a.impacts);
  a.residual.assign(samples.begin(), samples.end());
  for (std::size_t i = 0; i < samples.size(); ++i) a.residual[i] -= a.sines[i];
  a.model = {.rate_hz = rate_hz,
             .samples = samples.size(),
             .hop = params.partials.hop,
             .partials = {},
             .noise = {},
             .transients = transients_at(samples, rate_hz, a.impacts, params.transients)};
  std::vector<Partial> others;
  for (const Partial& partial : a.partials) {
    const double seconds = static_cast<double>(partial.points.size()) * params.partials.hop / rate_hz;
    if (seconds < params.kept_s)
      others.push_back(partial);
    else
      a.model.partials.push_back(knots_of(partial, params.tolerance));
  }
  if (!watched(0.9)) return stopped_while("modelling the sound");
  const std::vector<float> short_sines =
      sound_with_phases(others, rate_hz, params.partials.hop, samples.size(), a.impacts);
  a.kept_sines = a.sines;
  std::vector<float> rest = a.residual;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    a.kept_sines[i] -= short_sines[i];
    rest[i] += short_sines[i];
  }
  a.model.noise = noise_layers(std::move(rest), a, rate_hz, params);
  return a;
}

std::vector<float> resynthesised_noise(const SpectralModel& model, std::uint64_t seed) {
  std::vector<float> sound(model.samples, 0.0F);
  for (std::size_t layer = 0; layer < model.noise.size(); ++layer) {
    // Another stream of numbers for each layer.
    const std::vector<float> noise = noise_sound(model.noise[layer], model.samples, seed ^ (layer + 1) << 32U);
    for (std::size_t i = 0; i < sound.size(); ++i) sound[i] += noise[i];
  }
  return sound;
}

std::vector<float> resynthesised(const SpectralModel& model, std::uint64_t seed) {
  std::vector<float> sound = resynthesised_noise(model, seed);
  Random random(seed);
  for (const std::vector<Knot>& knots : model.partials)
    add_partial(sound, partial_of(knots), model.hop, random.unit(), model.rate_hz);
  put_transients(sound, model.transients, model.rate_hz);
  return sound;
}

}  // namespace osteon::sound
