// The picture in a render window: bone, tools, items, and what people say and draw. Its owner gives the window and
// decides when to draw. So the same scene is in the window of a script, in a Qt widget, and in tests. It hides VTK from
// the rest of the program. All functions: [render], the thread that owns the window.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/surface/density_grid.hpp"
#include "common/surface/surgical_plan.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/scene_item.hpp"
#include "viewer_client/render/image.hpp"
#include "viewer_client/render/stereo.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/clipping.hpp"
#include "viewer_client/scene/surface_scene.hpp"

class vtkRenderWindow;

namespace osteon {

class BoneScene {
 public:
  // Adds its renderers to the window, which must outlive it.
  explicit BoneScene(vtkRenderWindow& window);
  ~BoneScene();

  // The region's whole mesh, bone frame. An empty mesh removes the region from the picture.
  void show_region(const RegionKey& region, const Mesh& mesh);
  // Paints the cut faces of regions that are shown from now on by density. Shared with whoever else reads it.
  void set_density(std::shared_ptr<const DensityGrid> density);
  // The tools of the room. Tools that are not in the list vanish. A translucent ghost shows the pose of the user's hand
  // where it differs from the tool.
  void show_tools(std::span<const CuttingState> states);
  // Adds a tool that is not built in, as the room defines it. From then on states and items may name it.
  void learn_tool(const Tool& tool);
  // The items on the bone. Items that are not in the list vanish.
  void show_items(std::span<const SceneItem> items);
  void show_text(const std::string& gauges, const std::string& notice);
  // The annotations of the room. Annotations that are not in the list vanish.
  void show_annotations(std::span<const Annotation> drawn);
  // Each tool shows the name of its person.
  void show_names(std::map<AuthorId, std::string> names);
  // What was said, one line for each person's text, and the restrictions of one's own hand, in lines.
  void show_words(const std::vector<std::string>& said, const std::string& holding);
  // What the mouse does next, as a sentence (empty: nothing), and a line that is being drawn, bone frame, mm.
  void show_pen(const std::string& hint, const std::vector<Vec3>& stroke_mm);

  // The point of the bone at a pixel, bone frame. Columns from the left, rows from the top.
  [[nodiscard]] std::optional<Vec3> surface_at(int x_px, int y_px) const;
  // The mean outer normal of the surface near a point, bone frame. None if no surface is near.
  [[nodiscard]] std::optional<Vec3> normal_at(const Vec3& point_mm) const;

  void look(const CameraView& view);
  [[nodiscard]] CameraView camera() const;

  // What is planned, and the structures at risk. Nothing of it is drawn before show_planned() and show_risks().
  void show_plan(const SurgicalPlan& plan);
  // How the names of axes are written from the next plan on, UTF-8; at first as they are.
  void name_axes(std::function<std::string(const std::string&)> written);
  // Axes, planes and regions, through the bone too.
  void show_planned(bool on);
  // Structures at risk: translucent before the bone, and fainter behind it.
  void show_risks(bool on);

  // The cube that names the patient's sides. It is off at first.
  void show_marker(bool on);
  // Draws only this part of the bone. Where the bone is open, its inside is seen. Tools and items stay whole.
  void clip(const Clipping& visible);
  // False: this window does not have the mode, and stereo is off.
  [[nodiscard]] bool set_stereo(StereoMode mode);
  [[nodiscard]] StereoMode stereo() const;

  // Smooth edges in live pictures. Saved pictures always have them.
  void set_smooth(bool smooth);
  void draw();
  // Draws once more with soft shadows in hollows, and saves that picture. A live picture in software has no time for
  // such shadows.
  [[nodiscard]] Result<void> save_png(const std::filesystem::path& file);
  // The picture of the last draw().
  [[nodiscard]] Image image() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Whether the window's OpenGL draws on the processor. The window's context must be usable.
[[nodiscard]] bool draws_in_software(vtkRenderWindow& window);

}  // namespace osteon
