#include "viewer_client/render/plan_actors.hpp"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkCubeSource.h>
#include <vtkLineSource.h>
#include <vtkNew.h>
#include <vtkPlaneSource.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTubeFilter.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "viewer_client/render/actors.hpp"

namespace osteon {

namespace {

constexpr double kBeforeBone = 0.55, kBehindBone = 0.16;  // opacities of structures
constexpr double kPlannedArea = 0.22;                     // of planes and regions
constexpr double kBeyond_mm = 15.0;                       // of an axis, beyond what is planned and at risk
constexpr double kLeastHalf_mm = 30.0;                    // of a plane and of an axis
constexpr double kAxisWidth_px = 1.6;                     // half of it
constexpr std::uint32_t kPlanned = 0x56b4e9;              // sky blue
constexpr int kNameSize = 13;

struct PlanRgb {
  explicit PlanRgb(std::uint32_t colour)
      : r((colour >> 16 & 255) / 255.0), g((colour >> 8 & 255) / 255.0), b((colour & 255) / 255.0) {}
  double r, g, b;
};

vtkSmartPointer<vtkActor> painted(vtkSmartPointer<vtkPolyDataMapper> mapper, std::uint32_t colour, double opacity,
                                  double ambient) {
  mapper->ScalarVisibilityOff();
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  const PlanRgb c(colour);
  vtkProperty* paint = actor->GetProperty();
  paint->SetColor(c.r, c.g, c.b);
  paint->SetAmbient(ambient);
  paint->SetDiffuse(0.95 - ambient);
  paint->SetOpacity(opacity);
  return actor;
}

vtkSmartPointer<vtkPolyDataMapper> mapper_of(vtkAlgorithmOutput* shape) {
  auto mapper = vtkSmartPointer<vtkPolyDataMapper>::New();
  mapper->SetInputConnection(shape);
  return mapper;
}

}  // namespace

std::uint32_t colour_of(StructureKind kind) {
  switch (kind) {
    case StructureKind::nerve:
      return 0xf0e442;  // yellow
    case StructureKind::vessel:
      return 0xd55e00;  // vermilion
    case StructureKind::dura:
      return 0xcc79a7;  // purple
    case StructureKind::cartilage:
      return 0x0072b2;  // blue
    case StructureKind::soft_tissue:
      return 0x009e73;  // green
    case StructureKind::region:
      break;
  }
  return kPlanned;
}

struct PlanActors::Impl {
  vtkRenderer& bone;  // the left picture
  vtkRenderWindow& window;
  LayerAbove layer;
  struct Drawn {
    vtkSmartPointer<vtkActor> in_bone, through;  // hidden by the bone, and drawn over it
  };
  struct Axis {
    Vec3 from_mm, to_mm;
    vtkSmartPointer<vtkTubeFilter> tube;
    vtkSmartPointer<vtkTextActor> name;
  };
  std::vector<Drawn> planned, risks;
  std::vector<Axis> axes;
  bool planned_on = false, risks_on = false;
  std::function<std::string(const std::string&)> written;

  Impl(const BonePictures& pictures, vtkRenderWindow& in) : bone(*pictures.left), window(in), layer(in, pictures) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { clear(); }

