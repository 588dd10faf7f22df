#include "viewer_client/render/people_overlay.hpp"

#include <vtkActor.h>
#include <vtkAppendPolyData.h>
#include <vtkArrowSource.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkMatrix4x4.h>
#include <vtkNew.h>
#include <vtkPlaneSource.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkSphereSource.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTubeFilter.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "viewer_client/scene/people_view.hpp"
#include "viewer_client/scene/stroke.hpp"

namespace osteon {

namespace {

// Screen sizes, pixels.
constexpr double kArrow = 92.0, kTube = 2.8, kDot = 5.5, kBeside = 14.0, kAlongTool = 110.0;
constexpr int kLabelText = 16, kNameText = 15, kSaidText = 19, kHoldingText = 22, kHintText = 16;
// Characters of the font are about half as wide as high.
constexpr double kCharacter = 0.52;
// Opacities of what lies behind the bone, and of planes.
constexpr double kThrough = 0.22, kThroughPlane = 0.12, kPlane = 0.3;
constexpr double kLeastPlane_mm = 30.0;  // a side of its square
constexpr std::uint32_t kStroke = 0xffd040;

using Rgb = std::array<double, 3>;
constexpr Rgb kLight{0.96, 0.96, 0.97}, kDark{0.06, 0.08, 0.10}, kWarning{1.0, 0.72, 0.25}, kName{0.60, 0.80, 0.95};

Rgb rgb(std::uint32_t colour) {
  return {(colour >> 16 & 255) / 255.0, (colour >> 8 & 255) / 255.0, (colour & 255) / 255.0};
}

vtkSmartPointer<vtkTextActor> text_actor(int size, const Rgb& colour) {
  auto actor = vtkSmartPointer<vtkTextActor>::New();
  vtkTextProperty* text = actor->GetTextProperty();
  text->SetFontFamilyToArial();
  text->SetFontSize(size);
  text->SetColor(colour[0], colour[1], colour[2]);
  text->SetBackgroundColor(kDark[0], kDark[1], kDark[2]);
  text->SetBackgroundOpacity(0.74);
  text->SetLineSpacing(1.2);
  return actor;
}

vtkSmartPointer<vtkActor> shape_actor(vtkAlgorithmOutput* shape, std::uint32_t colour, double opacity) {
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(shape);
  mapper->ScalarVisibilityOff();
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  const Rgb c = rgb(colour);
  vtkProperty* paint = actor->GetProperty();
  paint->SetColor(c[0], c[1], c[2]);
  // Mostly ambient light, because the colour shows who drew it.
  paint->SetAmbient(0.55);
  paint->SetDiffuse(0.5);
  paint->SetOpacity(opacity);
  paint->SetBackfaceCulling(1);
  return actor;
}

// A square about the line of its first two points.
vtkSmartPointer<vtkPlaneSource> square_about(const std::vector<Vec3>& points_mm) {
  const Vec3 line = points_mm[1] - points_mm[0], along = line.normalized();
  const Vec3 across = (points_mm[2] - points_mm[0] - along.dot(points_mm[2] - points_mm[0]) * along).normalized();
  const double half_mm = 0.5 * std::max(kLeastPlane_mm, line.norm());
  const Vec3 corner = 0.5 * (points_mm[0] + points_mm[1]) - half_mm * (along + across);
  const Vec3 first = corner + 2.0 * half_mm * along, second = corner + 2.0 * half_mm * across;
  auto square = vtkSmartPointer<vtkPlaneSource>::New();
  square->SetOrigin(corner.x(), corner.y(), corner.z());
  square->SetPoint1(first.x(), first.y(), first.z());
  square->SetPoint2(second.x(), second.y(), second.z());
  return square;
}

}  // namespace

struct PeopleOverlay::Impl {
  vtkRenderer& bone;  // the left picture
  vtkRenderWindow& window;
  NormalAt normal_at;
  LayerAbove layer;
  vtkNew<vtkArrowSource> arrow;
  vtkNew<vtkSphereSource> ball;

