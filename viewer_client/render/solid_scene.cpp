#include "viewer_client/render/solid_scene.hpp"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkLineSource.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "viewer_client/render/layer_above.hpp"
#include "viewer_client/render/lighting.hpp"
#include "viewer_client/render/orientation_marker.hpp"
#include "viewer_client/render/soft_tissue.hpp"
#include "viewer_client/render/status_text.hpp"
#include "viewer_client/render/view_of_camera.hpp"

namespace osteon {

namespace {

constexpr std::array<double, 3> kCrossColour{0.35, 0.90, 0.55};  // as on the planes
constexpr double kBehind = 0.3;                                  // opacity of lines that the surface hides
constexpr float kCrossWidth_px = 1.5f;
constexpr float kBoxWidth_px = 1.5f, kWideBox_px = 4.0f;
constexpr int kMostDashes = 12, kLeastDashes = 2;  // along an edge; not more than it has voxels

// Lines with a colour each.
struct Lines {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkUnsignedCharArray> colours;

  Lines() { colours->SetNumberOfComponents(3); }
  void add(const Vec3& from, const Vec3& to, const std::array<std::uint8_t, 3>& colour) {
    cells->InsertNextCell(2);
    for (const Vec3& end : {from, to}) cells->InsertCellPoint(points->InsertNextPoint(end.x(), end.y(), end.z()));
    colours->InsertNextTypedTuple(colour.data());
  }
  // The twelve edges, along the outer faces of the voxels.
  void add(const VoxelGrid& grid, const WireBox& box) {
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 4; ++side) {
        Vec3 begin, end;
        for (int of = 0; of < 3; ++of) {
          const auto a = static_cast<std::size_t>(of);
          const bool far = of == (axis + 1) % 3 ? (side & 1) != 0 : (side & 2) != 0;
          const double low = box.first[a] - 0.5, high = box.last[a] + 0.5;
          begin[of] = of == axis ? low : far ? high : low;
          end[of] = of == axis ? high : begin[of];
        }
        const Vec3 from = grid.origin_mm + grid.axes_mm * begin, way = grid.axes_mm * (end - begin);
        const auto along = static_cast<std::size_t>(axis);
        const int voxels = box.last[along] - box.first[along] + 1;
        const int pieces = box.dashed ? 2 * std::clamp(voxels, kLeastDashes, kMostDashes) : 1;
        for (int piece = 0; piece < pieces; piece += 2)
          add(from + way * piece / pieces, from + way * (piece + 1) / pieces, box.colour);
      }
  }
};

}  // namespace

struct SolidScene::Impl {
  explicit Impl(vtkRenderWindow& on) : window(on) {
    window.SetMultiSamples(0);  // several times slower in software
    window.AddRenderer(renderer);
    set_lighting(*renderer);
    layer.emplace(window, BonePictures{renderer, renderer});
    for (CrossLine& line : cross) {
      line.mapper->SetInputConnection(line.ends->GetOutputPort());
      for (vtkActor* actor : {line.before.Get(), line.behind.Get()}) {
        actor->SetMapper(line.mapper);
        actor->GetProperty()->SetColor(kCrossColour[0], kCrossColour[1], kCrossColour[2]);
        actor->GetProperty()->LightingOff();
        actor->GetProperty()->SetLineWidth(kCrossWidth_px);
      }
      line.behind->GetProperty()->SetOpacity(kBehind);
      renderer->AddActor(line.before);
      layer->add(line.behind, 0);
    }
    marks.emplace(*layer);
    for (BoxLines* of : {&boxes, &wide_boxes}) {
      of->mapper->SetInputData(of->lines);
      for (vtkActor* actor : {of->before.Get(), of->behind.Get()}) {
        actor->SetMapper(of->mapper);
        actor->GetProperty()->LightingOff();
        actor->GetProperty()->SetLineWidth(of == &boxes ? kBoxWidth_px : kWideBox_px);
        actor->PickableOff();
      }
      of->behind->GetProperty()->SetOpacity(kBehind);
      renderer->AddActor(of->before);
      layer->add(of->behind, 0);
    }
    marker.show(true);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    marks.reset();
    layer.reset();
    window.RemoveRenderer(renderer);
  }

