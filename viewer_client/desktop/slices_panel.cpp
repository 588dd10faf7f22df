#include "viewer_client/desktop/slices_panel.hpp"

#include <QCheckBox>
#include <QComboBox>
#include <QEvent>
#include <QLabel>
#include <QLocale>
#include <QPushButton>
#include <QResizeEvent>
#include <QSettings>
#include <QSlider>
#include <QStringList>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/tools/tool_solid.hpp"
#include "viewer_client/desktop/structure_names.hpp"

namespace osteon {

namespace {

// They differ for colour-blind people too: orange, green and purple.
constexpr std::array<QRgb, kSlices> kPlaneColours{0xffe69f00, 0xff009e73, 0xffcc79a7};
// Of the plane that the horizontal and the vertical line of each image stand for.
constexpr std::array<std::array<std::size_t, 2>, kSlices> kPatientLines{{{1, 2}, {0, 2}, {0, 1}}};
constexpr std::array<std::array<std::size_t, 2>, kSlices> kToolLines{{{2, 1}, {2, 0}, {0, 1}}};
constexpr std::array<const char*, kSlices> kViewNames{"slice_0", "slice_1", "slice_2"};
constexpr std::array<const char*, kSlices> kSliderNames{"slice_slider_0", "slice_slider_1", "slice_slider_2"};

constexpr double kToolField_mm = 60.0;                // the shorter side of an image along the tool
constexpr double kLeastZoom = 0.01, kMostZoom = 5.0;  // mm for each pixel
constexpr double kRoomAroundBone = 1.05;              // of a bone that is seen as a whole
constexpr int kPresets = 3;                           // the entry after them is that of another window

constexpr std::array<HuWindow, kPresets> kWindows{kBoneWindow, kSoftTissueWindow, kWideWindow};

QString rounded_text(double value, int decimals) {
  const double step = std::pow(10.0, -decimals);
  return QLocale().toString(std::round(value / step) * step + 0.0, 'f', decimals);
}

bool equal(const radiology::PixelGrid& a, const radiology::PixelGrid& b) {
  return a.first_mm == b.first_mm && a.column_mm == b.column_mm && a.row_mm == b.row_mm && a.columns == b.columns &&
         a.rows == b.rows;
}

}  // namespace

SlicesPanel::SlicesPanel(InsideLink& inside, Drawing drawing, QWidget* parent)
    : QWidget(parent), inside_(&inside), drawing_(std::move(drawing)) {
  painter_ = std::make_shared<SlicePainter>([this] {
    QMetaObject::invokeMethod(
        this, [this] { show_images(); }, Qt::QueuedConnection);
  });
  auto* all = new QVBoxLayout(this);
  add_choices(*all);
  add_views(*all);
  const QSettings settings;
  axes_->setCurrentIndex(settings.value("slices/axes", 0).toInt() == 1 ? 1 : 0);
  const HuWindow kept{settings.value("slices/level", kBoneWindow.level_hu).toDouble(),
                      settings.value("slices/width", kBoneWindow.width_hu).toDouble()};
  set_axes();
  // Whatever the file says: numbers, within the limits.
  const bool usable = std::isfinite(kept.level_hu) && std::isfinite(kept.width_hu);
  set_window(usable ? dragged(kept, 0.0, 0.0) : kBoneWindow);
}

void SlicesPanel::add_choices(QBoxLayout& all) {
  auto* row = new QHBoxLayout;
  axes_ = new QComboBox;
  axes_->setObjectName("slices_axes");
  axes_->setAccessibleName(tr("Planes of the slices"));
  axes_->addItem(tr("Patient's axes"));
  axes_->addItem(tr("Along the tool"));
  axes_->setToolTip(tr("Axial, coronal and sagittal, or along the tool and across its tip."));
  connect(axes_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, [this] { set_axes(); });
  follows_ = new QCheckBox(tr("Follow the tool"));
  follows_->setObjectName("slices_follow");
  follows_->setChecked(true);
  follows_->setToolTip(tr("While the tool cuts, the slices go through its tip."));
  presets_ = new QComboBox;
  presets_->setObjectName("slices_window");
  presets_->setAccessibleName(tr("Window of the slices"));
  presets_->addItem(tr("Bone"));
  presets_->addItem(tr("Soft tissue"));
  presets_->addItem(tr("Wide"));
  presets_->addItem(tr("By hand"));
  presets_->setToolTip(tr("Which HU are black and white. Drag with the right button to change it."));
  connect(presets_, QOverload<int>::of(&QComboBox::activated), this, [this] { choose_window(); });
  auto* whole = new QPushButton(tr("Whole bone"));
  whole->setObjectName("slices_whole");
  whole->setToolTip(tr("The cross in the middle of the bone, and all of it in the images."));
  connect(whole, &QPushButton::clicked, this, [this] { show_whole(); });
  for (QWidget* part : {static_cast<QWidget*>(axes_), static_cast<QWidget*>(follows_), static_cast<QWidget*>(presets_),
                        static_cast<QWidget*>(whole)})
    row->addWidget(part);
  row->addStretch();
  hu_ = new QLabel;
  hu_->setObjectName("slice_hu");
  row->addWidget(hu_);
  all.addLayout(row);
}

void SlicesPanel::add_views(QBoxLayout& all) {
  images_ = new QBoxLayout(QBoxLayout::LeftToRight);
  for (std::size_t i = 0; i < kSlices; ++i) {
    SliceView::Events events;
    events.point = [this](const Vec3& point_mm) { set_point(point_mm); };
    events.drawn = [this, i](const Vec3& point_mm) {
      set_point(point_mm);
      drawing_.drawn(point_mm, normal_of(planes_of(view())[i]));
    };
    events.dragged = drawing_.dragged;
    events.dropped = drawing_.dropped;
    events.move = [this, i](double steps) { move_slice(i, steps * pitch_mm_); };
    events.shift = [this](const Vec3& by_mm) {
      centre_mm_ += by_mm;
      ask();
    };
    events.zoom = [this](double factor) { zoom(factor); };
    events.window = [this](double right, double down) { set_window(dragged(window_, right, down)); };
    events.hovered = [this, i](const std::optional<Vec3>& point_mm) { show_hu(i, point_mm); };
    events.resized = [this] { ask(); };
    views_[i] = new SliceView(std::move(events));
    views_[i]->setObjectName(kViewNames[i]);
    views_[i]->setToolTip(QStringList{tr("Left button or arrows: the cross. Middle button: the image moves."),
                                      tr("Right button: to the right a wider window of HU, down a darker image."),
                                      tr("Wheel, or Page Up and Page Down: the next slice."),
                                      tr("Ctrl and wheel, or + and -: nearer or farther.")}
                              .join('\n'));
    sliders_[i] = new QSlider(Qt::Vertical);
    sliders_[i]->setObjectName(kSliderNames[i]);
    connect(sliders_[i], &QSlider::valueChanged, this, [this, i](int value) {
      if (sets_sliders_) return;
      const Vec3 normal = normal_of(planes_of(view())[i]);
      const double now_mm = normal.dot(point_.point_mm() - bone_.centre_mm());
      move_slice(i, value * pitch_mm_ - now_mm);
    });
    auto* with_slider = new QHBoxLayout;
    with_slider->setSpacing(2);
    with_slider->addWidget(views_[i]);
    with_slider->addWidget(sliders_[i]);
    images_->addLayout(with_slider, 1);
  }
  all.addLayout(images_, 1);
  status_ = new QLabel;
  status_->setObjectName("slices_status");
  status_->setWordWrap(true);
  status_->hide();
  all.addWidget(status_);
}

SliceAxes SlicesPanel::axes() const { return axes_->currentIndex() == 1 ? SliceAxes::tool : SliceAxes::patient; }

void SlicesPanel::set_axes() {
  QSettings().setValue("slices/axes", axes_->currentIndex());
  const bool patient = axes() == SliceAxes::patient;
  const std::array<QString, kSlices> titles =
      patient ? std::array<QString, kSlices>{tr("Axial"), tr("Coronal"), tr("Sagittal")}
              : std::array<QString, kSlices>{tr("Along the tool"), tr("Along, turned by 90°"), tr("Across the tip")};
  for (std::size_t i = 0; i < kSlices; ++i) {
    const auto& lines = patient ? kPatientLines[i] : kToolLines[i];
    views_[i]->set_title(titles[i], QColor(kPlaneColours[i]),
                         {QColor(kPlaneColours[lines[0]]), QColor(kPlaneColours[lines[1]])});
    sliders_[i]->setAccessibleName(tr("Slice: %1").arg(titles[i]));
  }
  if (tool_pose_) point_.follow(*tool_pose_, false, axes());
  ask();
}

void SlicesPanel::reset(const Box& bone, double pitch_mm) {
  bone_ = bone;
  pitch_mm_ = pitch_mm;
  painter_->clear();
  asked_ = {};
  zoom_ = {};
  overlay_ = {};
  tool_pose_.reset();
  planned_ = 0;
  hovered_.reset();
  hu_->clear();
  point_.reset(bone.empty() ? Vec3(Vec3::Zero()) : bone.centre_mm());
  overlay_.point_mm = centre_mm_ = point_.point_mm();
  for (SliceView* view : views_) view->show_overlay(overlay_);
  show_images();
  ask();
}

void SlicesPanel::show_whole() {
  if (bone_.empty()) return;
  centre_mm_ = bone_.centre_mm();
  zoom_[static_cast<std::size_t>(axes())].reset();
  set_point(bone_.centre_mm());
}

LinkedSlices SlicesPanel::view() const {
  LinkedSlices now;
  now.axes = axes();
  now.point_mm = point_.point_mm();
  now.rotation = point_.rotation();
  now.centre_mm = now.axes == SliceAxes::patient ? centre_mm_ : point_.point_mm();
  for (std::size_t i = 0; i < kSlices; ++i) now.images[i] = views_[i]->size_px();
  double fit = kLeastZoom;
  if (now.axes == SliceAxes::tool) {
    fit = kToolField_mm / std::max(1, std::min(views_[0]->width(), views_[0]->height()));
  } else if (!bone_.empty()) {
    const Vec3 size = kRoomAroundBone * bone_.size_mm();
    const std::array<std::pair<int, int>, kSlices> sides{{{0, 1}, {0, 2}, {1, 2}}};  // of the image: right, down
    for (std::size_t i = 0; i < kSlices; ++i)
      fit = std::max({fit, size[sides[i].first] / std::max(1, views_[i]->width()),
                      size[sides[i].second] / std::max(1, views_[i]->height())});
  }
  const double mm_per_px = zoom_[static_cast<std::size_t>(now.axes)].value_or(fit);
  now.pixel_mm = std::clamp(mm_per_px, kLeastZoom, kMostZoom) / devicePixelRatioF();
  return now;
}

void SlicesPanel::ask() {
  if (bone_.empty() || views_.back() == nullptr) return;
  const auto planes = planes_of(view());
  bool same = true;
  for (std::size_t i = 0; i < kSlices; ++i) same &= equal(planes[i], asked_[i]);
  set_sliders();
  if (overlay_.point_mm != point_.point_mm()) {
    overlay_.point_mm = point_.point_mm();
    for (SliceView* view : views_) view->show_overlay(overlay_);
  }
  if (same) return;
  asked_ = planes;
  painter_->ask(planes);
  if (inside_) inside_->wake();
}

void SlicesPanel::set_point(const Vec3& point_mm) {
  if (bone_.empty()) return;
  // Nobody loses it: it stays in the box of the bone, or near it.
  const Vec3 beyond = Vec3::Constant(20.0);
  point_.set(point_mm.cwiseMax(bone_.min_mm - beyond).cwiseMin(bone_.max_mm + beyond));
  ask();
}

void SlicesPanel::move_slice(std::size_t slice, double by_mm) {
  set_point(point_.point_mm() + by_mm * normal_of(planes_of(view())[slice]));
}

void SlicesPanel::zoom(double factor) {
  const double now = view().pixel_mm * devicePixelRatioF();
  zoom_[static_cast<std::size_t>(axes())] = std::clamp(now * factor, kLeastZoom, kMostZoom);
  // What the user looks at stays in the image.
  if (factor < 1.0) centre_mm_ += (1.0 - factor) * (point_.point_mm() - centre_mm_);
  ask();
}

void SlicesPanel::set_window(const HuWindow& window) {
  window_ = window;
  QSettings settings;
  settings.setValue("slices/level", window.level_hu);
  settings.setValue("slices/width", window.width_hu);
  const auto preset = std::ranges::find(kWindows, window);
  presets_->setCurrentIndex(static_cast<int>(preset - kWindows.begin()));
  show_images();
}

void SlicesPanel::choose_window() {
  const int chosen = presets_->currentIndex();
  if (chosen < kPresets) set_window(kWindows[static_cast<std::size_t>(chosen)]);
}

void SlicesPanel::show_hu(std::size_t slice, const std::optional<Vec3>& point_mm) {
  hovered_ = point_mm ? std::optional(std::pair(slice, *point_mm)) : std::nullopt;
  const auto hu = hovered_ ? views_[slice]->hu_at(*point_mm) : std::nullopt;
  hu_->setText(hu ? tr("%1 HU at %2, %3, %4 mm")
                        .arg(rounded_text(*hu, 0), rounded_text(point_mm->x(), 1), rounded_text(point_mm->y(), 1),
                             rounded_text(point_mm->z(), 1))
                  : QString());
}

void SlicesPanel::show_images() {
  const SliceImages images = painter_->newest();
  for (std::size_t i = 0; i < kSlices; ++i) views_[i]->show_image(images[i], window_);
  // The bone under a resting pointer may be cut away.
  if (hovered_) show_hu(hovered_->first, hovered_->second);
}

void SlicesPanel::refresh(const CuttingState* tool, const SurgicalPlan* plan) {
  if (!isVisible()) return;
  show_status();
  follow(tool);
  const std::size_t planned = plan != nullptr ? plan->axes.size() : 0;
  if (planned == planned_) return;
  planned_ = planned;
  overlay_.planned.clear();
  if (plan != nullptr)
    for (const SurgicalPlan::Axis& axis : plan->axes)
      overlay_.planned.push_back({structure_title(axis.name), axis.point_mm, axis.direction});
  for (SliceView* view : views_) view->show_overlay(overlay_);
}

void SlicesPanel::show_drawn(const std::vector<Annotation>& drawn, std::uint32_t selected, bool draws,
                             const std::optional<Vec3>& begun) {
  overlay_.drawn = drawn;
  overlay_.selected = selected;
  overlay_.draws = draws;
  overlay_.begun = begun;
  for (SliceView* view : views_) view->show_overlay(overlay_);
}

void SlicesPanel::add_row(QWidget* row) { static_cast<QBoxLayout*>(layout())->insertWidget(1, row); }

Vec3 SlicesPanel::into_image() const {
  const auto planes = planes_of(view());
  const auto focused = std::ranges::find_if(views_, [](const SliceView* one) { return one->hasFocus(); });
  return normal_of(planes[focused == views_.end() ? 0 : static_cast<std::size_t>(focused - views_.begin())]);
}

void SlicesPanel::follow(const CuttingState* tool) {
  if (tool == nullptr) {
    if (!tool_pose_) return;
    tool_pose_.reset();
    overlay_.tool_axis.reset();
    overlay_.tool.reset();
    for (SliceView* view : views_) view->show_overlay(overlay_);
    return;
  }
  const Pose& now = tool->pose_bone_tool;
  const bool moved = !tool_pose_ || tool_pose_->position_mm != now.position_mm ||
                     tool_pose_->rotation.coeffs() != now.rotation.coeffs() || tool_name_ != tool->tool_name;
  if (follows_->isChecked())
    point_.follow(now, tool->phase == CuttingPhase::cutting || tool->phase == CuttingPhase::rubbing, axes());
  if (moved) set_tool(tool);
  ask();
}

void SlicesPanel::set_tool(const CuttingState* tool) {
  if (tool_name_ != tool->tool_name) {
    tool_name_ = tool->tool_name;
    const Result<Tool> known = find_tool(tool_name_);
    solid_ = known ? std::optional(tool_solid(*known)) : std::nullopt;
  }
  tool_pose_ = tool->pose_bone_tool;
  overlay_.tool_axis = {tool_pose_->position_mm, tool_pose_->direction(Vec3::UnitZ())};
  overlay_.tool = solid_ ? std::optional(placed(*solid_, *tool_pose_)) : std::nullopt;
  for (SliceView* view : views_) view->show_overlay(overlay_);
}

void SlicesPanel::show_status() {
  const std::optional<InsideStatus> now = inside_ ? inside_->status() : std::nullopt;
  QString notice, line;
  if (now) {
    switch (now->state) {
      case InsideState::begins:
        notice = tr("The bone is fetched…");
        if (now->why) notice += "\n" + QString::fromStdString(now->why->message);
        break;
      case InsideState::makes:
        notice = tr("The slices are computed, %1 %").arg(static_cast<int>(100.0 * now->progress));
        break;
      case InsideState::follows:
        break;
      case InsideState::interrupted:
        line = tr("Connection lost: the slices show the bone as it was.");
        break;
      case InsideState::failed:
        notice = line = now->why ? QString::fromStdString(now->why->message) : QString();
        break;
    }
    if (now->scan_fault && line.isEmpty())
      line = tr("The slices show the density of the case, not its scan: %1")
                 .arg(QString::fromStdString(now->scan_fault->message));
  }
  for (SliceView* view : views_) view->set_notice(notice);
  if (line == status_->text()) return;
  status_->setText(line);
  status_->setVisible(!line.isEmpty());
}

void SlicesPanel::set_sliders() {
  sets_sliders_ = true;
  const auto planes = planes_of(view());
  for (std::size_t i = 0; i < kSlices; ++i) {
    const Vec3 normal = normal_of(planes[i]);
    const int last = static_cast<int>(std::ceil(0.5 * bone_.size_mm().dot(normal.cwiseAbs()) / pitch_mm_));
    const double now_mm = normal.dot(point_.point_mm() - bone_.centre_mm());
    sliders_[i]->setRange(-last, last);
    sliders_[i]->setPageStep(10);
    sliders_[i]->setValue(static_cast<int>(std::lround(now_mm / pitch_mm_)));
  }
  sets_sliders_ = false;
}

void SlicesPanel::showEvent(QShowEvent* event) {
  QWidget::showEvent(event);
  if (inside_) inside_->set_visible(painter_, true);
  ask();
}

void SlicesPanel::hideEvent(QHideEvent* event) {
  QWidget::hideEvent(event);
  if (inside_) inside_->set_visible(painter_, false);
  // The bone may change before somebody looks again.
  painter_->clear();
  show_images();
}

// Beside each other in a wide panel, one below the other in a high one.
void SlicesPanel::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  images_->setDirection(width() >= height() ? QBoxLayout::LeftToRight : QBoxLayout::TopToBottom);
}

}  // namespace osteon