  // A text beside a point, at its place in each picture.
  using Words = std::array<vtkSmartPointer<vtkTextActor>, LayerAbove::kPictures>;
  struct Drawn {
    Annotation annotation;
    std::vector<Vec3> points_mm;
    vtkSmartPointer<vtkTubeFilter> tube;      // of a line and of an axis
    vtkSmartPointer<vtkSphereSource> target;  // of an axis
    vtkSmartPointer<vtkAppendPolyData> with_target;
    vtkSmartPointer<vtkPlaneSource> plane;
    vtkSmartPointer<vtkActor> solid, through;  // the same shape: hidden by the bone, and drawn over it
    Words words;
    std::optional<Vec3> normal;  // at a pointer's point
  };
  std::map<std::uint32_t, Drawn> drawn;
  std::optional<Drawn> stroke;
  std::map<AuthorId, std::string> names;
  struct Tool {
    Pose pose;
    Words name;
  };
  std::map<AuthorId, Tool> tools;
  vtkSmartPointer<vtkTextActor> said = text_actor(kSaidText, kLight), holding = text_actor(kHoldingText, kWarning),
                                hint = text_actor(kHintText, kLight);
  // Rectangles of each picture's texts: left, right, bottom, top.
  std::array<std::vector<std::array<int, 4>>, LayerAbove::kPictures> taken;
  int pictures = 1;

  Impl(const BonePictures& b, vtkRenderWindow& w, NormalAt n)
      : bone(*b.left), window(w), normal_at(std::move(n)), layer(w, b) {}

  Drawn make(const Annotation& annotation);
  vtkAlgorithmOutput* shape_of(Drawn& one);
  void add(const Drawn& one);
  void remove(const Drawn& one);
  void place(Drawn& one);
  [[nodiscard]] std::string words_of(const Annotation& annotation) const;

