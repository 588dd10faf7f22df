#include "common/sound/wav_file.hpp"

#include <sndfile.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

namespace osteon::sound {
namespace {

namespace fs = std::filesystem;

struct Close {
  void operator()(SNDFILE* file) const { sf_close(file); }
};
using SoundFile = std::unique_ptr<SNDFILE, Close>;

std::uint64_t little_endian(const unsigned char* bytes) {
  return static_cast<std::uint64_t>(bytes[0]) | static_cast<std::uint64_t>(bytes[1]) << 8U |
         static_cast<std::uint64_t>(bytes[2]) << 16U | static_cast<std::uint64_t>(bytes[3]) << 24U;
}

std::string shown(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

// libsndfile takes a file that was cut off for a shorter one, and names no reason for other files. So the chunks are
// walked through here first.
Result<void> check_chunks(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error)) return bad_input(file.string() + " is a folder; give a WAV file in it");
  if (!fs::exists(file, error))
    return failure(ErrorCode::not_found, "there is no file " + file.string() + "; give the path of a WAV recording");
  std::ifstream in(file, std::ios::binary);
  const std::uintmax_t size = fs::file_size(file, error);
  if (!in || error)
    return failure(ErrorCode::not_found, "cannot read " + file.string() + "; give a file that you may read");
  if (size == 0) return bad_input(file.string() + " is empty, with no byte in it; give a WAV recording");

  std::array<unsigned char, 12> header{};
  in.read(reinterpret_cast<char*>(header.data()), header.size());
  const std::string_view letters(reinterpret_cast<const char*>(header.data()), header.size());
  if (!in || letters.substr(0, 4) != "RIFF" || letters.substr(8) != "WAVE")
    return bad_input(file.string() + " is no WAV file, because its ChunkID and Format are not RIFF and WAVE; convert " +
                     "the recording to PCM WAV");
  bool format = false;
  for (std::uintmax_t at = header.size(); at + 8 <= size;) {
    in.seekg(static_cast<std::streamoff>(at));
    in.read(reinterpret_cast<char*>(header.data()), 8);
    if (!in) break;
    const std::string_view name = letters.substr(0, 4);
    const std::uint64_t bytes = little_endian(header.data() + 4);
    at += 8;
    if (name == "fmt ") format = true;
    if (name == "data" && at + bytes > size)
      return bad_input(file.string() + " is truncated: Subchunk2Size of its data is " + std::to_string(bytes) +
                       " bytes, and " + std::to_string(size - at) + " are there; copy or record it again");
    if (name == "data" && format) return {};
    at += bytes + (bytes & 1U);
  }
  return bad_input(file.string() + " is truncated: it has no chunk \"" + (format ? "data" : "fmt ") +
                   "\"; copy or record it again");
}

Result<int> bits_of(const fs::path& file, int format) {
  const int kind = format & SF_FORMAT_TYPEMASK;
  if (kind == SF_FORMAT_WAV || kind == SF_FORMAT_WAVEX) {
    switch (format & SF_FORMAT_SUBMASK) {
      case SF_FORMAT_PCM_16:
        return 16;
      case SF_FORMAT_PCM_24:
        return 24;
      case SF_FORMAT_PCM_32:
        return 32;
      case SF_FORMAT_PCM_U8:
        return failure(ErrorCode::unsupported,
                       file.string() + ": BitsPerSample is 8, too coarse for a quiet room beside a drill; " +
                           "record with 16 bits or more");
      default:
        break;
    }
  }
  return failure(ErrorCode::unsupported,
                 file.string() + ": AudioFormat is not integer PCM; convert it to PCM WAV of 16 bits");
}

Result<void> check_facts(const fs::path& file, const SF_INFO& info, std::optional<Channel> channel) {
  const std::string name = file.string();
  if (info.channels > 2)
    return failure(ErrorCode::unsupported, name + ": NumChannels is " + std::to_string(info.channels) +
                                               "; give a recording with one channel, or two with --channel");
  if (info.channels == 2 && !channel)
    return failure(ErrorCode::unsupported,
                   name + ": NumChannels is 2; choose one with --channel left or right, " + "or take --channel mean");
  if (info.samplerate < kLowestRate_hz || info.samplerate > kHighestRate_hz)
    return failure(ErrorCode::unsupported, name + ": SampleRate is " + std::to_string(info.samplerate) +
                                               " Hz, outside " + std::to_string(kLowestRate_hz) + " to " +
                                               std::to_string(kHighestRate_hz) +
                                               " Hz; convert it to 44100 Hz, or record it so");
  if (info.frames == 0)
    return bad_input(name + " is empty: Subchunk2Size of its data is 0; give a recording with samples");
  const double seconds = static_cast<double>(info.frames) / info.samplerate;
  if (seconds < kShortest_s)
    return bad_input(name + ": its data last " + shown(seconds) + " s; give a recording of at least " +
                     shown(kShortest_s) + " s");
  if (seconds > kLongest_s)
    return bad_input(name + ": its data last " + shown(seconds) + " s; give a part of at most " + shown(kLongest_s) +
                     " s");
  return {};
}

std::vector<float> taken(std::vector<float> frames, int channels, std::optional<Channel> channel) {
  if (channels == 1) return frames;
  std::vector<float> one(frames.size() / 2);
  for (std::size_t i = 0; i < one.size(); ++i) {
    const float left = frames[2 * i], right = frames[2 * i + 1];
    one[i] = channel == Channel::left ? left : channel == Channel::right ? right : 0.5F * (left + right);
  }
  return one;
}

}  // namespace

