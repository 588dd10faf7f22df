// Writes a WAV file piece by piece. It gets its name when it is whole.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "common/core/result.hpp"

namespace osteon::sound {

struct WavFormat {
  int rate_hz = 48000;
  int channels = 1;
  int bits = 16;  // 16 or 24, PCM
};

class WavWriter {
 public:
  // The size in a header has 32 bits.
  static constexpr std::uint64_t kMostBytes = 4'000'000'000;

  // Begins FILE.partial-PID beside the file. Error internal: it cannot be made; names the file.
  [[nodiscard]] static Result<WavWriter> open(const std::filesystem::path& file, const WavFormat& format);
  ~WavWriter();  // without close(): removes what was begun; an older file of that name is as it was
  WavWriter(WavWriter&&) noexcept;
  WavWriter& operator=(WavWriter&&) noexcept;

  // Frames of interleaved samples; beyond full scale they are clipped. Errors: internal (disk), exhausted (kMostBytes).
  [[nodiscard]] Result<void> write(std::span<const float> samples);
  // Writes the length so far into the header, for whoever reads the unfinished file of a killed program.
  void update_header();
  // Renames the file. Error internal: it could not be written whole.
  [[nodiscard]] Result<void> close();
  [[nodiscard]] std::uint64_t frames() const;

 private:
  struct Impl;
  explicit WavWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::sound
