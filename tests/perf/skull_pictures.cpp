// Pictures of an imported bone with a groove, 1280 x 720, from several sides: coarse where nobody looks or works, as
// `--detail near` draws it, and in full. Counts pixels that have a cut's colour and are not beside the cut. Measures
// how far the shaded normal turns from one pixel to the next, within a level of detail and where two levels meet, and
// compares the outlines of both. Takes the case's folder, and a folder for pictures if they are wanted. Prints JSON.
#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "tests/perf/drawn_bone.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/xvfb.hpp"
#include "viewer_client/render/actors.hpp"
#include "viewer_client/render/view_of_camera.hpp"
#include "viewer_client/render/window.hpp"

namespace osteon::test {
namespace {

constexpr int kWidth_px = 1280, kHeight_px = 720;
constexpr double kGroove_mm = 14.0, kDeep_mm = 1.2;

using Blocks = std::vector<ReceivedBlock>;

// The surface in flat colours that are numbers. The background is black.
class FlatPicture {
 public:
  FlatPicture() {
    window_->SetMultiSamples(0);
    window_->SetSize(kWidth_px, kHeight_px);
    window_->AddRenderer(renderer_);
  }
  ~FlatPicture() { window_->Finalize(); }
  FlatPicture(const FlatPicture&) = delete;
  FlatPicture& operator=(const FlatPicture&) = delete;

  // `colour` of a block's vertex.
  Image draw(const Blocks& blocks, const CameraView& view,
             const std::function<Colour(const ReceivedBlock&, std::size_t)>& colour) {
    renderer_->RemoveAllViewProps();
    for (const ReceivedBlock& block : blocks) {
      std::vector<Colour> colours(block.mesh.positions_mm.size());
      for (std::size_t v = 0; v < colours.size(); ++v) colours[v] = colour(block, v);
      const auto actor =
          actor_of(poly_data(block.mesh.positions_mm, block.mesh.normals, colours, block.mesh.triangles));
      actor->GetProperty()->SetLighting(false);
      actor->GetProperty()->SetBackfaceCulling(true);
      renderer_->AddActor(actor);
    }
    set_view(*renderer_->GetActiveCamera(), view);
    renderer_->ResetCameraClippingRange();
    window_->Render();
    return image_of(*window_);
  }

 private:
  vtkNew<vtkRenderWindow> window_;
  vtkNew<vtkRenderer> renderer_;
};

// Each pixel's level of detail and shaded normal. No bone: the level is kNoLevel.
constexpr int kNoLevel = 99;
struct Pixel {
  int level = kNoLevel;
  Vec3 normal = Vec3::Zero();
};
struct Seen {
  std::vector<Pixel> pixels;
  [[nodiscard]] const Pixel& at(int x, int y) const { return pixels[static_cast<std::size_t>(y * kWidth_px + x)]; }
  [[nodiscard]] bool bone(int x, int y) const {
    return x >= 0 && y >= 0 && x < kWidth_px && y < kHeight_px && at(x, y).level != kNoLevel;
  }
};

Seen see(FlatPicture& flat, const Blocks& blocks, const CameraView& view) {
  constexpr int kLevelColour = 40;
  const Image normals = flat.draw(blocks, view, [](const ReceivedBlock& block, std::size_t v) {
    Colour colour;
    for (std::size_t i = 0; i < 3; ++i)
      colour[i] = static_cast<std::uint8_t>(std::lround(127.5f * (1.0f + block.mesh.normals[v][i])));
    return colour;
  });
  const Image levels = flat.draw(blocks, view, [](const ReceivedBlock& block, std::size_t) {
    const auto colour = static_cast<std::uint8_t>(kLevelColour * (block.key.level - kCoarsestLevel + 1));
    return Colour{colour, colour, colour};
  });
  Seen result;
  result.pixels.resize(normals.rgb.size());
  for (std::size_t i = 0; i < result.pixels.size(); ++i) {
    if (levels.rgb[i][0] == 0) continue;
    result.pixels[i].level = levels.rgb[i][0] / kLevelColour - 1 + kCoarsestLevel;
    const auto& [r, g, b] = normals.rgb[i];
    result.pixels[i].normal = Vec3(r - 127.5, g - 127.5, b - 127.5).normalized();
  }
  return result;
}

// How far the shaded normal turns from pixel to pixel, degrees.
struct Jumps {
  std::vector<double> within, across;

