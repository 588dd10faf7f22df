// What a person does at a C-arm: turns and moves it within its limits, presses pedals, and reads how much was shot. It
// computes no picture: it says when one is due, and counts those that came.
#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "viewer_client/inside/c_arm_shot.hpp"

namespace osteon {

// [A] How far it turns and moves, to both sides.
inline constexpr double kMostOrbit_rad = 3.14159265358979;
inline constexpr double kMostTilt_rad = 1.57079632679490;
inline constexpr double kMostTranslation_mm = 200.0;  // along each of the patient's axes
// [A] Pulses and live pictures of a second, and for how long one of them has the tube on. Live, it is on all the time.
inline constexpr double kPulses_per_s = 8.0, kLive_per_s = 15.0;
inline constexpr double kPulse_s = 0.02;
[[nodiscard]] double exposure_of(ShotMode mode);

// A picture that is due.
struct ShotOrder {
  std::uint64_t id = 0;  // from 1; not that of the shot, because not every order becomes one
  ShotMode mode = ShotMode::single;
  CArmPosition position;
  std::uint64_t seed = 0;
};

// Not synchronised: one thread.
class CArmConsole {
 public:
  using Clock = std::chrono::steady_clock;

  // `first_seed`: equal noise follows from equal seeds, so two C-arms have different ones.
  explicit CArmConsole(std::uint64_t first_seed) : first_seed_(first_seed) {}

  // A new session, with the shots that were kept of it. Anteroposterior about the middle of the bone.
  void begin(const Box& bone, std::span<const CArmShot> kept);

  [[nodiscard]] const CArmPosition& position() const { return position_; }
  // Each keeps within the limits. What is no number changes nothing.
  void set_orbit(double rad);
  void set_tilt(double rad);
  void set_translation(int axis, double mm);
  // Turns the arm; the isocentre stays, and the translation ends.
  void take_view(radiology::View view);
  // The middle of the bone, or the tip of a tool. The translation ends.
  void set_isocentre(const Vec3& point_mm);
  [[nodiscard]] Vec3 middle_of_bone() const;

  // The pedals. A press gives one picture at least, however short it is. `pulse` and `live` go on until release().
  void press(ShotMode mode, Clock::time_point now);
  void release() { held_.reset(); }
  [[nodiscard]] std::optional<ShotMode> held() const { return held_; }
  // Nothing is pressed, due or on its way.
  [[nodiscard]] bool idle() const { return !held_ && !owed_ && !under_way_; }
  // Drops what was pressed and what is on its way, as when the pane closes.
  void stop();

  // The picture to make now, if one is due. There is one on its way at most, so a machine that cannot follow shoots
  // less often. While the C-arm moves, the next one may be asked for as soon as there is a coarse one.
  [[nodiscard]] std::optional<ShotOrder> due(Clock::time_point now);
  enum class Came : std::uint8_t {
    shot,     // it counts: it is now the last of shots(), and has its number
    finer,    // the whole picture of a shot that has been counted
    dropped,  // nobody waits for it any more
  };
  // A picture of an order came, of this shot.
  Came came(std::uint64_t order, bool coarse, const CArmShot& made);

  [[nodiscard]] const ShotTotals& totals() const { return totals_; }
  [[nodiscard]] std::span<const CArmShot> shots() const { return shots_; }

 private:
  struct UnderWay {
    ShotOrder order;
    bool counted = false;  // a coarse picture is there
  };

  std::uint64_t first_seed_;
  std::uint64_t last_id_ = 0, last_number_ = 0;
  Box bone_;
  CArmPosition position_;
  std::optional<ShotMode> held_, owed_;
  std::optional<UnderWay> under_way_;
  Clock::time_point next_{};  // of the pedal that is held
  std::vector<CArmShot> shots_;
  ShotTotals totals_;
};

}  // namespace osteon
