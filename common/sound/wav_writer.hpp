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

// What becomes of a sound that could not be written whole.
enum class Unfinished : std::uint8_t {
  removed,  // it can be made again
  kept,     // it cannot
};

// What becomes of another file that has the name when the sound is whole.
enum class Older : std::uint8_t {
  replaced,
  kept,
};

class WavWriter {
 public:
  // The size in a header has 32 bits.
  static constexpr std::uint64_t kMostBytes = 4'000'000'000;

  // Begins FILE.partial-PID beside the file. Error internal: it cannot be made; names the file.
  [[nodiscard]] static Result<WavWriter> open(const std::filesystem::path& file, const WavFormat& format,
                                              Unfinished unfinished = Unfinished::removed,
                                              Older older = Older::replaced);
  ~WavWriter();  // without close(): removes what was begun; an older file of that name is as it was
  WavWriter(WavWriter&&) noexcept;
  WavWriter& operator=(WavWriter&&) noexcept;

  // Frames of interleaved samples; beyond full scale they are clipped. Errors: internal (disk), exhausted (kMostBytes).
  // After an error of the disk, frames() counts what it has taken, and nothing more is written.
  [[nodiscard]] Result<void> write(std::span<const float> samples);
  // Writes the length so far into the header, for whoever reads the unfinished file of a killed program.
  void update_header();
  // Renames the file. With Unfinished::kept, also after an error of write(): it then has the frames that were taken.
  // Error internal: it could not be written whole, or not be renamed. What is kept then stays in FILE.partial-PID,
  // which the sentence names. Error exists: with Older::kept another file has the name; the sound stays in
  // FILE.partial-PID.
  [[nodiscard]] Result<void> close();
  // As close(), but the file keeps its name FILE.partial-PID, which is returned: a file that is already there stays.
  [[nodiscard]] Result<std::filesystem::path> close_apart();
  [[nodiscard]] std::uint64_t frames() const;

 private:
  struct Impl;
  explicit WavWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::sound