  // Pairs of pixels beside each other. Where one part of the bone hides another, there is no surface on which a normal
  // could turn. So the points that both show must be near.
  void add(const Seen& seen, const SurfaceScene& surface, const CameraView& view) {
    const double pixel_mm = 2.0 * std::tan(0.5 * view.view_angle_rad) / kHeight_px;  // at a distance of 1 mm
    const auto take = [&](int x, int y, int x2, int y2) {
      const Pixel &a = seen.at(x, y), &b = seen.at(x2, y2);
      if (a.level == kNoLevel || b.level == kNoLevel) return;
      const double turned = std::acos(std::clamp(a.normal.dot(b.normal), -1.0, 1.0)) * 180.0 / std::numbers::pi;
      std::vector<double>& jumps = a.level == b.level ? within : across;
      // Only what may be the largest is looked at more closely.
      if (a.level == b.level && !jumps.empty() && turned <= jumps.back()) return;
      const auto hit = [&](int px, int py) {
        const SightRay ray = ray_through(view, kWidth_px, kHeight_px, px, py);
        return surface.first_hit(ray.from_mm, ray.direction);
      };
      const auto first = hit(x, y), second = hit(x2, y2);
      if (!first || !second) return;
      const double reach_mm = 3.0 * pixel_mm * (first->point_mm - view.eye_mm).norm();
      if ((first->point_mm - second->point_mm).norm() > reach_mm) return;
      jumps.push_back(turned);
    };
    for (int y = 0; y + 1 < kHeight_px; ++y)
      for (int x = 0; x + 1 < kWidth_px; ++x) {
        take(x, y, x + 1, y);
        take(x, y, x, y + 1);
      }
  }
};

// Compares where two pictures show bone. Pixels of both are counted. An outline is of pixels of bone beside one
// without; it is apart where the other picture has none at most a pixel away. A pixel differs that is bone, or is none,
// unlike the same pixel of the other picture and all beside it.
struct Outlines {
  int pixels = 0, differing = 0, outline_pixels = 0, apart = 0;

  static bool outline(const Seen& seen, int x, int y) {
    return seen.bone(x, y) &&
           !(seen.bone(x - 1, y) && seen.bone(x + 1, y) && seen.bone(x, y - 1) && seen.bone(x, y + 1));
  }
  void add(const Seen& one, const Seen& other) {
    for (int y = 0; y < kHeight_px; ++y)
      for (int x = 0; x < kWidth_px; ++x) {
        for (const auto& [from, to] : {std::pair(&one, &other), std::pair(&other, &one)}) {
          bool near = false, same = false;
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) {
              near = near || outline(*to, x + dx, y + dy);
              same = same || to->bone(x + dx, y + dy) == from->bone(x, y);
            }
          outline_pixels += outline(*from, x, y) ? 1 : 0;
          apart += outline(*from, x, y) && !near ? 1 : 0;
          differing += same ? 0 : 1;
          ++pixels;
        }
      }
  }
};

// The groove of a round burr: all points that its ball reaches.
struct Groove {
  Tool burr = *find_tool("burr-round-5");
  Vec3 from_mm, to_mm, out;

  [[nodiscard]] Cut cut_at(double pitch_mm) const {
    Cut cut = straight_cut(burr, from_mm, to_mm, -out);
    cut.level = std::min(burr.cut_level, finest_level(pitch_mm));
    return cut;
  }
  [[nodiscard]] Vec3 middle_mm() const { return 0.5 * (from_mm + to_mm); }
  [[nodiscard]] double outside_mm(const Vec3& at) const {
    const double radius_mm = 0.5 * burr.diameter_mm;
    const Vec3 centre = at - radius_mm * out - from_mm, along = to_mm - from_mm;
    return (centre - std::clamp(centre.dot(along) / along.squaredNorm(), 0.0, 1.0) * along).norm() - radius_mm;
  }
};

// Pixels of the cut's colour; bone has 1.07 times as much red as green, a cut 1.53 times. Off the cut is what lies
// farther from the burr's way than a cell of the bone, for the pixel and for all beside it.
struct CutPixels {
  int on_cut = 0, off_cut = 0;

