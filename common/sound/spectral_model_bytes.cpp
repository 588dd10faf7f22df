#include "common/sound/spectral_model_bytes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "common/core/check.hpp"
#include "common/core/digest.hpp"
#include "common/sound/levels.hpp"
#include "common/sound/wav_file.hpp"

namespace osteon::sound {
namespace {

constexpr std::size_t kDigestBytes = 32;
constexpr double kLoudest_db = 6.0, kStepsPerLevel_db = 3.0;  // byte 0, and steps in a decibel
constexpr double kNoiseSteps_db = 1.5;
constexpr int kNoNoise = 255;
constexpr std::size_t kMostHops = 255;  // between two knots
constexpr double kFull = 32767.0;
// Partials at a time, on average: a small file must not cost hours of oscillators.
constexpr std::uint64_t kMostPartials = 1000;
constexpr std::uint64_t kMostLayers = 8;
constexpr std::uint64_t kMostModelFrames = 65535;

class Writer {
 public:
  void put(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) bytes_.push_back(static_cast<char>(value >> (8 * i) & 0xffU));
  }
  void put(std::string_view text) { bytes_ += text; }
  [[nodiscard]] std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

// Reads in the order of Writer. Beyond the end it gives zeros, and remembers that it did.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  std::uint64_t get(int count) {
    if (bytes_.size() < static_cast<std::size_t>(count)) {
      bytes_ = {};
      whole_ = false;
      return 0;
    }
    std::uint64_t value = 0;
    for (int i = 0; i < count; ++i)
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes_[static_cast<std::size_t>(i)])) << (8 * i);
    bytes_.remove_prefix(static_cast<std::size_t>(count));
    return value;
  }
  [[nodiscard]] bool whole() const { return whole_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size(); }

 private:
  std::string_view bytes_;
  bool whole_ = true;
};

std::uint64_t rounded(double value, double most) {
  return static_cast<std::uint64_t>(std::llround(std::clamp(value, 0.0, most)));
}

std::string digest_of(std::string_view bytes) {
  Hasher hasher;
  hasher.bytes(std::as_bytes(std::span(bytes)));
  const Digest digest = hasher.finish();
  return {reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size()};
}

double hz_step(double rate_hz) { return 0.5 * rate_hz / 65535.0; }

void put_knot(Writer& out, std::size_t hops, const Knot& knot, double rate_hz) {
  out.put(hops, 1);
  out.put(rounded(knot.hz / hz_step(rate_hz), 65535), 2);
  out.put(rounded((kLoudest_db - knot.level_db) * kStepsPerLevel_db, 255), 1);
}

void put_partial(Writer& out, const std::vector<Knot>& knots, std::size_t after, double rate_hz) {
  // Lines of more than 255 hops are divided.
  std::vector<Knot> all;
  const Partial points = partial_of(knots);
  for (const Knot& knot : knots) {
    while (!all.empty() && knot.frame - all.back().frame > kMostHops) {
      const std::size_t frame = all.back().frame + kMostHops;
      const Sinusoid& point = points.points[frame - points.first];
      all.push_back({frame, point.hz, 20.0 * std::log10(point.amplitude)});
    }
    all.push_back(knot);
  }
  OSTEON_CHECK(all.front().frame >= after);
  out.put(all.front().frame - after, 2);
  out.put(all.size(), 2);
  for (std::size_t i = 0; i < all.size(); ++i)
    put_knot(out, i > 0 ? all[i].frame - all[i - 1].frame : 0, all[i], rate_hz);
}

tl::unexpected<Error> damaged(const std::string& file, const std::string& what) {
  return bad_input(file + " is a damaged model: " + what + "; make it again with osteon-audio model");
}

std::string outside(const std::string& field, std::uint64_t value, const std::string& range) {
  return field + " is " + std::to_string(value) + ", and must be " + range;
}

