// Writes the rendered sound to a WAV file. The sound card's thread pushes into a fixed queue; a separate thread writes.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "common/core/result.hpp"

namespace osteon::audio {

class WavRecorder {
 public:
  // 16-bit PCM. One channel has the mean of both. Error internal: names the path.
  [[nodiscard]] static Result<WavRecorder> open(const std::filesystem::path& file, unsigned rate_hz, int channels);
  WavRecorder(WavRecorder&&) noexcept;
  WavRecorder& operator=(WavRecorder&&) noexcept;
  ~WavRecorder();  // closes

  // [audio] Never waits: what does not fit into the queue of about 5 s is dropped and counted.
  void push(std::span<const float> left, std::span<const float> right) noexcept;
  // Writes what is queued and closes. Error internal: names the path (a full disk is reported here).
  [[nodiscard]] Result<void> close();
  [[nodiscard]] std::uint64_t frames_written() const noexcept;
  [[nodiscard]] std::uint64_t frames_lost() const noexcept;

 private:
  struct Impl;
  explicit WavRecorder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::audio
