#include "server/import/label_comparison.hpp"

#include <itkImage.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <cstdio>
#include <new>

#include "server/import/ct_case.hpp"

namespace osteon::import {
namespace {

using Mask = itk::Image<std::uint8_t, 3>;
using Distances = itk::Image<float, 3>;

constexpr double kMostPercent = 0.95;

// The label of the scan's voxels in a box, from a smaller box around all labels.
struct Labelled {
  imaging::VoxelBox box;
  const std::vector<std::uint8_t>& values;

  [[nodiscard]] std::uint8_t at(const std::array<int, 3>& voxel) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (voxel[axis] < box.first[axis] || voxel[axis] > box.last[axis]) return 0;
    return values[box.index(voxel[0], voxel[1], voxel[2])];
  }
};

bool is_empty(const imaging::VoxelBox& box) { return box.last[0] < box.first[0]; }

// The box of the voxels with one of these labels; empty if there is none.
imaging::VoxelBox box_of(const Labelled& from, const std::bitset<256>& of) {
  imaging::VoxelBox box{from.box.last, {-1, -1, -1}};
  for (std::size_t axis = 0; axis < 3; ++axis) ++box.first[axis];
  const std::uint8_t* value = from.values.data();
  for (int slice = from.box.first[2]; slice <= from.box.last[2]; ++slice)
    for (int row = from.box.first[1]; row <= from.box.last[1]; ++row)
      for (int column = from.box.first[0]; column <= from.box.last[0]; ++column, ++value) {
        if (!of[*value]) continue;
        const std::array<int, 3> at{column, row, slice};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          box.first[axis] = std::min(box.first[axis], at[axis]);
          box.last[axis] = std::max(box.last[axis], at[axis]);
        }
      }
  return box;
}

// Around both, with one voxel more on each side that the scan has.
imaging::VoxelBox box_around(const imaging::VoxelBox& a, const imaging::VoxelBox& b, const std::array<int, 3>& dims) {
  imaging::VoxelBox box = is_empty(a) ? b : a;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!is_empty(b)) {
      box.first[axis] = std::min(box.first[axis], b.first[axis]);
      box.last[axis] = std::max(box.last[axis], b.last[axis]);
    }
    box.first[axis] = std::max(0, box.first[axis] - 1);
    box.last[axis] = std::min(dims[axis] - 1, box.last[axis] + 1);
  }
  return box;
}

imaging::VoxelMask mask_of(const Labelled& from, const std::bitset<256>& of, const imaging::VoxelBox& box) {
  imaging::VoxelMask mask({box.dim(0), box.dim(1), box.dim(2)});
  std::uint8_t* to = mask.values.data();
  for (int slice = box.first[2]; slice <= box.last[2]; ++slice)
    for (int row = box.first[1]; row <= box.last[1]; ++row)
      for (int column = box.first[0]; column <= box.last[0]; ++column)
        *to++ = of[from.at({column, row, slice})] ? 1 : 0;
  return mask;
}

// Memory indices of the voxels that share a face with one outside the set.
std::vector<std::size_t> surface_of(const imaging::VoxelMask& set) {
  std::vector<std::size_t> surface;
  const auto [columns, rows, slices] = set.dims;
  const auto row_step = static_cast<std::ptrdiff_t>(columns), slice_step = row_step * rows;
  const std::uint8_t* value = set.values.data();
  for (int slice = 0; slice < slices; ++slice)
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column, ++value) {
        if (*value == 0) continue;
        const bool inner = (column == 0 || value[-1] != 0) && (column + 1 == columns || value[1] != 0) &&
                           (row == 0 || value[-row_step] != 0) && (row + 1 == rows || value[row_step] != 0) &&
                           (slice == 0 || value[-slice_step] != 0) && (slice + 1 == slices || value[slice_step] != 0);
        if (!inner) surface.push_back(static_cast<std::size_t>(value - set.values.data()));
      }
  return surface;
}