Result<void> get_partials(Reader& in, SpectralModel& model, const std::string& file) {
  const std::uint64_t frames = model.samples / static_cast<std::size_t>(model.hop) + 1;
  const std::uint64_t count = in.get(4);
  std::uint64_t points = 0;
  for (std::uint64_t p = 0; p < count && in.whole(); ++p) {
    std::uint64_t frame = (model.partials.empty() ? 0 : model.partials.back().front().frame) + in.get(2);
    const std::uint64_t knots = in.get(2);
    if (in.whole() && (knots == 0 || knots > in.left() / 4))
      return damaged(file, outside("the number of knots of partial " + std::to_string(p), knots,
                                   "1 to the " + std::to_string(in.left() / 4) + " that the file has left"));
    std::vector<Knot> all;
    for (std::uint64_t i = 0; i < knots; ++i) {
      const std::uint64_t hops = in.get(1);
      frame += hops;
      if ((hops > 0) != (i > 0) || frame >= frames)
        return damaged(file, outside("the frame of knot " + std::to_string(i) + " of partial " + std::to_string(p),
                                     frame, "after the one before and below " + std::to_string(frames)));
      Knot knot{.frame = frame};
      knot.hz = static_cast<double>(in.get(2)) * hz_step(model.rate_hz);
      knot.level_db = kLoudest_db - static_cast<double>(in.get(1)) / kStepsPerLevel_db;
      all.push_back(knot);
    }
    if (!all.empty()) points += all.back().frame - all.front().frame + 1;
    if (points > kMostPartials * frames)
      return damaged(file, "it has more than " + std::to_string(kMostPartials) + " partials at a time");
    model.partials.push_back(std::move(all));
  }
  return {};
}

// Whether noise_points_hz() has points for these.
Result<void> check_noise(const NoiseParams& params, double rate_hz, const std::string& file) {
  const auto window = static_cast<unsigned>(params.window);
  if (!std::has_single_bit(window) || window < 32 || window > 8192)
    return damaged(file, outside("the window of its noise", window, "a power of two, 32 to 8192"));
  if (!(params.from_hz >= 0 && params.from_hz < params.to_hz && params.to_hz <= 0.5 * rate_hz))
    return damaged(file, "its noise has no frequencies from 0 Hz to half of its rate");
  const double most = (params.to_hz - params.from_hz) * params.window / rate_hz + 1;
  if (params.points < 2 || params.points > most)
    return damaged(file, outside("the number of points of its noise", static_cast<std::uint64_t>(params.points),
                                 "2 to " + std::to_string(static_cast<int>(most))));
  return {};
}

Result<void> get_noise(Reader& in, SpectralModel& model, const std::string& file) {
  const std::uint64_t layers = in.get(1);
  if (layers > kMostLayers)
    return damaged(file,
                   outside("the number of layers of its noise", layers, "at most " + std::to_string(kMostLayers)));
  for (std::uint64_t l = 0; l < layers; ++l) {
    NoiseParams params;
    params.window = static_cast<int>(in.get(2));
    params.points = static_cast<int>(in.get(2));
    params.from_hz = 0.5 * static_cast<double>(in.get(4));
    params.to_hz = 0.5 * static_cast<double>(in.get(4));
    if (!in.whole()) return {};
    if (auto usable = check_noise(params, model.rate_hz, file); !usable) return usable;
    NoiseModel noise{.rate_hz = model.rate_hz,
                     .params = params,
                     .points_hz = noise_points_hz(model.rate_hz, params),
                     .frames = noise_frames(model.samples, params),
                     .levels_db = {}};
    const std::size_t levels = noise.frames * noise.points_hz.size();
    if (levels > in.left())
      return damaged(file, outside("the number of levels of its noise", levels,
                                   "at most the " + std::to_string(in.left()) + " bytes that the file has left"));
    for (std::size_t i = 0; i < levels; ++i) {
      const auto level = static_cast<int>(in.get(1));
      noise.levels_db.push_back(level == kNoNoise ? static_cast<float>(kSilence_db)
                                                  : static_cast<float>(-level / kNoiseSteps_db));
    }
    model.noise.push_back(std::move(noise));
  }
  return {};
}

Result<void> get_transients(Reader& in, SpectralModel& model, const std::string& file) {
  const std::uint64_t count = in.get(2);
  std::uint64_t all = 0;
  for (std::uint64_t t = 0; t < count && in.whole(); ++t) {
    Transient transient{.begin = in.get(4), .samples = {}};
    const std::uint64_t samples = in.get(2);
    all += samples;
    const std::string name = "transient " + std::to_string(t);
    if (transient.begin + samples > model.samples)
      return damaged(
          file, outside("the end of " + name, transient.begin + samples, "at most " + std::to_string(model.samples)));
    if (static_cast<double>(samples) > kLongestTransient_s * model.rate_hz)
      return damaged(file, outside("the number of samples of " + name, samples, "20 ms at most"));
    if (static_cast<double>(all) > kMostTransientPart * static_cast<double>(model.samples))
      return damaged(file, "its transients are more than a tenth of the sound");
    for (std::uint64_t i = 0; i < samples; ++i) {
      const auto value = static_cast<std::int16_t>(static_cast<std::uint16_t>(in.get(2)));
      transient.samples.push_back(static_cast<float>(value / kFull));
    }
    model.transients.push_back(std::move(transient));
  }
  return {};
}

