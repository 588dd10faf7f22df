#include "common/imaging/watershed.hpp"

#include <itkCommand.h>
#include <itkImage.h>
#include <itkMorphologicalWatershedFromMarkersImageFilter.h>

#include <algorithm>
#include <new>

#include "common/core/check.hpp"

namespace osteon::imaging {
namespace {

using Relief = itk::Image<std::uint16_t, 3>;
using Numbers = itk::Image<std::uint8_t, 3>;
using Filter = itk::MorphologicalWatershedFromMarkersImageFilter<Relief, Numbers>;

// Not bone. As a marker on the highest relief, it floods nothing before all bone that others reach has its number.
constexpr std::uint8_t kOutside = kMostMarkers + 1;

// An image of ITK on memory that belongs to somebody else.
template <class Image, class Pixel>
typename Image::Pointer view_of(std::vector<Pixel>& values, const std::array<int, 3>& dims) {
  auto image = Image::New();
  typename Image::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(dims[axis]);
  image->SetRegions(size);
  image->GetPixelContainer()->SetImportPointer(values.data(), values.size(), false);
  return image;
}

tl::unexpected<Error> no_memory() {
  return failure(ErrorCode::exhausted, "this machine has no memory to separate the bones; export a smaller region");
}

Result<void> flood(std::vector<std::uint16_t>& relief, VoxelMask& markers, bool corners, const KeepGoing& keep_going) {
  if (!keep_going(0.0)) return stopped_while("separating the bones");
  auto filter = Filter::New();
  filter->SetInput1(view_of<Relief>(relief, markers.dims));
  filter->SetInput2(view_of<Numbers>(markers.values, markers.dims));
  filter->SetMarkWatershedLine(false);
  filter->SetFullyConnected(corners);
  filter->AddObserver(itk::ProgressEvent(), [&](const itk::EventObject&) {
    if (!keep_going(std::clamp<double>(filter->GetProgress(), 0.0, 1.0))) filter->AbortGenerateDataOn();
  });
  try {
    filter->Update();
  } catch (const itk::ProcessAborted&) {
    return stopped_while("separating the bones");
  } catch (const itk::MemoryAllocationError&) {
    return no_memory();
  } catch (const std::bad_alloc&) {  // of the filter's queue
    return no_memory();
  } catch (const itk::ExceptionObject& fault) {
    return failure(ErrorCode::internal, std::string("ITK cannot separate the bones: ") + fault.GetDescription());
  }
  if (filter->GetAbortGenerateData()) return stopped_while("separating the bones");
  const std::uint8_t* flooded = filter->GetOutput()->GetBufferPointer();
  std::copy(flooded, flooded + markers.values.size(), markers.values.begin());
  return {};
}

}  // namespace

Result<VoxelMask> watershed(const VoxelMask& mask, BoneDepth depth, VoxelMask markers, const KeepGoing& keep_going) {
  OSTEON_CHECK(mask.dims == markers.dims && depth.values.size() == mask.values.size());
  std::vector<std::uint16_t>& relief = depth.values;
  for (std::size_t i = 0; i < mask.values.size(); ++i) {
    relief[i] = mask.values[i] != 0 ? static_cast<std::uint16_t>(kDeepest - relief[i]) : kDeepest;
    if (mask.values[i] == 0) markers.values[i] = kOutside;
  }
  for (const bool corners : {false, true}) {
    if (std::ranges::none_of(markers.values, [](std::uint8_t number) { return number != 0 && number != kOutside; }))
      break;
    const KeepGoing flooding = corners ? part(keep_going, 0.8, 1.0) : part(keep_going, 0.0, 0.8);
    if (auto done = flood(relief, markers, corners, flooding); !done) return tl::unexpected(done.error());
    // What only the outside has reached is still to be flooded.
    bool all = true;
    for (std::size_t i = 0; i < mask.values.size(); ++i)
      if (mask.values[i] != 0 && markers.values[i] == kOutside) {
        markers.values[i] = 0;
        all = false;
      }
    if (all) break;
  }
  for (std::uint8_t& number : markers.values)
    if (number == kOutside) number = 0;
  return markers;
}

}  // namespace osteon::imaging
