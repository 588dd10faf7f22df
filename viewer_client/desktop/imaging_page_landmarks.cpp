// The landmarks of the page of image processing, which are edits as all others.
#include <QLabel>
#include <QLocale>
#include <algorithm>
#include <utility>

#include "viewer_client/desktop/imaging_page.hpp"
#include "viewer_client/desktop/landmark_names.hpp"

namespace osteon {

ImagingLandmarks* ImagingPage::make_landmarks() {
  return new ImagingLandmarks(
      {[this](const std::string& name) { show_landmark(name); },
       [this](const std::string& name) {
         take_threshold();
         ImagingEdits edits = history_.now();
         remove_landmark(edits, name);
         take(std::move(edits), 0);
       },
       [this](const std::string& name, const std::string& other) {
         take_threshold();
         ImagingEdits edits = history_.now();
         if (!rename_landmark(edits, name, other)) {
           words_->setText(tr("No landmark can be called that. Write up to 60 bytes that no other landmark has."));
           return landmarks_->follow(edits);
         }
         take(std::move(edits), 0);
         landmarks_->follow(history_.now());  // also if nothing changed
       }});
}

void ImagingPage::set_landmark(const std::array<int, 3>& voxel) {
  const std::string name = landmarks_->name();
  if (!is_landmark_name(name))
    return words_->setText(tr("Name the landmark first: up to 60 bytes, in the field Landmark."));
  const Vec3 at_mm = centre_of(scene_.scan.geometry, voxel);
  ImagingEdits edits = history_.now();
  put_landmark(edits, name, at_mm);
  const QLocale locale;
  words_->setText(tr("%1 is at %2, %3, %4 mm.")
                      .arg(landmark_title(name), locale.toString(at_mm.x(), 'f', 1), locale.toString(at_mm.y(), 'f', 1),
                           locale.toString(at_mm.z(), 'f', 1)));
  take(std::move(edits), 0);
}

void ImagingPage::show_landmark(const std::string& name) {
  const auto& all = history_.now().landmarks;
  const auto found = std::ranges::find(all, name, &MarkedLandmark::name);
  if (found == all.end() || !scene_.open()) return;
  if (const auto voxel = voxel_of(scene_.scan.geometry, found->at_mm)) look_at(*voxel);
}

}  // namespace osteon