Result<SpectralModel> model_of(Reader in, const std::string& file) {
  SpectralModel model;
  const std::uint64_t rate = in.get(4), samples = in.get(4), hop = in.get(2);
  if (rate < kLowestRate_hz || rate > kHighestRate_hz)
    return damaged(file, outside("its rate", rate, "22050 to 48000 Hz"));
  if (static_cast<double>(samples) > kLongest_s * static_cast<double>(rate))
    return damaged(file, outside("its number of samples", samples, "at most 300 s"));
  if (hop < 16 || hop > 8192) return damaged(file, outside("its hop", hop, "16 to 8192 samples"));
  if (samples / hop >= kMostModelFrames)
    return damaged(file,
                   outside("its number of frames", samples / hop + 1, "at most " + std::to_string(kMostModelFrames)));
  model.rate_hz = static_cast<double>(rate), model.samples = samples, model.hop = static_cast<int>(hop);
  if (auto got = get_partials(in, model, file); !got) return tl::unexpected(got.error());
  if (auto got = get_noise(in, model, file); !got) return tl::unexpected(got.error());
  if (auto got = get_transients(in, model, file); !got) return tl::unexpected(got.error());
  if (!in.whole()) return damaged(file, "it ends too early");
  if (in.left() > 0) return damaged(file, std::to_string(in.left()) + " bytes follow its end");
  return model;
}

}  // namespace

std::string bytes_of(const SpectralModel& model) {
  OSTEON_CHECK(model.rate_hz == std::round(model.rate_hz) && model.samples <= UINT32_MAX && model.hop <= UINT16_MAX);
  OSTEON_CHECK(model.samples / static_cast<std::size_t>(model.hop) < kMostModelFrames);
  Writer out;
  out.put(kModelMagic);
  out.put(kModelVersion, 2);
  out.put(static_cast<std::uint64_t>(model.rate_hz), 4);
  out.put(model.samples, 4);
  out.put(static_cast<std::uint64_t>(model.hop), 2);
  out.put(model.partials.size(), 4);
  std::size_t after = 0;  // frame at which the partial before begins
  for (const std::vector<Knot>& knots : model.partials) {
    put_partial(out, knots, after, model.rate_hz);
    after = knots.front().frame;
  }
  out.put(model.noise.size(), 1);
  for (const NoiseModel& noise : model.noise) {
    out.put(static_cast<std::uint64_t>(noise.params.window), 2);
    out.put(noise.points_hz.size(), 2);
    // Half of the rate may be half a hertz.
    out.put(rounded(2.0 * noise.params.from_hz, UINT32_MAX), 4);
    out.put(rounded(2.0 * noise.params.to_hz, UINT32_MAX), 4);
    for (const float level : noise.levels_db) out.put(rounded(-level * kNoiseSteps_db, kNoNoise), 1);
  }
  out.put(model.transients.size(), 2);
  for (const Transient& transient : model.transients) {
    out.put(transient.begin, 4);
    out.put(transient.samples.size(), 2);
    for (const float x : transient.samples)
      out.put(static_cast<std::uint16_t>(std::lround(std::clamp(x, -1.0F, 1.0F) * kFull)), 2);
  }
  out.put(digest_of(out.bytes()));
  return out.bytes();
}

Result<SpectralModel> model_from_bytes(std::string_view bytes, const std::string& file) {
  if (bytes.substr(0, kModelMagic.size()) != kModelMagic)
    return bad_input(file + " is no spectral model, because it does not begin with " + std::string(kModelMagic) +
                     "; give a file that osteon-audio model --out has written");
  Reader version(bytes.substr(kModelMagic.size()));
  const std::uint64_t number = version.get(2);
  if (!version.whole()) return damaged(file, "it ends too early");
  if (number != kModelVersion)
    return failure(ErrorCode::unsupported, file + ": its version is " + std::to_string(number) +
                                               ", and this program reads version " + std::to_string(kModelVersion) +
                                               "; make it again with osteon-audio model");
  const std::size_t head = kModelMagic.size() + 2;
  if (bytes.size() < head + kDigestBytes) return damaged(file, "it ends too early");
  const std::string_view content = bytes.substr(0, bytes.size() - kDigestBytes);
  if (digest_of(content) != bytes.substr(content.size()))
    return damaged(file, "its SHA-256 at the end is not that of its bytes");
  return model_of(Reader(content.substr(head)), file);
}

}  // namespace osteon::sound
