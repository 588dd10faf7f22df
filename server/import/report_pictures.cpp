#include "server/import/report_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace osteon::import {
namespace {

constexpr int kPanel = 460, kCaption = 22, kSpace = 8, kEdge = 26;  // pixels
constexpr int kLabelPixels = 150;
constexpr double kAround_mm = 8.0;  // of the scan around the bones in a plane
constexpr std::size_t kMostInList = 17;
constexpr Colour kThresholdInk{220, 40, 40}, kBoneInk{230, 159, 0}, kScanInk{170, 174, 180};

std::string words(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

struct Colours {
  LabelColours bones, structures, all;
};
Colours colours_of(const std::vector<CaseLabel>& labels) {
  Colours colours;
  int next = 0;
  for (const CaseLabel& label : labels) {
    const auto value = static_cast<std::size_t>(label.value);
    const Colour colour = palette_colour(next++);
    (is_carved(label.kind) ? colours.bones : colours.structures)[value] = colour;
    colours.all[value] = colour;
  }
  return colours;
}

// Two lines for each bone and structure, one if there are many, and what was left out.
Picture list_of_parts(const ReportFacts& facts) {
  Picture list(kPanel, kPanel, kBlackInk);
  const auto kept = static_cast<std::size_t>(std::ranges::count(facts.parts, true, &ReportPart::kept));
  const bool two_lines = kept <= kMostInList / 2;
  int y = kEdge / 2;
  std::size_t listed = 0;
  double left_out_cm3 = 0.0;
  for (const ReportPart& part : facts.parts) {
    if (!part.kept) left_out_cm3 += part.volume_cm3;
    if (!part.kept || ++listed > kMostInList) continue;
    list.fill(8, y, 14, 14, part.colour.value_or(kGreyInk));
    const std::string volume = words("%.1f cm3", part.volume_cm3);
    list.text(32, y, part.name.substr(0, two_lines ? 34 : 24), kWhiteInk, 2);
    if (two_lines) {
      const std::string density = part.density_g_cm3 ? words(", mean %.2f g/cm3", *part.density_g_cm3) : "";
      list.text(32, y + 22, part.at_risk ? volume + ", at risk" : volume + density,
                part.at_risk ? kThresholdInk : kGreyInk, 2);
      y += 46;
    } else {
      list.text(kPanel - 8 - text_width(volume, 2), y, volume, part.at_risk ? kThresholdInk : kGreyInk, 2);
      y += 22;
    }
  }
  if (listed > kMostInList) list.text(32, y, "and " + std::to_string(listed - kMostInList) + " more", kGreyInk, 2);
  if (left_out_cm3 > 0.0)
    list.text(8, kPanel - 44, words("left out: %.1f cm3 of other islands", left_out_cm3), kGreyInk, 2);
  if (facts.threshold_hu) list.text(8, kPanel - 22, words("threshold %.0f HU", *facts.threshold_hu), kGreyInk, 2);
  return list;
}

}  // namespace

Result<Picture> montage(const LabelledVoxels& voxels, const std::vector<CaseLabel>& labels, const ReportFacts& facts,
                        const KeepGoing& keep_going) {
  const Colours colours = colours_of(labels);
  const bool any_bone = std::ranges::any_of(colours.bones, [](const auto& colour) { return colour.has_value(); });
  const LabelColours& main = any_bone ? colours.bones : colours.all;
  const Box box = coloured_box(voxels, colours.all);
  Picture whole(3 * kPanel + 2 * kSpace, 2 * (kPanel + kCaption) + kSpace, Colour{40, 44, 50});
  const auto place = [&](Picture panel, const std::string& caption, int column, int row) {
    const int x = column * (kPanel + kSpace), y = row * (kPanel + kCaption + kSpace);
    whole.fill(x, y, kPanel, kCaption, kBlackInk);
    whole.text(x + 6, y + 4, caption, kWhiteInk, 2);
    whole.paste(panel, x, y + kCaption);
  };
  static constexpr const char* kNames[] = {"axial, z %.0f mm", "coronal, y %.0f mm", "sagittal, x %.0f mm"};
  for (const View view : {View::axial, View::coronal, View::sagittal}) {
    const int column = static_cast<int>(view);
    if (!keep_going(0.1 * column)) return stopped_while("drawing the bone");
    Frame frame = frame_around(box.grown(kAround_mm), view, kPanel);
    const Vec3 across = direction_of(view).cwiseAbs();
    const double at_mm = fullest_plane_mm(voxels, main, view);
    frame.centre_mm += (at_mm - frame.centre_mm.dot(across)) * across;
    Picture panel = draw_plane(voxels, colours.all, frame);
    write_sides(panel, frame);
    place(std::move(panel), words(kNames[column], at_mm), column, 0);
  }
  for (const View view : {View::coronal, View::sagittal}) {
    const int column = view == View::coronal ? 0 : 1;
    const Frame frame = frame_around(box, view, kPanel, kEdge);
    auto panel = draw_surface(voxels, colours.bones, colours.structures, frame,
                              part(keep_going, 0.3 + 0.35 * column, 0.65 + 0.35 * column));
    if (!panel) return tl::unexpected(panel.error());
    write_sides(panel->picture, frame);
    place(std::move(panel->picture), column == 0 ? "from the front" : "from the left", column, 1);
  }
  place(list_of_parts(facts), "in the case", 2, 1);
  return whole;
}

Result<Picture> label_picture(const LabelledVoxels& voxels, int label, Colour colour, const KeepGoing& keep_going) {
  LabelColours one;
  one[static_cast<std::size_t>(label)] = colour;
  const Box box = coloured_box(voxels, one);
  if (box.empty()) return Picture(kLabelPixels, kLabelPixels, kBlackInk);
  auto drawn = draw_surface(voxels, one, {}, frame_around(box, View::coronal, kLabelPixels, 6), keep_going);
  if (!drawn) return tl::unexpected(drawn.error());
  return std::move(drawn->picture);
}

Picture histogram_picture(const ReportFacts& facts) {
  constexpr int kLeft = 20, kTop = 40, kHeight = 260, kBottom = 40;
  constexpr int kWidth = 2 * HuHistogram::kBins;  // two pixels for each bin
  Picture picture(kLeft + kWidth + 20, kTop + kHeight + kBottom, Colour{255, 255, 255});
  const auto most = std::max<std::int64_t>(10, std::ranges::max(facts.of_scan.voxels));
  const auto draw = [&](const HuHistogram& histogram, Colour colour) {
    for (int bin = 0; bin < HuHistogram::kBins; ++bin) {
      const auto count = static_cast<double>(histogram.voxels[static_cast<std::size_t>(bin)]);
      const int height = static_cast<int>(kHeight * std::log1p(count) / std::log1p(static_cast<double>(most)));
      picture.fill(kLeft + 2 * bin, kTop + kHeight - height, 2, height, colour);
    }
  };
  const auto x_of = [&](double hu) {
    return kLeft + static_cast<int>(std::lround(2.0 * (hu - HuHistogram::kFirst_hu) / HuHistogram::kBin_hu));
  };
  draw(facts.of_scan, kScanInk);
  draw(facts.of_bone, kBoneInk);
  picture.fill(kLeft, kTop + kHeight, kWidth, 2, kBlackInk);
  for (int hu = -1000; hu <= 3000; hu += 500) {
    const std::string text = std::to_string(hu);
    picture.fill(x_of(hu), kTop + kHeight, 2, 6, kBlackInk);
    picture.text(x_of(hu) - text_width(text, 2) / 2, kTop + kHeight + 10, text, kBlackInk, 2);
  }
  picture.text(kLeft + kWidth - 4, kTop + kHeight + 10, "HU", kBlackInk, 2);
  picture.fill(kLeft, 10, 14, 14, kScanInk);
  picture.text(kLeft + 20, 10, "scan", kBlackInk, 2);
  picture.fill(kLeft + 90, 10, 14, 14, kBoneInk);
  picture.text(kLeft + 110, 10, "bone of the case", kBlackInk, 2);
  if (facts.threshold_hu) {
    const int x = x_of(*facts.threshold_hu);
    picture.fill(x, kTop - 8, 2, kHeight + 8, kThresholdInk);
    picture.text(x + 8, kTop - 8, words("threshold %.0f HU", *facts.threshold_hu), kThresholdInk, 2);
  }
  return picture;
}

}  // namespace osteon::import