// Distances from voxels to the nearest one of a surface, sorted, mm. Error: cancelled.
Result<std::vector<float>> distances_to(const std::vector<std::size_t>& surface, const std::vector<std::size_t>& from,
                                        const std::array<int, 3>& dims, const Vec3& spacing_mm,
                                        const KeepGoing& keep_going) {
  Mask::RegionType region;
  for (unsigned axis = 0; axis < 3; ++axis) region.SetSize(axis, static_cast<itk::SizeValueType>(dims[axis]));
  const auto mask = Mask::New();
  mask->SetRegions(region);
  const double spacing[3] = {spacing_mm.x(), spacing_mm.y(), spacing_mm.z()};
  mask->SetSpacing(spacing);
  mask->Allocate(true);
  for (const std::size_t voxel : surface) mask->GetBufferPointer()[voxel] = 1;
  const auto filter = itk::SignedMaurerDistanceMapImageFilter<Mask, Distances>::New();
  filter->SetInput(mask);
  filter->SquaredDistanceOff();
  filter->UseImageSpacingOn();
  filter->AddObserver(itk::ProgressEvent(), [&](const itk::EventObject&) {
    if (!keep_going(filter->GetProgress())) filter->AbortGenerateDataOn();
  });
  try {
    filter->Update();
  } catch (const itk::ProcessAborted&) {
    return stopped_while("comparing labels");
  }
  if (!keep_going(1.0)) return stopped_while("comparing labels");
  const float* distance = filter->GetOutput()->GetBufferPointer();
  std::vector<float> found;
  found.reserve(from.size());
  for (const std::size_t voxel : from) found.push_back(std::abs(distance[voxel]));
  std::ranges::sort(found);
  return found;
}

// The smallest value that at least 95 % of the sorted values do not exceed.
double percentile95(const std::vector<float>& sorted) {
  const auto rank = static_cast<std::size_t>(std::ceil(kMostPercent * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1];
}

double cm3_of(const imaging::VoxelMask& mask, const Vec3& spacing_mm) {
  const auto voxels = std::ranges::count_if(mask.values, [](std::uint8_t value) { return value != 0; });
  return static_cast<double>(voxels) * spacing_mm.prod() * 1e-3;
}

int number_of(const CaseLabel& label) {
  const auto in_file = label.provenance.parameters.find("number_in_file");
  return in_file == label.provenance.parameters.end() ? label.value : static_cast<int>(in_file->second);
}

std::bitset<256> only(int value) {
  std::bitset<256> one;
  one.set(static_cast<std::size_t>(value));
  return one;
}

// What is compared: a label, or all labels of a bone that has one for each tissue.
struct Comparable {
  std::string name;
  std::vector<std::string> words;  // of the name, sorted
  int value = 0;                   // of the label; 0: several
  int number = 0;                  // of the label, or of the bone among all bones
  bool named = true;               // not only by a number
  std::bitset<256> of;
};

std::vector<std::string> sorted(std::vector<std::string> words) {
  std::ranges::sort(words);
  return words;
}

// Names that Osteon gives where there is none.
bool is_named(const CaseLabel& label) {
  return label.name != "bone " + std::to_string(label.value) &&
         label.name != "label " + std::to_string(number_of(label));
}

std::vector<Comparable> labels_alone(const std::vector<CaseLabel>& labels) {
  std::vector<Comparable> alone;
  for (const CaseLabel& label : labels)
    alone.push_back(
        {label.name, sorted(words_of(label.name)), label.value, number_of(label), is_named(label), only(label.value)});
  return alone;
}

// All bones of labels of which at least one names a tissue. A bone is what is left of a name without the tissue.
std::vector<Comparable> bones_of_tissues(const std::vector<CaseLabel>& labels) {
  std::vector<Comparable> bones;
  bool any = false;
  for (const CaseLabel& label : labels) {
    if (!is_carved(label.kind) || label.kind == LabelKind::metal || label.kind == LabelKind::enamel) continue;
    std::vector<std::string> words = words_of(label.name);
    any = std::erase_if(words, [](const std::string& word) { return is_tissue_word(word); }) > 0 || any;
    std::string name;
    for (const std::string& word : words) name += (name.empty() ? "" : " ") + word;
    const std::vector<std::string> key = sorted(std::move(words));
    auto bone = std::ranges::find(bones, key, &Comparable::words);
    if (bone == bones.end()) {
      const int number = static_cast<int>(bones.size()) + 1;
      bone = bones.insert(bones.end(), {name.empty() ? "bone" : name, key, 0, number, true, {}});
    }
    bone->of |= only(label.value);
  }
  return any ? bones : std::vector<Comparable>();
}

struct Match {
  const Comparable* truth = nullptr;
  MatchedBy by = MatchedBy::nothing;
};

struct Pair {
  Comparable ours;
  Match match;
};

// All labels of the case, and bones of which the truth does not tell the tissues apart.
std::vector<Pair> matched(const std::vector<CaseLabel>& labels, const std::vector<Comparable>& truth,
                          const std::vector<Comparable>& truth_bones) {
  const auto by_words = [](const Comparable& ours, const std::vector<Comparable>& list) -> const Comparable* {
    const auto found = std::ranges::find(list, ours.words, &Comparable::words);
    return found == list.end() ? nullptr : &*found;
  };
  std::vector<Pair> pairs;
  std::bitset<256> taken;
  for (Comparable& label : labels_alone(labels)) {
    const Comparable* other = by_words(label, truth);
    if (other == nullptr) other = by_words(label, truth_bones);
    if (other != nullptr) taken |= other->of;
    pairs.push_back({std::move(label), {other, other != nullptr ? MatchedBy::name : MatchedBy::nothing}});
  }
  for (Comparable& bone : bones_of_tissues(labels))
    if (const Comparable* other = by_words(bone, truth); other != nullptr && (other->of & taken).none()) {
      taken |= other->of;
      pairs.push_back({std::move(bone), {other, MatchedBy::name}});
    }
  for (auto& [ours, match] : pairs) {
    if (match.truth != nullptr) continue;
    const std::vector<Comparable>& list = !ours.named && !truth_bones.empty() ? truth_bones : truth;
    const auto other = std::ranges::find(list, ours.number, &Comparable::number);
    if (other != list.end() && (!ours.named || !other->named) && (other->of & taken).none())
      match = {&*other, MatchedBy::number};
  }
  return pairs;
}

std::bitset<256> carved(const std::vector<CaseLabel>& labels) {
  std::bitset<256> of;
  for (const CaseLabel& label : labels) of[static_cast<std::size_t>(label.value)] = is_carved(label.kind);
  return of;
}

}  // namespace

