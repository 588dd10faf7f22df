#include "audio_client/space/sofa_file.hpp"

#include <mysofa.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

namespace osteon::audio {
namespace {

constexpr std::uintmax_t kMostBytes = 200'000'000;
constexpr unsigned kMostDirections = 20'000;
constexpr unsigned kMostSamples = 1'000'000;  // of a response
constexpr const char* kRemedy = "; give --hrtf another file, or leave it out";

struct FreeSofa {
  void operator()(MYSOFA_HRTF* hrtf) const { mysofa_free(hrtf); }
};

// libmysofa does not compare the sizes of the arrays with the numbers of directions and samples. All that is read later
// is there, and every number is finite.
bool is_whole(const MYSOFA_HRTF& sofa) {
  if (sofa.M == 0 || sofa.M > kMostDirections || sofa.N == 0 || sofa.N > kMostSamples || sofa.R != 2) return false;
  const std::uint64_t directions = sofa.M, samples = sofa.N;
  const auto has = [](const MYSOFA_ARRAY& array, std::uint64_t count) {
    return array.elements == count && (count == 0 || array.values != nullptr) &&
           std::all_of(array.values, array.values + count, [](float x) { return std::isfinite(x); });
  };
  const MYSOFA_ARRAY& delay = sofa.DataDelay;
  return has(sofa.SourcePosition, 3 * directions) && has(sofa.DataIR, 2 * directions * samples) &&
         has(sofa.DataSamplingRate, 1) && (has(delay, 0) || has(delay, 2) || has(delay, 2 * directions)) &&
         std::all_of(delay.values, delay.values + delay.elements,
                     [](float x) { return x >= 0.0F && x <= static_cast<float>(Hrtf::kMostTaps); });
}

std::vector<HeadResponse> responses(const MYSOFA_HRTF& sofa) {
  std::vector<HeadResponse> heard(sofa.M);
  for (std::size_t m = 0; m < heard.size(); ++m) {
    const float* towards = sofa.SourcePosition.values + 3 * m;
    heard[m].towards = Vec3(towards[0], towards[1], towards[2]);
    for (const std::size_t ear : {0U, 1U}) {
      // A file may keep a delay apart from the response, in samples: of both ears for all directions, or for each.
      const std::size_t which = sofa.DataDelay.elements == 2 ? ear : 2 * m + ear;
      const float delay = which < sofa.DataDelay.elements ? sofa.DataDelay.values[which] : 0.0F;
      std::vector<float>& response = ear == 0 ? heard[m].left : heard[m].right;
      response.assign(static_cast<std::size_t>(std::lround(delay)), 0.0F);
      const float* first = sofa.DataIR.values + (2 * m + ear) * sofa.N;
      response.insert(response.end(), first, first + sofa.N);
    }
  }
  return heard;
}

}  // namespace

Result<Hrtf> read_hrtf(const std::filesystem::path& file, double rate_hz) {
  const std::string name = file.empty() ? "libmysofa's default HRTF file" : "the HRTF file " + file.string();
  if (!file.empty()) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored))
      return failure(ErrorCode::not_found, name + " is not there, or is no file" + kRemedy);
    if (std::filesystem::file_size(file, ignored) > kMostBytes)
      return failure(ErrorCode::invalid_input, name + " has more than 200 MB" + kRemedy);
  }
  int fault = MYSOFA_OK;
  const std::unique_ptr<MYSOFA_HRTF, FreeSofa> sofa(mysofa_load(file.empty() ? nullptr : file.c_str(), &fault));
  if (!sofa && file.empty())
    return failure(ErrorCode::not_found, name + " cannot be read; install the package libmysofa1, or give --hrtf FILE");
  const auto wrong = [&](const std::string& why) {
    return failure(ErrorCode::invalid_input, name + " has no head-related transfer functions: " + why + kRemedy);
  };
  if (!sofa) return wrong("libmysofa finds no SOFA data in it (" + std::to_string(fault) + ")");
  if (const int checked = mysofa_check(sofa.get()); checked != MYSOFA_OK)
    return wrong("it does not follow SimpleFreeFieldHRIR of AES69 (" + std::to_string(checked) + ")");
  if (!is_whole(*sofa)) return wrong("its numbers of directions, ears and samples are not those of its data");
  if (const double measured_hz = sofa->DataSamplingRate.values[0]; !(measured_hz >= 8000 && measured_hz <= 384'000))
    return wrong("its sampling rate is not 8 to 384 kHz");
  if (sofa->N * rate_hz > Hrtf::kMostTaps * static_cast<double>(sofa->DataSamplingRate.values[0]))
    return wrong("its responses are as long as those of a room");
  if (mysofa_resample(sofa.get(), static_cast<float>(rate_hz)) != MYSOFA_OK)
    return wrong("its responses cannot be converted to " + std::to_string(static_cast<int>(rate_hz)) + " Hz");
  mysofa_tocartesian(sofa.get());
  Result<Hrtf> hrtf = Hrtf::make(responses(*sofa), rate_hz);
  if (!hrtf) return wrong(hrtf.error().message);
  return hrtf;
}

}  // namespace osteon::audio
