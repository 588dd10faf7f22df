// The metal that stands in the beam of a C-arm: the tools in hands, and the guides, pins, screws and trial implants on
// the bone.
#pragma once
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/core/digest.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/radiology/metal.hpp"
#include "common/tools/scene_item.hpp"

namespace osteon {

struct PlacedMetal {
  // In its own frame. Shared by all that have its shape, and with the thread that casts it.
  std::shared_ptr<const Implicit> solid;
  Pose pose_bone_solid;
  friend bool operator==(const PlacedMetal& a, const PlacedMetal& b) {
    return a.solid == b.solid && a.pose_bone_solid.position_mm == b.pose_bone_solid.position_mm &&
           a.pose_bone_solid.rotation.coeffs() == b.pose_bone_solid.rotation.coeffs();
  }
};
// [A] All of it is steel: a tool does not say what it is made of.
[[nodiscard]] radiology::MetalSolid in_bone_frame(const PlacedMetal& metal);

// Makes the solid of each tool once. Not synchronised: one thread.
class MetalInBeam {
 public:
  MetalInBeam();
  // A tool that is not built in, as the room defines it.
  void learn(const Tool& tool);
  // What nobody knows the shape of casts no shadow.
  [[nodiscard]] std::vector<PlacedMetal> of(std::span<const CuttingState> states, std::span<const SceneItem> items);

 private:
  struct Shape {
    Tool tool;
    std::shared_ptr<const Implicit> solid;  // null: nobody has asked for it yet
  };
  void add(std::vector<PlacedMetal>& to, const std::string& name, const Pose& pose);

  std::map<std::string, Shape> shapes_;
  std::map<Digest, std::string> names_;
};

}  // namespace osteon
