// Turns mouse and keys over the picture into what the pointer device of the haptic client wants to know: where the tool
// rests, how it points, and how hard the hand pushes. Pure geometry; the window sends the result.
#pragma once
#include <optional>
#include <string>

#include "common/input/pointer_link.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/surface_scene.hpp"

namespace osteon {

// [render]
class ToolPointer {
 public:
  // The tool that the hand is to hold. Its turn begins anew. Speed, wear and law are the tool's own.
  void take(const std::string& tool);
  // The hand is empty, as at the beginning.
  void put_down();
  void set_irrigation(bool on) { input_.irrigation = on; }
  void set_suction(bool on) { input_.suction = on; }
  void set_spindle_speed(double rpm) { input_.spindle_rpm = rpm; }  // 0: the tool's own
  // Wear and force law of the tool, as PointerInput says.
  void set_wear_and_law(const std::optional<double>& wear, const std::string& law);

  // The pointer moved to this ray. While nobody pushes, the tool rests where the ray meets the surface and points along
  // the mean normal into the bone. While somebody pushes, the tool keeps its direction and moves across it.
  void move(const SightRay& ray, const SurfaceScene& surface);
  // A stick moved the pointer for dt_s. `right` and `up`: -1 to 1 of the fastest, in the picture's axes. The tool stays
  // on bone: a gap is crossed, and at an edge it waits. Without a place on bone it begins in the picture's middle, or
  // next to it. While somebody pushes, the tool moves across its axis, no faster than a hand can follow.
  void slide(const CameraView& view, double right, double up, double dt_s, const SurfaceScene& surface);
  // The pointer left the picture.
  void leave();
  // The button went down. False: there is no bone under the pointer.
  [[nodiscard]] bool press();
  void release();
  // Turns the tool by radians about the picture's axes: `right` about its vertical, `up` about its horizontal axis.
  void turn(const CameraView& view, double right_rad, double up_rad);
  // Turns the tool by an axis times an angle. Frame: the picture's, x right, y up, z to the eye.
  void twist(const CameraView& view, const Vec3& twist_rad);
  void roll(double angle_rad);  // about its own axis, as of a saw
  void add_push(double newtons);
  void set_push(double newtons);
  void set_fine(bool fine) { input_.fine = fine; }
  void set_spindle(bool on) { spindle_ = on; }
  void set_source(PointerSource source) { input_.source = source; }

  [[nodiscard]] bool pushing() const { return input_.push; }
  [[nodiscard]] bool on_bone() const { return input_.on_bone; }
  [[nodiscard]] bool spindle() const { return spindle_; }
  [[nodiscard]] double push_n() const { return input_.push_n; }
  [[nodiscard]] const std::string& tool() const { return input_.tool; }
  [[nodiscard]] const PointerInput& input();
  // Of the bone under the pointer, when it last was over bone and nobody pushed.
  [[nodiscard]] const std::optional<SurfaceHit>& hit() const { return hit_; }

 private:
  PointerInput input_{.empty_hand = true};
  std::optional<SurfaceHit> hit_;
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();  // of the tool, away from the normal, bone frame
  double roll_rad_ = 0;
  Vec3 normal_ = Vec3::UnitZ();
  bool spindle_ = false;
  Vec3 beside_mm_ = Vec3::Zero();  // from the tool's place on bone to where a stick is, over a gap or beside the bone

  void aim();
  void find_bone(const CameraView& view, const SurfaceScene& surface);
};

}  // namespace osteon