  void add(const Image& image, const SurfaceScene& surface, const CameraView& view, const Groove& groove,
           double pitch_mm) {
    for (int y = 0; y < kHeight_px; ++y)
      for (int x = 0; x < kWidth_px; ++x) {
        const auto& [r, g, b] = image.at(x, y);
        if (r < 60 || r < 1.25 * g) continue;
        bool beside = false;
        for (int i = 0; i < 9 && !beside; ++i) {
          const int dx = (i + 1) % 3 - 1, dy = (i / 3 + 1) % 3 - 1;  // the pixel itself first
          const SightRay ray = ray_through(view, kWidth_px, kHeight_px, x + dx, y + dy);
          const auto hit = surface.first_hit(ray.from_mm, ray.direction);
          beside = hit && groove.outside_mm(hit->point_mm) < pitch_mm;
        }
        ++(beside ? on_cut : off_cut);
      }
  }
};

SurfaceScene surface_of(const Blocks& blocks) {
  SurfaceScene surface;
  for (const ReceivedBlock& block : blocks) surface.replace(block);
  return surface;
}

Image shaded(const Blocks& blocks, const CameraView& view, const std::filesystem::path& file) {
  auto window = BoneWindow::open({kWidth_px, kHeight_px, "Osteon"});
  OSTEON_CHECK(window.has_value());
  SurfaceScene surface = surface_of(blocks);
  for (const RegionKey& region : surface.take_dirty())
    (*window)->scene().show_region(region, surface.region_mesh(region));
  (*window)->scene().look(view);
  (*window)->draw();
  Image image = (*window)->scene().image();
  if (!file.empty()) OSTEON_CHECK(write_png(image, file).has_value());
  return image;
}

double part(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// A groove where the middle of this view meets the bone.
Groove groove_at(const DrawnBone& bone, const CameraView& view) {
  const SurfaceScene whole = surface_of(bone.received());
  const auto hit = whole.first_hit(view.eye_mm, (view.target_mm - view.eye_mm).normalized());
  OSTEON_CHECK(hit.has_value());
  Groove groove;
  groove.out = whole.mean_normal(hit->point_mm, 5.0).value_or(hit->normal);
  const Vec3 along = 0.5 * kGroove_mm * groove.out.unitOrthogonal(), deep = hit->point_mm - kDeep_mm * groove.out;
  groove.from_mm = deep - along;
  groove.to_mm = deep + along;
  return groove;
}

// From all round, and close to the groove.
std::vector<CameraView> views_of(const CameraView& far_view, const Groove& groove) {
  std::vector<CameraView> views;
  for (int side = 0; side < 6; ++side) views.push_back(orbited(far_view, side * std::numbers::pi / 3.0, 0.0));
  for (const double distance_mm : {60.0, 120.0}) {
    CameraView close = far_view;
    close.target_mm = groove.middle_mm();
    close.eye_mm = close.target_mm + distance_mm * (groove.out + 0.3 * Vec3::UnitZ()).normalized();
    views.push_back(close);
  }
  return views;
}

// What all pictures together show.
struct Findings {
  Jumps jumps;
  Outlines outlines;
  CutPixels cut;
  std::map<int, std::size_t> triangles;  // of each level
  std::size_t views = 0;
};

Findings look_at(DrawnBone& bone, const std::filesystem::path& pictures) {
  const double h = bone.pitch_mm();
  const CameraView far_view = overview({position_mm(bone.samples().min, h), position_mm(bone.samples().max, h)});
  const Groove groove = groove_at(bone, far_view);
  bone.apply(groove.cut_at(h));
  const Blocks full = bone.received();
  FlatPicture flat;
  Findings found;
  for (const CameraView& view : views_of(far_view, groove)) {
    bone.focus(std::array{focus_of(look_of(view, kWidth_px, kHeight_px), h), focus_of_tool(groove.middle_mm())});
    const Blocks coarse = bone.received();
    for (const ReceivedBlock& block : coarse) found.triangles[block.key.level] += block.mesh.triangles.size();
    const SurfaceScene surface = surface_of(coarse);
    const Seen near = see(flat, coarse, view);
    found.jumps.add(near, surface, view);
    found.outlines.add(near, see(flat, full, view));
    const std::string name = std::to_string(found.views++) + ".png";
    const Image image = shaded(coarse, view, pictures.empty() ? pictures : pictures / name);
    found.cut.add(image, surface, view, groove, h);
  }
  return found;
}

int measure(const char* folder, const std::filesystem::path& pictures) {
  const auto loaded = Case::load(folder);
  if (!loaded) {
    std::fprintf(stderr, "osteon-skull-pictures: %s\n", loaded.error().message.c_str());
    return 1;
  }
  const auto screen = Xvfb::start("1280x720");
  if (!screen) {
    std::fprintf(stderr, "osteon-skull-pictures: Xvfb, of Debian's package xvfb, did not start\n");
    return 1;
  }
  ::setenv("DISPLAY", screen->display().c_str(), 1);
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);

  DrawnBone bone(*loaded);
  const Findings found = look_at(bone, pictures);
  const auto& [jumps, outlines, cut, triangles, views] = found;
  std::printf("{\"pitch_mm\": %.4f, \"views\": %zu, \"cut_pixels\": %d, \"off_cut_pixels\": %d, ", bone.pitch_mm(),
              views, cut.on_cut, cut.off_cut);
  std::printf("\"jump_within_max\": %.2f, \"jump_across_max\": %.2f, \"jump_across_p99\": %.2f, \"seam_pixels\": %zu, ",
              part(jumps.within, 1.0), part(jumps.across, 1.0), part(jumps.across, 0.99), jumps.across.size());
  std::printf("\"outline_pixels\": %d, \"outline_apart\": %d, \"pixels\": %d, \"differing\": %d",
              outlines.outline_pixels, outlines.apart, outlines.pixels, outlines.differing);
  for (const auto& [level, count] : triangles) std::printf(", \"triangles_level_%d\": %zu", level, count);
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "osteon-skull-pictures: needs a case's folder\n");
    return 1;
  }
  return osteon::test::measure(argv[1], argc > 2 ? argv[2] : "");
}
