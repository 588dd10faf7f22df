// How thick the cortical layer is that a tool cuts. It looks along lines beside the tool and parallel to its feed,
// because where the tool was nothing is left to measure.
#pragma once
#include <array>
#include <cstddef>

#include "haptic_client/contact/patch.hpp"
#include "haptic_client/contact/tool_model.hpp"

namespace osteon::haptic {

class CortexProbe {
 public:
  // The longest way that is looked along, to each side of the tool. What is thicker counts as that thick.
  static constexpr double kFarthest_mm = 10.0;

  // [haptic] Looks along one line, in some dozen samples: each call takes the next of the four. `touching`: the tool
  // has bone to cut. `on_bone_n`: the tool's force on the bone, which is the way into it for a tool that is not fed
  // along its axis. A patch ends some millimetres beyond the tip, so a thick layer is seen wholly only from inside.
  void step(const ToolModel& model, const Patch& patch, const Pose& pose_bone_tool, bool touching,
            const Vec3& on_bone_n) noexcept;

  // Median of the lines that are in a cortical layer, 0 if none is.
  [[nodiscard]] double thickness_mm() const noexcept;

 private:
  std::array<double, 4> lines_mm_{};
  std::size_t next_ = 0;
  Vec3 into_ = Vec3::Zero();  // the newest way into the bone, tool frame; zero: along the axis
};

}  // namespace osteon::haptic
