// Writes the rendered sound to a WAV file. The sound card's thread pushes into a fixed queue; a separate thread writes.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "common/core/result.hpp"

namespace osteon::audio {

// What becomes of a file that has the name already.
enum class Existing : std::uint8_t {
  refused,
  replaced,
};

class WavRecorder {
 public:
  // 16-bit PCM. One channel has the mean of both. Errors: exists (the name is taken, or another program records to it),
  // internal; name the path.
  [[nodiscard]] static Result<WavRecorder> open(const std::filesystem::path& file, unsigned rate_hz, int channels,
                                                Existing existing = Existing::refused);
  WavRecorder(WavRecorder&&) noexcept;
  WavRecorder& operator=(WavRecorder&&) noexcept;
  ~WavRecorder();  // closes

  // [audio] Never waits: what does not fit into the queue of about 5 s is dropped and counted.
  void push(std::span<const float> left, std::span<const float> right) noexcept;
  // Writes what is queued and closes. Error internal: names the path and the system's reason, such as a full disk.
  [[nodiscard]] Result<void> close();
  // One sentence, as soon as the disk took no more: the recording then ends where it is. Empty: all is well.
  [[nodiscard]] std::string trouble() const;
  [[nodiscard]] std::uint64_t frames_written() const noexcept;  // that the file has
  [[nodiscard]] std::uint64_t frames_lost() const noexcept;     // for want of time, or of room on the disk

 private:
  struct Impl;
  explicit WavRecorder(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::audio