Result<TruthLabels> read_truth(const std::filesystem::path& input, const LabelNames& names, const imaging::HuVolume& ct,
                               const std::string& frame_of_reference, const KeepGoing& keep_going) {
  auto map = read_label_map(input, part(keep_going, 0.0, 0.5));
  if (!map) return tl::unexpected(map.error());
  LabelNames known = names;
  for (const LabelSegment& segment : map->segments) {
    const std::string number = std::to_string(segment.number);
    const bool named =
        known.given.contains(segment.name) || known.given.contains(number) || known_structure(segment.name) ||
        known_structure(segment.type) ||
        (names.totalsegmentator && segment.name.empty() && known_structure(totalsegmentator_name(segment.number)));
    if (!named) known.given[number] = {"label " + number, LabelKind::bone};
  }
  auto placed = place_labels(std::move(*map), known, ct, frame_of_reference, part(keep_going, 0.5, 0.95));
  if (!placed) return tl::unexpected(placed.error());

  TruthLabels truth;
  truth.scan = {ct.dims, ct.origin_mm, ct.directions * ct.spacing_mm.asDiagonal()};
  truth.labels = std::move(placed->labels);
  const Labelled all{{{0, 0, 0}, {ct.dims[0] - 1, ct.dims[1] - 1, ct.dims[2] - 1}}, placed->values.values};
  truth.box = box_of(all, ~only(0));
  auto values =
      imaging::cropped(std::move(placed->values), truth.box.first, truth.box.last, part(keep_going, 0.95, 1.0));
  if (!values) return tl::unexpected(values.error());
  truth.values = std::move(values->values);
  return truth;
}

Result<Agreement> agreement_of(const imaging::VoxelMask& a, const imaging::VoxelMask& b, const Vec3& spacing_mm,
                               const KeepGoing& keep_going) try {
  std::int64_t both = 0, sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const int in_a = a.values[i] != 0 ? 1 : 0, in_b = b.values[i] != 0 ? 1 : 0;
    both += in_a * in_b;
    sum += in_a + in_b;
  }
  Agreement agreement;
  agreement.dice = sum > 0 ? 2.0 * static_cast<double>(both) / static_cast<double>(sum) : 0.0;
  const std::vector<std::size_t> surface_a = surface_of(a), surface_b = surface_of(b);
  if (surface_a.empty() || surface_b.empty()) return agreement;
  const auto from_a = distances_to(surface_b, surface_a, a.dims, spacing_mm, part(keep_going, 0.0, 0.5));
  if (!from_a) return tl::unexpected(from_a.error());
  const auto from_b = distances_to(surface_a, surface_b, a.dims, spacing_mm, part(keep_going, 0.5, 1.0));
  if (!from_b) return tl::unexpected(from_b.error());
  double total_mm = 0.0;
  for (const auto* distances : {&*from_a, &*from_b})
    for (const float distance : *distances) total_mm += distance;
  agreement.mean_mm = total_mm / static_cast<double>(from_a->size() + from_b->size());
  agreement.percentile95_mm = std::max(percentile95(*from_a), percentile95(*from_b));
  return agreement;
} catch (const itk::ExceptionObject& error) {
  return failure(ErrorCode::internal, std::string("cannot measure distances of labels: ") + error.GetDescription());
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, kNoMemory);
}