  // Millimetres per pixel at a point's distance from the eye. Not positive: the point is behind the eye.
  [[nodiscard]] double mm_per_px(const Vec3& point_mm) const;
  [[nodiscard]] Words words_in(int size, const Rgb& colour);
  void add(const Words& words);
  void remove(const Words& words);
  static void show(const Words& words, const std::string& text);  // empty: hides it
  // `from_mm`: where the line begins that ends at the point. The text does not cover it.
  void put_beside(const Words& words, const Vec3& point_mm, const std::optional<Vec3>& from_mm = {});
  void put_beside(vtkTextActor* text, int picture, const Vec3& point_mm, const std::optional<Vec3>& from_mm);
};

PeopleOverlay::PeopleOverlay(const BonePictures& bone, vtkRenderWindow& window, NormalAt normal_at)
    : impl_(std::make_unique<Impl>(bone, window, std::move(normal_at))) {
  impl_->arrow->InvertOn();  // its tip at the origin
  impl_->arrow->SetTipLength(0.32);
  impl_->arrow->SetTipRadius(0.105);
  impl_->arrow->SetShaftRadius(0.038);
  impl_->arrow->SetTipResolution(24);
  impl_->arrow->SetShaftResolution(24);
  impl_->ball->SetRadius(1.0);
  impl_->ball->SetThetaResolution(20);
  impl_->ball->SetPhiResolution(20);

  const auto fix = [&](vtkTextActor* text, double x, double y) {
    text->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
    text->SetPosition(x, y);
    text->SetVisibility(0);
    impl_->layer.add(text);
  };
  fix(impl_->said, 0.5, 0.075);
  impl_->said->GetTextProperty()->SetJustificationToCentered();
  fix(impl_->holding, 0.5, 0.965);
  impl_->holding->GetTextProperty()->SetJustificationToCentered();
  impl_->holding->GetTextProperty()->SetVerticalJustificationToTop();
  fix(impl_->hint, 0.984, 0.024);
  impl_->hint->GetTextProperty()->SetJustificationToRight();
}

PeopleOverlay::~PeopleOverlay() = default;

PeopleOverlay::Impl::Words PeopleOverlay::Impl::words_in(int size, const Rgb& colour) {
  return {text_actor(size, colour), text_actor(size, colour)};
}

void PeopleOverlay::Impl::add(const Words& words) {
  for (int picture = 0; picture < LayerAbove::kPictures; ++picture)
    layer.add(words[static_cast<std::size_t>(picture)], picture);
}

void PeopleOverlay::Impl::remove(const Words& words) {
  for (vtkTextActor* text : words) layer.remove(text);
}

void PeopleOverlay::Impl::show(const Words& words, const std::string& text) {
  for (vtkTextActor* one : words) {
    one->SetVisibility(0);
    if (!text.empty()) one->SetInput(text.c_str());
  }
}

std::string PeopleOverlay::Impl::words_of(const Annotation& annotation) const {
  // Each author has one arrow, so its text names the author.
  const auto name = names.find(annotation.author);
  if (annotation.kind != AnnotationKind::pointer || name == names.end()) return annotation.words;
  return annotation.words.empty() ? name->second : name->second + ": " + annotation.words;
}

// The shape before it is placed.
vtkAlgorithmOutput* PeopleOverlay::Impl::shape_of(Drawn& one) {
  switch (one.annotation.kind) {
    case AnnotationKind::pointer:
      return arrow->GetOutputPort();
    case AnnotationKind::label:
      return ball->GetOutputPort();
    case AnnotationKind::plane:
      one.plane = square_about(one.points_mm);
      return one.plane->GetOutputPort();
    case AnnotationKind::line:
    case AnnotationKind::axis:
      break;
  }
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  cells->InsertNextCell(static_cast<int>(one.points_mm.size()));
  for (const Vec3& point : one.points_mm) cells->InsertCellPoint(points->InsertNextPoint(point.data()));
  vtkNew<vtkPolyData> line;
  line->SetPoints(points);
  line->SetLines(cells);
  one.tube = vtkSmartPointer<vtkTubeFilter>::New();
  one.tube->SetInputData(line);
  one.tube->SetNumberOfSides(10);
  one.tube->CappingOn();
  if (one.annotation.kind == AnnotationKind::line) return one.tube->GetOutputPort();
  // A ball marks the depth.
  one.target = vtkSmartPointer<vtkSphereSource>::New();
  one.target->SetCenter(one.points_mm.back().data());
  one.target->SetRadius(kDot / kTube * one.tube->GetRadius());
  one.target->SetThetaResolution(20);
  one.target->SetPhiResolution(20);
  one.with_target = vtkSmartPointer<vtkAppendPolyData>::New();
  one.with_target->AddInputConnection(one.tube->GetOutputPort());
  one.with_target->AddInputConnection(one.target->GetOutputPort());
  return one.with_target->GetOutputPort();
}

PeopleOverlay::Impl::Drawn PeopleOverlay::Impl::make(const Annotation& annotation) {
  Drawn one;
  one.annotation = annotation;
  one.points_mm = points_mm(annotation);
  vtkAlgorithmOutput* shape = shape_of(one);
  const bool plane = annotation.kind == AnnotationKind::plane;
  one.solid = shape_actor(shape, annotation.colour, plane ? kPlane : 1.0);
  one.through = shape_actor(shape, annotation.colour, plane ? kThroughPlane : kThrough);
  if (plane)
    for (vtkActor* actor : {one.solid.Get(), one.through.Get()}) actor->GetProperty()->SetBackfaceCulling(0);
  one.words = words_in(kLabelText, kLight);
  const Rgb c = rgb(annotation.colour);
  for (vtkTextActor* text : one.words) {
    text->GetTextProperty()->SetFrame(1);
    text->GetTextProperty()->SetFrameWidth(2);
    text->GetTextProperty()->SetFrameColor(c[0], c[1], c[2]);
  }
  return one;
}

void PeopleOverlay::Impl::add(const Drawn& one) {
  bone.AddActor(one.solid);
  layer.add(one.through);
  add(one.words);
}

void PeopleOverlay::Impl::remove(const Drawn& one) {
  bone.RemoveActor(one.solid);
  layer.remove(one.through);
  remove(one.words);
}

void PeopleOverlay::show_annotations(std::span<const Annotation> drawn) {
  std::map<std::uint32_t, Impl::Drawn> shown;
  for (const Annotation& annotation : drawn) {
    if (!check(annotation)) continue;
    auto held = impl_->drawn.extract(annotation.id);
    if (!held.empty() && held.mapped().annotation == annotation) {
      shown.insert(std::move(held));
      continue;
    }
    if (!held.empty()) impl_->remove(held.mapped());
    const auto place = shown.insert_or_assign(annotation.id, impl_->make(annotation)).first;
    impl_->add(place->second);
  }
  for (const auto& [id, gone] : impl_->drawn) impl_->remove(gone);
  impl_->drawn = std::move(shown);
}

void PeopleOverlay::show_stroke(const std::vector<Vec3>& points_mm) {
  if (impl_->stroke) impl_->remove(*impl_->stroke);
  impl_->stroke.reset();
  if (points_mm.size() < 2) return;
  Annotation line;
  line.kind = AnnotationKind::line;
  line.colour = kStroke;
  for (const Vec3& point : points_mm) line.points.push_back(in_steps(point));
  impl_->stroke = impl_->make(line);
  impl_->add(*impl_->stroke);
}

void PeopleOverlay::show_names(std::map<AuthorId, std::string> names) { impl_->names = std::move(names); }

void PeopleOverlay::show_tools(std::span<const CuttingState> states) {
  std::map<AuthorId, Impl::Tool> shown;
  for (const CuttingState& state : states) {
    if (state.tool_name.empty()) continue;  // an empty hand is not seen
    auto held = impl_->tools.extract(state.author);
    Impl::Tool tool = held.empty() ? Impl::Tool{{}, impl_->words_in(kNameText, kName)} : held.mapped();
    if (held.empty()) impl_->add(tool.name);
    tool.pose = state.pose_bone_tool;
    shown.emplace(state.author, std::move(tool));
  }
  for (const auto& [author, gone] : impl_->tools) impl_->remove(gone.name);
  impl_->tools = std::move(shown);
}

void PeopleOverlay::show_words(const std::vector<std::string>& said, const std::string& holding,
                               const std::string& hint) {
  const auto show = [&](vtkTextActor* actor, const std::string& text) {
    actor->SetInput(text.c_str());
    actor->SetVisibility(text.empty() ? 0 : 1);
  };
  const auto columns = [&](int size) {
    return static_cast<std::size_t>(std::max(20.0, 0.62 * impl_->layer.frame(0).width / (kCharacter * size)));
  };
  std::string lines;
  for (const std::string& one : said) lines += (lines.empty() ? "" : "\n") + wrapped(one, columns(kSaidText), 3);
  show(impl_->said, lines);
  // Keep the text's own line breaks.
  lines.clear();
  for (std::size_t at = 0; at < holding.size();) {
    const std::size_t end = std::min(holding.find('\n', at), holding.size());
    lines +=
        (lines.empty() ? "" : "\n") + wrapped(std::string_view(holding).substr(at, end - at), columns(kHoldingText), 3);
    at = end + 1;
  }
  show(impl_->holding, lines);
  show(impl_->hint, hint);
}

double PeopleOverlay::Impl::mm_per_px(const Vec3& point_mm) const {
  vtkCamera* camera = bone.GetActiveCamera();
  const Vec3 eye(camera->GetPosition()), sight(camera->GetDirectionOfProjection());
  const double half = std::tan(0.5 * camera->GetViewAngle() * std::numbers::pi / 180.0);
  return 2.0 * half * (point_mm - eye).dot(sight) / std::max(1, window.GetSize()[1]);
}

void PeopleOverlay::Impl::put_beside(const Words& words, const Vec3& point_mm, const std::optional<Vec3>& from_mm) {
  for (int picture = 0; picture < pictures; ++picture)
    put_beside(words[static_cast<std::size_t>(picture)], picture, point_mm, from_mm);
}

// To the right of the point, or to the left of one to which a line comes from the right. If another text is there
// already, it moves towards the picture's middle row.
void PeopleOverlay::Impl::put_beside(vtkTextActor* text, int picture, const Vec3& point_mm,
                                     const std::optional<Vec3>& from_mm) {
  const auto [x, y] = layer.on_screen(picture, {point_mm.x(), point_mm.y(), point_mm.z()});
  const LayerAbove::Frame frame = layer.frame(picture);
  const bool seen = mm_per_px(point_mm) > 0.0 && x >= 0 && y >= 0 && x < frame.width && y < frame.height;
  text->SetVisibility(seen ? 1 : 0);
  if (!seen) return;
  double box[4];
  text->SetPosition(0, 0);
  text->GetBoundingBox(layer.above(picture), box);
  const int width = static_cast<int>(box[1] - box[0]) + 1, height = static_cast<int>(box[3] - box[2]) + 1;
  // On the other side where the picture ends.
  const int on_right = static_cast<int>(std::lround(x + kBeside));
  const int on_left = static_cast<int>(std::lround(x - kBeside)) - width;
  const bool leftwards = from_mm && layer.on_screen(picture, {from_mm->x(), from_mm->y(), from_mm->z()})[0] > x;
  int left = leftwards && on_left >= 0 ? on_left : on_right, bottom = static_cast<int>(std::lround(y)) - height / 2;
  if (left + width > frame.width) left = on_left;
  const bool upwards = y < 0.5 * frame.height;
  auto& texts = taken[static_cast<std::size_t>(picture)];
  for (bool free = false; !free;) {
    free = true;
    for (const auto& [l, r, b, t] : texts) {
      if (left > r || left + width < l || bottom > t || bottom + height < b) continue;
      bottom = upwards ? t + 4 : b - height - 4;
      free = false;
      break;
    }
  }
  texts.push_back({left, left + width, bottom, bottom + height});
  text->SetPosition(left - box[0], bottom - box[2]);
}

void PeopleOverlay::Impl::place(Drawn& one) {
  const Vec3& at = one.points_mm.front();
  const double px_mm = std::max(1e-6, mm_per_px(at));
  Vec3 beside = at;
  std::optional<Vec3> from;
  vtkNew<vtkMatrix4x4> matrix;
  if (one.annotation.kind == AnnotationKind::plane) {
    beside = one.points_mm[1];
  } else if (one.tube) {
    beside = one.points_mm.back();
    if (one.annotation.kind == AnnotationKind::axis) from = at;
    const Vec3& middle = one.points_mm[one.points_mm.size() / 2];
    const double radius_mm = kTube * std::max(1e-6, mm_per_px(middle));
    // Rebuilt only if the difference is visible.
    if (std::abs(one.tube->GetRadius() / radius_mm - 1.0) > 0.1) {
      one.tube->SetRadius(radius_mm);
      if (one.target) one.target->SetRadius(kDot / kTube * radius_mm);
    }
  } else if (one.annotation.kind == AnnotationKind::label) {
    for (int i = 0; i < 3; ++i) {
      matrix->SetElement(i, i, kDot * px_mm);
      matrix->SetElement(i, 3, at[i]);
    }
  } else {
    // From outside and from above, so that the arrow is long on the screen even if the view is along the normal.
    if (!one.normal) one.normal = normal_at(at);
    const Vec3 sight(bone.GetActiveCamera()->GetDirectionOfProjection());
    const Vec3 normal = one.normal.value_or(-sight);
    const Vec3 upwards = Vec3::UnitZ() - normal.z() * normal;
    const Vec3 aside = upwards.norm() > 0.1 ? upwards.normalized() : normal.unitOrthogonal();
    const Vec3 outwards = (normal + 1.2 * aside).normalized();
    // VTK's inverted arrow runs from its tip at the origin along +x.
    const Eigen::Matrix3d turn = rotation_between(Vec3::UnitX(), outwards).toRotationMatrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) matrix->SetElement(row, column, kArrow * px_mm * turn(row, column));
      matrix->SetElement(row, 3, at[row]);
    }
    beside = at + kArrow * px_mm * outwards;
  }
  one.solid->SetUserMatrix(matrix);
  one.through->SetUserMatrix(matrix);

  const std::string words = wrapped(words_of(one.annotation), 40, 4);
  show(one.words, words);
  if (words.empty()) return;
  put_beside(one.words, beside, from);
}