std::optional<Channel> channel_of(std::string_view name) {
  if (name == "left") return Channel::left;
  if (name == "right") return Channel::right;
  if (name == "mean") return Channel::mean;
  return std::nullopt;
}

Result<WavSound> read_wav(const fs::path& file, std::optional<Channel> channel) {
  if (auto sound = check_chunks(file); !sound) return tl::unexpected(sound.error());
  SF_INFO info{};
  const SoundFile in(sf_open(file.c_str(), SFM_READ, &info));
  if (!in)
    return bad_input("cannot read " + file.string() + ": " + sf_strerror(nullptr) +
                     "; convert it to PCM WAV of 16 bits");
  const Result<int> bits = bits_of(file, info.format);
  if (!bits) return tl::unexpected(bits.error());
  if (auto usable = check_facts(file, info, channel); !usable) return tl::unexpected(usable.error());

  std::vector<float> frames(static_cast<std::size_t>(info.frames) * static_cast<std::size_t>(info.channels));
  if (sf_readf_float(in.get(), frames.data(), info.frames) != info.frames)
    return bad_input(file.string() + " is truncated: its data end too early; copy or record it again");
  return WavSound{.rate_hz = info.samplerate,
                  .channels = info.channels,
                  .bits = *bits,
                  .samples = taken(std::move(frames), info.channels, channel)};
}

Result<void> write_wav(const fs::path& file, std::span<const float> samples, int rate_hz) {
  SF_INFO info{};
  info.samplerate = rate_hz;
  info.channels = 1;
  info.format = SF_FORMAT_WAV | SF_FORMAT_PCM_16;
  SoundFile out(sf_open(file.c_str(), SFM_WRITE, &info));
  if (!out)
    return failure(ErrorCode::internal, "cannot write the sound " + file.string() + ": " + sf_strerror(nullptr) +
                                            "; choose a place where you may write");
  sf_command(out.get(), SFC_SET_CLIPPING, nullptr, SF_TRUE);
  const auto count = static_cast<sf_count_t>(samples.size());
  const bool whole = sf_writef_float(out.get(), samples.data(), count) == count;
  if (sf_close(out.release()) != 0 || !whole)
    return failure(ErrorCode::internal,
                   "the sound " + file.string() + " could not be written whole; is the disk full?");
  return {};
}

}  // namespace osteon::sound