  void add_surface(const SurgicalPlan::Structure& structure);
  void add_axis(const SurgicalPlan::Axis& axis, const Box& around);
  void add_planned(vtkAlgorithmOutput* shape, double opacity);
  void clear();
  void apply() const;
  [[nodiscard]] double mm_per_px(const Vec3& point_mm) const;
};

void PlanActors::Impl::add_surface(const SurgicalPlan::Structure& structure) {
  const std::vector<std::array<float, 3>> none(structure.surface.positions_mm.size());
  const std::vector<std::uint8_t> marks(none.size());
  const auto data = poly_data(structure.surface.positions_mm, none, marks, structure.surface.triangles,
                              std::array<Colour, 1>{{{255, 255, 255}}});
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(data);
  normals->SplittingOff();
  normals->ConsistencyOff();
  normals->Update();
  const auto mapper = vtkSmartPointer<vtkPolyDataMapper>::New();
  mapper->SetInputData(normals->GetOutput());
  const std::uint32_t colour = colour_of(structure.kind);
  Drawn drawn{painted(mapper, colour, kBeforeBone, 0.3), painted(mapper, colour, kBehindBone, 0.6)};
  // Only its front, so that its colour does not depend on the order of triangles.
  for (vtkActor* actor : {drawn.in_bone.Get(), drawn.through.Get()}) actor->GetProperty()->SetBackfaceCulling(1);
  (structure.at_risk() ? risks : planned).push_back(drawn);
}

void PlanActors::Impl::add_planned(vtkAlgorithmOutput* shape, double opacity) {
  const auto mapper = mapper_of(shape);
  planned.push_back({painted(mapper, kPlanned, opacity, 0.5), painted(mapper, kPlanned, 0.6 * opacity, 0.7)});
}

void PlanActors::Impl::add_axis(const SurgicalPlan::Axis& axis, const Box& around) {
  // As long as the box around everything is along it.
  const double half = std::max(
      kLeastHalf_mm, around.empty() ? 0.0 : 0.5 * around.size_mm().dot(axis.direction.cwiseAbs()) + kBeyond_mm);
  const double middle = around.empty() ? 0.0 : (around.centre_mm() - axis.point_mm).dot(axis.direction);
  Axis made;
  made.from_mm = axis.point_mm + (middle - half) * axis.direction;
  made.to_mm = axis.point_mm + (middle + half) * axis.direction;
  vtkNew<vtkLineSource> line;
  line->SetPoint1(made.from_mm.x(), made.from_mm.y(), made.from_mm.z());
  line->SetPoint2(made.to_mm.x(), made.to_mm.y(), made.to_mm.z());
  made.tube = vtkSmartPointer<vtkTubeFilter>::New();
  made.tube->SetInputConnection(line->GetOutputPort());
  made.tube->SetNumberOfSides(8);
  made.tube->CappingOn();
  add_planned(made.tube->GetOutputPort(), 1.0);
  made.name = vtkSmartPointer<vtkTextActor>::New();
  made.name->SetInput((written ? written(axis.name) : axis.name).c_str());
  made.name->GetPositionCoordinate()->SetCoordinateSystemToWorld();
  made.name->GetPositionCoordinate()->SetValue(made.to_mm.x(), made.to_mm.y(), made.to_mm.z());
  vtkTextProperty* text = made.name->GetTextProperty();
  const PlanRgb c(kPlanned);
  text->SetFontFamilyToArial();
  text->SetFontSize(kNameSize);
  text->SetColor(c.r, c.g, c.b);
  text->SetBackgroundColor(0.06, 0.08, 0.10);
  text->SetBackgroundOpacity(0.6);
  axes.push_back(made);
}

void PlanActors::Impl::clear() {
  for (const auto* group : {&planned, &risks})
    for (const Drawn& drawn : *group) {
      bone.RemoveActor(drawn.in_bone);
      layer.remove(drawn.through);
    }
  for (const Axis& axis : axes) layer.remove(axis.name);
  planned.clear();
  risks.clear();
  axes.clear();
}

void PlanActors::Impl::apply() const {
  const auto set = [](const std::vector<Drawn>& group, bool on) {
    for (const Drawn& drawn : group)
      for (vtkActor* actor : {drawn.in_bone.Get(), drawn.through.Get()}) actor->SetVisibility(on ? 1 : 0);
  };
  set(planned, planned_on);
  set(risks, risks_on);
  for (const Axis& axis : axes) axis.name->SetVisibility(planned_on ? 1 : 0);
}

PlanActors::PlanActors(const BonePictures& bone, vtkRenderWindow& window) : impl_(new Impl(bone, window)) {}

PlanActors::~PlanActors() = default;

void PlanActors::show(const SurgicalPlan& plan) {
  impl_->clear();
  Box around = plan.bone_mm;
  for (const SurgicalPlan::Structure& structure : plan.structures) {
    const Box box = bounds(structure.surface);
    if (!box.empty()) around.include(box.min_mm);
    if (!box.empty()) around.include(box.max_mm);
    impl_->add_surface(structure);
  }
  for (const SurgicalPlan::Axis& axis : plan.axes) around.include(axis.point_mm);
  for (const SurgicalPlan::Axis& axis : plan.axes) impl_->add_axis(axis, around);
  for (const SurgicalPlan::Plane& plane : plan.planes) {
    // A square about its point.
    const Vec3 across = plane.normal.unitOrthogonal(), other = plane.normal.cross(across);
    const Vec3 corner = plane.point_mm - kLeastHalf_mm * (across + other);
    const Vec3 first = corner + 2.0 * kLeastHalf_mm * across, second = corner + 2.0 * kLeastHalf_mm * other;
    vtkNew<vtkPlaneSource> square;
    square->SetOrigin(corner.x(), corner.y(), corner.z());
    square->SetPoint1(first.x(), first.y(), first.z());
    square->SetPoint2(second.x(), second.y(), second.z());
    impl_->add_planned(square->GetOutputPort(), kPlannedArea);
  }
  for (const SurgicalPlan::Region& box : plan.boxes) {
    vtkNew<vtkCubeSource> cube;
    cube->SetBounds(box.min_mm.x(), box.max_mm.x(), box.min_mm.y(), box.max_mm.y(), box.min_mm.z(), box.max_mm.z());
    impl_->add_planned(cube->GetOutputPort(), kPlannedArea);
  }
  for (const auto* group : {&impl_->planned, &impl_->risks})
    for (const Impl::Drawn& drawn : *group) {
      impl_->bone.AddActor(drawn.in_bone);
      impl_->layer.add(drawn.through);
    }
  for (const Impl::Axis& axis : impl_->axes) impl_->layer.add(axis.name);
  impl_->apply();
}

void PlanActors::name_axes(std::function<std::string(const std::string&)> written) {
  impl_->written = std::move(written);
}

void PlanActors::set_planned(bool on) {
  impl_->planned_on = on;
  impl_->apply();
}

void PlanActors::set_risks(bool on) {
  impl_->risks_on = on;
  impl_->apply();
}

double PlanActors::Impl::mm_per_px(const Vec3& point_mm) const {
  vtkCamera* camera = bone.GetActiveCamera();
  const Vec3 eye(camera->GetPosition()), sight(camera->GetDirectionOfProjection());
  const double half = std::tan(0.5 * camera->GetViewAngle() * std::numbers::pi / 180.0);
  return 2.0 * half * (point_mm - eye).dot(sight) / std::max(1, window.GetSize()[1]);
}

void PlanActors::place(bool two_pictures) {
  const bool any = (impl_->planned_on && !impl_->planned.empty()) || (impl_->risks_on && !impl_->risks.empty());
  impl_->layer.place(any, two_pictures);
  if (!impl_->planned_on) return;
  for (const Impl::Axis& axis : impl_->axes) {
    const double radius_mm = kAxisWidth_px * std::max(1e-3, impl_->mm_per_px(0.5 * (axis.from_mm + axis.to_mm)));
    // Rebuilt only if the difference is visible.
    if (std::abs(axis.tube->GetRadius() / radius_mm - 1.0) > 0.1) axis.tube->SetRadius(radius_mm);
  }
}

}  // namespace osteon