void PeopleOverlay::place(bool two_pictures) {
  impl_->pictures = two_pictures ? LayerAbove::kPictures : 1;
  impl_->layer.place(true, two_pictures);  // texts are measured in their pictures
  for (int picture = 0; picture < impl_->pictures; ++picture) {
    auto& texts = impl_->taken[static_cast<std::size_t>(picture)];
    texts.clear();
    for (vtkTextActor* text : {impl_->said.Get(), impl_->holding.Get(), impl_->hint.Get()}) {
      if (text->GetVisibility() == 0) continue;
      double box[4];
      text->GetBoundingBox(impl_->layer.above(picture), box);
      const int* at = text->GetPositionCoordinate()->GetComputedViewportValue(impl_->layer.above(picture));
      const auto edge = [&](int which) { return at[which / 2] + static_cast<int>(box[which]); };
      texts.push_back({edge(0), edge(1), edge(2), edge(3)});
    }
  }
  for (auto& [id, one] : impl_->drawn) impl_->place(one);
  if (impl_->stroke) impl_->place(*impl_->stroke);
  bool named = false;
  for (auto& [author, tool] : impl_->tools) {
    const auto name = impl_->names.find(author);
    Impl::show(tool.name, name == impl_->names.end() ? std::string() : name->second);
    if (name == impl_->names.end() || name->second.empty()) continue;
    named = true;
    const Vec3& tip = tool.pose.position_mm;
    impl_->put_beside(tool.name, tip - kAlongTool * impl_->mm_per_px(tip) * tool.pose.direction(Vec3::UnitZ()));
  }
  bool words = false;
  for (vtkTextActor* text : {impl_->said.Get(), impl_->holding.Get(), impl_->hint.Get()})
    words = words || text->GetVisibility() != 0;
  impl_->layer.place(words || named || impl_->stroke || !impl_->drawn.empty(), two_pictures);
}

}  // namespace osteon
