// The way of one source's sound to the listener: its level falls with the distance, it arrives later, a moving source
// has another pitch, and both ears hear where it is (Niu 2008, 8.6.3).
#pragma once
#include <array>
#include <memory>

#include "audio_client/space/block.hpp"
#include "audio_client/space/delay_line.hpp"
#include "audio_client/space/hrtf.hpp"
#include "audio_client/space/listener.hpp"

namespace osteon::audio {

struct Space {
  Listening listening = Listening::mono;
  Pose pose_bone_head;               // of the listener
  std::shared_ptr<const Hrtf> hrtf;  // for headphones; owned by every path together
  // Hides the steps between states: the position follows by two poles with this time constant.
  double smoothing_s = 0.015;
};

class SoundPath {
 public:
  void prepare(const Space& space, double rate_hz) noexcept;  // silences
  // The source begins here, and what was under way is forgotten. [audio]
  void start(const Vec3& position_mm) noexcept;
  // It moves here; a position that is not finite, or beyond 100 m, is ignored. [audio]
  void aim(const Vec3& position_mm) noexcept;
  // The next kBlockFrames of the source in, and what is heard of it added. [audio]
  void add_to(const Block& source, StereoBlock& heard) noexcept;
  // Something that was put in may not have arrived yet.
  [[nodiscard]] bool ringing() const noexcept { return silent_frames_ < kLongest; }

 private:
  static constexpr int kLongest = DelayLine::kFrames + kEarTaps;

  struct Ear {
    double delay = DelayLine::kLeast;  // frames, at the end of the last block
    float gain = 0;                    // and there
    // The last taps of the delayed sound, and the new block: what the filter needs.
    std::array<float, kEarTaps + kBlockFrames> delayed{};
  };
  struct Place {  // of the source, seen from the listener
    Vec3 towards = Vec3::UnitX();
    double distance_mm = 0, aside = 0;  // aside: -1 right to 1 left
  };

  [[nodiscard]] Place place() const noexcept;
  [[nodiscard]] double delay_frames(double distance_mm, double receding_mm_per_s, double later_s) const noexcept;
  // Follows the target for a block. Returns by how much the distance grows, mm/s.
  double advance() noexcept;
  void add_panned(const Place& here, double receding_mm_per_s, StereoBlock& heard) noexcept;
  void add_by_ears(const Place& here, double receding_mm_per_s, StereoBlock& heard) noexcept;

  Space space_;
  double rate_hz_ = 48000;
  DelayLine line_;
  Ear left_, right_;
  EarPair filters_, next_filters_;
  Vec3 filters_towards_ = Vec3::Zero();
  Vec3 target_mm_ = Vec3::Zero(), followed_mm_ = Vec3::Zero(), position_mm_ = Vec3::Zero();
  bool begun_ = false;  // a block was heard since the start
  int silent_frames_ = kLongest;
};

}  // namespace osteon::audio
