#include "server/import/dicom_frames.hpp"

#include <gdcmFile.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmStringFilter.h>

#include "server/import/dicom_text.hpp"

namespace osteon::import {
namespace {

constexpr int kMostFrames = 1 << 14;
constexpr std::uint32_t kLongestNumber = 256;
const gdcm::Tag kSharedGroups(0x5200, 0x9229), kFrameGroups(0x5200, 0x9230);

using Sequence = gdcm::SmartPointer<gdcm::SequenceOfItems>;

// Null if there is none.
Sequence sequence_of(const gdcm::DataSet& data, const gdcm::Tag& tag) {
  return data.FindDataElement(tag) ? data.GetDataElement(tag).GetValueAsSQ() : Sequence();
}

// The functional groups of one frame.
class Groups {
 public:
  Groups(const gdcm::StringFilter& filter, const gdcm::DataSet* shared, const gdcm::DataSet& own)
      : filter_(filter), shared_(shared), own_(own) {}

  // The value of an attribute in a group's only item; empty if the frame has no such group.
  [[nodiscard]] std::string text(const gdcm::Tag& group, const gdcm::Tag& attribute) const {
    for (const gdcm::DataSet* groups : {&own_, shared_}) {
      const Sequence items = groups == nullptr ? Sequence() : sequence_of(*groups, group);
      if (!items || items->GetNumberOfItems() == 0) continue;
      const gdcm::DataSet& item = items->GetItem(1).GetNestedDataSet();
      if (!item.FindDataElement(attribute)) continue;
      const gdcm::DataElement& element = item.GetDataElement(attribute);
      if (element.GetByteValue() == nullptr || element.GetByteValue()->GetLength() > kLongestNumber) continue;
      return trimmed(filter_.ToString(element));
    }
    return {};
  }

 private:
  const gdcm::StringFilter& filter_;
  const gdcm::DataSet* shared_;
  const gdcm::DataSet& own_;
};

DicomHeader frame_of(DicomHeader h, const Groups& groups, int frame) {
  const gdcm::Tag position(0x0020, 0x9113), orientation(0x0020, 0x9116), measures(0x0028, 0x9110),
      transformation(0x0028, 0x9145), content(0x0020, 0x9111);
  h.frame = frame;
  h.position = near(numbers(groups.text(position, gdcm::Tag(0x0020, 0x0032))));
  h.orientation = numbers(groups.text(orientation, gdcm::Tag(0x0020, 0x0037)));
  h.spacing = near(numbers(groups.text(measures, gdcm::Tag(0x0028, 0x0030))));
  h.intercept = numbers(groups.text(transformation, gdcm::Tag(0x0028, 0x1052)));
  h.slope = numbers(groups.text(transformation, gdcm::Tag(0x0028, 0x1053)));
  const std::string unit = groups.text(transformation, gdcm::Tag(0x0028, 0x1054));
  h.is_hu = unit.empty() || unit.starts_with("HU");  // HU_MOD are HU of several energies
  h.acquisition = integer(groups.text(content, gdcm::Tag(0x0020, 0x9156)), h.acquisition);
  h.temporal_position = integer(groups.text(content, gdcm::Tag(0x0020, 0x9128)), h.temporal_position);
  return h;
}

}  // namespace

std::vector<DicomHeader> frames_of(const DicomHeader& h, const gdcm::File& file) {
  const gdcm::DataSet& data = file.GetDataSet();
  const Sequence frames = sequence_of(data, kFrameGroups), shared = sequence_of(data, kSharedGroups);
  if (!frames || h.frames < 1 || h.frames > kMostFrames) return {};
  if (frames->GetNumberOfItems() != static_cast<std::size_t>(h.frames)) return {};
  gdcm::StringFilter filter;
  filter.SetFile(file);
  const gdcm::DataSet* common =
      shared && shared->GetNumberOfItems() > 0 ? &shared->GetItem(1).GetNestedDataSet() : nullptr;
  std::vector<DicomHeader> headers;
  for (int i = 0; i < h.frames; ++i) {
    const auto item = static_cast<std::size_t>(i) + 1;  // the library counts from 1
    headers.push_back(frame_of(h, Groups(filter, common, frames->GetItem(item).GetNestedDataSet()), i));
  }
  return headers;
}

}  // namespace osteon::import
