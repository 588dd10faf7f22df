#include "common/sound/wav_writer.hpp"

#include <sndfile.h>
#include <unistd.h>

#include <string>
#include <system_error>
#include <utility>

#include "common/core/check.hpp"

namespace osteon::sound {
namespace {

namespace fs = std::filesystem;

}  // namespace

struct WavWriter::Impl {
  fs::path file, target, partial;
  WavFormat format;
  SNDFILE* out = nullptr;
  std::uint64_t frames = 0;
  bool failed = false;

  ~Impl() {
    if (out) sf_close(out);
    std::error_code ignored;
    fs::remove(partial, ignored);
  }

  [[nodiscard]] tl::unexpected<Error> not_whole(const std::error_code& why) {
    failed = true;
    return failure(ErrorCode::internal, "the sound " + file.string() + " could not be written whole (" + why.message() +
                                            "); an older file of that name is as it was");
  }
};

WavWriter::WavWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
WavWriter::~WavWriter() = default;
WavWriter::WavWriter(WavWriter&&) noexcept = default;
WavWriter& WavWriter::operator=(WavWriter&&) noexcept = default;

Result<WavWriter> WavWriter::open(const fs::path& file, const WavFormat& format) {
  OSTEON_CHECK(format.channels > 0 && (format.bits == 16 || format.bits == 24));
  std::error_code error;
  // A rename would replace a link, a device or a pipe by a file.
  const fs::path target = fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : file;
  if (fs::is_other(target, error))
    return failure(ErrorCode::internal,
                   "cannot write the sound " + file.string() + ": it is a device or a pipe; give a file");
  auto impl = std::make_unique<Impl>();
  impl->file = file;
  impl->target = impl->partial = target;
  impl->partial += ".partial-" + std::to_string(::getpid());
  impl->format = format;
  SF_INFO info{};
  info.samplerate = format.rate_hz;
  info.channels = format.channels;
  info.format = SF_FORMAT_WAV | (format.bits == 16 ? SF_FORMAT_PCM_16 : SF_FORMAT_PCM_24);
  impl->out = sf_open(impl->partial.c_str(), SFM_WRITE, &info);
  if (!impl->out)
    return failure(ErrorCode::internal, "cannot write the sound " + file.string() + ": " + sf_strerror(nullptr) +
                                            "; choose a place where you may write");
  sf_command(impl->out, SFC_SET_CLIPPING, nullptr, SF_TRUE);
  return WavWriter(std::move(impl));
}

Result<void> WavWriter::write(std::span<const float> samples) {
  const auto channels = static_cast<std::size_t>(impl_->format.channels);
  OSTEON_CHECK(samples.size() % channels == 0);
  const std::uint64_t count = samples.size() / channels;
  const auto frame_bytes = static_cast<std::uint64_t>(impl_->format.channels * impl_->format.bits / 8);
  if ((impl_->frames + count) * frame_bytes > kMostBytes)
    return failure(ErrorCode::exhausted,
                   "the sound " + impl_->file.string() + " is full, because a WAV file holds 4 GB; begin another file");
  if (sf_writef_float(impl_->out, samples.data(), static_cast<sf_count_t>(count)) != static_cast<sf_count_t>(count))
    return impl_->not_whole(std::make_error_code(std::errc::no_space_on_device));
  impl_->frames += count;
  return {};
}

void WavWriter::update_header() { sf_command(impl_->out, SFC_UPDATE_HEADER_NOW, nullptr, 0); }

Result<void> WavWriter::close() {
  if (sf_close(std::exchange(impl_->out, nullptr)) != 0 || impl_->failed)
    return impl_->not_whole(std::make_error_code(std::errc::no_space_on_device));
  std::error_code error;
  fs::rename(impl_->partial, impl_->target, error);
  if (error) return impl_->not_whole(error);
  return {};
}

std::uint64_t WavWriter::frames() const { return impl_->frames; }

}  // namespace osteon::sound
