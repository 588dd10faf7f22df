#include "tests/perf/baselines/itk_smoothing.hpp"

#include <itkDiscreteGaussianImageFilter.h>
#include <itkImportImageFilter.h>
#include <itkMedianImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkSmoothingRecursiveGaussianImageFilter.h>

#include <ctime>

namespace osteon::baselines {
namespace {

using Image = itk::Image<std::int16_t, 3>;

// An image of the volume's own memory, with a spacing of 1.
Image::Pointer image_of(const imaging::HuVolume& volume) {
  using Import = itk::ImportImageFilter<std::int16_t, 3>;
  const auto import = Import::New();
  Image::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) size[axis] = static_cast<itk::SizeValueType>(volume.dims[axis]);
  import->SetRegion(Image::RegionType(size));
  // ITK asks for memory that it may change. No filter here changes its input.
  import->SetImportPointer(const_cast<std::int16_t*>(volume.values.data()), volume.count(), false);
  import->Update();
  return import->GetOutput();
}

template <class Filter>
ItkResult run(Filter& filter, const imaging::HuVolume& volume) {
  const Image::Pointer image = image_of(volume);
  filter.SetInput(image);
  const std::clock_t start = std::clock();
  filter.Update();
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const std::int16_t* values = filter.GetOutput()->GetBufferPointer();
  return {{values, values + volume.count()}, seconds};
}

}  // namespace

ItkResult itk_filtered(const imaging::HuVolume& volume, ItkFilter filter, double sigma_voxels) {
  itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(1);
  switch (filter) {
    case ItkFilter::gaussian: {
      const auto gaussian = itk::DiscreteGaussianImageFilter<Image, Image>::New();
      gaussian->SetVariance(sigma_voxels * sigma_voxels);
      gaussian->SetMaximumError(6.4e-5);  // the part of a Gaussian beyond four standard deviations
      gaussian->SetMaximumKernelWidth(1024);
      return run(*gaussian, volume);
    }
    case ItkFilter::recursive_gaussian: {
      const auto gaussian = itk::SmoothingRecursiveGaussianImageFilter<Image, Image>::New();
      gaussian->SetSigma(sigma_voxels);
      return run(*gaussian, volume);
    }
    case ItkFilter::median: {
      const auto median = itk::MedianImageFilter<Image, Image>::New();
      median->SetRadius(1);
      return run(*median, volume);
    }
  }
  return {};
}

}  // namespace osteon::baselines
