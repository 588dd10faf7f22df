// What people draw, who holds which tool, and what is said, over the picture of the bone. All sizes are of the screen:
// an arrow is as long in a close view as in one of the whole. All functions: [render], the thread that opened the
// window.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/mechanics/cutting_state.hpp"
#include "common/tools/annotation.hpp"

class vtkRenderer;
class vtkRenderWindow;

namespace osteon {

class PeopleOverlay {
 public:
  // The surface's outer normal near a point in the bone's frame; none where no surface is near.
  using NormalAt = std::function<std::optional<Vec3>(const Vec3&)>;

  // Both must outlive it.
  PeopleOverlay(vtkRenderer& bone, vtkRenderWindow& window, NormalAt normal_at);
  ~PeopleOverlay();

  // Those not in the list vanish.
  void show_annotations(std::span<const Annotation> drawn);
  // A line that is being drawn and nobody else sees yet; fewer than two points: none.
  void show_stroke(const std::vector<Vec3>& points_mm);
  void show_names(std::map<AuthorId, std::string> names);
  // Beside which the names of their people stand.
  void show_tools(std::span<const CuttingState> states);
  // Lines of their own; what is longer than the window is wide is broken. Empty: nothing.
  void show_words(const std::vector<std::string>& said, const std::string& holding, const std::string& hint);

  // To be called before each picture: the camera may have moved.
  void place();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
