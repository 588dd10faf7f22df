// Draws what people say and annotate, and who holds which tool, over the picture of the bone. All sizes are screen
// sizes: an arrow has the same length in a close view and in an overview. All functions: [render], the thread that
// opened the window.
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
#include "viewer_client/render/layer_above.hpp"

class vtkRenderWindow;

namespace osteon {

class PeopleOverlay {
 public:
  // The outer normal of the surface near a point, bone frame. None if no surface is near.
  using NormalAt = std::function<std::optional<Vec3>(const Vec3&)>;

  // All must outlive it.
  PeopleOverlay(const BonePictures& bone, vtkRenderWindow& window, NormalAt normal_at);
  ~PeopleOverlay();

  // Annotations that are not in the list vanish.
  void show_annotations(std::span<const Annotation> drawn);
  // A line that this window's user is drawing; others do not see it yet. Fewer than two points: none.
  void show_stroke(const std::vector<Vec3>& points_mm);
  void show_names(std::map<AuthorId, std::string> names);
  // The names of the tools' people are shown beside these tools.
  void show_tools(std::span<const CuttingState> states);
  // Each text has its own lines. A line longer than the picture's width is wrapped. Empty: nothing.
  void show_words(const std::vector<std::string>& said, const std::string& holding, const std::string& hint);

  // Call this before each picture, because the camera may have moved. `two_pictures`: side by side. Then names and
  // words are in both.
  void place(bool two_pictures);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