Result<LabelComparison> compare_labels(const CaseScan& scan, const std::vector<CaseLabel>& labels,
                                       const TruthLabels& truth, const KeepGoing& keep_going) {
  const Vec3 spacing_mm = truth.scan.axes_mm.colwise().norm();
  // The case's voxels are some of the scan's.
  const Vec3 first = truth.scan.axes_mm.inverse() * (scan.geometry.origin_mm - truth.scan.origin_mm);
  imaging::VoxelBox case_box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    case_box.first[axis] = static_cast<int>(std::lround(first[static_cast<int>(axis)]));
    case_box.last[axis] = case_box.first[axis] + scan.geometry.dims[axis] - 1;
  }
  const std::vector<std::uint8_t> values = scan.labels.dense();
  const Labelled ours{case_box, values}, theirs{truth.box, truth.values};

  LabelComparison comparison;
  const auto compare = [&](ComparedLabel row, const std::bitset<256>& of, const std::bitset<256>& of_truth,
                           const KeepGoing& going) -> Result<void> {
    const imaging::VoxelBox box = box_around(box_of(ours, of), box_of(theirs, of_truth), truth.scan.dims);
    if (!is_empty(box)) {
      const imaging::VoxelMask a = mask_of(ours, of, box), b = mask_of(theirs, of_truth, box);
      row.volume_cm3 = cm3_of(a, spacing_mm);
      row.truth_cm3 = cm3_of(b, spacing_mm);
      if (!row.truth.empty()) {
        const auto agreement = agreement_of(a, b, spacing_mm, going);
        if (!agreement) return tl::unexpected(agreement.error());
        row.agreement = *agreement;
      }
    }
    comparison.labels.push_back(std::move(row));
    return {};
  };
  const std::vector<Comparable> alone = labels_alone(truth.labels), bones = bones_of_tissues(truth.labels);
  const std::vector<Pair> pairs = matched(labels, alone, bones);
  std::bitset<256> found;
  const double all = static_cast<double>(pairs.size()) + 1.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto& [compared, match] = pairs[i];
    const std::bitset<256> of_truth = match.truth != nullptr ? match.truth->of : std::bitset<256>();
    found |= of_truth;
    const KeepGoing going = part(keep_going, static_cast<double>(i) / all, static_cast<double>(i + 1) / all);
    if (auto done = compare(
            {compared.value, compared.name, match.truth != nullptr ? match.truth->name : "", match.by, 0.0, 0.0, {}},
            compared.of, of_truth, going);
        !done)
      return tl::unexpected(done.error());
  }
  if (auto done = compare({0, "all bone", "all bone", MatchedBy::nothing, 0.0, 0.0, {}}, carved(labels),
                          carved(truth.labels), part(keep_going, static_cast<double>(pairs.size()) / all, 1.0));
      !done)
    return tl::unexpected(done.error());
  for (const CaseLabel& label : truth.labels)
    if (!found[static_cast<std::size_t>(label.value)]) comparison.missing.push_back(label.name);
  return comparison;
}

std::string_view name_of(MatchedBy matched) {
  switch (matched) {
    case MatchedBy::name:
      return "name";
    case MatchedBy::number:
      return "number";
    case MatchedBy::nothing:
      break;
  }
  return "";
}

std::string comparison_text(const LabelComparison& comparison) {
  std::string text = "truth        Dice  mean mm  95 % mm      cm3  truth's  label\n";
  std::array<char, 640> line{};
  for (const ComparedLabel& row : comparison.labels) {
    if (row.truth.empty()) {
      std::snprintf(line.data(), line.size(), "           %6s  %7s  %7s  %7.2f  %7s  %s: the truth has no such label\n",
                    "-", "-", "-", row.volume_cm3, "-", row.name.c_str());
    } else {
      std::array<char, 32> mean{"-"}, most{"-"};
      if (row.agreement.mean_mm) std::snprintf(mean.data(), mean.size(), "%.3f", *row.agreement.mean_mm);
      if (row.agreement.percentile95_mm)
        std::snprintf(most.data(), most.size(), "%.3f", *row.agreement.percentile95_mm);
      const bool other = row.name != row.truth;
      const std::string by(name_of(row.matched));
      std::snprintf(line.data(), line.size(), "           %6.4f  %7s  %7s  %7.2f  %7.2f  %s%s%s%s%s\n",
                    row.agreement.dice, mean.data(), most.data(), row.volume_cm3, row.truth_cm3, row.name.c_str(),
                    other ? ", with " : "", other ? row.truth.c_str() : "", by.empty() ? "" : ", by ", by.c_str());
    }
    text += line.data();
  }
  for (const std::string& name : comparison.missing) text += "           the case has no " + name + "\n";
  return text;
}

}  // namespace osteon::import
