// Times of frames of 1280 x 720 in software, in turns in one run. First a bone of about 500 blocks: a frame before
// which five of them changed, and one of the same scene at rest. What the viewer does with changed blocks is in it:
// copies of meshes, colours, the upload. Then a bone of a million triangles: Osteon's scene, and a program that gives
// the same triangles to one vtkPolyDataMapper. Takes the number of frames of each kind. Prints JSON.
#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/surface/weld.hpp"
#include "tests/perf/drawn_bone.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/xvfb.hpp"
#include "viewer_client/render/actors.hpp"
#include "viewer_client/render/lighting.hpp"
#include "viewer_client/render/scene_updater.hpp"
#include "viewer_client/render/view_of_camera.hpp"
#include "viewer_client/render/window.hpp"

namespace osteon::test {
namespace {

constexpr int kWidth_px = 1280, kHeight_px = 720;
constexpr double kPitch_mm = 0.5;
// Balls of these radii have about 500 blocks, and a million triangles.
constexpr double kBlocksRadius_mm = 41.0, kTrianglesRadius_mm = 81.5;
constexpr std::size_t kChanged = 5;
constexpr int kWarmUp = 3;
constexpr double kTurn_rad = 0.01;  // of the camera, from frame to frame

template <class Work>
double ms(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print(const char* name, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf("\"%s\": {\"p50\": %.3f, \"min\": %.3f, \"max\": %.3f}", name, values[values.size() / 2], values.front(),
              values.back());
}

std::vector<ReceivedBlock> ball(double radius_mm) { return DrawnBone(large_ball(radius_mm, kPitch_mm)).received(); }

CameraView whole(double radius_mm) { return overview({Vec3::Constant(-radius_mm), Vec3::Constant(radius_mm)}); }

// Osteon's window, filled through the queue that its network threads fill.
struct Viewed {
  RenderQueue queue;
  std::unique_ptr<BoneWindow> window;
  std::optional<SceneUpdater> updater;

  Viewed() {
    auto opened = BoneWindow::open({kWidth_px, kHeight_px, "Osteon"});
    OSTEON_CHECK(opened.has_value());
    window = std::move(*opened);
    updater.emplace(queue, window->scene());
  }
  void fill(const std::vector<ReceivedBlock>& blocks, const CameraView& view) {
    queue.begin_stream();
    queue.put_mesh(RoomSeq{1}, blocks, true, static_cast<std::uint32_t>(blocks.size()), 0);
    window->scene().look(view);
    OSTEON_CHECK(updater->update(false));
  }
  void put(std::vector<ReceivedBlock> blocks) { queue.put_mesh(RoomSeq{2}, std::move(blocks), true, 0, 0); }
  void draw() { window->draw(); }
};

// Frames after five blocks changed, which are spread over the bone, and frames of the bone at rest.
void changed_blocks(Viewed& viewed, int frames) {
  const std::vector<ReceivedBlock> whole_ball = ball(kBlocksRadius_mm);
  // The other version of each block is that of a ball a tenth of a millimetre smaller.
  std::map<BlockKey, ReceivedBlock> smaller;
  for (ReceivedBlock& block : ball(kBlocksRadius_mm - 0.1)) smaller.emplace(block.key, std::move(block));
  viewed.fill(whole_ball, whole(kBlocksRadius_mm));

  std::vector<double> changed, at_rest, updates;
  std::vector<bool> small(whole_ball.size());
  std::uint64_t version = 1;
  const std::size_t stride = whole_ball.size() / kChanged;
  for (int frame = -kWarmUp; frame < frames; ++frame) {
    std::vector<ReceivedBlock> sent;
    for (std::size_t i = 0; i < kChanged; ++i) {
      const std::size_t which = (static_cast<std::size_t>(frame + kWarmUp) * 7 + i * stride) % whole_ball.size();
      const auto other = smaller.find(whole_ball[which].key);
      small[which] = !small[which];
      ReceivedBlock block = small[which] && other != smaller.end() ? other->second : whole_ball[which];
      if (small[which] && other == smaller.end()) block = {block.key, 0, {}, {}};
      block.version = ++version;
      sent.push_back(std::move(block));
    }
    viewed.put(std::move(sent));
    const double update = ms([&] { OSTEON_CHECK(viewed.updater->update(false)); });
    const double drawn = ms([&] { viewed.draw(); });
    const double rest = ms([&] { viewed.draw(); });
    if (frame < 0) continue;
    updates.push_back(update);
    changed.push_back(update + drawn);
    at_rest.push_back(rest);
  }
  const SurfaceScene& surface = viewed.updater->surface();
  std::printf("\"blocks\": %zu, \"regions\": %zu, \"block_triangles\": %zu, ", surface.blocks(), surface.regions(),
              surface.triangles());
  print("changed_ms", changed);
  std::printf(", ");
  print("update_ms", updates);
  std::printf(", ");
  print("at_rest_ms", at_rest);
}

// A program with VTK alone: one mapper with normals. It has Osteon's lights and material.
struct Bare {
  vtkNew<vtkRenderWindow> window;
  vtkNew<vtkRenderer> renderer;
  vtkSmartPointer<vtkActor> actor;

  explicit Bare(const std::vector<ReceivedBlock>& blocks) {
    std::vector<Mesh> meshes;
    for (const ReceivedBlock& block : blocks) meshes.push_back(block.mesh);
    const Mesh mesh = weld(meshes);
    const auto data = poly_data(mesh.positions_mm, mesh.normals, {}, mesh.triangles);
    data->GetPointData()->SetScalars(nullptr);
    actor = actor_of(data);
    vtkProperty* bone = actor->GetProperty();
    bone->SetInterpolationToPhong();
    bone->SetColor(0.95, 0.89, 0.77);
    bone->SetAmbient(0.10);
    bone->SetDiffuse(0.88);
    bone->SetSpecular(0.13);
    bone->SetSpecularPower(22.0);
    window->SetMultiSamples(0);
    window->SetSize(kWidth_px, kHeight_px);
    window->SetPosition(kWidth_px, 0);
    window->AddRenderer(renderer);
    set_lighting(*renderer);
    renderer->AddActor(actor);
  }
  ~Bare() { window->Finalize(); }
  Bare(const Bare&) = delete;
  Bare& operator=(const Bare&) = delete;

  void look(const CameraView& view) { set_view(*renderer->GetActiveCamera(), view); }
  void draw(bool culls) {
    actor->GetProperty()->SetBackfaceCulling(culls);
    renderer->ResetCameraClippingRange();
    window->Render();
    window->WaitForCompletion();
  }
};

// Frames of a turning bone of a million triangles by Osteon and by VTK, with and without its back faces.
void million_triangles(Viewed& viewed, int frames) {
  const std::vector<ReceivedBlock> blocks = ball(kTrianglesRadius_mm);
  viewed.fill(blocks, whole(kTrianglesRadius_mm));
  Bare bare(blocks);
  std::vector<double> ours, culled, plain;
  for (int frame = -kWarmUp; frame < frames; ++frame) {
    const CameraView view = orbited(whole(kTrianglesRadius_mm), kTurn_rad * frame, 0.0);
    viewed.window->scene().look(view);
    bare.look(view);
    const double a = ms([&] { viewed.draw(); }), b = ms([&] { bare.draw(true); }), c = ms([&] { bare.draw(false); });
    if (frame < 0) continue;
    ours.push_back(a);
    culled.push_back(b);
    plain.push_back(c);
  }
  std::printf(", \"triangles\": %zu, ", viewed.updater->surface().triangles());
  print("ours_ms", ours);
  std::printf(", ");
  print("vtk_ms", culled);
  std::printf(", ");
  print("vtk_with_backs_ms", plain);
}

int measure(int frames) {
  // Room for both windows side by side, so that none hides the other.
  const auto screen = Xvfb::start("2560x720");
  if (!screen) {
    std::fprintf(stderr, "osteon-scene-bench: Xvfb, of Debian's package xvfb, did not start\n");
    return 1;
  }
  ::setenv("DISPLAY", screen->display().c_str(), 1);
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  Viewed viewed;
  std::printf("{");
  changed_blocks(viewed, frames);
  million_triangles(viewed, frames);
  std::printf("}\n");
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const int frames = argc > 1 ? std::atoi(argv[1]) : 0;
  if (frames < 1) {
    std::fprintf(stderr, "osteon-scene-bench: needs the number of frames\n");
    return 1;
  }
  return osteon::test::measure(frames);
}
