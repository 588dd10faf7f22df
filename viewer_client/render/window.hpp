// The picture: one window with the bone, the tools and a line of gauges. VTK stays behind this page.
// All functions: [render], the thread that opened the window.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/mechanics/cutting_state.hpp"
#include "common/tools/annotation.hpp"
#include "common/tools/scene_item.hpp"
#include "viewer_client/scene/camera_view.hpp"
#include "viewer_client/scene/surface_scene.hpp"

namespace osteon {

struct WindowOptions {
  int width_px = 1280;
  int height_px = 720;
  std::string title = "Osteon";
};

// Pixels as one sees them, rows from the top.
struct Image {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::array<std::uint8_t, 3>> rgb;
  [[nodiscard]] const std::array<std::uint8_t, 3>& at(int x, int y) const {
    return rgb[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x)];
  }
};

// What the user did in the window since it was last asked.
struct WindowEvents {
  bool closed = false;
  bool redraw = false;          // the camera moved or the window was uncovered or resized
  bool wants_overview = false;  // key O
  bool wants_tool = false;      // key T
  bool wants_wipe = false;      // key X
  std::optional<Vec3> pointed;  // key P, then a click on the surface; bone frame, mm
  std::vector<Vec3> drawn;      // key L, then a line drawn on the surface with the left button; empty: none
};

class BoneWindow {
 public:
  // Error not_found: no X display, one that cannot be reached, or one without OpenGL.
  [[nodiscard]] static Result<std::unique_ptr<BoneWindow>> open(const WindowOptions& options);
  ~BoneWindow();

  // The region's whole mesh, bone frame; an empty mesh takes the region out of the picture.
  void show_region(const RegionKey& region, const Mesh& mesh);
  // The tools of the room; those not in the list vanish. A translucent ghost stands where the hand is, if not there.
  void show_tools(std::span<const CuttingState> states);
  // A tool that is not built in, as the room defines it; from now on states and items may name it.
  void learn_tool(const Tool& tool);
  // What stands on the bone; what is not in the list vanishes.
  void show_items(std::span<const SceneItem> items);
  void show_text(const std::string& gauges, const std::string& notice);
  // What people have drawn; what is not in the list vanishes.
  void show_annotations(std::span<const Annotation> drawn);
  // Each tool is named by its person.
  void show_names(std::map<AuthorId, std::string> names);
  // Who said what, one after the other; and what holds for one's own hand, in lines.
  void show_words(const std::vector<std::string>& said, const std::string& holding);

  // What of the bone is seen at a pixel, columns from the left and rows from the top; bone frame.
  [[nodiscard]] std::optional<Vec3> surface_at(int x_px, int y_px) const;

  void look(const CameraView& view);
  [[nodiscard]] CameraView camera() const;

  void draw();
  // Draws once more with soft shadows in hollows, which a live picture in software has no time for, and saves that.
  [[nodiscard]] Result<void> save_png(const std::filesystem::path& file);
  // What the last draw() made.
  [[nodiscard]] Image image() const;

  // Handles what the window system has sent.
  [[nodiscard]] WindowEvents events();

 private:
  struct Impl;
  explicit BoneWindow(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon
