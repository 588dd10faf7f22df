// The edits of the page of image processing: threshold, filter, seeds, strokes, cuts, box and labels.
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QSignalBlocker>
#include <QSpinBox>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "viewer_client/desktop/imaging_page.hpp"
#include "viewer_client/desktop/landmark_names.hpp"
#include "viewer_client/desktop/library.hpp"

namespace osteon {

namespace {

// [A] Who pauses for longer does something else.
constexpr double kLongestPause_min = 2.0;
constexpr double kMsPerMinute = 60000.0;

}  // namespace

void ImagingPage::take_threshold() {
  ImagingEdits edits = history_.now();
  edits.threshold_hu = threshold_->value();
  history_.apply(std::move(edits));
}

void ImagingPage::apply_threshold() {
  take_threshold();
  follow_edits();
}

void ImagingPage::take_filter() {
  if (!scene_.open()) return;
  take_threshold();
  ImagingEdits edits = history_.now();
  const int row = filter_->currentIndex();
  edits.filter = {row == 1   ? MedianFilter::slice
                  : row == 2 ? MedianFilter::volume
                             : MedianFilter::none,
                  row == kGaussianRow ? gaussian_->value() : 0.0};
  history_.apply(std::move(edits));
  follow_edits();
}

void ImagingPage::show_filter(const ScanFilter& filter) {
  const QSignalBlocker quiet(filter_), quiet_sigma(gaussian_);
  filter_->setCurrentIndex(filter.gaussian_mm > 0.0                ? kGaussianRow
                           : filter.median == MedianFilter::slice  ? 1
                           : filter.median == MedianFilter::volume ? 2
                                                                   : 0);
  if (filter.gaussian_mm > 0.0) gaussian_->setValue(filter.gaussian_mm);
}

void ImagingPage::take(ImagingEdits edits, int bone) {
  if (edits == history_.now()) return refresh_list();
  if (bone != 0) {
    const double minutes = static_cast<double>(work_.elapsed()) / kMsPerMinute;
    own_label(edits, bone).minutes += std::min(kLongestPause_min, minutes);
  }
  if (!is_listable(edits)) {
    words_->setText(tr("The edit list is full, at 1000 edits or 1 MiB. Make the bone, or undo edits."));
    refresh_list();
    return refresh_planes();
  }
  work_.restart();
  history_.apply(std::move(edits));
  follow_edits();
}

std::bitset<256> ImagingPage::bones_under(const std::array<int, 3>& voxel) const {
  return bones_at(scene_.scan.geometry, scene_.islands, scene_.look.kept, voxel, history_.now().corrections);
}

int ImagingPage::bone_at(const std::array<int, 3>& voxel) const { return shown_bone(bones_under(voxel)); }

bool ImagingPage::kept(int island) const {
  return std::ranges::any_of(history_.now().seeds, [&](const KeptSeed& seed) {
    const auto voxel = voxel_of(scene_.scan.geometry, seed.at_mm);
    return seed.bone != 0 && voxel && scene_.islands.number(*voxel) == island;
  });
}

std::optional<ImagingEdits> ImagingPage::with_seed(const std::array<int, 3>& voxel, int bone) {
  const int island = scene_.islands.number(voxel);
  const auto seed = island == 0 ? std::optional<std::array<int, 3>>()
                                : scene_.islands.seed_near(scene_.scan, island, found_hu(), voxel);
  if (!seed) {
    words_->setText(tr("There is no bone at the crosshair. Move it into a tinted part."));
    return std::nullopt;
  }
  ImagingEdits edits = history_.now();
  const Vec3 at_mm = centre_of(scene_.scan.geometry, *seed);
  if (std::ranges::find(edits.seeds, at_mm, &KeptSeed::at_mm) != edits.seeds.end()) return std::nullopt;
  edits.seeds.push_back({at_mm, bone});
  return edits;
}

void ImagingPage::keep_at(const std::array<int, 3>& voxel) {
  if (!keep_->isEnabled()) return;
  const int bone = choice_->bone() != 0 ? choice_->bone() : next_bone(history_.now());
  auto edits = with_seed(voxel, bone);
  if (!edits) return;
  words_->setText(tr("Part %1 is kept.").arg(scene_.islands.number(voxel)));
  take(std::move(*edits), bone);
}

void ImagingPage::keep_outside(const std::array<int, 3>& voxel) {
  auto edits = with_seed(voxel, 0);
  if (!edits) return;
  words_->setText(tr("What touches a bone there is separated from it and left out."));
  take(std::move(*edits), bone_at(voxel));
}

void ImagingPage::change_island(const QListWidgetItem* item) {
  const auto row = static_cast<std::size_t>(island_list_->row(item));
  if (filling_ || row >= islands_.size()) return;
  const ListedIsland& island = islands_[row];
  const bool keep = item->checkState() == Qt::Checked;
  if (keep == kept(island.number)) return;
  ImagingEdits edits = history_.now();
  int bone = 0;
  if (keep) {
    const auto centre = voxel_of(scene_.scan.geometry, island.centre_mm);
    const auto seed =
        scene_.islands.main_seed_near(scene_.scan, island.number, found_hu(), centre.value_or(scene_.crosshair));
    bone = next_bone(edits);
    if (seed) edits.seeds.push_back({centre_of(scene_.scan.geometry, *seed), bone});
  } else {
    std::erase_if(edits.seeds, [&](const KeptSeed& seed) {
      const auto voxel = voxel_of(scene_.scan.geometry, seed.at_mm);
      return voxel && scene_.islands.number(*voxel) == island.number;
    });
  }
  take(std::move(edits), bone);
}

void ImagingPage::follow_tools() {
  if (tools_ == nullptr) return;  // it is being made
  if (scene_.tool != tools_->tool()) end_drags(false);
  scene_.tool = tools_->tool();
  scene_.brush_mm = tools_->radius_mm();
  drag_ ? show_drag() : refresh_planes();
}

bool ImagingPage::begin_drag(const PlaneAxes& axes, const std::array<int, 3>& voxel) {
  end_drags(true);
  look_at(voxel);
  // A box without bone can be drawn anew.
  const bool anywhere = scene_.tool == ImagingTool::box || scene_.tool == ImagingTool::landmark;
  if (anywhere ? steps_.making() : !keep_->isEnabled()) {
    words_->setText(keep_->toolTip());
    return false;
  }
  const bool of_one = scene_.tool == ImagingTool::paint || scene_.tool == ImagingTool::cut;
  if (of_one && choice_->bone() == 0 && bones_under(voxel).count() > 1) {
    words_->setText(tr("Several bones grow in this part. Choose the bone first."));
    return false;
  }
  drag_.emplace(scene_.tool, axes, voxel);
  show_drag();
  return true;
}

void ImagingPage::end_drags(bool keep) {
  for (ImagingPlane* plane : planes_)
    if (plane != nullptr) plane->end_drag(keep);
}

void ImagingPage::drag_to(const std::array<int, 3>& voxel) {
  if (!drag_) return;
  drag_->move(voxel);
  look_at(voxel);
  show_drag();
}

namespace {

// The bone that a drag works on: that under its first voxel, or else the last that was kept.
int bone_of_drag(int chosen, int under, const ImagingEdits& edits) {
  if (chosen != 0) return chosen;
  if (under != 0) return under;
  for (std::size_t i = edits.seeds.size(); i > 0; --i)
    if (edits.seeds[i - 1].bone != 0) return edits.seeds[i - 1].bone;
  return next_bone(edits);
}

}  // namespace

void ImagingPage::show_drag() {
  refresh_look();
  const ScanGeometry& scan = scene_.scan.geometry;
  const int bone = bone_of_drag(choice_->bone(), bone_at(drag_->first()), history_.now());
  const auto show = [&](Correction correction) {
    scene_.look.corrections.push_back(std::make_shared<const Correction>(std::move(correction)));
  };
  switch (drag_->tool()) {
    case ImagingTool::paint:
    case ImagingTool::erase:
      show(drag_->stroke(scan, bone, tools_->radius_mm(), tools_->flat()));
      break;
    case ImagingTool::cut:
      if (auto cut = drag_->cut(scan, bone)) show(std::move(*cut));
      break;
    case ImagingTool::box:
      if (drag_->first() != drag_->last()) scene_.look.box = drag_->box(scan, history_.now().box);
      break;
    default:
      break;
  }
  refresh_planes();
}

void ImagingPage::end_drag(bool keep) {
  const std::optional<PlaneDrag> drag = std::exchange(drag_, std::nullopt);
  if (!drag) return;
  refresh_look();
  refresh_planes();
  if (!keep) return;
  take_threshold();
  const ScanGeometry& scan = scene_.scan.geometry;
  ImagingEdits edits = history_.now();
  const int under = bone_at(drag->first()), bone = bone_of_drag(choice_->bone(), under, edits);
  switch (drag->tool()) {
    case ImagingTool::paint:
    case ImagingTool::erase: {
      Correction stroke = drag->stroke(scan, bone, tools_->radius_mm(), tools_->flat());
      if (!reaches(scan, range_of(scan, edits.box), stroke))
        return words_->setText(tr("The brush touched nothing in the box. A click with the tool Box takes it away."));
      edits.corrections.push_back(std::make_shared<const Correction>(std::move(stroke)));
      return take(std::move(edits), bone);
    }
    case ImagingTool::cut: {
      auto cut = drag->cut(scan, bone);
      if (!cut) return words_->setText(tr("Drag a line through the bone. What is to its right is cut off."));
      if (choice_->bone() == 0 && under == 0)
        return words_->setText(tr("The line begins on no kept bone. Begin on one, or choose the bone."));
      edits.corrections.push_back(std::make_shared<const Correction>(std::move(*cut)));
      return take(std::move(edits), bone);
    }
    case ImagingTool::box:
      edits.box = drag->box(scan, edits.box);
      return take(std::move(edits), 0);
    case ImagingTool::outside:
      return keep_outside(drag->first());
    case ImagingTool::landmark:
      return set_landmark(drag->last());
    default:
      return;
  }
}

void ImagingPage::name_bone(int bone, const QString& name) {
  ImagingEdits edits = history_.now();
  const std::string text = name.trimmed().toStdString();
  if (!may_be_called(edits, bone, text)) {
    words_->setText(tr("No bone can be called that. Write up to 60 bytes that no other bone has."));
    return choice_->follow(edits);
  }
  own_label(edits, bone).name = text;
  take(std::move(edits), bone);
}

void ImagingPage::fade_bone(int bone, int percent) {
  if (bone == 0) return;
  ImagingEdits edits = history_.now();
  own_label(edits, bone).opacity_percent = percent;
  take(std::move(edits), 0);
}

void ImagingPage::follow_edits() {
  const ImagingEdits& edits = history_.now();
  const QSignalBlocker quiet(threshold_);
  threshold_->setValue(static_cast<int>(edits.threshold_hu));
  histogram_->set_limits(edits.threshold_hu, scene_.look.window);
  threshold_timer_.stop();
  show_filter(edits.filter);
  choice_->follow(edits);
  landmarks_->follow(edits);
  if (!current()) {
    scene_.look.threshold_hu = edits.threshold_hu;
    refresh_look();
    // A landmark changes nothing of a search that is at work or was cancelled.
    if (wanted() != searched_) find_islands();
  } else {
    scene_.look.threshold_hu.reset();
    refresh_list();
  }
  refresh_planes();
  enable_parts();
}

void ImagingPage::refresh_look() {
  const ImagingEdits& edits = history_.now();
  PlaneLook& look = scene_.look;
  look.corrections = edits.corrections;
  look.box = edits.box;
  look.kept = {};
  scene_.seeds.clear();
  scene_.landmarks.clear();
  for (const MarkedLandmark& landmark : edits.landmarks)
    if (const auto voxel = scene_.open() ? voxel_of(scene_.scan.geometry, landmark.at_mm) : std::nullopt)
      scene_.landmarks.push_back({*voxel, landmark_title(landmark.name)});
  for (const KeptSeed& seed : edits.seeds) {
    const auto voxel = scene_.open() ? voxel_of(scene_.scan.geometry, seed.at_mm) : std::nullopt;
    if (!voxel) continue;
    scene_.seeds.push_back({*voxel, seed.bone == 0});
    const auto island = static_cast<std::size_t>(scene_.islands.number(*voxel));
    if (island == 0 || seed.bone == 0) continue;
    look.kept[island].set(static_cast<std::size_t>(seed.bone));
  }
  set_tints(look, edits.labels);
}

void ImagingPage::make_bone(bool sends) {
  end_drags(true);
  if (!make_->isEnabled()) return;  // a box has begun a search
  const ImagingEdits& edits = history_.now();
  std::vector<KeptSeed> seeds;
  for (const KeptSeed& seed : edits.seeds)
    for (const Vec3& at_mm : scene_.islands.moved_seeds(scene_.scan, found_hu(), {&seed.at_mm, 1})) {
      const auto same = std::ranges::find(seeds, at_mm, &KeptSeed::at_mm);
      if (same == seeds.end())
        seeds.push_back({at_mm, seed.bone});
      else if (same->bone != seed.bone)
        return words_->setText(tr("Seeds of two bones are in one voxel now. Choose a lower threshold, or undo one."));
    }
  sends_made_ = sends;
  const ImagingEdits made = made_edits(edits, std::move(seeds), scene_.scan.geometry);
  const bool same = made_ && made_->edits == made && is_case(made_->bone);
  if (same && (!report_->isChecked() || is_file(report_page(made_->bone)))) return use_made(made_->bone);
  made_ = {made, {}};
  show_work(tr("The bone is being made"));
  steps_.make(made, report_->isChecked());
  if (!steps_.making()) sends_made_ = false;
  events_.busy(steps_.making());
  enable_parts();
}

void ImagingPage::make_and_send() {
  if (!send_->isEnabled() || !events_.may_send()) return;
  make_bone(true);
}

void ImagingPage::use_made(const std::filesystem::path& bone) {
  events_.busy(false);
  made_->bone = bone;
  const QString said = show_report(bone);
  end_work(said);
  if (std::exchange(sends_made_, false)) return words_->setText(said + ' ' + events_.send(bone));
  events_.made(bone, said);
}

void ImagingPage::check_made() {
  if (steps_.busy() || !made_ || made_->bone.empty() || is_case(made_->bone)) return;
  made_.reset();
  words_->setText(tr("The case of the bone is removed again. The edits are still here."));
}

}  // namespace osteon