  struct CrossLine {
    vtkNew<vtkLineSource> ends;
    vtkNew<vtkPolyDataMapper> mapper;
    vtkNew<vtkActor> before, behind;  // hidden by the surface, and drawn over it
  };

  struct BoxLines {
    vtkNew<vtkPolyData> lines;
    vtkNew<vtkPolyDataMapper> mapper;
    vtkNew<vtkActor> before, behind;
    VoxelGrid grid;
    std::vector<WireBox> shown;
  };

  vtkRenderWindow& window;
  vtkNew<vtkRenderer> renderer;
  SolidBones bones{*renderer};
  SoftTissue soft{*renderer};
  StatusText status{*renderer};
  OrientationMarker marker{window};
  std::optional<LayerAbove> layer;
  std::optional<SolidMarks> marks;
  std::array<CrossLine, 3> cross;
  BoxLines boxes, wide_boxes;
};

SolidScene::SolidScene(vtkRenderWindow& window) : impl_(std::make_unique<Impl>(window)) {}

SolidScene::~SolidScene() = default;

SolidBones& SolidScene::bones() { return impl_->bones; }

SolidMarks& SolidScene::marks() { return *impl_->marks; }

void SolidScene::show_soft_tissue(const VoxelGrid& grid, std::span<const std::int16_t> hu) {
  hu.empty() ? impl_->soft.hide() : impl_->soft.show(grid, hu);
}

bool SolidScene::has_soft_tissue() const { return impl_->soft.shown(); }

void SolidScene::show_cross(const VoxelGrid& grid, const std::array<int, 3>& voxel) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Vec3 first(voxel[0], voxel[1], voxel[2]), last = first;
    first[static_cast<int>(axis)] = -0.5;
    last[static_cast<int>(axis)] = grid.dims[axis] - 0.5;
    const Vec3 from = grid.origin_mm + grid.axes_mm * first, to = grid.origin_mm + grid.axes_mm * last;
    impl_->cross[axis].ends->SetPoint1(from.x(), from.y(), from.z());
    impl_->cross[axis].ends->SetPoint2(to.x(), to.y(), to.z());
  }
}

void SolidScene::show_boxes(const VoxelGrid& grid, std::span<const WireBox> boxes) {
  for (Impl::BoxLines* to : {&impl_->boxes, &impl_->wide_boxes}) {
    std::vector<WireBox> now;
    std::ranges::copy_if(boxes, std::back_inserter(now),
                         [&](const WireBox& box) { return box.wide == (to == &impl_->wide_boxes); });
    const bool same_grid = to->grid.origin_mm == grid.origin_mm && to->grid.axes_mm == grid.axes_mm;
    if (same_grid && to->shown == now) continue;  // another section is chosen, and the thin lines stay
    Lines lines;
    for (const WireBox& box : now) lines.add(grid, box);
    to->grid = grid;
    to->shown = std::move(now);
    to->lines->SetPoints(lines.points);
    to->lines->SetLines(lines.cells);
    to->lines->GetCellData()->SetScalars(lines.colours);
    to->lines->Modified();
  }
}

void SolidScene::show_notice(const std::string& notice) { impl_->status.show({}, notice); }

std::optional<SolidHit> SolidScene::bone_at(int x_px, int y_px) const {
  return impl_->bones.at(x_px, impl_->window.GetActualSize()[1] - 1 - y_px);
}

void SolidScene::look(const CameraView& view) {
  set_view(*impl_->renderer->GetActiveCamera(), view);
  impl_->renderer->ResetCameraClippingRange();  // a point may be picked before the next picture
}

CameraView SolidScene::camera() const { return view_of(*impl_->renderer->GetActiveCamera()); }

void SolidScene::draw(bool coarse) {
  impl_->soft.set_coarse(coarse);
  impl_->marker.follow(camera());
  impl_->layer->place(true, false);
  impl_->renderer->ResetCameraClippingRange();
  impl_->window.Render();
  impl_->window.WaitForCompletion();
}

Image SolidScene::image() const { return image_of(impl_->window); }

}  // namespace osteon
