// The forces of the tool's motor on the hand: drag, kick and vibration. While the tool cuts, its drag is the force of
// its law across the feed. While it rubs, the drag is friction. The drag of a turning tool has one direction; that of a
// saw alternates with the stroke.
//
// These forces are active, unlike the coupling's: they may put energy into the hand as a real motor does. So they go
// through a port of their own. Its force is bounded by friction times the normal force. The port closes soon after the
// pedal is released.
#pragma once
#include "common/geometry/pose.hpp"

namespace osteon::haptic {

struct MotorPortParams {
  double friction = 0.3;    // mu: bound of all motor forces, relative to the normal force [A]
  double drag = 0.6;        // share of the bound: pull of a rubbing flank, and the largest force of the law [A]
  double kick = 0.8;        // share of friction times a sudden rise of the normal force, added to the drag [A]
  double vibration = 0.15;  // share of the bound, at the rate at which the teeth bite [A]
  double kick_s = 0.03;     // a slower rise is no kick [A]
  double most_hz = 300.0;   // faster vibration is beyond a 1 kHz loop: it averages out, and sound represents it
  double on_s = 0.02, off_s = 0.01;  // time to open after the pedal is pressed, to close after its release
};

struct MotorMoment {
  bool pedal = false;  // the spindle is commanded to turn
  double spindle_rpm = 0;
  int teeth = 0;
  Vec3 normal_n = Vec3::Zero();  // of the bone on the tool, physical
  Vec3 axis = Vec3::UnitZ();     // of the tool, out of its tip; the tool turns clockwise as its holder sees it
  bool cutting = false;
  double across_n = 0;         // while it cuts: the law's force across the feed, physical, as ForceLaw::across_n says
  Vec3 stroke = Vec3::Zero();  // of a saw: unit vector along which its teeth oscillate; zero: the tool turns
  double pull_n = 0;           // of a drill that breaks through, along the axis out of its tip; within the same bound
};

class MotorPort {
 public:
  explicit MotorPort(const MotorPortParams& params = {}) : params_(params) {}
  void reset() noexcept;
  // [haptic] Force on the tool, physical, N, in the frame of the moment's vectors. Its size is at most friction times
  // that of the normal force. It is zero as soon as the pedal has been released for off_s.
  [[nodiscard]] Vec3 step(const MotorMoment& moment, double dt_s) noexcept;
  // [haptic] 0 … 1: share of the motor's force that passes now; zero once the pedal has been released for off_s.
  [[nodiscard]] double open() const noexcept { return open_; }
  [[nodiscard]] const MotorPortParams& params() const noexcept { return params_; }

 private:
  MotorPortParams params_;
  double open_ = 0;     // 0 … 1
  double usual_n_ = 0;  // normal force, followed slowly
  double phase_ = 0;    // of the teeth, or of a saw's stroke, in turns
};

}  // namespace osteon::haptic
