// The file of a spectral model. Its format is described in deploy/docs/sound.md.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/result.hpp"
#include "common/sound/spectral_model.hpp"

namespace osteon::sound {

inline constexpr std::string_view kModelMagic = "OSTEOSMS";
inline constexpr int kModelVersion = 1;
// A model of five minutes that could hardly be larger. Bigger files are refused before they are read.
inline constexpr std::uintmax_t kLargestModel_bytes = 64U << 20U;

// Numbers are rounded: levels of partials to 1/3 dB, of noise to 2/3 dB, frequencies to the 65535th of half the rate,
// and stored samples to 16 bits. The rate is a whole number of Hz, 22050 to 48000, and the frames of the partials,
// which are in the order of their births, are at most 65535.
[[nodiscard]] std::string bytes_of(const SpectralModel& model);

// `file`: for the messages. Errors: invalid_input (damaged), unsupported (another version); one sentence with file,
// field and remedy. Whatever the bytes are, a model that is returned can be resynthesised.
[[nodiscard]] Result<SpectralModel> model_from_bytes(std::string_view bytes, const std::string& file);

}  // namespace osteon::sound
