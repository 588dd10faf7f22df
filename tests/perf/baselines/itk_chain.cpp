#include "tests/perf/baselines/itk_chain.hpp"

#include <itkBinaryImageToLabelMapFilter.h>
#include <itkBinaryThresholdImageFilter.h>
#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImageRegionConstIterator.h>
#include <itkImageSeriesReader.h>
#include <itkLabelMapMaskImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkResampleImageFilter.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <algorithm>
#include <cmath>

namespace osteon::baselines {
namespace {

using Scan = itk::Image<std::int16_t, 3>;
using Mask = itk::Image<std::uint8_t, 3>;
using Field = itk::Image<float, 3>;
using Labels = itk::LabelMap<itk::LabelObject<itk::SizeValueType, 3>>;

constexpr std::uint8_t kBone = 1;
constexpr std::array<itk::SizeValueType, 3> kBorder{6, 6, 6};

Scan::Pointer read(const std::string& folder) {
  const auto names = itk::GDCMSeriesFileNames::New();
  names->SetDirectory(folder);
  const auto reader = itk::ImageSeriesReader<Scan>::New();
  reader->SetImageIO(itk::GDCMImageIO::New());
  reader->SetFileNames(names->GetInputFileNames());
  reader->Update();
  Scan::Pointer scan = reader->GetOutput();
  scan->DisconnectPipeline();
  return scan;
}

Mask::Pointer at_or_above(const Scan::Pointer& scan, double threshold_hu) {
  const auto filter = itk::BinaryThresholdImageFilter<Scan, Mask>::New();
  filter->SetInput(scan);
  filter->SetLowerThreshold(static_cast<std::int16_t>(std::ceil(threshold_hu)));
  filter->SetInsideValue(kBone);
  filter->SetOutsideValue(0);
  filter->Update();
  Mask::Pointer mask = filter->GetOutput();
  mask->DisconnectPipeline();
  return mask;
}

// The scan around its largest island, with everything else below the threshold.
Scan::Pointer largest_bone(Scan::Pointer scan, double threshold_hu) {
  const auto label = itk::BinaryImageToLabelMapFilter<Mask, Labels>::New();
  label->SetInput(at_or_above(scan, threshold_hu));
  label->SetInputForegroundValue(kBone);
  label->FullyConnectedOn();
  label->GetOutput()->ReleaseDataFlagOn();
  label->Update();
  const auto islands = label->GetOutput()->GetLabelObjects();
  const auto largest = std::max_element(islands.begin(), islands.end(),
                                        [](const auto& a, const auto& b) { return a->Size() < b->Size(); });
  const auto keep = itk::LabelMapMaskImageFilter<Labels, Scan>::New();
  keep->SetInput(label->GetOutput());
  keep->SetFeatureImage(scan);
  keep->SetLabel((*largest)->GetLabel());
  keep->SetBackgroundValue(static_cast<std::int16_t>(std::ceil(threshold_hu) - 1));
  keep->CropOn();
  keep->SetCropBorder({kBorder[0], kBorder[1], kBorder[2]});
  keep->Update();
  Scan::Pointer bone = keep->GetOutput();
  bone->DisconnectPipeline();
  return bone;
}

Scan::Pointer resampled(const Scan::Pointer& scan, double pitch_mm) {
  const auto filter = itk::ResampleImageFilter<Scan, Scan>::New();
  const Scan::RegionType region = scan->GetLargestPossibleRegion();
  Scan::SizeType size;
  Scan::PointType origin;
  scan->TransformIndexToPhysicalPoint(region.GetIndex(), origin);
  for (unsigned axis = 0; axis < 3; ++axis)
    size[axis] = static_cast<itk::SizeValueType>(
        std::ceil(static_cast<double>(region.GetSize(axis)) * scan->GetSpacing()[axis] / pitch_mm));
  filter->SetInput(scan);
  filter->SetSize(size);
  filter->SetOutputOrigin(origin);
  filter->SetOutputDirection(scan->GetDirection());
  filter->SetOutputSpacing(Scan::SpacingType(pitch_mm));
  filter->Update();
  Scan::Pointer samples = filter->GetOutput();
  samples->DisconnectPipeline();
  return samples;
}

Field::Pointer signed_distance(const Scan::Pointer& samples, double threshold_hu) {
  const auto distance = itk::SignedMaurerDistanceMapImageFilter<Mask, Field>::New();
  distance->SetInput(at_or_above(samples, threshold_hu));
  distance->SquaredDistanceOff();
  distance->UseImageSpacingOn();
  distance->Update();
  return distance->GetOutput();
}

}  // namespace

ItkBone itk_chain(const std::string& folder, double threshold_hu) {
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(1);
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(1);
  Scan::Pointer samples = largest_bone(read(folder), threshold_hu);
  ItkBone bone;
  bone.pitch_mm = *std::min_element(samples->GetSpacing().Begin(), samples->GetSpacing().End());
  samples = resampled(samples, bone.pitch_mm);
  const Field::Pointer field = signed_distance(samples, threshold_hu);
  const Field::RegionType region = field->GetLargestPossibleRegion();
  for (unsigned axis = 0; axis < 3; ++axis) bone.dims[axis] = static_cast<int>(region.GetSize(axis));
  std::int64_t inside = 0;
  for (itk::ImageRegionConstIterator<Field> at(field, region); !at.IsAtEnd(); ++at) inside += at.Get() <= 0.0f;
  bone.volume_mm3 = static_cast<double>(inside) * std::pow(bone.pitch_mm, 3);
  return bone;
}

}  // namespace osteon::baselines
