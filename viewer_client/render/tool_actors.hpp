// Draws the tools in people's hands, and the items that stand in the bone. All functions: [render], the thread that
// opened the window.
#pragma once
#include <memory>
#include <span>

#include "common/mechanics/cutting_state.hpp"
#include "common/tools/scene_item.hpp"
#include "common/tools/tool.hpp"

class vtkRenderer;

namespace osteon {

class ToolActors {
 public:
  // It knows the built-in tools. The renderer must outlive it.
  explicit ToolActors(vtkRenderer& renderer);
  ~ToolActors();

  // Adds a tool that is not built in, or replaces one. From then on states and items may name it.
  void learn(const Tool& tool);
  // Tools that are not in the list vanish. A translucent ghost shows the pose of the hand where it differs from the
  // tool. Returns true if a tool is new; it is then drawn after the next add().
  [[nodiscard]] bool show_tools(std::span<const CuttingState> states);
  // Items that are not in the list vanish. The others are drawn after the next add().
  void show_items(std::span<const SceneItem> items);

  // Adds all actors to the renderer: items in the order of their numbers, then tools in the order of their authors.
  void add();
  void remove();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
